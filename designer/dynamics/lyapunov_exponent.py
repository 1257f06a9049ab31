"""The largest Lyapunov exponent of a motion without a period, with its standard error.

A tangent vector is carried by the exact variational flow and renormalised every few drive periods;
the exponent is the mean of its growth, which is a correlated series. The error is by batch means,
with what neighbouring batches still have in common (J. M. Flegal and G. L. Jones, Ann. Stat. 38,
2010, 1034). A run is made longer until the error is below a bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import SURE
from designer.dynamics.piecewise_linear import ModeKey

BLOCK = 5
"""Drive periods between two renormalisations of the tangent vector."""
BATCHES = 64
"""Batches of the series: few enough to be long against the motion's memory."""


LEAST = 1e-6
"""Growth per drive period that is never told from 0: less is rounding."""


class Bound(NamedTuple):
    """How small the standard error has to become, and how much is run for it."""

    relative: float = 0.01
    """Of the exponent."""
    absolute: float = 1e-3
    """Of the growth per drive period: enough where the exponent is next to nothing."""
    periods: int = 50_000
    """Drive periods that are run at most."""

    def met(self, rates: Array) -> bool:
        """Whether a series of growth rates per drive period is enough."""
        if len(rates) < BATCHES:
            return False
        return self.holds(float(rates.mean()), batch_error(rates), 1.0)

    def holds(self, value: float, error: float, period: float) -> bool:
        """Whether an exponent per unit of time has a small enough error; period : of the drive."""
        return error <= max(self.relative * abs(value), self.absolute / period)


@dataclass(frozen=True)
class LyapunovExponent:
    """An exponent, and where the motion was left."""

    rates: Array
    """(k,) growth of the tangent vector per drive period, over ``BLOCK`` periods each."""
    period: float
    start: Array
    """(states,) the strobe that was reached."""
    mode: ModeKey
    """Mode that holds there."""

    @property
    def value(self) -> float:
        """Per unit of the system's time; 0 where nothing was run."""
        return float(self.rates.sum() / max(len(self.rates), 1) / self.period)

    @property
    def error(self) -> float:
        """Standard error of ``value``."""
        return batch_error(self.rates) / self.period

    @property
    def sign(self) -> int:
        """1 or -1 where it is surely above or below 0, else 0."""
        return sign(self.rates)


def batch_error(rates: Array) -> float:
    """Standard error of the mean of a stationary series (k,); nan of fewer than two figures.

    Where neighbouring batches are alike, that is counted; what is remembered over more than a batch
    is not seen.
    """
    count = min(BATCHES, len(rates))
    if count < 2:
        return float("nan")
    size = len(rates) // count
    means = rates[len(rates) - count * size :].reshape(count, size).mean(axis=1)
    off = means - means.mean()
    shared = max(float(off[1:] @ off[:-1]) / count, 0.0)
    return float(np.sqrt((float(off @ off) / (count - 1) + 2.0 * shared) / count))


def sign(rates: Array) -> int:
    """1 or -1 where the mean of a series of growth rates (k,) per drive period is above or below 0
    by more than ``SURE`` standard errors and ``LEAST``, else 0. On a torus the vector's length only
    swings, so that batches repeat; then the error is what one term more or less would make."""
    if len(rates) < 2:
        return 0
    mean = float(rates.mean())
    error = max(batch_error(rates), float(rates.std()) / len(rates))
    return int(np.sign(mean)) if abs(mean) > max(SURE * error, LEAST) else 0


def lyapunov(
    flow: Flow, x: Array, mode: ModeKey | None, periods: int, bound: Bound | None = None
) -> LyapunovExponent:
    """Largest exponent of the motion through x (states,) over ``periods``, or with a bound over as
    many more as it takes."""
    v: Array | None = np.random.default_rng(0).standard_normal((len(x), 1))

    def further(blocks: int) -> Array:
        nonlocal x, mode, v
        rates: list[float] = []
        while len(rates) < blocks and v is not None:
            x, mode, v, rate = _grown(flow, x, mode, v)
            rates += [rate] if v is not None else []
        return np.array(rates)

    further(1)  # only turns the vector towards the leading direction
    rates = further(-(-periods // BLOCK) - 1)
    if bound is not None:
        rates = until(bound, rates, further)
    return LyapunovExponent(rates, flow.drive.period, x, mode or flow.system.start)


def until(bound: Bound, rates: Array, further: Callable[[int], Array]) -> Array:
    """The series of rates, made longer, doubled each time, until the bound is met, or until
    ``further`` has no more or the most periods are run."""
    most = bound.periods // BLOCK
    while not bound.met(rates) and len(rates) < most:
        wanted = min(max(len(rates), BATCHES), most - len(rates))
        more = further(wanted)
        rates = np.concatenate([rates, more])
        if len(more) < wanted:
            break
    return rates


def _grown(
    flow: Flow, x: Array, mode: ModeKey | None, tangent: Array
) -> tuple[Array, ModeKey | None, Array | None, float]:
    """State, mode and tangent vector a block later, and its growth; no vector where the flow
    stopped."""
    run = flow.run(x, BLOCK, mode=mode, tangent=tangent)
    if run.status is not FlowStatus.DONE or run.tangent is None:
        return x, mode, None, float("nan")
    size = max(float(np.linalg.norm(run.tangent)), 1e-300)
    return run.strobes[-1], run.mode, run.tangent / size, float(np.log(size)) / BLOCK
