"""Makers of boards as data: what each can make, and the columns, names and rotations that it wants
to be sent.

A fab is a TOML file in a folder ``fabs`` beside the catalogue's files, named after it
(docs/fabrication.md); folders are searched as the catalogue's are, so a user's own comes first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from designer.base.errors import MISSING, InputError
from designer.base.guarded_reading import read_text
from designer.base.schema import (
    FIRST_FORMAT,
    FileTable,
    checked,
    choice,
    flag,
    line,
    lines,
    number,
    one_of,
)
from designer.base.toml_reader import parse_toml
from designer.catalog.read import FABS

PositionField = Literal["reference", "value", "package", "x", "y", "rotation", "side"]
"""What a column of a position file shows; places in mm, angles in degrees."""
Measure = Literal[
    "track", "gap", "hole", "via-ring", "pad-ring", "edge", "hole-gap", "slot", "silk-height",
    "silk-stroke", "layers", "thickness",
]  # fmt: skip
"""What a fab limits: the width of a track, from copper to copper, the diameter of a hole, the ring
of copper round a via's hole and round a pad's, from copper to the board's edge, from hole to hole,
the width of a slot, the height of letters and the width of lines in silk, the number of copper
layers, the thickness of the board. All but the layers in mm."""
GENERIC = "generic"
"""The fab whose limits hold for a board without one, and where another states none."""
_MAX_BYTES = 100_000


@dataclass(frozen=True)
class PositionColumn(FileTable):
    """A column of a position file."""

    title: Annotated[str, line("a heading of one line")]
    """Heading of the column."""
    field: Annotated[PositionField, choice(*get_args(PositionField))]
    """What it shows."""


@dataclass(frozen=True)
class RotationOffset(FileTable):
    """How a fab's own model of a footprint is turned against KiCad's."""

    footprint: Annotated[str, line("a footprint's name, * for any text")]
    """Pattern of the footprint's name."""
    degrees: Annotated[
        float,
        number("", "an angle in degrees, from -360 to 360", lambda value: abs(value) <= 360.0),
    ]
    """Angle that is added, counter-clockwise as seen on that side [°]."""
    source: Annotated[str, line("where the angle comes from")]
    """Where the angle comes from."""


@dataclass(frozen=True)
class FabLimit(FileTable):
    """The least and the most that a fab makes."""

    of: Annotated[Measure, choice(*get_args(Measure))]
    """What is limited."""
    source: Annotated[str, line("where the limit comes from")]
    """Where the limit comes from."""
    least: Annotated[float | None, number("", "a number above 0", lambda value: value > 0.0)] = None
    """From below [mm]; None for none."""
    most: Annotated[float | None, number("", "a number above 0", lambda value: value > 0.0)] = None
    """From above [mm, or a count]; None for none."""
    assumed: Annotated[bool, flag()] = False
    """Whether no page of the fab says so."""


@dataclass(frozen=True)
class FabTable(FileTable):
    """A fab as its file states it."""

    format: Annotated[int, FIRST_FORMAT]
    """Format of the file."""
    title: Annotated[str, line("the fab's name")]
    """Name of the fab, as people write it."""
    bom: Annotated[str, line("the name of a layout of bills")]
    """Layout of its bill (``board.bom_layouts``)."""
    column: tuple[PositionColumn, ...]
    """Columns of the position file, in order."""
    top: Annotated[str, line("what the upper side is called")] = "top"
    """What the upper side is called in the position file."""
    bottom: Annotated[str, line("what the lower side is called")] = "bottom"
    """What the lower side is called there."""
    from_below: Annotated[bool, flag()] = False
    """Whether angles on the lower side are as seen from below."""
    protel_names: Annotated[bool, flag()] = False
    """Whether each layer has a name ending of its own (.gtl, .gbl, …) instead of .gbr."""
    distributor: Annotated[str | None, line("a distributor's name")] = None
    """Whose order numbers its assembly asks for; None where it asks for none."""
    limit: tuple[FabLimit, ...] = ()
    """What it makes, each measure once; of others those of ``generic`` hold."""
    rotation: tuple[RotationOffset, ...] = ()
    """Angles by footprint; the first pattern that fits counts."""
    steps: Annotated[tuple[str, ...], lines("a list of what to do")] = ()
    """How to order, a step a line."""
    sources: Annotated[tuple[str, ...], lines("a list of where this is described")] = ()
    """Where the columns are described."""
    assumed: Annotated[tuple[str, ...], lines("a list of what was not checked")] = ()
    """What was not checked."""


