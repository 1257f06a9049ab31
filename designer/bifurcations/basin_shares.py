"""Basins that are counted: the share of random starts that end on each attractor, along a sweep.

The starts (initial states, and phases of the drive at which they begin) are the same at every
value. A start is followed until it lies on an attractor that is known at that value; what is new is
named as a step of a sweep is. An attractor keeps its number from value to value where Newton's
method leads from its orbit at one value to a stable orbit of the same period at the next, also
where no start ends on it there; else where one of the same name lies at both values, the nearest
first. Motions that are not periodic are one attractor for each status.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from designer.base.arrays import Array
from designer.base.proportion import wilson
from designer.base.threads import parallel
from designer.bifurcations.attractor_list import AttractorList, MetAttractor
from designer.bifurcations.block_store import KeptBlocks
from designer.bifurcations.flow_family import Family
from designer.bifurcations.parameter_map import COURSE
from designer.bifurcations.subject import Subject
from designer.dynamics.attractors import describe, shoot
from designer.dynamics.coexisting_attractors import outlived
from designer.dynamics.counts import Pairs
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import MOST_COUNTED, Motion, Orbit, OrbitStatus
from designer.dynamics.steady_state import UPPER, DrivenSystem, TransientSettings, stopped
from designer.kernels.kernel_orbit import CHAOS
from designer.kernels.kernel_sweep import ALIGN, SPAN

if TYPE_CHECKING:
    from designer.answers.bifurcation_answer import SharePlanKeys, SharesRow, ShareStep

BLOCK = 16
"""Values of a block."""
LOOKS = (40, 80, 160)
"""Drive periods between two comparisons of a start with the attractors that are known."""
LEAP = 0.1
"""Of the largest state: where an orbit moves farther from one value to the next, the way is
halved."""
HALVINGS = 4
"""How often."""


@dataclass(frozen=True)
class SharePlan:
    """Starts that are followed at each value of a sweep."""

    subject: Subject
    """The system whose parameter changes."""
    parameter: str
    """Name of the parameter that changes."""
    values: Array
    """(N,) values of the parameter, ascending."""
    box: Array
    """(states, 2) least and greatest value of each state that a start is drawn from."""
    numbers: Array
    """(K, states + 1) numbers in [0, 1): where each start lies in the box, and its drive phase in
    periods."""
    seed: int
    """Seed that the numbers were drawn with."""
    course: TransientSettings = COURSE
    """Periods of a run to an attractor that is not known."""

    @property
    def starts(self) -> Array:
        """(K, states) initial states."""
        low, high = self.box.T
        return np.asarray(low + self.numbers[:, :-1] * (high - low))

    @property
    def phases(self) -> Array:
        """(K,) phases of the drive at the start [rad]."""
        return np.asarray(2.0 * np.pi * self.numbers[:, -1])

    def blocks(self) -> list[Array]:
        """The values, cut into blocks."""
        return [self.values[k : k + BLOCK] for k in range(0, len(self.values), BLOCK)]

    def as_dict(self) -> SharePlanKeys:
        """What decides the result, beside the sweep."""
        box = dict(zip(self.subject.states, self.box.tolist(), strict=True))
        course = dict(self.course.__dict__)
        return {"starts": len(self.numbers), "seed": self.seed, "box": box, "periods": course}


@dataclass(frozen=True)
class AttractorShare(Motion):
    """An attractor at one value, and how many starts end on it."""

    attractor: int
    """Number of the attractor, the same at every value; from 0."""
    status: OrbitStatus
    n: int
    p: int
    q: int
    symmetric: bool | None
    """Whether the motion is its own mirror image; None unless periodic."""
    twin: int | None
    """Number of the attractor that is its mirror image, where one was met."""
    count: int
    """Starts that end on it; 0 where it is known from neighbouring values alone."""
    strobes: tuple[tuple[float, ...], ...]
    """States at drive phase 0 in order; of what is not periodic the one where it was left."""
    more: Pairs = ()


Step = tuple[AttractorShare, ...]
"""The attractors at one value, by number."""


@dataclass(frozen=True)
class BasinShares:
    """Which share of the starts ends where, along a sweep."""

    plan: SharePlan
    """What was asked for."""
    steps: tuple[Step, ...]
    """The attractors at each value, in the order of ``plan.values``."""

    @property
    def attractors(self) -> dict[int, list[tuple[float, AttractorShare]]]:
        """By number: the values at which an attractor was met, and what it is there."""
        out: dict[int, list[tuple[float, AttractorShare]]] = {}
        for value, step in zip(self.plan.values.tolist(), self.steps, strict=True):
            for share in step:
                out.setdefault(share.attractor, []).append((value, share))
        return dict(sorted(out.items()))

    def as_dict(self) -> SharesRow:
        """Plain data by the keys of the contract."""
        return {
            **self.plan.as_dict(),
            "phase": "even over a drive period",
            "attractors": [
                {"number": number, "steps": [self._row(value, s) for value, s in met]}
                for number, met in self.attractors.items()
            ],
        }

    def interval(self, count: int) -> tuple[float, float]:
        """Limits of a share, at 95 % (Wilson)."""
        return wilson(count, len(self.plan.numbers))

    def _row(self, value: float, share: AttractorShare) -> ShareStep:
        low, high = self.interval(share.count)
        return {
            "value": value,
            "response": share.response,
            "symmetric": share.symmetric,
            "twin": share.twin,
            "count": share.count,
            "share": share.count / len(self.plan.numbers),
            "low": low,
            "high": high,
        }


def run(
    plan: SharePlan,
    jobs: int = 1,
    store: KeptBlocks[list[Step]] | None = None,
    progress: Callable[[], None] = lambda: None,
) -> BasinShares:
    """Count the starts, or what of them ``store`` has not; ``progress`` is called once a value."""
    blocks = plan.blocks()
    known = [None if store is None else store.read(k) for k in range(len(blocks))]
    known = [
        steps if steps is not None and _may_be(steps, plan, block) else None
        for block, steps in zip(blocks, known, strict=True)
    ]
    open_ = [v for block, steps in zip(blocks, known, strict=True) if steps is None for v in block]
    settings = plan.subject.settings([{plan.parameter: float(v)} for v in open_])

    def arrivals(setting: DrivenSystem) -> tuple[AttractorList, list[int]]:
        out = _arrivals(plan, setting)
        progress()
        return out

    counted = parallel(arrivals, settings, jobs)
    lineage, every = _Lineage(plan), list[Step]()
    for k, block in enumerate(blocks):
        steps = known[k]
        if steps is None:
            met = islice(counted, len(block))
            steps = [lineage.step(v, *m) for v, m in zip(block.tolist(), met, strict=True)]
            if store is not None:
                store.write(steps, k)
        else:
            lineage.take(float(block[-1]), steps)
            for _ in block:
                progress()
        every += steps
    return BasinShares(plan, tuple(every))


def _may_be(steps: Sequence[Step], plan: SharePlan, block: Array) -> bool:
    """Whether stored steps are of as many values, and each counts all starts of this system."""
    states, starts = len(plan.subject.states), len(plan.numbers)
    return len(steps) == len(block) and all(
        sum(share.count for share in step) == starts
        and all(
            share.countable
            and 0 <= share.attractor < MOST_COUNTED
            and (share.twin is None or 0 <= share.twin < MOST_COUNTED)
            and share.count >= 0
            and share.strobes
            and all(len(strobe) == states for strobe in share.strobes)
            for share in step
        )
        for step in steps
    )


# ---------------------------------------------------------------------------------------------


def _arrivals(plan: SharePlan, setting: DrivenSystem) -> tuple[AttractorList, list[int]]:
    """The attractors at one value, and how many starts end on each."""
    flow = setting.flow()
    # One flow for all starts; which stops are shown is of no matter, and the upper one is fast.
    setting = replace(setting, flow=lambda: flow, stops=UPPER)
    met = AttractorList(flow, plan.subject.weights)
    ends: list[int] = []
    chaotic: list[Orbit] = []
    for x, phase in zip(plan.starts, plan.phases.tolist(), strict=True):
        end = _end(plan, setting, met, x, phase, chaos=bool(chaotic))
        if isinstance(end, Orbit):
            chaotic.append(end)
        else:
            ends.append(end)
    for before, orbit in zip(chaotic, outlived(flow, chaotic), strict=True):
        motion, x = _named(orbit), orbit.start if len(orbit.start) else before.start
        ends.append(met.number(motion, motion.symmetric, x))
    return met, np.bincount(ends, minlength=len(met.met)).tolist()


def _end(
    plan: SharePlan,
    setting: DrivenSystem,
    met: AttractorList,
    x: Array,
    phase: float,
    *,
    chaos: bool,
) -> int | Orbit:
    """Number of the attractor that a start ends on, or a chaotic motion, which may be a transient.
    chaos : whether one was met before, so that growth is enough to call another one so."""
    flow = met.flow
    run = flow.to_strobe(x, phase)
    for look in LOOKS:
        if run.status is FlowStatus.DONE:
            run = flow.run(run.strobes[-1], look, mode=run.mode)
        if run.status is not FlowStatus.DONE:
            return met.number(stopped(run.status, run.strobes[-1], 0), None, run.strobes[-1])
        number = met.at(run.strobes[-1])
        if number is not None:
            return number
        if chaos and look == LOOKS[0] and _grows(flow, run.strobes[-1]):
            return Orbit(OrbitStatus.APERIODIC, start=run.strobes[-1], mode=run.mode)
    steady = setting.steady(run.strobes[-1], plan.course)
    if steady.status is OrbitStatus.APERIODIC:
        return Orbit(OrbitStatus.APERIODIC, start=steady.end)
    return met.number(steady, steady.symmetric, steady.start)


def _named(orbit: Orbit) -> Orbit:
    """As a sweep names it: a count near a tangency is given as it was run."""
    grazing = orbit.status is OrbitStatus.GRAZING
    return replace(orbit, status=OrbitStatus.PERIODIC) if grazing else orbit


def _grows(flow: Flow, x: Array) -> bool:
    """Whether a tangent vector of the motion through x (states,) grows as in chaos; what overflows
    does."""
    aligned = flow.run(x, ALIGN, tangent=np.ones((len(x), 1)))
    if aligned.status is not FlowStatus.DONE or aligned.tangent is None:
        return False
    v = aligned.tangent / max(float(np.linalg.norm(aligned.tangent)), 1e-300)
    run = flow.run(aligned.strobes[-1], SPAN, mode=aligned.mode, tangent=v)
    return run.tangent is not None and not np.linalg.norm(run.tangent) <= np.exp(CHAOS * SPAN)


@dataclass(frozen=True)
class _Way:
    """The way from one value of the parameter to another."""

    family: Family
    """The system at any value."""
    low: float
    """Where it begins."""
    high: float
    """Where it ends."""
    flow: Flow
    """The flow at its end."""

    def halves(self) -> tuple[_Way, _Way]:
        middle = 0.5 * (self.low + self.high)
        first = replace(self, high=middle, flow=self.family.flow(middle))
        return first, replace(self, low=middle)


class _Lineage:
    """Numbers attractors from value to value."""

    def __init__(self, plan: SharePlan) -> None:
        self.family = plan.subject.family(plan.parameter)
        self.value = float(plan.values[0])
        self.count = 0
        self.alive: dict[int, MetAttractor] = {}
        self.unsettled: dict[OrbitStatus, int] = {}

    def take(self, value: float, steps: Sequence[Step]) -> None:
        """Go on behind steps that were numbered before, the last of them at this value."""
        self.value = value
        for share in (share for step in steps for share in step):
            self.count = max(self.count, share.attractor + 1)
            if share.status is not OrbitStatus.PERIODIC:
                self.unsettled[share.status] = share.attractor
        last = [s for s in steps[-1] if s.status is OrbitStatus.PERIODIC]
        self.alive = {s.attractor: MetAttractor(s, s.symmetric, np.array(s.strobes)) for s in last}

    def step(self, value: float, met: AttractorList, counts: list[int]) -> Step:
        """The attractors of the next value with their numbers."""
        numbers = self._continued(met, _Way(self.family, self.value, value, met.flow))
        self.value = value
        self._by_name(met, numbers)
        for k, attractor in enumerate(met.met):
            if k not in numbers:
                numbers[k] = self._new(attractor)
        self.alive = {numbers[k]: a for k, a in enumerate(met.met) if a.periodic}
        counts = counts + [0] * (len(met.met) - len(counts))
        shares = [_share(met, k, numbers, counts[k]) for k in range(len(met.met))]
        return tuple(sorted(shares, key=lambda share: share.attractor))

    def _continued(self, met: AttractorList, way: _Way) -> dict[int, int]:
        """Numbers of those that Newton's method leads to, by their place in the list, which gets
        those that no start ended on."""
        out: dict[int, int] = {}
        for number, before in self.alive.items():
            k = _continuation(met, before, way)
            if k is not None:
                out.setdefault(k, number)
        return out

    def _by_name(self, met: AttractorList, numbers: dict[int, int]) -> None:
        """Number those that have the name of one that was lost, the nearest first."""
        lost = {n: a for n, a in self.alive.items() if n not in numbers.values()}
        pairs = sorted(
            (_distance(met, before, attractor), k, number)
            for k, attractor in enumerate(met.met)
            for number, before in lost.items()
            if k not in numbers and attractor.periodic and attractor.label == before.label
        )
        for _, k, number in pairs:
            if k not in numbers and number not in numbers.values():
                numbers[k] = number

    def _new(self, attractor: MetAttractor) -> int:
        status = attractor.motion.status
        if not attractor.periodic and status in self.unsettled:
            return self.unsettled[status]
        self.count += 1
        if not attractor.periodic:
            self.unsettled[status] = self.count - 1
        return self.count - 1


def _continuation(met: AttractorList, before: MetAttractor, way: _Way) -> int | None:
    """Place in the list of the stable orbit that continues one of the value before, if any."""
    n = before.motion.n
    continued = _continue(met, way, before.strobes[0], n, HALVINGS)
    if continued is None:
        return None
    x, monodromy = continued
    k = met.at(x)
    if k is not None:
        alike = met.met[k].motion.n == n and met.met[k].symmetric is before.symmetric
        return k if alike else None
    orbit = _named(describe(met.flow, x, n, monodromy))
    if orbit.status is not OrbitStatus.PERIODIC or orbit.symmetric is not before.symmetric:
        return None
    laps = met.flow.run(x, n).strobes
    if any(met.same(laps[d], x) for d in range(1, n) if n % d == 0):
        return None
    return met.number(orbit, orbit.symmetric, x)


def _continue(
    met: AttractorList, way: _Way, x: Array, n: int, halvings: int
) -> tuple[Array, Array] | None:
    """Strobe and matrix at the end of the way of the stable orbit of period n through x (states,)
    at its start; None where there is none. The way is halved where Newton's method leads far."""
    shot = shoot(way.flow, x, n)
    if shot is not None and met.distance(shot[0], x) <= LEAP:
        return shot if np.abs(np.linalg.eigvals(shot[1])).max() < 1.0 else None
    if not halvings:
        return None
    first, second = way.halves()
    half = _continue(met, first, x, n, halvings - 1)
    return None if half is None else _continue(met, second, half[0], n, halvings - 1)


def _distance(met: AttractorList, one: MetAttractor, other: MetAttractor) -> float:
    """Distance from the first strobe of one orbit to the nearest of another."""
    return float(np.abs(met.weights * (other.strobes - one.strobes[0])).max(axis=1).min())


def _share(met: AttractorList, k: int, numbers: dict[int, int], count: int) -> AttractorShare:
    attractor, twin = met.met[k], met.twin(k)
    motion = attractor.motion
    return AttractorShare(
        numbers[k],
        motion.status,
        motion.n,
        motion.p,
        motion.q,
        attractor.symmetric,
        None if twin is None else numbers[twin],
        count,
        tuple(map(tuple, attractor.strobes.tolist())),
        motion.more,
    )
