"""Verbs on design folders in which one file is damaged or says other things, with and without a
manifest that vouches for it: read, refused by name, or computed again; never an accident."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from designer.cli import entry
from tests.jobs.test_damaged_folder import BLOCK
from tests.shared.damaged import cells_swapped, damaged, json_of, swapped
from tests.shared.exploring import EXPLORING, quick
from tests.shared.quick_folders import EXACT, studied_folder
from tests.shared.stopped_work import work_stopped

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

FILES = (
    "manifest.json", "manifest.json", "design.json", "design.json", "design.json",
    "tolerance.json", "kept.npz", BLOCK, "model.toml", "setup.csv", "bom.csv",
    "scales.csv", "circuit.cir", "board.md",
)  # fmt: skip
"""What is damaged, the richest several times."""
VERBS = (
    ["run", "{}"],
    ["tolerance", "{}", *EXACT],
    ["tolerance", "{}", "--resume", "--map", "grade"],
    ["tolerance", "{}", *EXACT, "--overwrite"],
    ["synthesise", "{}"],
    ["export", "{}"],
    ["export", "{}", "--deck", "portable"],
    ["export", "{}", "--dsn", "{}/board.dsn"],
    ["rules", "{}"],
    ["simulate", "{}", "--omega", "0.85", "--engine", "circuit", "--starts", "1"],
    ["bifurcation", "{}", "--circuit", "--from", "1", "--to", "0.9", "--steps", "3"],
    ["search", "{}", "--yield", "0.9"],
)
FEW, MANY, EACH = 4, 7 if EXPLORING else 5, 100
"""Runs of the quick tests, of the slow ones, and folders of each."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a design and a study."""
    return studied_folder(tmp_path_factory.mktemp("fuzzed") / "design")


@pytest.fixture
def work_begins(finished: Path) -> Iterator[None]:
    """What comes after everything was read stops at once, as by Ctrl-C."""
    with work_stopped(finished):
        yield


def other(name: str, content: bytes, dice: Random) -> bytes:
    """The file as an accident leaves it, or with other values."""
    if dice.random() < 0.6:
        if name.endswith(".json"):
            return json_of(swapped(json.loads(content), dice))
        if name.endswith(".csv"):
            return cells_swapped(content.decode(), dice, ",").encode("utf-8", "surrogatepass")
    return damaged(content, dice)


def vouched(folder: Path, name: str) -> None:
    """The manifest knows the file as it is now."""
    path = folder / "manifest.json"
    manifest = json.loads(path.read_bytes())
    manifest["files"][name]["sha256"] = hashlib.sha256((folder / name).read_bytes()).hexdigest()
    path.write_text(json.dumps(manifest), encoding="utf-8")


@pytest.mark.timeout(600)
@pytest.mark.parametrize("run", quick(range(MANY), FEW))
@pytest.mark.usefixtures("work_begins")
def test_a_verb_reads_a_damaged_folder_or_names_it(
    run: int, finished: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for number in range(run * EACH, (run + 1) * EACH if run >= FEW else run * EACH + EACH // 10):
        dice = Random(number)
        folder = Path(shutil.copytree(finished, tmp_path / str(number)))
        name = dice.choice([each for each in FILES if (folder / each).exists()])
        (folder / name).write_bytes(other(name, (folder / name).read_bytes(), dice))
        if name != "manifest.json" and dice.random() < 0.6:
            vouched(folder, name)
        words = [word.format(folder) for word in dice.choice(VERBS)]
        before = set(tmp_path.iterdir())
        capfd.readouterr()
        status, said = entry.status(words), capfd.readouterr().err
        told = f"{number}: {name}, {words}: {said}"
        assert status in (0, 1, 2, 130), told
        assert "internal error" not in said, told
        assert "Traceback" not in said, told
        if status == 2:
            assert name.rpartition("/")[2] in said or str(folder) in said, told
        assert set(tmp_path.iterdir()) == before, told
        shutil.rmtree(folder)
