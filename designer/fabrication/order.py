"""The files of one order, by name: what is uploaded, what a person reads, and their hashes.

The bill is a page too, on which R7 is found on the board's picture and the other way round: one
file that loads nothing, for keyboard, mouse and phone; ``page.html#R7`` opens at a part.

An order is checked as it was written, by geometry alone (``plotted_copper``): copper that touches
is one piece, what is drilled or outside the edge is taken away, plated holes join layers. Each pad
lies on a piece, and the pads of one piece have to be those of one net of the circuit.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import get_args

import shapely
from scipy.cluster.hierarchy import DisjointSet
from shapely.geometry import Point
from shapely.geometry.base import BaseGeometry

from designer.base.csv_tables import csv_text
from designer.base.errors import InputError
from designer.base.html_templates import page_templates
from designer.base.natural_sort import natural_key
from designer.base.seal import sha256
from designer.base.views import View
from designer.board.board_facts import BoardFacts, facts_of
from designer.board.bom import Line
from designer.board.bom_layouts import Layout
from designer.board.component import Component, joined
from designer.board.footprints import footprint
from designer.board.kicad_names import LIBRARY
from designer.board.kicad_reader import BoardFile, PlacedFootprint, PlacedPad, few, turned
from designer.catalog.fab import Fab, FabLimits, Measure, PositionField
from designer.catalog.stock_list import order_number
from designer.fabrication.board_picture import Side, board_svg
from designer.fabrication.kicad_plot import DATE, PartPosition, Plots, plot
from designer.fabrication.plotted_copper import Plotted, plotted

FINISH = "any; lead-free solder (HASL) is the usual one"
"""No footprint of ours needs a flat surface."""


def notes(
    title: str,
    name: str,
    fab: Fab,
    facts: BoardFacts,
    limits: FabLimits,
    read_back: str,
    remarks: Sequence[str],
) -> str:
    """The page as Markdown.

    title : of the model file. name : of the files. limits : what the fab makes. read_back : what
    the files said when they were read back. remarks : what is to be looked at, a line each.
    """
    parts = [
        "# Order",
        f"Files for {fab.table.title}.",
        "\n".join(_indented(title)),
        "\n".join(_files(name)),
        "## Options of the board",
        "\n".join(_options(facts, limits)),
        "## Checked as written",
        read_back,
        "## Steps",
        "\n".join(f"{i}. {step}" for i, step in enumerate(fab.table.steps, start=1)),
        "## To be looked at" if remarks else "",
        "\n".join(f"- {remark}" for remark in remarks),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _indented(title: str) -> Iterator[str]:
    """A foreign text as a code block, which means nothing else in Markdown."""
    yield f"    {' '.join(title.split())}"


def _files(name: str) -> Iterator[str]:
    yield f"- `{name}-gerbers.zip`: the layers and holes, to be uploaded; `gerbers/` has the same."
    yield f"- `{name}-bom.csv`: the bill of materials, in this fab's columns."
    yield f"- `{name}-bom.html`: the bill with the board's picture, for the bench; loads nothing."
    yield f"- `{name}-top.svg`, `{name}-bottom.svg`: the finished board from above and from below."
    yield f"- `{name}-positions.csv`: where each part stands, and at which angle."
    yield "- `SHA256SUMS`: hashes of all files; `sha256sum -c SHA256SUMS` checks them."
    yield f"- All files carry the date {DATE[:10]}, so that equal boards give equal files."


def _options(facts: BoardFacts, limits: FabLimits) -> Iterator[str]:
    yield "| option | value | the fab makes |"
    yield "|---|---|---|"
    yield f"| size | {facts.width:.2f} mm × {facts.height:.2f} mm | |"
    yield f"| copper layers | {facts.layers} | {_made(limits, 'layers')} |"
    yield f"| thickness | {facts.thickness:g} mm | {_made(limits, 'thickness')} |"
    yield "| copper | 35 µm (1 oz) | |"
    yield f"| surface | {FINISH} | |"
    measured: tuple[tuple[str, float | None, Measure], ...] = (
        ("finest track", facts.finest_track, "track"),
        ("smallest hole", facts.smallest_hole, "hole"),
        ("narrowest slot", facts.narrowest_slot, "slot"),
        ("thinnest ring of a via", facts.via_ring, "via-ring"),
        ("thinnest ring of a pad", facts.pad_ring, "pad-ring"),
        ("lowest letters in silk", facts.silk_height, "silk-height"),
        ("finest line in silk", facts.silk_stroke, "silk-stroke"),
    )
    for words, value, measure in measured:
        yield f"| {words} | {_millimetres(value)} | {_made(limits, measure)} |"
    yield f"| holes in pads, vias | {facts.holes}, {facts.vias} | |"
    parts = f"{facts.surface_parts}, {facts.through_parts}"
    yield f"| parts on the surface, through holes | {parts} | |"


def _made(limits: FabLimits, measure: Measure) -> str:
    """What the fab makes, in words."""
    unit = "" if measure == "layers" else " mm"
    words = [f"at least {limits.least[measure]:g}{unit}"] if measure in limits.least else []
    words += [f"at most {limits.most[measure]:g}{unit}"] if measure in limits.most else []
    return ", ".join(words) + (" (assumed)" if measure in limits.assumed else "")


def _millimetres(value: float | None) -> str:
    return "none" if value is None else f"{value:.3g} mm"


def bom_page(title: str, board: BoardFile, bought: Sequence[Line]) -> str:
    """The page as HTML. title : of the model file, as it is."""
    sides = [("From above", board_svg(board, "top")), ("From below", board_svg(board, "bottom"))]
    page = page_templates("designer.fabrication").get_template("bom_page.html.j2")
    return page.render(title=" ".join(title.split()), sides=sides, lines=bought)


GERBERS = "gerbers"
"""Folder of the plotted files."""
NOTES, HASHES = "README.md", "SHA256SUMS"
FIRST_DAY = (1980, 1, 1, 0, 0, 0)
"""Date of the files in the archive: the earliest that its format knows."""


@dataclass(frozen=True)
class BoardOrder:
    """A board that is to be ordered."""

    name: str
    """Name of the files: the project's."""
    title: str
    """Title of the model file, as it is."""
    board: BoardFile
    components: Sequence[Component]
    """What the design has on the board, with the nets of the circuit."""
    bought: Sequence[Line]
    """Its bill."""
    not_checked: Sequence[str]
    """Rules that were not run, with the reason of each."""
    accepted: Sequence[str] = ()
    """Rules that fail and are accepted, with what was found."""


