"""What the page says of rare losses that a design folder's study has."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from designer import InputError
from designer.base.design_folder import MODEL, TOLERANCE, Folder
from designer.base.plain_json import dumps
from designer.explorer.explorer_page import page
from designer.explorer.folder_losses import folder_losses
from designer.folders.model_source import model_of
from designer.model.model_file import parse_model_file
from tests.explorer.opened_page import chromium, opened
from tests.explorer.served import served
from tests.shared.model_text import SMALL

REGION = {"becomes": "2-2-2 <b>", "found_by": "", "share": 0.8, "boards": 9, "parts": ["R203 high"]}
RARE = {
    "per_million": [12.0, 8.0, 17.0],
    "drawn_lost": 90,
    "regions": [REGION],
    "margins": [{"part": "", "widening": 0.6}, {"part": "R203", "widening": 1.3}],
}


def made(place: Path, **changes: Any) -> Path:
    """A design folder with a finished study that says this of its response."""
    digest = parse_model_file(SMALL).sha256
    response = {"omega": 0.85, "expected": "1-2-2", "model": "1-2-2", "rare": RARE}
    study = {
        "format": 1,
        "responses": [response],
        "provenance": {"seed": 3, "spread": {"temperature": [-20.0, 60.0]}},
        **changes,
    }
    folder = Folder(place)
    stages = {"design": ({"model": digest}, [MODEL]), "study": ({}, [TOLERANCE])}
    with folder.working(stages):  # type: ignore[arg-type]
        folder.write(MODEL, SMALL)
        folder.write(TOLERANCE, dumps(study))
    return place


def test_figures_of_a_folder_stand_on_its_page(tmp_path: Path) -> None:
    """With the parts and the temperature that they are of; what a file says is no markup."""
    modelfile = model_of(made(tmp_path / "d"))
    losses = folder_losses(modelfile)
    assert losses is not None
    text = page(modelfile, losses)
    for words in ("for the parts of this folder", "at −20 to 60 °C", "seed 3"):
        assert words in text
    (row,) = losses.message()["rows"]
    assert (row["omega"], row["summary"]) == (0.85, "1-2-2 at ω = 0.85")
    assert row["words"] == (
        "12 of a million boards are lost (8 to 17), of them 80 % by R203 high, which show "
        "2-2-2 <b>; R203 alone loses it at 1.3 times its tolerance"
    )
    assert "2-2-2 <b>" not in text
    assert "At least one" not in text
    assert "Boards of a million" not in page(modelfile)


def test_bounds_of_several_responses_are_said(tmp_path: Path) -> None:
    joint = {"least": 1.2e-5, "most": 3e-5, "low": 8e-6, "high": 4.1e-5}
    losses = folder_losses(model_of(made(tmp_path / "d", any_lost=joint)))
    assert losses is not None
    assert "12 to 30 of a million boards (8 to 41 by the ends of the intervals)" in losses.words


def test_where_no_board_is_lost_the_bound_is_said(tmp_path: Path) -> None:
    none = RARE | {"per_million": [0.0, 0.0, 75.0], "drawn_lost": 0, "regions": [], "margins": []}
    response = {"omega": 0.85, "expected": "1-2-2", "model": "1-2-2", "rare": none}
    losses = folder_losses(model_of(made(tmp_path / "d", responses=[response])))
    assert losses is not None
    assert "at most 75 of a million" in losses.rows[0][2]


def test_without_a_finished_estimate_of_this_model_nothing_is_said(tmp_path: Path) -> None:
    model = tmp_path / "small.toml"
    model.write_text(SMALL, "utf-8")
    assert folder_losses(model_of(model)) is None
    without = {"omega": 0.85, "expected": "1-2-2", "model": "1-2-2"}
    assert folder_losses(model_of(made(tmp_path / "a", responses=[without]))) is None
    other = made(tmp_path / "b")
    (other / MODEL).write_text(SMALL.replace("omega = 0.85", "omega = 0.86"), "utf-8")
    assert folder_losses(model_of(other / MODEL)) is None
    unfinished = made(tmp_path / "c")
    Folder(unfinished).begin({"study": ({}, [TOLERANCE])})
    assert folder_losses(model_of(unfinished)) is None


def test_a_study_that_is_none_is_named(tmp_path: Path) -> None:
    folder = made(tmp_path / "d", responses=[{"omega": 0.85, "rare": {"per_million": "x"}}])
    with pytest.raises(InputError, match=r"tolerance\.json"):
        folder_losses(model_of(folder))
    changed = made(tmp_path / "e")
    study = json.loads((changed / TOLERANCE).read_text("utf-8"))
    study["responses"][0]["rare"]["per_million"] = [0.0, 0.0, 1.0]
    (changed / TOLERANCE).write_text(json.dumps(study), "utf-8")
    with pytest.raises(InputError, match="sha256"):
        folder_losses(model_of(changed))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as each:
        yield each


@pytest.mark.browser
def test_the_page_says_when_it_shows_other_values(browser: Browser, tmp_path: Path) -> None:
    """Another frequency or another number of the model; the row leads back to its frequency."""
    with served(made(tmp_path / "d"), tmp_path, "--port", "0") as address:
        shown = opened(browser, address)
        shown.wait_for_selector("#moved", state="hidden")
        assert "12 of a million boards are lost" in shown.inner_text("#losses li")
        shown.fill("[data-name=omega] .number", "0.86")
        shown.press("[data-name=omega] .number", "Enter")
        shown.wait_for_selector("#moved:not([hidden])")
        shown.click("#losses li button")
        shown.wait_for_selector("#moved", state="hidden")
        shown.fill("[data-name=zeta] .number", "0.11")
        shown.press("[data-name=zeta] .number", "Enter")
        shown.wait_for_selector("#moved:not([hidden])")
        shown.click("#reset")
        shown.wait_for_selector("#moved", state="hidden")
        shown.close()
