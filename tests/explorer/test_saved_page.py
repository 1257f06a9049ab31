"""The page as one file: what it carries, and that it works from a disc without a server."""

from __future__ import annotations

import base64
import math
from pathlib import Path

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

from designer import InputError, explore, read_model_file
from designer.explorer import saved_page, saved_page as branch_recording
from designer.explorer.explorer_page import recorded_page
from designer.explorer.place import ModelPlace
from designer.explorer.response_view import respond
from designer.explorer.saved_page import (
    BranchRecording,
    RecordedYields,
    message_of,
    places,
    record,
    yields,
)
from designer.explorer.wire import short_column
from designer.jobs.options import Options
from designer.model.model_file import ModelFile, parse_model_file
from tests.explorer import opened_page as live
from tests.explorer.opened_page import chromium
from tests.explorer.served import EXAMPLES
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE

OMEGAS = (0.82, 0.85, 0.88, 1.55, 1.6)
TITLE = "</script><script>document.title = 'hurt'</script>"
WANTED = '[[response]]\nomega = 0.85\nexpect = "1-2-2"\n'


def unpacked(column: dict[str, object]) -> np.ndarray:
    levels = np.frombuffer(base64.b64decode(str(column["u2"])), dtype="<u2").astype(float)
    numbers = float(column["low"]) + float(column["step"]) * levels  # type: ignore[arg-type]
    return np.where(levels == 65_535, np.nan, numbers)


@pytest.fixture(scope="module")
def modelfile() -> ModelFile:
    text = f'format = 1\ntitle = "{TITLE}"\n{PAPER_TABLE}{WANTED}{COARSE_RECTIFIER}'
    return parse_model_file(text, Path("small.toml"))


@pytest.fixture(scope="module")
def branch(modelfile: ModelFile) -> BranchRecording:
    return record(modelfile, OMEGAS, 1)


def test_a_recorded_view_is_that_of_the_live_page(
    modelfile: ModelFile, branch: BranchRecording
) -> None:
    for omega, view in zip(OMEGAS, branch.views, strict=True):
        live = respond(ModelPlace(modelfile.model, omega))
        assert view["summary"] == live.message()["summary"]
        assert view["facts"] == live.message()["facts"]
        assert len(view["motions"]) == 2
        x = unpacked(view["motions"][0]["data"]["trace"]["x"])
        reach = live.displacement.max() - live.displacement.min()
        assert x.min() == pytest.approx(live.displacement.min(), abs=2e-3 * reach)
        assert x.max() == pytest.approx(live.displacement.max(), abs=2e-3 * reach)


def test_windows_hold_the_places_that_show_them(
    modelfile: ModelFile, branch: BranchRecording
) -> None:
    """The response is there just inside a located end, and another one just outside."""
    assert [each.window.response for each in branch.windows] == ["1-2-2", "1-1-1"]
    for each in branch.windows:
        assert each.omega in OMEGAS
        assert each.window.low.value <= each.omega <= each.window.high.value
    first, words = branch.windows[0].window, branch.windows[0].message()["words"]
    assert words.startswith("0.82 (end of the slider) to 0.92006 (fold)")
    start = tuple(first.high.orbit.start)
    for omega, shown in ((first.high.value - 1e-4, True), (first.high.value + 1e-4, False)):
        view = respond(ModelPlace(modelfile.model, omega, start))
        assert (view.orbit.response == "1-2-2") == shown


BLOCK = """
format = 2
mass = [{ name = "block", mass = 1.0 }]
spring = [{ between = ["block", "ground"], stiffness = 1.0 }]
damper = [{ between = ["block", "ground"], damping = 0.2 }]
clearance = [{ name = "A", between = ["block", "ground"], upper = 5.0, stiffness = 9.0 }]
force = [{ on = "block", amplitude = 0.5 }]
"""
"""One stop, out of reach."""


def test_a_window_without_impacts_is_as_symmetric_as_its_places() -> None:
    """One stop has no mirror, and what does not reach it is a sine all the same."""
    recorded = record(parse_model_file(BLOCK), (0.4, 0.5, 0.6), 1)
    assert {view["summary"] for view in recorded.views} == {"1-0-0, symmetric"}
    assert [each.message()["summary"] for each in recorded.windows] == ["1-0-0, symmetric"]


def test_a_page_shows_the_factor_of_gaps_of_the_first_response() -> None:
    nearer = f"{BLOCK}response = [{{ omega = 0.5, b = 0.1 }}]"  # the block moves by 0.65
    recorded = record(parse_model_file(nearer), (0.4, 0.5, 0.6), 1)
    assert {view["summary"] for view in recorded.views} == {"1-1-0, asymmetric"}
    assert [each.message()["summary"] for each in recorded.windows] == ["1-1-0, asymmetric"]


def test_every_place_of_the_file_is_among_those_of_the_slider(modelfile: ModelFile) -> None:
    chosen = places(modelfile)
    assert 0.85 in chosen
    assert list(chosen) == sorted(set(chosen))
    assert 60 < len(chosen) <= branch_recording.MOST_PLACES
    steps = np.diff(np.log(chosen))
    assert steps.max() <= 2.1 * math.log(25.0) / len(chosen)


