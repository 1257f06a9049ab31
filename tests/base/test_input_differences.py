"""What a folder was made with and what is asked for now: in words, and without hashes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from designer.base.design_folder import MOST, Folder, differences
from designer.base.errors import InputError
from designer.base.manifest import StageName
from designer.base.plain_json import dumps
from designer.base.seal import sha256

TEXT = 'format = 1\n[model]\nm = 0.5\n[[response]]\nomega = 0.85\nexpect = "1-2-2"\n'
HASHES = [sha256(text.encode()) for text in ("a", "b")]


def made(tmp_path: Path, stage: StageName, inputs: dict[str, Any], **files: str) -> Folder:
    """A folder with a finished stage of these inputs."""
    folder = Folder(tmp_path / "made")
    folder.begin({stage: (inputs, [*files])})
    for name, content in files.items():
        folder.write(name, content)
    folder.finish(stage)
    return Folder(folder.path)


def refused(folder: Folder, stage: StageName, inputs: dict[str, Any], **asked: Any) -> str:
    with pytest.raises(InputError) as caught:
        folder.decide({stage: (inputs, [])}, overwrite=False, resume=False, asked=asked)
    said = str(caught.value)
    assert "--overwrite" in said
    assert not re.search(r"[0-9a-f]{8}", said)
    return said


@pytest.mark.parametrize(
    ("key", "before", "now", "words"),
    [
        ("steps", 226, 227, "made with --steps 226, asked for 227"),
        ("samples", 200, 300, "made with --samples 200, asked for 300"),
        ("seed", 1, 7, "made with --seed 1, asked for 7"),
        ("until", None, 0.05, "made without --until, asked for 0.05"),
        ("budget", 20.0, None, "made with --budget 20.0, asked for without"),
        ("without", ["grades", "trim"], ["trim"], "--without grades, trim, asked for trim"),
        ("truth", "full", "vendor", "made with --truth full, asked for vendor"),
        ("version", "0.1.0", "0.2.0", "made with version of designer 0.1.0, asked for 0.2.0"),
        ("catalogue", *HASHES, "made with another catalogue"),
        ("board", HASHES[0], None, "made with a board file"),
        ("list", None, HASHES[0], "made without a list of measured boards"),
    ],
)  # fmt: skip
def test_each_kind_of_input_has_its_words(
    tmp_path: Path, key: str, before: object, now: object, words: str
) -> None:
    folder = made(tmp_path, "trade", {"same": 1, key: before})
    assert f"{words}, expected the same" in refused(folder, "trade", {"same": 1, key: now})


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("0.85", "0.9", "made with response[1].omega 0.85, asked for 0.9"),
        ("m = 0.5", "m = 0.6", "made with model.m 0.5, asked for 0.6"),
        (
            "format",
            'title = "x"\nformat',
            "made without title, asked for x",
        ),
        ("0.85", "0.85  # comment", "made with another model file, in its comments alone"),
        ('"1-2-2"\n', '"1-2-2"\n[[response]]\nomega = 1\n', "made without response[2], asked for"),
    ],
)
def test_another_model_file_is_compared_key_by_key(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    other = TEXT.replace(old, new, 1)
    hashes = [sha256(text.encode()) for text in (TEXT, other)]
    folder = made(tmp_path, "design", {"model": hashes[0]}, **{"model.toml": TEXT})
    assert words in refused(folder, "design", {"model": hashes[1]}, model=other)
    (folder / "model.toml").write_text("changed since")
    assert "made with another model file" in refused(
        folder, "design", {"model": hashes[1]}, model=other
    )


def test_another_sweep_is_compared_option_by_option(tmp_path: Path) -> None:
    work = {"parameter": "omega", "from": 0.5, "to": 2.0, "steps": 226, "tracks": ["down"]}
    answer = {"format": 1, "provenance": {"settings": {"bifurcation": work}}}
    folder = made(tmp_path, "sweep", {"work": HASHES[0]}, **{"sweep.json": dumps(answer)})
    asked = work | {"steps": 227, "tracks": ("down", "up")}
    said = refused(folder, "sweep", {"work": HASHES[1]}, work=asked)
    assert "made with --steps 226, asked for 227; made with tracks down, asked for down, up" in said
    other = refused(folder, "sweep", {"work": HASHES[1]}, work=work)
    assert "made with another sweep, by the rules of another version" in other


def test_many_differences_are_counted() -> None:
    before, now = ({f"k{i}": i + add for i in range(30)} for add in (0, 1))
    said = differences(before, now, {})
    assert said.count("made with") == MOST
    assert said.endswith(f"; {30 - MOST} more")
    assert differences({"a": [1, 2]}, {"a": list(range(999))}, {}).endswith("asked for 999 values")
    assert "\x1b" not in differences({"a": "\x1b[2J"}, {"a": "x" * 9999}, {})
