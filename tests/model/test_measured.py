"""A bench's list of measured values: read, refused, and drawn from; in a design folder."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from designer.base.design_folder import is_design_folder
from designer.base.errors import InputError
from designer.catalog.parts_catalog import load_catalog
from designer.cli import entry
from designer.folders.model_source import model_file
from designer.model.measured_values import read_measured
from designer.model.model_file import parse_model_file, read_model_file
from designer.spread.part_rules import spread_of
from designer.spread.spread import BOARD, Spread, draw_many
from tests.jobs.test_kicad_export import MODEL as LINEAR
from tests.spread.test_spread_model import CATALOG, CIRCUIT, PAPER, RECTIFIER

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

ROOT = Path(__file__).resolve().parents[2]
NOMINAL = CIRCUIT.values
ONE = """\
part,value,tolerance
R1,100.2k,0.1%
C2,"99.1 nF",
U1A.offset,-1.3mV,50µV
U1A.high,13.4 V,
U1A.low,-13.1,
U1B.bias,40pA,0.5
U1B.gbw,2.9MHz,
VCC,14.93V,
"""


def listed(folder: Path, text: str | bytes, circuit: object = CIRCUIT, more: str = "") -> Spread:
    """The spread of the paper's model file with this list."""
    folder.mkdir(exist_ok=True)
    content = text.encode("utf-8") if isinstance(text, str) else text
    (folder / "bench.csv").write_bytes(content)
    model = folder / "model.toml"
    model.write_text(f'{PAPER}\n[spread]\nmeasured = "bench.csv"\n{more}', encoding="utf-8")
    return spread_of(read_model_file(model), circuit, CATALOG)  # type: ignore[arg-type]


def test_measured_parts_have_their_values_and_others_spread(tmp_path: Path) -> None:
    spread = listed(tmp_path, ONE)
    boards = draw_many(CIRCUIT, spread, 1, range(4000))
    r1 = boards.values["R1"]
    assert r1.min() >= 100.2e3 * 0.999
    assert r1.max() <= 100.2e3 * 1.001
    assert r1.std() == pytest.approx(100.2 / math.sqrt(3.0), rel=0.05)
    assert set(boards.values["C2"]) == {99.1e-9}
    offset = boards.offset["U1A"]
    assert (offset.min(), offset.max()) == (
        pytest.approx(-1.35e-3, rel=1e-3),
        pytest.approx(-1.25e-3, rel=1e-3),
    )
    assert set(boards.high["U1A"]) == {13.4}
    assert set(boards.low["U1A"]) == {-13.1}
    assert boards.bias["U1B"].std() == pytest.approx(20e-12 / math.sqrt(3.0), rel=0.05)
    assert set(boards.gain_bandwidth) == {"U1B"}
    assert set(boards.gain_bandwidth["U1B"]) == {2.9e6}
    assert {name: set(v) for name, v in boards.supply.items()} == {"VCC": {14.93}}
    bench = draw_many(CIRCUIT, spread_of(parse_model_file(PAPER), CIRCUIT, CATALOG), 1, range(4000))
    for name in set(NOMINAL) - {"R1", "C2"}:
        assert np.array_equal(boards.values[name], bench.values[name])
    # The rail's distance stays for the sections that were not measured.
    assert boards.high["U2A"] == pytest.approx(bench.high["U2A"] - 0.07, abs=1e-12)
    assert np.array_equal(boards.low["U2A"], bench.low["U2A"])
    assert spread.name != "bench-1"
    assert spread.as_dict()["measured"]["parts"] == sorted(
        ["R1", "C2", "U1A.offset", "U1A.high", "U1A.low", "U1B.bias", "U1B.gbw", "VCC"]
    )


def test_a_measured_part_still_warms_up_and_ages(tmp_path: Path) -> None:
    """The list is of the bench, at 25 °C."""
    more = 'temperature = [35, 35]\n[[spread.part]]\nnames = "resistors"\ntempco = [1e-3, 1e-3]\n'
    more += '[[spread.part]]\nnames = "capacitors"\ntempco = 0\nageing = [0.02, 0.02]\n'
    spread = listed(tmp_path, "part,value\nR1,100k\nC2,100n\n", more=more)
    boards = draw_many(CIRCUIT, spread, 1, range(3))
    assert boards.values["R1"] == pytest.approx(100e3 * 1.01, rel=1e-12)
    assert boards.values["C2"] == pytest.approx(100e-9 * 1.02, rel=1e-12)


