"""Tables of the modal fast path for many models and drive frequencies at once.

What ``dynamics.modal_tables.tables`` makes for one system, in batches: a sweep or a map changes the
model or the drive at every point, and one set-up would cost as much as a thousand drive periods.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from designer.base.arrays import Array
from designer.dynamics import modal_tables
from designer.dynamics.modal_tables import WORST_RESONANCE, Oscillators
from designer.kernels import kernel_modal as kernel
from designer.kernels.kernel_crossing import BLOCK_STEP, LAST, NODES, PARTS, TERMS
from designer.kernels.kernel_modal import ModalTables
from designer.model.clearance import POSITIONS
from designer.model.mechanics import MechanicalModel
from designer.model.model import Dimensionless


class ModalBatch:
    """Makes tables; keeps the oscillators of the matrices it has met."""

    def __init__(self) -> None:
        self._known: dict[bytes, Oscillators | None] = {}

    def tables(
        self, given: Sequence[MechanicalModel], omegas: Sequence[float]
    ) -> list[ModalTables | None]:
        """For each model under its drive frequency; None where the fast path does not fit."""
        out: list[ModalTables | None] = [None] * len(given)
        models = [model for model in given if isinstance(model, Dimensionless)]
        if len(models) < len(given):
            return out
        systems = [m.second_order() for m in models]
        open_ = [s.state_matrix() for s in systems]
        touched = [A.copy() for A in open_]
        for A, system, model in zip(touched, systems, models, strict=True):
            A[1, 0] -= model.mu / system.mass[0]
        pairs = [
            (self._oscillators(a), self._oscillators(c))
            for a, c in zip(open_, touched, strict=True)
        ]
        fit = [i for i, m in enumerate(models) if m.k0 > 0.0 and None not in pairs[i]]
        if not fit:
            return out
        w = np.array([omegas[i] for i in fit])
        B = np.zeros((len(fit), 4))
        for row, i in enumerate(fit):
            B[row, 1::2] = systems[i].force / systems[i].mass
        push = np.array([models[i].mu * models[i].b / systems[i].mass[0] for i in fit])
        both = []
        for place, matrices in enumerate((open_, touched)):
            A = np.array([matrices[i] for i in fit])
            both.append(_Forced(A, B, w, [pairs[i][place] for i in fit]))
        data = np.zeros((len(fit), 3, kernel.WIDTH))
        d = np.zeros((len(fit), 3, 4))
        d[:, 1, 1], d[:, 2, 1] = push, -push
        b = np.array([models[i].b for i in fit])
        limits = np.empty((len(fit), 3, 2))
        limits[:, 0] = [-np.inf, np.inf]
        limits[:, 1] = np.stack([b, np.full_like(b, np.inf)], axis=1)
        limits[:, 2] = np.stack([np.full_like(b, -np.inf), -b], axis=1)
        for row, i in enumerate(fit):
            for side in POSITIONS[models[i].sides]:
                limits[row, 0, 1 if side > 0 else 0] = side * b[row]
        good = both[0].fine & both[1].fine
        to_modal, to_state = [], []
        both[0].write(data[:, 0])
        both[1].write(data[:, 1])
        data[:, 2] = data[:, 1]
        data[:, :, kernel.LIMIT : kernel.LIMIT + 2] = limits
        for m, forced in enumerate((both[0], both[1], both[1])):
            K = forced.constant(d[:, m])
            data[:, m, kernel.CENTRE] = K[:, 0]
            wave = np.stack([forced.P, forced.Q, K], axis=2)
            to_state.append(np.concatenate([forced.back, wave], axis=2))
            to_modal.append(np.concatenate([forced.G, -forced.G @ wave], axis=2))
        for m in range(3):
            _put(data[:, m], kernel.MODAL, to_modal[m])
            _put(data[:, m], kernel.STATE, to_state[m])
            for n in range(3):
                if m != n:
                    change = to_modal[n][:, :, :4] @ to_state[m]
                    change[:, :, 4:] += to_modal[n][:, :, 4:]
                    _put(data[:, m], kernel.CHANGE + 28 * n, change)
        for row, i in enumerate(fit):
            if good[row]:
                out[i] = ModalTables(data[row].ravel())
        return out

    def _oscillators(self, A: Array) -> Oscillators | None:
        key = A.tobytes()
        if key not in self._known:
            self._known[key] = modal_tables.oscillators_of(A)
        return self._known[key]


class _Forced:
    """One kind of mode of N systems: free oscillators and forced motion."""

    def __init__(self, A: Array, B: Array, w: Array, parts: Sequence[Oscillators | None]) -> None:
        known = [p for p in parts if p is not None]
        assert len(known) == len(A)
        self.A, self.w = A, w
        self.G = np.array([p.G for p in known])
        self.back = np.array([p.back for p in known])
        self.factors = np.array([p.factors for p in known])
        self.rate = np.array([p.rate for p in known])
        M = A @ A + (w * w)[:, None, None] * np.eye(4)
        _, first, which = np.unique(
            A.reshape(len(A), -1), axis=0, return_index=True, return_inverse=True
        )
        worst = np.maximum(np.linalg.cond(M), np.linalg.cond(A[first])[which])
        self.fine = worst <= WORST_RESONANCE
        M[~self.fine] = np.eye(4)  # its tables are not used
        self.Q = np.linalg.solve(M, (-w[:, None] * B)[:, :, None])[:, :, 0]
        self.P = np.einsum("nij,nj->ni", A, self.Q) / w[:, None]

    def constant(self, d: Array) -> Array:
        """(N, 4) the state at rest under the constant terms d (N, 4)."""
        return np.asarray(np.linalg.solve(self.A, -d[:, :, None])[:, :, 0])

    def write(self, data: Array) -> None:
        """Columns of one mode, data (N, WIDTH), but for the limits and the centre;
        ``modal_tables._fill`` says what they are."""
        w, count = self.w, len(self.w)
        M = np.zeros((count, 6, 6))
        M[:, 4, 5], M[:, 5, 4] = w, -w
        for k in range(2):
            p, q = self.factors[:, k].T
            M[:, 2 * k, 2 * k + 1] = 1.0
            M[:, 2 * k + 1, 2 * k], M[:, 2 * k + 1, 2 * k + 1] = -q, -p
        h = BLOCK_STEP / np.maximum(self.rate, w)
        part = h / PARTS
        powers = [np.broadcast_to(np.eye(6), M.shape)]
        for _ in range(TERMS - 1):
            powers.append(powers[-1] @ M)
        series = np.stack(powers, axis=1) / np.cumprod([1.0, *range(1, TERMS)])[:, None, None]
        times = np.arange(LAST + 1) * part[:, None]
        jump = np.zeros((count, LAST + 1, 6, 6))
        for k in range(2):
            own = slice(2 * k, 2 * k + 2)
            jump[:, :, own, own] = _closed(self.factors[:, k], times)
        sin, cos = np.sin(w[:, None] * times), np.cos(w[:, None] * times)
        jump[:, :, 4, 4], jump[:, :, 4, 5] = cos, sin
        jump[:, :, 5, 4], jump[:, :, 5, 5] = -sin, cos
        row = np.concatenate([self.back[:, 0], self.P[:, :1], self.Q[:, :1]], axis=1)
        rate = (row[:, None] @ M)[:, 0]
        scan = np.stack([row, rate], axis=1)[:, None] @ jump[:, ::PARTS]
        assert scan.shape == (count, NODES, 2, 6)
        near = np.zeros((count, TERMS, 8))
        near[:, :, :6] = series[:, :, [1, 0, 3, 2, 4, 5], [1, 1, 3, 3, 5, 5]]
        for first, values in (
            (kernel.STEP, np.stack([h, part, 1.0 / part], axis=1)),
            (kernel.REST, h[:, None] ** 4 / 288.0),
            (kernel.QUAD, self.factors),
            (kernel.BOUND, self._fourth(row, powers)),
            (kernel.SCAN, scan.transpose(0, 3, 2, 1)),
            (kernel.LOCAL, (row[:, None, None] @ series)[:, :, 0].swapaxes(1, 2)),
            (kernel.NEAR, near),
        ):
            flat = values.reshape(count, -1)
            data[:, first : first + flat.shape[1]] = flat
        table = np.concatenate(
            [
                jump[:, :, 0:2, 0:2].reshape(count, -1, 4),
                jump[:, :, 2:4, 2:4].reshape(count, -1, 4),
                jump[:, :, 4, 5:3:-1],
            ],
            axis=2,
        )
        data[:, kernel.JUMP : kernel.JUMP + 10 * (LAST + 1)] = table.reshape(count, -1)

    def _fourth(self, row: Array, powers: list[Array]) -> Array:
        """(N, 9) as ``modal_tables._fourth``."""
        fourth, fifth = (row[:, None] @ powers[4])[:, 0], (row[:, None] @ powers[5])[:, 0]
        out = np.empty((len(row), 9))
        for k in range(2):
            own = slice(2 * k, 2 * k + 2)
            p, q = self.factors[:, k].T
            D = q - 0.25 * p * p
            w = np.sqrt(np.abs(D))
            slowest = 0.5 * p - np.where(D < 0.0, w, 0.0)
            with np.errstate(divide="ignore"):
                fade = np.where(slowest > 0.0, np.exp(-1.0) / slowest, np.inf)
            reach = np.minimum(1.0 / w, fade)
            out[:, 4 * k : 4 * k + 2] = fourth[:, own]
            out[:, 4 * k + 2 : 4 * k + 4] = reach[:, None] * (
                fifth[:, own] + 0.5 * p[:, None] * fourth[:, own]
            )
        out[:, 8] = np.hypot(fourth[:, 4], fourth[:, 5])
        return out


def _closed(factors: Array, t: Array) -> Array:
    """(N, k, 2, 2) as ``modal_tables._closed``, for factors (N, 2) over times t (N, k)."""
    p, q = factors[:, 0], factors[:, 1]
    sigma, D = 0.5 * p[:, None], (q - 0.25 * p * p)[:, None]
    w = np.sqrt(np.abs(D))
    fade = np.exp(-sigma * t)
    slow, fast = np.exp((np.where(D < 0.0, w, 0.0) - sigma) * t), np.exp(-(w + sigma) * t)
    turning = D > 0.0
    c = np.where(turning, fade * np.cos(w * t), 0.5 * (slow + fast))
    s = np.where(turning, fade * np.sin(w * t), 0.5 * (slow - fast)) / w
    rows = [[c + sigma * s, s], [-q[:, None] * s, c - sigma * s]]
    return np.moveaxis(np.array(rows), (0, 1), (2, 3))


def _put(data: Array, first: int, matrices: Array) -> None:
    """Write (N, rows, columns) by columns."""
    columns = matrices.swapaxes(1, 2).reshape(len(matrices), -1)
    data[:, first : first + columns.shape[1]] = columns
