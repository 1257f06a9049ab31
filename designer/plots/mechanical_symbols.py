"""A sheet on which springs, dampers, masses, walls and arrows of a mechanical model are drawn."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from designer.base.figure_style import CONTACT, INK, MUTED, new_figure

INCH = 0.4
"""Inches of one unit of a drawing."""
_SIZE = 8.5


class MechanicalSheet:
    """A figure of one pair of axes without a frame, in units of its own."""

    def __init__(self, width: float, height: float, low: float = 0.0) -> None:
        self.figure = new_figure(width * INCH, (height - low) * INCH)
        self.figure.set_layout_engine("none")
        self.axes: Axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self.axes.set_axis_off()
        self.axes.set_xlim(0.0, width)
        self.axes.set_ylim(low, height)

    def box(self, left: float, right: float, low: float, high: float) -> None:
        """A mass."""
        body = Rectangle((left, low), right - left, high - low, fc=CONTACT, ec=INK, lw=1.2)
        self.axes.add_patch(body)

    def spring(self, x0: float, x1: float, y: float) -> None:
        turns, lead = 6, 0.18 * (x1 - x0)
        step = (x1 - x0 - 2.0 * lead) / (2 * turns)
        xs = [x0, x0 + lead]
        ys = [y, y]
        for i in range(2 * turns):
            xs.append(x0 + lead + (i + 0.5) * step)
            ys.append(y + (0.28 if i % 2 == 0 else -0.28))
        self.line([*xs, x1 - lead, x1], [*ys, y, y], INK, 1.2)

    def damper(self, x0: float, x1: float, y: float) -> None:
        middle, half = 0.5 * (x0 + x1), 0.7
        self.line([x0, middle - half], [y, y], INK, 1.2)
        self.line(
            [middle + half, middle - half, middle - half, middle + half],
            [y + 0.35, y + 0.35, y - 0.35, y - 0.35], INK, 1.2,
        )  # fmt: skip
        self.line([middle + 0.15, middle + 0.15], [y + 0.26, y - 0.26], INK, 1.8)
        self.line([middle + 0.15, x1], [y, y], INK, 1.2)

    def friction(self, x0: float, x1: float, y: float) -> None:
        """A rod between two pads that rub on it."""
        middle, half = 0.5 * (x0 + x1), 0.6
        self.line([x0, middle + half], [y, y], INK, 1.2)
        for pad in (y + 0.14, y - 0.14):
            self.line([middle - half, middle + half], [pad, pad], INK, 1.8)
        end = middle + half + 0.25
        self.line([middle + half, end, end, middle + half], [y + 0.3] * 2 + [y - 0.3] * 2, INK, 1.2)
        self.line([end, x1], [y, y], INK, 1.2)

    def slash(self, x0: float, x1: float, y: float) -> None:
        """An arrow across a spring or a damper that is not linear."""
        middle = 0.5 * (x0 + x1)
        self.axes.annotate(
            "", (middle + 0.55, y + 0.42), (middle - 0.55, y - 0.42),
            arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.1, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip

    def wall(self, x: float, low: float, high: float, side: int) -> None:
        """Ground, hatched on the side away from the system."""
        self.line([x, x], [low, high], INK, 1.2)
        y = low + 0.25
        while y <= high + 1e-9:
            self.line([x, x + 0.25 * side], [y, y - 0.25], MUTED, 0.8)
            y += 0.35

    def arrow(self, x0: float, x1: float, y: float, colour: str = MUTED) -> None:
        self.axes.annotate(
            "", (x1, y), (x0, y),
            arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.1, "shrinkA": 0,
                        "shrinkB": 0},
        )  # fmt: skip

    def line(self, xs: list[float], ys: list[float], colour: str, width: float) -> None:
        self.axes.plot(xs, ys, color=colour, lw=width, solid_joinstyle="round")

    def text(
        self,
        x: float,
        y: float,
        text: str,
        ha: str = "center",
        va: str = "bottom",
        size: float = _SIZE,
    ) -> None:
        self.axes.text(x, y, text, ha=ha, va=va, color=INK, size=size)
