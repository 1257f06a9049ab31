"""The report: complete, inert, self-contained, the same twice, and plain about what is missing."""

from __future__ import annotations

import re
import zlib
from base64 import b64decode, b64encode
from dataclasses import replace
from hashlib import sha256
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from designer.base import figure_style
from designer.base.errors import InputError
from designer.base.page import PageSection, Table
from designer.board.kicad_reader import read_board
from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.check import checked_design
from designer.check.synthesis_result import synthesise
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.design import Certificate, Design
from designer.dynamics.counts import Counts
from designer.dynamics.orbit import Orbit, OrbitStatus, failed
from designer.folders.origin import provenance
from designer.model.ascii_sketch import sketch
from designer.model.clearance import Sides
from designer.model.model_file import parse_model_file, read_model_file
from designer.report import design_tables, words
from designer.report.data import ReportData
from designer.report.inline_svg import legible_width
from designer.report.inserted import inserted_html, inserted_markdown
from designer.report.response_tables import ngspice_table
from designer.report.write import render_html, render_markdown, write_report
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed
from designer.verdicts.cross_check import CrossCheck, StartKind, ask_random
from designer.verdicts.ngspice_runs import cross_checks
from designer.verdicts.verdict import Verdict
from designer.yields.layers import samples_task
from designer.yields.study import RunResult, Study
from designer.yields.study_plan import plan_study
from tests.shared.blank_figures import blank_figures
from tests.shared.exact_circuits import Scale, exact_circuit
from tests.shared.exploring import quick
from tests.shared.kicad_cases import case_files
from tests.shared.mechanism_file import HAMMER
from tests.shared.model_text import dimensionless
from tests.shared.paper_cases import PAPER as EXAMPLE, synthesised
from tests.shared.report_data import NO_ORIGIN, changed, plain_report

HOSTILE = "<script>alert(1)</script> {{7*7}} {% raw %} \"q\" 'a' | `x` <img src=x onerror=y> & ]]>"
VOID = {"meta", "img", "link", "br", "hr", "input"}


@pytest.fixture(scope="session")
def catalog() -> Catalog:
    return load_catalog()


@pytest.fixture(scope="session")
def whole(catalog: Catalog) -> ReportData:
    """A small run in which everything works: 1-1-1, its asymmetric kind, 1-2-2."""
    made = synthesised()
    modelfile = replace(made.modelfile, responses=made.modelfile.responses[:3])
    found, design = made.model_responses[:3], made.design
    with SpicePool(2) as pool:
        checked = checked_design.check(design, found, pool)
        plan = plan_study(modelfile, design, checked, catalog, samples=4, seed=1)
        answers = samples_task(plan, range(4))(2, lambda: None)
        heard = cross_checks(plan, ask_random(answers), pool, 2)
    study = Study(checked, plan, (0, 1, 2), {}, tuple(answers), cross_checks=tuple(heard))
    source = provenance(modelfile, catalog.hash, seed=1, spread=plan.spread.as_dict())
    result = RunResult(modelfile, catalog, found, design, checked, study, source)
    return ReportData(result, "designer run model.toml --samples 4 --seed 1 --out out")


@pytest.fixture(scope="session")
def html(whole: ReportData) -> str:
    return render_html(whole)


