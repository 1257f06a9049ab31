"""The margin of a response on boards whose trimmers are set, as a function of what is drawn alone.

On such boards the wiper's place is one more quantity that the response depends on, and it follows
from the others: it cancels their constant force. So the margin is taken of the circuit with its
trimmer, and the part of the wiper is then given to the quantities that move it, by least squares
over many boards. What offsets do to the response and what the wiper undoes of it cancel in the
slopes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from designer import margins, verdict
from designer.cure_study import Book, answers_of
from designer.margins import Margin
from designer.quantities import column
from designer.spread import draw_many
from designer.system import Array
from designer.trimmer import HIGH, LOW, DcTrim, trimmed_boards
from designer.verdict import StudyPlan

FITTED = 1000
"""Boards from which is learnt what moves the wiper."""


def trimmed_margins(
    plan: StudyPlan,
    trim: DcTrim,
    target: float,
    book: Book,
    *,
    count: int,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> list[tuple[Margin | None, float]]:
    """Of each question of a plan of the circuit without the trimmer: its margin, and its yield.

    No margins where every yield is at the target. book : verdicts that are known. count, progress :
    as ``margins.margins``.
    """
    by = []
    for question in plan.questions:
        own = replace(plan, questions=(question,))
        blocks = (book.block(own, block, trim, jobs)[0] for block in plan.blocks())
        by.append(answers_of("".join(blocks)))
        progress()
    rates = [verdict.count(row).rate for row in by]
    if min(rates) >= target:
        return [(None, rate) for rate in rates]
    boards, _ = trimmed_boards(trim, plan, range(plan.samples))
    found = margins.margins(
        trim.circuit, plan.questions, boards, by, count=count, jobs=jobs, progress=progress
    )
    return [(without_wiper(m, plan, trim), rate) for m, rate in zip(found, rates, strict=True)]


def without_wiper(margin: Margin, plan: StudyPlan, trim: DcTrim) -> Margin:
    """A margin of trimmed boards in terms of the quantities of the boards without a trimmer."""
    indices = range(FITTED)
    boards, _ = trimmed_boards(trim, plan, indices)
    own = set(plan.circuit.values)
    wiper = [k for k, q in enumerate(margin.quantities) if q.part in (HIGH, LOW)]
    kept = [
        k for k, q in enumerate(margin.quantities) if q.group != "values" or q.part in own
    ]  # and not the resistor at the wiper

    def off(k: int) -> Array:
        q = margin.quantities[k]
        return (column(boards, q) - q.nominal) / q.sigma

    drawn = np.stack([off(k) for k in kept], axis=1)
    moves = np.linalg.lstsq(drawn, np.stack([off(k) for k in wiper], axis=1), rcond=None)[0]
    quantities = tuple(margin.quantities[k] for k in kept)
    plain = draw_many(plan.circuit, plan.spread, plan.seed, indices)
    limits = []
    for limit in margin.limits:
        slopes = limit.slopes[kept] + moves @ limit.slopes[wiper]
        moved = replace(limit, sigma=1.0, slopes=slopes)
        sigma = float(Margin(quantities, (moved,)).each(plain).std())
        if sigma > 0.0:
            limits.append(replace(moved, sigma=sigma))
    limits.sort(key=lambda limit: limit.distance)
    return replace(margin, quantities=quantities, limits=tuple(limits))
