"""The pieces of a trade, each kept as soon as it is done: interrupted work goes on from them.

Of each response one piece with every fidelity, and one for every ``CHUNK`` boards. They stand in
one file of the design folder, a line each with its own seal (``base.keyed_store``), which goes when
the trade is finished.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from designer.base.guarded_reading import UNREADABLE
from designer.base.keyed_store import Lines, Note
from designer.base.plain_json import plain
from designer.base.progress import quiet
from designer.base.record_check import checked_record, fits, read_record
from designer.fidelity.fidelity_errors import FidelityError, Truth
from designer.fidelity.yields import Tally
from designer.spice.deck import SolverSettings

PIECES = "trade-pieces.json"
CHUNK = 100
"""Boards of a piece."""


class TradePieces:
    """Pieces by name, as they were found in ``known`` or are made now.

    key : of all that decides a piece. save : puts the text of the file where it belongs; by default
    nowhere.
    """

    def __init__(
        self,
        known: Mapping[str, Any] | None = None,
        save: Callable[[str], None] = lambda _: None,
        key: str = "",
    ) -> None:
        self._pieces, self._save = dict(known or {}), save
        self._lines = _lines(key)

    def __contains__(self, name: str) -> bool:
        return name in self._pieces

    def piece(self, name: str, make: Callable[[], Mapping[str, Any]]) -> dict[str, Any]:
        """What there is of this name, or what is made and kept now."""
        if name not in self._pieces:
            began = time.perf_counter()
            made = plain(make())
            self._pieces[name] = {**made, "elapsed": time.perf_counter() - began}
            self._save(self._lines.text(self._pieces))
        return dict(self._pieces[name])

    @property
    def seconds(self) -> float:
        """Time that the pieces took, s, whenever they were made."""
        return math.fsum(piece["elapsed"] for piece in self._pieces.values())


def read_pieces(path: Path, key: str, note: Note = quiet) -> dict[str, dict[str, Any]]:
    """The pieces of this key in a file that are as they were written; none where there is no file.

    note : told of the others, which are made again.
    """
    pieces = _lines(key).load(path, note)
    fine = {name: piece for name, piece in pieces.items() if _may_be(name, piece)}
    if len(fine) < len(pieces):
        note(f"{path}: {len(pieces) - len(fine)} that are no pieces of a trade, computed again")
    return fine


def _may_be(name: str, piece: Mapping[str, Any]) -> bool:
    """Whether a piece is such as ``fidelities`` or ``tally`` read."""
    elapsed: Any = piece.get("elapsed")
    if not fits(elapsed, float) or not elapsed >= 0.0:
        return False
    try:
        if name.startswith("rungs "):
            fidelities(piece)
            return True
        counts = {k: v for k, v in asdict(tally(piece)).items() if isinstance(v, int)}
    except UNREADABLE:
        return False
    counts.pop("runs", None)
    return all(0 <= count <= CHUNK for count in counts.values())


def _lines(key: str) -> Lines:
    return Lines("pieces", key)


@dataclass(frozen=True)
class _Measured:
    """What of a response at every fidelity may have numbers that are not finite."""

    rows: tuple[FidelityError, ...]
    truth: Truth
    seconds: float


def fidelities_json(
    rows: tuple[FidelityError, ...], truth: Truth, settings: SolverSettings | None, seconds: float
) -> dict[str, Any]:
    """A response at every fidelity; settings, seconds : as in ``FidelityAnswers``."""
    return {
        "rows": [asdict(row) for row in rows],
        "truth": asdict(truth),
        "settings": None if settings is None else asdict(settings),
        "seconds": seconds,
    }


def fidelities(
    piece: Mapping[str, Any],
) -> tuple[tuple[FidelityError, ...], Truth, SolverSettings | None, float]:
    """The inverse of ``fidelities_json``; numbers that are not finite come back as nan."""
    values = {f.name: piece[f.name] for f in fields(_Measured)}
    measured, settings = read_record(_Measured, values, null=math.nan), piece["settings"]
    return (
        measured.rows,
        measured.truth,
        None if settings is None else checked_record(SolverSettings, settings),
        measured.seconds,
    )


def tally(piece: Mapping[str, Any]) -> Tally:
    """Counts of a piece of boards."""
    return checked_record(Tally, {f.name: piece[f.name] for f in fields(Tally)})