@pytest.mark.slow
def test_a_study_that_went_on_takes_the_design_s_pictures_over(
    whole: ReportData, html: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page is that of the whole study made at once; only its own pictures are drawn again."""
    begun = replace(whole.study, answers=whole.study.answers[:3], cross_checks=())
    first = ReportData(replace(whole.result, study=begun), whole.command)
    drawn: list[Figure] = []

    def counted(figure: Figure) -> str:
        drawn.append(figure)
        return figure_style.to_svg(figure)

    monkeypatch.setattr("designer.report.pictures.to_svg", counted)
    assert render_html(first) != html
    at_first = len(drawn)
    assert render_html(first.of_study(whole.result)) == html
    assert len(drawn) - at_first == 2  # yields and margins
    other = replace(whole.result, checked=tuple(replace(c) for c in whole.checked))
    assert render_html(first.of_study(other)) == html
    assert len(drawn) - at_first > at_first


def without_pictures(data: ReportData) -> str:
    """The page of these data for who asks nothing of its pictures."""
    with blank_figures():
        return render_html(data)


def words_of(data: ReportData) -> Page:
    """The same, read."""
    return Page(without_pictures(data))


class Page(HTMLParser):
    """Tags, attributes and text of a page; fails on tags that do not balance."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.classes: list[str] = []
        self.breakable: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
            self.classes.append(dict(attrs).get("class") or "")

    def handle_endtag(self, tag: str) -> None:
        assert self.open, tag
        assert self.open.pop() == tag
        self.classes.pop()

    def handle_data(self, data: str) -> None:
        if not {"style", "script"} & set(self.open):
            self.text += data
        if (
            not {"style", "script", "title", "h1", "pre"} & set(self.open)
            and "whole" not in self.classes
        ):
            self.breakable += re.findall(r"(?<![\w-])(?:\d+-\d+-\d+|n-p-q)(?![\w-])", data)

    def named(self, tag: str) -> list[dict[str, str | None]]:
        return [attrs for name, attrs in self.tags if name == tag]

    def pictures(self) -> list[str]:
        """What each picture says that it shows."""
        svgs = self.named("svg")
        assert all(attrs["role"] == "img" for attrs in svgs)
        return [str(attrs["aria-label"]) for attrs in svgs]


def _broken(data: ReportData) -> ReportData:
    """ngspice fails for the first, the second is not found, the third is lost in the circuit."""
    first, second, third = data.checked
    assert first.gate is not None
    read = SimulationFailed("timestep too small <at> 1 ms")
    first = replace(first, gate=replace(first.gate, read=read, passed=False))
    spec = replace(second.model.spec, expect=Counts(3, ((4, 5),)))
    second = replace(second, model=replace(second.model, spec=spec, found=False))
    third = replace(third, circuit=Orbit(OrbitStatus.APERIODIC, start=third.circuit.start))
    plan = replace(data.plan, questions=data.plan.questions[:1])
    left_out = {1: "the model does not show it", 2: "the nominal circuit is aperiodic"}
    answers = tuple(a for a in data.study.answers if a.question == 0)
    study = Study((first, second, third), plan, (0,), left_out, answers)
    return changed(data, checked=study.checked, study=study)


def test_page_is_balanced_and_loads_nothing(html: str) -> None:
    page = Page(html)
    read = re.sub(r'<script type="text/plain".*?</script>', "", html)
    assert not re.search(r"https?:|//\w|@import|url\((?!#)", read)
    foreign = {"link", "iframe", "object", "base", "img", "foreignobject"}
    assert {tag for tag, _ in page.tags}.isdisjoint(foreign)
    for tag, attrs in page.tags:
        assert not any(name.startswith("on") for name in attrs), tag
        assert (attrs.get("href") or "#").startswith("#")
        assert {"src", "srcset", "xlink:href"}.isdisjoint(attrs)
    policy = {m.get("http-equiv"): m.get("content") for m in page.named("meta")}
    rules = str(policy["Content-Security-Policy"])
    assert rules.startswith("default-src 'none'; img-src data:;")
    allowed = re.findall(r"'sha256-([^']+)'", rules)
    assert allowed == [
        b64encode(sha256(script.encode()).digest()).decode()
        for script in [*re.findall(r"<script>(.*?)</script>", html, re.DOTALL), library(html)]
    ]
    assert "unsafe" not in rules.replace("style-src 'unsafe-inline'", "")


def library(html: str) -> str:
    """The plotting library that a page carries."""
    packed = re.search(r'<script type="text/plain" id="bokeh">(.*?)</script>', html)
    assert packed is not None
    return zlib.decompress(b64decode(packed[1])).decode()


def test_links_lead_to_sections_and_ids_are_unique(html: str) -> None:
    page = Page(html)
    ids = [attrs["id"] for tag, attrs in page.tags if "id" in attrs and tag != "script"]
    assert len(ids) == len(set(ids))
    linked = {str(a["href"])[1:] for a in page.named("a")}
    questions = set(re.findall(r'<section id="(\w+)">\n<details class="question">', html))
    assert questions >= {"engines", "working", "choice", "build", "made"}
    assert linked | questions == {a["id"] for a in page.named("section")}  # a part has an entry
    assert questions - linked == {"engines", "working", "choice", "build", "made"}
    used = {str(a["href"])[1:] for _, a in page.tags if "href" in a} | questions
    used |= set(re.findall(r"url\(#([^)]+)\)", html))
    assert used == set(ids)  # of each picture its own, and none that nothing needs
    assert '<a href="#dc">DC curve</a>\n<a href="#roles">Roles</a>' in html


def test_what_is_below_the_first_screen_is_folded_by_question(html: str) -> None:
    """Before it stand the answers; each question says in a line what it comes to."""
    body = html[html.index("<main>") :]
    first, rest = body[: body.index("<nav ")], body[body.index("</nav>") :]
    assert re.findall(r'<section id="(\w+)"', first) == ["answers"]
    assert "<table" not in first
    assert '<details class="question" open' not in rest
    depth, unfolded = 0, 0
    for tag in re.findall(r"<details|</details|<table|<svg", rest):
        depth += {"<details": 1, "</details": -1}.get(tag, 0)
        unfolded += tag in ("<table", "<svg") and not depth
    assert unfolded == depth == 0
    lines = re.findall(r"<summary><h2>(.*?)</h2>\n<p>(.*?)</p></summary>", rest)
    assert [title for title, _ in lines] == [
        "Which response does each engine show?",
        "How many boards work, and why are the others lost?",
        "What was chosen, and how good is it?",
        "How to build and start it?",
        "What was it made with?",
        "What do the words mean?",
    ]
    assert lines[0][1] == "All 3 responses as wanted, in model, exact circuit and ngspice."
    assert all(line for _, line in lines)


@pytest.mark.slow
def test_each_response_has_its_bar_with_its_interval(whole: ReportData) -> None:
    answers = [
        replace(a, verdict=Verdict.LOST if (a.sample, a.question) == (1, 2) else Verdict.OK)
        for a in whole.study.answers
    ]
    html = without_pictures(changed(whole, answers=tuple(answers)))
    bars = html[html.index('<ul class="bars') : html.index('<div class="columns">')]
    assert bars.count("<li") == len(whole.checked) + 1  # and all of them on one board
    assert re.findall(r'<i style="width: ([\d.]+)%">', bars) == ["100.0", "100.0", "75.0", "75.0"]
    ends = [(float(a), float(b)) for a, b in re.findall(r"left: ([\d.]+)%; width: ([\d.]+)%", bars)]
    assert ends[2] == pytest.approx((30.06, 95.44 - 30.06), abs=0.1)  # Wilson's of 3 of 4
    assert bars.count("<svg ") == len(whole.checked)
    assert "(30 to 95)" in bars


@pytest.mark.slow
def test_commands_have_the_name_of_the_folder(whole: ReportData) -> None:
    data = replace(whole, folder="a rig; <b>")
    html, text = without_pictures(data), render_markdown(data)
    assert "designer tolerance &#39;a rig; &lt;b&gt;&#39; --samples 1000" in html
    assert "    designer tolerance 'a rig; <b>' --samples 1000\n" in text
    assert "DIR" not in text


def test_the_lettering_of_a_drawing_is_legible() -> None:
    text = '<text font-size="6.5">a</text><text x="1" font-size="10">b</text>'
    svg = f'<svg width="9pt" viewBox="-3.5 0 900 40">{text}</svg>'
    assert legible_width(svg) == 1316  # 9.5 pixels for 6.5 units
    assert legible_width('<svg viewBox="0 0 1 1"><path/></svg>') == 0


def test_pictures_follow_the_page(html: str) -> None:
    """What is drawn in a colour of the ground or of ink is drawn in the page's own."""
    drawn = "".join(re.findall(r"<svg.*?</svg>", html, re.DOTALL)).lower()
    css = html[html.index("<style>") : html.index("</style>")]
    for colour in (
        "#ffffff",
        "#000000",
        figure_style.INK,
        figure_style.MUTED,
        figure_style.GRID,
        figure_style.CONTACT,
    ):
        assert colour not in drawn, colour
    used = set(re.findall(r"var\((--plot-\w+)\)", drawn + css))
    light, dark = _palette(css[: css.index("@media")]), _palette(css[css.index("@media") :])
    assert used <= set(light) == set(dark)
    for palette in (light, dark):
        for name in ("ink", "soft", "ngspice", "impact"):
            for ground in ("page", "contact"):
                apart = _contrast(palette[f"--plot-{name}"], palette[f"--plot-{ground}"])
                assert apart >= 3.0, (name, ground)  # WCAG 2.1, 1.4.11
        assert _contrast(palette["--plot-ink"], palette["--plot-model"]) >= 3.0
    assert "@media screen and (prefers-color-scheme: dark)" in css  # paper is light


def _palette(css: str) -> dict[str, str]:
    """The first value that each variable of the pictures gets."""
    pairs = re.findall(r"(--plot-\w+):\s*(#[0-9a-f]{6})", css)
    return dict(reversed(pairs))


def _contrast(a: str, b: str) -> float:
    """The contrast ratio of WCAG 2.1 between two colours."""

    def luminance(colour: str) -> float:
        shares = [int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in shares]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(a), luminance(b)))
    return (high + 0.05) / (low + 0.05)


