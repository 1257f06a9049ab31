"""Verbs that are killed at a write, or whose disk is full from then on: what they left is taken up
again, and the end is that of work that nobody disturbed.

A kill is one between two writes: what a process has not yet put in its place is not there, and
nothing is tidied up. ``tests/yields`` and ``tests/cli`` kill real processes at random moments.
"""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, NoReturn

import pytest

from designer.cli import entry
from designer.folders import design_source
from designer.jobs import bench_job
from tests.jobs.test_bench_job import csv_of
from tests.shared.exploring import EXPLORING
from tests.shared.folder_contents import differing
from tests.shared.model_text import SMALL
from tests.shared.paper_cases import synthesised
from tests.shared.quick_folders import EXACT, quick_folder

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

ROOT = Path(__file__).resolve().parents[2]
SWEEP = "--from 1.46 --to 1.5 --steps 5 --and b 0.24 0.26 --jobs 1"
AT = 12 if EXPLORING else 1
"""Writes at which each verb is killed, beside the last one."""


@dataclass(frozen=True)
class Work:
    """A command line that writes into the folder ``{out}``."""

    words: str
    again: str
    """What is added when it is begun a second time."""


WORK = {
    "tolerance": Work(f"tolerance {{out}} {' '.join(EXACT)} --map grade", "--resume"),
    "search": Work("search {out} --yield 0.5 --jobs 1", "--resume"),
    "bifurcation": Work(f"bifurcation {{out}}/model.toml {SWEEP} --out {{out}}/swept", "--resume"),
    "export": Work("export {out} --routed", ""),
    "bench": Work("bench {out} --record {record} --out {out}/board --no-ngspice", "--overwrite"),
}
FULL = ("tolerance", "search")
"""Verbs whose disk is full in CI too."""


class Killed(BaseException):
    """The process is no more."""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a design."""
    place = tmp_path_factory.mktemp("killed")
    return quick_folder(SMALL, place / "design")


@pytest.fixture
def record(tmp_path: Path) -> Path:
    """Of a board of the paper's design, which stands for the folder's where ``bench`` reads it."""
    return csv_of(2, tmp_path / "board.csv")


@pytest.fixture(autouse=True)
def benched(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    if "bench" in request.node.name:
        monkeypatch.setattr(design_source, "read_design", lambda *_: synthesised())
        monkeypatch.setattr(bench_job, "is_design_folder", lambda path: path.name == "design")


@contextmanager
def ending(folder: Path, at: int, how: Callable[[], NoReturn]) -> Iterator[list[int]]:
    """Inside, write number ``at`` into this folder and all later ones end as ``how`` says; the
    number of those before. Nothing is removed from then on."""
    count, ended = [0], False
    replace, unlink = os.replace, Path.unlink

    def put(source: Path, place: Path) -> None:
        nonlocal ended
        if not Path(place).is_relative_to(folder):  # such as a compiled kernel
            return replace(source, place)
        ended = ended or count[0] == at
        if ended:
            how()
        count[0] += 1
        return replace(source, place)

    def remove(path: Path, missing_ok: bool = False) -> None:
        if not ended:
            unlink(path, missing_ok)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(os, "replace", put)
        patched.setattr(Path, "unlink", remove)
        yield count


@contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """Inside, nothing in this folder can be made, changed or removed."""

    def refused(names: list[object]) -> None:
        if any(Path(str(name)).is_relative_to(folder) for name in names):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(names[0]))

    opened, made, removed, moved = Path.open, Path.mkdir, Path.unlink, os.replace

    def open_(path: Path, mode: str = "r", *args: Any, **more: Any) -> Any:
        if mode not in ("r", "rb"):
            refused([path])
        return opened(path, mode, *args, **more)

    def mkdir(path: Path, *args: Any, **more: Any) -> None:
        if not path.exists():
            refused([path])
        made(path, *args, **more)

    def unlink(path: Path, missing_ok: bool = False) -> None:
        refused([path])
        removed(path, missing_ok)

    def replace(source: Any, place: Any) -> None:
        refused([source, place])
        moved(source, place)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Path, "open", open_)
        patched.setattr(Path, "mkdir", mkdir)
        patched.setattr(Path, "unlink", unlink)
        patched.setattr(os, "replace", replace)
        yield


def kill() -> NoReturn:
    raise Killed


def full() -> NoReturn:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("how", "name"),
    [*((kill, name) for name in WORK), *((full, name) for name in (WORK if EXPLORING else FULL))],
)
def test_what_was_left_is_taken_up_again(
    how: Callable[[], NoReturn],
    name: str,
    made: Path,
    record: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    work = WORK[name]

    def words(out: Path, more: str = "") -> list[str]:
        return [w.format(out=out, record=record) for w in f"{work.words} {more}".split()]

    def begun(place: str) -> Path:
        return Path(shutil.copytree(made, tmp_path / place / "design"))

    whole = begun("whole")
    with ending(whole, -1, how) as count:
        status = entry.status(words(whole))
    assert status in (0, 1), capfd.readouterr().err
    (writes,) = count
    assert writes > 0
    chosen = Random(name).sample(range(writes), min(AT, writes))
    for at in sorted({writes - 1, *chosen}):
        out = begun(f"at {at}")
        capfd.readouterr()
        with ending(out, at, how):
            if how is kill:
                with pytest.raises(Killed):
                    entry.status(words(out))
            else:
                assert entry.status(words(out)) == 2
                said = capfd.readouterr().err
                assert "No space left on device" in said, (at, said)
                assert "Traceback" not in said, (at, said)
        assert entry.status(words(out, work.again)) == status, (at, capfd.readouterr().err)
        assert not differing(out, whole), at
        shutil.rmtree(out.parent)


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", WORK)
def test_a_read_only_folder_is_told_of(
    name: str, made: Path, record: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Whoever runs these tests may write anywhere, so the file system's refusal is put in its
    place."""
    out = Path(shutil.copytree(made, tmp_path / "design"))
    with read_only(out):
        status = entry.status(WORK[name].words.format(out=out, record=record).split())
    said = capfd.readouterr().err
    assert status == 2, said
    assert "Read-only file system" in said
    assert "Traceback" not in said
    assert not differing(out, made)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", ["tolerance", "bifurcation"])
def test_files_that_may_not_grow_are_told_of(name: str, made: Path, tmp_path: Path) -> None:
    """The system refuses whatever is longer than some thousand bytes, by whichever way it is
    written; with room again the verb goes on."""
    out = Path(shutil.copytree(made, tmp_path / "design"))
    words = WORK[name].words.format(out=out).split()
    limited = ["sh", "-c", 'ulimit -f 4; exec "$@"', "sh"]
    done = subprocess.run(
        [*limited, sys.executable, "-m", "designer", *words],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert "File too large" in done.stderr
    assert "Traceback" not in done.stderr
    assert not list(out.rglob("*.part"))
    assert entry.status([*words, *WORK[name].again.split(), "-q"]) in (0, 1)
