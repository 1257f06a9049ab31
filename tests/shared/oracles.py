"""Slow, plain references that share no code with the package: what the tests hold it against."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, linprog

Array = NDArray[np.float64]

# ---------------------------------------------------------------------------------------------
# The model, written out once more from the corrected Eq. (4)


@dataclass(frozen=True)
class Plain:
    """Dimensionless parameters; ``upper`` and ``lower``: which stops exist."""

    m: float
    k: float
    k0: float
    c: float
    zeta: float
    f20: float
    b: float
    upper: bool = True
    lower: bool = True

    @property
    def mu(self) -> float:
        return self.k0 / (1.0 - self.k0)

    def stop_force(self, x: float, side: int) -> float:
        """Force of the stop that is touched: side 1 upper, -1 lower, 0 none."""
        return self.mu * (x - side * self.b) if side else 0.0

    def rhs(self, t: float, y: Array, omega: float, side: int) -> list[float]:
        x1, v1, x2, v2 = y
        ratio = self.m / (1.0 - self.m)
        force = math.sin(omega * t)
        a1 = (1.0 - self.f20) * force - 2.0 * self.zeta * (v1 - v2) - (x1 - x2)
        a1 -= self.stop_force(x1, side)
        a2 = self.f20 * force - 2.0 * self.zeta * (v2 / (1.0 - self.c) - v1)
        a2 -= x2 / (1.0 - self.k) - x1
        return [v1, a1, v2, a2 / ratio]

    def side_of(self, x: float) -> int:
        if self.mu > 0.0 and self.upper and x > self.b:
            return 1
        if self.mu > 0.0 and self.lower and x < -self.b:
            return -1
        return 0


@dataclass(frozen=True)
class Trajectory:
    """strobes : (periods + 1, 4); times, velocities, sides : of every impact."""

    strobes: Array
    times: Array
    velocities: Array
    sides: Array


def integrate(p: Plain, omega: float, y0: Sequence[float], periods: int) -> Trajectory:
    """DOP853 at rtol 1e-12, restarted at every event and at every strobe."""
    period = 2.0 * math.pi / omega
    y, side = np.array(y0, dtype=float), p.side_of(y0[0])
    strobes, impacts = [y.copy()], []
    for lap in range(periods):
        t = 0.0
        while t < period:
            exits: list[tuple[Callable[[float, Array], float], int]] = []
            if side == 0 and p.mu > 0.0:
                if p.upper:
                    exits.append((lambda _, s: s[0] - p.b, 1))
                if p.lower:
                    exits.append((lambda _, s: -s[0] - p.b, -1))
            elif side:
                exits.append((lambda _, s, here=side: p.b - here * s[0], 0))  # type: ignore[misc]
            events: list[Callable[[float, Array], float]] = []
            for guard, _ in exits:

                def event(at: float, s: Array, guard: object = guard) -> float:
                    return float(guard(at, s))  # type: ignore[operator]

                event.terminal = True  # type: ignore[attr-defined]
                event.direction = 1.0  # type: ignore[attr-defined]
                events.append(event)
            fastest = math.sqrt(1.0 + p.mu + 1.0 / (1.0 - p.k) * (1.0 - p.m) / p.m)
            solved = solve_ivp(
                lambda at, s, here=side: p.rhs(at, s, omega, here),
                (t, period),
                y,
                method="DOP853",
                rtol=1e-12,
                atol=1e-14,
                events=events or None,
                max_step=min(period / 40.0, 0.1 / fastest),
            )
            y, t = solved.y[:, -1].copy(), float(solved.t[-1])
            if solved.status != 1:
                break
            assert solved.t_events is not None
            which = next(i for i, found in enumerate(solved.t_events) if len(found))
            side = exits[which][1]
            if side:
                impacts.append((lap * period + t, float(y[1]), side))
                y[0] = side * p.b  # the root finder is good to 4 eps; the rest is the boundary
        strobes.append(y.copy())
    columns = np.array(impacts, dtype=float).reshape(-1, 3)
    return Trajectory(np.array(strobes), columns[:, 0], columns[:, 1], columns[:, 2])


def response_amplitude(p: Plain, omega: float) -> NDArray[np.complex128]:
    """Complex amplitudes of x1, x2 of the linear model (no stops): x = Im(X exp(i ω t))."""
    ratio, z2 = p.m / (1.0 - p.m), 2.0 * p.zeta
    s = 1j * omega
    matrix = np.array(
        [
            [s * s + z2 * s + 1.0, -z2 * s - 1.0],
            [-z2 * s - 1.0, ratio * s * s + z2 * s / (1.0 - p.c) + 1.0 / (1.0 - p.k)],
        ]
    )
    return np.asarray(np.linalg.solve(matrix, np.array([1.0 - p.f20, p.f20], dtype=complex)))


# ---------------------------------------------------------------------------------------------
# Any piecewise-linear system, by matrix exponentials and bisection


@dataclass(frozen=True)
class BruteResult:
    """strobes : (periods + 1, n); entries : (time, clearance, side) of every contact."""

    strobes: Array
    entries: list[tuple[float, int, int]]


def brute_flow(
    build: Callable[[tuple[int, ...]], object],
    key: tuple[int, ...],
    drive: tuple[float, float, float],
    x: Array,
    periods: int,
    samples: int = 400,
) -> BruteResult:
    """Scan each period at ``samples`` points; bisect where a guard has become positive.

    build : mode by key, with attributes A, B, d, guards (C, D, e, target) and sides. drive :
    omega, amplitude, offset. Blind to double crossings between two points, by design.
    """
    omega, amplitude, offset = drive
    period = 2.0 * math.pi / omega
    n = len(x)
    z = np.concatenate([x, [0.0, 1.0, 1.0]])
    strobes, entries = [x.copy()], []
    step = period / samples
    cache: dict[tuple[int, ...], tuple[object, Array, Array]] = {}

    def tables(of: tuple[int, ...]) -> tuple[object, Array, Array]:
        if of not in cache:
            mode = build(of)
            matrix = np.zeros((n + 3, n + 3))
            matrix[:n, :n] = mode.A  # type: ignore[attr-defined]
            matrix[:n, n] = amplitude * mode.B  # type: ignore[attr-defined]
            matrix[:n, n + 2] = mode.d + offset * mode.B  # type: ignore[attr-defined]
            matrix[n, n + 1], matrix[n + 1, n] = omega, -omega
            cache[of] = (mode, matrix, expm(matrix * step))
        return cache[of]

    def guards(mode: object, at: Array) -> list[float]:
        u = amplitude * at[n] + offset
        return [float(g.C @ at[:n] + g.D * u + g.e) for g in mode.guards]  # type: ignore[attr-defined]

    def rise(mode: object, matrix: Array, j: int, left: float, z: Array) -> float:
        """When guard j becomes positive: at once where it is positive and grows."""
        if guards(mode, z)[j] > 0.0:
            return 0.0
        least = 4.0 * np.finfo(float).eps
        return float(
            brentq(
                lambda t: guards(mode, expm(matrix * t) @ z)[j], 0.0, left, xtol=1e-300, rtol=least
            )
        )

    for lap in range(periods):
        t = 0.0
        for i in range(samples):
            end = (i + 1) * step
            while True:
                mode, matrix, whole = tables(key)
                left = end - t
                after = whole @ z if abs(left - step) < 1e-15 * period else expm(matrix * left) @ z
                crossed = [
                    j
                    for j, (v0, v1) in enumerate(
                        zip(guards(mode, z), guards(mode, after), strict=False)
                    )
                    if v1 > 0.0 and (v0 <= 0.0 or v1 > v0)
                ]
                if not crossed:
                    z, t = after, end
                    break
                when, j = min((rise(mode, matrix, j, left, z), j) for j in crossed)
                z = expm(matrix * when) @ z
                t += when
                target = mode.guards[j].target  # type: ignore[attr-defined]
                before, now = mode.sides, tables(target)[0].sides  # type: ignore[attr-defined]
                for c, (old, new) in enumerate(zip(before, now, strict=False)):
                    if new != old and new:
                        entries.append((lap * period + t, c, new))
                key = target
        z[n:] = [0.0, 1.0, 1.0]
        strobes.append(z[:n].copy())
    return BruteResult(np.array(strobes), entries)


# ---------------------------------------------------------------------------------------------
# The circuit's formulas, by hand from the paper's figures

TERMS = {
    # resistor: (equation, state fed in, sign of the coefficient, capacitor)
    "R1": (0, 1, 1.0, "C1"),
    "R2": (1, 1, -1.0, "C2"),
    "R3": (1, 3, 1.0, "C2"),
    "R4": (1, 0, -1.0, "C2"),
    "R5": (1, 2, 1.0, "C2"),
    "R7": (2, 3, 1.0, "C3"),
    "R8": (3, 1, 1.0, "C4"),
    "R9": (3, 3, -1.0, "C4"),
    "R10": (3, 0, 1.0, "C4"),
    "R11": (3, 2, -1.0, "C4"),
}
INVERTER = {
    "R1": ("R102", "R103"),
    "R3": ("R106", "R107"),
    "R5": ("R104", "R105"),
    "R7": ("R106", "R107"),
    "R8": ("R102", "R103"),
    "R10": ("R100", "R101"),
}


def linear_matrix(values: Mapping[str, float]) -> Array:
    """(4, 4) A of Eq. (12) without the stop, ideal op-amps; inverters as they are."""
    A = np.zeros((4, 4))
    for name, (i, j, sign, cap) in TERMS.items():
        gain = 1.0
        if name in INVERTER:
            r_in, r_fb = INVERTER[name]
            gain = values[r_fb] / values[r_in]
        A[i, j] = sign * gain / (values[name] * values[cap])
    return A


def dead_zone_gains(values: Mapping[str, float]) -> tuple[float, float, float]:
    """A+ to U3C's output, slope of the linear path at fv, gain from U3C's output to fv (divider
    loaded by R208): the paper's Fig. 5."""
    steep = values["R201"] * values["R203"] / (values["R200"] * values["R202"])
    lower = values["R205"] * values["R208"] / (values["R205"] + values["R208"])
    beta = lower / (values["R204"] + lower)
    linear = values["R207"] / values["R206"] * values["R210"] / values["R209"]
    return steep, linear, beta * values["R210"] / values["R208"]


