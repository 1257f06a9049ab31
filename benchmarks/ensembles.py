"""Many boards at once in the competitors of the compiled settling: heyoka's batch mode, and
Runge-Kutta whose innermost loops run over boards.

Both carry what a board's reduction is: x' = A x + B sin(ω t) + d + Σ push · max(0, depth), where a
depth is linear in state and sin(ω t). A board has numbers of its own.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from benchmarks.references import Array, compile_rival

LANES = 32
"""Boards whose steps of Runge-Kutta are taken together: of 8 the compiler takes one at a time."""


@dataclass(frozen=True)
class BoardNumbers:
    """N boards of n states with s contacts each."""

    A: Array
    """(N, n, n)."""
    B: Array
    """(N, n)."""
    d: Array
    """(N, n)."""
    depth: Array
    """(N, s, n + 2) over (states, sin ωt, 1)."""
    push: Array
    """(N, s, n)."""
    omega: float
    """Frequency of the drive."""

    def __len__(self) -> int:
        return len(self.A)


class HeyokaBatch:
    """heyoka's Taylor integrator in batch mode: as many boards a batch as it recommends, each with
    its numbers as run-time parameters, and terminal events that switch a contact.

    Raises
    ------
    ImportError : heyoka is not installed.
    """

    def __init__(self, boards: BoardNumbers, tolerance: float) -> None:
        hy: Any = importlib.import_module("heyoka")

        self.boards, self.size = boards, int(hy.recommended_simd_size())
        n, contacts = boards.B.shape[1], boards.depth.shape[1]
        states = hy.make_vars(*[f"x{i}" for i in range(n)])
        drive = hy.sin(boards.omega * hy.time)
        columns: list[Array] = []

        def number(values: Array) -> Any:
            """None where it is zero on every board; a constant where all have the same."""
            if not values.any():
                return None
            if (values == values[0]).all():
                return hy.expression(float(values[0]))
            columns.append(values)
            return hy.par[contacts + len(columns) - 1]

        def linear(coefficients: Array) -> Any:
            factors = [*states, drive, hy.expression(1.0)]
            terms = [
                (number(coefficients[:, i]), factor)
                for i, factor in enumerate(factors[: coefficients.shape[1]])
            ]
            return hy.sum([value * factor for value, factor in terms if value is not None])

        depths = [linear(boards.depth[:, k]) for k in range(contacts)]
        rates = []
        for i in range(n):
            row = np.column_stack([boards.A[:, i], boards.B[:, i], boards.d[:, i]])
            terms = [linear(row)]
            for k in range(contacts):
                push = number(boards.push[:, k, i])
                terms += [] if push is None else [hy.par[k] * push * depths[k]]
            rates.append(hy.sum(terms))
        self._columns = np.array(columns).reshape(len(columns), len(boards))

        def switch(contact: int) -> Callable[[Any, int, int], bool]:
            def callback(integrator: Any, direction: int, lane: int) -> bool:
                integrator.pars[contact, lane] = float(direction > 0)
                return True

            return callback

        self._integrator = hy.taylor_adaptive_batch(
            list(zip(states, rates, strict=True)),
            np.zeros((n, self.size)),
            pars=np.zeros((contacts + len(columns), self.size)),
            tol=tolerance,
            t_events=[hy.t_event_batch(depths[k], callback=switch(k)) for k in range(contacts)],
        )

    def __call__(self, starts: Array, periods: int) -> Array:
        """(N, n) states after whole drive periods from ``starts`` (N, n) at drive phase 0."""
        out, ta, boards = np.empty_like(starts), self._integrator, self.boards
        depths = (boards.depth[:, :, :-2] @ starts[:, :, None])[:, :, 0] + boards.depth[:, :, -1]
        touching = (depths > 0.0).T
        contacts, end = len(touching), np.full(self.size, periods * 2.0 * math.pi / boards.omega)
        for first in range(0, len(starts), self.size):
            lanes = np.minimum(np.arange(first, first + self.size), len(starts) - 1)
            ta.set_time(0.0)
            ta.state[:] = starts[lanes].T
            ta.pars[:contacts] = touching[:, lanes]
            ta.pars[contacts:] = self._columns[:, lanes]
            ta.reset_cooldowns()
            ta.propagate_until(end)
            out[lanes] = ta.state.T
        return out


@partial(compile_rival, inline=True)
def _slope(
    N: Array, lane: int, x: float, v: float, y: float, u: float, wave: float
) -> tuple[float, float, float, float]:
    """The rates of a board; its numbers are at ``lane`` of each of ``_placed``'s rows."""
    upper = max(N[lane] * x + N[LANES + lane], 0.0)
    lower = max(N[2 * LANES + lane] * x + N[3 * LANES + lane], 0.0)
    return (
        N[4 * LANES + lane] * x + N[5 * LANES + lane] * v + N[6 * LANES + lane],
        N[7 * LANES + lane] * x + N[8 * LANES + lane] * v + N[9 * LANES + lane] * y
        + N[10 * LANES + lane] * u + N[11 * LANES + lane] * wave + N[12 * LANES + lane]
        + N[13 * LANES + lane] * upper + N[14 * LANES + lane] * lower,
        N[15 * LANES + lane] * y + N[16 * LANES + lane] * u + N[17 * LANES + lane],
        N[18 * LANES + lane] * x + N[19 * LANES + lane] * v + N[20 * LANES + lane] * y
        + N[21 * LANES + lane] * u + N[22 * LANES + lane],
    )  # fmt: skip