class FaultyOrder(Exception):
    """The files of an order are not as the circuit and the bill have it.

    faults : a line for each difference.
    """

    def __init__(self, faults: Sequence[str]) -> None:
        super().__init__("; ".join(faults))
        self.faults = tuple(faults)


def order_files(order: BoardOrder, fab: Fab, layout: Layout, limits: FabLimits) -> dict[str, bytes]:
    """Every file of the order, by its name inside the fab's folder.

    layout : of the fab's bill. limits : what the fab makes.

    Raises
    ------
    KicadFailed : kicad-cli gives no files.
    FaultyOrder : its files are not as the circuit and the bill have it.
    """
    plots = plot(order.board, order.name, fab.table.protel_names)
    checked = _read_back(plots, order)
    placed = {part.reference for part in plots.positions}
    files = {
        **{f"{GERBERS}/{name}": content for name, content in plots.gerbers.items()},
        f"{order.name}-gerbers.zip": packed(plots.gerbers),
        f"{order.name}-positions.csv": positions_csv(plots.positions, fab).encode("utf-8"),
        f"{order.name}-bom.csv": layout.csv(order.bought).encode("utf-8"),
    }
    wired = [d for one in order.bought for d in one.designators if d not in placed]
    by_hand = ["On the bill without a place on the board, fitted by hand: " + ", ".join(wired)]
    remarks = [
        *by_hand[: bool(wired)],
        *_unnumbered(order.bought, fab.table.distributor),
        *_assumed(order.bought),
        *(f"Accepted, though the rule fails: {rule}" for rule in order.accepted),
        *(f"Not checked: {rule}" for rule in order.not_checked),
        *(f"Assumed: {assumption}" for assumption in fab.table.assumed),
    ]
    facts = facts_of(order.board)
    text = notes(order.title, order.name, fab, facts, limits, checked.words, remarks)
    files[NOTES] = text.encode("utf-8")
    files[f"{order.name}-bom.html"] = bom_page(order.title, order.board, order.bought).encode(
        "utf-8"
    )
    for side in get_args(Side):
        files[f"{order.name}-{side}.svg"] = board_svg(order.board, side).encode("utf-8")
    files[HASHES] = "".join(
        f"{sha256(content)}  {name}\n" for name, content in sorted(files.items())
    ).encode("ascii")
    return files


