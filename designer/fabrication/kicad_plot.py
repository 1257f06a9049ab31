"""Gerbers, hole files and positions of a board, plotted by KiCad on a copy in a scratch folder.

KiCad writes the time of day into each file. It is replaced by one fixed date, so that equal boards
give equal files.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from designer.base.guarded_reading import csv_rows, reading
from designer.board.kicad_reader import BoardFile
from designer.board.sexpr import read
from designer.design_rules.kicad_program import KicadFailed, call, last_words

TECHNICAL = (
    "F.Paste",
    "B.Paste",
    "F.SilkS",
    "B.SilkS",
    "F.Mask",
    "B.Mask",
    "Edge.Cuts",
)
"""Layers that are plotted beside the copper."""
STAMP, DATE = "1980-01-01T00:00:00+00:00", "1980-01-01 00:00:00"
"""The fixed date, in the two ways in which KiCad writes one."""
_STAMPED = re.compile(rb"^.*(?:CreationDate|Created by KiCad|DRILL file).*$", re.MULTILINE)
_TIME = re.compile(rb"\d{4}-\d\d-\d\d([T ])\d\d:\d\d:\d\d(?:[+-]\d\d:?\d\d)?")
_HEADINGS = ["Ref", "Val", "Package", "PosX", "PosY", "Rot", "Side"]


@dataclass(frozen=True)
class PartPosition:
    """Where a part stands."""

    reference: str
    value: str
    """Its value, as written on the board."""
    package: str
    """Name of its footprint."""
    at: tuple[float, float]
    """Place of its origin [mm], from the sheet's corner, y upwards."""
    degrees: float
    """KiCad's angle, counter-clockwise [°]."""
    bottom: bool
    """Whether it stands on the lower side."""


@dataclass(frozen=True)
class Plots:
    """What KiCad plots of a board."""

    gerbers: dict[str, bytes]
    """Content of each Gerber, the job file and the hole files, by name."""
    positions: tuple[PartPosition, ...]
    """Where the parts stand that are fitted; bare pads are none."""


def plot(board: BoardFile, name: str, protel_names: bool) -> Plots:
    """Plot a board with what its file holds: zones as they are filled there.

    name : of the files. protel_names : as ``Fab`` states it.

    Raises
    ------
    KicadFailed : kicad-cli is missing, or gives no files.
    """
    with tempfile.TemporaryDirectory(prefix="designer-fab-") as scratch:
        place = Path(scratch)
        file, out = place / f"{name}.kicad_pcb", place / "gerbers"
        file.write_text(board.text, encoding="utf-8")
        layers = ",".join((*_copper(board), *TECHNICAL))
        endings = [] if protel_names else ["--no-protel-ext"]
        _export(place, "gerbers", "-l", layers, "--subtract-soldermask", *endings,
                "-o", f"{out}/", str(file))  # fmt: skip
        _export(place, "drill", "--excellon-separate-th", "-o", f"{out}/", str(file))
        table = place / "positions.csv"
        _export(place, "pos", "--format", "csv", "--units", "mm", "--exclude-dnp",
                "-o", str(table), str(file))  # fmt: skip
        gerbers = {path.name: undated(path.read_bytes()) for path in sorted(out.iterdir())}
        return Plots(gerbers, tuple(_positions(table)))


def undated(content: bytes) -> bytes:
    """A plotted file with the fixed date in the lines in which KiCad states when it was made."""

    def fixed(time: re.Match[bytes]) -> bytes:
        return (STAMP if time[1] == b"T" else DATE).encode("ascii")

    return _STAMPED.sub(lambda line: _TIME.sub(fixed, line[0]), content)


def _copper(board: BoardFile) -> Sequence[str]:
    """The copper layers that the board has, from the top."""
    listed = read(board.text, board.path).get("layers").children
    return [layer.text(0) for layer in listed if layer.text(0).endswith(".Cu")]


def _export(place: Path, kind: str, *options: str) -> None:
    process = call("pcb", "export", kind, *options, place=place)
    if process.returncode != 0:
        raise KicadFailed(f"kicad-cli pcb export {kind}: {last_words(process)}")


def _positions(table: Path) -> Iterator[PartPosition]:
    if not table.is_file():
        raise KicadFailed("kicad-cli wrote no positions")
    rows = csv_rows(table.read_text(encoding="utf-8"), table)
    with reading(table, "a table of positions as KiCad 9 writes it"):
        _, header = next(rows)
        if header != _HEADINGS:
            raise ValueError(f"columns {header}")
        for _, (reference, value, package, x, y, turn, side) in rows:
            at = float(x), float(y)
            yield PartPosition(reference, value, package, at, float(turn), side == "bottom")
