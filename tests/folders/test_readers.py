"""Every reader of files on files that are not what they ought to be: each says so by name, or reads
them, and nothing else comes out."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from designer.base.design_folder import DESIGN, Folder
from designer.base.errors import InputError
from designer.base.guarded_reading import csv_rows, parse_json, read_bytes, read_text, reading
from designer.base.keyed_store import KeyedStore
from designer.base.manifest import MANIFEST, read_json
from designer.base.parquet_entry import ParquetCodec
from designer.base.report_pieces import check_report_folder
from designer.board.bom_layouts import layouts
from designer.board.kicad_reader import read_board
from designer.catalog.parts_catalog import load_catalog
from designer.catalog.read import read_catalog_file
from designer.catalog.vendor_model import read_vendor_model
from designer.folders.design_files import load, starts
from designer.folders.design_source import read_design
from designer.folders.study_cache import StudyCache
from designer.model.find_responses import peaks
from designer.model.measured_values import read_measured
from designer.model.model_file import read_model_file
from tests.catalog.test_catalog import CSV
from tests.catalog.test_vendor_model import MODEL as VENDOR, ORDER
from tests.folders.test_study_cache import ATTRIBUTION, kept
from tests.shared.model_text import COARSE_CIRCUIT, PAPER_TABLE
from tests.shared.quick_folders import quick_folder

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

ROOT = Path(__file__).resolve().parents[2]
QUICK = settings(max_examples=25, suppress_health_check=list(HealthCheck))
Reader = Callable[[Path], object]
BOARD = """(kicad_pcb (version 20241229) (generator "pcbnew")
  (net 0 "") (net 1 "/v1")
  (footprint "R_0805" (layer "F.Cu") (at 10.5 20 90)
    (property "Reference" "R1") (property "Value" "22.1k")
    (fp_rect (start -1 -1) (end 1 1) (layer "F.CrtYd"))
    (pad "1" smd roundrect (at -1 0 90) (size 1 1.4) (net 1 "/v1"))
    (pad "2" smd custom (at 1 0 90) (size 1 1) (net 1 "/v1")
      (primitives (gr_poly (pts (xy 0 0) (xy 1 1) (xy 0 1)) (width 0.1)))))
  (gr_arc (start 0 0) (mid 1 1) (end 2 0) (layer "Edge.Cuts"))
  (gr_line (start 2 0) (end 0 0) (layer "Edge.Cuts"))
  (segment (start 0 0) (end 1e1 5) (width 0.25) (layer "F.Cu") (net 1))
  (arc (start 0 0) (mid 1 1) (end 2 0) (width 0.25) (layer "F.Cu") (net 1)))
"""
MEASURED = (
    'part,value,tolerance,board\nR203,22.13k,0.1%,a\n"C1",98.1nF,,a\nU1A.offset,2.1mV,10uV,a\n'
)


def nothing(_name: str, _content: bytes) -> None:
    """Writes nothing."""


def parquet(path: Path) -> object:
    """A block without a seal that a manifest vouches for: its bytes reach the library."""
    schema = pa.schema([("sample", pa.int64()), ("reason", pa.string())])
    store = KeyedStore(path.parent, ParquetCodec(schema), vouch=lambda *_: True)
    return store.read(path.name, {"study": "a"})


def parquet_bytes() -> bytes:
    schema = pa.schema([("sample", pa.int64()), ("reason", pa.string())])
    rows = [{"sample": i, "reason": "why" * i} for i in range(20)]
    return ParquetCodec(schema).encode({"study": "a", "rows": 20}, rows)


def npz_bytes(folder: Path) -> bytes:
    kept(folder / "it.npz").put("blame", "key", ATTRIBUTION)
    return (folder / "it.npz").read_bytes()


def layout(path: Path) -> object:
    place = path.parent / "bom-layouts"
    place.mkdir(exist_ok=True)
    (place / "own.toml").write_bytes(path.read_bytes())
    return layouts(["own"], [path.parent])


READERS: dict[str, tuple[str, Reader]] = {
    "model file": ("model.toml", read_model_file),
    "catalogue, TOML": ("own.toml", read_catalog_file),
    "catalogue, CSV": ("own.csv", read_catalog_file),
    "layout": ("layout.toml", layout),
    "measured values": ("measured.csv", read_measured),
    "vendor model": ("part.lib", lambda p: read_vendor_model(p.name, "part", ORDER, p.parent)),
    "board": ("some.kicad_pcb", read_board),
    "Parquet": ("block-000000.parquet", parquet),
    "archive": (
        "kept.npz",
        lambda p: StudyCache(p, nothing, vouch=lambda *_: True).get("blame", "key"),
    ),
    "JSON": ("some.json", read_json),
    "manifest": (MANIFEST, lambda p: Folder(p.parent)),
    "setup table": ("setup.csv", lambda p: starts(Folder(p.parent / "none")) or p),
}
MANIFEST_TEXT = json.dumps(
    {
        "format": 1,
        "tool": "designer",
        "complete": False,
        "stages": {
            "study": {
                "inputs": {"layers": ["samples"], "seed": 1},
                "complete": False,
                "kept": {"trade": None},
            }
        },
        "files": {"tolerance.json": {"stage": "study", "sha256": None}},
        "provenance": {"seed": 1},
    }
)


@pytest.fixture(scope="module")
def contents(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What each reader reads, whole."""
    model = "format = 1\n" + PAPER_TABLE + '[[response]]\nomega = 0.85\nexpect = "1-2-2"\n'
    return {
        "model file": (model + COARSE_CIRCUIT).encode(),
        "catalogue, TOML": (ROOT / "catalogs" / "prices.toml").read_bytes(),
        "catalogue, CSV": CSV.encode(),
        "layout": (ROOT / "catalogs" / "bom-layouts" / "jlcpcb.toml").read_bytes(),
        "measured values": MEASURED.encode(),
        "vendor model": VENDOR.encode(),
        "board": BOARD.encode(),
        "Parquet": parquet_bytes(),
        "archive": npz_bytes(tmp_path_factory.mktemp("npz")),
        "JSON": b'{"format": 1, "a": [1, 2.5e3, null, {"b": "\\u00e9"}]}',
        "manifest": MANIFEST_TEXT.encode(),
    }