def test_no_line_ends_inside_an_n_p_q(html: str) -> None:
    page = Page(html)
    assert page.breakable == []
    assert "1-1-1" in page.text
    assert ".whole { white-space: nowrap; }" in html
    assert '<span class="whole">ω = 0.85 (1-2-2)</span>' in html
    assert "RC0603FR-0710KL" in html


def test_what_is_wide_scrolls_in_a_box_of_its_own(html: str) -> None:
    """Tables and wide pictures; the page itself is never wider than the screen."""
    assert re.findall(r'(?<!<div class="scroll">)<table', html) == []
    wide = re.findall(r'<figure class="wide(?: broad)?"[^>]*>(.{24})', html)
    assert len(wide) >= 3
    assert set(wide) == {'<div class="scroll"><svg'}
    css = html[html.index("<style>") : html.index("</style>")]
    assert ".scroll { overflow-x: auto;" in css
    narrow = css[css.index("@media screen and (max-width: 48rem)") :]
    assert "table.broad { width: max-content; }" in narrow  # no column is squeezed and so tall
    heads = re.findall(r"<table([^>]*)>\s*<thead>(.*?)</thead>", html, re.DOTALL)
    assert all('class="broad"' in rest for rest, head in heads if head.count("<th ") > 3)
    assert Table(("a", "b"), (("short", "x" * 200),)).broad
    assert not Table(("a", "b", "c"), (("short", "of a few words", "1"),)).broad


