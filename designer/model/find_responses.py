"""The wanted responses: found on the model, carried over to the circuit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError, ResponseNotFound
from designer.base.progress import doing
from designer.base.si_unit import value_text
from designer.dynamics import harmonics
from designer.dynamics.attractors import settle, starts, twin, with_exponent
from designer.dynamics.coexisting_attractors import coexisting
from designer.dynamics.counts import Counts
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import ANSWERS, WITHOUT_PERIOD, Orbit, OrbitStatus
from designer.laws.force_law import Quantity
from designer.model.clearance import Clearance
from designer.model.driven import model_flow
from designer.model.mechanics import MechanicalModel, SecondOrderSystem, check_omega
from designer.model.model import Dimensionless, SiScales
from designer.model.response_table import Response

STARTS = 16
"""Initial states tried for each response: rest and a Sobol set."""
SCOUT = tuple(float(w) for w in np.linspace(0.2, 1.8, 17))
"""Frequencies over the model's own that set the swing of a model file that names no response."""
LARGEST_START = 1e9
"""Of a state that a motion may be asked to begin at: far past any motion, and no overflow."""
LEAST_SHARE = 0.1
"""Of the widest start of a mass: the least of another, where a law may be all that moves it."""
STILL = 1e-6
"""Of the largest displacement or velocity: a state with a peak below it is taken to be at rest. No
circuit could show it: a part in a million of some volts is far below an op-amp's offset."""
DENSE = 1024
"""Points a drive period at which a displacement between two masses is looked at."""


_A_NUMBER = (
    "a number; the verb search chooses one, and so does what makes a design with "
    'circuit.objective = "yield"'
)


@dataclass(frozen=True)
class ModelResponse:
    """A wanted response and what the model shows there."""

    spec: Response
    """The response as wanted."""
    b: float
    """The clearance it is wanted at."""
    orbit: Orbit
    """The wanted orbit, or the attractor reached from rest where it was not found."""
    others: tuple[Orbit, ...]
    """Coexisting attractors that the search came to."""
    found: bool
    """Whether the orbit is the wanted one; true where no response was wanted."""

    @property
    def omega(self) -> float:
        assert self.spec.omega is not None
        return self.spec.omega

    @property
    def expected(self) -> str | None:
        return None if self.spec.expect is None else str(self.spec.expect)


def find(
    model: MechanicalModel, wanted: Sequence[Response], start: Array | None = None
) -> tuple[ModelResponse, ...]:
    """Find each wanted response on the model with the exact flow.

    start : (states,) the first start that is tried, in the place of rest.

    Raises
    ------
    InputError : a response leaves omega or b open, which only a search can fill.
    """
    out = []
    for number, spec in enumerate(wanted, start=1):
        for key, value in (
            ("omega", "best" if spec.omega is None else None),
            ("b", list(spec.b) if isinstance(spec.b, tuple) else None),
        ):
            if value is not None:
                raise InputError(None, f"response[{number}].{key}", value, _A_NUMBER)
        assert spec.omega is not None
        assert not isinstance(spec.b, tuple)
        check_omega(f"response[{number}].omega", spec.omega, model)
        b = model.b if spec.b is None else spec.b
        if len(wanted) > 1:
            doing(f"response {number} of {len(wanted)} on the model")
        out.append(_find_one(model.at(b), spec, b, start))
    return tuple(out)


def need_found(
    responses: Mapping[int, ModelResponse], si: SiScales | None = None, file: Path | None = None
) -> None:
    """Refuse to go on without a wanted response.

    responses : by number in the file, from 1. si : adds frequencies in Hz. file : is named.

    Raises
    ------
    ResponseNotFound : the model does not show one, or more; says what was found instead.
    """
    lost = {number: r for number, r in responses.items() if not r.found}
    if not lost:
        return
    name = "" if file is None else f"{file}: "
    lines = [f"{name}response[{number}]: {_not_found(r, si)}" for number, r in lost.items()]
    more = (
        "no parts are chosen for what the model does not show; without expect, what it shows is "
        "taken; bifurcation MODEL --up --down shows which responses there are near this frequency"
    )
    rows = [
        {
            "omega": r.omega,
            "expected": r.expected,
            "found": r.found,
            "model": r.orbit.response,
            "circuit": None,
            "ngspice": None,
            "symmetric": r.orbit.symmetric,
            "yield": None,
            "others": [orbit.response for orbit in r.others],
        }
        for r in responses.values()
    ]
    raise ResponseNotFound("\n".join([*lines, more]), {"responses": rows})


