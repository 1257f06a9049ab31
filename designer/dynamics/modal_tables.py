"""Set-up of the modal fast path: which systems it fits, and their tables.

Fits four states, a sine and one clearance whose guards all watch one displacement; everything
else, and any mode whose quadratics are nearly equal or whose modal matrix is ill-conditioned, goes
to the general kernel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array
from designer.dynamics.piecewise_linear import Drive, Mode, ModeKey, PiecewiseLinearSystem
from designer.kernels import kernel_modal as kernel
from designer.kernels.kernel_crossing import BLOCK_STEP, LAST, NODES, PARTS, TERMS
from designer.kernels.kernel_modal import ModalTables

Complex = NDArray[np.complex128]
WORST_CONDITION = 1e4
WORST_RESONANCE = 1e5
"""Of the equations of the forced motion: near an undamped resonance that motion is huge, and the
state is its small difference from the homogeneous one."""
TURNS = np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0.0, np.pi, 8, endpoint=False)])


def tables(system: PiecewiseLinearSystem, drive: Drive) -> ModalTables | None:
    """The tables of a system under a drive, or None where the fast path does not fit."""
    if system.size != 4 or len(system.clearances) != 1:
        return None
    if system.orders is not None or not drive.is_sine:
        return None
    modes = _modes(system)
    if modes is None:
        return None
    row = _displacement(modes, drive)
    if row is None:
        return None
    C, on_drive, limits = row
    data = np.zeros((3, kernel.WIDTH))
    data[:, kernel.LIMIT : kernel.LIMIT + 2] = limits
    to_modal, to_state = np.zeros((3, 4, 7)), np.zeros((3, 4, 7))
    known: dict[bytes, Oscillators | None] = {}  # both contacts have the same A
    for i, mode in modes.items():
        key = mode.A.tobytes()
        parts = known[key] if key in known else known.setdefault(key, oscillators_of(mode.A))
        forced = _forced(mode, drive)
        if parts is None or forced is None:
            return None
        to_state[i, :, :4], to_state[i, :, 4:] = parts.back, forced
        to_modal[i, :, :4], to_modal[i, :, 4:] = parts.G, -parts.G @ forced
        wave = np.append(C @ parts.back, C @ forced[:, :2] + [on_drive, 0.0])
        _fill(data[i], parts, drive.omega, wave, float(C @ forced[:, 2]))
    change = np.zeros((3, 3, 4, 7))
    for i in modes:
        for j in modes:
            if i != j:
                change[i, j] = to_modal[j, :, :4] @ to_state[i]
                change[i, j, :, 4:] += to_modal[j, :, 4:]
    for first, matrices in (
        (kernel.MODAL, to_modal),
        (kernel.STATE, to_state),
        (kernel.CHANGE, change),
    ):
        columns = matrices.swapaxes(-1, -2).reshape(3, -1)
        data[:, first : first + columns.shape[1]] = columns
    return ModalTables(data.ravel())


def keys(system: PiecewiseLinearSystem) -> list[ModeKey]:
    """Keys of the open, upper and lower mode, in the tables' order; () where there is none."""
    out: list[ModeKey] = [system.start, (), ()]
    for guard in system.mode(system.start).guards:
        out[1 if system.mode(guard.target).sides[0] > 0 else 2] = guard.target
    return out


def _modes(system: PiecewiseLinearSystem) -> dict[int, Mode] | None:
    """Open mode 0, upper contact 1, lower contact 2, if those are all there are."""
    open_mode = system.mode(system.start)
    modes = {0: open_mode}
    for guard in open_mode.guards:
        mode = system.mode(guard.target)
        only = len(mode.guards) == 1 and mode.guards[0].target == system.start
        number = {1: 1, -1: 2}.get(mode.sides[0], 0)
        if not only or number in modes or guard.clearance != 0 or mode.guards[0].clearance != 0:
            return None
        modes[number] = mode
    return modes if len(modes) > 1 and open_mode.sides == (0,) else None


