"""The place of a response in its windows over ω and b that is farthest from losing it.

Every stretch of the response (``centering.response_windows``) is scanned with a few boards at one
stretched spread; the best places are asked again with more boards and stretches, and around the
best of them a pattern of ever smaller steps over ω and b goes on as long as something is gained.
How far that is is the reliability index of ``centering.scaled_sigma``, so borders count by how much
boards move them, whichever mechanism makes them, other attractors among them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from designer.centering.response_windows import CLEARANCE_STEP, OperatingPoint, Stretch
from designer.centering.scaled_sigma import LADDER, OperatingOrbit, ScaledBoards, StretchCounts
from designer.model.response_table import Response

SHARES = (0.5, 0.3, 0.7, 0.1, 0.9)
"""Shares of a stretch at which it is scanned. The first of equal places is taken, so the middle is
first."""
SCAN, SOME, MANY = 8, 24, 64
"""Boards of the scan, of the second round and of the pattern."""
SCANNED, KEPT, STARTS = (2.0,), 10, 2
"""Stretches of the spread in the scan; places of the second round; starts of the pattern."""
PATTERN = 4
"""Rounds of the pattern in which the step is halved."""
MOST = 12
"""Rounds of the pattern in all."""


@dataclass(frozen=True)
class Scored:
    """A place with what boards showed there."""

    place: OperatingPoint
    """Where the response is asked for."""
    operating_orbit: OperatingOrbit | None
    """The nominal board's orbit there; None where it does not show the response."""
    counts: StretchCounts
    """What boards showed there."""

    @property
    def reliability_index(self) -> float:
        return self.counts.reliability_index if self.operating_orbit is not None else -math.inf


@dataclass(frozen=True)
class OperatingRange:
    """How far a place may go."""

    omega: tuple[float, float]
    """Closed range of the frequency; equal ends where it is not open."""
    b: tuple[float, float]
    """Closed range of the clearance; equal ends where it is not open."""


def room_of(spec: Response, b: float, omega: tuple[float, float]) -> OperatingRange:
    """What a response leaves open. b : the model's clearance. omega : band of a search."""
    one = spec.b if isinstance(spec.b, float) else b
    ends = spec.b if isinstance(spec.b, tuple) else (one, one)
    return OperatingRange(omega if spec.omega is None else (spec.omega, spec.omega), ends)


def best_points(
    bench: ScaledBoards,
    spec: Response,
    stretches: Sequence[Stretch],
    room: OperatingRange,
) -> tuple[list[Scored], int]:
    """Places of one response, best first, and how many were tried.

    bench : with ``MANY`` boards at least.
    """
    every = [stretch.at(SHARES) for stretch in stretches]
    scanned = [p for row in itertools.zip_longest(*every) for p in row if p is not None]
    first = score(bench, spec, scanned, SCAN, SCANNED)
    # The scan's indices are coarse: among equals the middle of a wide stretch comes first.
    second = score(bench, spec, [s.place for s in best(first, KEPT)], SOME, LADDER)
    count, scored = len(scanned) + len(second), []
    for start in best(second, STARTS):
        step = _step(stretches, start.place)
        ways, more = _pattern(bench, spec, start.place, room, step)
        scored += ways
        count += more
    return best(scored, len(scored)), count


def score(
    bench: ScaledBoards,
    spec: Response,
    wanted: Sequence[OperatingPoint],
    boards: int,
    ladder: Sequence[float] = LADDER,
) -> list[Scored]:
    """What the first boards show at these places, in order."""
    operating_orbits = bench.operating_orbits([(spec, place) for place in wanted])
    there = [s for s in operating_orbits if s is not None]
    counts = iter(bench.ask(there, range(boards), ladder) if there else [])
    nothing = StretchCounts(tuple(ladder), (0,) * len(ladder), (0,) * len(ladder))
    return [
        Scored(place, operating_orbit, nothing if operating_orbit is None else next(counts))
        for place, operating_orbit in zip(wanted, operating_orbits, strict=True)
    ]


def best(scored: Sequence[Scored], count: int) -> list[Scored]:
    """The places with the largest reliability indices that the nominal board shows; the earlier of
    equals first."""
    there = [s for s in scored if s.operating_orbit is not None]
    return sorted(there, key=lambda s: -s.reliability_index)[:count]


def _step(stretches: Sequence[Stretch], place: OperatingPoint) -> float:
    """The first step in ln ω: half the distance of the places that were scanned."""
    home = next(s for s in stretches if any(p is place for p in s.places))
    return max(math.log(home.high / home.low) * 0.1, 1e-3)


def _pattern(
    bench: ScaledBoards,
    spec: Response,
    start: OperatingPoint,
    room: OperatingRange,
    step: float,
) -> tuple[list[Scored], int]:
    """Places met by a pattern search over (ln ω, ln b)."""
    scored_at = {(start.omega, start.b): score(bench, spec, [start], MANY, LADDER[1:])[0]}
    centre, halved, wide = scored_at[start.omega, start.b], 0, 0.5 * CLEARANCE_STEP
    for _ in range(MOST):
        if halved == PATTERN:
            break
        steps = itertools.product((-1, 0, 1), repeat=2)
        pairs = (
            (
                _clamped(centre.place.omega * math.exp(i * step), room.omega),
                _clamped(centre.place.b * math.exp(j * wide), room.b),
            )
            for i, j in steps
        )
        new = [pair for pair in dict.fromkeys(pairs) if pair not in scored_at]
        around = [replace(centre.place, omega=omega, b=b) for omega, b in new]
        for scored in score(bench, spec, around, MANY, LADDER[1:]):
            scored_at[scored.place.omega, scored.place.b] = scored
        top = max(scored_at.values(), key=lambda s: s.reliability_index)
        if top.reliability_index > centre.reliability_index:
            centre = top
        else:
            step, wide, halved = 0.5 * step, 0.5 * wide, halved + 1
    return list(scored_at.values()), len(scored_at)


def _clamped(value: float, ends: tuple[float, float]) -> float:
    return min(max(value, ends[0]), ends[1])
