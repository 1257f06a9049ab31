"""The report in a real browser: without a complaint, for keyboard, phone, dark and paper."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Locator, Page, sync_playwright

from designer.base.page import Page as ReportPage, PageSection, table
from designer.report.page_html import render_page
from designer.report.write import render_html
from designer.verdicts.verdict import Verdict
from tests.shared.report_data import changed, paper_report, plain_report

pytestmark = pytest.mark.browser
HOSTILE = "</script><script>document.body.dataset.bad = 1</script><img src=x onerror=alert(1)>"


@dataclass
class Loaded:
    """A page, and what it complained of."""

    page: Page
    """The page in the browser."""
    complaints: list[str] = field(default_factory=list)
    """Errors and warnings of the console, and requests that leave the page."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox"]
        )
        yield started
        started.close()


def loaded(browser: Browser, html: str, file: Path) -> Loaded:
    file.write_text(html, encoding="utf-8")
    page = browser.new_page(viewport={"width": 1200, "height": 900}, color_scheme="light")
    out = Loaded(page)
    page.on(
        "console",
        lambda message: (
            out.complaints.append(message.text) if message.type in ("error", "warning") else None
        ),
    )
    page.on("pageerror", lambda error: out.complaints.append(str(error)))
    page.on(
        "request",
        lambda request: (
            out.complaints.append(request.url) if request.url.startswith(("http", "ws")) else None
        ),
    )
    page.goto(file.as_uri())
    return out