NAMES = [name for name in READERS if name != "setup table"]


def met(read: Reader, path: Path) -> object:
    """What is read; None where it is refused by name. Anything else that is raised is a defect."""
    try:
        return read(path)
    except InputError as error:
        wrong = error
    assert wrong.file is not None
    assert wrong.field
    assert wrong.expected
    return None


@pytest.mark.parametrize("name", NAMES)
def test_the_whole_file_is_read(name: str, contents: dict[str, bytes], tmp_path: Path) -> None:
    file, read = READERS[name]
    (tmp_path / file).write_bytes(contents[name])
    assert read(tmp_path / file) is not None


def mutated(content: bytes, random_: random.Random) -> bytes:
    """The content after one to three accidents."""
    for _ in range(random_.randint(1, 3)):
        place = random_.randrange(len(content) + 1)
        kind = random_.choice(("flip", "cut", "insert", "repeat", "drop"))
        if kind == "flip" and place < len(content):
            byte = content[place] ^ 1 << random_.randrange(8)
            content = content[:place] + bytes([byte]) + content[place + 1 :]
        elif kind == "cut":
            content = content[:place]
        elif kind == "insert":
            content = content[:place] + random_.choice(INSERTED) + content[place:]
        elif kind == "repeat":
            content = content[:place] + content[place : place + 40] * 3 + content[place:]
        else:
            content = content[:place] + content[place + random_.randint(1, 40) :]
    return content


INSERTED = (
    b"\x00", b"\xff\xfe", "²".encode(), b"nan", b"1e308", b"-1e999", b"9" * 5000, b"[" * 3000,
    b"(" * 3000, b'"', b"'''", b"\r", b"\n", b"=1", b"{", b"x" * 200_000, b"[[a]]\n", b"1_0",
)  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_mutated_bytes_are_read_or_refused(
    name: str, contents: dict[str, bytes], tmp_path: Path
) -> None:
    file, read = READERS[name]
    path = tmp_path / file

    @QUICK
    @given(st.randoms(use_true_random=False))
    def check(random_: random.Random) -> None:
        path.write_bytes(mutated(contents[name], random_))
        met(read, path)

    check()


@pytest.mark.parametrize("name", NAMES)
def test_what_is_no_file_is_refused(name: str, tmp_path: Path) -> None:
    """Nothing there, a folder, an empty file, a file of other bytes, one without an end."""
    file, read = READERS[name]
    path = tmp_path / "place" / file
    path.parent.mkdir()
    if name == "layout":  # the folder of layouts is asked for names, not for paths
        return
    # Without a manifest, or with a folder of its name, it is no design folder; a model that is not
    # there is refused in the name of the catalogue's file.
    if name not in ("manifest", "vendor model"):
        assert met(read, path) is None
        path.mkdir()
        assert met(read, path) is None
        path.rmdir()
    several = [] if name == "catalogue, CSV" else [b""]  # a table without a row
    for content in (
        *several,
        b"\x00" * 99,
        b"\xff" * 99,
        b"[" * 100_000,
        b"(" * 100_000,
        b'{"a":' * 9999,
    ):
        path.write_bytes(content)
        assert met(read, path) is None


