"""What files and names hold steers no terminal, wherever it is printed."""

from __future__ import annotations

import ast
import unicodedata
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from designer.base.errors import InputError, InputErrors
from designer.base.printed import one_line, printable, tell
from designer.base.progress import ProgressLines
from designer.cli import entry
from designer.verbs.console import grid, say
from tests.shared.house import trees

HOSTILE = "\x1b]0;owned\x07\x1b[2J\r\x9b31m\u202edesrever\x08\x7f"
HARMLESS = "Ω 1 kΩ é 二つの質量 ½\tσ\nnext"


def steers(text: str) -> bool:
    """Whether a character of these kinds is in it: by Unicode's own table, not the tool's."""
    kinds = ((unicodedata.category(c), unicodedata.bidirectional(c), c) for c in text)
    turns = ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
    return any(
        (kind in ("Cc", "Cs", "Zl", "Zp") and c not in "\n\t") or turn in turns
        for kind, turn, c in kinds
    )


@given(st.text(st.characters()))
def test_no_character_steers(text: str) -> None:
    assert not steers(printable(text))
    assert len(printable(text)) == len(text)
    assert "\n" not in one_line(text)


def test_other_characters_stay() -> None:
    assert printable(HARMLESS) == HARMLESS
    assert steers(HOSTILE)


@pytest.mark.parametrize("place", range(4))
def test_every_part_of_an_error(place: int) -> None:
    parts = ["file", "field", "found", "expected"]
    parts[place] = HOSTILE
    error = InputError(*parts)
    assert not steers(str(error))
    assert not steers(str(InputErrors([error, error])))


def test_every_door(capfd: pytest.CaptureFixture[str]) -> None:
    tell(HOSTILE)
    say(HOSTILE)
    grid(HOSTILE, [HOSTILE], [[HOSTILE]])
    progress = ProgressLines()
    progress.stage(HOSTILE)
    progress.note(HOSTILE)
    progress.doing(HOSTILE)
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("owned") == 7
    assert not steers(err)


@pytest.mark.parametrize(
    "words",
    [
        [HOSTILE],
        ["simulate", HOSTILE],
        ["simulate", "examples/paper.toml", HOSTILE],
        ["simulate", "examples/paper.toml", "--omega", HOSTILE],
        ["simulate", "examples/paper.toml", f"--{HOSTILE}"],
        ["catalog", "--check", HOSTILE],
        ["rules", "examples", "--board", HOSTILE],
        ["bench", "examples", "--record", HOSTILE],
        ["new", "examples/paper.toml", "--from", HOSTILE],
    ],
)
def test_command_lines(words: list[str], tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "log"
    more = ["--log", str(log)] if len(words) > 1 and words[0] != "catalog" else []
    assert entry.status([*words, *more]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert not steers(err)
    assert not log.exists() or not steers(log.read_text("utf-8"))


def test_nothing_else_prints() -> None:
    """Standard error has one door for text and one for tables; standard output is for answers."""
    printers = {
        module: sum(
            isinstance(node, ast.Call)
            and ast.unparse(node.func) in ("print", "typer.echo", "sys.stderr.write")
            for node in ast.walk(tree)
        )
        for module, tree in trees().items()
    }
    own = {"cli.command_line": 2, "base.printed": 1}
    found = {m: n for m, n in printers.items() if n and m in own}
    assert found == own
    others = {m for m, n in printers.items() if n and m not in own}
    assert all(m.startswith("paper") for m in others), others
