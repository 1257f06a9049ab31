"""Whose spread moves a margin: Sobol indices over the coordinates of the spread."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import sobol_indices

from designer.base.arrays import Array
from designer.circuit.netlist import Circuit
from designer.spread.spread import Spread, part_of
from designer.yields.margins import Margin

CUBE = 512
"""Base samples of the Sobol indices; a power of two."""


@dataclass(frozen=True)
class Index:
    """Sobol indices of the margin for one coordinate of the spread."""

    coordinate: str
    """Name of the coordinate."""
    part: str
    """Name of the part that it belongs to."""
    first: float
    """First-order Sobol index."""
    total: float
    """Total Sobol index."""


def sobol(
    circuit: Circuit, spread: Spread, margins: Sequence[Margin], seed: int, base: int = CUBE
) -> list[tuple[Index, ...]]:
    """Sobol indices of each margin over the spread's coordinates, largest total first.

    Saltelli's estimators with ``base`` base samples on a scrambled Sobol set (scipy.stats). Empty
    where nothing limits.
    """
    names = spread.coordinates(circuit)
    real = [m for m in margins if m.limits]
    if not real:
        return [() for _ in margins]

    def values(cube: Array) -> Array:
        boards = spread.from_cube(circuit, np.minimum(cube.T, 1.0 - 2.0**-53))
        return np.stack([m.of(boards) for m in real])

    uniform: Any = _Uniform()
    found = sobol_indices(
        func=values,
        n=base,
        dists=[uniform] * len(names),
        rng=np.random.default_rng([seed, base]),
    )
    first = np.reshape(found.first_order, (len(real), len(names)))
    total = np.reshape(found.total_order, (len(real), len(names)))
    by_margin = iter(range(len(real)))
    out: list[tuple[Index, ...]] = []
    for margin in margins:
        if not margin.limits:
            out.append(())
            continue
        i = next(by_margin)
        rows = (
            Index(name, part_of(name), float(first[i, k]), float(total[i, k]))
            for k, name in enumerate(names)
        )
        out.append(tuple(sorted(rows, key=lambda x: (-x.total, x.coordinate))))
    return out


class _Uniform:
    """A coordinate of the cube, as scipy.stats wants it."""

    def ppf(self, q: Array) -> Array:
        return q
