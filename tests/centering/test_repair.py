"""The repair: its linear picture against drawn boards, its loop against a truth that is known, and
a whole one."""

from __future__ import annotations

import contextlib
import csv
import itertools
import json
import math
import re
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import norm

from designer.base import progress
from designer.base.defaults import StudyEngine
from designer.base.errors import InputError
from designer.base.figure_style import to_svg
from designer.base.progress import Progress, report_to
from designer.catalog.parts_catalog import load_catalog
from designer.centering import repair_measure, repair_search
from designer.centering.repair_branch import RepairBranch
from designer.centering.repair_couplings import finest
from designer.centering.repair_linear_model import LinearModel, share_above, tail_quantile
from designer.centering.repair_measure import (
    MOST_PLAIN,
    MeasuredYield,
    RareShare,
    VerdictCache,
    measure,
    measure_all,
    telling,
)
from designer.centering.repair_milp import cheapest
from designer.centering.repair_plots import front_chart
from designer.centering.repair_search import find_repair
from designer.centering.repair_slots import PartSlot, network_slots, part_slots, trimmer_slot
from designer.centering.repair_trial import Repair, Trial
from designer.centering.repair_upgrade import Upgrades, price, upgraded_file, with_same_parts
from designer.centering.repair_ways import ResponseWay, best_place
from designer.circuit.netlist import Circuit
from designer.jobs import fidelity_choice
from designer.jobs.options import Options
from designer.jobs.repair_job import FEWEST_LOST, REPAIR, STUDIES, cure, repair_into, repair_json
from designer.jobs.synthesise_job import synthesise_into
from designer.model.model_file import parse_model_file
from designer.spread.board_quantities import quantities
from designer.spread.part_rules import spread_of
from designer.spread.spread import Spread, draw_many
from designer.verbs.search import repair_text
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import BLOCK, Question, StudyPlan, Verdict
from designer.yields import stored_parts
from designer.yields.margins import Limit, Margin
from designer.yields.rare_losses import unseen_share
from designer.yields.stored_parts import AnswerLog
from designer.yields.trimmed_yield import trimmed_block
from designer.yields.yield_count import Yield
from designer.yields.yield_maps import Axis, YieldMap
from tests.shared import bench_plans, paper_cases
from tests.shared.exploring import quick
from tests.shared.model_text import COARSE_CIRCUIT, PAPER_TABLE
from tests.shared.quick_folders import quick_folder
from tests.shared.report_data import NO_ORIGIN

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

CATALOG = load_catalog()
WEIGHTS = {"R50": 3.0, "R203": 2.0, "R4": 1.5, "R11": 1.0, "C2": 1.0, "R8": 0.6}
"""Slopes of the limit that is known: per standard deviation of a part as it is."""
OTHERWISE = {**WEIGHTS, "R50": 1.0, "R11": 3.0}
"""As much together, of other parts: a picture that is right of the design as it is alone."""
OFFSET = 1.2
SLOTS = ("R50", "R203", "R4", "R11", "R8")
TARGET = 0.97


@cache
def branch() -> RepairBranch:
    return RepairBranch(Upgrades(), paper_cases.synthesised(), 0.0)


@cache
def known_margin(nominal: float, otherwise: bool = False) -> Margin:
    """One linear limit in a few parts and an offset, of this nominal value."""
    weights = OTHERWISE if otherwise else WEIGHTS
    made = branch().synthesis
    circuit = made.design.circuit
    boards = draw_many(circuit, spread_of(made.modelfile, circuit, CATALOG), 3, range(4000))
    differing = quantities(circuit, boards)
    slopes = np.array(
        [OFFSET if q.name == "U1A.offset" else weights.get(q.name, 0.0) for q in differing]
    )
    limit = Limit("x", "contact", nominal, 1.0, slopes)
    sigma = float(Margin(differing, (limit,)).each(boards).std())
    return Margin(differing, (replace(limit, sigma=sigma),))


def known_picture(nominal: float) -> LinearModel:
    """The picture of that limit: the better grades of a few parts are what can be bought."""
    from designer.centering import repair_linear_model

    parts = tuple(p for p in part_slots(branch().synthesis) if p.slot.name in SLOTS)
    way = ResponseWay(0, "as it is", bench_plans.question(1), None, known_margin(nominal), 0.5)
    ratios = repair_linear_model._ratios(branch(), parts, 5)
    return LinearModel(branch(), parts, ((way,),), ratios, 0.0, 5)


@pytest.mark.slow
def test_a_demand_holds_the_variance_of_the_drawn_boards() -> None:
    seen = known_picture(8.0)
    slots = len(seen.parts)
    assert [p.slot.name for p in seen.parts] == [
        p.name for p in branch().synthesis.design.circuit.resistors if p.name in SLOTS
    ]
    z = seen.quantiles(TARGET, seen.boards((0,) * (slots + 1)))
    demand = seen.program(z, {}).demands[0]
    fixed = (8.0 / known_margin(8.0).limits[0].sigma / z[0, 0, 0]) ** 2 - demand.room
    for pick in itertools.product(range(2), repeat=slots):
        each = known_margin(8.0).each(seen.boards((*pick, 0)))[:, 0]
        # 4000 boards: the variance of a draw is known to about 2 % of it.
        assert demand.variance((*pick, 0)) + fixed == pytest.approx(each.var(), rel=0.08)


