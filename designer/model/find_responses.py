"""The wanted responses: found on the model, carried over to the circuit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.progress import doing
from designer.dynamics import harmonics
from designer.dynamics.attractors import coexisting, settle, starts, twin
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import ANSWERS, Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.mechanics import POSITIONS
from designer.model.model import Dimensionless
from designer.model.response_table import Response

SLOWEST, FASTEST = 1e-3, 1e3
"""Dimensionless drive frequencies: slower, one period has too many steps to wait for."""
STARTS = 16
"""Initial states tried for each response: rest and a Sobol set."""
SCOUT = tuple(float(w) for w in np.linspace(0.2, 1.8, 17))
"""Frequencies that set the swing of a model file that names no response."""


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
    """Coexisting attractors that were met."""
    found: bool
    """Whether it is what was wanted (always, where nothing was)."""

    @property
    def omega(self) -> float:
        assert self.spec.omega is not None
        return self.spec.omega

    @property
    def expected(self) -> str | None:
        return None if self.spec.expect is None else str(self.spec.expect)


def find(model: Dimensionless, wanted: Sequence[Response]) -> tuple[ModelResponse, ...]:
    """Find each wanted response on the model with the exact flow.

    Raises
    ------
    InputError : a response leaves omega or b open, which only a search can fill.
    """
    out = []
    for number, spec in enumerate(wanted, start=1):
        for key, found in (
            ("omega", "best" if spec.omega is None else None),
            ("b", list(spec.b) if isinstance(spec.b, tuple) else None),
        ):
            if found is not None:
                raise InputError(None, f"response[{number}].{key}", found, _A_NUMBER)
        assert spec.omega is not None
        assert not isinstance(spec.b, tuple)
        check_omega(f"response[{number}].omega", spec.omega)
        b = model.b if spec.b is None else spec.b
        if len(wanted) > 1:
            doing(f"response {number} of {len(wanted)} on the model")
        out.append(_find_one(replace(model, b=b), spec, b))
    return tuple(out)


def check_omega(name: str, omega: float, file: str | None = None) -> None:
    """Raises InputError for a frequency outside ``SLOWEST`` to ``FASTEST``."""
    if not SLOWEST <= omega <= FASTEST:
        raise InputError(file, name, omega, f"a number from {SLOWEST:g} to {FASTEST:g}")


def matches(orbit: Orbit, spec: Response) -> bool:
    """Whether an orbit is the one wanted; anything that is an answer, where nothing is."""
    if orbit.status is not OrbitStatus.PERIODIC:
        return spec.expect is None and spec.symmetric is None and orbit.status in ANSWERS
    if spec.symmetric is False and orbit.symmetric is not False:
        return False
    return not spec.difference(orbit)


def peaks(model: Dimensionless, found: Sequence[ModelResponse]) -> Peaks:
    """Largest states, deepest penetration over all responses and their starts from rest, and the
    highest harmonic of the responses."""
    runs: list[tuple[Dimensionless, float, Orbit]] = [
        (replace(model, b=r.b), r.omega, r.orbit) for r in found
    ]
    if not runs:
        system = model.second_order().piecewise_linear()
        rest = np.zeros(system.size)
        runs = [(model, w, settle(Flow(system, Drive(w)), rest)) for w in SCOUT]
    stopped = POSITIONS[model.sides]
    states, depth, excursion, fastest = np.zeros(4), 0.0, 0.0, 0.0
    for variant, omega, orbit in runs:
        doing(f"swing at ω = {omega:.4g}")
        system = variant.second_order().piecewise_linear()
        flow = Flow(system, Drive(omega))
        spans = [flow.run(np.zeros(system.size), 20, measure=True).extremes]
        if orbit.status is OrbitStatus.PERIODIC:
            spans.append(orbit.extremes)
        elif len(orbit.start):
            spans.append(flow.run(orbit.start, 200, measure=True).extremes)
        fastest = max(fastest, harmonics.fastest(flow, orbit))
        scale = model.b / variant.b  # the generator's amplitude follows b, the threshold stays
        for span in spans:
            states = np.maximum(states, scale * np.abs(span).max(axis=1))
            for side, reach in ((1, span[0, 1]), (-1, -span[0, 0])):
                if side in stopped:
                    depth = max(depth, scale * float(reach - variant.b))
                else:
                    excursion = max(excursion, scale * float(reach))
    return Peaks(states, depth, excursion, fastest)


def scale_of(model: Dimensionless, omega: float) -> Array:
    """(states,) size of the states that starts are drawn from: a few static deflections."""
    system = model.second_order()
    stiffness = np.linalg.inv(system.stiffness)
    x = np.abs(stiffness @ system.force) + model.b
    return np.stack([x, x * max(omega, 1.0)], axis=1).ravel()


def _find_one(model: Dimensionless, spec: Response, b: float) -> ModelResponse:
    assert spec.omega is not None
    flow = Flow(model.second_order().piecewise_linear(), Drive(spec.omega))
    met = coexisting(flow, starts(scale_of(model, spec.omega), STARTS))
    for orbit in met:
        for candidate in _with_twin(flow, orbit, spec):
            if matches(candidate, spec):
                return ModelResponse(
                    spec, b, candidate, tuple(o for o in met if o is not orbit), True
                )
    return ModelResponse(spec, b, met[0], tuple(met[1:]), False)


def _with_twin(flow: Flow, orbit: Orbit, spec: Response) -> list[Orbit]:
    """The orbit, and its mirror twin first where that is the one named by ``expect``."""
    expect = spec.expect
    if expect is None or orbit.counts == expect or orbit.counts != expect.mirrored:
        return [orbit]
    other = twin(flow, orbit)
    return [orbit] if other is None else [other, orbit]


@dataclass(frozen=True)
class Peaks:
    """What the circuit has to hold, in model units."""

    states: Array
    """(4,) peaks of x1, x1', x2, x2' over all wanted responses and the starts from rest."""
    penetration: float
    """The deepest penetration of a stop."""
    excursion: float = 0.0
    """Largest |x1| on the side that has no stop; 0 with stops on both."""
    fastest: float = 0.0
    """Angular frequency of the highest harmonic that matters in the velocities
    (``harmonics.fastest``)."""
