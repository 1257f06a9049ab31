"""What every op-amp section has to give: its output's peak voltage and current.

Over a wanted response's orbit on the exact circuit, and over the first ``REST`` drive periods from
discharged capacitors. Voltages and currents are linear functions of state and drive in each mode
(``Reduction.solution``) and continuous across modes, so an extreme is looked for in two steps: on
exact strobes, ``RESOLUTION`` radians of the fastest motion apart, and then, between the strobes
around every peak that comes near the largest, on the cubic through both ends' values and
derivatives, in narrower and narrower brackets. Against strobes 16 times as close the answers of the
paper's case agree to 2e-7 of the peak, corners at a contact included; the bound that is tested is
1e-5 (tests/synthesis/test_output_loads.py). A corner at a stop between two masses was missed by
7e-5. With dampers in the stops currents jump where contact
begins and the voltages of their integrators have a corner there: a peak just there may be missed by
3e-3 of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Index, distinct_indices
from designer.base.errors import InputError
from designer.circuit.design import Design
from designer.circuit.nodal import Solution
from designer.circuit.nominal import circuit_flow, on_circuit
from designer.circuit.reduction import Reduction
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive, Mode, ModeKey
from designer.model.find_responses import ModelResponse

FROM_REST = " from rest"
"""How the name of a run ends that begins at rest."""
REST = 20
"""Drive periods from rest that count, as in ``find_responses.peaks``."""
UNSETTLED = 200
"""Drive periods that stand for an orbit without a period."""
COUNTED = frozenset({OrbitStatus.PERIODIC, OrbitStatus.GRAZING, OrbitStatus.CLIPPED})
"""Statuses of an orbit that n periods show whole."""
RESOLUTION = 0.1
"""Radians of the fastest motion, in any mode that is met, between two strobes."""
LEAST_POINTS, MOST_POINTS = 64, 16384
"""Strobes a drive period: of the first look at the modes, and at most."""
NEAR = 0.02
"""A peak this near to the largest of all runs so far, over the span of its own, is refined too,
since it may be the larger one."""
BRACKET, ROUNDS = 16, 4
"""Parts of a bracket, and how often the best one is divided again."""
WALK = 64
"""Steps that all states take together; what is not settled by then is looked up by itself."""


@dataclass(frozen=True)
class Run:
    """One trajectory that a circuit must be able to follow."""

    name: str
    """Name of the run, such as "1.55" or "1.55 from rest"."""
    drive: Drive
    """The generator's drive, in rad/s and volts."""
    start: Array
    """Capacitor voltages (n,) at drive phase 0."""
    periods: int
    """Drive periods that count."""


@dataclass(frozen=True)
class Load:
    """Extremes of one section's output over all runs."""

    section: str
    low: float
    """Lowest voltage of the output [V]."""
    high: float
    """Highest voltage of the output [V]."""
    current: float
    """Largest size of the current out of it [A]."""
    low_in: str
    """Name of the run with the lowest voltage."""
    high_in: str
    """Name of the run with the highest voltage."""
    current_in: str
    """Name of the run with the largest current."""

    @property
    def peak(self) -> float:
        """Largest magnitude of the output voltage [V]."""
        return max(abs(self.low), abs(self.high))


@dataclass(frozen=True)
class Loads:
    """What the outputs of a circuit have to give, over all runs."""

    sections: tuple[Load, ...]
    """The outputs' loads in the circuit's order; empty where nothing ran."""
    left_out: dict[str, str]
    """Runs without an answer, with the reason."""

    def of(self, section: str) -> Load:
        """The load of one section; KeyError where there is none."""
        return {load.section: load for load in self.sections}[section]


def design_loads(design: Design, reduction: Reduction, responses: Sequence[ModelResponse]) -> Loads:
    """Loads of a design over its wanted responses and their starts from rest.

    reduction : of the board that is asked about, usually ``nominal.nominal_reduction(design)``.
    """
    system = reduction.system()
    drives = [circuit_flow(system, design, r).drive for r in responses]
    orbits = [on_circuit(system, design, r) for r in responses]
    return over(reduction, *runs([r.omega for r in responses], drives, orbits))


