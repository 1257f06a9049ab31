"""The responses on boards whose trimmers are set: how many boards show them, and their margins as
functions of what is drawn alone.

A trimmer that is set is set for every response, so it is no way to any where it is hopeless for
one. On such boards the wiper's place is one more quantity that the response depends on, and it
follows from the others: it cancels their constant force. So the margin is taken of the circuit with
its trimmer, and the part of the wiper is then given to the quantities that move it, by least
squares over many boards. What offsets do to the response and what the wiper undoes of it cancel in
the slopes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from designer.base.arrays import Array
from designer.centering.cure_branch import TRIMMER
from designer.centering.cure_ways import FEW, SAMPLES, Looker, ResponseWay, foretold
from designer.spread.board_quantities import column
from designer.verdicts.verdict import StudyPlan
from designer.yields import margins
from designer.yields.margins import Margin
from designer.yields.trimmed_yield import HIGH, LOW, DcTrim, trimmed_boards

FITTED = 1000
"""Boards from which is learnt what moves the wiper."""


def trimmer_ways(
    looker: Looker, trim: DcTrim, firsts: Sequence[ResponseWay]
) -> list[ResponseWay] | None:
    """The trimmer as a way to each response; None where it is hopeless for one of them.

    trim : of the branch's circuit. firsts : the responses as they are, in the order in which they
    are to be looked at.
    """
    boards, _ = trimmed_boards(trim, looker.plan, range(SAMPLES))
    finest = [trimmed_boards(trim.on(p.circuit), p, range(2 * FEW))[0] for p in looker.best]
    ways = []
    for first in firsts:
        way = looker.with_rate(ResponseWay(first.response, TRIMMER, first.question), boards)
        ways.append(looker.bounded(way, finest))
        if ways[-1].hopeless:
            return None
    return ways


def trimmed_margins(
    plan: StudyPlan,
    trim: DcTrim,
    *,
    count: int,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> list[Margin]:
    """The margin of each question; the plan is of the circuit without the trimmer.

    count, progress : as ``margins.margins``.
    """
    boards, _ = trimmed_boards(trim, plan, range(plan.samples))
    answers = []
    for question in plan.questions:
        answers.append(foretold(boards, question, jobs))
        progress()
    trimmed = margins.margins(
        trim.circuit, plan.questions, boards, answers, count=count, jobs=jobs, progress=progress
    )
    return [without_wiper(margin, plan, trim) for margin in trimmed]


def without_wiper(margin: Margin, plan: StudyPlan, trim: DcTrim) -> Margin:
    """A margin of trimmed boards in terms of the quantities of the boards without a trimmer."""
    indices = range(FITTED)
    boards, _ = trimmed_boards(trim, plan, indices)
    part_names = set(plan.circuit.values)
    wiper = [k for k, q in enumerate(margin.quantities) if q.part in (HIGH, LOW)]
    remaining = [
        k for k, q in enumerate(margin.quantities) if q.group != "values" or q.part in part_names
    ]  # and not the resistor at the wiper

    def off(k: int) -> Array:
        q = margin.quantities[k]
        return (column(boards, q) - q.nominal) / q.sigma

    deviations = np.stack([off(k) for k in remaining], axis=1)
    moves = np.linalg.lstsq(deviations, np.stack([off(k) for k in wiper], axis=1), rcond=None)[0]
    quantities = tuple(margin.quantities[k] for k in remaining)
    plain = plan.boards(indices)
    limits = []
    for limit in margin.limits:
        slopes = limit.slopes[remaining] + moves @ limit.slopes[wiper]
        moved = replace(limit, sigma=1.0, slopes=slopes)
        sigma = float(Margin(quantities, (moved,)).each(plain).std())
        if sigma > 0.0:
            limits.append(replace(moved, sigma=sigma))
    limits.sort(key=lambda limit: limit.distance)
    return replace(margin, quantities=quantities, limits=tuple(limits))