@pytest.mark.parametrize("sides", quick(["both", "upper"]))
def test_the_model_is_drawn_with_its_equations(whole: ReportData, sides: Sides) -> None:
    model = replace(dimensionless(whole.design.model), sides=sides)
    data = changed(whole, design=replace(whole.design, model=model))
    page, markdown = words_of(data), render_markdown(data)
    (label,) = [text for text in page.pictures() if text.startswith("The model: ground")]
    assert ("both sides" in label) == (sides == "both")
    law = {"both": "19 (x − clip(x, −0.25, 0.25))", "upper": "19 max(x − 0.25, 0)"}[sides]
    for text in (page.text, markdown):
        assert "x₁″ + 2ζ (x₁′ − x₂′) + (x₁ − x₂) + f(x₁) = (1 − f₂₀) sin ωt" in text
        assert "x₂″ + 0.2 (2 x₂′ − x₁′) + (2 x₂ − x₁) = 0" in text
        assert f"f(x) = {law}" in text
        assert "M₁ X₁″" not in text
    assert f"\n    {sketch(model).splitlines()[4]}\n" in markdown


def test_every_image_says_what_it_shows(whole: ReportData, html: str) -> None:
    page = Page(html)
    assert all(len(label) > 20 for label in page.pictures())
    assert (
        len(page.pictures()) == 3 * len(whole.checked) + 6
    )  # small, portrait and trace of each; model, legend, dead zone, yields, margins, schematic


@pytest.mark.parametrize("kind", ["html", "markdown"])
def test_every_response_appears_with_its_facts(whole: ReportData, html: str, kind: str) -> None:
    page = re.sub("</?span[^>]*>", "", html).replace("\u00a0", " ")
    text = page if kind == "html" else render_markdown(whole)
    for c in whole.checked:
        assert f"ω = {c.model.omega:.4g} ({c.model.expected})" in text
        assert f"{c.excitation.frequency:.4g} Hz" in text
    for wanted in (
        "All 3 responses were found",
        "1-1-1, asymmetric",
        "3-3-3",  # met beside 1-1-1 at 1.55
        "TL074C",
        "RC0603FR-0710KL",
        "exact (up to 1e-6)",
        "Proved optimal",
        "4 simulated boards",
        "designer tolerance DIR --samples 1000",
        "all on one board",
        whole.result.modelfile.sha256,
        whole.command,
    ):
        assert wanted in text, wanted


