"""The schematic on one page: one stage a cell, signal from left to right, values and roles.

Drawn from the circuit's parts alone. Nets join cells by name, as labels do on a sheet. Text of a
model file enters through the title only, and is escaped.
"""

from __future__ import annotations

import html
import re
from typing import Any, Literal, cast

import schemdraw
import schemdraw.elements as elm

from designer.base.units import format_quantity
from designer.board.component import Numbers, designator
from designer.circuit.netlist import (
    Capacitor,
    Circuit,
    Diode,
    Reference,
    Resistor,
    SupplyCapacitor,
    SupplyDiode,
)
from designer.schematic.drawing_cells import (
    Amplifier,
    Cell,
    CellRows,
    Chain,
    TwoPin,
    board_cells,
    circuit_cells,
    role_lines,
    shown_net,
)

_SYMBOLS: dict[type, Any] = {
    Resistor: elm.ResistorIEEE,
    Capacitor: elm.Capacitor,
    SupplyCapacitor: elm.Capacitor,
    Reference: elm.Zener,
    Diode: elm.Diode,
    SupplyDiode: elm.Schottky,
}

Canvas = Literal["svg", "matplotlib"]
Align = Literal["left", "center", "right"]

ROW, LINE, PART, LABEL = 1.9, 0.7, 3.6, 1.3
"""Heights and widths in schemdraw's units, half an inch each: of a row, a line of text, a part, a
net's name."""
GAP, TITLE = 1.4, 1.3
"""Distance between cells, and height of a cell's title."""
NAME_SIZE, ROLE_SIZE, TITLE_SIZE = 10, 6.5, 11
ROLE_WIDTH = 30
"""Characters of a role's line."""
FAINT = "#5c5c5c"
CLEAR = 0.6
"""Distance between the lowest feedback's role and the op-amp."""
OPAMP = 2.17
"""Length of the op-amp's symbol."""
_TAG, _DIGITS = re.compile(r"<[^>]*>"), re.compile(r"-?\d+\.\d{4,}")
_LIKE = str.maketrans({"&": "+", "<": "‹", ">": "›", "$": "S"})
IN2 = 1.25
"""How far its lower input is below the upper one."""


def svg(circuit: Circuit, title: str = "", numbers: Numbers | None = None) -> str:
    """The drawing as SVG text: equal circuits, titles and numbers give equal bytes.

    numbers : of the op-amps' pins, shown where they are given.
    """
    page = _Page("svg", numbers=numbers)
    page.draw(circuit, title)
    text: str = page.drawing.get_imagedata("svg").decode("utf-8")
    return _TAG.sub(lambda tag: _DIGITS.sub(lambda n: f"{float(n[0]):.3f}", tag[0]), text)


def png(circuit: Circuit, title: str = "", dpi: int = 72, numbers: Numbers | None = None) -> bytes:
    """The drawing as PNG."""
    from matplotlib import pyplot  # matplotlib is needed for this alone
    from schemdraw.backends import mpl

    from designer.base.figure_style import style

    with style():
        page = _Page("matplotlib", dpi, numbers)
        page.draw(circuit, title)
        picture = page.drawing.get_imagedata("png")
    # schemdraw takes its figure from pyplot, which keeps every figure until it is closed.
    pyplot.close(cast(mpl.Figure, page.drawing.fig).fig)
    return picture


