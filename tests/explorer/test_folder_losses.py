"""What the page says of rare losses that a design folder's study has."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from designer.base.design_folder import MODEL, TOLERANCE, Folder
from designer.cli import entry
from designer.explorer.explorer_page import page
from designer.explorer.folder_losses import FolderLosses, folder_losses
from designer.folders.model_source import model_of
from designer.yields.rare_losses import LossRegion, RareLosses, ToleranceMargin
from tests.explorer.opened_page import chromium, opened
from tests.explorer.served import served
from tests.shared.model_text import SMALL
from tests.shared.quick_folders import without_starts

pytestmark = pytest.mark.usefixtures("designs_are_made_once")

TWO = (
    SMALL
    + """\
[[response]]
omega = 0.85
expect = "1-2-2"
b = 0.26

[spread]
temperature = [-20.0, 60.0]
"""
)
"""One response at two clearances."""
RARE = RareLosses(
    0, 12e-6, 8e-6, 17e-6, 0.0, 1500, 3000, 90, 60.0, 3.0, 40.0, 0.0, True,
    (LossRegion("", "2-2-2 <b>", 0.8, 9, ("R203 high",)),),
    (ToleranceMargin("", 0.6), ToleranceMargin("R203", 1.3)), 0.0,
)  # fmt: skip


def made(place: Path, *options: str) -> Path:
    """A design folder whose study, asked for an estimate, says ``RARE`` of each response."""
    model = place.with_suffix(".toml")
    model.write_text(TWO, "utf-8")
    command = ["tolerance", str(model), "--out", str(place), "--rung", "exact", "--samples", "1"]

    def known(_plan: object, number: int, **_: object) -> RareLosses:
        return replace(RARE, question=number)

    def report(_data: object, html: Path, text: Path, _sections: object) -> None:
        for path in (html, text):
            path.write_text("report")

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("designer.yields.tolerance_study.rare_losses", known)
        patched.setattr("designer.report.write.write_report", report)
        without_starts(patched)
        assert entry.status([*command, "--no-blame", "--seed", "3", *options]) == 0
    return place


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, designs_are_made_once: None) -> Path:
    """A folder with an estimate, which no test changes."""
    return made(tmp_path_factory.mktemp("whole") / "d", "--rare")


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(whole, tmp_path / "d"))


def said(folder: Path) -> FolderLosses:
    """What is found of a folder of which nothing has to be noted."""
    losses = folder_losses(model_of(folder), pytest.fail)
    assert losses is not None
    return losses


def test_figures_of_a_folder_stand_on_its_page(whole: Path) -> None:
    """With the parts and the temperature that they are of, and the clearance of each response; what
    a file says is no markup."""
    losses = said(whole)
    text = page(model_of(whole), losses)
    for words in ("for the parts of this folder", "at −20 to 60 °C", "seed 3"):
        assert words in text
    first, second = losses.message()["rows"]
    assert (first["omega"], first["b"], first["summary"]) == (0.85, 0.25, "1-2-2 at ω = 0.85")
    assert (second["omega"], second["b"]) == (0.85, 0.26)
    assert second["summary"] == "1-2-2 at ω = 0.85, b = 0.26"
    assert first["words"] == (
        "12 of a million boards are lost (8 to 17), of them 80 % by R203 high, which show "
        "2-2-2 <b>; R203 alone loses it at 1.3 times its tolerance"
    )
    assert "2-2-2 <b>" not in text
    assert "At least one of the responses is lost on 12 to 24 of a million boards" in text
    assert "Boards of a million" not in page(model_of(whole))


@pytest.mark.slow
def test_without_a_finished_estimate_of_this_model_nothing_is_said(
    folder: Path, tmp_path: Path
) -> None:
    model = tmp_path / "small.toml"
    model.write_text(SMALL, "utf-8")
    assert folder_losses(model_of(model), pytest.fail) is None
    assert folder_losses(model_of(made(tmp_path / "a")), pytest.fail) is None
    (folder / MODEL).write_text(TWO.replace("b = 0.26", "b = 0.27"), "utf-8")
    assert folder_losses(model_of(folder / MODEL), pytest.fail) is None
    (folder / MODEL).write_text(TWO, "utf-8")
    said(folder)
    Folder(folder).begin({"study": ({}, [TOLERANCE])})
    assert folder_losses(model_of(folder), pytest.fail) is None


@pytest.mark.slow
def test_a_study_that_cannot_be_read_is_noted_and_done_without(
    folder: Path, tmp_path: Path
) -> None:
    notes = list[str]()
    study = json.loads((folder / TOLERANCE).read_text("utf-8"))
    study["responses"][0]["rare"]["per_million"] = [0.0, 0.0, 1.0]
    (folder / TOLERANCE).write_text(json.dumps(study), "utf-8")
    assert folder_losses(model_of(folder), notes.append) is None
    (folder / TOLERANCE).unlink()
    assert folder_losses(model_of(folder), notes.append) is None
    edited, deleted = notes
    assert "tolerance.json" in edited
    assert "sha256" in edited
    assert "tolerance.json" in deleted
    with served(folder, tmp_path, "--port", "0") as address:
        assert address


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as each:
        yield each


@pytest.mark.browser
def test_the_page_says_when_it_shows_other_values(
    browser: Browser, whole: Path, tmp_path: Path
) -> None:
    """Another frequency, another clearance or another number of the model; a row leads to its
    response."""
    with served(whole, tmp_path, "--port", "0") as address:
        shown = opened(browser, address)
        shown.wait_for_selector("#moved", state="hidden")
        assert "12 of a million boards are lost" in shown.inner_text("#losses li")
        clearance = shown.locator("[data-name=b] .number")
        for name, value in (("omega", "0.86"), ("b", "0.27")):
            shown.fill(f"[data-name={name}] .number", value)
            shown.press(f"[data-name={name}] .number", "Enter")
            shown.wait_for_selector("#moved:not([hidden])")
            shown.click("#losses li:nth-child(2) button")
            shown.wait_for_selector("#moved", state="hidden")
            assert clearance.input_value() == "0.26"
        shown.click("#losses li:nth-child(1) button")
        shown.wait_for_function("document.querySelector('[data-name=b] .number').value === '0.25'")
        shown.wait_for_selector("#moved", state="hidden")
        shown.fill("[data-name=zeta] .number", "0.11")
        shown.press("[data-name=zeta] .number", "Enter")
        shown.wait_for_selector("#moved:not([hidden])")
        shown.click("#reset")
        shown.wait_for_selector("#moved", state="hidden")
        shown.close()