def test_several_boards_in_turn(tmp_path: Path) -> None:
    """The samples of a study are the boards, one after the other, and then again."""
    text = (
        "board,part,value,tolerance\n"
        "left,R1,99k,\nleft,R2,149k,\nright,R1,101k,\nthird,R1,100.5k,100Ω\n"
    )
    spread = listed(tmp_path, text.replace("149k", f"{NOMINAL['R2'] * 1.004!r}"))
    assert spread.measured is not None
    assert spread.measured.boards == ("left", "right", "third")
    boards = draw_many(CIRCUIT, spread, 1, range(4, 13))
    which = np.arange(4, 13) % 3
    assert set(boards.values["R1"][which == 0]) == {99e3}
    assert set(boards.values["R1"][which == 1]) == {101e3}
    third = boards.values["R1"][which == 2]
    assert np.all(np.abs(third - 100.5e3) <= 100.0)
    assert len(set(third)) == 3
    # Measured on one board only: drawn on the others.
    r2 = boards.values["R2"]
    assert set(r2[which == 0]) == {NOMINAL["R2"] * 1.004}
    assert len(set(r2[which != 0])) == 6
    names = spread.coordinates(CIRCUIT)
    assert names.count(BOARD) == 1
    # By the cube: a third of the numbers each.
    cube = np.full((4, len(names)), 0.5)
    cube[:, names.index(BOARD)] = [0.0, 0.34, 0.66, 0.999999]
    drawn = spread.from_cube(CIRCUIT, cube).values["R1"]
    assert drawn == pytest.approx([99e3, 101e3, 101e3, 100.5e3])


def test_references_of_the_rectifier(tmp_path: Path) -> None:
    spread = listed(tmp_path, "part,value\nVR1,5.012V\nVEE,-15.2\n", RECTIFIER)
    boards = draw_many(RECTIFIER, spread, 1, range(5))
    assert set(boards.reference["VR1"]) == {5.012}
    assert len(set(boards.reference["VR2"])) == 5
    assert set(boards.supply["VEE"]) == {-15.2}


R = f"R1,{NOMINAL['R1']!r}\n"
REFUSED = [
    # text, where, part of what was found, part of what was expected
    ("", "line 1", "", "columns part, value"),
    ("part,value\n", "line 1", "no measured value", "a line for each part"),
    ("part;value\nR1;100k\n", "line 1", "part;value", "one of part, value"),
    ("part,values\nR1,100k\n", "line 1", "values", 'did you mean "value"?'),
    ("part,part,value\nR1,R1,100k\n", "line 1", "part,part,value", "columns part, value"),
    ("part,tolerance\nR1,100k\n", "line 1", "part,tolerance", "columns part, value"),
    (f"part,value,tolerance\n{R[:-1]},1%\nR2", "line 3", "1 cells", "3, as the header"),
    (f'part,value\n{R}R2,"99', "line 3", "unexpected end", "a CSV file"),
    (f"part,value\n{R}R2,\n", "line 3", "", "a value in Ω"),
    (f"part,value\n{R}R2,much\n", "line 3", "much", "a value in Ω"),
    (f"part,value\n{R}R2,nan\n", "line 3", "nan", "a value in Ω"),
    (f"part,value\n{R}R2,1e999\n", "line 3", "1e999", "a value in Ω"),
    (f"part,value\n{R}C2,100k\n", "line 3", "C2, 100kF", "a value within 50nF to 200nF"),
    (f"part,value\n{R}C2,100V\n", "line 3", "100V", "a value in F"),
    (f"part,value\n{R}{R}", "line 3", "R1 a second time", "each part once"),
    ("part,value\nQ1,1\n", "line 2", "Q1", "a part such as R203"),
    ("part,value\nU1A,1\n", "line 2", "U1A", "a part such as R203"),
    ("part,value\nU1A.slew,1\n", "line 2", "U1A.slew", "a part such as R203"),
    (f"part,value\n{R}R999,100k\n", "line 3", "R999", "a part of this design"),
    ("part,value\nVR1,5\n", "line 2", "VR1", "a part of this design"),
    ("part,value\nR1,-100k\n", "line 2", "R1, -100k", "a value within 50kΩ to 200kΩ"),
    ("part,value\nR1,100\n", "line 2", "R1, 100", "a value within 50kΩ to 200kΩ"),
    ("part,value\nVEE,15\n", "line 2", "VEE, 15V", "a value within -30V to -7.5V"),
    ("part,value\nU1A.low,13\n", "line 2", "U1A.low", "-30V to 0V"),
    ("part,value,tolerance\nR1,100k,-1%\n", "line 2", "-1%", "not below 0"),
    ("part,value,tolerance\nR1,100k,much\n", "line 2", "much", 'a fraction, "0.1%"'),
    ("part,value,tolerance\nR1,100k,nan\n", "line 2", "nan", 'a fraction, "0.1%"'),
    ("part,value,tolerance\nR1,100k,10V\n", "line 2", "10V", 'a fraction, "0.1%"'),
    ("part,value,board\nR1,100k,\n", "line 2", "no board", "the name of the board"),
    ("part,value,board\nR1,100k,a\nR1,99k,a\n", "line 3", "R1 a second", "once a board"),
    (b"part,value\nR1,\xff\n", "line 2", "byte 0xff", "UTF-8"),
]