@pytest.fixture(scope="module")
def report(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Loaded:
    """A small report whose title is hostile, and whose board 1 lost the first response."""
    data = plain_report()
    lost: dict[str, Any] = {"verdict": Verdict.LOST, "response": "aperiodic", "reason": "aperiodic"}
    answers = tuple(
        replace(a, **lost) if (a.sample, a.question) == (1, 0) else a for a in data.study.answers
    )
    data = changed(data, answers=answers)
    data = changed(data, modelfile=replace(data.result.modelfile, title=HOSTILE))
    return loaded(browser, render_html(data), tmp_path_factory.mktemp("report") / "report.html")


@pytest.fixture(scope="module")
def tables(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Loaded:
    """A page of two tables, one of which folds."""
    parts = [("R1", "10 kΩ"), ("R2", "4.7 kΩ"), ("C1", "1.2 nF"), ("R10", "137 kΩ"),
             ("C2", "15 nF"), ("R3", "1 MΩ"), ('R"4', "5 Ω, 1 %")]  # fmt: skip
    alike = [(f"board {k}", "ok") for k in range(7)]
    sections = [
        PageSection("To buy", [table(("part", "value"), parts)], "buy"),
        PageSection("Boards", [table(("board", "A"), alike, names=1)], "boards"),
    ]
    html = render_page(ReportPage("Tables", ["Two."], sections))
    return loaded(browser, html, tmp_path_factory.mktemp("tables") / "page.html")


@pytest.fixture(scope="module")
def nine(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Loaded:
    """The paper's nine responses, in a folder, with something that is not good enough."""
    warned = (
        "The file states the saturation stage, and the other one keeps the responses more often."
    )
    data = replace(paper_report(), folder="paper", warnings=(warned,))
    return loaded(browser, render_html(data), tmp_path_factory.mktemp("nine") / "report.html")


def unfolded(page: Page) -> None:
    """Open every question, as a reader does one after the other.

    By the keyboard: a click is lost where a plot that is drawn above moves the page between its
    two halves.
    """
    for question in page.locator(".question").all():
        if question.get_attribute("open") is None:
            question.locator(":scope > summary").press("Enter")
        assert question.get_attribute("open") is not None


TALL = "document.documentElement.scrollHeight"


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (400, 850)])
def test_the_page_is_short_until_a_question_is_opened(
    nine: Loaded, width: int, height: int
) -> None:
    page = nine.page
    page.set_viewport_size({"width": width, "height": height})
    assert page.locator(".question[open]").count() == 0
    assert page.evaluate(TALL) < 6000
    assert page.evaluate("document.documentElement.scrollWidth") == width


def test_the_first_screen_has_the_answers(nine: Loaded) -> None:
    """On a screen of 1280 by 900 nothing of them has to be scrolled to."""
    page = nine.page
    page.set_viewport_size({"width": 1280, "height": 900})
    page.evaluate("scrollTo(0, 0)")
    box = page.locator("#answers").bounding_box()
    assert box is not None
    assert box["y"] + box["height"] <= 900
    bars = page.locator(".bars li")
    assert bars.count() == len(paper_report().checked) + 1
    for k in range(bars.count() - 1):
        assert bars.nth(k).locator("svg").is_visible()
    full, fill = (page.locator(one).first.bounding_box() for one in (".bar", ".bar i"))
    assert full is not None
    rate = paper_report().yields[0]
    assert fill is not None
    assert rate is not None
    assert fill["width"] == pytest.approx(rate.rate * full["width"], abs=1.0)
    for command in page.locator(".remedies pre").all_inner_texts():
        assert " paper" in command
        assert "DIR" not in command


def test_portraits_of_few_responses_are_larger_and_leave_the_answers_in_sight(
    report: Loaded, nine: Loaded
) -> None:
    for width, height, larger in ((1280, 900, 1.5), (400, 850, 1.4)):
        for each in (report, nine):
            each.page.set_viewport_size({"width": width, "height": height})
        few, many = (each.page.locator(".bars svg").first.bounding_box() for each in (report, nine))
        assert few is not None
        assert many is not None
        assert few["width"] > larger * many["width"]
        assert report.page.evaluate("document.documentElement.scrollWidth") == width
    report.page.set_viewport_size({"width": 1280, "height": 900})
    report.page.evaluate("scrollTo(0, 0)")
    box = report.page.locator("#answers").bounding_box()
    assert box is not None
    assert box["y"] + box["height"] <= 900
    for item in report.page.locator(".bars li:has(svg)").all():
        portrait, name, share = (
            item.locator(one).bounding_box() for one in ("svg", ".of", "strong")
        )
        assert portrait is not None
        for words in (name, share):  # beside the portrait, and not below its end
            assert words is not None
            assert words["x"] >= portrait["x"] + portrait["width"]
            assert words["y"] + words["height"] <= portrait["y"] + portrait["height"]
    report.page.set_viewport_size({"width": 1200, "height": 900})


def test_a_link_opens_what_it_leads_to(nine: Loaded) -> None:
    page = nine.page
    page.set_viewport_size({"width": 1280, "height": 900})
    scales = page.locator("#scales h3")
    assert not scales.is_visible()
    page.get_by_role("link", name="Scales", exact=True).click()
    scales.wait_for()
    page.locator("#choice > details > summary").click()
    assert not scales.is_visible()
    page.get_by_role("link", name="Scales", exact=True).click()  # the same hash once more
    scales.wait_for()
    page.goto(page.url.partition("#")[0] + "#made")
    page.locator("#provenance h3").wait_for()
    page.goto(page.url.partition("#")[0])


LETTERS = """
Math.min(...[...document.querySelectorAll("#schematic svg text")].map((text) =>
  parseFloat(text.getAttribute("font-size")) * text.ownerSVGElement.getScreenCTM().a))
"""


@pytest.mark.parametrize("width", [1280, 400])
def test_the_schematic_can_be_read_at_its_own_size(nine: Loaded, width: int) -> None:
    page = nine.page
    page.set_viewport_size({"width": width, "height": 900})
    page.goto(page.url.partition("#")[0] + "#schematic")
    page.locator("#schematic svg").wait_for()
    assert page.evaluate(LETTERS) >= 9.0
    assert page.evaluate("document.documentElement.scrollWidth") == width
    box = page.locator("#schematic .scroll").bounding_box()
    assert box is not None
    assert box["height"] <= 900


def test_no_room_is_left_above_a_portrait(nine: Loaded) -> None:
    """Neither while its plot is drawn nor after."""
    page = nine.page
    page.set_viewport_size({"width": 1280, "height": 900})
    page.goto(page.url.partition("#")[0] + "#portraits")
    page.evaluate("""
      const empty = document.createElement("div");
      empty.className = "live";
      document.querySelector("#portraits .cards figure:last-child").prepend(empty);
    """)
    figures = page.locator("#portraits .cards figure")
    assert _above(figures.last, "svg") < 4
    page.locator('[data-plot="portrait 0 0"].drawn canvas').first.wait_for()
    assert _above(figures.first, "canvas") < 4


def _above(figure: Locator, drawn: str) -> float:
    """Pixels between the top of a card and what is drawn in it."""
    outer, inner = figure.bounding_box(), figure.locator(drawn).first.bounding_box()
    assert outer is not None
    assert inner is not None
    return inner["y"] - outer["y"]


def column(page: Page, number: int) -> list[str]:
    cells = page.locator(f"#buy tbody tr:visible td:nth-child({number + 1})")
    return cells.all_inner_texts()


def test_tables_sort_by_the_keyboard(tables: Loaded) -> None:
    page = tables.page
    before = column(page, 1)
    button = page.locator("#buy th button").nth(1)
    button.focus()
    head = page.locator("#buy th").nth(1)
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "ascending"
    rising = ["1.2 nF", "15 nF", "5 Ω, 1 %", "4.7 kΩ", "10 kΩ", "137 kΩ", "1 MΩ"]
    assert column(page, 1) == rising
    page.keyboard.press("Enter")
    assert column(page, 1) == rising[::-1]
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") is None
    assert column(page, 1) == before


def test_tables_filter_and_copy_what_is_shown(tables: Loaded) -> None:
    page = tables.page
    search = page.get_by_label("Filter the rows of: To buy")
    search.fill("r k")
    assert {*column(page, 0)} == {"R1", "R2", "R10"}
    assert page.locator("#buy [role=status]").inner_text() == "3 of 7 rows"
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    search.fill('r"')
    page.get_by_label("Copy as CSV: To buy").click()
    page.get_by_text("Copied.").wait_for()
    text = page.evaluate("navigator.clipboard.readText()")
    assert text == 'part,value\n"R""4","5 Ω, 1 %"\n'
    search.fill("")
    assert len(column(page, 0)) == 7


def test_what_folds_opens(tables: Loaded) -> None:
    page = tables.page
    summary = page.get_by_text("All 7 agree: ok.")
    assert page.locator("#boards tbody tr:visible").count() == 0
    summary.focus()
    page.keyboard.press("Enter")
    assert page.locator("#boards tbody tr:visible").count() == 7


CURVES = """
Bokeh.documents.flatMap((d) => d.roots()).flatMap((root) => [...root.references()])
  .filter((model) => model.type === "GlyphRenderer" && model.name === "model")
  .map((model) => Math.max(...model.data_source.data.x))
"""


SEEN_AND_DRAWN = """(name) => {
  const figure = document.querySelector(`[data-plot="${name}"]`);
  figure.scrollIntoView();  // at each look: a plot drawn above moves this one away
  return figure.matches(".drawn");
}
"""


def test_plots_are_drawn_with_the_orbits_own_values(report: Loaded) -> None:
    page, data = report.page, plain_report()
    unfolded(page)
    for name in ("portrait 0 0", "portrait 1 0", "stop 0", "yields"):
        figure = page.locator(f'[data-plot="{name}"]')
        page.wait_for_function(SEEN_AND_DRAWN, arg=name)
        page.locator(f'[data-plot="{name}"].drawn canvas').first.wait_for()
        assert figure.locator(":scope > .live").get_attribute("aria-label")
        assert not figure.locator("svg[role=img]").first.is_visible()
    largest = [float(c.model.orbit.extremes[0].max()) for c in data.checked]
    assert sorted({round(x, 4) for x in page.evaluate(CURVES)}) == pytest.approx(
        sorted(largest), rel=1e-3
    )


def test_a_board_is_called_up_by_the_keyboard(report: Loaded) -> None:
    page, data = report.page, plain_report()
    unfolded(page)
    page.locator("#boards").scroll_into_view_if_needed()
    page.locator("#boards canvas").first.wait_for()
    page.get_by_label("Response", exact=True).select_option("1")
    number = page.get_by_label("Number of the board")
    number.fill("2")
    number.press("Enter")
    (answer,) = (a for a in data.study.answers_to(1) if a.sample == 2)
    page.get_by_text(f"Board 2, ω = 0.85 (1-2-2): {answer.verdict}").wait_for()
    row = page.locator("#boards table").first.locator("tbody tr").nth(1)
    assert row.locator("td").nth(2).inner_text() == answer.response
    assert row.locator("td").nth(4).inner_text() == f"{answer.radius:.4g}"
    page.get_by_text("the farthest from nominal first").press("Enter")
    parts = page.locator("#boards table").nth(1)
    drawn = data.plan.boards(range(3)).board(2).values["R50"]
    cell = parts.locator("tr", has_text="R50").locator("td").nth(1)
    assert float(cell.inner_text().split()[0]) == pytest.approx(drawn / 1e3, rel=1e-3)
    page.wait_for_function(BOARD)


def test_a_board_without_a_period_is_told_of_once(report: Loaded) -> None:
    page = report.page
    unfolded(page)
    page.locator("#boards").scroll_into_view_if_needed()
    page.locator("#boards canvas").first.wait_for()
    page.get_by_label("Response", exact=True).select_option("0")
    number = page.get_by_label("Number of the board")
    number.fill("1")
    number.press("Enter")
    page.get_by_text("It shows no n-p-q: aperiodic.", exact=True).wait_for()
    row = page.locator("#boards table").first.locator("tbody tr").first
    assert row.locator("td").all_inner_texts()[1:4] == ["lost", "aperiodic", "–"]


BOARD = """() => Bokeh.documents.flatMap((d) => d.roots()).flatMap((root) => [...root.references()])
  .some((model) => model.name === "board" && model.data.v?.length > 200)"""


def test_paper_has_the_pictures(report: Loaded, tmp_path: Path) -> None:
    for question in report.page.locator(".question").all():  # paper has what is folded too
        question.evaluate("(details) => details.open = false")
    report.page.emulate_media(media="print")
    pictures = report.page.locator("svg[role=img]")
    assert pictures.count() > 5
    assert all(pictures.nth(k).is_visible() for k in range(pictures.count()))
    assert not report.page.locator(".live").first.is_visible()
    report.page.emulate_media(media="screen")
    assert len(report.page.pdf()) > 50_000


def test_nothing_is_complained_of(report: Loaded, tables: Loaded) -> None:
    assert report.complaints == tables.complaints == []
    assert report.page.evaluate("document.body.dataset.bad") is None
    assert report.page.title() == HOSTILE


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_rules_of_accessibility_hold(report: Loaded, scheme: str) -> None:
    report.page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
    unfolded(report.page)
    found = Axe().run(report.page).response["violations"]
    assert [(v["id"], v["nodes"][0]["html"]) for v in found] == []


def test_the_page_is_as_wide_as_a_phone(report: Loaded) -> None:
    unfolded(report.page)
    report.page.set_viewport_size({"width": 390, "height": 800})
    assert report.page.evaluate("document.documentElement.scrollWidth") == 390
    report.page.set_viewport_size({"width": 1200, "height": 900})