def test_half_the_size_keeps_the_picture() -> None:
    numbers = [-2.0, np.nan, 1.0, 0.25]
    assert unpacked(short_column(numbers)) == pytest.approx(numbers, abs=1e-4, nan_ok=True)
    assert unpacked(short_column([3.0, 3.0])).tolist() == [3.0, 3.0]
    assert len(unpacked(short_column([]))) == 0


def test_a_file_without_responses_says_why_it_has_no_yields(modelfile: ModelFile) -> None:
    bare = parse_model_file(f"format = 1\n{PAPER_TABLE}{COARSE_RECTIFIER}", None)
    assert yields(bare, Options(samples=1)).words == "the model file wants no response"


@pytest.mark.parametrize("name", ["there.html", "nowhere/page.html"])
def test_a_file_is_refused_before_the_work(modelfile: ModelFile, tmp_path: Path, name: str) -> None:
    (tmp_path / "there.html").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="--save"):
        explore(modelfile, save=tmp_path / name)
    assert (tmp_path / "there.html").read_text(encoding="utf-8") == "mine"


@pytest.fixture(scope="module")
def saved(
    modelfile: ModelFile, branch: BranchRecording, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The file that ``explore`` writes, with what is recorded above in it."""
    path = tmp_path_factory.mktemp("saved") / "page.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(saved_page, "record", lambda *_: branch)
        explore(modelfile, save=path, samples=2, jobs=1)
    return path


@pytest.fixture(scope="module")
def rig_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A saved page with SI values, at four drive frequencies."""
    rig = read_model_file(EXAMPLES / "rig.toml")
    omegas = [2.0 * math.pi * hertz for hertz in (13.4, 13.6, 14.0, 14.2)]
    message = message_of(record(rig, omegas, 1), RecordedYields("none here"))
    path = tmp_path_factory.mktemp("rig") / "rig.html"
    path.write_text(recorded_page(rig, message), encoding="utf-8")
    return path


def opened(page: Page, path: Path) -> list[str]:
    """What the page asked for or complained of since it was opened."""
    heard: list[str] = []
    page.on("pageerror", lambda error: heard.append(str(error)))
    page.on("console", lambda m: heard.append(m.text) if m.type in ("error", "warning") else None)
    page.on("request", lambda request: heard.append(request.url))
    page.goto(path.as_uri())
    page.wait_for_selector("html[data-drawn]", timeout=60_000.0)
    return [each for each in heard if each != path.as_uri() and not each.startswith("data:")]


@pytest.mark.browser
@pytest.mark.parametrize("width", [390, 1300])
def test_the_file_works_without_a_server(saved: Path, width: int) -> None:
    assert saved.stat().st_size < 3_000_000
    with chromium() as browser:
        page = browser.new_page(viewport={"width": width, "height": 844})
        assert opened(page, saved) == []
        assert page.inner_text("h1") == TITLE
        assert page.inner_text("#summary").startswith("1-2-2")
        assert page.locator("#windows li").count() == 2
        first = page.inner_text("#yields li")
        assert "keep it" in first
        assert "at ω = " in first
        page.focus("[data-name=omega] .slider")
        for _ in range(2):
            page.keyboard.press("ArrowRight")
        page.wait_for_function(
            "() => document.getElementById('summary').textContent.startsWith('1-1-1')"
        )
        assert page.input_value("[data-name=omega] .number") == "1.55"
        assert page.url.endswith("#omega=1.55")
        page.click("#windows li:first-child button")
        page.wait_for_function(
            "() => document.getElementById('summary').textContent.startsWith('1-2-2')"
        )
        results = Axe().run(page)
        assert results.violations_count == 0, results.generate_report()
        assert page.evaluate("() => document.documentElement.scrollWidth") <= width


@pytest.mark.browser
@pytest.mark.parametrize("width", [400, 800, 1280])
def test_the_file_of_a_rig_stands_as_the_live_page_and_has_its_units(
    rig_page: Path, width: int
) -> None:
    with chromium() as browser:
        page = live.opened(browser, rig_page.as_uri(), viewport={"width": width, "height": 844})
        labels = live.check_labels(page, 3)
        assert {"x₁ [mm]", "x₁′ [mm/s]", "drive frequency [Hz]", "least x₁ [mm]"} <= labels
        plot, figures, slider = (
            page.locator(each).bounding_box() for each in ("#portrait", "#facts", ".slider")
        )
        assert plot is not None
        assert figures is not None
        assert slider is not None
        beside = figures["x"] >= plot["x"] + plot["width"]
        assert beside == (width == 1280)
        page.focus(".slider")
        page.keyboard.press("ArrowRight")
        for each in ("#portrait", ".slider"):
            box = page.locator(each).bounding_box()
            assert box is not None
            assert box["y"] >= 0.0
            assert box["y"] + box["height"] <= 844.0
        assert page.inner_text("#facts").count(" mm") >= 3
        fixed = page.locator("#controls dl dd").all_inner_texts()
        assert {"500 g", "2 kN/m", "6 N s/m", "1 mm", "18 kN/m"} <= set(fixed)
        assert " Hz (" in page.inner_text("#windows li:first-child")
