"""The report's part on tolerance: it says what the layers hold, and nothing where they are not."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
import pytest

from designer.base.page import Table
from designer.model.distributions import Normal
from designer.report import words
from designer.report.data import ReportData
from designer.report.design_tables import condition_table
from designer.report.response_tables import provenance_table
from designer.report.tolerance_tables import (
    avoided,
    boards,
    corners,
    differences,
    indices,
    kinds,
    limits,
    maps,
    over_temperature,
    rare,
    recipes,
    what_temperature_moves,
)
from designer.report.write import render_html, render_markdown
from designer.spread.spread import OpAmpDrift
from designer.verdicts.verdict import Verdict
from designer.yields.loss_attribution import Attribution, NearLimit, ResponseAttribution
from designer.yields.loss_replay import PartAttribution
from designer.yields.margins import Prediction
from designer.yields.rare_losses import LossRegion, RareLosses, ToleranceMargin
from designer.yields.worst_corner import Corner, Index
from designer.yields.yield_maps import Axis, YieldMap
from tests.report.test_write import Page, words_of
from tests.shared.report_data import changed, plain_report

HOSTILE = "<b>x</b> | `y`"


@dataclass(frozen=True)
class Row:
    sample: int
    question: int
    verdict: Verdict
    bench_verdict: Verdict = Verdict.OK


@dataclass(frozen=True)
class Share:
    count: int = 1
    of: int = 40
    interval: tuple[float, float] = (0.004, 0.13)


@dataclass(frozen=True)
class Other:
    sample: int = 7
    kind: str = "own"
    exact: str = "1-1-1"
    ngspice: str = "3-3-3"
    explanation: str = "grazing margin"


@dataclass(frozen=True)
class Together:
    estimate: float = 0.875
    undecided: int = 2
    if_lost: float = 0.86
    if_ok: float = 0.885
    low: float = 0.8
    high: float = 0.925
    disagreement: Share = Share()
    differences: tuple[Other, ...] = (Other(),)


@dataclass(frozen=True)
class Recipe:
    text: str = f"switch on at 500 Hz {HOSTILE}"


@pytest.fixture(scope="module")
def plain() -> ReportData:
    return plain_report()


BOTH = Index("U3C.offset", "U3C", 0.2, 0.6, 0.02, 0.05), Index("R204", "R204", -0.01, 0.3)


def attributed(question: int, lost: int) -> ResponseAttribution:
    subjects = (
        PartAttribution("all offsets", "group", 9, 10, 1, 4),
        PartAttribution("U3C", "op-amp", 6, 10, 0, 4),
        PartAttribution("R204", "resistor", 0, 10, 0, 4),
    )
    return ResponseAttribution(
        question,
        lost,
        subjects if lost else (),
        BOTH,
        (NearLimit("stability: a fold", 1.5),),
        Prediction(80, 20, 2, 3),
        8,
        1,
        Corner(("U3C.offset",), ("high",), -1.0, Verdict.LOST, "2-2-2", 1, 2),
        f"question {question} sentence {HOSTILE}",
    )


def mapped(question: int) -> YieldMap:
    ok = np.array([0, 80, 100])
    nothing = np.zeros_like(ok)
    return YieldMap(
        "omega", question, (Axis("omega", (0.8, 0.85, 0.9)),), np.array([False, True, True]), ok,
        np.array([0, 20, 0]), nothing, nothing, 100, 1, 0.85, (0.82, 0.9), (False, True), 30, 0.1,
    )  # fmt: skip


def test_the_map_over_temperature_says_what_moves_its_boards_and_where_no_sheet_holds(
    plain: ReportData,
) -> None:
    drift = OpAmpDrift(offset=Normal(18e-6, 54e-6), bias_doubling=10.0, gain_bandwidth=-2e-3)
    warm = replace(
        mapped(1), over="temperature", axes=(Axis("temperature", (-20.0, 25.0, 85.0)),),
        used=25.0, window=None, drift=drift, specified=(0.0, None),
    )  # fmt: skip
    data = changed(plain, maps=(warm,))
    table = over_temperature(data)
    assert table is not None
    assert list(table.columns)[1:] == ["−20 °C*", "25 °C", "85 °C"]
    said = what_temperature_moves(data).replace("\N{NO-BREAK SPACE}", " ")
    assert "normal with σ = 18 µV/K, cut at 54 µV/K" in said
    assert "a doubling every 10 K" in said
    assert "gain-bandwidth by -0.2 %/K (which does not enter the yield)" in said
    assert "* The op-amp is specified from 0 °C, not here." in said
    assert what_temperature_moves(plain) == ""


@pytest.fixture(scope="module")
def full(plain: ReportData) -> ReportData:
    tuned = [
        Row(s, q, Verdict.LOST if (s, q) == (0, 1) else Verdict.OK)
        for s in range(4)
        for q in (0, 1)
    ]
    reached = [Row(s, 0, Verdict.OK) for s in range(4)] + [Row(9, 1, Verdict.FAILED)]
    return changed(
        plain,
        tuned=tuple(tuned),
        power_ups=tuple(reached),
        combined=(Together(), None),
        recipes=(Recipe(), Recipe("dwell for 2 s")),
        blame=Attribution((attributed(0, 10), attributed(1, 0)), 100, 1, 500, 300, 1.0),
        maps=(mapped(1),),
    )


def rows_of(table: Table | None) -> tuple[tuple[str, ...], ...]:
    assert table is not None
    return table.rows


def test_without_layers_there_is_no_trace_of_them(plain: ReportData) -> None:
    for part in (kinds, differences, recipes, limits, avoided, corners, maps, boards):
        assert part(plain) is None
    page = words_of(plain)
    text = page.text + render_markdown(plain)
    for heading in ("Which part is to blame", "Where to sit", "and both engines", "How to reach"):
        assert heading not in text
    assert "#blame" not in {a.get("href") for a in page.named("a")}


def test_each_kind_of_yield_stands_beside_the_others(full: ReportData) -> None:
    table = kinds(full)
    assert table is not None
    assert table.columns == (
        "response", "as built", "tuned", "tuned on the bench", "reached", "both engines together",
    )  # fmt: skip
    first, second, whole = table.rows
    assert first[2].startswith("100 % (51 to 100)")  # Wilson's of 4 of 4
    assert second[2].startswith("75 %")
    assert first[5] == (
        "87.5 % (80 to 92.5), 2 without an answer in ngspice: 86 % if these are lost, 88.5 % if ok"
    )
    assert second[4:] == ("–", "–")
    assert whole[0] == "all on one board"
    assert whole[2].startswith("75 %")


def test_the_heading_names_the_kinds_that_there_are(full: ReportData) -> None:
    data = changed(full, tuned=None, power_ups=None, combined=(Together(), None))
    assert "### As built and both engines together" in render_markdown(data)


def test_without_a_loss_nobody_is_to_blame(full: ReportData) -> None:
    one, other = (replace(attributed(q, 0), prediction=Prediction(100, 0, 0, 0)) for q in (0, 1))
    none = Attribution((one, other), 100, 1, 500, 300, 1.0)
    text = render_markdown(changed(full, blame=none))
    assert "foretold by the margin" not in text
    assert "## What comes nearest to a loss?" in text
    assert "No board was lost, so none was asked again." in text
    assert "Lost boards were asked" not in text
    assert "to blame" not in text


def test_a_difference_says_where_ngspice_started(full: ReportData) -> None:
    row = rows_of(differences(full))[0]
    assert row[2] == (
        "board 7 from its own orbit: exact circuit 1-1-1, ngspice 3-3-3 (grazing margin)"
    )


def test_every_response_has_its_start_recipe_without_power_ups(plain: ReportData) -> None:
    assert recipes(plain) is None
    text = render_markdown(replace(plain, starts=("sweep down to 500 Hz", "switch on there")))
    assert "How to reach a response" in text
    assert "sweep down to 500 Hz" in text
    assert "switch on there" in text


def test_conditions_have_words_and_units(plain: ReportData) -> None:
    rows = rows_of(condition_table(plain.design))
    assert rows
    assert not {name for name, _ in rows} & {k.replace("_", " ") for k in plain.design.conditions}


def test_the_provenance_has_the_spread_in_words(plain: ReportData) -> None:
    assert plain.plan is not None
    data = changed(plain, provenance={"seed": 1, "spread": plain.plan.spread.as_dict()})
    rows = {row[0]: row[1] for row in rows_of(provenance_table(data))}
    assert set(rows) == {"seed", "spread"}
    assert rows["spread"].startswith("bench-1: resistors uniform within ± 1 %")


def test_a_very_small_error_has_no_exponent() -> None:
    assert words.error(5.06e-9) == words.error(-5.06e-9) == "exact (up to 1e-6)"
    assert words.error(1.26e-4) == "0.0126 %"


def test_an_interval_near_the_end_keeps_its_ends_apart() -> None:
    assert words.span(0.99904, 1.0) == ("99.9", "100")
    assert words.span(0.51, 1.0) == ("51", "100")
    assert words.span(0.0, 0.0001) == ("0.00", "0.01")


def test_the_attribution_says_who_and_how_sure_it_is(full: ReportData) -> None:
    assert len(rows_of(avoided(full))) == 1
    (_, lost, groups, parts) = rows_of(avoided(full))[0]
    assert lost == "10"
    assert groups == "all offsets: 9 of 10 (60 to 98 %), 1 of 4 ok boards lost"
    assert parts == "U3C: 6 of 10 (31 to 83 %)"
    assert rows_of(limits(full))[0][2] == "95 of 100 (lost boards missed: 2, false alarms: 3)"
    assert rows_of(corners(full))[0][1:] == ("U3C.offset high", "lost: 2-2-2", "1 of 2")
    assert [row[1:] for row in rows_of(indices(full))[:2]] == [
        ("U3C.offset", "20 ± 4 %", "60 ± 10 %"),  # 1.96 standard errors
        ("R204", "−1 %", "30 %"),  # of an earlier version, that knew no noise
    ]
    assert "500 attractors" in render_markdown(full)


def test_an_attribution_without_noise_says_once_how_to_get_it(full: ReportData) -> None:
    anew = "designer tolerance 'my boards' --blame --resume"
    text = render_markdown(replace(full, folder="my boards"))
    assert text.count(anew) == text.count("stored no noise") == 1
    assert "95 % noise" not in text
    attribution = full.study.blame
    assert attribution is not None
    known = tuple(replace(index, first_error=0.02, total_error=0.05) for index in BOTH)
    whole = replace(
        attribution, responses=tuple(replace(r, indices=known) for r in attribution.responses)
    )
    text = render_markdown(changed(full, blame=whole))
    assert "95 % noise" in text
    assert "stored no noise" not in text


def test_an_attribution_says_a_temperature_that_is_stated(full: ReportData) -> None:
    assert full.plan.spread.temperature is None
    assert "the nominal one" not in render_markdown(full)
    warm = replace(full.plan, spread=replace(full.plan.spread, temperature=(-20.0, 60.0)))
    text = render_markdown(changed(full, plan=warm))
    assert "Boards are at −20 to 60 °C, each at its own, the nominal one at 25 °C." in text
    assert "temperature uniform from −20 to 60 °C" in text


def test_a_map_says_what_is_in_use_and_what_is_better(full: ReportData) -> None:
    row = rows_of(maps(full))[0]
    assert row[1] == "ω"
    assert row[2] == "0.82 to 0.9 (as far as was looked)"
    assert row[3].startswith("0.85: 80 %")
    assert row[4].startswith("0.9: 100 %")


def test_a_response_that_survives_nowhere_has_no_recommended_setting(full: ReportData) -> None:
    none = replace(mapped(1), ok=np.zeros(3, dtype=np.int64), lost=np.array([0, 10, 10]))
    data = changed(full, maps=(none,))
    row = rows_of(maps(data))[0]
    assert row[-1] == "nowhere"
    assert row[-2].startswith("0.85: 0")
    assert "nowhere" in render_markdown(data)


@pytest.mark.slow
def test_both_pages_hold_every_section_once_and_nothing_of_it_is_markup(full: ReportData) -> None:
    html, markdown = render_html(full), render_markdown(full)
    page = Page(html)
    assert html == render_html(full)
    for heading in (
        "As built, tuned, tuned on the bench, reached and both engines together",
        "Where the engines differ", "How to reach a response",
        r"Which part is to blame\?", "Losses avoided", "Worst corners", "Where to sit",
        "Whose spread moves the margin",
    ):  # fmt: skip
        assert len(re.findall(rf"<h[234]>{heading}</h[234]>", html)) == 1
        assert len(re.findall(rf"^##+ {heading}$", markdown, re.M)) == 1
    assert {"#blame", "#maps"} <= {a.get("href") for a in page.named("a")}
    assert "<b>x</b>" not in html
    assert HOSTILE in page.text
    assert "<b>" not in markdown.replace("\\<", "")
    alts = page.pictures()
    assert sum("losses" in a for a in alts) == 1
    assert sum("Sobol" in a for a in alts) == 1
    assert sum(a.startswith("Yield over omega") for a in alts) == 1
    assert "exact circuit 1-1-1, ngspice 3-3-3 (grazing margin)" in page.text


def estimate(question: int, lost: float) -> RareLosses:
    """One region, one part."""
    region = LossRegion("a contact", "2-2-2", 0.8, 90, ("R203 high", "C1 low"))
    margin = ToleranceMargin("R203", 1.3)
    return RareLosses(
        question, lost, 0.5 * lost, 2.0 * lost, 0.0, 1500, 3000, 90, 60.0, 3.0, 40.0, 1e-3, True,
        (region,), (margin,), 0.0,
    )  # fmt: skip


def test_boards_of_a_million_stand_in_the_first_answer(plain: ReportData) -> None:
    """The response that most lose, with what it becomes and the part that loses it; how many lose
    one of both; at which temperature."""
    warm = replace(plain.plan, spread=replace(plain.plan.spread, temperature=(-20.0, 60.0)))
    data = changed(plain, rare=(estimate(0, 2e-5), estimate(1, 5e-5)), plan=warm)
    text = render_markdown(data)
    assert (
        f"{words.name(data.checked[1])}: 50 of a million boards are lost (25 to 100), of them 80 % "
        "by R203 high, C1 low, which show 2-2-2; R203 alone loses it at 1.3 times its tolerance."
    ) in text
    assert (
        "is lost on 50 to 70 of a million boards (20.7 to 3095 by the intervals and what may"
        in text
    )
    assert "Boards differ as in the study above, at −20 to 60 °C, each at its own." in text
    table = rare(data)
    assert table is not None
    last = dict(zip(table.columns, table.rows[-1], strict=True))
    assert last["response"] == "at least one, on one board"
    assert last["lost of a million"] == "50 to 70"
    single = changed(data, rare=(estimate(0, 2e-5),))
    assert "at least one" not in render_markdown(single).lower()
