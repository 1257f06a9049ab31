"""Every reader of files on many damaged ones: each is read, or refused by name in plain words.

``tests/folders/test_readers.py`` has a few accidents of bytes for each reader. Here values, keys,
rows and words are swapped too, and what once went wrong stands by itself.
"""

from __future__ import annotations

import io
import json
import struct
import tomllib
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from designer.base.errors import InputError
from designer.base.guarded_reading import reading
from designer.base.manifest import MANIFEST, read_manifest
from designer.base.printed import printable
from designer.base.seal import BLANK, sealed
from designer.board.bom_layouts import layouts
from designer.board.kicad_reader import BoardFile, read_board
from designer.board.kicad_rules import canary
from designer.board.sexpr import read
from designer.catalog.fab import fabs
from designer.catalog.read import FABS, LAYOUTS, read_catalog_file
from designer.catalog.stock_list import stock_rows
from designer.catalog.vendor_model import read_vendor_model
from designer.design_rules.kicad_drc import understood
from designer.design_rules.kicad_program import KicadFailed
from designer.explorer.board_box import expected
from designer.explorer.place import read_place
from designer.explorer.questions import read_question
from designer.explorer.response_map import read_map
from designer.explorer.saved_model import PinnedResponse, place_for, read_pins, saved_text
from designer.folders.study_cache import StudyCache
from designer.jobs.template import SECOND, TEXT, second_format
from designer.model.measured_values import read_measured
from designer.model.model_file import parse_model_file, read_model_file
from designer.routing.board_copper import read_copper
from designer.routing.specctra import with_session
from designer.spice.batch_backend import read_raw
from designer.spice.simulator import offending_line
from designer.workbench.record_formats import read_record
from tests.catalog.test_catalog import CSV
from tests.catalog.test_vendor_model import MODEL as VENDOR, ORDER
from tests.folders.test_readers import BOARD, MANIFEST_TEXT, MEASURED
from tests.shared.damaged import cells_swapped, damaged, json_of, lists_swapped, swapped, toml_of
from tests.shared.exploring import EXPLORING
from tests.shared.model_text import PAPER_TABLE

ROOT = Path(__file__).resolve().parents[2]
CATALOGS = ROOT / "catalogs"
Make = Callable[[Random], bytes]
EASY = list(HealthCheck)

MATRICES = """format = 2
[matrices]
names = ["middle", "tip"]
mass = [1.0, 0.5]
stiffness = [[16.0, -5.0], [-5.0, 2.0]]
damping = [[0.16, -0.05], [-0.05, 0.02]]
[[clearance]]
name = "A"
of = { tip = 1.0, middle = -0.4 }
upper = 0.2
lower = 0.2
stiffness = 20.0
[[force]]
on = "tip"
amplitude = 1.0
harmonics = [[2, 0.3, 0.1]]
[spread]
resistors = { law = "binned", inner = 0.002 }
temperature = [0, 50]
[rules.offset-force]
limit = 0.5
reason = "why"
"""
NAMED = MATRICES.replace("mass = [1.0, 0.5]", 'mass = "it.npy"')
SESSION = """(session board (base_design board) (placement (resolution um 10)) (was_is)
  (routes (resolution um 10) (parser) (network_out
    (net "/v1" (wire (path F.Cu 2500 0 0 10000 -5000 20000 0)) (via "Via" 10000 -5000)))))
"""
STOCK = """part_number,kind,value,case,grade,distributor,number,price_eur,from_pieces,date,source
RC0603FR-0722K1L,,,,,LCSC,C1,0.001,100,2025-01-31,a page
,resistor,22.1k,0603,0.01,LCSC,C2,,,2025-01-31,a page
,capacitor,100n,0603,0.05,LCSC,C3,0.01,,2025-01-31,a page
"""
TIMES = np.arange(150) * 1e-4
WAVE = np.sin(TIMES * 600.0)


def scope_text(between: str = ",") -> str:
    rows = (f"{t:.6f}{between}{v:.4f}" for t, v in zip(TIMES, WAVE, strict=True))
    return "\n".join([f"Time(s){between}CH1(V)", *rows, ""])


SCOPE = scope_text()


def npy(values: Any) -> bytes:
    stream = io.BytesIO()
    np.save(stream, values)
    return stream.getvalue()


def npz(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def headed(header: str, data: bytes = b"\0" * 64) -> bytes:
    """An ``.npy`` with any header."""
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(header)) + header.encode() + data


