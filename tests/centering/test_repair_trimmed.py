"""Margins of trimmed boards: the wiper's part against boards on which it was really set."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from designer.centering import repair_linear_model as repair_trimmed
from designer.centering.repair_linear_model import trimmed_margins, trimmer_ways, without_wiper
from designer.centering.repair_measure import VerdictCache
from designer.centering.repair_ways import ResponseSurvey, ResponseWay
from designer.circuit.board_arrays import Boards
from designer.circuit.board_modes import at_rest
from designer.circuit.board_values import nominal_board
from designer.spread.board_quantities import quantities
from designer.spread.spread import draw_many
from designer.verdicts.exact_circuit import block
from designer.verdicts.verdict import StudyPlan, Verdict
from designer.yields import margins
from designer.yields.margins import Limit, Margin
from designer.yields.trimmed_yield import trimmed_answers, trimmed_boards
from tests.shared.bench_plans import plan
from tests.yields.test_trimmed_yield import ROUGH, trim


def test_what_the_trimmer_holds_still_depends_on_nothing() -> None:
    """The rest point's distance from the middle of the stops, as a linear form of the parts: the
    trimmer brings it to zero, so what is left of its variance is little."""
    of = replace(plan(3, spread=ROUGH), samples=400)
    boards, _ = trimmed_boards(trim(), of, range(400))
    differing = quantities(trim().circuit, boards)
    one = Boards.of(trim().circuit, [nominal_board(trim().circuit)])
    nominal = margins._probes(one, differing).boards
    rest, stops = at_rest(nominal)
    away = rest - 0.5 * (stops[1] + stops[-1])
    slopes = (away[1::2] - away[0::2]) / (2.0 * margins.STEP)
    raw = Margin(differing, (Limit("x", "contact", 1.0, 1.0, slopes),))
    found = without_wiper(raw, of, trim())
    plain = draw_many(of.circuit, ROUGH, of.seed, range(400))
    untouched = Margin(
        found.quantities,
        (replace(raw.limits[0], slopes=slopes[[q in found.quantities for q in differing]]),),
    )
    before = untouched.each(plain).std()
    after = (found.each(plain) * found.limits[0].sigma).std()
    assert after < 0.1 * before


class _Looker(ResponseSurvey):
    """Of a plan, where there is no branch."""

    @property
    def plan(self) -> StudyPlan:
        return replace(plan(6, spread=ROUGH), questions=())


def ways(best: StudyPlan, target: float) -> list[ResponseWay] | None:
    none = cast(Any, None)
    survey = _Looker(none, target, 1, VerdictCache(), 0.0, frozenset(), (best,), 2, lambda: None)
    return trimmer_ways(
        survey, trim(), [ResponseWay(0, "as it is", plan(6, spread=ROUGH).questions[0])]
    )


@pytest.mark.slow
def test_what_trimmed_boards_show_is_what_a_study_of_them_finds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And the trimmer is no way where even the best parts, here as rough as the others, lose too
    many boards for the target."""
    monkeypatch.setattr(repair_trimmed, "SAMPLES", 40)
    of = plan(6, spread=ROUGH)
    answers, _ = trimmed_answers(trim(), of, range(40), 2)
    rate = sum(a.verdict is Verdict.OK for a in answers) / 40
    assert 0.0 < rate < 0.95
    fine = replace(of, spread=replace(ROUGH, resistor=1e-4, capacitor=1e-4), questions=())
    found = ways(fine, 0.99)
    assert found is not None
    (way,) = found
    assert way.kind == "trimmer"
    assert way.rate == pytest.approx(rate)
    assert ways(replace(of, questions=()), 0.999) is None


@pytest.mark.slow
def test_the_margin_foretells_trimmed_boards() -> None:
    """Chosen on some boards, its sign is held against the verdicts of others; the one as built
    says nothing about them."""
    of = replace(plan(6, spread=ROUGH), samples=120)
    (margin,) = trimmed_margins(of, trim(), count=3, jobs=2)
    assert {q.name for q in margin.quantities} <= {
        q.name for q in quantities(of.circuit, draw_many(of.circuit, ROUGH, of.seed, range(120)))
    }
    fresh = range(200, 400)
    answers, _ = trimmed_answers(trim(), of, fresh, 2)
    boards = draw_many(of.circuit, ROUGH, of.seed, fresh)
    ok = np.array([a.verdict is Verdict.OK for a in answers])
    right = ((margin.of(boards) > 0.0) == ok).mean()
    assert right > 0.8
    built = [a.verdict is Verdict.OK for a in block(of, fresh, 2)]
    assert np.mean(built) < ok.mean()
