"""The scales at which the largest coefficient error is least: small linear programs."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from designer.base.arrays import Array, Mask
from designer.circuit.linear_program import LinearProgram


def least_largest(h: Array, D: Array) -> float:
    """The least of max |h + D s| over all s. h : (m,); D : (m, n).

    Raises
    ------
    ArithmeticError : the solver found nothing, which no finite h and D can cause.
    """
    return float(np.abs(h + D @ _Fit(D).level(h)).max())


def minimax(h: Array, D: Array) -> Array:
    """s (n,) that minimises max |h + D s|, and among those the sum of |h + D s|.

    h : (m,); D : (m, n).

    Raises
    ------
    ArithmeticError : as ``least_largest``.
    """
    return _Fit(D).best(h)


class LargestFit:
    """The largest error of many choices, each at the scales that are best for it.

    D : (m, n), of all choices. own : (m,) the errors that scales are fitted to; the others are read
    at these scales, which are those of ``minimax``.
    """

    def __init__(self, D: Array, own: Mask) -> None:
        self._slopes, self._own, self._fit = D, own, _Fit(D[own])

    def largest(self, h: Array) -> float:
        """The largest |h + D s|, h (m,).

        Raises
        ------
        ArithmeticError : as ``least_largest``.
        """
        fit = self._fit.level if self._own.all() else self._fit.best
        return float(np.abs(h + self._slopes @ fit(h[self._own])).max())


class _Fit:
    """The scales of many h with the same D (m, n)."""

    def __init__(self, D: Array) -> None:
        self._slopes = D

    def level(self, h: Array) -> Array:
        """s (n,) with the least max |h + D s|."""
        n = self._slopes.shape[1]
        level = self._levels.solve(np.eye(1, n + 1, n)[0], np.concatenate([-h, h]))
        if level is None:  # feasible for every h, so only a broken solver comes here
            raise ArithmeticError("no minimax scales")
        return level[:n]

    def best(self, h: Array) -> Array:
        """Of those the one with the least sum: |e_i| <= t_i <= worst, least sum of t."""
        m, n = self._slopes.shape
        level = self.level(h)
        worst = float(np.abs(h + self._slopes @ level).max())
        cost = np.append(np.zeros(n), np.ones(m))
        most = np.append(np.full(n, np.inf), np.full(m, worst + 1e-12))
        total = self._sums.solve(cost, np.concatenate([-h, h]), most)
        if total is None or np.abs(h + self._slopes @ total[:n]).max() > worst + 1e-9:
            return level
        return total[:n]

    @cached_property
    def _levels(self) -> LinearProgram:
        return self._program(np.ones((len(self._slopes), 1)))

    @cached_property
    def _sums(self) -> LinearProgram:
        return self._program(np.eye(len(self._slopes)))

    def _program(self, tops: Array) -> LinearProgram:
        """Its variables are s and what |h + D s| may not exceed: tops @ these."""
        D, (_, count) = self._slopes, tops.shape
        low = np.append(np.full(D.shape[1], -np.inf), np.zeros(count))
        return LinearProgram(np.block([[D, -tops], [-D, -tops]]), low, np.full(len(low), np.inf))
