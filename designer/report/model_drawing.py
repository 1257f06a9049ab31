"""The mechanical model as a picture: which spring, damper and stop joins what."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from designer.base.figure_style import CONTACT, INK, MUTED, new_figure, styled
from designer.model.model import Dimensionless, Mechanical
from designer.model.si_units import MECHANICAL_UNITS
from designer.report import words

_SUBSCRIPTS = str.maketrans("012", "₀₁₂")

WIDTH, HEIGHT = 18.5, 7.0
"""Of the drawing, in its own units."""
INCH = 0.4
"""Of one such unit."""
_GROUND = (0.6, 0.6, 4.0)
"""Abscissa of the wall at the left, and the ordinates of its ends."""
_M2, _M1 = (5.0, 7.4), (11.8, 14.2)
"""Left and right side of each mass."""
_BOTTOM, _TOP = 0.8, 3.6
"""Of both masses."""
_SPRING, _DAMPER, _FORCE, _STOP = 3.0, 1.4, 1.95, 5.1
"""Ordinates of springs, dampers, forces and stops."""
_GAP, _STOP_LENGTH = 1.3, 3.1
_SIZE = 8.5


@styled
def model_drawing(model: Dimensionless | Mechanical | None = None) -> Figure:
    """Two masses in a row from ground, the stops of M1, the forces.

    model : its values stand beside the names, and what it does not have is left out: a damper, a
    force, a stop. ``Dimensionless`` values are in units of M1, K1 and P1 + P2. None : every part,
    by its name alone. Displacements count to the right, so the upper stop stands at the right.
    """
    page = _Page(model)
    return page.figure


class _Page:
    def __init__(self, model: Dimensionless | Mechanical | None) -> None:
        self.figure = new_figure(WIDTH * INCH, HEIGHT * INCH)
        self.figure.set_layout_engine("none")
        self.axes: Axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self.axes.set_axis_off()
        self.axes.set_xlim(0.0, WIDTH)
        self.axes.set_ylim(0.0, HEIGHT)
        self.plain = isinstance(model, Dimensionless)
        self.units = isinstance(model, Mechanical)
        if isinstance(model, Dimensionless):
            model = Mechanical.from_dimensionless(model, M1=1.0, K1=1.0, force=1.0)
        self.model = model
        self.draw()

    def draw(self) -> None:
        x, low, high = _GROUND
        self.wall(x, low, high, -1)
        self.link(x, _M2[0], "K2", "C2")
        self.link(_M2[1], _M1[0], "K1", "C1")
        self.mass("M2", _M2, "2")
        self.mass("M1", _M1, "1")
        self.force("P2", _M2[1])
        self.force("P1", _M1[1])
        if self.there("K0"):
            self.stops()

    def there(self, name: str) -> bool:
        return self.model is None or getattr(self.model, name) > 0.0

    def label(self, name: str, join: str = " = ") -> str:
        """The name, and the value where there is one."""
        shown = name.lower() if self.plain and name == "B" else name
        shown = shown.translate(_SUBSCRIPTS)
        if self.model is None:
            return shown
        value = getattr(self.model, name)
        text = words.quantity(value, MECHANICAL_UNITS[name]) if self.units else words.number(value)
        return f"{shown}{join}{text}"

    def link(self, x0: float, x1: float, spring: str, damper: str) -> None:
        middle = 0.5 * (x0 + x1)
        self.spring(x0, x1, _SPRING)
        self.text(middle, _SPRING + 0.45, self.label(spring))
        if self.there(damper):
            self.damper(x0, x1, _DAMPER)
            self.text(middle, _DAMPER - 0.8, self.label(damper))

    def mass(self, name: str, sides: tuple[float, float], number: str) -> None:
        left, right = sides
        middle = 0.5 * (left + right)
        box = Rectangle((left, _BOTTOM), right - left, _TOP - _BOTTOM, fc=CONTACT, ec=INK, lw=1.2)
        self.axes.add_patch(box)
        self.text(middle, 2.2, self.label(name, "\n"), size=9.5, va="center")
        self.line([middle, middle], [_BOTTOM, 0.25], MUTED, 0.8)
        self.arrow(middle, middle + 0.9, 0.4)
        symbol = "x" if self.plain else "X"
        self.text(middle + 1.05, 0.4, f"{symbol}{number}".translate(_SUBSCRIPTS), "left", "center")

    def force(self, name: str, x: float) -> None:
        if not self.there(name):
            return
        phase = "ωt" if self.plain else "ΩT"
        self.arrow(x, x + 1.5, _FORCE, INK)
        wave = f"{name.translate(_SUBSCRIPTS)} sin {phase}"
        value = "" if self.model is None else f", {self.label(name)}"
        self.text(x + 0.15, _FORCE + 0.12, wave + value, "left")

    def stops(self) -> None:
        """A rod on M1 between plates on springs, at the distance B."""
        sides = "both" if self.model is None else self.model.sides
        middle = 0.5 * (_M1[0] + _M1[1])
        self.line([middle, middle], [_TOP, _STOP + 0.6], INK, 2.0)
        for side, name in ((1, "upper"), (-1, "lower")):
            if sides not in ("both", name):
                continue
            plate = middle + side * _GAP
            end = plate + side * _STOP_LENGTH
            self.line([plate, plate], [_STOP - 0.4, _STOP + 0.4], INK, 2.0)
            self.spring(plate, end, _STOP)
            self.wall(end, _STOP - 0.7, _STOP + 0.7, side)
            self.text(0.5 * (plate + end), _STOP - 0.85, self.label("K0"))
            self.gap(middle, plate, self.label("B"), "left" if side > 0 else "right")

    def gap(self, x0: float, x1: float, text: str, align: str) -> None:
        height = _STOP + 0.85
        self.line([x1, x1], [_STOP + 0.4, height + 0.2], MUTED, 0.6)
        self.line([x0, x0], [_STOP + 0.6, height + 0.2], MUTED, 0.6)
        self.axes.annotate(
            "", (x1, height), (x0, height),
            arrowprops={"arrowstyle": "<->", "color": MUTED, "lw": 0.8, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip
        side = 1.0 if align == "left" else -1.0
        self.text(x0 + 0.15 * side, height + 0.25, text, align)

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
