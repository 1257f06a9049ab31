"""The picture of a board: each component once, named, its pads where the KiCad file has them."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.patches import Circle, Rectangle

from designer.board.kicad_placement import place
from designer.board.kicad_reader import read_board
from reports.makers.placement_drawing import placement_drawing
from tests.shared.figure_text import clipped, overlapping
from tests.shared.kicad_cases import case, case_files, written


@pytest.mark.parametrize("name", ["rectifier", "surface"])
def test_every_component_is_drawn_with_its_pads(name: str, tmp_path: Path) -> None:
    project = case(name)
    placement = place(project.circuit, project.components)
    figure = placement_drawing(placement)
    (axes,) = figure.axes
    assert sorted(t.get_text() for t in axes.texts) == sorted(
        spot.component.reference for spot in placement.spots
    )
    (path,) = written(case_files(name), tmp_path).glob("*.kicad_pcb")
    pads = [pad.at for part in read_board(path).footprints for pad in part.pads]
    drawn = {
        (round(x, 3), round(y, 3))
        for patch in axes.patches
        for x, y in [patch.center if isinstance(patch, Circle) else _middle(patch)]
    }
    assert {(round(x, 3), round(y, 3)) for x, y in pads} <= drawn
    assert clipped(figure) == []
    assert overlapping(figure) == []


def _middle(patch: object) -> tuple[float, float]:
    assert isinstance(patch, Rectangle)
    x, y = patch.get_xy()
    return x + 0.5 * patch.get_width(), y + 0.5 * patch.get_height()
