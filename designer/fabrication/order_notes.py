"""``README.md`` of an order: what the files are, what to choose, and what to look at."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from designer.fabrication.board_facts import BoardFacts
from designer.fabrication.fab import Fab
from designer.fabrication.kicad_plot import DATE

FINISH = "any; lead-free solder (HASL) is the usual one"
"""No footprint of ours needs a flat surface."""


def notes(
    title: str,
    name: str,
    fab: Fab,
    facts: BoardFacts,
    remarks: Sequence[str],
) -> str:
    """The page as Markdown.

    title : of the model file. name : of the files. remarks : what is to be looked at, a line each.
    """
    parts = [
        "# Order",
        f"Files for {fab.table.title}.",
        "\n".join(_indented(title)),
        "\n".join(_files(name)),
        "## Options of the board",
        "\n".join(_options(facts)),
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


def _options(facts: BoardFacts) -> Iterator[str]:
    yield "| option | value |"
    yield "|---|---|"
    yield f"| size | {facts.width:.2f} mm × {facts.height:.2f} mm |"
    yield f"| copper layers | {facts.layers} |"
    yield f"| thickness | {facts.thickness:g} mm |"
    yield "| copper | 35 µm (1 oz) |"
    yield f"| surface | {FINISH} |"
    yield f"| finest track | {_millimetres(facts.finest_track)} |"
    yield f"| smallest hole | {_millimetres(facts.smallest_hole)} |"
    yield f"| holes in pads, vias | {facts.holes}, {facts.vias} |"
    yield f"| parts on the surface, through holes | {facts.surface_parts}, {facts.through_parts} |"


def _millimetres(value: float | None) -> str:
    return "none" if value is None else f"{value:g} mm"
