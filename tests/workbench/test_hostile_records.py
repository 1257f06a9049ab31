"""Files that are no records, damaged or made to harm: each is read, or refused with its place."""

from __future__ import annotations

import io
import resource
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.errors import InputError
from designer.workbench.record import Record
from designer.workbench.record_formats import read_record
from tests.workbench.test_record_formats import FIRST, ONE, SECOND, START, STEP, TIME, TWO, K


def npy(values: np.ndarray[Any, Any]) -> bytes:
    stream = io.BytesIO()
    np.save(stream, values)
    return stream.getvalue()


def npz(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def headed(header: str, data: bytes = b"\0" * 4096, version: bytes = b"\1\0") -> bytes:
    """An ``.npy`` with any header."""
    return b"\x93NUMPY" + version + struct.pack("<H", len(header)) + header.encode() + data


def line(number: int, text: str) -> str:
    lines = TWO["Rigol MSO5000"].splitlines()
    lines[number - 1] = text
    return "\n".join(lines)


TABLE = np.column_stack([TIME, FIRST, SECOND])
NAMED = npz(time=TIME, v1=FIRST, fv=SECOND)
BOMB = io.BytesIO()
with zipfile.ZipFile(BOMB, "w", zipfile.ZIP_DEFLATED) as archive:
    zeros = 1 << 28  # bytes: a quarter of a gigabyte in 260 kB
    start = npy(np.zeros(0))[:128].replace(b"(0,)", b"(%d,)" % (zeros // 8))
    archive.writestr("time.npy", start[:128] + bytes(zeros))

HOSTILE: dict[str, tuple[str, bytes | str, str, str]] = {
    "a value of 1e300": (".csv", line(101, "0.001,1e300,0"), "line 101", "1e+300"),
    "a value of 1e400": (".csv", line(101, "0.001,1e400,0"), "line 101", "1e400"),
    "four hundred digits": (".csv", line(101, "0.001," + "9" * 400 + ",0"), "line 101", "999"),
    "a time of 1e300": (".csv", line(101, "1e300,1,0"), "line 101", "1e+300"),
    "a lone carriage return": (".csv", line(101, "0.001,1.\r5,0"), "line 101", "0.001,1"),
    "a lone carriage return and a word": (".csv", line(101, "x\ry,0"), "line 101", "x"),
    "an open quotation": (".csv", line(101, '0.001,"1,0'), "line 101", '"1,0'),
    "a cell without end": (".csv", line(101, "1" * 200_000 + "x"), "the file", "a line with"),
    "an empty start": (
        ".npz", npz(A=FIRST, Tstart=np.zeros(0), Tinterval=STEP), "Tstart", "0 numbers"
    ),
    "two steps": (".npz", npz(A=FIRST, Tstart=0.0, Tinterval=[1.0, 2.0]), "Tinterval", "2 num"),
    "no step": (".npz", npz(A=FIRST, Tstart=0.0, Tinterval=0.0), "the step", "0 s"),
    "steps backwards": (".npz", npz(A=FIRST, Tstart=0.0, Tinterval=-STEP), "the step", "-2e-05"),
    "a step that is none": (".npz", npz(A=FIRST, Tstart=0.0, Tinterval=np.nan), "Tinter", "nan"),
    "steps of 1e-300 s": (".npz", npz(A=FIRST, Tstart=0.0, Tinterval=1e-300), "the step", "1e-3"),
    "a start that swallows the step": (
        ".npz", npz(A=FIRST, Tstart=1e9, Tinterval=STEP), "its first time", "1e+09"
    ),
    "a step of 0 in a header": (
        ".csv", ONE["Rigol MSO5000 memory"].replace("tInc = 2.0e-05s", "tInc = 0s"), "the step", "0"
    ),
    "time going backwards": (
        ".csv", line(101, "-1,1,0"), "line 101", "-1"
    ),
    "constant time": (
        ".npy", npy(np.column_stack([np.ones(K), FIRST])), "sample 1", "1 s"
    ),
    "falling time": (".npy", npy(TABLE[::-1]), "sample 1", "s"),
    "not a number": (".npy", npy(np.where(TABLE > 1.9, np.nan, TABLE)), "column 2[", "nan"),
    "infinite": (".npy", npy(np.where(TABLE > 1.9, np.inf, TABLE)), "column 2[", "inf"),
    "1e300 in an array": (".npy", npy(np.where(TABLE > 1.9, 1e300, TABLE)), "sample", "1e+300"),
    "beyond a float": (
        ".npy", npy(np.where(TABLE > 1.9, np.longdouble("1e4000"), TABLE)), "column 2[", "inf"
    ),
    "1e12 samples": (
        ".npy",
        headed("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000, 3)}"),
        "the file",
        "4096 bytes for 3000000000000 values",
    ),
    "a damaged header": (
        ".npy", headed("{'descr': '<f8', 'fortran_order': False, 'shape': (3"), "the file", ""
    ),
    "an escape in a header": (".npy", headed(r"{'descr': '\g'}"), "the file", ""),
    "a header of another thing": (".npy", headed("[1, 2]"), "the file", ""),
    "a header without end": (".npy", headed("(" * 9000), "the file", ""),
    "a negative shape": (
        ".npy",
        headed("{'descr': '<f8', 'fortran_order': False, 'shape': (-4, 3)}"),
        "the file",
        "-4",
    ),
    "dates": (".npy", npy(np.zeros(K, dtype="datetime64[s]")), "the file", "M8"),
    "complex": (".npy", npy(TABLE * 1j), "the file", "c16"),
    "zero rows": (".npy", npy(np.zeros((0, 3))), "the file", "shape (0, 3)"),
    "one row": (".npy", npy(TABLE[:1]), "its channels", ""),
    "no axis": (".npy", npy(np.array(3.0)), "its channels", "missing"),
    "three axes": (".npy", npy(np.zeros((4, 4, 4))), "the file", "shape (4, 4, 4)"),
    "cut off": (".npy", npy(TABLE)[:-100], "the file", "values"),
    "cut in the header": (".npy", npy(TABLE)[:40], "the file", "header"),
    "an archive cut off": (".npz", NAMED[:-40], "the file", "zip"),
    "an archive that is none": (".npz", b"PK\3\4" + bytes(99), "the file", "zip"),
    "an empty archive": (".npz", npz(), "its arrays", "missing"),
    "an archive that swells": (".npz", BOMB.getvalue(), "time", "more than"),
    "a thousand arrays": (".npz", npz(**{f"a{k}": [0.0] for k in range(99)}), "its arrays", "99"),
    "thirty channels": (
        ".npy", npy(np.column_stack([TIME, *[FIRST] * 30])), "its channels", "30"
    ),
    "three million samples": (
        ".npz", npz(A=np.zeros(3 << 20), Tstart=0.0, Tinterval=STEP), "its samples", "3145728"
    ),
    "bytes": (".csv", bytes(range(256)) * 99, "the file", "no text"),
    "bytes late in a text": (
        ".csv", TWO["Siglent"] * 9 + "\0" * 99, "the file", "no text"
    ),
    "half a character": (".csv", b"\xff\xfe" + b"1\0,\0001\0\n", "the file", ""),
    "zero rows of text": (".csv", "Time(s),CH1(V)\n", "a line", "Time"),
    "one row of text": (".csv", "Time(s),CH1(V)\n0.0,1.0\n", "its samples", "1"),
    "a waveform of the scope's own": (".wfm", b"\xa5\xa5\0\1" * 999, "the file", "no text"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused_with_its_place(name: str, tmp_path: Path) -> None:
    suffix, content, field, found = HOSTILE[name]
    path = tmp_path / f"record{suffix}"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError) as error:
        read_record(path)
    assert str(path) in str(error.value)
    assert field in error.value.field
    assert found in str(error.value)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 400_000  # kB


def test_old_line_ends_are_ends_of_lines(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(TWO["Rigol MSO5000"], encoding="utf-8", newline="\r")
    np.testing.assert_allclose(read_record(path).signals["CH2"], SECOND, atol=1e-9)


def test_a_fault_below_empty_lines_has_its_line(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(line(51, "1,x,0").replace("\n", "\n\n", 3), encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_record(path)
    assert error.value.field == "line 54"


FILES: dict[str, tuple[str, bytes]] = {
    **{name: (".csv", text.encode()) for name, text in {**ONE, **TWO}.items()},
    "npy": (".npy", npy(TABLE)),
    "npy, transposed": (".npy", npy(np.asfortranarray(TABLE.T))),
    "npy, fields": (
        ".npy",
        npy(np.array([*zip(TIME, FIRST, strict=True)], dtype=[("time", "<f8"), ("v1", "<f4")])),
    ),
    "npz": (".npz", NAMED),
    "npz, PicoScope": (".npz", npz(A=FIRST, B=SECOND, Tstart=START, Tinterval=STEP, Length=K)),
}
TOKENS = (
    b"1e300", b"-1e300", b"1e-320", b"nan", b"inf", b"", b"\r", b"\n", b"\r\n", b"\0", b'"', b"'",
    b",", b";", b"\t", b" ", b"\xff", b"\xc3", b"\xe2\x80\xa8", b"\x1c", b"9" * 400, b"-", b"e",
    b"tInc = 0s", b"Increment", b"(V)", b"(kA)", b"(", b"1000000000000", b"shape", b"\xff\xfe",
)  # fmt: skip


def mutated(content: bytes, changes: list[tuple[float, int, int]]) -> bytes:
    """Bytes replaced by hostile tokens. changes : place, bytes that go, number of the token."""
    for place, gone, token in changes:
        at = int(place * len(content))
        content = content[:at] + TOKENS[token % len(TOKENS)] + content[at + gone :]
    return content


def read_or_refused(suffix: str, content: bytes, folder: Path) -> Record | None:
    path = folder / f"record{suffix}"
    path.write_bytes(content)
    refused: InputError | None = None
    try:
        record = read_record(path)
    except InputError as error:
        refused = error
    if refused is not None:
        assert refused.file == str(path)
        assert refused.field
        return None
    assert len(record.time) >= 100
    assert (np.diff(record.time) > 0.0).all()
    for signal in record.signals.values():
        assert np.isfinite(signal).all()
        assert signal.shape == record.time.shape
    return record


CHANGES = st.lists(
    st.tuples(st.floats(0.0, 1.0), st.sampled_from([0, 1, 3, 40, 10**9]), st.integers(0, 99)),
    min_size=1,
    max_size=4,
)


def fuzz(examples: int) -> Callable[[Callable[..., None]], Callable[..., None]]:
    def of(test: Callable[..., None]) -> Callable[..., None]:
        return settings(max_examples=examples, deadline=None)(
            given(name=st.sampled_from(list(FILES)), changes=CHANGES, first=st.booleans())(test)
        )

    return of


def damaged(name: str, changes: list[tuple[float, int, int]], first: bool, folder: Path) -> None:
    """first : only the first 300 bytes change, where headers are."""
    suffix, content = FILES[name]
    if first:
        content = mutated(content[:300], changes) + content[300:]
    else:
        content = mutated(content, changes)
    read_or_refused(suffix, content, folder)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("records")


@fuzz(60)
def test_damaged_files_are_read_or_refused(
    place: Path, name: str, changes: list[tuple[float, int, int]], first: bool
) -> None:
    damaged(name, changes, first, place)


@pytest.mark.slow
@fuzz(1500)
def test_many_damaged_files_are_read_or_refused(
    place: Path, name: str, changes: list[tuple[float, int, int]], first: bool
) -> None:
    damaged(name, changes, first, place)