def test_what_the_text_says_stands_on_the_page(whole: ReportData, html: str) -> None:
    """Every number of the one in the other."""
    shown = set(re.findall(r"\d+(?:\.\d+)?", Page(html).text))
    said = set(re.findall(r"\d+(?:\.\d+)?", render_markdown(whole)))
    assert len(said) > 150
    assert said - shown == set()


def test_markdown_tables_line_up(whole: ReportData) -> None:
    rows = [line for line in render_markdown(whole).splitlines() if line.startswith("|")]
    assert len(rows) > 60
    for above, below in pairwise(rows):
        if below.startswith(("| --", "| -:")):
            assert len(above) == len(below)


@pytest.mark.slow
def test_the_same_data_give_the_same_bytes(whole: ReportData, html: str, tmp_path: Path) -> None:
    write_report(whole, tmp_path / "report.html", tmp_path / "report.md")
    assert (tmp_path / "report.html").read_bytes() == html.encode("utf-8")
    assert (tmp_path / "report.md").read_bytes() == render_markdown(whole).encode("utf-8")
    assert len(list(tmp_path.iterdir())) == 2


def test_later_sections_stand_before_what_it_was_made_with_and_go_without_a_trace(
    whole: ReportData, html: str
) -> None:
    section = PageSection("Later", ["A <later> answer."], "later", "", "It <came> to this.")
    page, text = (
        inserted_html(html, [section]),
        inserted_markdown(render_markdown(whole), [section]),
    )
    anchors = re.findall(r'<section id="(\w+)">', page)
    assert anchors[anchors.index("later") + 1] == "made"
    entries = re.findall(r'<a href="#(\w+)">', page)
    assert entries[entries.index("later") + 1] == "provenance"
    assert "<p>A &lt;later&gt; answer.</p>" in page
    assert "<h2>Later</h2>\n<p>It &lt;came&gt; to this.</p></summary>" in page
    places = [
        text.index(f"## {title}\n") for title in ("Yields", "Later", "What was it made with?")
    ]
    assert places == sorted(places)
    assert inserted_html(page, [section]) == page
    assert inserted_html(page, []) == html
    assert inserted_markdown(text, []) == render_markdown(whole)


def test_no_time_and_no_path_of_this_machine_stands_in_it(whole: ReportData, html: str) -> None:
    slow = changed(whole, design=replace(whole.design, seconds=123456.0))
    told = dict(whole.result.provenance) | {"cost": {"seconds": 99.5}}
    assert render_markdown(changed(slow, provenance=told)) == render_markdown(whole)
    assert str(EXAMPLE.parent) not in html + render_markdown(whole)


def test_hostile_text_is_inert(whole: ReportData, html: str) -> None:
    bom = [{**whole.bom[0], "manufacturer": HOSTILE, "part_number": "x" * 70}]
    modelfile = replace(whole.result.modelfile, title=HOSTILE)
    data = changed(whole, modelfile=modelfile, command=f"run\n{HOSTILE}")
    vars(data)["bom"] = bom
    plain, hostile = Page(html), words_of(data)
    assert hostile.text.count(HOSTILE) == 5  # title, heading, summary, BOM, command
    assert {tag for tag, _ in hostile.tags} <= {tag for tag, _ in plain.tags}
    assert "49" not in hostile.text[: hostile.text.index("In short")]
    markdown = render_markdown(data)
    shown = [line for line in markdown.splitlines() if not line.startswith("    ")]
    assert not any("<" in line or "`x`" in line for line in shown)
    assert "{{7\\*7}}" in shown[0]
    # As code, where nothing is markup, and on one line.
    assert f"    run {' '.join(HOSTILE.split())}" in markdown.splitlines()


@pytest.mark.slow
def test_a_response_that_is_left_out_of_the_study(whole: ReportData) -> None:
    plan = replace(whole.plan, questions=whole.plan.questions[:2])
    answers = tuple(a for a in whole.study.answers if a.question < 2)
    left_out = {2: "the nominal circuit is aperiodic"}
    study = Study(whole.checked, plan, (0, 1), left_out, answers)
    data = changed(whole, study=study)
    assert [y is None for y in data.yields] == [False, False, True]
    assert [data.question_of(i) for i in range(3)] == [0, 1, None]
    assert 'aria-label="Schematic: ' in without_pictures(data)
    assert "1 response could not be studied" in render_markdown(data)