def small_tables() -> list[dict[str, Any]]:
    """A table of each kind in the catalogue, each as a file of its own."""
    files = (tomllib.loads(p.read_text("utf-8")) for p in sorted(CATALOGS.glob("*.toml")))
    named = ((key, value) for data in files for key, value in data.items())
    return [{"format": 1, key: value[:1]} for key, value in named if isinstance(value, list)]


def parsed(folder: str) -> list[dict[str, Any]]:
    return [tomllib.loads(p.read_text("utf-8")) for p in sorted(CATALOGS.glob(f"{folder}/*.toml"))]


PAPER = read_model_file(ROOT / "examples" / "paper.toml")
WORDS = {"omega": 0.85, "b": "0.25", "zeta": "0.1", "start": "0,0,0.1,-1e-3", "shown": 0}
ASKED: list[dict[str, Any]] = [
    {"kind": "view", "id": 1, "words": WORDS},
    {"kind": "map", "id": 2, "words": {}, "map": {"x": "omega", "y": "b", "x_low": "0.7"}},
    {"kind": "board", "id": 3, "words": WORDS, "expect": "1-2-2"},
    {"kind": "save", "id": 4, "words": WORDS, "name": "mine", "pins": ["0.85~1-2-2~0.25"]},
    {"kind": "run", "id": 5, "words": WORDS, "name": "it.toml", "pins": [], "overwrite": True},
]
RAW = (
    b"Title: t\nDate: today\nPlotname: Transient Analysis\nFlags: real\n"
    b"No. Variables: 2\nNo. Points: 3       \nVariables:\n"
    b"\t0\ttime\ttime\n\t1\tv(A)\tvoltage\nBinary:\n" + np.arange(6.0).tobytes()
)
LOG = """Circuit: * a title
Note: No compatibility mode selected!
Doing analysis at TEMP = 27.000000 and TNOM = 27.000000
Initial Transient Solution
v1                      0.001
error                   -1.5e-05
Warning: Dynamic gmin stepping failed
No. of Data Rows : 1234
"""
ITEMS = [
    {"uuid": "1", "pos": {"x": 1.0, "y": 2.5}, "description": "Track [/v1] on F.Cu, length 1 mm"},
    {"uuid": "2", "pos": {"x": -100.0, "y": -100.0}, "description": "Pad 1 [GND] of R4"},
]
MET = [
    {"type": "clearance", "severity": "error", "items": ITEMS,
     "description": "Clearance violation (rule 'summing-gap' clearance 0.5 mm; actual 0.2 mm)"},
    {"type": "track_width", "severity": "error", "items": ITEMS[:1],
     "description": f"Track width (board setup min width {canary().limit:.4f} mm; actual 0.1 mm)"},
    {"type": "shorting_items", "severity": "warning", "items": [], "description": "shorted"},
]  # fmt: skip
REPORT = {"violations": MET, "unconnected_items": MET[:1], "schematic_parity": MET[2:]}
KEPT_HEAD = {
    "format": 1,
    "items": {
        "it": [
            "key",
            {"record": ["Orbit", {
                "status": {"word": ["OrbitStatus", "periodic"]}, "n": 1, "p": 2, "q": 2,
                "start": {"array": 0}, "extremes": {"array": 1}, "multipliers": {"tuple": [0.5]},
                "more": {"tuple": [{"tuple": [1, 2]}]}, "reason": "",
            }]},
        ]
    },
}  # fmt: skip

MODELS = [p.read_text("utf-8") for p in sorted((ROOT / "examples").glob("*.toml"))]
MODELS += [TEXT, SECOND, MATRICES]
TREES = read(BOARD), read(SESSION)


def of_toml(tables: list[dict[str, Any]]) -> Make:
    return lambda dice: encoded(toml_of(swapped(dice.choice(tables), dice, moments=True)))


def of_bytes(*contents: str | bytes) -> Make:
    raw = [c if isinstance(c, bytes) else encoded(c) for c in contents]
    return lambda dice: damaged(dice.choice(raw), dice)


def of_cells(text: str, between: str = ",") -> Make:
    return lambda dice: encoded(cells_swapped(text, dice, between))


