"""The drawing and the sketch of any system: everything that the file has is in them."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

from designer.base import figure_style
from designer.model.ascii_sketch import system_sketch
from designer.plots.system_drawing import system_drawing
from designer.plots.system_equations import element_rows
from tests.plots.test_system_equations import FILES, system
from tests.shared.system_text import clearance, system_text, table

BRANCH = system_text(
    {"a": 1.5, "b": 2.5, "c": 3.5},
    {("a", "b"): 4.5, ("b", "ground"): 5.5, ("c", "b"): 6.5},
    {("c", "ground"): 0.25, ("a", "b"): 0.75},
    clearance("A", "a", "c", upper=0.5, lower=0.3, stiffness=12.0),
    table("force", on="c", amplitude=8.5, constant=-0.125),
)
SAME_MASS = system_text(
    {"a": 1.5},
    {("a", "ground"): 4.5},
    {("a", "ground"): 0.25},
    clearance("anvil", "a", "ground", upper=0.5, stiffness=12.0),
    clearance("pad", "a", "ground", lower=0.3, stiffness=13.0),
    clearance("stiffening_by_steps", "a", "ground", upper=0.75, lower=0.7, stiffness=14.0),
    table("force", on="a", amplitude=8.5),
)
LAWS = system_text(
    {"a": 1.5, "b": 2.5},
    {("a", "b"): 4.5, ("b", "ground"): 5.5},
    {("a", "b"): 0.75},
    table("cubic_spring", between=("b", "ground"), k1=-1.25, k3=7.5, range=2.0),
    table("friction", between=("a", "ground"), force=0.375, velocity=0.1),
    table("law", name="soft", between=("a", "b"), points=[[-1, -2], [1, 2], [2, 3]]),
    table("law", name="mesh", points=[[-1, -2], [1, 2]]) + "of = { a = 1.0, b = -0.5 }\n",
    table("law", name="oil", between=("a", "b"), quantity="velocity", points=[[-1, -2], [1, 2]]),
    table("force", on="a", amplitude=8.5, phase=0.75, harmonics=[[2, 1.625, 0.5]]),
    table("force", on="b", amplitude=9.5, waveform="square", terms=3),
)
IN_THE_TABLE_ALONE = (
    *(".constant", ".depth", ".damping", ".restitution", ".preload_over", ".range", ".velocity"),
    *(".x₁", ".x₂", ".x₃", ".f₁", ".f₂", ".f₃", "φ₁", "P₁.2", "φ₁.2", ".terms"),
)
SYSTEMS = {**FILES, "branch": BRANCH, "same mass": SAME_MASS, "laws": LAWS}


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for axes in figure.axes for text in axes.texts]


@pytest.mark.parametrize("name", SYSTEMS)
def test_every_value_is_drawn_inside_the_sheet(name: str) -> None:
    model = system(SYSTEMS[name])
    figure = system_drawing(model, si=name in FILES)
    shown = " ".join(texts(figure)).replace("\n", " ").replace("−", "-")
    for symbol, value, _ in element_rows(model, si=name in FILES):
        if not symbol.endswith(IN_THE_TABLE_ALONE):
            assert value.lstrip("-") in shown, symbol
    axes = figure.axes[0]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    for line in axes.lines:
        x, y = line.get_xydata().T  # type: ignore[union-attr]
        assert left <= x.min() <= x.max() <= right
        assert low <= y.min() <= y.max() <= high
    svg = figure_style.to_svg(figure)
    assert svg == figure_style.to_svg(system_drawing(model, si=name in FILES))


@pytest.mark.parametrize("name", SYSTEMS)
def test_no_line_crosses_the_name_of_a_clearance(name: str) -> None:
    model = system(SYSTEMS[name])
    figure = system_drawing(model, si=name in FILES)
    axes, names = figure.axes[0], {gap.name for gap in model.gaps}
    paths = [axes.transData.transform_path(line.get_path()) for line in axes.lines]
    boxes = {t.get_text(): t.get_window_extent() for t in axes.texts if t.get_text() in names}
    assert set(boxes) == names
    for text, box in boxes.items():
        assert not any(path.intersects_bbox(box, filled=False) for path in paths), text


def test_masses_stand_in_a_row_from_the_ground() -> None:
    model = system(BRANCH)
    assert model.row == ("b", "c", "a")
    sketch = system_sketch(model)
    assert [sketch.index(f"[ {name} ]") for name in "bca"] == sorted(
        sketch.index(f"[ {name} ]") for name in "bca"
    )
    for line in ("spring: a to b", "damper: c to ground", "A: upper and lower stop, a to c"):
        assert line in sketch.splitlines()
    assert "force on c" in sketch
    assert sketch.isascii()