def _read_back(plots: Plots, order: BoardOrder) -> OrderCheck:
    try:
        files = plotted(plots.gerbers)
    except ValueError as why:
        raise FaultyOrder((str(why),)) from None
    checked = check_order(files, plots.positions, order.board, order.components, order.bought)
    if checked.faults:
        raise FaultyOrder(checked.faults)
    return checked


def _assumed(bought: Sequence[Line]) -> Iterator[str]:
    """A line for what the catalogue assumes of parts, those alike together."""
    alike: dict[str, list[str]] = {}
    for one in bought:
        alike.setdefault(one.assumed, []).append(one.part_number)
    for assumed, numbers in alike.items():
        if assumed:
            yield f"Assumed of {', '.join(numbers)}: {assumed}"


def _unnumbered(bought: Sequence[Line], distributor: str | None) -> Iterator[str]:
    """A line on the parts that no list has a number of."""
    bare = [one.part_number for one in bought if not order_number(one.stock, distributor or "")]
    if distributor is not None and bare:
        yield f"Without an order number of {distributor}: {', '.join(bare)}"


def packed(files: Mapping[str, bytes]) -> bytes:
    """A zip archive of files, the same bytes for the same files."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, content in sorted(files.items()):
            entry = zipfile.ZipInfo(name, FIRST_DAY)
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return out.getvalue()


def positions_csv(parts: Sequence[PartPosition], fab: Fab) -> str:
    """The position file in the fab's columns; places in mm, angles in degrees."""
    columns = fab.table.column
    rows = [{column.title: _cell(column.field, part, fab) for column in columns} for part in parts]
    return csv_text([column.title for column in columns], rows)


def _cell(field: PositionField, part: PartPosition, fab: Fab) -> str:
    turned = fab.rotation(part.package, part.degrees, part.bottom)
    cells: dict[PositionField, str] = {
        "reference": part.reference,
        "value": part.value,
        "package": part.package,
        "x": f"{part.at[0]:.4f}",
        "y": f"{part.at[1]:.4f}",
        "rotation": f"{turned:g}",
        "side": fab.side(part.bottom),
    }
    return cells[field]


NEAR = 0.005
"""Copper that is nearer than this [mm] to a hole, and a pad's place to its copper, touch."""
PLACED = 0.02
"""How far a pad may be from where the position file's part has it [mm]."""


@dataclass(frozen=True)
class OrderCheck:
    """What an order's files say when they are read back."""

    pads: int
    """Pads that lie on copper."""
    nets: int
    """Nets that they are on."""
    placed: int
    """Parts in the position file."""
    faults: tuple[str, ...]
    """A line for each thing that is not as the circuit and the bill have it."""

    @property
    def words(self) -> str:
        """What was found, for the page of an order that has no fault."""
        return (
            f"The files were read back: their copper and plated holes join {self.pads} pads to "
            f"{self.nets} nets as the circuit does, without an open or a short. Each pad is open "
            f"in the mask; each of {self.placed} placed parts is on the bill once, and stands on "
            "its own pads by its place and angle."
        )