def _displacement(modes: dict[int, Mode], drive: Drive) -> tuple[Array, float, Array] | None:
    """The guarded row (4,), its drive term, and (3, 2) limits of each mode; None if they differ."""
    some = 1 if 1 in modes else 2
    leaving = modes[some].guards[0]  # the way out of the upper contact is downwards
    sign = -1.0 if some == 1 else 1.0
    C, D = sign * leaving.C, sign * leaving.D
    limits = np.tile([-np.inf, np.inf], (3, 1))
    for number, mode in modes.items():
        for g in mode.guards:
            rising = 1.0 if np.dot(g.C, C) > 0.0 else -1.0
            if not (np.array_equal(rising * g.C, C) and rising * g.D == D):
                return None
            limits[number, 1 if rising > 0.0 else 0] = -rising * g.e - D * drive.offset
    return C, D * drive.amplitude, limits


@dataclass(frozen=True)
class Oscillators:
    """A mode's homogeneous motion: g = G x, x = back g, with y'' + p y' + q y = 0 twice in g."""

    factors: list[tuple[float, float]]
    """(p, q) factors of each pair of modal coordinates."""
    G: Array
    """Matrix of the change to the modal coordinates, g = G x."""
    back: Array
    """Matrix of the change to the states, x = back g."""
    rate: float
    """Largest modulus of an eigenvalue."""


def oscillators_of(A: Array) -> Oscillators | None:
    """None where the modal form cannot be trusted."""
    roots: Complex = np.linalg.eigvals(A).astype(complex)
    factors = _quadratics(roots)
    if factors is None:
        return None
    G = np.zeros((4, 4))
    for k, (p, q) in enumerate(factors):
        if p < 0.0 or q <= 0.0 or abs(q - 0.25 * p * p) < 1e-8 * q:
            return None
        left = _left_vector(A, p, q)
        G[2 * k], G[2 * k + 1] = left, left @ A
    scale = np.linalg.norm(G, axis=1)
    if np.linalg.cond(G / scale[:, None]) > WORST_CONDITION:
        return None
    back: Array = np.asarray(np.linalg.inv(G), dtype=np.float64)
    return Oscillators(factors, G, back, float(np.abs(roots).max()))