class _Page:
    def __init__(self, canvas: Canvas, dpi: int = 72, numbers: Numbers | None = None) -> None:
        self.canvas = canvas
        self.numbers: Numbers = {} if numbers is None else numbers
        self.drawing = schemdraw.Drawing(canvas=canvas, show=False, dpi=dpi)
        self.drawing.config(
            font="sans-serif", fontsize=NAME_SIZE, lw=1.0, margin=0.5, bgcolor="white"
        )

    def draw(self, circuit: Circuit, title: str) -> None:
        x, y = 0.0, 0.0
        if title:
            self.text(x, y, " ".join(title.split())[:120], 15)
            y -= 1.2
        generator = " and ".join(circuit.generator_nets)
        limits = f"rails ± {circuit.supply:g} V, {circuit.opamp}, generator at {generator}"
        self.text(x, y, limits, TITLE_SIZE, FAINT)
        y -= 1.6
        for row in (*circuit_cells(circuit), board_cells(circuit, self.numbers)):
            tall = 0.0
            x = 0.0
            for cell in row:
                width, height = self.cell(x, y, cell)
                x += width + GAP
                tall = max(tall, height)
            y -= tall + GAP if row else 0.0

    def cell(self, x: float, y: float, cell: Cell) -> tuple[float, float]:
        """Draw a cell below and right of (x, y); returns its width and height."""
        self.text(x, y - 0.4, cell.title, TITLE_SIZE)
        if isinstance(cell, Amplifier):
            width, height = self.amplifier(x, y - TITLE, cell)
        else:
            width, height = self.rows(x, y - TITLE, cell)
        return max(width, 0.21 * len(cell.title)), height + TITLE

    def amplifier(self, x: float, y: float, cell: Amplifier) -> tuple[float, float]:
        """Feedback on top, inputs at the left from the height of the inverting input down."""
        section = cell.section
        wide = max((len(c.parts) for c in cell.inputs), default=1)
        back = max((len(c.parts) for c in cell.feedback), default=1)
        node = x + LABEL + wide * PART
        tip = node + max(1.0 + OPAMP + 0.5, back * PART)
        top = y - ROW * len(cell.feedback) - CLEAR
        after = tip if cell.series is None else tip + PART * len(cell.series.parts)
        for i, chain in enumerate(cell.inputs):
            self.net_name(x + LABEL - 0.15, top - i * ROW, shown_net(chain.start), "left")
            self.chain(x + LABEL, top - i * ROW, node, chain)
        low = top - ROW * max(len(cell.inputs) - 1, 0)
        highest = y - 0.5 * ROW if cell.feedback else top
        self.line(node, highest, node, low)
        self.dot(node, top)
        symbol = elm.Opamp(leads=False).theta(0).anchor("in1").at((node + 1.0, top))
        self.drawing += symbol
        self.line(node, top, node + 1.0, top)
        self.line(node + 0.6, top - IN2, node + 1.0, top - IN2)
        self.drawing += elm.Ground().theta(0).at((node + 0.6, top - IN2)).scale(0.7)
        out = top - IN2 / 2.0
        self.line(node + 1.0 + OPAMP, out, tip, out)
        pads = self.numbers.get(section.name, {})
        before, behind = node + 0.85, node + 1.05 + OPAMP
        self.text(before, top, pads.get("-", ""), ROLE_SIZE, FAINT, "right")
        self.text(before, top - IN2, pads.get("+", ""), ROLE_SIZE, FAINT, "right")
        self.text(behind, out, pads.get("OUT", ""), ROLE_SIZE, FAINT)
        over: dict[str, list[float]] = {}
        for i, chain in enumerate(cell.feedback):
            height = y - (i + 0.5) * ROW
            end = tip if chain.start == section.output else after
            self.chain(node, height, end, chain.turned)
            over.setdefault(chain.start, []).append(height)
        for net, heights in over.items():
            end = tip if net == section.output else after
            self.line(end, max(heights), end, out)
        net = section.output
        if cell.series is not None:
            self.chain(tip, out, after, cell.series)
            net = cell.series.end
            self.text(tip - 0.1, out - 0.35, section.output, ROLE_SIZE + 1, FAINT, "right")
        bottom = min(low, top - IN2 - 0.9)
        if cell.shunts:
            length = 2.4
            self.line(after, out, after, out - 0.3)
            for i, chain in enumerate(cell.shunts):
                at = after + i * 1.6
                self.line(after, out - 0.3, at, out - 0.3)
                self.hanging(at, out - 0.3, length, chain)
            bottom = min(bottom, out - 0.3 - length - 0.9)
        self.dot(after, out)
        self.line(after, out, after + 0.5, out)
        self.net_name(after + 0.6, out, net, "right")
        return after + 0.6 + 0.2 * len(net) + 0.4 - x, y - bottom + 0.5 * ROW

    def rows(self, x: float, y: float, cell: CellRows) -> tuple[float, float]:
        """A chain or a line of text a row."""
        width, below = 0.0, y
        for row in cell.rows:
            if isinstance(row, str):
                self.text(x, below - 0.35, row, NAME_SIZE)
                below -= LINE
                width = max(width, 0.17 * len(row))
                continue
            height = below - 0.4 * ROW
            below -= ROW
            self.net_name(x + LABEL - 0.15, height, shown_net(row.start), "left")
            end = x + LABEL + PART * len(row.parts)
            self.chain(x + LABEL, height, end, row)
            name = " ".join([shown_net(row.end), *cell.at.get(row.end, ())])
            self.net_name(end + 0.1, height, name, "right")
            width = max(width, end - x + 0.3 + 0.2 * len(name))
        return width, y - below

    def chain(self, x: float, y: float, end: float, chain: Chain) -> None:
        """The parts of a chain from left to right on one height."""
        step = (end - x) / len(chain.parts)
        for i, part in enumerate(chain.parts):
            a, b = (x + i * step, y), (x + (i + 1) * step, y)
            if not chain.forward(i):
                a, b = b, a
            self.drawing += _element(part).endpoints(a, b)
            middle = x + (i + 0.5) * step
            self.text(middle, y + 0.5, _named(part), NAME_SIZE, align="center")
            for n, line in enumerate(role_lines(part.role, ROLE_WIDTH)):
                self.text(middle, y - 0.58 - 0.26 * n, line, ROLE_SIZE, FAINT, "center")

    def hanging(self, x: float, y: float, length: float, chain: Chain) -> None:
        """A chain down to ground."""
        step = length / len(chain.parts)
        for i, part in enumerate(chain.parts):
            a, b = (x, y - i * step), (x, y - (i + 1) * step)
            if not chain.forward(i):
                a, b = b, a
            self.drawing += _element(part).endpoints(a, b)
            self.text(x + 0.4, y - (i + 0.4) * step, _named(part), NAME_SIZE)
            for n, line in enumerate(role_lines(part.role, ROLE_WIDTH)):
                self.text(x + 0.4, y - (i + 0.4) * step - 0.4 - 0.26 * n, line, ROLE_SIZE, FAINT)
        self.drawing += elm.Ground().theta(0).at((x, y - length)).scale(0.7)

    def net_name(self, x: float, y: float, name: str, side: Literal["left", "right"]) -> None:
        """A net's name on this side of a point."""
        towards: Align = "right" if side == "left" else "left"
        self.drawing += (
            elm.Label()
            .theta(0)
            .at((x, y))
            .label(self.escaped(name), loc=side, fontsize=NAME_SIZE, halign=towards)
        )

    def text(
        self,
        x: float,
        y: float,
        words: str,
        size: float,
        color: str = "black",
        align: Align = "left",
    ) -> None:
        if not words:
            return
        self.drawing += (
            elm.Label()
            .theta(0)
            .at((x, y))
            .label(
                self.escaped(words),
                loc="center",
                fontsize=size,
                color=color,
                halign=align,
                valign="base",
            )
        )

    def line(self, x: float, y: float, to_x: float, to_y: float) -> None:
        if (x, y) != (to_x, to_y):
            self.drawing += elm.Line().endpoints((x, y), (to_x, to_y))

    def dot(self, x: float, y: float) -> None:
        self.drawing += elm.Dot(radius=0.06).at((x, y))

    def escaped(self, text: str) -> str:
        """Text that no backend takes for markup or mathematics.

        Both backends measure text as XML; only that of SVG also writes it as such, so a PNG shows
        look-alikes.
        """
        if self.canvas == "matplotlib":
            return text.translate(_LIKE)
        return html.escape(text).replace("$", "&#36;")


def _named(part: TwoPin) -> str:
    if isinstance(part, Resistor):
        return f"{designator(part.name)} {format_quantity(part.value, 'Ω')}"
    if isinstance(part, Capacitor | SupplyCapacitor):
        return f"{part.name} {format_quantity(part.value, 'F')}"
    return f"{part.name} {part.model.name if isinstance(part, Diode) else part.model}"


def _element(part: TwoPin) -> Any:
    return _SYMBOLS[type(part)]().scale(0.8)
