"""Makers of boards as data: the columns, names and rotations that each wants to be sent.

A fab is a TOML file in a folder ``fabs`` beside the catalogue's files, named after it
(docs/fabrication.md); folders are searched as the catalogue's are, so a user's own comes first.
"""

from __future__ import annotations

from collections.abc import Sequence
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
    return table