def test_what_went_wrong_is_said_with_its_reason(whole: ReportData) -> None:
    data = _broken(whole)
    page = words_of(data)
    for wanted in (
        "0 of 3 responses were found",
        "ngspice gave no answer: timestep too small <at> 1 ms",
        "ω = 1.43 (3-4-5): the model shows 1-1-1 instead",
        "model 1-2-2 and exact circuit aperiodic differ",
        "left out: the model does not show it",
        "left out: the nominal circuit is aperiodic",
        "2 responses could not be studied",
        "trap (not passed)",
    ):
        assert wanted in page.text, wanted
    assert "all on one board" not in page.text
    assert "timestep too small &lt;at> 1 ms" in render_markdown(data)


def test_lost_boards_are_counted_by_reason(whole: ReportData) -> None:
    kinds = [("to 1-3-3", "1-3-3"), ("asymmetric by 0.01 of the peak", "1-2-2")]
    answers = []
    for a in whole.study.answers:
        lost = a.question == 2
        reason, met = kinds[a.sample % 2]
        answers.append(replace(a, verdict=Verdict.LOST, reason=reason, response=met) if lost else a)
    heard = [
        replace(h, response="1-9-9") if h.question == 2 else h for h in whole.study.cross_checks
    ]
    data = changed(whole, answers=tuple(answers), cross_checks=tuple(heard))
    text = render_markdown(data)
    assert "lost to 1-3-3 (2), lost: asymmetric (2)" in text
    assert "1-2-2 but 1-9-9 (2), 1-3-3 but 1-9-9 (2)" in text
    assert "2 of 3 responses survive on every one" in text
    assert "shown by 0 of 4: of a thousand boards, about 0 (95 % interval 0 to 490)" in text
    assert data.study.all_on_one_board is not None
    assert (data.study.all_on_one_board.ok, data.study.all_on_one_board.lost) == (0, 4)


@pytest.mark.slow
def test_boards_that_failed_do_not_count(whole: ReportData) -> None:
    answers = [
        replace(a, verdict=Verdict.FAILED, reason="no mode holds") for a in whole.study.answers
    ]
    data = changed(whole, answers=tuple(answers))
    text = words_of(data).text
    assert "failed: no mode holds (4)" in text
    assert "4 simulated boards: not one gave an answer" in text
    assert not re.search(r"\b(nan|inf)\b", text)
    some = [replace(a, verdict=Verdict.FAILED) if a.sample == 3 else a for a in whole.study.answers]
    data = changed(whole, answers=tuple(some))
    text = render_markdown(data)
    assert "All 3 responses on one and the same board: 3 of 3; of a thousand, about 1000" in text
    assert "3 runs gave no answer, which the yields leave out" in text


@pytest.mark.slow
def test_results_of_a_script_have_no_command(whole: ReportData) -> None:
    nameless = replace(whole, command="")
    for text in (words_of(nameless).text, render_markdown(nameless)):
        assert "To make these results again" not in text


def test_where_no_board_was_lost_nothing_is_told_of_losses(whole: ReportData) -> None:
    answers = [replace(a, verdict=Verdict.OK, reason="") for a in whole.study.answers]
    agreed = [
        replace(h, response=a.response, reason="")
        for h in whole.study.cross_checks
        for a in answers
        if (a.sample, a.question) == (h.sample, h.question)
    ]
    data = changed(whole, answers=tuple(answers), cross_checks=tuple(agreed))
    text = render_markdown(data)
    assert "every one shows all 3 responses: of a thousand, about 1000" in text
    assert "on one and the same board" not in text  # said already
    assert "what became of the others" not in text
    assert "why without answer" not in text


def test_an_exact_match_does_not_read_as_an_error(html: str) -> None:
    page = Page(html)
    assert "Every coefficient of the equations is met exactly." in page.text
    assert "largest coefficient error" not in page.text


def test_without_ngspice(whole: ReportData) -> None:
    checked = tuple(replace(c, gate=None) for c in whole.checked)
    text = words_of(changed(whole, checked=checked, cross_checks=())).text
    assert "the model and the exact circuit (ngspice was not asked) agree on each" in text
    assert "ngspice was not asked about any board." in text
    assert "steps per period" not in text
    assert "ngspice’s runs" not in text.replace("'", "’")
    assert "designer tolerance DIR --rung auto" in text


