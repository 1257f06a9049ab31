"""Where the model shows a response: places over ω and b, from which a search chooses one.

At each clearance of a response's range the attractor is followed over ω, down and up
(``bifurcations.sweep``); neighbouring steps that show the response are a stretch of its window.
What coexists with both followed attractors is not seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import MISSING, InputError
from designer.bifurcations import sweep
from designer.bifurcations.sweep import DOWN, UP, SweepPlan
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import SteadyMotion, TransientSettings
from designer.model import find_responses
from designer.model.mechanics import MechanicalModel
from designer.model.response_table import Response
from designer.model.search_table import SearchSpec
from designer.model.swept_model import ModelSubject

STEP = 0.005
"""The difference in ω between two steps of a sweep."""
CLEARANCE_STEP = 0.06
"""The largest difference in b between two clearances of a range."""
COURSE = TransientSettings(settle=300, keep=10, patience=300)


@dataclass(frozen=True)
class OperatingPoint:
    """Where a response is asked for."""

    omega: float
    """Dimensionless frequency."""
    b: float
    """Dimensionless clearance."""
    start: Array
    """(4,) a strobe of its orbit, in model units."""


@dataclass(frozen=True)
class Stretch:
    """Neighbouring places at one clearance that show one response, by ascending ω."""

    places: tuple[OperatingPoint, ...]

    @property
    def b(self) -> float:
        return self.places[0].b

    @property
    def low(self) -> float:
        return self.places[0].omega

    @property
    def high(self) -> float:
        return self.places[-1].omega

    def at(self, shares: Sequence[float]) -> list[OperatingPoint]:
        """The places nearest to these shares of the way from the lower end to the upper, in the
        order of the shares."""
        last = len(self.places) - 1
        return [self.places[i] for i in dict.fromkeys(round(s * last) for s in shares)]


def open_in(spec: Response) -> bool:
    """Whether a response leaves its place open."""
    return spec.omega is None or isinstance(spec.b, tuple)


def need_periods(wanted: Sequence[Response]) -> None:
    """Refuse what neither a search nor a repair can follow.

    Raises
    ------
    InputError : a response without a period is wanted.
    """
    for number, spec in enumerate(wanted, start=1):
        if spec.expect is not None and not spec.periodic:
            expected = (
                "n-p-q for a search, which follows orbits to where they end; how many boards show "
                f'"{spec.expect}" is what run and tolerance count'
            )
            raise InputError(None, f"response[{number}].expect", str(spec.expect), expected)


def check(wanted: Sequence[Response]) -> None:
    """Refuse what no search can find.

    Raises
    ------
    InputError : a response without a period; ω or b is open and nothing says which response is
        wanted, or a range of b is one value.
    """
    need_periods(wanted)
    for number, spec in enumerate(wanted, start=1):
        if not open_in(spec):
            continue
        if spec.expect is None:
            open_ = '"best"' if spec.omega is None else "b as a range"
            raise InputError(
                None,
                f"response[{number}].expect",
                MISSING,
                f'n-p-q such as "1-2-2": {open_} is chosen in the window of that response',
            )
        if isinstance(spec.b, tuple) and not spec.b[0] < spec.b[1]:
            raise InputError(
                None, f"response[{number}].b", list(spec.b), "a range [low, high] with low < high"
            )


def stretches(
    model: MechanicalModel,
    wanted: Sequence[Response],
    spec: SearchSpec,
    *,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> tuple[tuple[Stretch, ...], ...]:
    """The stretches on which the model shows each response, the widest first.

    progress : called once a clearance.

    Raises
    ------
    InputError : see ``check``; the model does not show a response anywhere in its range.
    """
    check(wanted)
    band = spec.band(model)
    omegas = _grid(band)
    swept: dict[float, list[tuple[SteadyMotion, ...]]] = {}

    def at(b: float) -> list[tuple[SteadyMotion, ...]]:
        if b not in swept:
            subject = ModelSubject(model.at(b))
            plan = SweepPlan(subject, "omega", omegas, tracks=(DOWN, UP), course=COURSE)
            result = sweep.run(plan, jobs)
            swept[b] = [result.steps[DOWN], result.steps[UP]]
            progress()
        return swept[b]

    out = []
    for number, response in enumerate(wanted, start=1):
        windows: list[Stretch] = []
        for b in clearances(model, response):
            if response.omega is None:
                windows += _runs(response, omegas, b, at(b))
            else:
                windows += _single(model, response, response.omega, b)
        if not windows:
            _refuse(number, response, band)
        windows.sort(key=lambda s: (-len(s.places), s.b, s.low))
        out.append(tuple(windows))
    return tuple(out)


def clearances(model: MechanicalModel, response: Response) -> list[float]:
    """The clearances at which a response is looked for, ascending."""
    if not isinstance(response.b, tuple):
        return [model.b if response.b is None else response.b]
    low, high = response.b
    count = max(math.ceil(math.log(high / low) / CLEARANCE_STEP), 1)
    return [float(v) for v in np.geomspace(low, high, count + 1)]


def shows(response: Response, step: SteadyMotion) -> bool:
    """Whether a step of a sweep is the response that is wanted."""
    if step.status is not OrbitStatus.PERIODIC or not step.radius < 1.0:
        return False
    if not response.accepts(step.counts):
        return False
    return response.symmetric is None or step.symmetric is response.symmetric


def _grid(ends: tuple[float, float]) -> Array:
    low, high = ends
    count = max(math.ceil(math.log(high / low) / STEP), 1)
    return np.geomspace(low, high, count + 1)


def _runs(
    response: Response, omegas: Array, b: float, tracks: Sequence[Sequence[SteadyMotion]]
) -> list[Stretch]:
    places: list[OperatingPoint | None] = []
    for i, omega in enumerate(omegas):
        step = next((t[i] for t in tracks if shows(response, t[i])), None)
        places.append(None if step is None else OperatingPoint(float(omega), b, step.start))
    out: list[Stretch] = []
    run: list[OperatingPoint] = []
    for place in [*places, None]:
        if place is not None:
            run.append(place)
        elif run:
            out.append(Stretch(tuple(run)))
            run = []
    return out


def _single(model: MechanicalModel, response: Response, omega: float, b: float) -> list[Stretch]:
    steady = find_responses.find(model, [replace(response, omega=omega, b=b)])[0]
    return [Stretch((OperatingPoint(omega, b, steady.orbit.start),))] if steady.found else []


def _refuse(number: int, response: Response, band: tuple[float, float]) -> None:
    ranged = isinstance(response.b, tuple)
    field = "omega" if response.omega is None else "b" if ranged else "omega"
    value: object = "best" if response.omega is None else response.omega
    if field == "b":
        value = list(response.b) if isinstance(response.b, tuple) else response.b
    region = f"ω from {band[0]:g} to {band[1]:g}" if response.omega is None else "it"
    raise InputError(
        None,
        f"response[{number}].{field}",
        value,
        f"a place at which the model shows {response.expect}: it has no window over {region}"
        + (" and this range of b" if ranged else " at this b")
        + ("; search.omega says where to look" if response.omega is None else ""),
    )
