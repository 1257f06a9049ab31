"""The mechanical model as a picture: which spring, damper and stop joins what."""

from __future__ import annotations

from matplotlib.figure import Figure

from designer.base.figure_style import INK, MUTED, styled
from designer.base.units import spaced_quantity
from designer.model.model import Dimensionless, Mechanical
from designer.model.si_units import MECHANICAL_UNITS
from designer.plots.mechanical_symbols import MechanicalSheet

_SUBSCRIPTS = str.maketrans("012", "₀₁₂")

WIDTH, HEIGHT = 18.5, 7.0
"""Of the drawing, in its own units."""
_GROUND = (0.6, 0.6, 4.0)
"""Abscissa of the wall at the left, and the ordinates of its ends."""
_M2, _M1 = (5.0, 7.4), (11.8, 14.2)
"""Left and right side of each mass."""
_BOTTOM, _TOP = 0.8, 3.6
"""Of both masses."""
_SPRING, _DAMPER, _FORCE, _STOP = 3.0, 1.4, 1.95, 5.1
"""Ordinates of springs, dampers, forces and stops."""
_GAP, _STOP_LENGTH = 1.3, 3.1


@styled
def model_drawing(model: Dimensionless | Mechanical | None = None) -> Figure:
    """Two masses in a row from ground, the stops of M1, the forces.

    model : its values stand beside the names, and what it does not have is left out: a damper, a
    force, a stop. ``Dimensionless`` values are in units of M1, K1 and P1 + P2. None : every part,
    by its name alone. Displacements count to the right, so the upper stop stands at the right.
    """
    page = _Page(model)
    return page.figure


class _Page(MechanicalSheet):
    def __init__(self, model: Dimensionless | Mechanical | None) -> None:
        super().__init__(WIDTH, HEIGHT)
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
        symbol = name.lower() if self.plain and name == "B" else name
        symbol = symbol.translate(_SUBSCRIPTS)
        if self.model is None:
            return symbol
        value = getattr(self.model, name)
        text = spaced_quantity(value, MECHANICAL_UNITS[name]) if self.units else f"{value:.4g}"
        return f"{symbol}{join}{text}"

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
        self.box(left, right, _BOTTOM, _TOP)
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