def check_order(
    files: Plotted,
    positions: Sequence[PartPosition],
    board: BoardFile,
    components: Sequence[Component],
    bought: Sequence[Line],
) -> OrderCheck:
    """Read an order back. positions : in KiCad's angles. components : of the design, with the nets
    that the circuit gives their pads. bought : the bill."""
    listed = [c for c in components if View.BOARD in c.views]
    copper = _Copper(files, {c.reference: board.pads(c.reference) for c in listed})
    faults = [
        *_edge(files),
        *copper.missing,
        *_nets(copper, listed),
        *_openings(files, copper, listed),
        *_bill(positions, listed, bought),
        *_places(positions, board, listed),
    ]
    nets = len(joined(listed))
    return OrderCheck(len(copper.piece), nets, len(positions), tuple(faults))


class _Copper:
    """Which pads the copper of plotted files joins.

    pads : of the board by the reference of their component.
    """

    def __init__(self, files: Plotted, pads: Mapping[str, Sequence[PlacedPad]]) -> None:
        self._files = files
        self.places = {
            (reference, pad.number, i): pad
            for reference, own in pads.items()
            for i, pad in enumerate(own)
            if pad.number
        }
        """Every pad of a component that has a number; one number may have more than one."""
        self.piece: dict[tuple[str, str, int], int] = {}
        """Of each pad that lies on copper: the piece, one for all that is joined."""
        self.missing: list[str] = []
        """A line for each pad that does not."""
        sets = DisjointSet(range(len(self._pieces) + len(files.holes)))
        for i, hole in enumerate(files.holes, len(self._pieces)):
            for piece in self._touching(hole.area) if hole.plated else ():
                sets.merge(i, piece)
        for key, pad in self.places.items():
            at = self._under(pad)
            if at is None:
                self.missing.append(f"{key[0]}.{key[1]} has no copper in the plotted files")
            else:
                self.piece[key] = int(sets[at])

    @cached_property
    def _pieces(self) -> list[tuple[str, BaseGeometry]]:
        """Layer and area of each piece of copper that is left on the board."""
        gone = shapely.union_all([hole.area for hole in self._files.holes])
        out: list[tuple[str, BaseGeometry]] = []
        for layer, area in self._files.copper.items():
            left = area.intersection(self._files.board).difference(gone)
            out += [(layer, piece) for piece in shapely.get_parts(left) if piece.area > 0.0]
        return out

    @cached_property
    def _tree(self) -> shapely.STRtree:
        return shapely.STRtree([piece for _, piece in self._pieces])

    @cached_property
    def _drilled(self) -> shapely.STRtree:
        return shapely.STRtree([hole.area for hole in self._files.holes])

    def _touching(self, area: BaseGeometry) -> list[int]:
        found = self._tree.query(area, predicate="dwithin", distance=NEAR)
        return [int(i) for i in found]

    def _under(self, pad: PlacedPad) -> int | None:
        """The piece at a pad, or the plated hole in it; None where there is neither."""
        at = Point(pad.at[0], -pad.at[1])
        if pad.hole:
            holes = self._drilled.query(at, predicate="dwithin", distance=NEAR)
            plated = [int(i) for i in holes if self._files.holes[int(i)].plated]
            return len(self._pieces) + plated[0] if plated else None
        layer = self._files.bottom if pad.bottom else "L1"
        return next((i for i in self._touching(at) if self._pieces[i][0] == layer), None)


def _edge(files: Plotted) -> Iterator[str]:
    if files.board.is_empty:
        yield "the plotted edge of the board is not closed"


def _nets(copper: _Copper, listed: Sequence[Component]) -> Iterator[str]:
    """Nets that are not one piece, and pieces that are not one net."""
    named = {pad: net for net, pads in joined(listed).items() for pad in pads}
    of_net: dict[str, dict[int, list[str]]] = {}
    of_piece: dict[int, dict[str, list[str]]] = {}
    for (reference, number, _), piece in copper.piece.items():
        pad = f"{reference}.{number}"
        net = named.get((reference, number), "")
        if net:
            of_net.setdefault(net, {}).setdefault(piece, []).append(pad)
        # A pad without a net is on a net of its own.
        of_piece.setdefault(piece, {}).setdefault(net or f"no net at {pad}", []).append(pad)
    for net, pieces in sorted(of_net.items(), key=lambda item: natural_key(item[0])):
        if len(pieces) > 1:
            parts = sorted(pieces.values(), key=len)
            yield f"the net {net} is open: " + " apart from ".join(map(_some, parts))
    for nets in of_piece.values():
        if len(nets) > 1:
            names = sorted(nets, key=natural_key)
            each = ", ".join(f"{name} ({_some(nets[name])})" for name in names)
            yield f"a short between {each}"


