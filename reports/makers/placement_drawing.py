"""The board as a picture: every component where it stands, with its pads and its reference."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from designer.base.figure_style import CONTACT, INK, MUTED, new_figure, styled
from designer.board.footprints import PadShape
from designer.board.kicad_placement import Placement
from designer.board.placed_component import PlacedComponent

INCH = 1.0 / 12.0
"""Of one millimetre of the board."""
MARGIN = 1.5
"""About the board [mm]."""
COPPER, HOLE, PART = "#c98b3b", "#fefefe", "#fefefe"


@styled
def placement_drawing(placement: Placement) -> Figure:
    """The board from above, twice as large as it is."""
    board = placement.outline
    wide, high = board.width + 2.0 * MARGIN, board.height + 2.0 * MARGIN
    figure = new_figure(INCH * wide, INCH * high)
    figure.set_layout_engine("none")
    axes: Axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(board.left - MARGIN, board.right + MARGIN)
    axes.set_ylim(board.bottom + MARGIN, board.top - MARGIN)  # y counts downwards
    edge = Rectangle((board.left, board.top), board.width, board.height, fc=CONTACT, ec=INK)
    axes.add_patch(edge)
    for spot in placement.spots:
        _component(axes, spot)
    for hole in placement.holes:
        (pad,) = hole.footprint.pads
        axes.add_patch(Circle((hole.x, hole.y), 0.5 * pad.drill, fc=HOLE, lw=0.0))
    for mark in placement.fiducials:
        (pad,) = mark.footprint.pads
        axes.add_patch(Circle((mark.x, mark.y), 0.5 * pad.width, fc=COPPER, lw=0.0))
    return figure


def _component(axes: Axes, spot: PlacedComponent) -> None:
    sign = -1.0 if spot.angle == 180 else 1.0
    wide, high = spot.footprint.body
    corner = (spot.x - 0.5 * wide, spot.y - 0.5 * high)
    axes.add_patch(Rectangle(corner, wide, high, fc=PART, ec=MUTED, lw=0.6))
    for pad in spot.footprint.pads:
        _pad(axes, pad, spot.x + sign * pad.x, spot.y + sign * pad.y)
    x, y = spot.label_at
    name = spot.component.reference
    axes.text(spot.x + x, spot.y + y, name, ha="center", va="center_baseline", size=4.6)


def _pad(axes: Axes, pad: PadShape, x: float, y: float) -> None:
    round_ = bool(pad.drill) and not pad.first
    if round_:
        axes.add_patch(Circle((x, y), 0.5 * min(pad.width, pad.height), fc=COPPER, lw=0.0))
    else:
        corner = (x - 0.5 * pad.width, y - 0.5 * pad.height)
        axes.add_patch(Rectangle(corner, pad.width, pad.height, fc=COPPER, lw=0.0))
    if pad.drill:
        axes.add_patch(Circle((x, y), 0.5 * pad.drill, fc=HOLE, lw=0.0))
