"""The files of one order, by name: what is uploaded, what a person reads, and their hashes.

The bill is a page too, on which R7 is found on the board's picture and the other way round: one
file that loads nothing, for keyboard, mouse and phone; ``page.html#R7`` opens at a part.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import get_args

from designer.base.csv_tables import csv_text
from designer.base.html_templates import page_templates
from designer.base.seal import sha256
from designer.board.board_facts import BoardFacts, facts_of
from designer.board.bom import Line
from designer.board.bom_layouts import Layout
from designer.board.component import Component
from designer.board.kicad_reader import BoardFile
from designer.catalog.fab import Fab, FabLimits, Measure, PositionField
from designer.catalog.stock_list import order_number
from designer.fabrication.board_picture import Side, board_svg
from designer.fabrication.kicad_plot import DATE, PartPosition, Plots, plot
from designer.fabrication.order_check import OrderCheck, check_order
from designer.fabrication.plotted_copper import plotted

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