def runs(
    omegas: Sequence[float], drives: Sequence[Drive], orbits: Sequence[Orbit]
) -> tuple[list[Run], dict[str, str]]:
    """Each orbit over its least period, each start from rest; and what has no orbit, with why."""
    out, left_out = [], {}
    for number, (omega, drive, orbit) in enumerate(zip(omegas, drives, orbits, strict=True)):
        same = sum(w == omega for w in omegas[:number])
        name = f"{omega:g}" + (f" ({same + 1})" if same else "")
        states = len(orbit.start)
        if not states:
            left_out[name] = orbit.reason or str(orbit.status)
            continue
        periods = orbit.n if orbit.status in COUNTED else UNSETTLED
        out.append(Run(name, drive, orbit.start, periods))
        out.append(Run(f"{name}{FROM_REST}", drive, np.zeros(states), REST))
    return out, left_out


def over(
    reduction: Reduction, wanted: Sequence[Run], left_out: dict[str, str] | None = None
) -> Loads:
    """Loads over these runs; a run that does not come to its end is left out, with the reason."""
    missing = dict(left_out or {})
    best: dict[tuple[str, str], tuple[float, str]] = {}
    for run in wanted:
        try:
            so_far = {key: value for key, (value, _) in best.items()}
            extremes = Sampled(reduction, run).extremes(so_far)
        except ArithmeticError as error:
            missing[run.name] = str(error)
            continue
        for key, value in extremes.items():
            if key not in best or value > best[key][0]:
                best[key] = (value, run.name)
    loads = []
    for name in [s.name for s in reduction.circuit.sections] if best else []:
        (low, low_in), (high, high_in) = best[name, "low"], best[name, "high"]
        current, current_in = max(best[name, "source"], best[name, "sink"])
        loads.append(Load(name, -low, high, current, low_in, high_in, current_in))
    return Loads(tuple(loads), missing)