def _some(pads: Sequence[str]) -> str:
    return few(sorted(set(pads), key=natural_key))


def _openings(files: Plotted, copper: _Copper, listed: Sequence[Component]) -> Iterator[str]:
    """Pads that the mask covers, and pads on the surface that get no solder paste."""
    pasted = {c.reference for c in listed if c.fitted and _soldered(c)}
    for layers, words in ((files.mask, "is covered by the mask"), (files.paste, "gets no paste")):
        stencil = layers is files.paste
        for area in layers.values():
            shapely.prepare(area)
        for (reference, number, _), pad in copper.places.items():
            sides = ("Top", "Bot") if pad.hole else ("Bot",) if pad.bottom else ("Top",)
            if stencil and (pad.hole or reference not in pasted):
                continue
            at = Point(pad.at[0], -pad.at[1])
            if not all(side in layers and layers[side].dwithin(at, NEAR) for side in sides):
                yield f"{reference}.{number} {words}"


def _soldered(component: Component) -> bool:
    try:
        return footprint(component.footprint).soldered
    except InputError:  # a footprint of the user's own
        return False


def _bill(
    positions: Sequence[PartPosition], listed: Sequence[Component], bought: Sequence[Line]
) -> Iterator[str]:
    """What is not on the bill once and at one place: parts that are fitted on the board."""
    on_bill = Counter(name for line in bought for name in line.designators)
    placed = Counter(part.reference for part in positions)
    for counts, where in ((on_bill, "the bill"), (placed, "the position file")):
        twice = [name for name, count in counts.items() if count > 1]
        yield from (f"{name} stands on {where} twice" for name in sorted(twice, key=natural_key))
    fitted = {c.reference for c in listed if View.BOM in c.views and c.bought is not None}
    for lost, where in ((fitted - on_bill.keys(), "bill"), (fitted - placed.keys(), "position")):
        yield from (f"{name} has no {where}" for name in sorted(lost, key=natural_key))
    foreign = placed.keys() - on_bill.keys()
    for name in sorted(foreign & {c.reference for c in listed}, key=natural_key):
        yield f"{name} has a position, and is on no bill"


def _places(
    positions: Sequence[PartPosition], board: BoardFile, listed: Sequence[Component]
) -> Iterator[str]:
    """Parts whose pads are not where their place and angle in the position file have them."""
    by_reference = {c.reference: c for c in listed}
    for part in positions:
        there, component = board.footprint(part.reference), by_reference.get(part.reference)
        if there is None or component is None:
            continue
        off = _off(part, there, component)
        if off is not None and not off < PLACED:
            yield (
                f"{part.reference} stands {off:.3g} mm off its pads by its place and angle in the "
                "position file"
            )


def _off(part: PartPosition, there: PlacedFootprint, component: Component) -> float | None:
    """How far the pad that is farthest off is from where the part has it [mm]; None for a footprint
    that is not known here.

    A footprint of another library may have another origin: then the angle alone counts.
    """
    try:
        shape = footprint(component.footprint)
    except InputError:
        return None
    origin, turn = (part.at[0], -part.at[1]), math.radians(part.degrees)
    off: list[tuple[float, float]] = []
    for pad in shape.pads:
        # KiCad turns a footprint over its horizontal axis, and states the angle seen from above.
        seen = turned((pad.x, -pad.y if part.bottom else pad.y), origin, turn)
        near = [p.at for p in there.pads if p.number == pad.number]
        if near and pad.number:
            at = min(near, key=lambda p: math.dist(p, seen))
            off.append((at[0] - seen[0], at[1] - seen[1]))
    if not off:
        return None
    x, y = off[0] if there.library != LIBRARY else (0.0, 0.0)
    return max(math.hypot(a - x, b - y) for a, b in off)
