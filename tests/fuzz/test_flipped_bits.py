"""One flipped bit in any file of a finished design folder: a verb says which file, or computes anew
what is damaged, or answers as it would without; its answer is never another one."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from random import Random
from typing import Any

import pytest

from designer.cli import entry
from tests.jobs.test_damaged_folder import BLOCK
from tests.shared.exploring import EXPLORING
from tests.shared.quick_folders import studied_folder

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

EACH = 60 if EXPLORING else 3
"""Bits of each file that verbs read; of the others, which have their hash alone, one."""
READ = ("manifest.json", "manifest.json", "design.json", "model.toml", "tolerance.json",
        "kept.npz", "setup.csv", BLOCK)  # fmt: skip
VERBS = {
    "tolerance": ["tolerance", "{}", "--json", "-q"],
    "another layer": ["tolerance", "{}", "--tuned", "--jobs", "1", "--json", "-q"],
    "simulate": ["simulate", "{}", "--engine", "circuit", "--starts", "0", "--json", "-q"],
    "rules": ["rules", "{}", "--json", "-q"],
    "export": ["export", "{}", "--json", "-q"],
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a design, a study and a report."""
    return studied_folder(tmp_path_factory.mktemp("whole") / "design")


def answered(
    verb: str, folder: Path, capfd: pytest.CaptureFixture[str]
) -> tuple[int, Mapping[str, Any], str]:
    """Exit status, the answer and what is said."""
    capfd.readouterr()
    status = entry.status([word.format(folder) for word in VERBS[verb]])
    shown = capfd.readouterr()
    answer = json.loads(shown.out) if shown.out.strip() else {}
    return status, without(answer, ("cost", "provenance")), shown.err


def without(value: Any, keys: tuple[str, ...]) -> Any:
    """JSON without what differs from run to run, at any depth."""
    if isinstance(value, dict):
        return {k: without(v, keys) for k, v in value.items() if k not in keys}
    return [without(each, keys) for each in value] if isinstance(value, list) else value


def names(folder: Path) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.usefixtures("quick_reports")
@pytest.mark.parametrize("verb", VERBS)
def test_no_answer_is_another_one(
    verb: str, finished: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "design"
    shutil.copytree(finished, folder)
    status, wanted, _ = answered(verb, folder, capfd)
    assert status in (0, 1)
    dice = Random(verb)
    others = [name for name in names(finished) if name not in READ] if verb == "tolerance" else []
    for name, count in (*((name, EACH) for name in READ), *((name, 1) for name in others)):
        content = (finished / name).read_bytes()
        for _ in range(count):
            at, bit = dice.randrange(len(content)), 1 << dice.randrange(8)
            shutil.rmtree(folder)
            shutil.copytree(finished, folder)
            flipped = content[:at] + bytes([content[at] ^ bit]) + content[at + 1 :]
            (folder / name).write_bytes(flipped)
            status, found, said = answered(verb, folder, capfd)
            told = f"{name}, byte {at}, bit {bit}: {content[max(at - 30, 0) : at + 30]!r}: {said}"
            assert status in (0, 1, 2), told
            assert "internal error" not in said, told
            assert "Traceback" not in said, told
            if status == 2:
                assert str(folder) in said, told
            else:
                assert found == wanted, told
