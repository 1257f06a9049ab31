"""Symbols of our own for the sheet: shapes with pins, in units of ``GRID``.

The same shapes make the symbols inside the sheet and the project's library, which KiCad compares.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from designer.board.kicad_names import HEAD, SYMBOLS_VERSION
from designer.board.sexpr import Contents, Expression, expression, lists, word

GRID = 1.27
"""Millimetres a unit: KiCad's usual grid is two of it."""
TEXT = 1.27
"""Height of texts [mm]."""
PART_ROW = 8
"""Units between rows of parts; at a connector, rows of signals with a pin of ground between."""
REACH = 3
"""Units from the centre of a part of two pins to either pin."""


@dataclass(frozen=True)
class ShapePin:
    """A pin of a symbol."""

    number: str
    name: str
    electrical: str
    """Its electrical type, in KiCad's words."""
    x: int
    """Where a wire meets the pin, to the right, in units of the grid."""
    y: int
    """Where a wire meets the pin, upwards, in units of the grid."""
    angle: int
    """Direction from there to the body [degrees]."""
    length: int
    """Length of the pin, in units of the grid."""


@dataclass(frozen=True)
class SymbolUnit:
    """One of the drawings that a symbol consists of."""

    pins: tuple[ShapePin, ...]
    lines: tuple[tuple[tuple[float, float], ...], ...]
    """Polylines of points (x, y)."""
    filled: bool = True
    """Whether the drawing is filled."""


@dataclass(frozen=True)
class SymbolShape:
    """A symbol."""

    name: str
    prefix: str
    """What its designators begin with."""
    units: tuple[SymbolUnit, ...]
    """Drawings of the symbol, one for each unit."""
    texts: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 1.9), (0.0, -1.9))
    """Where reference and value stand, (x, y) with y upwards."""
    power: bool = False
    """Whether it names its net."""
    names: bool = False
    """Whether pins show their names."""
    numbers: bool = False
    """Whether pins show their numbers."""

    def pin(self, number: str) -> tuple[int, ShapePin]:
        """The unit (from 1) and the pin of this number."""
        for index, unit in enumerate(self.units, start=1):
            for pin in unit.pins:
                if pin.number == number:
                    return index, pin
        raise KeyError(number)


def two_pins(
    name: str,
    prefix: str,
    left: tuple[str, str],
    right: tuple[str, str],
    lines: Sequence[Sequence[tuple[float, float]]],
    body: float,
) -> SymbolShape:
    """A part of two pins in a row; left, right : number and name. body : its half length."""
    length = REACH - int(body)
    inner = [((-float(REACH - length), 0.0), (-body, 0.0)), ((body, 0.0), (REACH - length, 0.0))]
    strokes = [tuple(line) for line in lines] + [p for p in inner if p[0] != p[1]]
    pins = (
        ShapePin(*left, "passive", -REACH, 0, 0, length),
        ShapePin(*right, "passive", REACH, 0, 180, length),
    )
    return SymbolShape(name, prefix, (SymbolUnit(pins, tuple(strokes), filled=False),))


def resistor() -> SymbolShape:
    box = ((-2.0, -0.8), (2.0, -0.8), (2.0, 0.8), (-2.0, 0.8), (-2.0, -0.8))
    return two_pins("R", "R", ("1", "1"), ("2", "2"), [box], 2.0)


def capacitor() -> SymbolShape:
    plates = [((-0.4, -1.1), (-0.4, 1.1)), ((0.4, -1.1), (0.4, 1.1))]
    return two_pins("C", "C", ("1", "+"), ("2", "-"), plates, 0.4)


def diode(
    name: str,
    anode: str,
    cathode: str,
    *,
    prefix: str = "D",
    zener: bool = False,
    free: Sequence[tuple[str, str]] = (),
) -> SymbolShape:
    """anode, cathode : pin numbers. The anode is on the left.

    free : number and name of each pin of the case that stays open, below.
    """
    bar = [(1.0, -1.0), (1.0, 1.0)]
    if zener:
        bar = [(0.5, -1.3), (1.0, -1.0), (1.0, 1.0), (1.5, 1.3)]
    triangle = ((-1.0, -1.0), (-1.0, 1.0), (1.0, 0.0), (-1.0, -1.0))
    shape = two_pins(name, prefix, (anode, "A"), (cathode, "K"), [triangle, tuple(bar)], 1.0)
    if not free:
        return shape
    first = -(len(free) - 1)
    pins = [ShapePin(*pin, "no_connect", first + 2 * i, -3, 90, 2) for i, pin in enumerate(free)]
    unit = replace(shape.units[0], pins=(*shape.units[0].pins, *pins))
    return replace(shape, units=(unit,), texts=((0.0, 1.9), (0.0, -4.2)))