def test_boards_without_a_decision_are_not_counted_as_different(whole: ReportData) -> None:
    def said(h: CrossCheck) -> CrossCheck:
        word = {0: "undecided", 1: "failed", 2: "9-9-9"}.get(h.sample, h.response)
        return replace(h, response=word, reason=f"why {word}")

    data = changed(
        whole,
        cross_checks=tuple(said(h) for h in whole.study.cross_checks if h.kind is StartKind.OWN),
    )
    table = ngspice_table(data)
    assert table is not None
    for row in table.rows:
        boards, agreed, *others = map(int, row[2:7])
        assert (agreed, others) == (boards - 3, [1, 1, 1])
        assert "but 9-9-9 (1), why failed (1), why undecided (1)" in row[7]
    few = ngspice_table(changed(whole, not_asked=(0, 31, 0)))
    assert few is not None
    told = [(row[0], row[1]) for row in few.rows if "not asked (31)" in row[7]]
    assert told == [(few.rows[2][0], "the nominal orbit")]


def test_without_responses(whole: ReportData) -> None:
    plan = replace(whole.plan, questions=())
    data = changed(whole, checked=(), answers=(), cross_checks=(), response_indices=(), plan=plan)
    for text in (words_of(data).text, render_markdown(data)):
        assert "no response is named" in text
        assert "None was asked for." in text


@pytest.mark.slow
def test_engine_that_has_no_orbit_at_all(whole: ReportData) -> None:
    first = whole.checked[0]
    broken = replace(first, model=replace(first.model, orbit=failed("diverged"), found=False))
    text = words_of(changed(whole, checked=(broken, *whole.checked[1:]))).text
    assert "the model shows failed (diverged) instead" in text


@pytest.mark.slow
def test_errors_that_are_not_zero_have_a_picture_and_a_bound(whole: ReportData) -> None:
    errors = {**whole.design.errors.errors, "stop slope": 0.0123}
    larger = replace(whole.design.errors, errors=errors, max_error=0.0123)
    certificate = replace(whole.design.certificate, status="bound", lower_bound=0.004)
    design = replace(whole.design, errors=larger, certificate=certificate)
    page = words_of(changed(whole, design=design))
    assert len(page.pictures()) == 3 * len(whole.checked) + 7
    assert "this design reaches 1.23 %" in page.text
    assert "stays below 0.4 %" in page.text


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("x2'' x1", "x₁ in the equation of x₂″"),
        ("stop slope", "stiffness of a stop, over K1"),
        ("lower stop slope B", "stiffness of the lower stop of B, over K1"),
        ("stop slope x2' x1", "x₁ in the equation of x₂″, by a stop"),
        ("stop slope A x12' x1", "x₁ in the equation of x₁₂″, by a stop of A"),
        ("dead-zone null", "slope left inside the dead zone, over K1"),
        ("dead-zone bias B", "force left inside the dead zone of B, over K1 times the threshold"),
        (
            "gap B upper",
            "gap to the upper stop of B, over the gap or the bend that sets the amplitude",
        ),
        ("upper bend slope L_1", "change of the slope at the upper bend of L_1"),
        ("bend slope L_1 x2' x1'", "x₁′ in the equation of x₂″, by a bend of L_1"),
        (
            "bend L_1 lower",
            "place of the lower bend of L_1, over the gap or the bend that sets the amplitude",
        ),
        ("constant x2", "constant force in the equation of x₂″"),
    ],
)
def test_coefficients_of_any_system_have_names_for_people(name: str, text: str) -> None:
    assert words.coefficient(name) == text


def test_thresholds_of_several_clearances_are_those_of_the_circuit() -> None:
    """Each of two contacts, as the model's gap by the scale and as an op-amp of the stage turns."""
    model = read_model_file(EXAMPLE.parent / "three-masses.toml").model
    system = model.second_order()
    scale = Scale(1e-3, np.array([8.0, 8.0, 5.0, 6.0, 7.0, 3.0]), 1.0)
    circuit = exact_circuit(system, scale)
    errors = coefficient_errors(circuit, system)
    design = Design(model, circuit, errors, Certificate("bound", 0.0, "none"), {}, {}, 0.0)
    shown = design_tables.scale_table(design, None)
    assert shown is not None
    rows = {row[0]: row[1] for row in shown.rows}
    assert rows["contact in A begins at (v1)"] == "± 2.4\u00a0V"
    assert rows["contact in B begins at (v5)"] == "2.1\u00a0V"


