"""Linear blocks of one and the same error: the dead zone may be better beside another.

What the stop needs follows R4 (its slope is in units of K1 = 1/(R4 C2)), and an exact linear
network stays exact at other levels. So where the first choice leaves the dead zone an error that
counts, others of the least error are tried, one for each interval of R4 that is left.
"""

from __future__ import annotations

from collections import deque

from designer.base.progress import part
from designer.circuit.coefficients import EXACT
from designer.synthesis.attempt import Attempt, Order, attempt, linear_block
from designer.synthesis.limits import ConditionLimits
from designer.synthesis.linear_search import FIRST_LEVEL, LinearBlock
from designer.synthesis.preferences import Wishes
from designer.synthesis.tie_break import Shortfall

TRIES = 10
"""Linear blocks that are tried beside the first."""
ASIDE = 1e-6
"""Relative: the ends of an interval of R4 leave out the value between."""


def best_beside(
    order: Order,
    within: ConditionLimits,
    wishes: Wishes,
    linear: LinearBlock,
    first: Attempt | Shortfall,
) -> Attempt | Shortfall:
    """The attempt of least error among linear blocks as good as ``linear``.

    first : the attempt with ``linear`` itself, which stands unless another is better by more than
    what counts.
    """
    best = first
    left = deque(_beside(linear, (0.0, float("inf"))))
    for number in range(TRIES):
        if not left or not _worth_trying(order, linear, best):
            break
        between = left.popleft()
        level = max(linear.least, FIRST_LEVEL)
        with part(f"beside the first linear block ({number + 1} of at most {TRIES})"):
            other = linear_block(order, within, wishes, between=between, level=level)
            if isinstance(other, Shortfall) or other.least > linear.least + EXACT:
                continue
            left.extend(_beside(other, between))
            made = attempt(order, within, wishes, other)
        if isinstance(made, Attempt) and _error(made) < _error(best) - EXACT:
            best = made
    return best


def _beside(linear: LinearBlock, between: tuple[float, float]) -> list[tuple[float, float]]:
    """What this block's R4 leaves of an interval, the part above it first."""
    r4, (low, high) = linear.values["R4"], between
    return [(r4 * (1.0 + ASIDE), high), (low, r4 * (1.0 - ASIDE))]


def _worth_trying(order: Order, linear: LinearBlock, best: Attempt | Shortfall) -> bool:
    """Whether the dead zone's error, or that there is none, is what limits the circuit."""
    return order.model.k0 > 0.0 and _error(best) > max(linear.least, EXACT)


def _error(made: Attempt | Shortfall) -> float:
    return made.errors.max_error if isinstance(made, Attempt) else float("inf")