def encoded(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")


def model(path: Path) -> object:
    return read_model_file(path).model.second_order()


def matrix_file(path: Path) -> object:
    (path.parent / "model.toml").write_text(NAMED)
    return model(path.parent / "model.toml")


def fab(path: Path) -> object:
    return fabs([path.stem], [path.parent.parent])


def layout(path: Path) -> object:
    return layouts([path.stem], [path.parent.parent])


def vendor(path: Path) -> object:
    return read_vendor_model(path.name, "part", ORDER, path.parent)


def board(path: Path) -> object:
    return read_copper(read(read_board(path).text, path))


def session(path: Path) -> object:
    return read_copper(read(with_session(BOARD, path)))


def question(path: Path) -> object:
    """What a page asks, as far as the server reads it; nothing is computed, nothing is written."""
    asked = read_question(path.read_bytes())
    if asked is None:
        return None
    more = asked.more
    place = read_place(PAPER, asked.words)
    if asked.kind in ("map", "borders"):
        return read_map(PAPER, place, more.get("map")).plan
    if asked.kind == "board":
        pin = PinnedResponse(place.omega, expected(more.get("expect")), place.model.b)
        return saved_text(PAPER, place, [pin])
    if asked.kind == "view":
        return place.state
    saved = place_for(path.parent, more.get("name", ""))
    assert saved.parent == path.parent
    return saved_text(PAPER, place, read_pins(PAPER, more.get("pins", [])))


def raw_file(path: Path) -> object:
    """A raw file of ngspice; what is none is a ``ValueError`` there, a run that does not count."""
    with reading(path, "a raw file"):
        return [plot.vectors for plot in read_raw(path.read_bytes())]


def other_header(dice: Random) -> bytes:
    header = RAW[: RAW.index(b"Binary")].decode("ascii")
    return encoded(cells_swapped(header, dice, dice.choice((":", "\t", " "))))


def log_file(path: Path) -> object:
    return offending_line(path.read_bytes().decode("utf-8", "replace"))


def report(path: Path) -> object:
    """A report of KiCad; what is none is a ``KicadFailed``."""
    answer = json.loads(path.read_bytes())
    try:
        return understood(answer, "9.0.0", frozenset(), board_of_report(), (canary(),), sheet=True)
    except KicadFailed as why:
        raise InputError(path, "the report", str(why), "a report of KiCad") from None


@cache
def board_of_report() -> BoardFile:
    with TemporaryDirectory() as folder:
        path = Path(folder, "it.kicad_pcb")
        path.write_text(BOARD, encoding="utf-8")
        return read_board(path)


def kept(path: Path) -> object:
    return StudyCache(path, lambda *_: None).get("it", "key")


def kept_archive(dice: Random) -> bytes:
    """An orbit as a study keeps it, and as somebody else would: sealed all the same."""
    head = swapped(KEPT_HEAD, dice)
    stream = io.BytesIO()
    arrays: dict[str, Any] = {
        f"array{k}": dice.choice((np.eye(2), np.arange(3), np.array("a"))) for k in range(4)
    }
    np.savez_compressed(stream, items=np.array(json.dumps(head)), **arrays)
    with ZipFile(stream, "a") as archive:
        archive.comment = BLANK.encode("ascii")
    return sealed(stream.getvalue())


@dataclass(frozen=True)
class Fuzzed:
    """A reader, and what makes the files that it is given."""

    file: str
    """Name of the file, below the folder of a test."""
    read: Callable[[Path], object]
    make: Make
    slow: int = 4000
    """Files of the long test where failures are looked for; in CI it has a fifth, the short one a
    hundredth."""


SHARE = 1 if EXPLORING else 5
"""One file of so many is made by the long test."""

FUZZED: Mapping[str, Fuzzed] = {
    "model file, bytes": Fuzzed("it.toml", model, of_bytes(*MODELS), 6000),
    "model file, values": Fuzzed("it.toml", model, of_toml([*map(tomllib.loads, MODELS)]), 6000),
    "matrix": Fuzzed("it.npy", matrix_file, of_bytes(npy([1.0, 0.5]), npy(np.eye(2)))),
    "catalogue, bytes": Fuzzed(
        "it.toml", read_catalog_file, of_bytes(*map(toml_of, small_tables()))
    ),
    "catalogue, values": Fuzzed("it.toml", read_catalog_file, of_toml(small_tables()), 7000),
    "catalogue, cells": Fuzzed("it.csv", read_catalog_file, of_cells(CSV)),
    "stock list, bytes": Fuzzed("it.csv", stock_rows, of_bytes(STOCK)),
    "stock list, cells": Fuzzed("it.csv", stock_rows, of_cells(STOCK)),
    "fab": Fuzzed(f"{FABS}/it.toml", fab, of_toml(parsed(FABS)), 2500),
    "layout": Fuzzed(f"{LAYOUTS}/it.toml", layout, of_toml(parsed(LAYOUTS)), 2500),
    "vendor model, bytes": Fuzzed("it.lib", vendor, of_bytes(VENDOR.encode("latin-1"))),
    "vendor model, words": Fuzzed("it.lib", vendor, of_cells(VENDOR, " ")),
    "measured values, bytes": Fuzzed("it.csv", read_measured, of_bytes(MEASURED)),
    "measured values, cells": Fuzzed("it.csv", read_measured, of_cells(MEASURED)),
    "board, bytes": Fuzzed("it.kicad_pcb", board, of_bytes(BOARD)),
    "board, lists": Fuzzed(
        "it.kicad_pcb", board, lambda dice: encoded(lists_swapped(TREES[0], dice))
    ),
    "session, bytes": Fuzzed("it.ses", session, of_bytes(SESSION), 1500),
    "session, lists": Fuzzed(
        "it.ses", session, lambda dice: encoded(lists_swapped(TREES[1], dice)), 1500
    ),
    "manifest": Fuzzed(
        MANIFEST,
        lambda path: read_manifest(path.parent),
        lambda dice: json_of(swapped(json.loads(MANIFEST_TEXT), dice)),
    ),
    "page's question, bytes": Fuzzed("it.json", question, of_bytes(*map(json_of, ASKED)), 3000),
    "page's question, values": Fuzzed(
        "it.json", question, lambda dice: json_of(swapped(dice.choice(ASKED), dice)), 5000
    ),
    "ngspice's raw file, bytes": Fuzzed("it.raw", raw_file, of_bytes(RAW, RAW + RAW)),
    "ngspice's raw file, words": Fuzzed(
        "it.raw", raw_file, lambda dice: other_header(dice) + RAW[RAW.index(b"Binary") :], 2000
    ),
    "ngspice's log": Fuzzed("it.log", log_file, of_bytes(LOG), 1000),
    "KiCad's report": Fuzzed("it.json", report, lambda dice: json_of(swapped(REPORT, dice)), 3000),
    "kept archive": Fuzzed("kept.npz", kept, kept_archive, 2000),
    "record, bytes": Fuzzed("it.csv", read_record, of_bytes(SCOPE, scope_text(";")), 1500),
    "record, cells": Fuzzed("it.csv", read_record, of_cells(SCOPE), 1500),
    "record, array": Fuzzed(
        "it.npy", read_record, of_bytes(npy(np.column_stack([TIMES, WAVE]))), 1000
    ),
    "record, archive": Fuzzed("it.npz", read_record, of_bytes(npz(time=TIMES, v1=WAVE)), 1000),
}


def met(reader: Callable[[Path], object], path: Path) -> InputError | None:
    """How a file is refused; None where it is read. Anything else that is raised is a defect."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            reader(path)
    except InputError as error:
        refused = error
    else:
        return None
    text = str(refused)
    assert refused.field
    assert refused.expected
    assert text == printable(text)
    assert len(text) < 20_000
    return refused


def fuzz(name: str, folder: Path, count: int) -> None:
    fuzzed = FUZZED[name]
    path = folder / fuzzed.file
    path.parent.mkdir(exist_ok=True)

    @settings(max_examples=count, suppress_health_check=EASY, database=None)
    @given(st.integers(0, 2**40))
    def check(number: int) -> None:
        path.write_bytes(fuzzed.make(Random(number)))
        met(fuzzed.read, path)

    check()


@pytest.mark.parametrize("name", FUZZED)
def test_a_damaged_file_is_read_or_refused(name: str, tmp_path: Path) -> None:
    fuzz(name, tmp_path, max(FUZZED[name].slow // 100, 10))


@pytest.mark.slow
@pytest.mark.parametrize("name", FUZZED)
def test_many_damaged_files_are_read_or_refused(name: str, tmp_path: Path) -> None:
    """20,000 files in all, the same in each run; 100,000 new ones under the profile explore."""
    fuzz(name, tmp_path, FUZZED[name].slow // SHARE)


def test_the_long_test_has_as_many_files_as_it_says() -> None:
    files = sum(each.slow // SHARE for each in FUZZED.values())
    assert files == (100_000 if EXPLORING else 20_000)


# ---------------------------------------------------------------------------------------------
# What once went wrong

ONE_MASS = """format = 2
[[mass]]
name = "a"
mass = 1.0
[[spring]]
between = ["a", "ground"]
stiffness = 1.0
[[damper]]
between = ["a", "ground"]
damping = 0.1
[[force]]
on = "a"
amplitude = 1.0
"""
SEAT = """[[clearance]]
name = "A"
between = ["a", "ground"]
lower = 1.0
restitution = 0.7
"""
DIGITS = "9" * 40_000 + "x"
LONG_AMPLITUDE = ONE_MASS.replace("amplitude = 1.0", f'amplitude = "{DIGITS}"')
RESISTOR = tomllib.loads((CATALOGS / "resistors.toml").read_text("utf-8"))["family"][0]
BLANKS = {**RESISTOR, "temperature_coefficient": "x" + " " * 5000 + "y"}
REFUSED: dict[str, tuple[str, Callable[[Path], object], str | bytes, str]] = {
    "a restitution without a stiffness": (
        "it.toml",
        model,
        ONE_MASS + SEAT,
        "clearance A.stiffness",
    ),
    "a rate that is lost in the rounding": (
        "it.toml",
        model,
        ONE_MASS + '[[friction]]\nbetween = ["a", "ground"]\nforce = 1e9\nvelocity = 0.04\n',
        "damper.between",
    ),
    "a whole number that is no float, in a matrix": (
        "it.toml", model, MATRICES.replace("0.02]]", f"1{'0' * 400}]]"), "matrices.damping"
    ),
    "a whole number of 65 bits, in a matrix": (
        "it.toml", model, MATRICES.replace("0.02]]", f"{2**64 * 10**30}]]"), "damper.between"
    ),
    "a diagonal of ten thousand masses": (
        "it.toml", model, MATRICES.replace("[1.0, 0.5]", f"[{'1.0,' * 10_000}]"), "matrices.mass"
    ),
    "digits and a letter, as an amplitude": (
        "it.toml", model, LONG_AMPLITUDE, "amplitude"
    ),
    "digits and a letter, as a phase": (
        "it.toml", model, f'{ONE_MASS}phase = "{DIGITS}"\n', "phase"
    ),
    "digits and a letter, on a board": (
        "it.kicad_pcb", board, BOARD.replace("(at 10.5 20 90)", f"(at {DIGITS} 20 90)"), "line 3"
    ),
    "blanks in a coefficient": (
        "it.toml",
        read_catalog_file,
        toml_of({"format": 1, "family": [BLANKS]}),
        "temperature_coefficient",
    ),
    "a header without end": (
        "it.npy", matrix_file, headed("{'descr': '<f8', 'shape': (2"), "matrices.mass"
    ),
    "a header with two kinds of keys": (
        "it.npy", matrix_file, headed("{False: 1, 'descr': 2}"), "matrices.mass"
    ),
    "a type of a comma": (
        "it.npy",
        matrix_file,
        headed("{'descr': ',', 'fortran_order': False, 'shape': (2,)}"),
        "matrices.mass",
    ),
    "a type without an entry": (
        "it.npy",
        matrix_file,
        headed("{'descr': (), 'fortran_order': False, 'shape': (2,)}"),
        "matrices.mass",
    ),
    "a record without fields": (
        "it.npy",
        read_record,
        headed("{'descr': [], 'fortran_order': False, 'shape': (2,)}"),
        "the file",
    ),
}  # fmt: skip


@pytest.mark.timeout(20)
@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused_at_its_place(name: str, tmp_path: Path) -> None:
    file, reader, content, field = REFUSED[name]
    path = tmp_path / file
    path.write_bytes(content if isinstance(content, bytes) else encoded(content))
    error = met(reader, path)
    assert error is not None
    assert field in error.field


@pytest.mark.timeout(20)
@pytest.mark.parametrize("name", ["a" + " " * 50_000 + "b", "(" * 50_000])
def test_a_long_name_of_a_channel_is_cut(name: str, tmp_path: Path) -> None:
    path = tmp_path / "it.csv"
    rows = "\n".join(f"{k * 1e-3},{k % 7}" for k in range(20_000))
    path.write_text(f"Time(s),{name}\n{rows}\n")
    (channel,) = read_record(path).signals
    assert len(channel) <= 200


@pytest.mark.timeout(20)
def test_a_long_cell_of_digits_is_refused_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "it.csv"
    rows = "\n".join(f"{k * 1e-3},{k % 7}" for k in range(20_000))
    path.write_text(f"Time(s),CH1(V)\n{rows}\n20.0,{DIGITS}\n")
    error = met(read_record, path)
    assert error is not None
    assert error.field == "line 20002"


@pytest.mark.timeout(20)
def test_blanks_in_a_list_are_rewritten_in_no_time() -> None:
    blanks = " " * 100_000
    text = f'format = 1\n{PAPER_TABLE}[circuit]\nresistors = ["E24",{blanks}"E96"]\n'
    assert blanks in second_format(parse_model_file(text))


def test_an_array_of_python_2_is_read_in_silence(tmp_path: Path) -> None:
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2L,), }"
    (tmp_path / "it.npy").write_bytes(headed(header, np.array([1.0, 0.5]).tobytes()))
    assert met(matrix_file, tmp_path / "it.npy") is None