def _fill(data: Array, parts: Oscillators, w: float, row: Array, centre: float) -> None:
    """Tables of one mode with displacement row · state + centre, under a drive of frequency w."""
    factors = parts.factors
    M = np.zeros((6, 6))  # state' = M state, the drive's sine and cosine last
    M[4, 5], M[5, 4] = w, -w
    for k, (p, q) in enumerate(factors):
        M[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[0.0, 1.0], [-q, -p]]
    h = BLOCK_STEP / max(parts.rate, w)
    part = h / PARTS
    powers = [np.eye(6)]  # M^k
    for _ in range(TERMS - 1):
        powers.append(powers[-1] @ M)
    series = np.array(powers) / np.cumprod([1.0, *range(1, TERMS)])[:, None, None]
    times = np.arange(LAST + 1, dtype=np.float64) * part
    jump = np.zeros((LAST + 1, 6, 6))
    for k, (p, q) in enumerate(factors):
        jump[:, 2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = _closed(p, q, times)
    sin, cos = np.sin(w * times), np.cos(w * times)
    jump[:, 4, 4], jump[:, 4, 5], jump[:, 5, 4], jump[:, 5, 5] = cos, sin, -sin, cos
    shape = np.stack([row, row @ M])
    near = np.zeros((TERMS, 8))
    near[:, :6] = series[:, [1, 0, 3, 2, 4, 5], [1, 1, 3, 3, 5, 5]]
    columns = {
        kernel.STEP: np.array([h, part, 1.0 / part]),
        kernel.REST: np.array([h**4 / 288.0]),
        kernel.QUAD: np.array(factors),
        kernel.CENTRE: np.array([centre]),
        kernel.BOUND: _fourth(row, powers, factors),
        kernel.SCAN: np.moveaxis(shape @ jump[::PARTS], 0, -1).swapaxes(0, 1),
        kernel.LOCAL: (row @ series).T,
        kernel.NEAR: near,
        kernel.JUMP: np.concatenate(
            [
                jump[:, 0:2, 0:2].reshape(-1, 4),
                jump[:, 2:4, 2:4].reshape(-1, 4),
                jump[:, 4, 5:3:-1],
            ],
            axis=1,
        ),
    }
    assert columns[kernel.SCAN].shape == (6, 2, NODES)
    for first, values in columns.items():
        data[first : first + values.size] = values.ravel()


def _fourth(row: Array, powers: list[Array], factors: list[tuple[float, float]]) -> Array:
    """(9,) rows over each oscillator whose moduli add up to a bound of |d⁴ row·state/dt⁴|.

    The fourth derivative z of each part obeys the oscillator's own equation, so from now on
    |z| <= |z(0)| + |z'(0) + p/2 z(0)| · max |impulse response|.
    """
    fourth, fifth = row @ powers[4], row @ powers[5]
    out = []
    for k, (p, q) in enumerate(factors):
        own = slice(2 * k, 2 * k + 2)
        D = q - 0.25 * p * p
        w = np.sqrt(abs(D))
        slowest = 0.5 * p - (w if D < 0.0 else 0.0)
        # |exp(-σ t) sin(w t)/w| <= min(1/w, t exp(-σ t)), and sinh alike with the slower root.
        reach = min(1.0 / w, np.exp(-1.0) / slowest if slowest > 0.0 else np.inf)
        out += [*fourth[own], *(reach * (fifth[own] + 0.5 * p * fourth[own]))]
    return np.array([*out, np.hypot(fourth[4], fourth[5])])


def _quadratics(roots: Complex) -> list[tuple[float, float]] | None:
    """The characteristic polynomial as two real quadratics λ² + p λ + q, or None if they meet."""
    oscillating = sorted(
        (z for z in roots if z.imag > 1e-12 * abs(z)), key=lambda z: (abs(z), z.real)
    )
    real = sorted(z.real for z in roots if abs(z.imag) <= 1e-12 * abs(z))
    factors = [(-2.0 * z.real, abs(z) ** 2) for z in oscillating]
    if len(factors) == 1:
        factors.append((-(real[0] + real[1]), real[0] * real[1]))
    elif len(factors) == 0:
        # The two slow ones together, the two fast ones together: best apart.
        factors = [
            (-(real[0] + real[1]), real[0] * real[1]),
            (-(real[2] + real[3]), real[2] * real[3]),
        ]
    if len(factors) != 2:
        return None
    (p1, q1), (p2, q2) = factors
    if abs(q1 - q2) + abs(p1 - p2) * np.sqrt(abs(q1)) < 1e-3 * (abs(q1) + abs(q2)):
        return None
    return [(float(p), float(q)) for p, q in factors]


def _left_vector(A: Array, p: float, q: float) -> Array:
    """l (4,) with l (A² + p A + q) = 0, so that y = l x obeys y'' + p y' + q y = 0."""
    N = A @ A + p * A + q * np.eye(4)
    u, _, _ = np.linalg.svd(N)
    candidates = u[:, 2:].T
    # Of the two-dimensional space take the vector best apart from its own image.
    vectors = TURNS @ candidates
    images = vectors @ A
    along = np.abs((vectors * images).sum(axis=1)) / np.sqrt((images * images).sum(axis=1))
    return np.asarray(vectors[np.argmin(along)])


def _forced(mode: Mode, drive: Drive) -> Array | None:
    """(4, 3) particular solution over (sin, cos, 1), or None near an undamped resonance."""
    w = drive.omega
    B = drive.amplitude * mode.B
    M = mode.A @ mode.A + w * w * np.eye(4)
    if max(np.linalg.cond(M), np.linalg.cond(mode.A)) > WORST_RESONANCE:
        return None
    Q = np.linalg.solve(M, -w * B)
    P = mode.A @ Q / w
    K = np.linalg.solve(mode.A, -(mode.d + drive.offset * mode.B))
    return np.stack([P, Q, K], axis=1)


def _closed(p: float, q: float, t: Array) -> Array:
    """(k, 2, 2) the propagators of y'' + p y' + q y = 0 over times t (k,)."""
    sigma, D = 0.5 * p, q - 0.25 * p * p
    w = np.sqrt(abs(D))
    if D > 0.0:
        fade = np.exp(-sigma * t)
        c, s = fade * np.cos(w * t), fade * np.sin(w * t) / w
    else:  # not cosh and sinh: they overflow where the product does not
        slow, fast = np.exp((w - sigma) * t), np.exp(-(w + sigma) * t)
        c, s = 0.5 * (slow + fast), 0.5 * (slow - fast) / w
    rows = [[c + sigma * s, s], [-q * s, c - sigma * s]]
    return np.moveaxis(np.array(rows), -1, 0)
