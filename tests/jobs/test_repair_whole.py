"""Whole repairs of real boards by one kind of upgrade, the only one allowed. What is promised is
held against the plain tolerance study of the repaired folder, on boards of a seed that the repair
has not seen, and the price against the two folders' bills."""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import pytest

from designer.answers.cure_answer import CureAnswer, CuredResponse
from designer.base.design_folder import MODEL
from designer.catalog.parts_catalog import load_catalog
from designer.centering.repair_branch import KINDS, PLACE, TRIMMER
from designer.centering.repair_measure import plan_of, questions_of
from designer.folders.design_source import read_design
from designer.jobs.options import Options
from designer.jobs.repair_job import repair_into
from designer.jobs.study_job import run_into
from designer.jobs.synthesise_job import synthesise_into
from designer.model.model_file import parse_model_file, read_model_file
from designer.yields.yield_maps import yield_map
from tests.shared.model_text import PAPER_TABLE
from tests.shared.quick_folders import without_starts
from tests.shared.typed_answers import check_type

FRESH = Options(seed=4242, samples=400, rung="exact", blame=False)
"""Of the study by which a repair is judged."""


def text(omega: float, expect: str, b: float = 0.25, dead_zone: str = "saturation") -> str:
    """The paper's model, one response, E24 parts of 1 %."""
    return f"""format = 1
{PAPER_TABLE}
[[response]]
omega = {omega}
expect = "{expect}"
b = {b}

[circuit]
opamp = "TL074C"
saturation = 13.0
resistors = "E24"
dead_zone = "{dead_zone}"
"""


@dataclass(frozen=True)
class Whole:
    """A design folder, the one of its repair by one kind of upgrade, and what the repair says."""

    design: Path
    repaired: Path
    answer: CureAnswer

    @property
    def told(self) -> CuredResponse:
        """The one response, as the repair tells it."""
        (response,) = self.answer["responses"]
        return response


def whole(where: Path, model: str, kind: str, target: float) -> Whole:
    """The repair of this model file's design by this kind alone."""
    design, repaired = where / "design", where / "cured"
    synthesise_into(parse_model_file(model), design, Options())
    found = repair_into(design, target=target, without=set(KINDS) - {kind}, out=repaired)
    assert found.reached, found.answer["why"]
    check_type(found.answer, "search")
    return Whole(design, repaired, found.answer)


def studied(folder: Path, options: Options = FRESH) -> dict[str, Any]:
    """What the plain tolerance study says about a folder's one response."""
    modelfile = read_model_file(folder / MODEL)
    answer = run_into(modelfile, folder, options, lambda _: "").answer
    (response,) = answer["responses"]
    return cast(dict[str, Any], response)


def euro(folder: Path) -> float:
    """What the folder's bill of materials comes to."""
    catalog = load_catalog()
    with (folder / "bom.csv").open(encoding="utf-8", newline="") as bill:
        return sum(
            int(row["quantity"]) * catalog.euro(int(row["price_class"]))
            for row in csv.DictReader(bill)
        )


def is_kept(found: Whole, before: dict[str, Any], after: dict[str, Any]) -> None:
    """The promise, on fresh boards of both folders, and the price, on both bills."""
    target = found.answer["target"]
    assert found.told["before"]["high"] < target <= found.told["after"]["low"]
    assert before["high"] < target
    assert after["failed"] == 0
    assert after["low"] <= found.told["after"]["rate"] <= after["high"]
    assert after["high"] >= target
    extra = euro(found.repaired) - euro(found.design)
    assert found.answer["price"] == pytest.approx(extra, abs=1e-9)


def changed(found: Whole) -> dict[str, Any]:
    """The upgrades that were taken."""
    return {kind: taken for kind, taken in found.answer["upgrades"].items() if taken}


@pytest.mark.slow
def test_the_fitted_trimmer_alone(tmp_path: Path) -> None:
    """As users have it: with starts, findings, attribution and the report, all before the fixtures
    of the other test."""
    found = whole(tmp_path, text(0.215, "1-8-8", 0.262, "rectifier"), TRIMMER, 0.9)
    assert changed(found) == {"trimmer": True}
    assert found.answer["price"] > 0.0
    options = replace(FRESH, blame=True)
    before, after = studied(found.design, options), studied(found.repaired, options)
    is_kept(found, before["yield"], after["trimmed"])
    # As built, the boards of both folders are the same ones.
    assert after["yield"] == before["yield"]
    for folder in (found.design, found.repaired):
        assert "<svg" in (folder / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.usefixtures("figures_are_blank", "quick_reports")
def test_another_b_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last of eight impacts nearly grazes at b = 0.25, at any frequency of the window. No
    repair asks for starts and findings."""
    without_starts(monkeypatch)
    found = whole(tmp_path, text(0.215, "1-8-8", 0.25, "rectifier"), PLACE, 0.97)
    (place,) = changed(found)["places"]
    assert place["omega"] == 0.215
    assert place["b"] > 0.25
    assert found.answer["price"] == 0.0
    is_kept(
        found,
        studied(found.design, replace(FRESH, samples=200))["yield"],
        studied(found.repaired)["yield"],
    )
    made = read_design(found.design)
    (question,) = questions_of(made, made.model_responses)
    assert question is not None
    plan = plan_of(made, question, FRESH.seed)
    along = yield_map(plan, 0, "omega", 0.25, values=(0.2125, 0.215, 0.2175), samples=30)
    assert along.rate.max() < 0.8