def source(name: str) -> SymbolShape:
    """A source that only the simulation has; its first pin is positive and on the left."""
    turns = (math.pi * k / 8.0 for k in range(17))
    circle = tuple((2.0 * round(math.cos(a), 3), 2.0 * round(math.sin(a), 3)) for a in turns)
    plus = [((-1.5, 0.0), (-0.7, 0.0)), ((-1.1, -0.4), (-1.1, 0.4)), ((0.7, -0.4), (0.7, 0.4))]
    shape = two_pins(name, "V", ("1", "+"), ("2", "-"), [circle, *plus], 2.0)
    return replace(shape, texts=((0.0, 2.8), (0.0, -2.8)))


def row(
    name: str, prefix: str, pins: Sequence[tuple[str, str, str]], pitch: int = 3
) -> SymbolShape:
    """A box with its pins below one another on the left: (number, name, electrical type)."""
    width = 5.0 if any(n != p for n, p, _ in pins) else 2.0
    placed = tuple(
        ShapePin(number, text, kind, -REACH, -pitch * i, 0, 2)
        for i, (number, text, kind) in enumerate(pins)
    )
    low = -float(pitch) * (len(pins) - 1) - 1.5
    box = ((-1.0, 1.5), (width, 1.5), (width, low), (-1.0, low), (-1.0, 1.5))
    texts = ((0.0, 2.6), (0.0, low - 1.1))
    return SymbolShape(
        name, prefix, (SymbolUnit(placed, (box,)),), texts, names=width > 2.0, numbers=True
    )


def coaxial_jack(name: str, signal: str, shell: str) -> SymbolShape:
    """A jack with its two pins below one another on the left; signal, shell : pin numbers."""
    turns = (math.pi * k / 8.0 for k in range(17))
    ring = tuple((1.0 + 1.6 * round(math.cos(a), 3), 1.6 * round(math.sin(a), 3)) for a in turns)
    inner = ((-1.0, 0.0), (1.0, 0.0))
    outer = ((-1.0, -4.0), (1.0, -4.0), (1.0, -1.6))
    pins = (
        ShapePin(signal, "signal", "passive", -REACH, 0, 0, 2),
        ShapePin(shell, "shell", "passive", -REACH, -4, 0, 2),
    )
    unit = SymbolUnit(pins, (ring, inner, outer), filled=False)
    return SymbolShape(name, "J", (unit,), ((4.8, 1.0), (7.6, -1.0)), numbers=True)


def probe_pad() -> SymbolShape:
    ring = ((0.0, 0.0), (0.0, 1.0), (-0.6, 1.6), (0.0, 2.2), (0.6, 1.6), (0.0, 1.0))
    pin = ShapePin("1", "1", "passive", 0, 0, 90, 0)
    return SymbolShape(
        "TestPoint", "TP", (SymbolUnit((pin,), (ring,), False),), ((2.6, 1.4), (2.6, 0.0))
    )


INVERTING, NONINVERTING, OUTPUT = (-6, 2), (-6, -2), (6, 0)
"""Where the pins of a section are."""


def opamp(
    name: str, sections: Sequence[tuple[str, str, str]], supply: tuple[str, str]
) -> SymbolShape:
    """An op-amp package: pin numbers (inverting, noninverting, output) of each section in order,
    then of the positive and the negative supply, which are the last unit."""
    triangle = ((-4.0, -4.0), (-4.0, 4.0), (4.0, 0.0), (-4.0, -4.0))
    minus, plus = ((-3.4, 2.0), (-2.4, 2.0)), ((-3.4, -2.0), (-2.4, -2.0))
    upright = ((-2.9, -2.5), (-2.9, -1.5))
    units = [
        SymbolUnit(
            (
                ShapePin(n_inverting, "-", "input", *INVERTING, 0, 2),
                ShapePin(n_noninverting, "+", "input", *NONINVERTING, 0, 2),
                ShapePin(n_output, "OUT", "output", *OUTPUT, 180, 2),
            ),
            (triangle, minus, plus, upright),
        )
        for n_inverting, n_noninverting, n_output in sections
    ]
    box = ((-1.5, 2.0), (1.5, 2.0), (1.5, -2.0), (-1.5, -2.0), (-1.5, 2.0))
    units.append(
        SymbolUnit(
            (
                ShapePin(supply[0], "V+", "power_in", 0, 4, 270, 2),
                ShapePin(supply[1], "V-", "power_in", 0, -4, 90, 2),
            ),
            (box,),
        )
    )
    return SymbolShape(name, "U", tuple(units), ((1.0, 4.6), (1.0, -4.6)), numbers=True)


