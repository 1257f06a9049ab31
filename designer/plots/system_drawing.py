"""Any mechanical system as a picture: which spring, damper, clearance and force joins what.

The masses stand in a row from the ground at the left, by how many springs away from it they are.
What joins neighbours is drawn between them, what joins others below the row, clearances above it.
Displacements count to the right, so upper stops stand at the right.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, TypeVar

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from designer.base.figure_style import CONTACT, INK, MUTED, new_figure, styled
from designer.base.units import spaced_quantity
from designer.laws.element_keys import GROUND
from designer.laws.law_elements import CubicSpring, NonlinearElement
from designer.model.lumped_elements import Damper, Elements, Force, Gap, Mass, Spring, words_of
from designer.model.lumped_system import LumpedSystem
from designer.model.model import Dimensionless, Mechanical
from designer.model.relative_motion import subscripted
from designer.model.si_units import MECHANICAL_UNITS
from designer.plots.system_equations import (
    drive_terms,
    element_rows,
    ground_line,
    law_symbols,
    law_variable,
)

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


Joint = Spring | Damper | NonlinearElement
T = TypeVar("T", Spring, Damper)
NO_TEXTS: Mapping[str, str] = MappingProxyType({})
_WALL, _FIRST, _WIDTH, _PITCH = 0.9, 5.3, 2.6, 7.0
"""Abscissae of the wall and of the first mass, the width of a mass, and from one to the next."""
_ROW = 1.6
"""Height of one spring, damper or force between neighbours."""
_LANE, _DEEP = 3.0, 1.7
"""Height of a clearance above the row, and of a joint below it."""
_LINE = 0.8
"""Height of a line of text below it."""
_SHIFT = 0.35
"""Distance between the rods of clearances on one mass."""
_GAP, _STOP = 1.3, 2.3
"""From a rod to a plate, and length of a stop's spring."""


@styled
def system_drawing(model: LumpedSystem, *, si: bool) -> Figure:
    """The whole system with its values. si : whether they are SI values, shown with units."""
    values = {symbol: value for symbol, value, _ in element_rows(model, si=si)}
    return _Page(model, values).figure


@styled
def pair_drawing(model: Dimensionless | Mechanical | None = None) -> Figure:
    """The paper's two masses as a system, each part by the paper's symbol with its value.

    model : ``Dimensionless`` values are in units of M1, K1 and P1 + P2. None : every part, by its
    symbol alone.
    """
    plain = isinstance(model, Dimensionless)
    alike: dict[str, Any] = dict.fromkeys(_PAPER, 1.0)
    pair = Mechanical(**alike) if model is None else model
    if isinstance(pair, Dimensionless):
        pair = Mechanical.from_dimensionless(pair, M1=1.0, K1=1.0, force=1.0)
    sizes = {name: float(getattr(pair, name)) for name in _PAPER}

    def text(name: str) -> str:
        symbol = "b" if plain and name == "B" else subscripted(name)
        size = sizes[name]
        value = f"{size:.4g}" if plain else spaced_quantity(size, MECHANICAL_UNITS[name])
        return symbol if model is None else f"{symbol} = {value}"

    ends = ("M1", "M2"), ("M2", GROUND)
    upper, lower = (None if pair.sides == other else pair.B for other in ("lower", "upper"))
    stops = Gap("A", ("M1", GROUND), upper, lower, pair.K0) if pair.K0 else None
    elements = Elements(
        masses=(Mass("M1", pair.M1), Mass("M2", pair.M2)),
        springs=(Spring(ends[0], pair.K1), Spring(ends[1], pair.K2)),
        dampers=tuple(Damper(e, c) for e, c in zip(ends, (pair.C1, pair.C2), strict=True) if c),
        gaps=() if stops is None else (stops,),
        forces=tuple(Force(f"M{k}", p) for k, p in ((1, pair.P1), (2, pair.P2)) if p),
    )
    texts = {symbol: text(name) for name, symbol in _PAPER.items()}
    texts |= {name: texts[name].replace(" = ", "\n") for name in elements.names}
    texts |= {"A": "", "A.upper": texts["B"], "A.lower": texts["B"]}
    for number in "12":
        wave = subscripted(f"P{number}") + (" sin ωt" if plain else " sin ΩT")
        more = "" if model is None else f", {texts[f'P{number}']}"
        texts[f"force M{number}"] = wave + more
        texts[subscripted(f"x{number}")] = subscripted(f"{'x' if plain else 'X'}{number}")
    return _Page(elements, texts, texts).figure


