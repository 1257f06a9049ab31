"""The pages of the report on a searched design, from made-up cases."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import pytest

from designer.base.figure_style import to_png
from designer.base.page import markdown
from designer.model.model_file import parse_model_file
from designer.verdicts.verdict import Verdict
from designer.yields.yield_count import Yield
from reports.makers.robust_design import _decided, at_model_clearance
from reports.makers.robust_design_page import lever_chart, robust_design_page, yield_chart
from tests.shared.search_cases import asked


def counted(ok: int, of: int = 4000) -> dict[str, Any]:
    y = Yield(ok, of - ok, 0, 0)
    return {**y.__dict__, "rate": y.rate, "low": y.interval[0], "high": y.interval[1]}


def response(expect: str, ok: int, **layers: int) -> dict[str, Any]:
    row = {"expect": expect, "omega": 1.0, "as built": counted(ok), "blame": "by U1A"}
    more = {name: counted(n, 400) for name, n in layers.items()}
    return {**row, "limited_by": "offset: near", **more}


def case(name: str, *responses: dict[str, Any], **more: Any) -> dict[str, Any]:
    bill = {"parts": 60, "packages": 4, "distinct": 12, "price": 7.5, "unsold": []}
    return {
        "name": name,
        "responses": list(responses),
        "all_on_one": {"as built": counted(3000), **more.pop("all_on_one", {})},
        "bill": bill,
        **more,
    }


RANK = {"smallest_distance": 4.0, "smallest_yield": 0.99997, "product": 0.9999}
NONE = {"smallest_distance": None, "smallest_yield": None, "product": None}
SEARCH = {
    "start": {**RANK, "smallest_distance": -1.3},
    "final": {
        **RANK,
        "responses": [
            {"omega": 1.6, "b": 0.36, "distance": 6.0},
            {"omega": 0.2112, "b": 0.3, "distance": None},
        ],
    },
    "contributions": [
        {"lever": "places", "from": "middle", "to": "chosen", "alone": RANK, "without": RANK},
        {"lever": "dead zone", "from": "saturation", "to": "rectifier", "alone": NONE,
         "without": RANK},
    ],
}  # fmt: skip
CONFIRMED = {
    "rung": "dynamic",
    "responses": [
        {"gate": {"passed": True}, "asked": 40, "agreed": 39},
        {"gate": {"passed": False}, "asked": 0, "agreed": 0},
    ],
}
CASES = [
    case("paper, as printed", response("1-1-1", 2700)),
    case("paper, corrected", response("1-1-1", 2800), response("1-8-8", 0)),
    case("rectifier stage", response("1-1-1", 4000), response("1-8-8", 700)),
    case("searched", response("1-1-1", 4000, reached=400), response("1-8-8", 3999, reached=400),
         search=SEARCH, confirmation=CONFIRMED,
         all_on_one={"as built": counted(4000), "reached": counted(400, 400)}),
    case("searched, nominal b", response("1-1-1", 4000, tuned=400, reached=400),
         response("1-8-8", 900, tuned=390, reached=100), search=SEARCH,
         all_on_one={"as built": counted(4000), "tuned": counted(396, 400)}),
]  # fmt: skip


def table(text: str, kind: str) -> dict[str, list[str]]:
    """The rows of one kind of yield, by circuit."""
    lines = text.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith(f"| {kind} |"))
    rows = {}
    for line in lines[first + 2 :]:
        if not line.startswith("|"):
            break
        name, *cells = [cell.strip() for cell in line.strip("|").split("|")]
        rows[name] = cells
    return rows


def written(cases: list[dict[str, Any]]) -> str:
    page = robust_design_page(cases, "make it", "robust.toml")
    return re.sub(" +", " ", markdown(page))


def test_the_tables_say_which_goal_is_reached() -> None:
    text = written(CASES)
    built = table(text, "as built")
    assert built["searched"] == [
        "4000", "100.00 (99.90 to 100.00)", "99.98 (99.86 to 100.00)",
        "100.00 (99.90 to 100.00)", "reached",
    ]  # fmt: skip
    assert built["paper, as printed"][1:] == [
        "67.50 (66.03 to 68.93)", "-", "75.00 (73.63 to 76.32)",
        "missed by 1-1-1, 1-8-8, all on one",
    ]  # fmt: skip
    assert built["searched, nominal b"][-1] == "missed by 1-8-8"
    tuned = table(text, "tuned")
    assert set(tuned) == {"searched, nominal b"}
    # Of 400 boards 396 are 99 %; 390 have an interval that ends below.
    assert tuned["searched, nominal b"][0] == "400"
    assert tuned["searched, nominal b"][-1] == "missed by 1-8-8; undecided for all on one"
    assert table(text, "reached")["searched"][1] == "100.00 (99.05 to 100.00)"
    assert "| 1-8-8 | not passed | 0 | 0 |" in text
    assert "| 1-1-1 | passed | 40 | 39 |" in text
    assert "| dead zone | saturation | rectifier | no such design | 4.00 σ |" in text
    assert "| 1-8-8 | 0.2112 | 0.3 | - | offset: near |" in text


@pytest.mark.parametrize("chart", [yield_chart, lever_chart])
def test_a_chart_is_a_picture(chart: Any) -> None:
    assert to_png(chart(CASES)).startswith(b"\x89PNG")


def test_the_yields_are_drawn_as_they_are() -> None:
    (axes,) = yield_chart(CASES).axes
    heights = [[float(bar.get_height()) for bar in bars] for bars in axes.containers
               if hasattr(bars, "patches")]  # fmt: skip
    assert heights[0] == [67.5]
    assert heights[4] == [100.0, 22.5]


def test_the_model_s_clearance_is_everybody_s() -> None:
    file = parse_model_file(asked('omega = "best"\nexpect = "1-2-2"\nb = [0.2, 0.3]'))
    fixed = parse_model_file(at_model_clearance(file))
    assert [r.b for r in fixed.responses] == [None]
    assert [r.expect for r in fixed.responses] == [r.expect for r in file.responses]
    assert fixed.circuit == file.circuit


@pytest.mark.parametrize(
    ("layer", "ok", "decided"),
    [("reached", 500, True), ("reached", 495, False), ("reached", 480, True), ("all", 495, False),
     ("tuned", 495, False)],
)  # fmt: skip
def test_a_second_look_where_the_first_decides_nothing(layer: str, ok: int, decided: bool) -> None:
    def rows(count: int) -> list[SimpleNamespace]:
        return [
            SimpleNamespace(verdict=Verdict.OK if i < count else Verdict.LOST) for i in range(500)
        ]

    study = SimpleNamespace(
        power_ups=rows(ok if layer == "reached" else 500),
        tuned=rows(ok) if layer == "tuned" else None,
        rows_of=lambda _, rows: rows,
        on_one_board=lambda _: Yield(*((ok, 500 - ok) if layer == "all" else (500, 0)), 0, 0),
    )
    assert _decided(study, 1) is decided  # type: ignore[arg-type]


def test_two_responses_with_one_n_p_q_have_a_column_each() -> None:
    twice = case("searched", response("1-1-1", 4000), response("1-1-1", 3000), search=SEARCH)
    text = written([twice])
    assert "| 1-1-1 | 1-1-1 (2) |" in text
    assert table(text, "as built")["searched"][1:3] == [
        "100.00 (99.90 to 100.00)", "75.00 (73.63 to 76.32)",
    ]  # fmt: skip
