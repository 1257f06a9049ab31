"""The competitors of the exact flow, and a reference in 40-digit arithmetic that judges them all.

Nothing here uses the package: the equations are written out once more from the corrected Eq. (4).
Each integrator carries a state over whole drive periods from phase 0 and returns the last state.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np
from mpmath import mp
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

Array = NDArray[np.float64]
DIGITS = 40
"""Of the reference's arithmetic; its events are converged to 30."""
Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Problem:
    """Dimensionless parameters (docs/definitions.md) and the drive's frequency."""

    omega: float
    m: float = 0.5
    k: float = 0.5
    k0: float = 0.95
    c: float = 0.5
    zeta: float = 0.1
    f20: float = 0.0
    b: float = 0.25
    upper: bool = True
    lower: bool = True

    @property
    def period(self) -> float:
        return 2.0 * math.pi / self.omega

    def matrices(self, number: Callable[[float], Any], side: int) -> tuple[list[Any], Any, Any]:
        """Rows of A, the drive's vector B and the constant d with x' = A x + B sin(ω t) + d.

        number : float or mp.mpf, in which all is computed.
        """
        m, k, k0, c, zeta, f20, b = (
            number(v) for v in (self.m, self.k, self.k0, self.c, self.zeta, self.f20, self.b)
        )
        mu, ratio = k0 / (1 - k0) * abs(side), m / (1 - m)
        zero, one = number(0.0), number(1.0)
        rows = [
            [zero, one, zero, zero],
            [-1 - mu, -2 * zeta, one, 2 * zeta],
            [zero, zero, zero, one],
            [1 / ratio, 2 * zeta / ratio, -1 / (1 - k) / ratio, -2 * zeta / (1 - c) / ratio],
        ]
        return rows, [zero, 1 - f20, zero, f20 / ratio], [zero, mu * side * b, zero, zero]

    def side_of(self, x: float) -> int:
        """Which stop is touched at displacement x: 1 upper, -1 lower, 0 none."""
        if self.k0 > 0.0 and self.upper and x > self.b:
            return 1
        return -1 if self.k0 > 0.0 and self.lower and x < -self.b else 0

    def exits(self, side: int) -> list[tuple[int, int]]:
        """(sign, next side) of each way out: sign · x1 rises through ``level(side, sign)``."""
        if side:
            return [(-side, 0)]
        stops = [(1, 1)] * self.upper + [(-1, -1)] * self.lower
        return stops if self.k0 > 0.0 else []

    def level(self, side: int, sign: int) -> float:
        """Of sign · x1 at the way out in direction ``sign``."""
        return -self.b if side else self.b


# ---------------------------------------------------------------------------------------------
# The reference


class _Segment:
    """x(t) from (t0, x0) in one mode: doubles to look ahead, mpmath for what is kept."""

    def __init__(self, problem: Problem, side: int) -> None:
        rows, B, d = problem.matrices(mp.mpf, side)
        w = mp.mpf(problem.omega)
        A = mp.matrix(rows)
        self.A = np.array(A.tolist(), dtype=float)
        self.roots, V = mp.eig(A)
        self.vectors, self.inverse = V, V**-1
        # Particular solution Im(z exp(i w t)) + constant.
        self.wave = mp.lu_solve(mp.mpc(0, w) * mp.eye(4) - A, mp.matrix(B))
        self.rest = mp.lu_solve(A, -mp.matrix(d))
        self.w = w
        self.fast_roots = np.array([complex(z) for z in self.roots])
        self.rate = max(float(np.abs(self.fast_roots).max()), problem.omega)

    def enter(self, t0: Any, x0: list[Any]) -> None:
        """Begin at phase time t0 in state x0 (4,)."""
        self.t0 = t0
        turn = mp.expj(self.w * t0)
        free = [x0[i] - (self.wave[i] * turn).imag - self.rest[i] for i in range(4)]
        modal = [mp.fsum(self.inverse[i, j] * free[j] for j in range(4)) for i in range(4)]
        self.weights = [[self.vectors[i, j] * modal[j] for j in range(4)] for i in range(4)]
        self.fast_weights = np.array([complex(z) for z in self.weights[0]])
        self.fast_wave = complex(self.wave[0] * turn)
        self.fast_rest = float(self.rest[0])

    def state(self, t: Any) -> list[Any]:
        """x (4,) a time t after entry."""
        e = [mp.exp(z * t) for z in self.roots]
        turn = mp.expj(self.w * (self.t0 + t))
        return [
            mp.fsum(self.weights[i][j] * e[j] for j in range(4)).real
            + (self.wave[i] * turn).imag
            + self.rest[i]
            for i in range(4)
        ]

    def glance(self, t: Array) -> tuple[Array, Array]:
        """Displacement and rate at times t after entry, in double precision."""
        e = np.exp(np.multiply.outer(t, self.fast_roots))
        turn = self.fast_wave * np.exp(1j * float(self.w) * t)
        x = (e @ self.fast_weights).real + turn.imag + self.fast_rest
        v = (e @ (self.fast_weights * self.fast_roots)).real + (1j * float(self.w) * turn).imag
        return x, v


