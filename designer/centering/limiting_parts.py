"""What limits what: the mechanism that binds each response, in one line.

Two questions. Where is the border? From the nearest limit of the response's margin
(``yields.margins``): an impact that grazes, a fold, doubling or torus at which the window of a
neighbour begins, or another attractor in whose basin the nominal orbit comes to lie. And what moves
a board across it? From the shares of the limit's variance over the spread: offsets and bias, the
dead zone's own parts, the rails, or the parts that make the coefficients. Parts that vary together
count with what they have in common.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from designer.circuit.board_arrays import Boards
from designer.circuit.netlist import Circuit
from designer.spread.board_quantities import Quantity, column
from designer.spread.spread import Spread, draw_many
from designer.verdicts.verdict import Answer, StudyPlan
from designer.yields import margins
from designer.yields.margins import DRAWN, Limit, Margin

OFFSET, NULL, RAILS = "offset", "null", "rails"
GRAZING, NEIGHBOUR, COEXISTING = "grazing", "neighbour window", "coexisting attractor"
NOTHING = "nothing that was seen"
COEFFICIENTS = "resistors and capacitors of the linear part"
NAMES = {
    OFFSET: "op-amps' offsets and bias",
    NULL: "the dead zone's parts",
    RAILS: "output limits and supply",
    COEFFICIENTS: COEFFICIENTS,
}
HALF = 0.5
"""Share of the variance, or of the lost boards, from which on a cause is named."""
JOINT_BOARDS = 4000
"""Boards from which a covariance is taken: a share is then known to about 2 %."""
STREAM = "limiting:"
_DEAD_ZONE = re.compile(r"R(2\d\d|50)[AB]?")


@dataclass(frozen=True)
class Limiting:
    """What limits one response."""

    mechanism: str
    """What ends the response, from ``OFFSET`` to ``NOTHING``."""
    border: str
    """Where the response ends, in words."""
    distance: float
    """Standard deviations from the nominal board to the border; nan without one."""
    shares: dict[str, float]
    """Shares of the border's variance, by what moves it; see ``shares``."""
    line: str


def limitings(
    plan: StudyPlan,
    answers: Sequence[Answer],
    *,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> tuple[Limiting, ...]:
    """What limits each question of a plan. answers : of its first samples, in any order."""
    count = max(max((a.sample for a in answers), default=0) + 1, DRAWN)
    boards = plan.boards(range(count))
    rows = [[a for a in answers if a.question == k] for k in range(len(plan.questions))]
    of_questions = margins.margins(
        plan.circuit, plan.questions, boards, rows, jobs=jobs, progress=progress
    )
    drawn = joint_boards(plan.circuit, plan.spread, plan.seed)
    return tuple(limiting(margin, drawn) for margin in of_questions)


def joint_boards(circuit: Circuit, spread: Spread, seed: int) -> Boards | None:
    """Boards to take the covariance of their parts from; None where each part varies by itself."""
    shared = spread.groups or spread.temperature is not None or spread.supply > 0.0
    if not shared and spread.measured is None:
        return None
    return draw_many(circuit, spread, seed, range(JOINT_BOARDS), STREAM)


def limiting(margin: Margin, boards: Boards | None = None) -> Limiting:
    """What limits a response, by its margin. boards : see ``joint_boards``."""
    if margin.sought and margin.there > HALF * margin.sought:
        border = f"another attractor takes over: {margin.there} of {margin.sought} lost boards"
        return Limiting(
            COEXISTING, border, float("nan"), {}, f"{border} have the response all the same"
        )
    if not margin.limits:
        return Limiting(NOTHING, "", float("nan"), {}, NOTHING)
    limit = margin.limits[0]
    moved = shares(margin.quantities, limit, boards)
    first = max(moved, key=lambda name: moved[name])
    mechanism = GRAZING if limit.kind in ("contact", "miss", "parting") else NEIGHBOUR
    if first != COEFFICIENTS and moved[first] >= HALF:
        mechanism = first
    causes = ", ".join(
        f"{NAMES[name]} {100.0 * share:.0f} %"
        for name, share in sorted(moved.items(), key=lambda item: -item[1])
        if share >= 0.05
    )
    line = f"{mechanism}: {limit.what}, {limit.reliability_index:.1f} σ away, moved by {causes}"
    return Limiting(mechanism, limit.what, limit.reliability_index, moved, line)


def shares(
    quantities: Sequence[Quantity], limit: Limit, boards: Boards | None = None
) -> dict[str, float]:
    """Shares of a limit's variance, by what moves it; they sum to 1.

    boards : boards on which quantities vary together; None: each varies by itself. A cause's share
    is the covariance of what it adds with the whole: below 0 where it takes off what another adds.
    """
    total = dict.fromkeys(NAMES, 0.0)
    if boards is None:
        for quantity, slope in zip(quantities, limit.slopes, strict=True):
            total[cause(quantity)] += float(slope) ** 2
    else:
        added = {name: np.zeros(len(boards)) for name in NAMES}
        for q, slope in zip(quantities, limit.slopes, strict=True):
            away = column(boards, q) - q.nominal
            added[cause(q)] += float(slope) / q.sigma * (away - away.mean())
        form = np.sum(list(added.values()), axis=0)
        total = {name: float(np.mean(one * form)) for name, one in added.items()}
    variance = float(np.sum(list(total.values())))
    return {name: value / variance if variance > 0.0 else 0.0 for name, value in total.items()}


def cause(quantity: Quantity) -> str:
    """Which cause a quantity of the spread belongs to."""
    if quantity.group in ("offset", "bias"):
        return OFFSET
    if quantity.group in ("low", "high", "supply"):
        return RAILS
    if quantity.group == "reference" or _DEAD_ZONE.fullmatch(quantity.part):
        return NULL
    return COEFFICIENTS
