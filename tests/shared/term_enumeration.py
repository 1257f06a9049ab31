"""Full enumeration of a linear block with any pattern of terms: every value in every place.
Shares no code with the package."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.shared.oracles import Array, elementary_vectors


def term_name(masses: int, state: int, source: int) -> str:
    """The resistor of one entry of the state matrix, counted out as docs/synthesis.md says."""
    names, number = {}, 1000 if masses > 4 else 0
    for mass in range(masses):
        own = [(2 * mass, 2 * mass + 1)]
        own += [(2 * mass + 1, 2 * j + 1) for j in range(masses)]
        own += [(2 * mass + 1, 2 * j) for j in range(masses)]
        for entry in own:
            number += 1
            names[entry] = f"R{number}"
        number += 1  # the force
    return names[state, source]


@dataclass(frozen=True)
class Limits:
    """As ``linear_network.linear_terms.Bounds``, and a model file's preferences."""

    seconds: tuple[float, float] = (0.0, np.inf)
    level: float = np.inf
    share: float = np.inf
    stop: float = 0.0
    mass: int = 0
    peaks: tuple[float, ...] = ()
    matched: tuple[tuple[str, ...], ...] = ()
    preferred: frozenset[float] = frozenset()
    most: int = 99


@dataclass(frozen=True)
class Everything:
    """names (p,) of the parts; values (k, p) of each choice; errors (k,); scales (k, 2n + 1): ln of
    the time scale and of each state's volts, by least squares, those of x1 being 1."""

    names: tuple[str, ...]
    values: Array
    errors: Array
    scales: Array
    entries: tuple[tuple[int, int], ...]

    def kinds(self, preferred: frozenset[float] = frozenset()) -> NDArray[np.int64]:
        return np.array([len(set(row) - preferred) for row in self.values.tolist()])

    def take(self, which: NDArray[np.bool_]) -> Everything:
        return Everything(
            self.names, self.values[which], self.errors[which], self.scales[which], self.entries
        )

    def keeping(self, kept: Limits) -> Everything:
        over, volts = 1e-9, self.scales[:, 1:]
        tall = volts + np.log(kept.peaks or np.ones(volts.shape[1]))
        tau = self.scales[:, 0]
        good = np.ones(len(tau), dtype=bool)
        with np.errstate(divide="ignore"):
            low, high = np.log(kept.seconds)
        good &= (tau >= low - over) & (tau <= high + over)
        n = volts.shape[1] // 2
        pairs = [(2 * i, 2 * i + 1) for i in range(n)]
        pairs += [(2 * i + 1, 2 * j + 1) for i in range(n) for j in range(i)]
        for i, j in pairs:
            good &= np.abs(tall[:, i] - tall[:, j]) <= np.log(kept.level) + over
        good &= tall.max(axis=1) - tall[:, 2 * kept.mass] <= np.log(kept.share) + over
        own = (2 * kept.mass + 1, 2 * kept.mass)
        if own in self.entries:
            column = self.names.index(term_name(n, *own))
            good &= self.values[:, column] >= kept.stop * (1.0 - over)
        for group in kept.matched:
            columns = [self.names.index(name) for name in group if name in self.names]
            for column in columns[1:]:
                good &= self.values[:, column] == self.values[:, columns[0]]
        good &= self.kinds(kept.preferred) <= kept.most
        return self.take(good)


def everything(A: Array, resistors: Array, capacitors: Array) -> Everything:
    """Every choice for the state matrix A, its least largest error and its nominal scales."""
    entries = tuple((int(a), int(b)) for a, b in np.argwhere(A != 0.0))
    states = len(A)
    index = itertools.product(
        *[range(len(resistors))] * len(entries), *[range(len(capacitors))] * states
    )
    chosen = np.array(list(index))
    k = len(entries)
    values = np.column_stack([resistors[chosen[:, :k]], capacitors[chosen[:, k:]]])
    D = np.zeros((k, 1 + states))
    h = np.zeros((len(values), k))
    for i, (a, b) in enumerate(entries):
        h[:, i] = -np.log(values[:, i] * values[:, k + a] * abs(A[a, b]))
        D[i, 0] = 1.0
        D[i, 1 + b] += 1.0
        D[i, 1 + a] -= 1.0
    D = np.delete(D, 1, axis=1)
    errors = np.zeros(len(h))
    for y in elementary_vectors(D):
        np.maximum(errors, np.abs(h @ y), out=errors)
    scales = np.linalg.lstsq(D, -h.T, rcond=None)[0].T
    names = (
        *(term_name(states // 2, a, b) for a, b in entries),
        *(f"C{i + 1}" for i in range(states)),
    )
    return Everything(tuple(names), values, errors, np.insert(scales, 1, 0.0, axis=1), entries)
