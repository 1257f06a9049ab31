"""Set-up of the modal fast path: which systems it fits, and their tables.

Fits four states and at most one clearance whose guards all watch one displacement; everything
else, and any mode whose quadratics are nearly equal or whose modal matrix is ill-conditioned, goes
to the general kernel.
"""

from __future__ import annotations

import numpy as np

from designer import modal_kernel as kernel
from designer.modal_kernel import PARTS, ModalTables
from designer.system import Array, Drive, Mode, ModeKey, PiecewiseLinearSystem

STEP = 0.9
"""h · max(|lambda|, omega): longer steps fail the hull more often."""
WORST_CONDITION = 1e4


def tables(system: PiecewiseLinearSystem, drive: Drive) -> ModalTables | None:
    """The tables of a system under a drive, or None where the fast path does not fit."""
    if system.size != 4 or len(system.clearances) != 1:
        return None
    modes = _modes(system)
    if modes is None:
        return None
    row = _displacement(modes, drive)
    if row is None:
        return None
    C, on_drive, limits = row
    out = ModalTables(
        data=np.zeros((3, kernel.WIDTH)),
        change=np.zeros((3, 3, 4, 7)),
        to_modal=np.zeros((3, 4, 7)),
        to_state=np.zeros((3, 4, 7)),
    )
    out.data[:, kernel.LIMIT : kernel.LIMIT + 2] = limits
    for i, mode in modes.items():
        if not _fill(out, i, mode, drive, C, on_drive):
            return None
    for i in modes:
        for j in modes:
            if i != j:
                out.change[i, j, :, :4] = out.to_modal[j, :, :4] @ out.to_state[i, :, :4]
                out.change[i, j, :, 4:] = (
                    out.to_modal[j, :, :4] @ out.to_state[i, :, 4:] + out.to_modal[j, :, 4:]
                )
    return out


def keys(system: PiecewiseLinearSystem) -> list[ModeKey]:
    """Keys of the open, upper and lower mode, in the tables' order; () where there is none."""
    out: list[ModeKey] = [system.start, (), ()]
    for guard in system.mode(system.start).guards:
        out[1 if system.mode(guard.target).sides[0] > 0 else 2] = guard.target
    return out


def _modes(system: PiecewiseLinearSystem) -> dict[int, Mode] | None:
    """Open mode 0, upper contact 1, lower contact 2, if those are all there are."""
    open_mode = system.mode(system.start)
    found = {0: open_mode}
    for guard in open_mode.guards:
        mode = system.mode(guard.target)
        only = len(mode.guards) == 1 and mode.guards[0].target == system.start
        number = {1: 1, -1: 2}.get(mode.sides[0], 0)
        if not only or number in found or guard.clearance != 0 or mode.guards[0].clearance != 0:
            return None
        found[number] = mode
    return found if len(found) > 1 and open_mode.sides == (0,) else None


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


def _fill(out: ModalTables, i: int, mode: Mode, drive: Drive, C: Array, on_drive: float) -> bool:
    """Tables of one mode; False where the modal form cannot be trusted."""
    factors, forced = _quadratics(mode.A), _forced(mode, drive)
    if factors is None or forced is None:
        return False
    G = np.zeros((4, 4))
    companion = np.zeros((4, 4))
    quad = np.zeros((2, 3))
    for k, (p, q) in enumerate(factors):
        left = _left_vector(mode.A, p, q)
        G[2 * k], G[2 * k + 1] = left, left @ mode.A
        companion[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[0.0, 1.0], [-q, -p]]
        quad[k] = 0.5 * p, q, q - 0.25 * p * p
        if p < 0.0 or q <= 0.0 or abs(quad[k, 2]) < 1e-8 * q:
            return False
    scale = np.linalg.norm(G, axis=1)
    if np.linalg.cond(G / scale[:, None]) > WORST_CONDITION:
        return False
    back = np.linalg.inv(G)
    out.to_state[i, :, :4], out.to_state[i, :, 4:] = back, forced
    out.to_modal[i, :, :4], out.to_modal[i, :, 4:] = G, -G @ forced
    w = drive.omega
    h = STEP / max(float(np.abs(np.linalg.eigvals(mode.A)).max()), w)
    times = h * np.arange(PARTS + 1) / PARTS
    row = C @ back
    wave = C @ forced + np.array([on_drive, 0.0, 0.0])
    rate = np.where(quad[:, 2] > 0.0, np.sqrt(quad[:, 1]), quad[:, 0] + np.sqrt(abs(quad[:, 2])))
    columns = {
        kernel.STEP: np.array([h]),
        kernel.OMEGA: np.array([w]),
        kernel.QUAD: quad,
        kernel.SHAPE: np.stack([row, row @ companion]),
        kernel.FORCED: np.stack([wave, np.array([-w * wave[1], w * wave[0], 0.0])]),
        # |d⁴y| <= |lambda|⁴ amplitude; where overdamped the faster exponential bounds both.
        kernel.BOUND: np.append(
            rate**4 * (np.abs(row[0::2]) + rate * np.abs(row[1::2])),
            w**4 * float(np.hypot(wave[0], wave[1])),
        ),
        kernel.PROP: np.stack([_closed(q, times) for q in quad], axis=1),
        kernel.TURN: np.stack([np.sin(w * times), np.cos(w * times)], axis=1),
    }
    for first, values in columns.items():
        out.data[i, first : first + values.size] = values.ravel()
    return True


def _quadratics(A: Array) -> list[tuple[float, float]] | None:
    """The characteristic polynomial as two real quadratics λ² + p λ + q, or None if they meet."""
    roots = np.linalg.eigvals(A)
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
    best, spread = candidates[0], -1.0
    for angle in np.linspace(0.0, np.pi, 8, endpoint=False):
        v = np.cos(angle) * candidates[0] + np.sin(angle) * candidates[1]
        w = v @ A
        apart = 1.0 - abs(float(v @ w)) / float(np.linalg.norm(w))
        if apart > spread:
            best, spread = v, apart
    return np.asarray(best)


def _forced(mode: Mode, drive: Drive) -> Array | None:
    """(4, 3) particular solution over (sin, cos, 1), or None at an undamped resonance."""
    w = drive.omega
    B = drive.amplitude * mode.B
    M = mode.A @ mode.A + w * w * np.eye(4)
    if np.linalg.cond(M) > 1e12 or np.linalg.cond(mode.A) > 1e12:
        return None
    Q = np.linalg.solve(M, -w * B)
    P = mode.A @ Q / w
    K = np.linalg.solve(mode.A, -(mode.d + drive.offset * mode.B))
    return np.stack([P, Q, K], axis=1)


def _closed(quad: Array, t: Array) -> Array:
    """(k, 4) the 2 x 2 propagators over times t (k,), by rows (NumPy twin of the kernel's)."""
    sigma, q, D = quad
    w = np.sqrt(abs(D))
    if D > 0.0:
        fade = np.exp(-sigma * t)
        c, s = fade * np.cos(w * t), fade * np.sin(w * t) / w
    else:
        slow, fast = np.exp((w - sigma) * t), np.exp(-(w + sigma) * t)
        c, s = 0.5 * (slow + fast), 0.5 * (slow - fast) / w
    return np.stack([c + sigma * s, s, -q * s, c - sigma * s], axis=1)
