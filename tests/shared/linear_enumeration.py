"""Full enumeration of the linear block: every value in every place, nothing joined, nothing pruned.
Shares no code with the package."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from tests.shared.oracles import _SCALES, LINEAR_NAMES, Array, elementary_vectors

RESISTORS = ("R1", "R2", "R3", "R4", "R5", "R7", "R8", "R9", "R10", "R11")
NAMES = (*RESISTORS, "C1", "C2", "C3", "C4")
CAPACITOR = {"R1": "C1", "R2": "C2", "R3": "C2", "R4": "C2", "R5": "C2", "R7": "C3"}
CAPACITOR |= dict.fromkeys(("R8", "R9", "R10", "R11"), "C4")
_VECTORS = elementary_vectors(_SCALES)


@dataclass(frozen=True)
class Conditions:
    """As ``linear_network.linear_block.Bounds``, and a model file's preferences."""

    seconds: tuple[float, float] = (0.0, math.inf)
    level: float = math.inf
    share: float = math.inf
    stop: float = 0.0
    peaks: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    matched: tuple[tuple[str, ...], ...] = ()
    preferred: frozenset[float] = frozenset()
    most: int = 14


@dataclass(frozen=True)
class Choices:
    """index (14, k) into the sorted resistors, capacitors; masks (2, k), a bit for each resistor
    and each capacitor that a choice uses; error of each; wanted in the order of LINEAR_NAMES."""

    resistors: tuple[float, ...]
    capacitors: tuple[float, ...]
    wanted: tuple[float, ...]
    index: NDArray[np.int8]
    masks: NDArray[np.uint8]
    errors: Array

    def values(self, name: str) -> Array:
        where = NAMES.index(name)
        kind = self.resistors if where < 10 else self.capacitors
        values: Array = np.array(kind)
        return np.asarray(values[self.index[where]])

    def kinds(self, preferred: frozenset[float] = frozenset()) -> NDArray[np.int64]:
        """(k,) distinct values that are not preferred."""
        total = np.zeros(self.index.shape[1], dtype=np.int64)
        for kind, mask in zip((self.resistors, self.capacitors), self.masks, strict=True):
            for i, value in enumerate(kind):
                if value not in preferred:
                    total += mask >> i & 1
        return total

    def take(self, which: NDArray[np.bool_]) -> Choices:
        return replace(
            self,
            index=self.index[:, which],
            masks=self.masks[:, which],
            errors=self.errors[which],
        )

    def keeping(self, kept: Conditions) -> Choices:
        """Those that keep the conditions, which are products here and sums in the package."""
        rc = {
            name: self.values(name) * self.values(CAPACITOR[name]) * w
            for name, w in zip(LINEAR_NAMES, self.wanted, strict=True)
        }
        tau = (rc["R2"] * rc["R9"] * rc["R3"] * rc["R8"]) ** 0.25
        # Volts of a unit of: x2' over x1'; displacement over velocity of each mass.
        velocities, first, second = np.sqrt(rc["R3"] / rc["R8"]), rc["R4"] / tau, rc["R11"] / tau
        x1, v1, x2, v2 = kept.peaks
        over = 1.0 + 1e-9
        one, two, between = v1 / x1 / first, v2 / x2 / second, v2 / v1 * velocities
        good = (tau >= kept.seconds[0] / over) & (tau <= kept.seconds[1] * over)
        good &= self.values("R4") >= kept.stop / over
        for ratio in (one, two, between):
            good &= (ratio <= kept.level * over) & (ratio >= 1.0 / (kept.level * over))
        for share in (one, one * between, one * between / two):
            good &= share <= kept.share * over
        for group in kept.matched:
            for name in group[1:]:
                good &= self.values(name) == self.values(group[0])
        good &= self.kinds(kept.preferred) <= kept.most
        return self.take(good)


@cache
def places(resistors: int, capacitors: int) -> tuple[NDArray[np.int8], NDArray[np.uint8]]:
    """The index and the masks of every choice, of so many resistors and capacitors."""
    counts = (resistors,) * 10 + (capacitors,) * 4
    index = np.indices(counts, dtype=np.int8).reshape(14, -1)
    bits = np.left_shift(np.uint8(1), index.view(np.uint8))
    return index, np.array([np.bitwise_or.reduce(b) for b in (bits[:10], bits[10:])])


@lru_cache(maxsize=8)
def every_choice(
    resistors: tuple[float, ...], capacitors: tuple[float, ...], wanted: tuple[float, ...]
) -> Choices:
    """Every choice and its least coefficient error over the four scales.

    wanted : |coefficient| of each of LINEAR_NAMES, 1 for R1 and R7.
    """
    r, c = tuple(sorted(resistors)), tuple(sorted(capacitors))
    index, masks = places(len(r), len(c))
    first = index[:, :: len(c) ** 4], index[:, : len(c) ** 4]  # every resistor; every capacitor
    ohms, farads = (
        np.stack([np.take(np.log(kind), some[NAMES.index(name)]) for name in names])
        for kind, some, names in (
            (r, first[0], LINEAR_NAMES),
            (c, first[1], [CAPACITOR[name] for name in LINEAR_NAMES]),
        )
    )
    ohms += np.log(wanted)[:, None]
    errors = np.zeros((ohms.shape[1], farads.shape[1]))
    for y in _VECTORS:
        np.maximum(errors, np.abs((y @ ohms)[:, None] + y @ farads), out=errors)
    return Choices(r, c, wanted, index, masks, errors.ravel())