@pytest.mark.parametrize(
    ("found", "instead"),
    [
        ("(version 20241229)", "(version ²)"),
        ("(version 20241229)", f"(version {'9' * 5000})"),
        ("(version 20241229)", "(version 1e3)"),
        ("(size 1 1.4)", "(size nan 1)"),
        ("(size 1 1.4)", "(size 1e308 -1e308)"),
        ("(size 1 1.4)", "(size ١ 1)"),
        ("(size 1 1.4)", "(size 1_0 1)"),
        ("(size 1 1.4)", "(size 1 inf)"),
        ("(at 10.5 20 90)", "(at 1e999 20 90)"),
    ],
)
def test_numbers_of_a_board(found: str, instead: str, tmp_path: Path) -> None:
    path = tmp_path / "some.kicad_pcb"
    path.write_text(BOARD.replace(found, instead))
    with pytest.raises(InputError, match=r"some\.kicad_pcb: line \d+, column \d+: found \("):
        read_board(path)
    path.write_text(BOARD)
    assert len(read_board(path).tracks) == 2


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("[" * 100_000, "nested too deeply"),
        ('{"a": ' * 100_000, "nested too deeply"),
        ("9" * 5000, "too many digits"),
        ("1e999", "too large a number"),
        ("[NaN]", "NaN"),
        ('{"a": -Infinity}', "-Infinity"),
        ('{"a": 1', "delimiter"),
        ("", "Expecting value"),
    ],
)
def test_json_that_is_none(text: str, found: str) -> None:
    with pytest.raises(InputError, match=found) as raised:
        parse_json(text, "some.json")
    assert str(raised.value).startswith("some.json: the file: found ")


def test_json_in_other_bytes() -> None:
    with pytest.raises(InputError, match=r"line 2: found byte 0xff, expected text in UTF-8"):
        parse_json(b'{\n"a": "\xff"}', "some.json")


def test_rows_of_a_table() -> None:
    assert list(csv_rows('a,b\n"x\ny",2\n', "t.csv")) == [(1, ["a", "b"]), (3, ["x\ny", "2"])]
    for text, line in (("a\n" + "x" * 200_000, 2), ('a\n"x" y', 2)):
        with pytest.raises(InputError, match=rf"t\.csv: line {line}: found .*a CSV file"):
            list(csv_rows(text, "t.csv"))


@pytest.mark.parametrize("place", ["nothing", "folder", "large", "device"])
def test_bytes_of_what_is_no_file(place: str, tmp_path: Path) -> None:
    path = tmp_path / "some"
    if place == "folder":
        path.mkdir()
    elif place == "large":
        path.write_bytes(b"12345")
    elif place == "device":
        path = Path("/dev/null")
    with pytest.raises(InputError, match="expected words") as raised:
        read_bytes(path, "words", "--option", most=4)
    assert (raised.value.file, raised.value.field) == (str(path), "--option")


def test_text_without_a_mark(tmp_path: Path) -> None:
    path = tmp_path / "some"
    path.write_bytes("\ufeffé\n".encode())
    assert read_text(path, "words", most=6) == "é\n"


def test_a_defect_outside_the_file_stays_one() -> None:
    """An error that no file can cause is not turned into the file's fault."""
    with pytest.raises(KeyboardInterrupt), reading("some", "words"):
        raise KeyboardInterrupt
    with pytest.raises(InputError, match="mine"), reading("some", "words"):
        raise InputError("other", "mine", 1, "2")


def test_a_report_s_folder_with_nested_json(tmp_path: Path) -> None:
    (tmp_path / "data.json").write_text("[" * 100_000)
    with pytest.raises(InputError, match=r"data\.json"):
        check_report_folder(tmp_path, ["data.json"], "data.json", "trade")


# ---------------------------------------------------------------------------------------------
# The files of a design folder


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> Path:
    text = "format = 1\n" + PAPER_TABLE + COARSE_CIRCUIT
    return quick_folder(text, tmp_path_factory.mktemp("readers") / "design")


