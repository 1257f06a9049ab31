"""The boards that a fit chooses from: those of a spread, as normal deviations of single parts.

A fitted board is near others of the same probability, so its parts' values are taken as linear in
the coordinates of the spread: each coordinate moves what it moves by its standard deviation for
each unit of a standard normal number. Tracking parts, rails and measured values come in by their
own coordinates. A uniform law so becomes a normal one of the same variance, which a sum of many
parts is near anyway; what only a product of two coordinates does (a temperature by a temperature
coefficient) is left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Circuit
from designer.circuit.reduction import Reduction
from designer.spread.board_quantities import Quantity, column, quantities, with_column
from designer.spread.spread import Spread

NODES = 16
"""Values of a coordinate that its standard deviation is taken from."""
PROBE = 0.05
"""Of a standard deviation: the step of a difference quotient."""


@dataclass(frozen=True)
class Prior:
    """The boards of a spread at standard normal numbers."""

    circuit: Circuit
    spread: Spread
    """What varies from board to board."""
    bandwidth: bool = True
    """Whether the op-amps lag behind (``circuit.reduction``)."""

    @cached_property
    def _middle(self) -> Boards:
        """One board, every coordinate at its median."""
        names = self.spread.coordinates(self.circuit)
        return self.spread.from_cube(self.circuit, np.full((1, len(names)), 0.5))

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """What differs from board to board, Q of them."""
        return self._moved[0]

    @property
    def slopes(self) -> Array:
        """(Q, K) change of each quantity with each coordinate, in its unit."""
        return self._moved[1]

    @cached_property
    def _moved(self) -> tuple[tuple[Quantity, ...], Array]:
        """(quantities, slopes): each coordinate is moved by itself, the rest at their medians."""
        count = len(self.spread.coordinates(self.circuit))
        cube = np.full((count, NODES, count), 0.5)
        own = np.arange(count)
        cube[own, :, own] = (np.arange(NODES) + 0.5) / NODES
        boards = self.spread.from_cube(self.circuit, cube.reshape(-1, count))
        varying = quantities(self.circuit, boards)
        values = np.array([column(boards, q).reshape(count, NODES) for q in varying])
        # Nodes in the middle of equal shares miss a part of a uniform law's variance: 1/NODES².
        slopes = values.std(axis=2) / np.sqrt(1.0 - NODES**-2)
        slopes *= np.sign(values[..., -1] - values[..., 0])
        moving = np.abs(slopes).max(axis=0) > 0.0
        return varying, slopes[:, moving]

    @cached_property
    def middle_values(self) -> Array:
        """(Q,) each quantity on the board whose coordinates are all at their medians."""
        return np.array([float(column(self._middle, q)[0]) for q in self.quantities])

    @property
    def size(self) -> int:
        """How many coordinates there are, K."""
        return int(self.slopes.shape[1])

    def boards(self, z: Array) -> Boards:
        """The boards at z (N, K)."""
        boards = self._middle.take(np.zeros(len(z), dtype=np.intp))
        for quantity, slope in zip(self.quantities, self.slopes, strict=True):
            values = column(boards, quantity) + z @ slope
            boards = with_column(boards, quantity, values)
        return replace(boards, bandwidth=self.bandwidth)

    def ensemble(self, z: Array) -> Ensemble:
        """The boards at z (N, K), reduced."""
        return Ensemble(self.boards(z))

    def reductions(self, z: Array) -> list[Reduction]:
        """The exact circuits of the boards at z (N, K), one by one."""
        boards = self.boards(z)
        return [
            Reduction(self.circuit, boards.board(i), bandwidth=self.bandwidth)
            for i in range(len(z))
        ]

    def draws(self, count: int, seed: int = 0) -> Array:
        """(count, K) points of the spread, the middle first."""
        z = np.random.default_rng(seed).standard_normal((count, self.size))
        z[0] = 0.0
        return z