@pytest.mark.parametrize(("text", "where", "found", "expected"), REFUSED)
def test_what_is_wrong_with_a_list(
    tmp_path: Path, text: str | bytes, where: str, found: str, expected: str
) -> None:
    with pytest.raises(InputError) as caught:
        listed(tmp_path, text)
    error = caught.value
    assert str(error.file).endswith("bench.csv")
    assert error.field == where
    assert found in str(error.found)
    assert expected in error.expected


def test_spaces_empty_lines_and_a_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "list.csv"
    path.write_bytes("\ufeffpart , value\r\n\r\n R1 , 100k \r\n".encode())
    assert read_measured(path).values == {"R1": (100e3,)}


@pytest.mark.parametrize("name", ["../bench.csv", "/etc/hostname", "none.csv", "link.csv", "."])
def test_the_list_lies_beside_the_model_file(tmp_path: Path, name: str) -> None:
    (tmp_path / "bench.csv").write_text("part,value\nR1,100k\n")
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "link.csv").symlink_to(tmp_path / "bench.csv")
    model = inner / "model.toml"
    model.write_text(f'{PAPER}\n[spread]\nmeasured = "{name}"\n')
    with pytest.raises(InputError) as caught:
        read_model_file(model)
    assert caught.value.field == "spread.measured"
    assert str(caught.value.file) == str(model)
    assert ("does not exist" in str(caught.value.found)) is (name == "none.csv")


def test_too_long_a_list(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="4000000 bytes"):
        listed(tmp_path, "part,value\n" + "\n" * 4_000_000)


def test_a_text_without_a_file_has_no_list() -> None:
    modelfile = parse_model_file(f'{PAPER}\n[spread]\nmeasured = "bench.csv"\n')
    with pytest.raises(InputError, match="a model file on disk"):
        spread_of(modelfile, CIRCUIT, load_catalog())


@pytest.mark.slow
def test_a_design_folder_keeps_the_list_and_notices_another(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    home, out, moved = tmp_path / "home", tmp_path / "out", tmp_path / "moved"
    (home / "bench").mkdir(parents=True)
    table = home / "bench" / "list.csv"
    model = home / "model.toml"
    # Without stops and responses, the quickest design: it is made four times.
    model.write_text(f'{LINEAR}\n[spread]\nmeasured = "bench/list.csv"\n', encoding="utf-8")
    table.write_text("part,value\nR999,100k\n")

    def synthesise(*options: str, target: Path = out) -> tuple[int, str]:
        source = [str(target)] if target != out else [str(model), "--out", str(out)]
        status = entry.status(["synthesise", *source, "-q", *options])
        return status, capfd.readouterr().err

    status, said = synthesise()
    assert status == 2
    assert "list.csv: line 2: found R999, expected a part of this design" in said
    assert not out.exists()
    text = "part,value\nVCC,14.93\n"
    table.write_text(text)
    assert synthesise()[0] == 0
    assert (out / "measured.csv").read_text() == text
    listed_ = json.loads((out / "manifest.json").read_text())["files"]
    assert "measured.csv" in listed_
    assert synthesise()[0] == 0  # the same again: nothing to do

    out.rename(moved)
    read = model_file(moved / "model.toml")
    assert read.measured is not None
    assert read.measured.values == {"VCC": (14.93,)}
    assert synthesise(target=moved)[0] == 0
    moved.rename(out)

    table.write_text(text.replace("14.93", "14.94"))
    status, said = synthesise()
    assert status == 2
    assert "measured" in said
    assert (out / "measured.csv").read_text() == text
    assert synthesise("--overwrite")[0] == 0
    assert (out / "measured.csv").read_text() == table.read_text()

    (out / "measured.csv").write_text(text)
    out.rename(moved)
    status, said = synthesise(target=moved)
    assert status == 2
    assert "measured" in said
    (moved / "measured.csv").unlink()
    status, said = synthesise(target=moved)
    assert status == 2
    assert "measured.csv" in said
    assert is_design_folder(moved)
