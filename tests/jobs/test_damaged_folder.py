"""A design folder in which a file was cut off, changed or lost: each verb that reads it says which,
or computes what is missing again; no damaged row is ever counted."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from designer.base.design_folder import Folder
from designer.base.seal import BLANK, MARK
from designer.cli import entry as cli
from tests.shared.exploring import quick
from tests.shared.quick_folders import EXACT, STUDY, studied_folder
from tests.shared.stopped_work import work_stopped

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

BLOCK = "samples.parquet/block-000000.parquet"
VERBS = {
    "tolerance": ["tolerance", "{}", *EXACT],
    "export": ["export", "{}"],
    "run": ["run", "{}", *STUDY],
    "another layer": ["tolerance", "{}", *EXACT, "--map", "grade"],
    "rules": ["rules", "{}"],
    "simulate": ["simulate", "{}", "--omega", "0.85", "--engine", "circuit", "--starts", "1"],
    "bifurcation": ["bifurcation", "{}", "--circuit", "--from", "1", "--to", "0.9", "--steps", "3"],
    "search": ["search", "{}", "--yield", "0.9"],
}
READ = ("manifest.json", "model.toml", "design.json", "tolerance.json", BLOCK)
"""Files that verbs read; of the others only the hash counts."""


@dataclass(frozen=True)
class Finished:
    """A folder with a design and a study; what ``tolerance`` says of it."""

    path: Path
    answer: dict[str, Any]


def words(verb: str, folder: Path) -> list[str]:
    return [word.format(folder) for word in VERBS[verb]]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    out = studied_folder(tmp_path_factory.mktemp("whole") / "design")
    return Finished(out, json.loads((out / "tolerance.json").read_text()))


@pytest.fixture
def copied(finished: Finished, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished.path, tmp_path / "copied"))


@pytest.fixture
def work_begins(finished: Finished) -> Iterator[None]:
    """What comes after everything was read stops at once, as by Ctrl-C."""
    with work_stopped(finished.path):
        yield


def damaged(content: bytes, name: str) -> Iterator[bytes | None]:
    """The file cut off, one that verbs read at several lengths, and no file."""
    lengths = [0, len(content) // 2, len(content) - 2] if name in READ else []
    yield from (content[:length] for length in lengths)
    yield None


@pytest.mark.parametrize("verb", quick(VERBS, 2))
@pytest.mark.usefixtures("work_begins")
def test_a_cut_off_file_is_named(
    verb: str, finished: Finished, copied: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Exit 2 with the name of the file, or the verb gets as far as it does without damage."""
    others = ("setup.csv", "kept.npz", "report.html")
    manifest = (finished.path / "manifest.json").read_bytes()
    assert cli.status(words(verb, copied)) in (0, 1, 130)
    refused = set()
    for name in (*READ, *others):
        path = copied / name
        whole = (finished.path / name).read_bytes()
        for content in damaged(whole, name):
            (copied / "manifest.json").write_bytes(manifest)  # the work that began has marked it
            path.unlink(missing_ok=True)
            if content is not None:
                path.write_bytes(content)
            capfd.readouterr()
            status, shown = cli.status([*words(verb, copied), "--json"]), capfd.readouterr()
            assert status in (0, 1, 2, 130), (name, shown.err)
            assert "internal error" not in shown.err, (name, shown.err)
            if status == 2:
                assert Path(name).name in shown.err, (name, shown.err)
                refused.add(name)
            elif status != 130 and verb == "tolerance":
                assert json.loads(shown.out)["responses"] == finished.answer["responses"], name
        path.write_bytes(whole)
    assert {"manifest.json", "model.toml", "design.json"} <= refused
    if verb == "tolerance":
        assert refused == {*READ, *others}


def with_another_row(content: bytes) -> bytes:
    """A block with one bit flipped that every reader of Parquet reads, with other rows."""
    whole = pq.read_table(pa.BufferReader(content)).to_pylist()
    for place in range(len(content)):
        other = content[:place] + bytes([content[place] ^ 4]) + content[place + 1 :]
        try:
            rows = pq.read_table(pa.BufferReader(other)).to_pylist()
        except (OSError, pa.ArrowException):
            continue
        if len(rows) == len(whole) and rows != whole:
            return other
    raise AssertionError("no such bit")


def study(folder: Path, *more: str) -> int:
    return cli.status([*words("tolerance", folder), *more])


def unfinished(folder: Path) -> None:
    """As if Ctrl-C had come when all blocks were written."""
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["stages"]["study"]["complete"] = False
    manifest["complete"] = False
    for entry in manifest["files"].values():
        if entry["stage"] == "study":
            entry["sha256"] = None
    path.write_text(json.dumps(manifest))


@pytest.mark.usefixtures("quick_reports")
def test_a_flipped_bit_is_not_counted(
    finished: Finished, copied: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Neither by --resume nor by another layer; the study is that of an undamaged folder."""
    whole = (copied / BLOCK).read_bytes()
    other = with_another_row(whole)
    (copied / BLOCK).write_bytes(other)
    unfinished(copied)
    capfd.readouterr()
    assert study(copied, "--resume") in (0, 1)
    assert f"{BLOCK}: damaged, computed again" in capfd.readouterr().err
    assert (copied / BLOCK).read_bytes() == whole
    (copied / BLOCK).write_bytes(other)
    assert study(copied) == 2
    assert study(copied, "--tuned") in (0, 1)
    assert f"{BLOCK}: damaged, computed again" in capfd.readouterr().err
    assert (copied / BLOCK).read_bytes() == whole
    answer = json.loads((copied / "tolerance.json").read_text())
    for mine, theirs in zip(answer["responses"], finished.answer["responses"], strict=True):
        assert mine["yield"] == theirs["yield"]
        assert mine["margins"] == theirs["margins"]


def without_seal(path: Path) -> None:
    """The block as versions without seals wrote it: by name no seal, and nothing that is one."""
    content = path.read_bytes()
    path.write_bytes(content.replace(MARK.encode(), b"x" * len(MARK)))


@pytest.mark.usefixtures("quick_reports")
def test_a_folder_of_before_is_read_where_its_manifest_vouches_for_it(
    finished: Finished, copied: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert BLANK.startswith(MARK)
    whole = (copied / BLOCK).read_bytes()
    without_seal(copied / BLOCK)
    folder = Folder(copied)
    assert folder.manifest is not None
    folder.finish("study", [BLOCK])  # the manifest knows this very content
    capfd.readouterr()
    assert study(copied, "--tuned") in (0, 1)
    assert BLOCK not in capfd.readouterr().err
    assert (copied / BLOCK).read_bytes() == whole  # sealed from now on
    without_seal(copied / BLOCK)
    unfinished(copied)
    assert study(copied, "--tuned", "--resume") in (0, 1)
    assert f"{BLOCK}: written without a checksum, computed again" in capfd.readouterr().err
    assert (copied / BLOCK).read_bytes() == whole
