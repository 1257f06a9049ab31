"""Symmetric orbits by the half-period map: what tests compare ``shoot`` with."""

from __future__ import annotations

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.attractors import peaks_near
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus


def shoot_symmetric(flow: Flow, x: Array, n: int) -> tuple[Array, Array] | None:
    """A symmetric orbit of odd period n near x, by the half-period map, or None.

    x(t + nT/2) = mirror · x(t); the paper's Eq. (9) is the case of one impact on each stop. It
    cannot leave for an asymmetric branch, so beyond a pitchfork it follows the unstable symmetric
    orbit. Returns the point and the full monodromy matrix.
    """
    mirror = flow.system.mirror
    assert n % 2 == 1
    assert mirror is not None
    size, last = len(x), np.inf
    peak = peaks_near(flow, x)
    for _ in range(12):
        run = flow.run(x, n, points=2, stretches=n, tangent=np.eye(size))
        if run.status is not FlowStatus.DONE or run.tangent is None:
            return None
        step = mirror @ run.strobes[-1] - x
        half = mirror @ run.tangent
        error = float((np.abs(step) / peak).max())
        if error < 1e-11 or (error < 1e-9 and error >= 0.5 * last):
            return x, half @ half
        x = x - np.linalg.solve(half - np.eye(size), step)
        if not np.all(np.isfinite(x)) or np.abs(x).max() > 1e6 * peak.max():
            return None
        last = error
    return None