def places(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where there is a value in JSON data."""
    inner: list[tuple[Any, Any]] = list(value.items()) if isinstance(value, dict) else []
    inner += enumerate(value[:2]) if isinstance(value, list) else []
    return [at, *(place for key, part in inner for place in places(part, (*at, key)))]


def with_other(value: Any, place: tuple[Any, ...], other: Any) -> Any:
    """The data with another value at this place."""
    if not place:
        return other
    copy = dict(value) if isinstance(value, dict) else list(value)
    copy[place[0]] = with_other(value[place[0]], place[1:], other)
    return copy


def _state(path: Path) -> str:
    return Folder(path.parent).state("study", {"layers": ["samples", "tuned"], "seed": 1})


OTHERS: tuple[Any, ...] = (None, True, -1, 0, 1.5e300, "", "nan", [], [[]], {}, {"a": []}, 10**299)


def test_other_types_in_a_manifest(tmp_path: Path) -> None:
    """Each value of it swapped for each other kind; also what stands among the layers."""
    whole = json.loads(MANIFEST_TEXT)
    path = tmp_path / MANIFEST
    for place in places(whole):
        for other in OTHERS:
            path.write_text(json.dumps(with_other(whole, place, other)))
            met(_state, path)
    layers = ("stages", "study", "inputs", "layers")
    for other in ([["samples"]], {"samples": 1}, [1], 3):
        path.write_text(json.dumps(with_other(whole, layers, other)))
        with pytest.raises(InputError, match=r"stages\.study\.inputs\.layers"):
            Folder(tmp_path)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # parts from 1e-300 to 1e300
def test_other_types_in_a_design(design: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The manifest states no hash of it, as while a later stage is about to write it anew."""
    made = read_design(design)
    folder, catalog = Folder(design), load_catalog()
    assert folder.manifest is not None
    folder.manifest.files[DESIGN] = ("design", None)
    highest = peaks(made.modelfile.model, made.model_responses)
    monkeypatch.setattr("designer.folders.design_files.find", lambda *_: made.model_responses)
    monkeypatch.setattr("designer.folders.design_files.peaks", lambda *_: highest)
    path, before = design / DESIGN, (design / DESIGN).read_bytes()
    whole = json.loads(before)
    wanted = [p for p in places(whole) if not p or p[0] not in ("provenance", "knobs", "model")]
    dice = random.Random(1)
    try:
        for place in wanted:
            path.write_text(json.dumps(with_other(whole, place, dice.choice(OTHERS))))
            met(lambda _: load(folder, made.modelfile, catalog), path)
        for value in (0.0, -1.0, "100k", True, None):
            part = next(iter(whole["parts"]))
            path.write_text(json.dumps(with_other(whole, ("parts", part), value)))
            with pytest.raises(InputError, match=rf"design\.json: parts\.{part}: found"):
                load(folder, made.modelfile, catalog)
        path.write_text("[" * 100_000)
        with pytest.raises(InputError, match="nested too deeply"):
            load(folder, made.modelfile, catalog)
        conditions = whole["conditions"]
        first, *others = conditions["checked"]
        for quantity in (first["quantity"], "rectifier_fv_v"):  # as versions wrote the second
            endless = {**first, "quantity": quantity, "limit": None}
            for more in ({quantity: None}, {}):
                changed = {**conditions, "checked": [endless, *others], **more}
                path.write_text(json.dumps({**whole, "conditions": changed}))
                if quantity == first["quantity"]:
                    with pytest.raises(InputError, match=r"design\.json"):
                        load(folder, made.modelfile, catalog)
                else:
                    again = load(folder, made.modelfile, catalog).design
                    assert again.checks == made.design.checks[1:]
                    assert quantity not in again.conditions
    finally:
        path.write_bytes(before)


def test_a_changed_design_is_refused(design: Path) -> None:
    """One digit of a part, in a file that is whole otherwise."""
    path, before = design / DESIGN, (design / DESIGN).read_bytes()
    whole = json.loads(before)
    try:
        path.write_text(json.dumps({**whole, "title": "another"}))
        with pytest.raises(InputError, match=r"design\.json: its sha256"):
            read_design(design)
        path.write_text(json.dumps({**whole, "cost": {**whole["cost"], "seconds": 7.0}}))
        assert read_design(design).design.circuit == read_design(design).design.circuit
    finally:
        path.write_bytes(before)


@pytest.mark.parametrize(
    "content",
    [b"", b"omega\n1\n", b"\xff\xfe", b'omega,start\n1,"x', b"omega,start\n" + b"x" * 200_000],
)
def test_a_setup_table_that_is_none(content: bytes, design: Path) -> None:
    path, before = design / "setup.csv", (design / "setup.csv").read_bytes()
    assert starts(Folder(design)) == ()
    try:
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"setup\.csv: line \d"):
            starts(Folder(design))
    finally:
        path.write_bytes(before)
    path.unlink()
    with pytest.raises(InputError, match=r"setup\.csv"):
        starts(Folder(design))
    path.write_bytes(before)
    assert starts(Folder(design)) == ()