def _not_found(response: ModelResponse, si: SiScales | None) -> str:
    """What was wanted, where, and what was found instead."""
    spec = response.spec
    hertz = "" if si is None else f" ({value_text(si.hertz(response.omega), 'Hz')})"
    symmetry = {None: "", True: ", symmetric", False: ", asymmetric"}
    wanted = f"{response.expected or 'a settled motion'}{symmetry[spec.symmetric]}"
    if spec.least_exponent is not None:
        wanted += f", of a largest exponent of {spec.least_exponent:g} at least,"
    seen = dict.fromkeys(
        orbit.response
        + ("" if spec.symmetric is None else symmetry[orbit.symmetric])
        + ("" if spec.least_exponent is None else _exponent_text(orbit))
        for orbit in (response.orbit, *response.others)
    )
    at = f"at omega = {response.omega:.6g}{hertz}"
    return f"{wanted} {at} was found from none of {STARTS} starts; found instead: {'; '.join(seen)}"


def _exponent_text(orbit: Orbit) -> str:
    """Exponent of a motion without a period, in brackets."""
    if orbit.status not in WITHOUT_PERIOD:
        return ""
    return f" (exponent {orbit.lyapunov:.3g} ± {orbit.lyapunov_error:.1g})"


def matches(orbit: Orbit, spec: Response) -> bool:
    """Whether an orbit, in the model's units, is the one wanted; anything that is an answer, where
    nothing is."""
    if orbit.status in WITHOUT_PERIOD and spec.expect is not None:
        enough = spec.has_exponent(orbit.lyapunov, orbit.lyapunov_error)
        return not spec.difference(orbit) and enough is True
    if orbit.status is not OrbitStatus.PERIODIC:
        return spec.expect is None and spec.symmetric is None and orbit.status in ANSWERS
    if spec.symmetric is False and orbit.symmetric is not False:
        return False
    return not spec.difference(orbit)


def peaks(model: MechanicalModel, responses: Sequence[ModelResponse]) -> Peaks:
    """The peaks that the circuit has to hold, over all responses and their starts from rest."""
    runs: list[tuple[MechanicalModel, float, Orbit]] = [
        (model.at(r.b), r.omega, r.orbit) for r in responses
    ]
    if not runs:
        unit = model.second_order().own_frequency
        rest = np.zeros(2 * model.second_order().size)
        runs = [(model, w * unit, settle(model_flow(model, w * unit), rest)) for w in SCOUT]
    clearances = _watched(model.second_order())
    states, fastest = np.zeros(2 * model.second_order().size), 0.0
    reaches = [Reach() for _ in clearances]
    for variant, omega, orbit in runs:
        doing(f"swing at ω = {omega:.4g}")
        flow = model_flow(variant, omega)
        rest = np.zeros(flow.system.size)
        spans = [_Span(flow, rest, flow.run(rest, 20, measure=True).extremes, 20)]
        if orbit.status is OrbitStatus.PERIODIC:
            spans.append(_Span(flow, orbit.start, orbit.extremes, orbit.n))
        elif len(orbit.start):
            extremes = flow.run(orbit.start, 200, measure=True).extremes
            spans.append(_Span(flow, orbit.start, extremes, 200))
        fastest = max(fastest, harmonics.fastest(flow, orbit))
        scale = model.b / variant.b  # the generator's amplitude follows b, the threshold stays
        stops = _watched(variant.second_order())
        for span in spans:
            states = np.maximum(states, scale * np.abs(span.extremes).max(axis=1))
            reaches = [
                reach.widened(stop, scale, *span.within(j, stop))
                for j, (reach, stop) in enumerate(zip(reaches, stops, strict=True))
            ]
    for own in (states[0::2], states[1::2]):
        own[own <= STILL * own.max()] = own.max()
    return Peaks(states, tuple(reaches), fastest)


def _watched(system: SecondOrderSystem) -> tuple[Clearance, ...]:
    """What a circuit would make a stage of; the clearances where none could make all."""
    try:
        return system.dead_zones
    except InputError:
        return system.clearances


def scale_of(model: MechanicalModel, omega: float) -> Array:
    """(states,) size of the states that starts are drawn from: the static deflection and the widest
    gap, or the corner of a law that is furthest from rest."""
    system = model.second_order()
    flexibility = np.linalg.inv(system.spanning_stiffness)
    gaps = [abs(side.gap) for stop in system.clearances for _, side in stop.sides]
    # Without a stop the clearance b of a dimensionless model is a length still; else b is a factor.
    length = model.b if isinstance(model, Dimensionless) else 0.0
    first, *further = system.drive_waves(omega)
    x = np.abs(flexibility @ first.sine) + max(gaps, default=length)
    for wave in (first.cosine, *(w for h in further for w in (h.sine, h.cosine))):
        x = x + np.abs(flexibility @ wave)
    x = x + np.abs(flexibility @ system.constant) + _law_reach(system, "displacement")
    if system.laws:  # a mass that only a law joins is moved by it, and by nothing that is linear
        x = np.maximum(x, LEAST_SHARE * x.max())
    v = x * max(omega, system.own_frequency) + _law_reach(system, "velocity")
    return np.stack([x, v], axis=1).ravel()


def _law_reach(system: SecondOrderSystem, quantity: Quantity) -> Array:
    """(n,) displacement or velocity of each mass, the others at rest, at the furthest corner of a
    law; 0 without one."""
    reach = np.zeros(system.size)
    for law in system.laws:
        if law.quantity == quantity:
            row = np.abs(law.row)
            reach = np.maximum(reach, np.divide(law.reach, row, where=row > 0.0, out=0.0 * row))
    return reach