_PAPER = {
    **{name: name for name in ("M1", "M2", "B", "P1", "P2")},
    "K1": "k₁",
    "K2": "k₂",
    "C1": "c₁",
    "C2": "c₂",
    "K0": "A.stiffness",
}
"""The paper's parameters, and what the drawing has their texts for."""


class _Page(MechanicalSheet):
    def __init__(
        self, model: Elements, values: Mapping[str, str], texts: Mapping[str, str] = NO_TEXTS
    ) -> None:
        """values : by symbol, as ``element_rows`` has them. texts : what is written instead of a
        mass's name and value, a joint's symbol and value, a force, a clearance's name."""
        self.model, self.values, self.texts = model, values, texts
        self.row = (GROUND, *model.row)
        self.between: list[list[str]] = [[] for _ in self.row]
        self.below: list[str] = []
        self.joints = self._joints()
        self.combinations = [
            f"{symbol}({law_variable(model, element)})"
            for symbol, element in self._laws()
            if element.between is None
        ]
        self.combinations += [f"{g.name}: {words_of(g)}" for g in model.gaps if g.between is None]
        self._sort()
        rows = max(len(slot) for slot in self.between)
        self.top = 0.6 + _ROW * max(rows, 2)
        self.gaps = [gap for gap in model.gaps if gap.between is not None]
        high = self.top + 0.6 + _LANE * len(self.gaps)
        width = _FIRST + _PITCH * (len(model.masses) - 1) + _WIDTH + 4.6
        low = _DEEP * len(self.below) + _LINE * len(self.combinations)
        self.floor = 0.5 - 1.1 - low if low else 0.0
        super().__init__(width, high, self.floor - 1.1)
        self._draw()

    def _joints(self) -> dict[str, Joint]:
        """What joins two bodies, clearances left out, by symbols."""
        springs: dict[str, Spring] = dict(self._numbered("k", self.model.shown_springs))
        dampers: dict[str, Damper] = dict(self._numbered("c", self.model.shown_dampers))
        return {**springs, **dampers, **{s: e for s, e in self._laws() if e.between is not None}}

    def _numbered(self, letter: str, joints: Sequence[T]) -> Iterator[tuple[str, T]]:
        """Springs or dampers by their symbols; those that make a matrix have none in the table, so
        that they are numbered in brackets."""
        form = f"{letter}{{}}" if self.model.matrices is None else f"({letter}{{}})"
        for i, joint in enumerate(joints, start=1):
            yield subscripted(form.format(i)), joint

    def _laws(self) -> list[tuple[str, NonlinearElement]]:
        elements = self.model.nonlinear
        return [(symbol, elements[name]) for name, symbol in law_symbols(self.model).items()]

    def _sort(self) -> None:
        """What stands between neighbours, at the right of each place of the row, and what below."""
        for symbol, joint in self.joints.items():
            left, right = self._ends(joint.between or ())
            (self.between[left] if right == left + 1 else self.below).append(symbol)
        for place, name in enumerate(self.row):
            forced = [f"force {name}"] if self._force(name) else []
            self.between[place] = forced + self.between[place]

    def _ends(self, between: Sequence[str]) -> tuple[int, int]:
        left, right = sorted(self.row.index(name) for name in between)
        return left, right

    def _force(self, name: str) -> str:
        """The forces on a mass as text."""
        if f"force {name}" in self.texts:
            on = [force.on for force in self.model.forces]
            return self.texts[f"force {name}"] if name in on else ""
        terms = []
        for i, force in enumerate(self.model.forces, start=1):
            constant = subscripted(f"G{i}")
            if force.on == name:
                # Phases and harmonics are in the table alone: there is no room for them.
                first = replace(force, harmonics=())
                terms += drive_terms(first, i, self._amplitude)
                terms += ["…"] if force.harmonics else []
            if force.on == name and constant in self.values:
                terms.append(self.values[constant])
        return " + ".join(terms).replace("+ -", "− ").replace("-", "−")

    def _amplitude(self, symbol: str, _value: float) -> str:
        return symbol if symbol.startswith("φ") else self.values[symbol]

    def _left(self, place: int) -> float:
        return _FIRST + _PITCH * (place - 1) if place else _WALL - _WIDTH

    def _middle(self, place: int) -> float:
        return self._left(place) + 0.5 * _WIDTH if place else _WALL

    def _draw(self) -> None:
        self.wall(_WALL, self.floor, self.top, -1)
        self._ground()
        for place in range(1, len(self.row)):
            self._mass(place)
        for place, symbols in enumerate(self.between):
            for number, symbol in enumerate(symbols):
                self._neighbours(place, self.top - 0.9 - _ROW * number, symbol)
        for number, symbol in enumerate(self.below):
            self._under(-1.5 - _DEEP * number, symbol)
        for number, symbol in enumerate(self.combinations):
            y = -1.2 - _DEEP * len(self.below) - _LINE * number
            self.text(_WALL + 0.4, y, symbol, "left")
        for number, gap in enumerate(self.gaps):
            self._clearance(self.top + 1.3 + _LANE * number, gap, self._shift(number))

    def _ground(self) -> None:
        base = self.model.base
        if base is None:
            return
        self.arrow(_WALL - 0.1, _WALL + 1.2, self.floor - 0.35)
        stay = ", the stops stay" if base.stops == "fixed" and self.model.gaps else ""
        # Harmonics are in the table alone, as those of forces are.
        line = ground_line(replace(base, harmonics=()), self._amplitude)
        more = " + …" if base.harmonics else ""
        self.text(_WALL - 0.4, self.floor - 0.95, f"{line}{more}{stay}", "left")

    def _mass(self, place: int) -> None:
        left, name = self._left(place), self.row[place]
        number = self.model.names.index(name) + 1
        self.box(left, left + _WIDTH, 0.0, self.top)
        entry = f"m{number}" if self.model.matrices is None else f"m{number}{number}"
        text = self.texts.get(name, f"{name}\n{self.values.get(subscripted(entry), '')}")
        self.text(left + 0.5 * _WIDTH, 0.5 * self.top, text, va="center", size=9.5)
        x = left + 0.5 * _WIDTH
        self.line([x, x], [0.0, -0.55], MUTED, 0.8)
        self.arrow(x, x + 0.9, -0.4)
        symbol = subscripted(f"x{number}")
        self.text(x + 1.05, -0.4, self.texts.get(symbol, symbol), "left", "center")

    def _neighbours(self, place: int, y: float, symbol: str) -> None:
        """A spring, a damper or a force at the right of a place of the row."""
        x0, x1 = self._left(place) + _WIDTH, self._left(place + 1)
        if symbol.startswith("force "):
            self.arrow(x0, x0 + 1.5, y, INK)
            self.text(x0 + 0.15, y + 0.12, self._force(symbol.removeprefix("force ")), "left")
            return
        self._joint(x0, x1, y, symbol)

    def _joint(self, x0: float, x1: float, y: float, symbol: str) -> None:
        joint = self.joints[symbol]
        if isinstance(joint, NonlinearElement):
            drawn = joint.drawn
        else:
            drawn = "spring" if isinstance(joint, Spring) else "damper"
        draw = {"spring": self.spring, "damper": self.damper, "friction": self.friction}[drawn]
        draw(x0, x1, y)
        if isinstance(joint, NonlinearElement) and drawn != "friction":
            self.slash(x0, x1, y)
        self.text(0.5 * (x0 + x1), y + 0.4, self._label(symbol, joint))

    def _label(self, symbol: str, joint: Joint) -> str:
        if symbol in self.texts:
            return self.texts[symbol]
        if isinstance(joint, CubicSpring):
            linear = f"{self.values[f'{symbol}.k1']} x, " if joint.k1 else ""
            return f"{symbol}: {linear}{self.values[f'{symbol}.k3']} x³"
        if isinstance(joint, NonlinearElement):
            first = next(iter(joint.PARAMETERS), None)
            value = self.values.get(f"{symbol}.{first}")
            return symbol if value is None else f"{symbol}: {value}"
        size = joint.stiffness if isinstance(joint, Spring) else joint.damping
        return f"{symbol} = {self.values.get(symbol, f'{size:.4g}'.replace('-', '−'))}"

    def _under(self, y: float, symbol: str) -> None:
        """A joint of what are no neighbours, below the row."""
        left, right = self._ends(self.joints[symbol].between or ())
        x0 = self._middle(left) + (0.3 * _WIDTH if left else 0.0)
        x1 = self._middle(right) - 0.3 * _WIDTH
        for x, place in ((x0, left), (x1, right)):
            if place:
                self.line([x, x], [0.0, y], INK, 1.2)
        self._joint(x0, x1, y, symbol)

    def _shift(self, number: int) -> float:
        """Distance of a clearance's rod from the middle of its mass, where that carries several."""
        return 0.0 if self._alone(self.gaps[number]) else _SHIFT * (number % 3 - 1)

    def _alone(self, gap: Gap) -> bool:
        """Whether no other clearance has a mass of this one."""
        masses = set(gap.factors) - {GROUND}
        return sum(not masses.isdisjoint(other.factors) for other in self.gaps) == 1

    def _clearance(self, y: float, gap: Gap, shift: float) -> None:
        """A rod on the mass between plates on springs, which stand on ground or on the other."""
        assert gap.between is not None
        mass, other = gap.between if gap.between[0] != GROUND else gap.between[::-1]
        middle = self._middle(self.row.index(mass))
        rod = middle + shift
        self.line([rod, rod], [self.top, y + 0.6], INK, 2.0)
        name = self.texts.get(gap.name, gap.name)
        if self._alone(gap):
            self.text(rod, y + 0.95, name, size=9.5)
        else:  # beside the rods, which go on to the lanes above
            self.text(middle - _SHIFT - 0.2, y + 0.95, name, "right", size=9.5)
        ends = []
        sides = ((1, gap.upper, "upper"), (-1, gap.lower, "lower"))
        turned = -1 if gap.between[0] == GROUND else 1
        for sign, place, word in sides:
            if place is not None:
                ends.append(self._stop(rod, y, turned * sign, gap, word))
        if other != GROUND:
            self._bracket(y, ends, self._middle(self.row.index(other)) + shift)
            return
        for side, end in ends:
            self.wall(end, y - 0.7, y + 0.7, side)

    def _stop(self, rod: float, y: float, side: int, gap: Gap, word: str) -> tuple[int, float]:
        """A plate on its spring; its side, and where the spring ends."""
        plate = rod + side * _GAP
        end = plate + side * _STOP
        self.line([plate, plate], [y - 0.4, y + 0.4], INK, 2.0)
        self.spring(plate, end, y)
        side_stiffness = self.values.get(f"{gap.name}.{word}_stiffness")
        stiffness = side_stiffness or self.values.get(f"{gap.name}.stiffness", "Hertz")
        preload = self.values.get(f"{gap.name}.preload")
        text = stiffness if preload is None else f"{stiffness}, preload {preload}"
        self.text(0.5 * (plate + end), y - (1.2 if self.texts else 0.95), text)
        place = self.values[f"{gap.name}.{word}"].replace("-", "−")
        self.text(plate, y + 0.5, place, "left" if side > 0 else "right")
        return side, end

    def _bracket(self, y: float, ends: Sequence[tuple[int, float]], x: float) -> None:
        """The springs' ends joined over the lane, and down to the other mass."""
        high = y + 1.5
        for _, end in ends:
            self.line([end, end], [y, high], INK, 1.2)
        spans = [end for _, end in ends]
        self.line([min(*spans, x), max(*spans, x)], [high, high], INK, 1.2)
        self.line([x, x], [self.top, high], INK, 1.2)