def test_the_quantile_is_that_of_the_drawn_form() -> None:
    seen = known_picture(8.0)
    boards = seen.boards((0,) * (len(seen.parts) + 1))
    z = seen.quantiles(TARGET, boards)[0, 0, 0]
    form = known_margin(8.0).each(boards)[:, 0] - known_margin(8.0).limits[0].reliability_index
    assert (form > -z * form.std()).mean() == pytest.approx(TARGET, abs=2e-3)
    assert 1.6 < z < 1.9  # a normal form's is 1.88; one uniform part's 1.63


def test_beyond_what_boards_show_a_tail_is_a_normal_s() -> None:
    """SciPy's normal distribution is the truth; what boards show is read off them."""
    form = np.random.default_rng(5).normal(size=4000)
    for share in (1e-4, 1e-5, 1e-6):
        z = norm.ppf(share)
        assert tail_quantile(form, share) == pytest.approx(z, rel=0.06)
        # A shift by z leaves this share below 0: to 0.2 of a standard deviation.
        assert norm.isf(1.0 - share_above(form - z)) == pytest.approx(-z, abs=0.2)
    for share in (0.001, 0.01, 0.3):
        assert tail_quantile(form, share) == np.quantile(form, share)
        shifted = form - np.quantile(form, share)
        assert share_above(shifted) == pytest.approx(1.0 - share, abs=5e-4)
    assert share_above(np.ones(1)) == 1.0
    assert share_above(-np.ones(9)) == 0.0


def truth(nominal: float, otherwise: bool = False) -> Any:
    """What a study measures where the limit is known: boards are ok where it is positive."""

    def of(
        plan: StudyPlan, target: float, verdict_cache: VerdictCache, **_: object
    ) -> MeasuredYield:
        boards = draw_many(plan.circuit, plan.spread, plan.seed, range(8000))
        ok = int((known_margin(nominal, otherwise).of(boards) > 0.0).sum())
        return MeasuredYield(Yield(ok, 8000 - ok, 0, 0), target)

    return of


def by_hand(nominal: float) -> float:
    """The least price at which the limit is positive on enough boards, by trying each choice."""
    seen = known_picture(nominal)
    prices = [
        seen.program({(0, 0, 0): 1.0}, {}).price((*pick, 0))
        for pick in itertools.product(range(2), repeat=len(seen.parts))
        if seen.predicted((*pick, 0), seen.boards((*pick, 0)))[0] >= TARGET + 0.004
    ]
    return min(prices)


def searched(
    monkeypatch: pytest.MonkeyPatch,
    picture: LinearModel | Callable[..., LinearModel],
    real: Any,
    budget: float | None = None,
    target: float = TARGET,
) -> Repair:
    """The search with this picture, where ``real`` is what studies measure."""
    taken = (lambda *_, **__: picture) if isinstance(picture, LinearModel) else picture
    monkeypatch.setattr(repair_search, "picture", taken)
    monkeypatch.setattr(repair_search, "measure", real)
    monkeypatch.setattr(repair_measure, "measure", real)  # as measure_all calls it
    monkeypatch.setattr(repair_search, "questions_of", lambda *_: [bench_plans.question(1)])
    monkeypatch.setattr(repair_search, "branches", lambda *_: iter([branch()]))
    return find_repair(one_response(), target, budget=budget, seed=1, jobs=1)


RARE_TARGET = 1.0 - 3e-4
DRAWN = 100_000


def share_lost(circuit: Circuit, spread: Spread, seed: int, nominal: float) -> float:
    """How many boards lose the limit that is known, by counting many."""
    boards = draw_many(circuit, spread, seed, range(DRAWN))
    return float((known_margin(nominal).of(boards) <= 0.0).mean())


