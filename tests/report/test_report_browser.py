"""The report in a real browser: without a complaint, for keyboard, phone, dark and paper."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, sync_playwright

from designer.base.page import Page as ReportPage, PageSection, table
from designer.report.page_html import render_page
from designer.report.write import render_html
from designer.verdicts.verdict import Verdict
from tests.shared.report_data import changed, plain_report

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


def test_plots_are_drawn_with_the_orbits_own_values(report: Loaded) -> None:
    page, data = report.page, plain_report()
    for name in ("portrait 0 0", "portrait 1 0", "stop 0", "yields"):
        figure = page.locator(f'[data-plot="{name}"]')
        figure.scroll_into_view_if_needed()
        page.locator(f'[data-plot="{name}"].drawn canvas').first.wait_for()
        assert figure.locator(":scope > .live").get_attribute("aria-label")
        assert not figure.locator("svg[role=img]").first.is_visible()
    largest = [float(c.model.orbit.extremes[0].max()) for c in data.checked]
    assert sorted({round(x, 4) for x in page.evaluate(CURVES)}) == pytest.approx(
        sorted(largest), rel=1e-3
    )


def test_a_board_is_called_up_by_the_keyboard(report: Loaded) -> None:
    page, data = report.page, plain_report()
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
    found = Axe().run(report.page).response["violations"]
    assert [(v["id"], v["nodes"][0]["html"]) for v in found] == []


def test_the_page_is_as_wide_as_a_phone(report: Loaded) -> None:
    report.page.set_viewport_size({"width": 390, "height": 800})
    assert report.page.evaluate("document.documentElement.scrollWidth") == 390
    report.page.set_viewport_size({"width": 1200, "height": 900})
