"""Impacts counted on a noisy curve, and which of them the noise leaves open.

An impact is an entry into contact. The displacement's extremes decide: a maximum that is beyond the
stop is a contact, and two of them are two impacts if the minimum between them is not. Each extreme
is asked what is more likely, with both signals at hand: the displacement itself, and the output of
the dead zone, which says how deep a contact is but nothing where there is none.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Protocol

import numpy as np

from designer.base.arrays import Array, Index

SURE = 8.0
"""Logarithm of the ratio of the likelihoods at which an extreme is decided: four standard
errors."""
PROMINENT = 4.0
"""Standard errors that an extreme has to stand out to be one."""
MOST_OPEN = 6
"""Open extremes whose every combination is counted; the least sure ones of more."""


@dataclass(frozen=True)
class ContactEvidence:
    """What the signals say of contact with one stop along a lap; positive is beyond the stop.

    Either signal may be missing: None.
    """

    beyond: Array | None
    """(k,) the displacement less the stop [V]."""
    beyond_error: float
    """Standard error of it [V]."""
    depth: Array | None
    """(k,) the depth of the contact by the output of the dead zone [V]: 0 without contact."""
    depth_error: float
    """Standard error of it [V]."""
    noise: float
    """Standard error of the trace from one of its extremes to the next [V]: without what moves all
    of it together."""

    @property
    def trace(self) -> Array:
        """(k,) what the extremes are looked for on [V]."""
        if self.beyond is None:
            assert self.depth is not None
            return self.depth
        if self.depth is None:
            return self.beyond
        a, b = 1.0 / self.beyond_error**2, 1.0 / self.depth_error**2
        joint = (a * self.beyond + b * self.depth) / (a + b)
        return np.where(joint > 0.0, joint, np.minimum(self.beyond, 0.0))

    def ratio(self, at: int) -> float:
        """Logarithm of the likelihood of contact over that of none at a point of the lap."""
        y = 0.0 if self.depth is None else float(self.depth[at])
        if self.beyond is None:
            y /= self.depth_error
            # The output alone cannot tell a near miss from a contact too shallow to be seen: where
            # nothing is seen there is taken to be none.
            return 0.5 * y * abs(y) - SURE
        x, a = float(self.beyond[at]), self.beyond_error**-2
        b = 0.0 if self.depth is None else self.depth_error**-2

        def likelihood(beyond: float) -> float:
            return -0.5 * (a * (x - beyond) ** 2 + b * (y - max(beyond, 0.0)) ** 2)

        return likelihood(max((a * x + b * y) / (a + b), 0.0)) - likelihood(min(x, 0.0))


@dataclass(frozen=True)
class ContactCount:
    """The impacts on one stop over a lap."""

    impacts: int
    """The likeliest number."""
    others: tuple[tuple[int, float], ...]
    """Other numbers that the noise allows, each with the logarithm of how much less likely it
    is."""
    nearest: float
    """Least logarithm of a likelihood ratio of all extremes, whether or not it matters."""
    entries: tuple[float, ...]
    """Where the impacts are, as a fraction of the lap."""


class ExtremeEvidence(Protocol):
    """What decides on the extremes of a trace."""

    @property
    def trace(self) -> Array:
        """(k,) the displacement beyond the stop along a lap [V]."""

    @property
    def noise(self) -> float:
        """Standard error of the trace from one of its extremes to the next [V]."""

    def ratio(self, at: int) -> float:
        """Logarithm of the likelihood of contact over that of none at a point of the lap."""


def count(evidence: ExtremeEvidence, sure: float = SURE) -> ContactCount:
    """The impacts on one stop over a closed lap. sure : logarithm of the ratio of the likelihoods
    at which an extreme is decided."""
    trace = evidence.trace
    places = extremes(trace, PROMINENT * evidence.noise)
    ratios = [evidence.ratio(int(at)) for at in places]
    touching = [ratio > 0.0 for ratio in ratios]
    open_ = sorted(
        (k for k, ratio in enumerate(ratios) if abs(ratio) < sure), key=lambda k: abs(ratios[k])
    )[:MOST_OPEN]
    impacts, others = _entries(touching), dict[int, float]()
    for size in range(1, len(open_) + 1):
        for flipped in combinations(open_, size):
            turned = [one != (k in flipped) for k, one in enumerate(touching)]
            cost = sum(abs(ratios[k]) for k in flipped)
            number = _entries(turned)
            if cost < sure and number != impacts:
                others[number] = min(cost, others.get(number, np.inf))
    nearest = min(map(abs, ratios), default=np.inf)
    entries = tuple(_crossings(trace, places, touching))
    return ContactCount(impacts, tuple(sorted(others.items())), float(nearest), entries)


def extremes(trace: Array, prominence: float) -> Index:
    """Where a closed lap (k,) turns by at least ``prominence``, in order: maxima and minima by
    turns. One place, of the largest value, where it never does."""
    top = int(np.argmax(trace))
    turned = np.roll(trace, -top)
    places, rising, best = [0], False, 0
    for at in range(1, len(turned)):
        value, record = turned[at], turned[best]
        if (value > record) == rising and value != record:
            best = at
        elif abs(value - record) >= prominence:
            places.append(best)
            rising, best = not rising, at
    if not rising and abs(turned[best] - turned[0]) >= prominence:
        places.append(best)
    return (np.array(places, dtype=np.int64) + top) % len(trace)


def _entries(touching: Sequence[bool]) -> int:
    """How often contact begins round a lap."""
    return sum(
        now and not before for before, now in zip((touching[-1], *touching), touching, strict=False)
    )


def _crossings(trace: Array, places: Index, touching: Sequence[bool]) -> Iterator[float]:
    """Where contact begins, as a fraction of the lap: from a free extreme to one in contact."""
    size = len(trace)
    for k, now in enumerate(touching):
        before = int(places[k - 1])
        if now and not touching[k - 1]:
            way = (before + np.arange((int(places[k]) - before) % size + 1)) % size
            beyond = np.flatnonzero(trace[way] > 0.0)
            yield float(way[beyond[0]] if len(beyond) else places[k]) / size
