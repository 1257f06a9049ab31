"""The references as the one kind of upgrade left, against every option judged by itself on boards
of another seed."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from designer.centering import repair_linear_model, repair_measure, repair_search
from designer.centering.repair_branch import KINDS, RepairBranch, repaired
from designer.centering.repair_measure import MeasuredYield, VerdictCache
from designer.centering.repair_search import find_repair
from designer.centering.repair_slots import part_slots
from designer.centering.repair_trial import Repair
from designer.centering.repair_upgrade import Upgrades, price
from designer.centering.repair_ways import ResponseWay
from designer.check.synthesis_result import Synthesis, synthesise
from designer.model.model_file import parse_model_file
from designer.spread.board_quantities import quantities
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from designer.verdicts.verdict import Question, StudyPlan
from designer.yields.margins import Limit, Margin
from designer.yields.yield_count import Yield
from tests.shared.exploring import quick
from tests.shared.model_text import COARSE_CIRCUIT, PAPER_TABLE

BAND = 0.05
OTHER_SEED = 4242


def design(p: int, omega: float) -> Synthesis:
    """For one 1-p-p response of the paper's model, from coarse parts of 1 %."""
    wanted = f'[[response]]\nomega = {omega}\nexpect = "1-{p}-{p}"\n'
    circuit = f'{COARSE_CIRCUIT}dead_zone = "rectifier"\n'
    tuning = f"[tuning]\noffset = {BAND}\n"
    return synthesise(parse_model_file("format = 1\n" + PAPER_TABLE + wanted + circuit + tuning))


def only(kind: str, base: Synthesis, target: float) -> Repair:
    return find_repair(base, target, trim=BAND, without=frozenset(KINDS) - {kind}, seed=3, jobs=1)


@pytest.mark.parametrize(("p", "omega"), quick([(2, 0.85), (8, 0.215)]))
def test_the_references_are_taken_where_they_move_the_limit(
    monkeypatch: pytest.MonkeyPatch, p: int, omega: float
) -> None:
    """With a limit that is known, so that each option's yield is the share of drawn boards."""
    base, target = design(p, omega), 0.97
    circuit = base.design.circuit
    boards = draw_many(circuit, spread_of(base.modelfile, circuit, base.catalog), 3, range(4000))
    differing = quantities(circuit, boards)
    slopes = np.array([2.0 * (q.group == "reference") + (q.part == "R4") for q in differing])
    assert np.count_nonzero(slopes) == 3
    limit = Limit("x", "contact", 3.5, 1.0, slopes)
    sigma = float(Margin(differing, (limit,)).each(boards).std())
    margin = Margin(differing, (replace(limit, sigma=sigma),))

    def counted(
        plan: StudyPlan, target: float, verdict_cache: VerdictCache, **_: object
    ) -> MeasuredYield:
        drawn = draw_many(plan.circuit, plan.spread, plan.seed, range(8000))
        ok = int((margin.of(drawn) > 0.0).sum())
        return MeasuredYield(Yield(ok, 8000 - ok, 0, 0), target)

    slots = part_slots(base, frozenset(KINDS) - {"reference"})
    (slot,) = slots
    branch = RepairBranch(Upgrades(), base, 0.0)
    way = ResponseWay(0, "as it is", cast(Question, None), None, margin, 0.5)
    ratios = repair_linear_model._ratios(branch, slots, 5)
    seen = repair_linear_model.LinearModel(branch, slots, ((way,),), ratios, 0.0, 5)
    monkeypatch.setattr(repair_search, "picture", lambda *_, **__: seen)
    monkeypatch.setattr(repair_search, "measure", counted)
    monkeypatch.setattr(repair_measure, "measure", counted)
    found = only("reference", base, target)
    enough = {}
    for k, model in enumerate(slot.models):
        made = repaired(base, Upgrades(reference=model) if k else Upgrades())
        spread = spread_of(made.modelfile, made.design.circuit, made.catalog)
        drawn = draw_many(made.design.circuit, spread, OTHER_SEED, range(8000))
        if (margin.of(drawn) > 0.0).mean() >= target:
            enough[model] = price(made) - price(base)
    assert slot.models[0] not in enough
    assert enough
    assert found.reached, found.why
    assert found.best.upgrades.reference in enough
    assert found.best.price == pytest.approx(min(enough.values()))
