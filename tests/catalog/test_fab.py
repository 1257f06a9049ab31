"""Makers of boards as data: rotations and what is wrong with a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.board.bom_layouts import layouts
from designer.catalog.fab import Fab, fabs
from designer.catalog.read import FABS
from tests.shared.stages import CATALOG

HEAD = 'format = 1\ntitle = "A"\nbom = "kicad"\n'
COLUMN = 'column = [{ title = "Ref", field = "reference" }]\n'


def shipped(name: str) -> Fab:
    (fab,) = fabs([name], CATALOG.folders)
    return fab


def own(folder: Path, text: str) -> Fab:
    (folder / FABS).mkdir()
    (folder / FABS / "own.toml").write_text(text, encoding="utf-8")
    (fab,) = fabs(["own"], [folder, *CATALOG.folders])
    return fab


@pytest.mark.parametrize(
    ("footprint", "kicad", "bottom", "angle"),
    [
        ("R_0603_1608Metric", 90.0, False, 90.0),
        ("SOIC-14_3.9x8.7mm_P1.27mm", 0.0, False, 270.0),
        ("SOIC-14_3.9x8.7mm_P1.27mm", 180.0, False, 90.0),
        ("SOT-23", 270.0, False, 90.0),
        ("R_0603_1608Metric", 30.0, True, 150.0),
    ],
)
def test_the_assembler_s_angles(footprint: str, kicad: float, bottom: bool, angle: float) -> None:
    assert shipped("jlcpcb").rotation(footprint, kicad, bottom) == angle
    assert shipped("generic").rotation(footprint, kicad, bottom) == kicad


def test_a_fab_of_one_s_own_comes_first_and_its_first_pattern_counts(tmp_path: Path) -> None:
    turns = "".join(
        f'[[rotation]]\nfootprint = "{name}"\ndegrees = {angle}\nsource = "mine"\n'
        for name, angle in (("SOT-23-5*", 90), ("SOT-23*", -90))
    )
    fab = own(tmp_path, HEAD + COLUMN + turns)
    assert fab.rotation("SOT-23-5", 0.0, False) == 90.0
    assert fab.rotation("SOT-23", 0.0, False) == 270.0
    assert (fab.side(False), fab.side(True)) == ("top", "bottom")


def test_the_shipped_fabs_name_layouts_that_there_are() -> None:
    for fab in fabs(["jlcpcb", "generic", "jlcpcb"], CATALOG.folders):
        assert layouts([fab.table.bom], CATALOG.folders)
        assert fab.table.steps
        assert fab.table.sources


@pytest.mark.parametrize(
    ("text", "field"),
    [
        (HEAD, "column"),
        (HEAD + "column = []", "column"),
        (HEAD + COLUMN.replace("]", ', { title = "Ref", field = "x" }]'), "column"),
        (HEAD + COLUMN.replace("reference", "referenz"), "column[1].field"),
        (HEAD + COLUMN + "botom = 1", "botom"),
        (HEAD + COLUMN + '[[rotation]]\nfootprint = "A"\ndegrees = 361\nsource = "s"',
         "rotation[1].degrees"),
        (HEAD.replace("1", "2") + COLUMN, "format"),
    ],
)  # fmt: skip
def test_wrong_fabs_are_named(tmp_path: Path, text: str, field: str) -> None:
    with pytest.raises(InputError) as caught:
        own(tmp_path, text)
    assert caught.value.field == field
    assert str(caught.value).startswith(str(tmp_path))


def test_an_unknown_fab_is_answered_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r'one of generic, jlcpcb; did you mean "jlcpcb"\?'):
        fabs(["jlpcb"], CATALOG.folders)
