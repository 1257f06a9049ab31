"""``README.md`` of an order: what the files are, what to choose, and what to look at."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from designer.board.board_facts import BoardFacts
from designer.catalog.fab import Fab, FabLimits, Measure
from designer.fabrication.kicad_plot import DATE

FINISH = "any; lead-free solder (HASL) is the usual one"
"""No footprint of ours needs a flat surface."""


def notes(
    title: str,
    name: str,
    fab: Fab,
    facts: BoardFacts,
    limits: FabLimits,
    remarks: Sequence[str],
) -> str:
    """The page as Markdown.

    title : of the model file. name : of the files. limits : what the fab makes. remarks : what is
    to be looked at, a line each.
    """
    parts = [
        "# Order",
        f"Files for {fab.table.title}.",
        "\n".join(_indented(title)),
        "\n".join(_files(name)),
        "## Options of the board",
        "\n".join(_options(facts, limits)),
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