@pytest.mark.slow
def test_a_rare_loss_is_repaired_for_the_least_price(monkeypatch: pytest.MonkeyPatch) -> None:
    """Against each choice, of which many boards are counted; no choice is taken on plain boards
    that are too few to tell, and the last estimate is of boards that no other had."""
    nominal, asked = 10.5, list[int]()

    def counted(plan: StudyPlan, *_: object, **__: object) -> Any:
        asked.append(plan.seed)
        lost = share_lost(plan.circuit, plan.spread, plan.seed, nominal)
        error = 2.0 * (lost / DRAWN) ** 0.5
        ends = {"low": max(lost - error, 0.0), "high": lost + error}
        return SimpleNamespace(lost=lost, **ends, unseen=1e-3, boards=DRAWN, pilots=0)

    def few(
        plan: StudyPlan, target: float, verdict_cache: VerdictCache, **_: object
    ) -> MeasuredYield:
        lost = share_lost(plan.circuit, plan.spread, plan.seed, nominal)
        return MeasuredYield(Yield(250 - round(250 * lost), round(250 * lost), 0, 0), target)

    monkeypatch.setattr(repair_measure, "rare_losses", counted)
    found = searched(monkeypatch, known_picture(nominal), few, target=RARE_TARGET)
    assert found.reached
    (measured,) = found.best.measured
    assert measured.rare is not None
    assert measured.rare.high <= 1.0 - RARE_TARGET
    assert len(set(asked)) == len(asked) >= 3
    seen = known_picture(nominal)
    enough = [
        pick
        for pick in itertools.product(range(2), repeat=len(seen.parts))
        if share_lost(*seen.spread((*pick, 0)), 11, nominal) <= 1.0 - RARE_TARGET
    ]
    program = seen.program({(0, 0, 0): 1.0}, {})
    assert found.best.price == pytest.approx(min(program.price((*p, 0)) for p in enough))
    assert "of a million lost" in repair_text(repair_json(found, NO_ORIGIN, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize(("promised", "real"), [(6.5, 6.5), (8.0, 5.5)])
def test_the_cheapest_repair_is_the_enumerated_one(
    monkeypatch: pytest.MonkeyPatch, promised: float, real: float
) -> None:
    """promised : the limit's nominal value in the picture; real : on the boards, which the first
    study shows."""
    found = searched(monkeypatch, known_picture(promised), truth(real))
    assert found.reached
    assert found.best.measured[0].reached
    assert found.best.price == pytest.approx(by_hand(real))
    worst = [t.worst.rate for t in found.front]
    assert worst == sorted(worst)
    told = repair_text(repair_json(found, NO_ORIGIN, 0.0))
    assert "every response at 97 % or better" in told
    assert "ω = " in told
    assert to_svg(front_chart(found)).startswith("<svg")


@pytest.mark.slow
def test_where_the_picture_is_wrong_the_loop_tightens(monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes R50 for the worst part, which is R11."""
    found = searched(monkeypatch, known_picture(5.5), truth(5.5, otherwise=True))
    assert found.reached
    assert len(found.rounds) > 1
    first = found.rounds[0]
    assert first.predicted[0] >= TARGET > first.measured[0].rate
    assert "R50" in first.upgrades.grades
    assert "R11" in found.best.upgrades.grades
    choices = [repr(t.upgrades) for t in found.rounds]
    assert len(set(choices)) == len(choices)
    assert [t.price for t in found.rounds] == sorted(t.price for t in found.rounds)


@pytest.mark.slow
def test_out_of_reach_and_over_the_budget_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    far = searched(monkeypatch, known_picture(2.0), truth(2.0))
    assert not far.reached
    assert "no choice of upgrades is enough" in far.why
    seen = known_picture(2.0)
    finest = (*(1 for _ in seen.parts), 0)
    (share,) = seen.predicted(finest, seen.boards(finest))
    assert share < TARGET
    told = re.fullmatch(r".*: response 1 \((0\.\d+) at most\)", far.why)
    assert told is not None
    # What the first study showed may have brought the loss nearer.
    assert float(told[1]) == pytest.approx(share, abs=0.03)
    # Squares of the slopes: R50 and R203 have 13 of 19.05, the offset 1.44.
    assert far.limits[0].startswith("null: x, ")
    assert "the dead zone's parts 68 %" in far.limits[0]
    assert "offsets and bias 8 %" in far.limits[0]
    least = by_hand(5.5)
    dear = searched(monkeypatch, known_picture(5.5), truth(5.5), 0.9 * least)
    assert not dear.reached
    assert dear.why == f"the cheapest choice that may be enough costs {least:.2f} euro"
    assert searched(monkeypatch, known_picture(5.5), truth(5.5), least).reached


@pytest.mark.parametrize(("nominal", "missed"), [(2.0, [0]), (60.0, None)])
def test_the_picture_knows_what_missed(
    monkeypatch: pytest.MonkeyPatch, nominal: float, missed: list[int] | None
) -> None:
    """None where every response is there already: no picture is taken."""
    told = []

    class _Taken(Exception):
        pass

    def taken(*_: object, missed: list[int], **__: object) -> LinearModel:
        told.append(missed)
        raise _Taken

    with contextlib.suppress(_Taken):
        searched(monkeypatch, taken, truth(nominal))
    assert told == ([] if missed is None else [missed])


def test_what_boards_show_is_said_before_the_search_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Nothing was told of the design as it is until the repair's report stood, minutes later."""
    said: list[str] = []
    heard = Progress()
    monkeypatch.setattr(heard, "note", said.append)
    with heard:
        searched(monkeypatch, known_picture(60.0), truth(60.0))
    (line,) = said
    assert re.fullmatch(r" *as it is: yield of each response: 1\.0000 \(0\.\d+ to 1\.0000\)", line)


@cache
def one_response() -> Any:
    base = paper_cases.synthesised()
    file = replace(base.modelfile, responses=base.modelfile.responses[:1])
    return replace(base, modelfile=file, model_responses=base.model_responses[:1])


def test_a_study_grows_until_it_is_decided(monkeypatch: pytest.MonkeyPatch) -> None:
    """Letters of a coin that is known: the study ends at the first block at which Wilson's interval
    lies on one side of the target, and what is known is not asked again."""
    blocks: list[int] = []

    def coin(plan: StudyPlan, indices: range, jobs: int) -> list[Any]:
        blocks.append(indices.start)
        rng = np.random.default_rng(plan.seed)
        fine = rng.random(8000) < 0.9
        return [_Row("ok" if fine[i] else "lost") for i in indices]

    monkeypatch.setattr(exact_circuit, "block", coin)
    plan = bench_plans.plan(1, samples=8000)
    kept: dict[str, Any] = {}
    verdict_cache = VerdictCache(save=kept.update)
    for target in (0.85, 0.93, 0.9):
        found = measure(plan, target, verdict_cache)
        low, high = found.counts.interval
        assert found.decided is (low >= target or high < target)
        assert found.decided or found.counts.samples == 8000
        for shorter in range(500, found.counts.samples, 250):
            assert not measure(plan, target, verdict_cache, least=shorter, most=shorter).decided
    assert sorted(set(blocks)) == sorted(blocks)
    again = measure(plan, 0.9, VerdictCache(json.loads(json.dumps(kept))["studies"]))
    assert again == measure(plan, 0.9, verdict_cache)
    assert sorted(set(blocks)) == sorted(blocks)
    for letters in ("!" * 250, ["o"] * 250, 250, None):  # with a seal that is right
        blocks.clear()
        strange = {s: {**known, "250": letters} for s, known in kept["studies"].items()}
        assert measure(plan, 0.9, VerdictCache(strange)) == again
        assert blocks == [250]


def test_a_rare_share_is_estimated_once_where_no_board_of_a_block_is_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What was estimated is kept; what is kept and damaged is estimated anew."""
    asked: list[tuple[int, range]] = []
    estimated: list[int] = []

    def few(plan: StudyPlan, *_: object, **__: object) -> Any:
        estimated.append(plan.seed)
        ends = {"low": 2e-6, "high": 8e-6 if plan.seed == 5 else 8e-5}
        return SimpleNamespace(lost=5e-6, **ends, unseen=1e-3, boards=2000, pilots=500)

    monkeypatch.setattr(repair_measure, "rare_losses", few)
    coins(monkeypatch, asked, 1.0)
    kept: dict[str, Any] = {}
    fine, other, out = (
        (replace(bench_plans.plan(1, samples=8000), seed=s), None) for s in (5, 6, 1)
    )
    verdict_cache = VerdictCache(save=kept.update)
    good, open_ = measure_all([fine, other], 1.0 - 1e-5, verdict_cache)
    assert good.reached
    assert good.rate == 1.0 - 5e-6
    assert not open_.reached
    assert not open_.missed
    assert estimated == [5, 6]
    stored = json.loads(json.dumps(kept))["studies"]
    assert measure_all([fine, other], 1.0 - 1e-5, VerdictCache(stored)) == (good, open_)
    assert estimated == [5, 6]
    assert good.rare is not None
    strange_ones: tuple[object, ...] = (
        {"lost": "x"}, {**asdict(good.rare), "high": float("nan")}, [], None
    )  # fmt: skip
    for damage in strange_ones:
        strange = {s: {**known, "rare": damage} for s, known in stored.items()}
        assert measure_all([fine], 1.0 - 1e-5, VerdictCache(strange)) == (good,)
    assert estimated == [5, 6, 5, 5, 5, 5]
    lost, waits = measure_all([out, fine], 1.0 - 1e-5, VerdictCache())
    assert lost.missed
    assert waits.rare is None


def test_an_interrupted_estimate_of_a_repair_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was answered is not asked again, and is forgotten at the end; damage is asked anew."""
    monkeypatch.setattr(stored_parts, "EVERY", 0.0)
    asked: list[bytes] = []

    def ask(question: bytes, most: float) -> list[str]:
        if len(asked) == most:
            raise KeyboardInterrupt
        asked.append(question)
        return ["ok 1-2-2", "lost clipped"]

    def cut(most: float) -> Callable[..., Any]:
        def estimate(*_: object, log: AnswerLog, **__: object) -> Any:
            for question in (b"a", b"b", b"c"):
                lines = log.answer(question, 2, partial(ask, question, most))
                assert lines == ["ok 1-2-2", "lost clipped"]
            ends = {"low": 2e-6, "high": 8e-6}
            return SimpleNamespace(lost=5e-6, **ends, unseen=1e-3, boards=2000, pilots=500)

        return estimate

    def studies() -> Any:
        return json.loads(json.dumps(kept))["studies"]

    kept: dict[str, Any] = {}
    plan = bench_plans.plan(1, samples=8000)
    monkeypatch.setattr(repair_measure, "rare_losses", cut(2))
    with pytest.raises(KeyboardInterrupt):
        VerdictCache(save=kept.update).rare(plan, 1e-5, 1, lambda: None)
    ((study, half),) = studies().items()
    monkeypatch.setattr(repair_measure, "rare_losses", cut(math.inf))
    damaged: tuple[object, ...] = (
        [], {"questions": ["x"]}, {"questions": [1], "answers": ["x"]}
    )  # fmt: skip
    for damage in damaged:
        asked.clear()
        VerdictCache({study: {"answers": damage}}).rare(plan, 1e-5, 1, lambda: None)
        assert asked == [b"a", b"b", b"c"]
    asked.clear()
    found = VerdictCache({study: half}, kept.update).rare(plan, 1e-5, 1, lambda: None)
    assert asked == [b"c"]
    assert studies() == {study: {"rare": asdict(found)}}


def test_where_no_search_meets_a_loss_boards_as_they_are_bound_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As many as the target takes; one that is lost all the same is counted with them."""
    asked: list[tuple[int, range]] = []

    def none(*_: object, **__: object) -> Any:
        return SimpleNamespace(lost=0.0, low=0.0, high=1e-3, unseen=1e-3, boards=2000, pilots=0)

    monkeypatch.setattr(repair_measure, "rare_losses", none)
    coins(monkeypatch, asked, 1.0)
    plan = replace(bench_plans.plan(1, samples=8000), seed=2)
    (found,) = measure_all([(plan, None)], 1.0 - 1e-4, VerdictCache())
    assert found.reached
    assert found.rare is not None
    boards = asked[-1][1].stop + 3000  # what the searches had drawn as they are
    assert found.rare.high == pytest.approx(3.0 / boards, rel=2e-3)
    assert 3.0 / (boards - repair_measure.PLAIN_BLOCK) > 1e-4  # no more than the target takes
    coins(monkeypatch, asked, 1.0 - 1.5e-4)
    (found,) = measure_all([(plan, None)], 1.0 - 1e-4, VerdictCache())
    assert not found.reached
    assert found.rare is None
    assert found.counts.lost > 0


def test_of_two_estimates_the_worse_one_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    """A region of losses may be met by one of them alone."""
    search = object.__new__(repair_search._Search)
    search.target, notes = 1.0 - 1e-5, list[str]()
    monkeypatch.setattr(progress, "note", notes.append)
    counted = MeasuredYield(Yield(4000, 0, 0, 0), search.target)
    few, many = (RareShare(s, 0.5 * s, 2.0 * s, 1e-3, 9000) for s in (1e-6, 2e-5))
    lost = iter([0, 9])  # of the boards that are counted, in each of the cases below

    def decided(*pairs: tuple[RareShare, RareShare]) -> tuple[MeasuredYield, ...]:
        studies: list[int] = []
        plain = Yield(4000 - (k := next(lost)), k, 0, 0)

        def measured(study: int, _: str, boards: int | None = None, whole: bool = False) -> Trial:
            studies.append(study)
            assert (boards is None) is whole is (len(studies) > 1)
            estimates = (
                replace(counted, counts=plain, rare=None if boards else pair[len(studies) - 2])
                for pair in pairs
            )
            return Trial("as it is", Upgrades(), 0.0, (1.0,), tuple(estimates), search.target)

        trial = search._confirmed(measured, 2, "round 1")
        assert len(set(studies)) == 3
        return trial.measured

    left = unseen_share(0, 4000)
    bad, good = decided((many, few), (few, few))
    assert [bad.rare, good.rare] == [replace(r, unseen=left) for r in (many, few)]
    assert not bad.reached
    assert good.reached
    (note,) = notes
    assert "response 1: the two estimates differ" in note
    # Boards that the estimate has no room for are the measure themselves.
    monkeypatch.setattr(MeasuredYield, "missed", False)
    (refuted,) = decided((few, few))
    assert refuted.rare is None
    assert not refuted.reached


def coins(
    monkeypatch: pytest.MonkeyPatch, asked: list[tuple[int, range]], usual: float = 0.999
) -> None:
    """Boards of which a known share is ok: 0.3 of seed 1, 0.96 of seed 4, ``usual`` of others."""

    def block(plan: StudyPlan, indices: range, jobs: int) -> list[Any]:
        asked.append((plan.seed, indices))
        share = {1: 0.3, 4: 0.96}.get(plan.seed, usual)
        fine = np.random.default_rng(plan.seed).random(max(8000, indices.stop)) < share
        return [_Row("ok" if fine[i] else "lost") for i in indices]

    monkeypatch.setattr(exact_circuit, "block", block)


def test_one_response_that_is_out_ends_the_studies_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """One of which most boards are lost is asked on few, one of which few are lost on two blocks,
    and the others on no second one; where none is out every interval lies above the target in the
    end."""
    asked: list[tuple[int, range]] = []
    coins(monkeypatch, asked)
    plans = [(replace(bench_plans.plan(1, samples=8000), seed=s), None) for s in (2, 1, 4, 3)]
    fine, out, close, last = measure_all(plans, 0.99, VerdictCache())
    assert out.missed
    assert out.counts.samples == repair_measure.FIRST
    assert close.missed
    assert close.counts.samples == 2 * BLOCK
    for other in (fine, last):
        assert not other.missed
        assert other.counts.samples == BLOCK
    known = len(asked)
    both = measure_all([plans[0], plans[3]], 0.99, VerdictCache())
    assert len(asked) > known
    assert all(m.reached and m.counts.samples >= 2 * BLOCK for m in both)
    nothing, waits = measure_all([None, plans[0]], 0.99, VerdictCache())
    assert nothing.counts.samples == 0
    assert waits.counts.samples == BLOCK


def test_the_boards_of_a_study_are_those_of_a_longer_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """A study that may end early asks the boards that one without has, once each; what a longer
    block knows is not asked again."""
    asked: list[tuple[int, range]] = []
    coins(monkeypatch, asked)
    plan = replace(bench_plans.plan(1, samples=8000), seed=2)
    early = measure(plan, 0.99, VerdictCache(), first=repair_measure.FIRST)
    boards = [i for _, indices in asked for i in indices]
    assert boards == list(range(early.counts.samples))
    verdict_cache = VerdictCache()
    assert measure(plan, 0.99, verdict_cache, most=early.counts.samples) == early
    known = len(asked)
    verdict_cache.block(plan, range(repair_measure.FIRST), None, 1)
    assert len(asked) == known


class _Row:
    def __init__(self, verdict: str) -> None:
        self.verdict = Verdict(verdict)


@pytest.mark.parametrize(
    ("rates", "used", "best"),
    [
        ([3, 8, 10, 9, 5], 4, 2),
        ([3, 10, 10, 10, 9], 4, 2),
        ([10, 9, 10, 10, 4], 4, 2),  # the longer of two rows
        ([3, 8, 10, 9, 5], 2, None),
        ([0, 0, 0, 0, 0], 1, None),
    ],
)
def test_the_best_place_is_the_middle_of_the_best_row(
    rates: list[int], used: int, best: int | None
) -> None:
    values = (0.30, 0.31, 0.32, 0.33, 0.34)
    ok, there = np.array(rates), np.ones(5, dtype=bool)
    none = np.zeros(5, dtype=np.int64)
    seen = YieldMap(
        "omega", 0, (Axis("omega", values),), there, ok, 10 - ok, none, none, 10, 1,
        values[used], None, (False, False), 0, 0.0,
    )  # fmt: skip
    assert best_place(seen) == (None if best is None else values[best])


def test_seeds_are_their_own() -> None:
    seeds = [repair_measure.study_seed(seed, number) for seed in range(4) for number in range(12)]
    assert len(set(seeds)) == len(seeds)
    assert not set(seeds) & set(range(1000))


HEAD = "format = 1\n" + PAPER_TABLE
QUICK = HEAD + '[[response]]\nomega = 1.55\nexpect = "1-1-1"\n' + COARSE_CIRCUIT
SMALL = (
    HEAD
    + """
[[response]]
omega = 0.337
expect = "1-5-5"

[circuit]
opamp = "TL074C"
saturation = 13.0
resistors = "E24"
resistor_grade = 0.01
capacitor_grade = 0.01
dead_zone = "saturation"
"""
)
WITHOUT = ("place", "trim", "dead zone", "op-amp")


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return quick_folder(QUICK, tmp_path_factory.mktemp("cure") / "design")


def test_bad_input_is_refused_and_nothing_is_written(design: Path) -> None:
    before = sorted(p.name for p in design.iterdir())
    asked: tuple[tuple[str, Mapping[str, Any]], ...] = (
        ("--yield", {"target": 1.0}),
        ("--yield", {"target": float("nan")}),
        ("--yield", {"target": 1.0 - 1e-6}),
        ("--budget", {"target": 0.9, "budget": -1.0}),
        ("--without", {"target": 0.9, "without": ("grades",)}),
        ("--jobs", {"target": 0.9, "options": Options(jobs=0)}),
        ("--out", {"target": 0.9, "out": design}),
    )
    for field, arguments in asked:
        with pytest.raises(InputError) as refused:
            repair_into(design, **cast(Any, arguments))
        assert refused.value.field == field
    fewest = 1e-6 * FEWEST_LOST
    assert telling(1.0 - fewest) < MOST_PLAIN
    assert telling(1.0 - fewest + 1e-6) == MOST_PLAIN  # one less, and no boards would tell
    for words in ({"ppm": 7.0}, {"ppm": 1e6}, {"ppm": float("nan")}, {"ppm": 10, "yield_": 0.9}):
        with pytest.raises(InputError) as refused:
            cure(design, **cast(Any, words))
        assert refused.value.field == "--ppm"
    assert sorted(p.name for p in design.iterdir()) == before


class _Stopped(BaseException):
    """As Ctrl-C."""


class _Stops(Progress):
    """Stops in the middle of the first round."""

    def stage(self, text: str, total: int | None = None) -> Any:
        if text.startswith("round 1"):
            raise _Stopped
        return super().stage(text, total)


class _Notes(Progress):
    """Keeps the notes, and stops before the first board."""

    def __init__(self) -> None:
        super().__init__()
        self.notes: list[str] = []

    def note(self, text: str) -> None:
        self.notes.append(text)

    def stage(self, text: str, total: int | None = None) -> Any:
        raise _Stopped


@pytest.mark.parametrize(("fidelity", "told"), [("auto", 0), ("ngspice", 1)])
def test_a_trade_that_sends_every_board_to_ngspice_is_told(
    design: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fidelity: StudyEngine, told: int
) -> None:
    folder = Path(shutil.copytree(design, tmp_path / "design"))
    choice = fidelity_choice.FidelityChoice(fidelity, "rung by trade.json: because")
    monkeypatch.setattr(fidelity_choice, "choose", lambda _: choice)
    said = _Notes()
    with pytest.raises(_Stopped), report_to(said):
        repair_into(folder, target=0.99)
    assert len(said.notes) == told
    assert all(choice.reason in note for note in said.notes)


@pytest.mark.slow
def test_a_design_is_repaired_and_its_repair_is_a_design(tmp_path: Path) -> None:
    from designer.jobs.study_job import run_into

    design = tmp_path / "design"
    synthesise_into(parse_model_file(SMALL), design, Options())
    other = Path(shutil.copytree(design, tmp_path / "stopped"))
    out = tmp_path / "cured"
    found = repair_into(design, target=0.99, without=WITHOUT, out=out)
    answer = found.answer
    assert found.reached
    (response,) = answer["responses"]
    assert response["before"]["high"] < 0.99 <= response["after"]["low"]
    assert answer["upgrades"]["grades"]
    assert answer["rounds"][-1]["measured"] == [response["after"]]

    with pytest.raises(_Stopped), report_to(_Stops()):
        repair_into(other, target=0.99, without=WITHOUT)
    with pytest.raises(InputError, match="unfinished"):
        repair_into(other, target=0.99, without=WITHOUT)
    repair_into(other, target=0.99, without=WITHOUT, options=Options(resume=True))
    for name in ("cure-front.csv", "cure-front.png", "cure-front.svg", STUDIES):
        assert (other / name).read_bytes() == (design / name).read_bytes()
    one, two = (json.loads((f / REPAIR).read_text()) for f in (design, other))
    assert {**one, "cost": 0} == {**two, "cost": 0}
    assert repair_into(design, target=0.99, without=WITHOUT).reused

    options = Options(seed=99, samples=400, rung="exact", blame=False)
    modelfile = parse_model_file((out / "model.toml").read_text(encoding="utf-8"), out / "m.toml")
    modelfile = replace(modelfile, source=out / "model.toml")
    yields = run_into(modelfile, out, options, lambda _: "").answer["responses"]
    # Another seed, so another draw of the same yield.
    assert yields[0]["yield"]["high"] > 0.99
    with (out / "bom.csv").open(encoding="utf-8", newline="") as bill:
        better = [row for row in csv.DictReader(bill) if row["grade"] == "0.001"]
    named = {name for row in better for name in row["designators"].split()}
    assert named == set(answer["upgrades"]["grades"])


@cache
def trimming() -> PartSlot:
    slot = trimmer_slot(branch().synthesis)
    assert slot is not None
    return slot


def with_trimmer(nominal: float, rate: float) -> LinearModel:
    """The known picture, where a trimmer can be had as well: so many boards show it trimmed."""
    seen = known_picture(nominal)
    slot = trimming()
    rows = (*seen.ways[0], ResponseWay(0, "trimmer", cast(Question, None), None, None, rate))
    parts = (*seen.parts, slot)
    return replace(seen, parts=parts, ways=(rows,))


@pytest.mark.slow
def test_the_trimmer_costs_what_it_adds_to_the_bill() -> None:
    made, slot = branch().synthesis, trimming()
    assert slot.trim is not None
    trimmer = CATALOG.trimmer(slot.trim.track)
    series = slot.trim.circuit.values["R911"]
    resistor = CATALOG.part("resistor", series, made.modelfile.circuit.resistor_grade)
    extra = CATALOG.euro(trimmer.price) + CATALOG.euro(resistor.price)
    assert [o.price for o in slot.slot.options] == [0.0, pytest.approx(extra)]
    assert trimmer_slot(made, frozenset({"trimmer"})) is None
    fitted = upgraded_file(made.modelfile, Upgrades(trimmer=True))
    again = trimmer_slot(with_same_parts(made, fitted))
    assert again is not None
    assert [o.price for o in again.slot.options] == [0.0, pytest.approx(0.0, abs=1e-12)]


@pytest.mark.parametrize("nominal", quick([6.5, 5.5]))
def test_a_trimmer_is_chosen_where_it_is_the_cheapest(nominal: float) -> None:
    """Against every choice; the trimmer's price is set so that it falls on either side."""
    plain = by_hand(nominal)
    for asked, taken in ((0.9 * plain, True), (1.1 * plain, False)):
        seen = with_trimmer(nominal, 1.0)
        options = tuple(
            replace(o, price=asked * i) for i, o in enumerate(seen.parts[-1].slot.options)
        )
        slot = replace(seen.parts[-1], slot=replace(seen.parts[-1].slot, options=options))
        seen = replace(seen, parts=(*seen.parts[:-1], slot))
        z = seen.quantiles(TARGET, seen.boards((0,) * (len(seen.parts) + 1)))
        program = seen.program(z, {})
        pick = cheapest(program)
        assert pick is not None
        least = min((p for p in program.picks() if program.keeps(p)), key=program.cost)
        assert program.cost(pick) == pytest.approx(program.cost(least))
        # Set, and shown trimmed, or neither.
        assert pick[-2] == pick[-1] == int(taken)
        assert seen.upgrades(pick).trimmer is taken
        assert bool(seen.upgrades(pick).grades) is not taken


def test_a_trimmer_is_set_for_every_response_or_for_none() -> None:
    seen = with_trimmer(6.5, 1.0)
    rows = seen.ways[0]
    seen = replace(seen, ways=(rows, (replace(rows[0], response=1, margin=Margin((), ())),)))
    program = seen.program({(0, 0, 0): 1e-3}, {}, frozenset({(0, 0)}))
    assert cheapest(program) is None  # the other response has no yield with it
    other = (seen.ways[1][0], replace(rows[1], response=1))
    program = replace(seen, ways=(rows, other)).program({(0, 0, 0): 1e-3}, {}, frozenset({(0, 0)}))
    pick = cheapest(program)
    assert pick is not None
    assert pick[-3:] == (1, 1, 1)
    assert program.cost(pick) == min(program.cost(p) for p in program.picks() if program.keeps(p))


@pytest.mark.slow
def test_a_trimmer_that_falls_short_is_not_taken_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few boards promised what many do not show: the next choice is the cheapest of grades."""
    real = truth(6.5)

    def of(
        plan: StudyPlan, target: float, verdict_cache: VerdictCache, **more: object
    ) -> MeasuredYield:
        if more.get("trim") is not None:
            return MeasuredYield(Yield(7000, 1000, 0, 0), target)
        return cast(MeasuredYield, real(plan, target, verdict_cache))

    seen = with_trimmer(6.5, 1.0)
    free = replace(
        seen.parts[-1].slot,
        options=tuple(replace(o, price=0.0) for o in seen.parts[-1].slot.options),
    )
    seen = replace(seen, parts=(*seen.parts[:-1], replace(seen.parts[-1], slot=free)))

    def pictured(seen: LinearModel, which: Sequence[tuple[int, int]], *_: object) -> LinearModel:
        """With a margin that sees no limit of the trimmed boards."""
        assert which == [(0, 1)]
        plain, trimmed = seen.ways[0]
        return replace(seen, ways=((plain, replace(trimmed, margin=Margin((), ()))),))

    monkeypatch.setattr(repair_search, "pictured", pictured)
    found = searched(monkeypatch, seen, of)
    assert found.reached
    assert found.rounds[0].upgrades.trimmer
    assert not found.best.upgrades.trimmer
    assert found.best.price == pytest.approx(by_hand(6.5))


def test_a_study_of_trimmed_boards_is_kept_apart() -> None:
    """The book's verdicts are those of the trimmed boards, once found and then known."""
    made, slot = branch().synthesis, trimming()
    assert slot.trim is not None
    question = bench_plans.question(3)
    circuit = made.design.circuit
    plan = StudyPlan(circuit, Spread(0.01, 0.01, 3e-4, 1e-3), 7, 6, (question,))
    verdict_cache = VerdictCache()
    letters, new = verdict_cache.block(plan, range(6), slot.trim, 1)
    assert new
    rows = trimmed_block(slot.trim, plan, range(6), 1)
    assert [repair_measure.VERDICTS[letter] for letter in letters] == [r.verdict for r in rows]
    assert verdict_cache.block(plan, range(6), slot.trim, 1) == (letters, False)
    assert verdict_cache.block(plan, range(6), None, 1)[1]


def matched_picture(signs: tuple[float, ...], nominal: float = 6.5) -> LinearModel:
    """A limit of the elements of one array alone, with slopes of these signs, and of R50."""
    from designer.centering import repair_linear_model

    made = branch().synthesis
    network = network_slots(made)[0]
    weights = dict(zip(network.network, signs, strict=False)) | {"R50": 1.0}
    circuit = made.design.circuit
    boards = draw_many(circuit, spread_of(made.modelfile, circuit, CATALOG), 3, range(4000))
    differing = quantities(circuit, boards)
    slopes = np.array([weights.get(q.name, 0.0) if q.group == "values" else 0.0 for q in differing])
    limit = Limit("x", "contact", nominal, 1.0, slopes)
    sigma = float(Margin(differing, (limit,)).each(boards).std())
    margin = Margin(differing, (replace(limit, sigma=sigma),))
    names = {*network.network, "R50"}
    parts = (*(p for p in part_slots(made) if p.slot.name in names), network)
    way = ResponseWay(0, "as it is", cast(Question, None), None, margin, 0.5)
    ratios = repair_linear_model._ratios(branch(), parts, 5)
    matched = repair_linear_model._matched(branch(), parts, 5)
    return LinearModel(branch(), parts, ((way,),), ratios, 0.0, 5, matched)


@pytest.mark.parametrize("signs", [(2.0, -2.0, 2.0, -2.0), (2.0, 2.0, 2.0, 2.0), (3.0, -1.0)])
def test_a_demand_holds_the_variance_of_drawn_arrays(signs: tuple[float, ...]) -> None:
    """Of boards drawn with the array; what it takes is most where only ratios count."""
    seen = matched_picture(signs)
    margin = seen.ways[0][0].margin
    assert margin is not None
    z = seen.quantiles(TARGET, seen.boards([0] * (len(seen.parts) + 1)))
    demand = seen.program(z, {}).demands[0]
    fixed = (margin.limits[0].reliability_index / z[0, 0, 0]) ** 2 - demand.room
    singles = [int(p.slot.name == "R50") for p in seen.parts]
    for pick in ([0] * len(singles), singles):
        for array in (0, 1):
            chosen = (*pick[:-1], array, 0)
            each = margin.each(seen.boards(chosen))[:, 0]
            # Known to 2 % of the draw each; the covariances of the array come on top.
            assert demand.variance(chosen) + fixed == pytest.approx(each.var(), rel=0.08)


def test_an_array_costs_what_it_changes_on_the_bill() -> None:
    made = branch().synthesis
    slots = network_slots(made)
    assert slots
    assert network_slots(made, frozenset({"network"})) == ()
    values = made.design.circuit.values
    for slot in slots[::3]:
        assert 2 <= len(slot.network) <= 4
        assert len({values[name] for name in slot.network}) == 1
        seen = LinearModel(branch(), (slot,), (), (), 0.0, 5)
        upgrades = seen.upgrades((1,))
        assert [n.parts for n in upgrades.networks] == [slot.network]
        assert Upgrades.of_dict(json.loads(json.dumps(upgrades.as_dict()))) == upgrades
        bought = replace(made, modelfile=upgraded_file(made.modelfile, upgrades))
        assert slot.slot.options[1].price == pytest.approx(price(bought) - price(made))
    held = [name for slot in slots for name in slot.network]
    assert len(set(held)) == len(held)  # one family in the catalogue


@pytest.mark.parametrize(
    ("signs", "nominal", "taken"),
    [((4.0, -4.0, 4.0, -4.0), 1.0, 1), ((4.0, -4.0, 4.0, -4.0), 12.0, 0), ((4.0,), 6.0, 0)],
)
def test_arrays_are_chosen_as_by_enumeration(
    signs: tuple[float, ...], nominal: float, taken: int
) -> None:
    """An array where ratios of its elements count, a better grade where one part does; and no part
    is both."""
    seen = matched_picture(signs, nominal)
    z = seen.quantiles(TARGET, seen.boards([0] * (len(seen.parts) + 1)))
    program = seen.program(z, {})
    least = min((p for p in program.picks() if program.keeps(p)), key=program.cost, default=None)
    pick = cheapest(program)
    assert least is not None
    assert pick is not None
    assert program.cost(pick) == pytest.approx(program.cost(least))
    assert pick[len(seen.parts) - 1] == taken
    network = seen.parts[-1].network
    graded = {p.slot.name for p, i in zip(seen.parts, pick, strict=False) if i and p.grades}
    assert not (taken and graded & {*network})
    for choice in program.picks():
        inside = choice[len(seen.parts) - 1] and any(
            i and p.slot.name in network for p, i in zip(seen.parts, choice, strict=False)
        )
        held = all(d.holds(choice) for d in program.demands if d.name.endswith(" once"))
        assert held is not bool(inside)


def test_the_finest_choices_can_be_built() -> None:
    parts = (*part_slots(branch().synthesis), *network_slots(branch().synthesis))
    for most in finest(parts, CATALOG):
        seen = LinearModel(branch(), parts, (), (), 0.0, 5)
        file = upgraded_file(branch().synthesis.modelfile, seen.upgrades(most))
        spread_of(file, branch().synthesis.design.circuit, CATALOG)
        assert any(most)