@dataclass(frozen=True)
class _Span:
    """A stretch of motion from a start at drive phase 0, with the (states, 2) extremes in it."""

    flow: Flow
    start: Array
    extremes: Array
    periods: int

    def within(self, index: int, stop: Clearance) -> tuple[float, float]:
        """Least and largest displacement in a clearance, or velocity in a dead zone of those."""
        system = self.flow.system
        row = np.zeros(system.size + 1)  # over the states and the drive, without the gap
        if stop.bend_of:
            for mass, factor in stop.terms:
                row[stop.state_of(mass)] = factor
        else:
            side, past = next(iter(system.contact_rows(index).items()))
            row = side * past[:-1] / abs(past[stop.watched])
        used = np.flatnonzero(row)
        if len(used) == 1 and used[0] < system.size and row[used[0]] == 1.0:
            return float(self.extremes[used[0], 0]), float(self.extremes[used[0], 1])
        states = self.flow.run(self.start, self.periods, points=DENSE).strobes
        phase = 2.0 * np.pi * np.arange(len(states)) / DENSE
        drive = self.flow.drive.at(phase)
        moves = states @ row[:-1] + row[-1] * drive
        return float(moves.min()), float(moves.max())


def _find_one(
    model: MechanicalModel, spec: Response, b: float, start: Array | None
) -> ModelResponse:
    assert spec.omega is not None
    flow = model_flow(model, spec.omega)
    orbits = coexisting(flow, starts(scale_of(model, spec.omega), STARTS, first=start))
    if spec.least_exponent is not None:
        orbits = [with_exponent(flow, orbit) for orbit in orbits]
    for orbit in orbits:
        for candidate in _with_twin(flow, orbit, spec):
            if matches(candidate, spec):
                return ModelResponse(
                    spec, b, candidate, tuple(o for o in orbits if o is not orbit), True
                )
    return ModelResponse(spec, b, orbits[0], tuple(orbits[1:]), False)


def _with_twin(flow: Flow, orbit: Orbit, spec: Response) -> list[Orbit]:
    """The orbit, and its mirror twin first where that is the one named by ``expect``."""
    expect = spec.expect
    if not isinstance(expect, Counts) or orbit.counts == expect:
        return [orbit]
    if orbit.counts != expect.mirrored:
        return [orbit]
    other = twin(flow, orbit)
    return [orbit] if other is None else [other, orbit]


@dataclass(frozen=True)
class Reach:
    """How far a displacement goes in one clearance, in model units."""

    penetration: float = 0.0
    """The deepest penetration of a stop."""
    excursion: float = 0.0
    """Largest displacement towards a side that has no stop; 0 with stops on both."""
    peak: float = 0.0
    """Largest displacement, either way."""
    sides: tuple[float, float] | None = None
    """The deepest penetration of the upper and of the lower stop; None where only the deeper of
    both is known."""

    def on(self, side: int) -> float:
        """The deepest penetration of the stop on this side, 1 upper or -1 lower."""
        return self.penetration if self.sides is None else self.sides[side < 0]

    def widened(self, stop: Clearance, scale: float, low: float, high: float) -> Reach:
        """With a motion from ``low`` to ``high`` too, in units of which ``scale`` counts."""
        excursion, sides = self.excursion, dict(stop.sides)
        depths = {1: self.on(1), -1: self.on(-1)}
        for side, reach in ((1, high), (-1, -low)):
            if side in sides:
                depths[side] = max(depths[side], scale * float(reach - sides[side].gap))
            else:
                excursion = max(excursion, scale * float(reach))
        peak = max(self.peak, scale * high, -scale * low)
        return Reach(max(depths.values()), excursion, peak, (depths[1], depths[-1]))


@dataclass(frozen=True)
class Peaks:
    """What the circuit has to hold, in model units."""

    states: Array
    """(states,) peaks of x1, x1', x2, … over all wanted responses and the starts from rest. A state
    within `STILL` of rest has no size to be scaled by: it is assumed to move as far as the one that
    moves most, so ``level`` and ``swing`` hold of it by assumption."""
    reaches: tuple[Reach, ...] = ()
    """How far the displacement in each clearance goes."""
    fastest: float = 0.0
    """Angular frequency of the highest harmonic that matters in the velocities
    (``harmonics.fastest``)."""

    def reach(self, index: int) -> Reach:
        """How far the displacement in the clearance with this index goes."""
        return self.reaches[index] if index < len(self.reaches) else Reach()

    @property
    def penetration(self) -> float:
        """The deepest penetration of any stop."""
        return max((reach.penetration for reach in self.reaches), default=0.0)

    @property
    def excursion(self) -> float:
        """Largest displacement towards a side that has no stop."""
        return max((reach.excursion for reach in self.reaches), default=0.0)
