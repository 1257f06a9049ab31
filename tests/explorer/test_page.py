"""The page in a real browser: sliders, address, reload, reconnection, and who can use it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page

from designer import read_model_file
from tests.explorer.opened_page import WAIT, chromium, opened
from tests.explorer.served import EXAMPLES, served
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as each:
        yield each


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder, text = tmp_path_factory.mktemp("explore"), (EXAMPLES / "paper.toml").read_text("utf-8")
    model = tmp_path_factory.mktemp("model") / "paper.toml"
    model.write_text(text.partition("[circuit]")[0] + COARSE_RECTIFIER, encoding="utf-8")
    with served(model, folder, "--port", "0") as place:
        yield place
    assert list(folder.iterdir()) == []


def summary(page: Page, text: str) -> None:
    page.wait_for_function(
        "text => document.getElementById('summary').textContent.startsWith(text)", arg=text
    )


def query(page: Page) -> dict[str, list[str]]:
    return parse_qs(urlsplit(page.url).query)


def kept(page: Page, text: str) -> None:
    page.wait_for_function(
        "text => document.getElementById('kept').textContent.startsWith(text)", arg=text
    )


def drawn(page: Page, source: str, column: str) -> int:
    """How many points of a column the plots have."""
    return int(
        page.evaluate(
            """([source, column]) => Math.max(...Bokeh.documents.map((d) =>
              d.get_model_by_name(source)?.data[column].length ?? 0))""",
            [source, column],
        )
    )


def test_a_slider_moves_the_picture_and_the_address_keeps_it(
    browser: Browser, address: str
) -> None:
    page = opened(browser, address)
    summary(page, "1-1-1, symmetric")
    page.fill("[data-name=omega] .number", "0.85")
    page.press("[data-name=omega] .number", "Enter")
    summary(page, "1-2-2")
    assert drawn(page, "trace", "x") > 500
    page.wait_for_function(
        "() => Bokeh.documents.some((d) => d.get_model_by_name('strip')?.data.x.length > 1000)"
    )
    page.focus("[data-name=zeta] .slider")
    page.keyboard.press("ArrowRight")
    page.wait_for_function("() => new URLSearchParams(location.search).has('zeta')")
    zeta = query(page)["zeta"]
    assert query(page)["omega"] == ["0.85"]
    assert 0.1 < float(zeta[0]) < 0.101
    page.reload()
    summary(page, "1-2-2")
    assert float(page.input_value("[data-name=zeta] .number")) == float(zeta[0])
    page.click("#reset")
    summary(page, "1-1-1")
    page.wait_for_function("() => location.search === ''")
    page.close()


def test_what_is_typed_wrong_is_named_and_the_picture_stays(browser: Browser, address: str) -> None:
    page = opened(browser, address)
    page.fill("[data-name=k0] .number", "<b>1.5")
    page.press("[data-name=k0] .number", "Enter")
    page.wait_for_selector("#notice:not([hidden])")
    assert "k0" in page.inner_text("#notice")
    assert page.get_attribute("[data-name=k0] .number", "aria-invalid") == "true"
    summary(page, "1-1-1")
    page.fill("[data-name=k0] .number", "0.9")
    page.press("[data-name=k0] .number", "Enter")
    page.wait_for_selector("#notice", state="hidden")
    page.close()


def test_the_motion_is_followed_into_hysteresis(browser: Browser, address: str) -> None:
    """At ω = 0.62 from rest there is chaos; a start that is in the address is kept by a reload."""
    page = opened(browser, address)
    page.check("#follow")
    page.wait_for_function("() => new URLSearchParams(location.search).has('start')")
    start = query(page)["start"]
    page.reload()
    summary(page, "1-1-1")
    kept = [float(x) for x in query(page)["start"][0].split(",")]
    assert kept == pytest.approx([float(x) for x in start[0].split(",")], abs=1e-9)
    page.close()


def test_two_tabs_do_not_disturb_each_other(browser: Browser, address: str) -> None:
    one, two = opened(browser, address), opened(browser, f"{address}?omega=0.85")
    summary(two, "1-2-2")
    one.fill("[data-name=omega] .number", "0.54")
    one.press("[data-name=omega] .number", "Enter")
    summary(one, "1-3-3")
    summary(two, "1-2-2")
    one.close()
    two.close()


def test_a_click_on_the_diagram_goes_there(browser: Browser, address: str) -> None:
    page = opened(browser, address)
    page.locator("#strip").click(position={"x": 250.0, "y": 80.0})
    page.wait_for_function("() => new URLSearchParams(location.search).has('omega')")
    assert 1.3 < float(query(page)["omega"][0]) < 1.5
    page.close()


def test_the_page_goes_on_when_the_server_is_there_again(browser: Browser, tmp_path: Path) -> None:
    model = EXAMPLES / "paper.toml"
    with served(model, tmp_path, "--port", "0") as address:
        page = opened(browser, f"{address}?omega=0.85")
        summary(page, "1-2-2")
        port = str(urlsplit(address).port)
    page.wait_for_selector("html[data-line=closed]")
    assert "does not answer" in page.inner_text("#notice")
    page.fill("[data-name=omega] .number", "1.55")
    page.press("[data-name=omega] .number", "Enter")
    with served(model, tmp_path, "--port", port):
        summary(page, "1-1-1")
        page.wait_for_selector("#notice", state="hidden")
        page.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1300])
def test_everybody_can_use_it(browser: Browser, address: str, scheme: str, width: int) -> None:
    """No rule of accessibility is broken, nothing is wider than the page, plots follow the dark."""
    size = {"width": width, "height": 844}
    page = opened(browser, address, viewport=size, color_scheme=scheme)
    results = Axe().run(page)
    assert results.violations_count == 0, results.generate_report()
    assert page.evaluate("() => document.documentElement.scrollWidth") <= width
    ink = page.evaluate(
        """() => { for (const m of Bokeh.documents[0]._all_models.values())
             if (m.type === 'LinearAxis') return m.axis_label_text_color; }"""
    )
    assert (ink == "#1a1a1a") == (scheme == "light")
    page.close()


def test_a_model_in_hertz_and_millimetres_is_moved_in_them(
    browser: Browser, tmp_path: Path
) -> None:
    with served(EXAMPLES / "hammer-base.toml", tmp_path, "--port", "0") as address:
        page = opened(browser, address)
        fields = {"omega": "12", "anvil\\.lower": "3", "hammer\\.mass": "2"}
        for name, text in fields.items():
            assert float(page.input_value(f"[data-name={name}] .number")) == float(text)
        page.fill("[data-name=omega] .number", "13")
        page.press("[data-name=omega] .number", "Enter")
        page.wait_for_function("() => new URLSearchParams(location.search).has('omega')")
        assert float(query(page)["omega"][0]) == 26.0 * math.pi
        assert page.input_value("[data-name=omega] .number") == "13"
        assert "mm" in page.inner_text("#facts")
        page.wait_for_function("() => !document.getElementById('pin').disabled")
        page.click("#pin")
        assert " at 13 Hz, " in page.inner_text("#pins li")
        page.fill("#name", "mine")
        page.click("[data-keep=save]")
        kept(page, "mine.toml is saved.")
        page.close()
    assert 'frequency = "13 Hz"' in (tmp_path / "mine.toml").read_text("utf-8")


def test_a_pinned_response_is_saved_and_never_over_another_file(
    browser: Browser, tmp_path: Path
) -> None:
    with served(EXAMPLES / "paper.toml", tmp_path, "--port", "0") as address:
        page = opened(browser, f"{address}?omega=0.85&zeta=0.101")
        summary(page, "1-2-2")
        page.click("#pin")
        assert query(page)["pin"] == ["0.85~1-2-2~0.25"]
        page.reload()
        summary(page, "1-2-2")
        assert page.locator("#pins li").count() == 1
        page.fill("#name", "mine")
        page.click("[data-keep=save]")
        kept(page, "mine.toml is saved.")
        saved = read_model_file(tmp_path / "mine.toml")
        assert [(r.omega, str(r.expect)) for r in saved.responses] == [(0.85, "1-2-2")]
        assert saved.model.parameter("zeta") == 0.101
        page.click("#pins button")
        page.click("[data-keep=save]")
        kept(page, "mine.toml is there already")
        page.click("#leave")
        assert read_model_file(tmp_path / "mine.toml") == saved
        page.click("[data-keep=save]")
        page.click("#overwrite")
        kept(page, "mine.toml is saved.")
        assert len(read_model_file(tmp_path / "mine.toml").responses) > 1
        page.fill("#name", "../mine")
        page.click("[data-keep=save]")
        kept(page, "name: found")
        page.close()
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


@pytest.mark.slow
def test_the_whole_job_is_run_and_its_report_opened(browser: Browser, tmp_path: Path) -> None:
    model = tmp_path / "small.toml"
    wanted = '[[response]]\nomega = 0.85\nexpect = "1-2-2"\n'
    model.write_text(f"format = 1\n{PAPER_TABLE}{wanted}{COARSE_RECTIFIER}", encoding="utf-8")
    with served(model, tmp_path, "--port", "0") as address:
        page = opened(browser, address)
        page.click("[data-keep=run]")
        page.wait_for_selector("#jobs li[data-status='0']", timeout=10.0 * WAIT)
        with page.expect_popup() as popup:
            page.click("#jobs a")
        popup.value.wait_for_load_state()
        assert "1-2-2" in popup.value.inner_text("body")
        popup.value.close()
        page.close()
    assert (tmp_path / "small-explored-run" / "report.html").is_file()


def test_other_attractors_are_listed_and_one_can_be_shown(browser: Browser, address: str) -> None:
    page = opened(browser, f"{address}?omega=0.9")
    page.wait_for_function("() => document.getElementById('tried').textContent.startsWith('16 of')")
    assert page.locator("#others li").count() >= 1
    assert page.inner_text("#summary") in page.inner_text("#others li:first-child")
    page.close()


def test_a_map_is_shown_and_a_point_of_it_gone_to(browser: Browser, address: str) -> None:
    """By a click and by the keyboard; what is wrong is named in the page, also from an address."""
    narrow = "?omega=1.55&map=omega~1.5~1.6~b~0.24~0.26"
    page = opened(browser, f"{address}{narrow}")
    page.wait_for_function("() => document.getElementById('map-done').textContent.includes(' of ')")
    page.wait_for_function("() => document.querySelectorAll('#map-legend li').length > 0")
    assert "1-1-1" in page.inner_text("#map-legend")
    assert drawn(page, "cells", "left") > 10
    assert page.input_value("#map-x-low") == "1.5"
    page.focus("#map")
    page.keyboard.press("Shift+ArrowRight")
    assert page.inner_text("#map-at").endswith("1-1-1")
    page.keyboard.press("Enter")
    page.wait_for_function("() => new URLSearchParams(location.search).get('omega') === '1.5625'")
    box = page.locator("#map").bounding_box()
    assert box is not None
    page.locator("#map").click(position={"x": 0.3 * box["width"], "y": 0.3 * box["height"]})
    page.wait_for_function("() => Number(new URLSearchParams(location.search).get('b')) > 0.25")
    assert 1.5 < float(query(page)["omega"][0]) < 1.55
    assert float(page.input_value("[data-name=b] .number")) == float(query(page)["b"][0])
    assert query(page)["map"] == ["omega~1.5~1.6~b~0.24~0.26"]
    page.wait_for_function(
        "() => document.getElementById('map-borders').textContent.includes('1-1-1, symmetric')",
        timeout=5.0 * WAIT,
    )
    page.fill("#map-x-high", "1.2")
    page.press("#map-x-high", "Enter")
    page.wait_for_selector("#map-notice:not([hidden])")
    assert "map.x" in page.inner_text("#map-notice")
    page.click("#map-away")
    page.wait_for_function("() => !new URLSearchParams(location.search).has('map')")
    page.goto(f"{address}?map=omega~1~2~nothing~1~2")
    page.wait_for_selector("#map-notice:not([hidden])")
    assert "nothing" in page.inner_text("#map-notice")
    summary(page, "1-1-1")
    page.close()


def test_real_parts_are_chosen_for_the_response(browser: Browser, address: str) -> None:
    page = opened(browser, f"{address}?omega=0.85")
    summary(page, "1-2-2")
    page.click("#choose")
    page.wait_for_function(
        "() => document.getElementById('boards').textContent.includes('of 200 boards')",
        timeout=5.0 * WAIT,
    )
    assert "R1" in page.inner_text("#board dl")
    page.fill("[data-name=zeta] .number", "0.11")
    page.press("[data-name=zeta] .number", "Enter")
    summary(page, "1-2-2")
    page.close()