@pytest.mark.slow
def test_model_in_si_units_without_a_clearance(catalog: Catalog) -> None:
    text = """
        format = 1
        title = "No stops"
        [mechanical]
        M1 = 2.0
        M2 = 2.0
        C1 = 40.0
        C2 = 40.0
        K0 = 0.0
        K1 = 20000.0
        K2 = 20000.0
        B = 0.001
        P1 = 50.0
        P2 = 0.0
        [[response]]
        omega = 0.8
        expect = "1-0-0"
    """
    modelfile = parse_model_file(text)
    made = synthesise(modelfile, catalog)
    found, design = made.model_responses, made.design
    checked = checked_design.check(design, found, None)
    plan = plan_study(modelfile, design, (), catalog, samples=1, seed=1)
    study = Study(checked, plan, (), {0: "not asked"}, ())
    data = ReportData(
        RunResult(modelfile, catalog, found, design, checked, study, NO_ORIGIN), "designer run x"
    )
    page = words_of(data)
    assert "The response was found" in page.text
    assert "contact begins" not in page.text
    assert "20\u00a0kN/m" in page.text
    assert "m/s" in page.text
    assert "2\u00a0kg" in page.text
    assert "M₁ X₁″ + C₁ (X₁′ − X₂′) + K₁ (X₁ − X₂) = P₁ sin ΩT" in page.text
    assert "f(x₁)" not in page.text


def test_portraits_of_a_model_in_metres_are_in_millimetres() -> None:
    data, file = plain_report(), parse_model_file(HAMMER)
    model = replace(data.checked[0].model, b=file.model.b)
    orbit = replace(model.orbit, extremes=np.array([[2.4e-3, -1.9e-3], [0.3, -0.3]]))
    checked = (replace(data.checked[0], model=replace(model, orbit=orbit)),)
    data = changed(
        data, checked=checked, modelfile=file, design=replace(data.design, model=file.model)
    )
    (motion,) = data.motions(0)  # both clearances see x₁
    assert motion.axes == ("x₁ [mm]", "x₁′ [mm/s]")
    assert motion.gaps == pytest.approx((0.8, -1.5))
    at = motion.of(np.zeros(1), np.array([[-2e-3, 0.25]]), 69.0)
    assert at == pytest.approx(np.array([[-2.0, 250.0]]))


def test_a_place_that_cannot_be_written(whole: ReportData, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a place that can be written"):
        write_report(whole, tmp_path / "no" / "report.html", tmp_path / "no" / "report.md")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_board_is_shown_from_both_sides(whole: ReportData, tmp_path: Path) -> None:
    texts = case_files("paper")
    board = tmp_path / "board.kicad_pcb"
    board.write_text(next(t for n, t in texts.items() if n.endswith(".kicad_pcb")), "utf-8")
    sides = ["The board from above", "The board from below"]
    page = words_of(replace(whole, board_file=read_board(board)))
    assert [shown for shown in page.pictures() if shown.startswith("The board from")] == [
        f"{side}." for side in sides
    ]
    assert "placed and not routed yet" in page.text
    assert not any(shown.startswith("The board") for shown in words_of(whole).pictures())


def test_what_is_not_good_enough_stands_first() -> None:
    rule = {"id": "swing", "found": "11.3 V", "limit": "at most 11 V", "do": "<b>scale down"}
    rest = plain_report()
    data = changed(rest, warnings=("The error is 19 %.",), failed_rules=(rule,))
    text, page = render_markdown(data), words_of(data).text
    sections = re.findall("^## (.*)$", text, re.MULTILINE)
    assert sections[:2] == ["What is not good enough", "In short"]
    assert "- The error is 19 %.\n\n### Design rules that fail\n" in text
    assert re.search(
        r"^\| swing +\| 11.3 V +\| at most 11 V +\| &lt;b>scale down", text, re.MULTILINE
    )
    assert page.index("What is not good enough") < page.index("The error is 19")
    assert page.index("<b>scale down") < page.index("Does the circuit do what the model does?")
    assert "The circuit does not keep 1 design rule: swing." in text
    assert "What is not good enough" not in render_markdown(rest)