def power(net: str) -> SymbolShape:
    """A power symbol: ground points down, VEE down, any other up."""
    down = net in ("GND", "VEE")
    sign = -1.0 if down else 1.0
    if net == "GND":
        lines: tuple[tuple[tuple[float, float], ...], ...] = (
            ((0.0, 0.0), (0.0, -0.8)),
            ((-1.0, -0.8), (1.0, -0.8), (0.0, -1.8), (-1.0, -0.8)),
        )
    else:
        lines = (((0.0, 0.0), (0.0, sign)), ((-0.7, sign), (0.7, sign)))
    pin = ShapePin("1", net, "power_in", 0, 0, 270 if down else 90, 0)
    texts = ((0.0, -3.0), (0.0, sign * (2.6 if net == "GND" else 2.0)))
    return SymbolShape(net, "#PWR", (SymbolUnit((pin,), lines, False),), texts, power=True)


def flag() -> SymbolShape:
    """Tells the electrical rule check that a net is fed from outside."""
    lines = (
        ((0.0, 0.0), (0.0, 1.0)),
        ((-1.0, 1.6), (0.0, 1.0), (1.0, 1.6), (0.0, 2.2), (-1.0, 1.6)),
    )
    pin = ShapePin("1", "pwr", "power_out", 0, 0, 90, 0)
    texts = ((0.0, 4.0), (0.0, 3.0))
    return SymbolShape("PWR_FLAG", "#FLG", (SymbolUnit((pin,), lines, False),), texts, power=True)


def library(shapes: Iterable[SymbolShape]) -> Expression:
    """The project's symbol library."""
    return expression(
        "kicad_symbol_lib",
        *lists(version=SYMBOLS_VERSION, **HEAD),
        *(symbol(shape, shape.name) for shape in shapes),
    )


def symbol(shape: SymbolShape, name: str) -> Expression:
    """The definition of a symbol; its name has the library's before it inside a sheet."""
    hidden = {"hide": True}
    return expression(
        "symbol",
        name,
        *lists(
            power=() if shape.power else None,
            pin_numbers=None if shape.numbers else hidden,
            pin_names={"offset": 0.5, **({} if shape.names else hidden)},
            exclude_from_sim=False,
            in_bom=not shape.power,
            on_board=not shape.power,
        ),
        *_properties(shape),
        *(
            expression(
                "symbol",
                f"{shape.name}_{number}_1",
                *(_line(line, unit.filled) for line in unit.lines),
                *(_pin(pin) for pin in unit.pins),
            )
            for number, unit in enumerate(shape.units, start=1)
        ),
        *lists(embedded_fonts=False),
    )


def _properties(shape: SymbolShape) -> Iterator[Expression]:
    (rx, ry), (vx, vy) = shape.texts
    texts = {
        "Reference": (shape.prefix, rx, ry, shape.power),
        "Value": (shape.name, vx, vy, False),
        "Footprint": ("", 0.0, 0.0, True),
        "Datasheet": ("", 0.0, 0.0, True),
        "Description": ("", 0.0, 0.0, True),
    }
    for key, (text, x, y, hide) in texts.items():
        yield expression("property", key, text, at=position(x, y), effects=effects(hide=hide))


def position(x: float, y: float, angle: int = 0) -> tuple[float, ...]:
    """The list ``at`` from units, as they stand: no axis is turned round."""
    return x * GRID, y * GRID, angle


def effects(*justify: str, hide: bool = False, size: float = TEXT) -> dict[str, Contents]:
    """How a text looks."""
    return {
        "font": {"size": (size, size)},
        "justify": tuple(map(word, justify)) or None,
        "hide": True if hide else None,
    }


def points(line: Iterable[tuple[float, float]]) -> tuple[Expression, ...]:
    return tuple(expression("xy", x * GRID, y * GRID) for x, y in line)


def _line(line: Sequence[tuple[float, float]], filled: bool) -> Expression:
    closed = filled and len(line) > 3 and line[0] == line[-1]
    return expression(
        "polyline",
        pts=points(line),
        stroke={"width": 0.2, "type": word("default")},
        fill={"type": word("background" if closed else "none")},
    )


def _pin(pin: ShapePin) -> Expression:
    return expression(
        "pin",
        word(pin.electrical),
        word("line"),
        at=position(pin.x, pin.y, pin.angle),
        length=pin.length * GRID,
        name=(pin.name, expression("effects", **effects())),
        number=(pin.number, expression("effects", **effects())),
    )