class Sampled:
    """One run on exact strobes, with the mode at each, and what lies between them.

    resolution : of the strobes, see ``RESOLUTION``.
    """

    def __init__(self, reduction: Reduction, run: Run, resolution: float = RESOLUTION) -> None:
        if run.periods < 1:
            raise InputError(None, "periods", run.periods, "at least 1")
        self.reduction = reduction
        self.system = reduction.system()
        self.run = run
        self.flow = Flow(self.system, run.drive)
        self._known_rows: dict[int, Array] = {}
        points = 0
        needed = LEAST_POINTS
        while needed > points:  # a finer look may meet a mode that a coarse one misses
            points = needed
            self._strobe(points)
            # Modes that hold at a strobe: not those that are only crossed in an instant.
            modes = [self.system.mode(self.keys[int(i)]) for i in distinct_indices(self.at)]
            rates = [float(np.abs(np.linalg.eigvals(mode.A)).max()) for mode in modes]
            fastest = max(self.flow.fastest, *rates)
            needed = min(int(np.ceil(run.drive.period * fastest / resolution)), MOST_POINTS)

    def extremes(self, known: Mapping[tuple[str, str], float]) -> dict[tuple[str, str], float]:
        """The extremes of each section: -lowest and highest voltage, largest current out of and
        into the output.

        known : those of other runs; one that is well inside them is that of the strobes.
        """
        names = [
            (s.name, quantity)
            for s in self.reduction.circuit.sections
            for quantity in ("low", "high", "source", "sink")
        ]
        values = self._outputs()
        which, left, right = _brackets(values, np.array([known.get(n, -np.inf) for n in names]))
        best, row = values.max(axis=0), np.arange(len(which))
        for _ in range(ROUNDS if len(which) else 0):
            time = left[:, None] + (right - left)[:, None] * np.linspace(0.0, 1.0, BRACKET + 1)
            x, angle = self._between(time.ravel())
            at = modes_at(self.flow, x, angle, self.keys)
            own = self._each(x, angle, at, np.repeat(which, BRACKET + 1)).reshape(time.shape)
            np.maximum.at(best, which, own.max(axis=1))
            peak = own.argmax(axis=1)
            left = time[row, np.maximum(peak - 1, 0)]
            right = time[row, np.minimum(peak + 1, BRACKET)]
        return {name: float(value) for name, value in zip(names, best, strict=True)}

    def _outputs(self) -> Array:
        """(k, 4 sections) -voltage, voltage, current and -current of each section's output on the
        strobes."""
        inputs, out = self._inputs(self.x, self.angle), np.zeros(0)
        for i in range(len(self.keys)):
            here = self.at == i
            if here.any():
                rows = self._rows(i)
                out = out if out.size else np.empty((len(inputs), len(rows)))
                out[here] = inputs[here] @ rows.T
        return out

    def _each(self, x: Array, angle: Array, at: Index, which: Index) -> Array:
        """(k,) the outputs of these columns (k,) of ``_outputs`` at states (k, n), drive phases
        (k,) and modes (k,)."""
        inputs, out = self._inputs(x, angle), np.empty(len(x))
        for i in distinct_indices(at):
            here = at == i
            out[here] = np.einsum("ki,ki->k", inputs[here], self._rows(int(i))[which[here]])
        return out

    def _inputs(self, x: Array, angle: Array) -> Array:
        """(k, n + 3) states, generator, 1 and the generator's second channel."""
        drive = self.flow.drive
        return np.column_stack([x, drive.at(angle), np.ones(len(x)), drive.second_at(angle)])

    def _rows(self, mode: int) -> Array:
        """(4 sections, n + 3) what the outputs are by ``_inputs`` in a mode, by its place."""
        known = self._known_rows.get(mode)
        if known is None:
            key = self.keys[mode]
            first = self._output_rows(self.reduction.solution(key))
            second = np.zeros(len(first))
            if self.flow.drive.second is not None:
                second = self._output_rows(self.reduction.by_second(key))[:, -2]
            known = self._known_rows[mode] = np.column_stack([first, second])
        return known

    def _output_rows(self, solved: Solution) -> Array:
        """(4 sections, n + 2) what they are by states, a channel of the generator, and 1."""
        sections = self.reduction.circuit.sections
        pairs = [(solved.voltage[s.output], solved.output[s.name]) for s in sections]
        return np.array([row for v, c in pairs for row in (-1.0 * v, v, c, -1.0 * c)])

    def _strobe(self, points: int) -> None:
        """x (k, n) and drive phases (k,) on strobes, their modes, and derivatives (k, n)."""
        run = self.flow.run(self.run.start, self.run.periods, points=points)
        if run.status is not FlowStatus.DONE:
            raise ArithmeticError(str(run.status))
        self.step = self.flow.drive.period / points
        self.x = run.strobes
        drive = self.flow.drive
        self.angle = self._angle(np.arange(len(self.x), dtype=np.float64))
        self.keys: list[ModeKey] = list(dict.fromkeys([self.system.start, *self.flow.met]))
        self.at = modes_at(self.flow, self.x, self.angle, self.keys)
        self.slope = np.empty_like(self.x)
        u, second_drive = drive.at(self.angle), drive.second_at(self.angle)
        for i, key in enumerate(self.keys):
            here, mode = self.at == i, self.system.mode(key)
            self.slope[here] = self.x[here] @ mode.A.T + np.outer(u[here], mode.B) + mode.d
            if mode.second is not None:
                self.slope[here] += np.outer(second_drive[here], mode.second)

    def _angle(self, steps: Array) -> Array:
        """Drive phases at times given in strobes."""
        return self.flow.drive.omega * self.step * steps

    def _between(self, steps: Array) -> tuple[Array, Array]:
        """x and the drive's phases at times given in strobes, by cubics between them."""
        i = np.clip(steps.astype(int), 0, len(self.x) - 2)
        t = (steps - i)[:, None]
        x0, x1 = self.x[i], self.x[i + 1]
        d0, d1 = self.step * self.slope[i], self.step * self.slope[i + 1]
        cubic = (
            (1 + 2 * t) * (1 - t) ** 2 * x0
            + t * (1 - t) ** 2 * d0
            + t**2 * (3 - 2 * t) * x1
            + t**2 * (t - 1) * d1
        )
        return cubic, self._angle(steps)