@dataclass(frozen=True)
class Truth:
    """strobes : (periods + 1, 4), rounded from 30 digits. impacts : (periods, 2) lower, upper.

    pieces : (k, 4, 4) linear maps between consecutive events and strobes. peak : (4,) largest
    modulus of each state at events and strobes.
    """

    strobes: Array
    impacts: NDArray[np.int64]
    pieces: Array
    peak: Array

    def magnification(self, scale: Array | float = 1.0) -> float:
        """Largest ‖Φ(t, s)‖, s < t among the ends of the pieces, of states divided by scale."""
        s = np.broadcast_to(np.asarray(scale, dtype=float), (4,))
        pieces = self.pieces * (s[None, None, :] / s[None, :, None])
        step = max(1, len(pieces) // 1500)
        worst, products = 1.0, np.empty((0, 4, 4))
        for i, piece in enumerate(pieces):
            products = piece @ products
            if i % step == 0:
                products = np.concatenate([products, piece[None]])
            worst = max(worst, float(np.sqrt((products**2).sum(axis=(1, 2)).max(initial=0.0))))
        return worst


def truth(problem: Problem, start: Array, periods: int, max_events: int = 20_000) -> Truth | None:
    """The exact flow in ``DIGITS``-digit arithmetic; None past ``max_events`` mode changes."""
    with mp.workdps(DIGITS):
        return _truth(problem, start, periods, max_events)


def _truth(problem: Problem, start: Array, periods: int, max_events: int) -> Truth | None:
    segments = {side: _Segment(problem, side) for side in (-1, 0, 1)}
    period = 2 * mp.pi / mp.mpf(problem.omega)
    x, side = [mp.mpf(v) for v in start], problem.side_of(float(start[0]))
    strobes, peak = [np.array(start, dtype=float)], np.abs(np.array(start, dtype=float))
    impacts = np.zeros((periods, 2), dtype=np.int64)
    pieces: list[Array] = []
    for lap in range(periods):
        t, entered = mp.mpf(0), False
        while True:
            here = segments[side]
            here.enter(t, x)
            left = period - t
            found = _first_exit(problem, here, side, float(left), entered)
            if found is not None:
                sign, after, near = found
                when = _root(here, mp.mpf(sign), mp.mpf(problem.level(side, sign)), near)
                found = None if when >= left else found
            stay = left if found is None else when
            x = here.state(stay)
            pieces.append(expm(here.A * float(stay)))
            peak = np.maximum(peak, [abs(float(v)) for v in x])
            if found is None:
                break
            t, side, entered = t + stay, after, True
            if side:
                impacts[lap, 1 if side > 0 else 0] += 1
            if len(pieces) > max_events:
                return None
        strobes.append(np.array([float(v) for v in x]))
    return Truth(np.array(strobes), impacts, np.array(pieces), peak)


def _first_exit(
    problem: Problem, here: _Segment, side: int, left: float, entered: bool
) -> tuple[int, int, tuple[float, float]] | None:
    """(sign, next side, bracket) of the first way out taken within ``left``, or None.

    Samples forty times a radian of the fastest motion and looks into every local maximum.
    """
    width, first = 0.025 / here.rate, True
    for begin in _chunks(left, 512 * width):
        t = np.linspace(begin, min(begin + 512 * width, left), 513)
        x, v = here.glance(t)
        best: tuple[int, int, tuple[float, float]] | None = None
        for sign, after in problem.exits(side):
            g, d = sign * x - problem.level(side, sign), sign * v
            # At the very entry g is zero up to rounding, and inwards: no way out.
            rises = (g[:-1] <= 0.0) & (g[1:] > 0.0)
            if entered and first and g[1] > 0.0 and d[0] < 0.0:
                rises[0] = True  # in and out again within one sample
            humps = (d[:-1] > 0.0) & (d[1:] < 0.0) & (g[:-1] <= 0.0) & (g[1:] <= 0.0)
            for i in np.flatnonzero(rises | humps):
                a, b = float(t[i]), float(t[i + 1])
                if not rises[i]:
                    b = brentq(lambda s: float(here.glance(np.array([s]))[1][0]), a, b, xtol=1e-300)
                    if sign * here.glance(np.array([b]))[0][0] <= problem.level(side, sign):
                        continue
                if d[i] < 0.0:
                    # Past the dip that follows the entry, so that the root found is not the entry.
                    a = brentq(lambda s: float(here.glance(np.array([s]))[1][0]), a, b, xtol=1e-300)
                if best is None or a < best[2][0]:
                    best = sign, after, (a, b)
                break
        if best is not None:
            return best
        first = False
    return None


def _chunks(left: float, width: float) -> Iterator[float]:
    return (i * width for i in range(max(1, math.ceil(left / width))))


def _root(here: _Segment, sign: Any, level: Any, bracket: tuple[float, float]) -> Any:
    """Newton, kept by bisection, until the step is below 30 digits."""
    a, b = mp.mpf(bracket[0]), mp.mpf(bracket[1])
    t = (a + b) / 2
    for _ in range(200):
        x = here.state(t)
        g, d = sign * x[0] - level, sign * x[1]
        if g > 0:
            b = t
        else:
            a = t
        u = t - g / d if d else (a + b) / 2
        if not a <= u <= b:
            u = (a + b) / 2
        if abs(u - t) <= mp.mpf(10) ** -30 * b or u == t:
            return u
        t = u
    return t


# ---------------------------------------------------------------------------------------------
# Competitors


def compile_rival(function: Function, *, inline: bool = False) -> Function:
    """Compile a competitor as our kernels are. inline : into all its callers."""
    how = {"fastmath": {"contract", "nsz", "arcp"}, "error_model": "numpy", "forceinline": inline}
    return numba.njit(**how)(function)  # type: ignore[no-any-return]


@compile_rival
def _rhs(t: float, x: Any, A: Any, B: Any, d: Any, omega: float) -> Any:
    out = np.empty(4)
    s = math.sin(omega * t)
    for i in range(4):
        out[i] = B[i] * s + d[i]
        for j in range(4):
            out[i] += A[i, j] * x[j]
    return out


def scipy_with_events(
    problem: Problem, start: Array, periods: int, method: str, tolerance: float
) -> Array:
    """``solve_ivp`` with rtol = atol = tolerance and terminal events at every change of mode.

    The right-hand side is compiled. A restart begins exactly on the boundary and leaves it, which
    its ``direction`` keeps from being found as an event again.
    """
    modes = {}
    for side in (-1, 0, 1):
        modes[side] = tuple(np.array(v, dtype=float) for v in problem.matrices(float, side))
    x, t, side = np.array(start, dtype=float), 0.0, problem.side_of(float(start[0]))
    end = periods * problem.period
    while True:
        events, exits = [], problem.exits(side)
        for sign, _ in exits:

            def event(
                _t: float,
                y: Array,
                *_args: Any,
                sign: int = sign,
                level: float = problem.level(side, sign),
            ) -> float:
                return float(sign * y[0] - level)

            event.terminal = True  # type: ignore[attr-defined]
            event.direction = 1.0  # type: ignore[attr-defined]
            events.append(event)
        run = solve_ivp(  # type: ignore[call-overload]
            _rhs,
            (t, end),
            x,
            method=method,
            rtol=max(tolerance, 2.3e-14),
            atol=tolerance,
            events=events or None,
            args=(*modes[side], problem.omega),
        )
        x, t = run.y[:, -1], float(run.t[-1])
        if run.status != 1:
            return np.asarray(x)
        side = exits[next(i for i, hit in enumerate(run.t_events) if len(hit))][1]


@compile_rival
def _rk4(
    x: float, v: float, y: float, u: float, rates: Array, gap: float, omega: float, steps: int,
    periods: int,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Both-sided stops, any damping; a0 to a10 are the coefficients of the equations."""
    a0, a1, a2, a3, a4, a5, a6, a7, f1, f2, mu = (
        rates[0], rates[1], rates[2], rates[3], rates[4], rates[5], rates[6], rates[7], rates[8],
        rates[9], rates[10],
    )  # fmt: skip
    h = 2.0 * math.pi / omega / steps
    half, sixth = 0.5 * h, h / 6.0
    for _ in range(periods):
        s0 = 0.0
        for i in range(steps):
            sm, s1 = math.sin(omega * (i + 0.5) * h), math.sin(omega * (i + 1) * h)
            n = min(max(x, -gap), gap)
            k1v = a0 * x + a1 * v + a2 * y + a3 * u - mu * (x - n) + f1 * s0
            k1u = a4 * x + a5 * v + a6 * y + a7 * u + f2 * s0
            p, q, r, w = x + half * v, v + half * k1v, y + half * u, u + half * k1u
            n = min(max(p, -gap), gap)
            k2x, k2y = q, w
            k2v = a0 * p + a1 * q + a2 * r + a3 * w - mu * (p - n) + f1 * sm
            k2u = a4 * p + a5 * q + a6 * r + a7 * w + f2 * sm
            p, q, r, w = x + half * k2x, v + half * k2v, y + half * k2y, u + half * k2u
            n = min(max(p, -gap), gap)
            k3x, k3y = q, w
            k3v = a0 * p + a1 * q + a2 * r + a3 * w - mu * (p - n) + f1 * sm
            k3u = a4 * p + a5 * q + a6 * r + a7 * w + f2 * sm
            p, q, r, w = x + h * k3x, v + h * k3v, y + h * k3y, u + h * k3u
            n = min(max(p, -gap), gap)
            k4v = a0 * p + a1 * q + a2 * r + a3 * w - mu * (p - n) + f1 * s1
            k4u = a4 * p + a5 * q + a6 * r + a7 * w + f2 * s1
            x, y = x + sixth * (v + 2.0 * (k2x + k3x) + q), y + sixth * (u + 2.0 * (k2y + k3y) + w)
            v += sixth * (k1v + 2.0 * (k2v + k3v) + k4v)
            u += sixth * (k1u + 2.0 * (k2u + k3u) + k4u)
            s0 = s1
    return x, v, y, u


def rk4(problem: Problem, start: Array, periods: int, steps: int) -> Array:
    """Classical Runge-Kutta with ``steps`` equal steps a period, compiled, blind to the stops."""
    A, B, _ = (np.array(v, dtype=float) for v in problem.matrices(float, 0))
    mu = problem.k0 / (1.0 - problem.k0)
    rates = np.concatenate([A[1], A[3], [B[1], B[3], mu]])
    x, v, y, u = (float(s) for s in start)
    return np.array(_rk4(x, v, y, u, rates, problem.b, problem.omega, steps, periods))


class Stops(NamedTuple):
    """Two even elastic stops of a clearance to ground."""

    state: int
    """Index of the displacement; its velocity comes next."""
    stiffness: float
    """Force over the mass, per displacement past a stop."""
    gap: float
    """Displacement at which either stop is touched."""


class Heyoka:
    """heyoka's Taylor integrator with terminal events: PyPI package ``heyoka`` or conda-forge.

    x' = A x + B sin(ω t), with stops. One integrator serves all modes: each stiffness and its
    constant are run-time parameters that an event's callback switches.

    Raises
    ------
    ImportError : heyoka is not installed.
    """

    def __init__(
        self,
        A: Sequence[Sequence[float]],
        B: Sequence[float],
        omega: float,
        stops: Sequence[Stops],
        tolerance: float,
    ) -> None:
        hy: Any = importlib.import_module("heyoka")

        self.omega, self.stops = omega, stops
        states = hy.make_vars(*[f"x{i}" for i in range(len(B))])
        drive = hy.sin(omega * hy.time)

        def rate(i: int) -> Any:
            terms = [z if a == 1.0 else a * z for a, z in zip(A[i], states, strict=True) if a]
            terms += [B[i] * drive] if B[i] else []
            for k, stop in enumerate(stops):
                if stop.state + 1 == i:
                    terms += [-hy.par[2 * k] * states[stop.state], hy.par[2 * k + 1]]
            return hy.sum(terms)

        def touch(k: int, side: int) -> Callable[[Any, int], bool]:
            on = self._contact(k, side)

            def callback(_: Any, direction: int) -> bool:
                pars[2 * k], pars[2 * k + 1] = on if direction == side else (0.0, 0.0)
                return True

            return callback

        self.integrator = hy.taylor_adaptive(
            [(z, rate(i)) for i, z in enumerate(states)],
            [0.0] * len(B),
            pars=[0.0] * (2 * len(stops)),
            tol=tolerance,
            t_events=[
                hy.t_event(states[stop.state] - side * stop.gap, callback=touch(k, side))
                for k, stop in enumerate(stops)
                for side in (1, -1)
            ],
        )
        pars = self.integrator.pars

    def _contact(self, k: int, side: int) -> tuple[float, float]:
        """Parameters with clearance k at its upper stop (1), its lower one (-1) or none (0)."""
        stop = self.stops[k]
        return stop.stiffness * abs(side), side * stop.stiffness * stop.gap

    def __call__(self, start: Array, periods: int) -> Array:
        ta = self.integrator
        ta.time = 0.0
        ta.state[:] = start
        for k, stop in enumerate(self.stops):
            x = float(start[stop.state])
            ta.pars[2 * k : 2 * k + 2] = self._contact(k, (x > stop.gap) - (x < -stop.gap))
        ta.reset_cooldowns()
        ta.propagate_until(periods * 2.0 * math.pi / self.omega)
        return np.array(ta.state)