@compile_rival
def _lanes(X: Array, N: Array, omega: float, steps: int, periods: int) -> None:
    """X (4 LANES,) ← the states of boards side by side. One axis, so that the compiler knows how
    far apart the rows are, and takes several lanes at once."""
    h = 2.0 * math.pi / omega / steps
    half, sixth = 0.5 * h, h / 6.0
    for _ in range(periods):
        s0 = 0.0
        for i in range(steps):
            sm, s1 = math.sin(omega * (i + 0.5) * h), math.sin(omega * (i + 1) * h)
            for lane in range(LANES):
                x, v, y, u = X[lane], X[LANES + lane], X[2 * LANES + lane], X[3 * LANES + lane]
                a, b, c, d = _slope(N, lane, x, v, y, u, s0)
                x1, v1, y1, u1 = x + half * a, v + half * b, y + half * c, u + half * d
                e, f, g, k = _slope(N, lane, x1, v1, y1, u1, sm)
                x1, v1, y1, u1 = x + half * e, v + half * f, y + half * g, u + half * k
                m, n, p, q = _slope(N, lane, x1, v1, y1, u1, sm)
                x1, v1, y1, u1 = x + h * m, v + h * n, y + h * p, u + h * q
                w, r, s, z = _slope(N, lane, x1, v1, y1, u1, s1)
                X[lane] = x + sixth * (a + 2.0 * (e + m) + w)
                X[LANES + lane] = v + sixth * (b + 2.0 * (f + n) + r)
                X[2 * LANES + lane] = y + sixth * (c + 2.0 * (g + p) + s)
                X[3 * LANES + lane] = u + sixth * (d + 2.0 * (k + q) + z)
            s0 = s1


def _placed(boards: BoardNumbers) -> Array:
    """(N, 23) what ``_slope`` takes; the paper's circuit has nothing else.

    Raises
    ------
    ValueError : another number is not zero.
    """
    A, B, d, depth, push = boards.A, boards.B, boards.d, boards.depth, boards.push
    columns = [
        depth[:, 0, 0], depth[:, 0, -1], depth[:, 1, 0], depth[:, 1, -1],
        A[:, 0, 0], A[:, 0, 1], d[:, 0],
        *A[:, 1].T, B[:, 1], d[:, 1], push[:, 0, 1], push[:, 1, 1],
        A[:, 2, 2], A[:, 2, 3], d[:, 2],
        *A[:, 3].T, d[:, 3],
    ]  # fmt: skip
    placed = np.stack(columns, axis=1)
    every = [values.reshape(len(boards), -1) for values in (A, B, d, depth, push)]
    if (placed != 0.0).sum() != sum((values != 0.0).sum() for values in every):
        raise ValueError("the boards have numbers that the paper's circuit has not")
    return placed


def runge_kutta(boards: BoardNumbers, starts: Array, periods: int, steps: int) -> Array:
    """(N, 4) as of ``HeyokaBatch``, with ``steps`` equal steps a period, blind to the contacts."""
    out, numbers = np.empty_like(starts), _placed(boards)
    for first in range(0, len(starts), LANES):
        rows = np.minimum(np.arange(first, first + LANES), len(starts) - 1)
        X = starts[rows].T.ravel()
        _lanes(X, numbers[rows].T.ravel(), boards.omega, steps, periods)
        out[rows] = X.reshape(4, LANES).T
    return out