def dead_zone_curve(
    v1: float, values: Mapping[str, float], rails: Mapping[str, tuple[float, float]]
) -> float:
    """fv at DC: every op-amp clipped at its own limits, infinite gain."""

    def clip(v: float, name: str) -> float:
        return min(max(v, rails[name][0]), rails[name][1])

    w1 = clip(-v1 * values["R201"] / values["R200"], "U3B")
    w2 = clip(-w1 * values["R203"] / values["R202"], "U3C")
    v12 = clip(-v1 * values["R207"] / values["R206"], "U3A")
    g4, g5, g8 = (1.0 / values[name] for name in ("R204", "R205", "R208"))
    v11 = w2 * g4 / (g4 + g5 + g8)  # the summing node is at 0 V while U3D is linear
    fv = -values["R210"] * (v11 * g8 + v12 / values["R209"])
    return clip(fv, "U3D")


def coefficient_error(values: Mapping[str, float], p: Plain) -> float:
    """The coefficient error from the formulas: a linear program over the free scales."""
    realised, wanted = linear_matrix(values), model_matrix(p)
    rows, h = [], []
    entries = [(i, j, realised[i, j], wanted[i, j]) for i, j in np.argwhere(wanted != 0.0)]
    null = 0.0
    if p.k0 > 0.0:
        steep, linear, through = dead_zone_gains(values)
        entries.append((1, 0, -linear / (values["R50"] * values["C2"]), -p.mu))
        null = p.mu * abs(math.log(steep * through / linear))
    for i, j, got, want in entries:
        if got / want <= 0.0:
            return math.inf
        row = np.zeros(5)  # ln seconds, ln volts of the four states
        row[0] = 1.0
        row[1 + j] += 1.0
        row[1 + i] -= 1.0
        rows.append(row)
        h.append(math.log(got / want))
    return max(minimax(np.array(h), np.array(rows)), null)


