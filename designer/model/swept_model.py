"""A model whose parameters or drive frequency a sweep changes.

Its tables of the modal fast path (``dynamics.modal_tables``) are made in batches: the model or the
drive changes at every point, and one set-up would cost as much as a thousand drive periods.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.schema import one_of
from designer.base.si_unit import Unit
from designer.bifurcations.flow_family import Family, FlowPlane
from designer.bifurcations.subject import ShownStop
from designer.dynamics import modal_tables
from designer.dynamics.flow import Flow
from designer.dynamics.modal_tables import WORST_RESONANCE, Oscillators
from designer.dynamics.steady_state import UPPER, DrivenSystem
from designer.kernels import kernel_modal as kernel
from designer.kernels.kernel_crossing import BLOCK_STEP, LAST, NODES, PARTS, TERMS
from designer.kernels.kernel_modal import ModalTables
from designer.model.clearance import POSITIONS
from designer.model.driven import model_flow
from designer.model.find_responses import scale_of
from designer.model.mechanics import MechanicalModel, check_omega, frequency_range, state_names
from designer.model.model import Dimensionless, SiScales
from designer.model.relative_motion import relative_motions, shown_stops, state_labels
from designer.model.si_units import in_si, units_of


class ModalBatch:
    """Makes tables; keeps the oscillators of the matrices it has met."""

    def __init__(self) -> None:
        self._known: dict[bytes, Oscillators | None] = {}

    def tables(
        self, given: Sequence[MechanicalModel], omegas: Sequence[float]
    ) -> list[ModalTables | None]:
        """For each model under its drive frequency; None where the fast path does not fit."""
        out: list[ModalTables | None] = [None] * len(given)
        models = [model for model in given if isinstance(model, Dimensionless)]
        if len(models) < len(given):
            return out
        systems = [m.second_order() for m in models]
        open_ = [s.state_matrix() for s in systems]
        touched = [A.copy() for A in open_]
        for A, system, model in zip(touched, systems, models, strict=True):
            A[1, 0] -= model.mu / system.mass[0]
        pairs = [
            (self._oscillators(a), self._oscillators(c))
            for a, c in zip(open_, touched, strict=True)
        ]
        fit = [i for i, m in enumerate(models) if m.k0 > 0.0 and None not in pairs[i]]
        if not fit:
            return out
        w = np.array([omegas[i] for i in fit])
        B = np.zeros((len(fit), 4))
        for row, i in enumerate(fit):
            B[row, 1::2] = systems[i].force / systems[i].mass
        push = np.array([models[i].mu * models[i].b / systems[i].mass[0] for i in fit])
        both = []
        for place, matrices in enumerate((open_, touched)):
            A = np.array([matrices[i] for i in fit])
            both.append(_Forced(A, B, w, [pairs[i][place] for i in fit]))
        data = np.zeros((len(fit), 3, kernel.WIDTH))
        d = np.zeros((len(fit), 3, 4))
        d[:, 1, 1], d[:, 2, 1] = push, -push
        b = np.array([models[i].b for i in fit])
        limits = np.empty((len(fit), 3, 2))
        limits[:, 0] = [-np.inf, np.inf]
        limits[:, 1] = np.stack([b, np.full_like(b, np.inf)], axis=1)
        limits[:, 2] = np.stack([np.full_like(b, -np.inf), -b], axis=1)
        for row, i in enumerate(fit):
            for side in POSITIONS[models[i].sides]:
                limits[row, 0, 1 if side > 0 else 0] = side * b[row]
        good = both[0].fine & both[1].fine
        to_modal, to_state = [], []
        both[0].write(data[:, 0])
        both[1].write(data[:, 1])
        data[:, 2] = data[:, 1]
        data[:, :, kernel.LIMIT : kernel.LIMIT + 2] = limits
        for m, forced in enumerate((both[0], both[1], both[1])):
            K = forced.constant(d[:, m])
            data[:, m, kernel.CENTRE] = K[:, 0]
            wave = np.stack([forced.P, forced.Q, K], axis=2)
            to_state.append(np.concatenate([forced.back, wave], axis=2))
            to_modal.append(np.concatenate([forced.G, -forced.G @ wave], axis=2))
        for m in range(3):
            _put(data[:, m], kernel.MODAL, to_modal[m])
            _put(data[:, m], kernel.STATE, to_state[m])
            for n in range(3):
                if m != n:
                    change = to_modal[n][:, :, :4] @ to_state[m]
                    change[:, :, 4:] += to_modal[n][:, :, 4:]
                    _put(data[:, m], kernel.CHANGE + 28 * n, change)
        for row, i in enumerate(fit):
            if good[row]:
                out[i] = ModalTables(data[row].ravel())
        return out

    def _oscillators(self, A: Array) -> Oscillators | None:
        key = A.tobytes()
        if key not in self._known:
            self._known[key] = modal_tables.oscillators_of(A)
        return self._known[key]


class _Forced:
    """One kind of mode of N systems: free oscillators and forced motion."""

    def __init__(self, A: Array, B: Array, w: Array, parts: Sequence[Oscillators | None]) -> None:
        known = [p for p in parts if p is not None]
        assert len(known) == len(A)
        self.A, self.w = A, w
        self.G = np.array([p.G for p in known])
        self.back = np.array([p.back for p in known])
        self.factors = np.array([p.factors for p in known])
        self.rate = np.array([p.rate for p in known])
        M = A @ A + (w * w)[:, None, None] * np.eye(4)
        _, first, which = np.unique(
            A.reshape(len(A), -1), axis=0, return_index=True, return_inverse=True
        )
        worst = np.maximum(np.linalg.cond(M), np.linalg.cond(A[first])[which])
        self.fine = worst <= WORST_RESONANCE
        M[~self.fine] = np.eye(4)  # its tables are not used
        self.Q = np.linalg.solve(M, (-w[:, None] * B)[:, :, None])[:, :, 0]
        self.P = np.einsum("nij,nj->ni", A, self.Q) / w[:, None]

    def constant(self, d: Array) -> Array:
        """(N, 4) the state at rest under the constant terms d (N, 4)."""
        return np.asarray(np.linalg.solve(self.A, -d[:, :, None])[:, :, 0])

    def write(self, data: Array) -> None:
        """Columns of one mode, data (N, WIDTH), but for the limits and the centre;
        ``modal_tables._fill`` says what they are."""
        w, count = self.w, len(self.w)
        M = np.zeros((count, 6, 6))
        M[:, 4, 5], M[:, 5, 4] = w, -w
        for k in range(2):
            p, q = self.factors[:, k].T
            M[:, 2 * k, 2 * k + 1] = 1.0
            M[:, 2 * k + 1, 2 * k], M[:, 2 * k + 1, 2 * k + 1] = -q, -p
        h = BLOCK_STEP / np.maximum(self.rate, w)
        part = h / PARTS
        powers = [np.broadcast_to(np.eye(6), M.shape)]
        for _ in range(TERMS - 1):
            powers.append(powers[-1] @ M)
        series = np.stack(powers, axis=1) / np.cumprod([1.0, *range(1, TERMS)])[:, None, None]
        times = np.arange(LAST + 1) * part[:, None]
        jump = np.zeros((count, LAST + 1, 6, 6))
        for k in range(2):
            own = slice(2 * k, 2 * k + 2)
            jump[:, :, own, own] = _closed(self.factors[:, k], times)
        sin, cos = np.sin(w[:, None] * times), np.cos(w[:, None] * times)
        jump[:, :, 4, 4], jump[:, :, 4, 5] = cos, sin
        jump[:, :, 5, 4], jump[:, :, 5, 5] = -sin, cos
        row = np.concatenate([self.back[:, 0], self.P[:, :1], self.Q[:, :1]], axis=1)
        rate = (row[:, None] @ M)[:, 0]
        scan = np.stack([row, rate], axis=1)[:, None] @ jump[:, ::PARTS]
        assert scan.shape == (count, NODES, 2, 6)
        near = np.zeros((count, TERMS, 8))
        near[:, :, :6] = series[:, :, [1, 0, 3, 2, 4, 5], [1, 1, 3, 3, 5, 5]]
        for first, values in (
            (kernel.STEP, np.stack([h, part, 1.0 / part], axis=1)),
            (kernel.REST, h[:, None] ** 4 / 288.0),
            (kernel.QUAD, self.factors),
            (kernel.BOUND, self._fourth(row, powers)),
            (kernel.SCAN, scan.transpose(0, 3, 2, 1)),
            (kernel.LOCAL, (row[:, None, None] @ series)[:, :, 0].swapaxes(1, 2)),
            (kernel.NEAR, near),
        ):
            flat = values.reshape(count, -1)
            data[:, first : first + flat.shape[1]] = flat
        table = np.concatenate(
            [
                jump[:, :, 0:2, 0:2].reshape(count, -1, 4),
                jump[:, :, 2:4, 2:4].reshape(count, -1, 4),
                jump[:, :, 4, 5:3:-1],
            ],
            axis=2,
        )
        data[:, kernel.JUMP : kernel.JUMP + 10 * (LAST + 1)] = table.reshape(count, -1)

    def _fourth(self, row: Array, powers: list[Array]) -> Array:
        """(N, 9) as ``modal_tables._fourth``."""
        fourth, fifth = (row[:, None] @ powers[4])[:, 0], (row[:, None] @ powers[5])[:, 0]
        out = np.empty((len(row), 9))
        for k in range(2):
            own = slice(2 * k, 2 * k + 2)
            p, q = self.factors[:, k].T
            D = q - 0.25 * p * p
            w = np.sqrt(np.abs(D))
            slowest = 0.5 * p - np.where(D < 0.0, w, 0.0)
            with np.errstate(divide="ignore"):
                fade = np.where(slowest > 0.0, np.exp(-1.0) / slowest, np.inf)
            reach = np.minimum(1.0 / w, fade)
            out[:, 4 * k : 4 * k + 2] = fourth[:, own]
            out[:, 4 * k + 2 : 4 * k + 4] = reach[:, None] * (
                fifth[:, own] + 0.5 * p[:, None] * fourth[:, own]
            )
        out[:, 8] = np.hypot(fourth[:, 4], fourth[:, 5])
        return out


def _closed(factors: Array, t: Array) -> Array:
    """(N, k, 2, 2) as ``modal_tables._closed``, for factors (N, 2) over times t (N, k)."""
    p, q = factors[:, 0], factors[:, 1]
    sigma, D = 0.5 * p[:, None], (q - 0.25 * p * p)[:, None]
    w = np.sqrt(np.abs(D))
    fade = np.exp(-sigma * t)
    slow, fast = np.exp((np.where(D < 0.0, w, 0.0) - sigma) * t), np.exp(-(w + sigma) * t)
    turning = D > 0.0
    c = np.where(turning, fade * np.cos(w * t), 0.5 * (slow + fast))
    s = np.where(turning, fade * np.sin(w * t), 0.5 * (slow - fast)) / w
    rows = [[c + sigma * s, s], [-q[:, None] * s, c - sigma * s]]
    return np.moveaxis(np.array(rows), (0, 1), (2, 3))


def _put(data: Array, first: int, matrices: Array) -> None:
    """Write (N, rows, columns) by columns."""
    columns = matrices.swapaxes(1, 2).reshape(len(matrices), -1)
    data[:, first : first + columns.shape[1]] = columns


@dataclass
class ModelSubject:
    """A model at one drive frequency, whose parameters can be swept."""

    name: ClassVar[str] = "model"
    model: MechanicalModel
    omega: float | None = None
    """Drive frequency in the model's units; None: it has to be among the changes."""
    _batch: ModalBatch = field(default_factory=ModalBatch, repr=False)
    scales: SiScales | None = None
    """SI values of the model's units; None where they are not known."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of what can be swept."""
        return ("omega", *self.model.parameters)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return state_names(self.model.second_order().size)

    @property
    def weights(self) -> Array:
        """(states,) the first mass's own frequency for a displacement, 1 for a velocity."""
        system = self.model.second_order()
        return np.tile([system.own_frequency, 1.0], system.size)

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of plain numbers by parameter, and by "λ" for the axis of a diagram, whose lengths
        and speeds are shown as ``si`` says; none where they are no SI values."""
        if not in_si(self.scales, self.model):
            return {}
        return {"omega": "rad/s", **self.model.units, "λ": "1/s"}

    @property
    def labels(self) -> Mapping[str, str]:
        """Those of a model whose masses have names."""
        system = self.model.second_order()
        if not system.names:
            return {}
        return {
            **dict(zip(self.states, state_labels(system), strict=True)),
            "displacement": relative_motions(system)[0].label,
        }

    @property
    def stops(self) -> tuple[ShownStop, ...]:
        """Those of ``shown_stops``, by their clearance's name where the masses have names."""
        system = self.model.second_order()
        motions, shown = relative_motions(system), shown_stops(system)
        if not system.names:
            names = {1: "the upper stop (A1)", -1: "the lower stop (A2)"}
            return tuple(ShownStop(k, side, names[side], "x₁′") for k, side in shown or UPPER)
        if not shown:
            return (ShownStop(0, 1, "a stop", motions[0].rate),)
        words = {1: "upper", -1: "lower"}
        return tuple(
            ShownStop(
                k,
                side,
                f"the {words[side]} stop of {system.clearances[k].name}",
                motions[k].rate,
            )
            for k, side in shown
        )

    @property
    def si(self) -> dict[str, Unit]:
        """SI units of the quantities that are shown in one beside their plain numbers, by name."""
        return units_of(self.scales, self.model)

    def check(self, option: str, name: str, value: float) -> None:
        """InputError that names the option, unless the parameter may have this value."""
        if name not in self.parameters:
            raise InputError(None, option, name, one_of(name, self.parameters))
        if name == "omega":
            check_omega(option, value, self.model)
            return
        try:
            self.model.changed({name: value})
        except InputError as error:
            expected = f"{name}: {error.expected}"
            if not math.isfinite(value):
                expected = f"{name}: a finite number"
            elif isinstance(error.found, float) and error.found != value:  # that of another key
                beside = f"{error.field} = {error.found:g}, which is to be {error.expected}"
                expected = f"another {name}: it stands beside {beside}"
            raise InputError(None, option, value, expected) from None

    def settings(self, changes: Sequence[Mapping[str, float]]) -> list[DrivenSystem]:
        """One for each set of changes, the others as they stand."""
        models, omegas = [], []
        for change in changes:
            models.append(_changed(self.model, change))
            omega = change.get("omega", self.omega)
            assert omega is not None
            omegas.append(float(omega))
        tables = self._batch.tables(models, omegas)
        stops = tuple((stop.clearance, stop.side) for stop in self.stops)
        return [
            DrivenSystem(lambda m=m, w=w: model_flow(m, w), 2.0 * np.pi / w, t, stops)  # type: ignore[misc]
            for m, w, t in zip(models, omegas, tables, strict=True)
        ]

    def scale(self, changes: Sequence[Mapping[str, float]]) -> Array:
        """(states,) size of the states that starts are drawn from: one for all changes."""
        out = np.zeros(len(self.states))
        for change in changes:
            omega = change.get("omega", self.omega)
            assert omega is not None
            out = np.maximum(out, scale_of(_changed(self.model, change), omega))
        return out

    def drawn(self, change: Mapping[str, float]) -> tuple[MechanicalModel, Array]:
        """The model with these changes, and (states,) units of its flow's states: its own."""
        return _changed(self.model, change), np.ones(len(self.states))

    def family(self, parameter: str) -> Family:
        """One flow for each value of a parameter, the others as they stand."""
        return of_model(self.model, 1.0 if self.omega is None else self.omega, parameter)

    def plane(self, first: str, second: str) -> FlowPlane:
        """One flow for each pair of values of two parameters, the others as they stand."""

        def build(a: float, b: float) -> Flow:
            change = {first: a, second: b}
            omega = change.get("omega", self.omega)
            assert omega is not None
            return model_flow(_changed(self.model, change), omega, fast=False)

        def side(name: str) -> Family:
            # Where one may be depends on the other: what stands in the file bounds neither.
            family = self.family(name)
            return family if name == "omega" else replace(family, low=-np.inf, high=np.inf)

        return FlowPlane(side(first), side(second), build)

    def fixed(self, swept: Mapping[str, float | None]) -> dict[str, float | None]:
        """ω and the model's parameters, in the order in which a model file has them; those
        that a title leaves out are there where they are swept."""
        model, ordered = self.model, dict.fromkeys([*self.model.as_dict(), *self.model.parameters])
        left_out = model.idle - swept.keys()
        names = [name for name in ordered if name in model.parameters and name not in left_out]
        return {"omega": self.omega, **{name: model.parameter(name) for name in names}}

    def remarks(self) -> tuple[str, ...]:
        """Which stop there is, where there is one only."""
        stops = self.model.second_order().clearances
        if len(stops) != 1 or len(stops[0].sides) != 1:
            return ()
        return ("upper stop only" if stops[0].upper is not None else "lower stop only",)

    def as_dict(self) -> dict[str, object]:
        """What decides the flow, for hashes and provenance."""
        return {"model": self.model.as_dict(), "omega": self.omega}


def _changed(model: MechanicalModel, change: Mapping[str, float]) -> MechanicalModel:
    return model.changed({name: value for name, value in change.items() if name != "omega"})


def of_model(model: MechanicalModel, omega: float, parameter: str) -> Family:
    """The model at drive frequency omega, with one of its parameters, or omega, free.

    Raises
    ------
    InputError : the parameter is not one of them.
    """
    ranges = {"omega": frequency_range(model), **model.parameters}
    if parameter not in ranges:
        raise InputError(None, "over", parameter, f"one of {', '.join(ranges)}")

    def build(value: float) -> Flow:
        if parameter == "omega":
            return model_flow(model, value, fast=False)
        return model_flow(model.changed({parameter: value}), omega, fast=False)

    return Family(parameter, *ranges[parameter], build)
