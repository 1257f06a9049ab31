"""Motion on a torus: strobes that run around a closed curve, by an angle that no period divides.

The strobes of such a motion are x_k = X(ρ k mod 1), X a closed curve, ρ the rotation number in
turns of the curve per drive period. ρ is the phase advance of the strobes' strongest line between
two halves of a run, averaged with the weight exp(-1/(t(1 - t))), which on a smooth torus converges
faster than any power (S. Das, Y. Saiki, E. Sander, J. A. Yorke, Nonlinearity 30, 2017, 4111). It is
taken for a torus where all of this holds:

- both halves give the same ρ, and the line the same amplitude: it neither drifts nor fades;
- in the order of ρ k mod 1 neighbours lie near each other, the nearer the more of them there are:
  the strobes lie on one curve, which neither a chaotic band nor a harmonic of ρ passes;
- ρ k mod 1 leaves no gap, and no strobe comes back to an earlier one: no period, however long.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.piecewise_linear import ModeKey

LINES = 12
"""Strongest lines of the strobes' spectrum that are tried for the curve's own."""
DRIFT = 1e-6
"""Turns per drive period by which the two halves of a run may differ in ρ."""
FADING = 1e-4
"""By which the line's amplitude may differ between the two halves."""
ROUGH = 0.1
"""Root mean square distance of neighbours on the curve, over that of two strobes drawn at random:
above it there is no curve."""
FINER = 1.5
"""How many times nearer they are at least than those of a quarter of the strobes."""
GAP = 32.0
"""Widest gap between neighbours' angles, over what even ones would leave."""
CLOSED = 1e-8
"""Of the spread of each state: a strobe this near to an earlier one has a period."""
STILL = 1e-7
"""Of its peak: a state that the strobes spread over less tells nothing."""
POINTS, PERIODS = 32, 512
"""Of the trace that the second frequency is looked for in."""
HIGHEST = 6
"""Drive frequency's multiple around which it is looked for at most."""


@dataclass(frozen=True)
class ClosedCurve:
    """The curve that the strobes of a motion run around."""

    rotation: float
    """Turns per drive period, in (0, 0.5]: up to a whole number, and to the sense of turning."""
    error: float
    """By how much the two halves of the run differ in it."""


def closed_curve(strobes: Array) -> ClosedCurve | None:
    """The curve that strobes (k, states) run around; None where they show none."""
    peak = np.maximum(np.abs(strobes).max(axis=0), 1e-300)
    spread = np.ptp(strobes, axis=0)
    moving = spread > STILL * peak
    if not moving.any():
        return None
    x = (strobes[:, moving] - strobes[:, moving].mean(axis=0)) / spread[moving]
    half = len(x) // 2
    if np.abs(x[-1 - half : -1] - x[-1]).max(axis=1).min() < CLOSED:
        return None
    for line in _lines(x):
        rotation = _refined(x, line)
        if not 0.0 < rotation <= 0.5:
            continue
        first, second = (float(np.linalg.norm(part)) for part in _halves(x, rotation))
        if abs(second - first) > FADING * first:  # so chaos ends here, and most lines of a torus
            continue
        drift = abs(_refined(x[:half], line) - _refined(x[half : 2 * half], line))
        if drift < DRIFT and _is_curve(x, rotation):
            return ClosedCurve(rotation, drift)
    return None


def frequencies(
    flow: Flow, x: Array, mode: ModeKey | None, curve: ClosedCurve
) -> tuple[float, float]:
    """The drive's angular frequency, and the second one of a motion on a torus, per unit of the
    system's time.

    The second is ω |k ± ρ| with the whole number k for which the displacement in the first
    clearance has its strongest line, or of a system without one the first moving state.
    """
    omega, rotation = flow.drive.omega, curve.rotation
    run = flow.run(x, PERIODS, mode=mode, points=POINTS)
    if run.status is not FlowStatus.DONE:
        return omega, rotation * omega
    system = flow.system
    row = system.displacement[0][: system.size] if system.displacement else np.eye(system.size)[0]
    trace = (run.strobes[:-1] - run.strobes[:-1].mean(axis=0)) @ row
    places = [abs(k + s * rotation) for k in range(HIGHEST + 1) for s in (1, -1)]
    sizes = [abs(complex(_amplitude(trace[:, None], f / POINTS)[0])) for f in places]
    return omega, places[int(np.argmax(sizes))] * omega


# ---------------------------------------------------------------------------------------------


@lru_cache(maxsize=8)
def _weights(count: int) -> Array:
    """(count,) the bump, with the sum 1."""
    t = (np.arange(count) + 1.0) / (count + 1.0)
    bump = np.exp(-1.0 / (t * (1.0 - t)))
    return np.asarray(bump / bump.sum())


def _amplitude(x: Array, line: float) -> NDArray[np.complex128]:
    """(states,) complex amplitude of a line in x (k, states), its phase that at x[0]."""
    real, imaginary = _turning(len(x), line) @ x
    return np.asarray(real + 1j * imaginary)


def _halves(x: Array, line: float) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """``_amplitude`` of a line in each half of x (k, states)."""
    half = len(x) // 2
    turning = _turning(half, line)
    (a, b), (c, d) = turning @ x[:half], turning @ x[half : 2 * half]
    return np.asarray(a + 1j * b), np.asarray(c + 1j * d)


def _turning(count: int, line: float) -> Array:
    """(2, count) real and imaginary part of a line's conjugate, weighted. Two real rows, for numpy
    is a hundred times slower where a complex matrix meets a real one."""
    angle = 2.0 * np.pi * line * np.arange(count)
    return np.asarray(_weights(count) * np.stack([np.cos(angle), -np.sin(angle)]))


def _lines(x: Array) -> list[float]:
    """Frequencies of the strongest peaks in the spectrum of x (k, states), the strongest first."""
    weights = _weights(len(x))[:, None]
    shaped = weights * (x - (weights * x).sum(axis=0))
    power = (np.abs(np.fft.rfft(shaped, axis=0)) ** 2).sum(axis=1)
    inner = power[1:-1]
    peaks = 1 + np.flatnonzero((inner >= power[:-2]) & (inner >= power[2:]))
    strongest = peaks[np.argsort(-power[peaks])][:LINES]
    return [float(k) / len(x) for k in strongest]


def _refined(x: Array, line: float) -> float:
    """The frequency of a line that is known to half a place of the spectrum of x (k, states)."""
    half = len(x) // 2
    for _ in range(4):
        first, second = _halves(x, line)
        turned = np.vdot(first, second) * np.exp(-2j * np.pi * line * half)
        line += float(np.angle(turned)) / (2.0 * np.pi * half)
    return line


def _is_curve(x: Array, rotation: float) -> bool:
    """Whether x (k, states), in the order of their angles, lie on a curve and leave no gap."""
    angle = np.sort((rotation * np.arange(len(x))) % 1.0)
    widest = float(np.diff(np.append(angle, angle[0] + 1.0)).max())
    if widest * len(x) > GAP:
        return False
    rough = _roughness(x, rotation)
    return rough < ROUGH and _roughness(x[: len(x) // 4], rotation) > FINER * rough


def _roughness(x: Array, rotation: float) -> float:
    """See ``ROUGH``."""
    order = np.argsort((rotation * np.arange(len(x))) % 1.0)
    along = np.append(order, order[0])
    steps = (np.diff(x[along], axis=0) ** 2).sum(axis=1).mean()
    return float(np.sqrt(steps / (2.0 * x.var(axis=0).sum())))