def model_matrix(p: Plain) -> Array:
    """(4, 4) A of the corrected Eq. (10) without the stop."""
    ratio, z2 = p.m / (1.0 - p.m), 2.0 * p.zeta
    return np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-1.0, -z2, 1.0, z2],
            [0.0, 0.0, 0.0, 1.0],
            [1.0 / ratio, z2 / ratio, -1.0 / (1.0 - p.k) / ratio, -z2 / (1.0 - p.c) / ratio],
        ]
    )


def minimax(h: Array, D: Array) -> float:
    """min over s of max |h + D s|, by linear programming."""
    m, n = D.shape
    found = linprog(
        np.concatenate([np.zeros(n), [1.0]]),
        A_ub=np.block([[D, -np.ones((m, 1))], [-D, -np.ones((m, 1))]]),
        b_ub=np.concatenate([-h, h]),
        bounds=[(None, None)] * n + [(0.0, None)],
        method="highs",
    )
    assert found.status == 0
    assert found.fun is not None
    return float(found.fun)


def elementary_vectors(D: Array) -> Array:
    """(k, m) vectors y of least support with y D = 0, each of unit 1-norm."""
    m, n = D.shape
    found: dict[tuple[int, ...], Array] = {}
    for size in range(1, n + 2):
        for rows in itertools.combinations(range(m), size):
            if any(set(old) <= set(rows) for old in found):
                continue
            part = D[list(rows)]
            if np.linalg.matrix_rank(part) != size - 1:
                continue
            null = np.linalg.svd(part.T)[2][-1]
            if np.abs(null).min() < 1e-9:
                continue
            y = np.zeros(m)
            y[list(rows)] = null / np.abs(null).sum()
            found[rows] = y
    return np.array(list(found.values()))


LINEAR_NAMES = ("R2", "R3", "R4", "R5", "R8", "R9", "R10", "R11", "R1", "R7")
_SCALES = np.array(
    [
        # alpha, p, q1, q3 in the realised coefficient of each resistor of LINEAR_NAMES
        [1, 0, 0, 0],
        [1, 1, 0, 0],
        [1, 0, 1, 0],
        [1, 1, 0, 1],
        [1, -1, 0, 0],
        [1, 0, 0, 0],
        [1, -1, 1, 0],
        [1, 0, 0, 1],
        [1, 0, -1, 0],
        [1, 0, 0, -1],
    ],
    dtype=float,
)
