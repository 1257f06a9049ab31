"""Pieces of a trade that a stranger wrote, with a seal that is right."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from designer.base.keyed_store import Lines
from designer.base.plain_json import plain
from designer.fidelity.fidelity_errors import FidelityError, ResponseLabel, Truth
from designer.fidelity.pieces import (
    CHUNK,
    TradePieces,
    fidelities,
    fidelities_json,
    read_pieces,
    tally,
)
from designer.fidelity.yields import Tally
from designer.spice.deck import SolverSettings

LABEL = ResponseLabel(1, 0.85, 0.25, "1-2-2")
ROW = FidelityError(
    LABEL, "ideal", "usual", {"reltol": 1e-4}, "1-2-2", "", 0.1, True,
    {"model": True}, {"model": math.nan}, {"model": 1e-3}, 1e-5, math.nan,
)  # fmt: skip
TRUTH = Truth(LABEL, "1-2-2", True, 1e-6, 1e-5, {"model": True}, {"model": True})
SETTINGS = SolverSettings("trap", 1e-6)
COUNTS = Tally(decided=90, ok=80, lost=2, undecided=10, runs=123, periods=4e4, seconds=1.5)
PIECES: dict[str, Mapping[str, Any]] = {
    "rungs 1": fidelities_json((ROW,), TRUTH, SETTINGS, 0.5),
    "boards 1, 0 to 99": asdict(COUNTS),
}


def written(path: Path, name: str, change: Mapping[str, Any]) -> Path:
    """A file of both pieces, some values of one changed."""

    def save(text: str) -> None:
        path.write_text(text)

    pieces = TradePieces(save=save, key="a")
    for each, content in PIECES.items():
        made = {**content, **(change if each == name else {})}
        pieces.piece(each, partial(dict, made))
    return path


def test_what_was_written_comes_back(tmp_path: Path) -> None:
    notes: list[str] = []
    found = read_pieces(written(tmp_path / "pieces", "", {}), "a", notes.append)
    rows, truth, settings, seconds = fidelities(found["rungs 1"])
    assert [repr(row) for row in rows] == [repr(ROW)]
    assert (truth, settings, seconds) == (TRUTH, SETTINGS, 0.5)
    assert tally(found["boards 1, 0 to 99"]) == COUNTS
    assert notes == []


STRANGE: list[tuple[str, dict[str, Any]]] = [
    ("rungs 1", {"rows": None}),
    ("rungs 1", {"rows": [1]}),
    ("rungs 1", {"rows": [{**asdict(ROW), "response": None}]}),
    ("rungs 1", {"rows": [{**asdict(ROW), "label": 3}]}),
    ("rungs 1", {"truth": {**asdict(TRUTH), "sure": "yes"}}),
    ("rungs 1", {"settings": {"method": "trap", "max_step": "1"}}),
    ("rungs 1", {"settings": {"step": 1.0}}),
    ("rungs 1", {"seconds": [1.0]}),
    ("rungs 1", {"seconds": "1.0"}),
    ("rungs 1", {"settings": {"method": "trap", "max_step": None}}),
    ("boards 1, 0 to 99", {"decided": CHUNK + 1}),
    ("boards 1, 0 to 99", {"ok": -1}),
    ("boards 1, 0 to 99", {"ok": 1.5}),
    ("boards 1, 0 to 99", {"lost": None}),
    ("boards 1, 0 to 99", {"runs": "many"}),
    ("boards 1, 0 to 99", {"seconds": True}),
]


@pytest.mark.parametrize(("name", "change"), STRANGE)
def test_what_cannot_be_is_made_again(tmp_path: Path, name: str, change: dict[str, Any]) -> None:
    notes: list[str] = []
    found = read_pieces(written(tmp_path / "pieces", name, change), "a", notes.append)
    assert found.keys() == PIECES.keys() - {name}
    (note,) = notes
    assert "1 that are no pieces of a trade, computed again" in note


@pytest.mark.parametrize("elapsed", [None, -1.0, "1", True, [1.0]])
def test_a_piece_has_the_time_that_it_took(tmp_path: Path, elapsed: object) -> None:
    pieces = {
        name: {**piece, "elapsed": elapsed if k else 1.0}
        for k, (name, piece) in enumerate(PIECES.items())
    }
    path = tmp_path / "pieces"
    path.write_text(Lines("pieces", "a").text(plain(pieces)))
    assert read_pieces(path, "a").keys() == {"rungs 1"}