def _brackets(values: Array, known: Array) -> tuple[Index, Array, Array]:
    """Where a quantity (columns) may have its largest value: column, left and right strobe.
    known : (columns,) a value that it has elsewhere."""
    top = values.max(axis=0)
    floor = np.maximum(top, known) - NEAR * (top - values.min(axis=0))
    own = np.flatnonzero(top >= floor)
    values, floor = values[:, own], floor[own]
    inner = np.pad(values, ((1, 1), (0, 0)), constant_values=-np.inf)
    local = (values >= inner[:-2]) & (values >= inner[2:]) & (values >= floor)
    # A flat top, such as a limit that is reached, is one candidate, not a thousand.
    local[1:] &= values[1:] > inner[:-2][1:]
    local[np.argmax(values, axis=0), np.arange(len(own))] = True
    at, which = np.nonzero(local)
    last = len(values) - 1
    return own[which], np.maximum(at - 1, 0).astype(float), np.minimum(at + 1, last).astype(float)


def modes_at(flow: Flow, x: Array, angle: Array, keys: list[ModeKey]) -> Index:
    """Index into ``keys``, which grows, of the mode at each state (k, n) and drive phase (k,).

    Where none of the keys that are known holds, the walk of ``PiecewiseLinearSystem.mode_at`` for
    all at once: across the most violated guard until none is violated.

    Raises
    ------
    ArithmeticError : somewhere no mode holds.
    """
    system, drive = flow.system, flow.drive
    u, second_drive = drive.at(angle), drive.second_at(angle)
    at = np.zeros(len(x), dtype=np.intp)
    unsettled = np.arange(len(x))
    for i, key in enumerate(keys):
        mode = system.mode(key)
        if mode.guards and len(unsettled):
            now = _guards(mode, x[unsettled], u[unsettled], second_drive[unsettled])
            holds = (now <= 0.0).all(axis=1)
            at[unsettled[holds]] = i
            unsettled = unsettled[~holds]

    def number(key: ModeKey) -> int:
        if key not in keys:
            keys.append(key)
        return keys.index(key)

    for _ in range(WALK):
        moved = []
        for i in distinct_indices(at[unsettled]):
            here = unsettled[at[unsettled] == i]
            mode = system.mode(keys[int(i)])
            if not mode.guards:
                continue
            value = _guards(mode, x[here], u[here], second_drive[here])
            worst = value.argmax(axis=1)
            leaving = value[np.arange(len(here)), worst] > 0.0
            for g in distinct_indices(worst[leaving]):
                go = here[leaving & (worst == g)]
                at[go] = number(mode.guards[int(g)].target)
                moved.append(go)
        if not moved:
            return at
        unsettled = np.concatenate(moved)
    for i in np.sort(unsettled):  # neighbours in time are mostly in one mode
        near = keys[int(at[i - 1])] if i else None
        at[i] = number(flow.mode_at(x[i], float(angle[i]), near))
    return at


def _guards(mode: Mode, x: Array, u: Array, second_drive: Array) -> Array:
    C, D, e = mode.guard_rows
    rows = np.column_stack([C, D, e, mode.second_guards])
    return np.asarray(np.column_stack([x, u, np.ones(len(x)), second_drive]) @ rows.T)