@dataclass(frozen=True)
class Fab:
    """A maker of boards."""

    name: str
    """Name of the file, by which it is asked for."""
    table: FabTable
    """What the file states."""

    def side(self, bottom: bool) -> str:
        """What a side is called in the position file."""
        return self.table.bottom if bottom else self.table.top

    def rotation(self, footprint: str, degrees: float, bottom: bool) -> float:
        """The fab's angle of a part that stands at ``degrees`` in KiCad, in [0, 360) [°]."""
        seen = 180.0 - degrees if bottom and self.table.from_below else degrees
        offsets = (r.degrees for r in self.table.rotation if fnmatchcase(footprint, r.footprint))
        return (seen + next(offsets, 0.0)) % 360.0


@dataclass(frozen=True)
class FabLimits:
    """What every one of some fabs makes."""

    title: str
    """Names of the fabs, as people write them."""
    least: Mapping[Measure, float]
    """The least of each measure [mm]."""
    most: Mapping[Measure, float]
    """The most of each measure [mm, or a count]."""
    assumed: frozenset[Measure]
    """Those that no page of a fab says."""


def fab_limits(names: Sequence[str], folders: Sequence[Path]) -> FabLimits:
    """The limits that hold for an order from all of these fabs; of none those of ``generic``.

    Raises
    ------
    InputError : as of ``fabs``.
    """
    (usual,) = fabs([GENERIC], folders)
    least: dict[Measure, float] = {}
    most: dict[Measure, float] = {}
    assumed: set[Measure] = set()
    chosen = fabs(names, folders) or (usual,)
    for fab in chosen:
        own = {each.of: each for each in fab.table.limit}
        for each in ({one.of: one for one in usual.table.limit} | own).values():
            if each.least is not None:
                least[each.of] = max(each.least, least.get(each.of, 0.0))
            if each.most is not None:
                most[each.of] = min(each.most, most.get(each.of, each.most))
            assumed |= {each.of} if each.assumed else set()
    return FabLimits(", ".join(f.table.title for f in chosen), least, most, frozenset(assumed))


def fabs(names: Sequence[str], folders: Sequence[Path]) -> tuple[Fab, ...]:
    """The fabs of these names, each once, from the first folder that has it.

    Raises
    ------
    InputError : no folder has one; or anything in its file is wrong.
    """
    return tuple(_fab(name, folders) for name in dict.fromkeys(names))


def _fab(name: str, folders: Sequence[Path]) -> Fab:
    known = {
        path.stem: path
        for folder in reversed(folders)
        for path in sorted((folder / FABS).glob("*.toml"))
    }
    if name not in known:
        raise InputError(None, "--fab", name, one_of(name, sorted(known)))
    return Fab(name, _read(known[name]))


def _read(path: Path) -> FabTable:
    text = read_text(path, "a fab's file that can be read", most=_MAX_BYTES)
    data: dict[str, Any] = parse_toml(text, str(path))
    table = checked(FabTable, data, str(path))
    titles = [column.title for column in table.column]
    twice = next((title for title in titles if titles.count(title) > 1), None)
    if twice is not None or not titles:
        raise InputError(path, "column", twice or MISSING, "columns, each title once")
    limited = [each.of for each in table.limit]
    again = next((of for of in limited if limited.count(of) > 1), None)
    if again is not None:
        raise InputError(path, "limit", f"{again} twice", "each measure once")
    bare = next((each.of for each in table.limit if each.least is None and each.most is None), None)
    if bare is not None:
        raise InputError(path, f"limit {bare}", MISSING, "least, most or both")
    return table
