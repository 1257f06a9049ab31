"""Figures of attribution, maps and the tolerance sheet: they draw what the results say."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from designer.base import figure_style
from designer.base.arrays import Array
from designer.base.page import markdown
from designer.paper.circuits import OMEGA
from designer.paper.reproduce_tolerance import KINDS, TITLES, YieldRow, tolerance_page, yield_sheet
from designer.plots.attribution_plots import avoided_chart, index_chart
from designer.plots.map_plots import map_chart
from designer.yields.loss_attribution import ResponseAttribution
from designer.yields.loss_replay import PartAttribution
from designer.yields.margins import Prediction
from designer.yields.worst_corner import Index
from designer.yields.yield_maps import Axis, YieldMap
from tests.shared.exploring import quick
from tests.shared.figure_text import clipped, overlapping

LABELS = ["ω = 0.54   1-3-3", "ω = 0.41   1-4-4"]


def attributed(shares: dict[str, int]) -> ResponseAttribution:
    subjects = tuple(
        PartAttribution(name, "group" if " " in name else "resistor", avoided, 10, 0, 0)
        for name, avoided in shares.items()
    )
    indices = tuple(Index(f"R{k}", f"R{k}", 0.1, 0.5 / (k + 1), 0.03, 0.05) for k in range(12))
    return ResponseAttribution(
        0, 10, subjects, indices, (), Prediction(50, 10, 1, 0), 0, 0, None, "something"
    )


def mapped(two: bool = False) -> YieldMap:
    ok = np.array([[0, 0], [9, 4], [10, 2]]) if two else np.array([0, 9, 10])
    there = ok.reshape(3, -1)[:, 0] > 0
    axes = (Axis("omega", (0.5, 0.54, 0.6)), Axis("grade", (0.001, 0.05)))
    nothing = np.zeros_like(ok)
    return YieldMap(
        "omega-grade" if two else "omega", 0, axes if two else axes[:1],
        np.tile(there[:, None], (1, 2)) if two else there, ok, 10 - ok, nothing, nothing, 10, 1,
        0.54, (0.52, 0.62), (False, False), 1, 1.0,
    )  # fmt: skip


def rows() -> list[YieldRow]:
    def row(circuit: str, resistor: float, kind: str, p: int) -> YieldRow:
        half = 5 if p < 8 else 0  # the nominal circuit does not show 1-8-8
        name = f"1-{p}-{p}"
        return YieldRow(
            circuit, resistor, 0.01, True, name, OMEGA[p], kind, p < 8, half, half, 0, 0
        )  # fmt: skip

    return [
        row(c, r, kind, p) for c in TITLES for r in (0.01, 0.001) for kind in KINDS for p in OMEGA
    ]


FIGURES: dict[str, Callable[[], Figure]] = {
    "avoided": lambda: avoided_chart(LABELS, [attributed({"all offsets": 8, "R1": 3}), None]),
    "nothing lost": lambda: avoided_chart(LABELS, [replace(attributed({}), lost=0), None]),
    "indices": lambda: index_chart(LABELS, [attributed({}), None]),
    "nothing limits": lambda: index_chart(LABELS, [None, None]),
    "map": lambda: map_chart("1-3-3", mapped()),
    "heat": lambda: map_chart("1-3-3", mapped(two=True)),
    "sheet": lambda: yield_sheet(rows()),
}


@pytest.mark.parametrize("name", quick(sorted(FIGURES), 3))
def test_no_text_is_cut_off_or_covered(name: str) -> None:
    figure = FIGURES[name]()
    assert clipped(figure) == []
    assert overlapping(figure) == []


@pytest.mark.parametrize("count", quick([1, 3, 4, 9]))
def test_charts_of_attribution_have_room_for_their_text(count: int) -> None:
    labels = [f"ω = 0.{k}15   1-{k}-{k}" for k in range(1, count + 1)]
    one = attributed({"thresholds of the dead zone": 8, "R204A": 3})
    wide = tuple(replace(i, coordinate=f"U3D.offset_drift_{i.part}") for i in one.indices)
    attributions = [replace(one, indices=wide)] * count
    for figure in (index_chart(labels, attributions), avoided_chart(labels, attributions)):
        assert clipped(figure) == []
        assert overlapping(figure) == []


@pytest.mark.parametrize("name", quick(sorted(FIGURES), 3))
def test_figures_are_the_same_twice(name: str) -> None:
    assert figure_style.to_svg(FIGURES[name]()) == figure_style.to_svg(FIGURES[name]())


def test_the_heat_map_of_attribution_holds_the_shares_with_groups_first() -> None:
    attributions = [
        attributed({"R1": 3, "all offsets": 8, "R2": 5}),
        attributed({"R1": 9, "all offsets": 1}),
    ]
    axes = avoided_chart(LABELS, attributions).axes[0]
    image = next(a for a in axes.get_children() if isinstance(a, AxesImage))
    names = [t.get_text() for t in axes.get_yticklabels()]
    assert names == ["all offsets", "R1", "R2"]
    values: Array = np.ma.filled(np.ma.asarray(image.get_array(), dtype=float), np.nan)
    np.testing.assert_allclose(values, [[80.0, 10.0], [30.0, 90.0], [50.0, np.nan]])


def test_the_index_chart_draws_the_largest_totals() -> None:
    axes = index_chart(LABELS, [attributed({}), None]).axes[0]
    widths = [p.get_width() for p in axes.patches]  # type: ignore[attr-defined]
    assert widths[:3] == pytest.approx([50.0, 25.0, 100.0 / 6.0])
    assert "59 of 60" in " ".join(t.get_text() for t in axes.texts)


def test_a_map_curve_is_the_rate_and_marks_what_is_not_there() -> None:
    axes = map_chart("1-3-3", mapped()).axes[0]
    lines = [(np.asarray(x.get_xdata()), np.asarray(x.get_ydata()), x) for x in axes.lines]
    curve = next(y for x, y, line in lines if len(x) == 3 and line.get_linestyle() == "-")
    np.testing.assert_allclose(curve, [0.0, 90.0, 100.0])
    crosses = next(x for x, _, line in lines if len(x) and line.get_marker() == "x")
    np.testing.assert_allclose(crosses, [0.5])


def test_the_page_says_every_case_and_what_is_not_there() -> None:
    attribution = {
        "responses": [
            {
                "question": 1, "limited_by": "stability: a fold",
                "prediction": {"ok": 8, "lost": 2, "right": 9},
                "subjects": [{"name": "all offsets", "kind": "group", "avoided": 3, "replayed": 4}],
            }
        ]
    }  # fmt: skip
    page = tolerance_page(rows(), {"printed": attribution}, samples=10, short=10, seed=3)
    text = re.sub(" +", " ", markdown(page))
    assert text.splitlines()[2].startswith("Made by `designer reproduce tolerance --samples 10")
    assert text.count("| 1 % | 1 % | on | as built | 50 | 50 | 50 | 50 | 50 | 50 | 50 | × |") == 3
    assert "- **1-2-2**: stability: a fold. Losses avoided if exact: all offsets 3 of 4. " in text
    assert "The margin foretells 9 of 10 verdicts." in text
    assert "± 26.3" in text  # Wilson at 5 of 10: 0.2366 to 0.7634
