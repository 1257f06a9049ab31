"""TOML's size is bounded as the parser would meet it, not as the text looks."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path
from tomllib import _parser  # type: ignore[attr-defined]
from typing import Any

import pytest
from hypothesis import given, strategies as st

from designer.base import toml_reader
from designer.base.errors import InputError
from designer.base.toml_reader import DEEPEST, MOST_PARTS, MOST_WORDS, parse_toml

PARSE_KEY, PARSE_VALUE = _parser.parse_key, _parser.parse_value
ROOT = Path(__file__).resolve().parents[2]
PARTS = MOST_PARTS + 1
DOTS = [
    ".".join("a" * PARTS) + " = 1",
    " . ".join("a" * PARTS) + " = 1",
    "[" + ".".join(["x"] * PARTS) + "]",
    "[[ " + ".".join(["'x'"] * PARTS) + " ]]",
    ".".join(['"x.y"'] * PARTS) + " = 1",
    "v = {" + ".".join("a" * PARTS) + " = 1}",
    "v = [1.5, {" + ".".join("a" * PARTS) + " = 1}]",
    "# it's\nv = 'a\\' # \"\n" + ".".join("a" * PARTS) + " = 1",
    'v = """a\\""""""\n' + ".".join("a" * PARTS) + " = 1",
    "v = '''a''''' # '''\n" + ".".join("a" * PARTS) + " = 1",
    'v = "" # """\n' + ".".join("a" * PARTS) + " = 1",
]
DEEP = [
    "v = " + "[" * (DEEPEST + 1) + "]" * (DEEPEST + 1),
    "v = " + "{a=" * (DEEPEST + 1) + "1" + "}" * (DEEPEST + 1),
    "v = " + "[ \n{a = '[' , b = # ]\n" * DEEPEST,
]


@pytest.mark.parametrize("text", DOTS)
def test_a_dotted_key_of_too_many_parts(text: str) -> None:
    with pytest.raises(InputError, match=rf"dotted key of more than {MOST_PARTS} parts"):
        parse_toml(text, "x.toml")


@pytest.mark.parametrize("text", DEEP)
def test_a_value_that_is_too_deep(text: str) -> None:
    with pytest.raises(InputError, match=rf"more than {DEEPEST} levels"):
        parse_toml(text, "x.toml")


def test_a_file_of_too_many_values() -> None:
    with pytest.raises(InputError, match=rf"line 1: .*more than {MOST_WORDS} keys and values"):
        parse_toml("v = [" + "1," * MOST_WORDS + "]", "x.toml")


DOTTED = "a." * 50
MUCH = "[{" * 50
LEGAL = [
    f'v = "{DOTTED} {MUCH} \\" {DOTTED}"',
    f"v = '{DOTTED} {MUCH} \\'",
    f'v = """\n{DOTTED}\n"" \\""" {MUCH}"""""',
    f"v = '''\n{DOTTED}\n'' {MUCH}'''''",
    f"# {DOTTED} {MUCH} \"\nv = 1 # ' {DOTTED}",
    f'"{DOTTED}".b.c = 1',
    "v = [" + "1.5, " * 500 + "]",
    "v = [" + "[1.5], " * 500 + "]",
    "v = [" + "{a.b = 1.5}, " * 500 + "]",
    "".join(f"[t{i}.u]\nv.w = 1.5\n" for i in range(500)),
    "".join("[[t.u]]\nd = 1979-05-27T07:32:00.5Z\n" for i in range(500)),
    ".".join("a" * MOST_PARTS) + " = 1",
    "v = " + "[" * DEEPEST + "]" * DEEPEST,
]


@pytest.mark.parametrize("text", LEGAL)
def test_what_stands_in_strings_and_comments_counts_nothing(text: str) -> None:
    assert parse_toml(text, None) == tomllib.loads(text)


PIECES = ['"', "'", '"""', "'''", "\\", "#", "\n", "\r\n", *"a.=[]{},1 é"]


@given(st.lists(st.sampled_from(PIECES), max_size=60).map("".join))
def test_the_parser_meets_nothing_larger(text: str) -> None:
    """With bounds so small that texts of a few signs reach them: what is let through has no longer
    key and no deeper value, and what is legal and small enough is let through."""
    longest = deepest = depth = 0

    def key(*arguments: Any) -> Any:
        nonlocal longest
        position, parts = PARSE_KEY(*arguments)
        longest = max(longest, len(parts))
        return position, parts

    def value(*arguments: Any) -> Any:
        nonlocal depth, deepest
        depth += 1
        deepest = max(deepest, depth)
        try:
            return PARSE_VALUE(*arguments)
        finally:
            depth -= 1

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_parser, "parse_key", key)
        patch.setattr(_parser, "parse_value", value)
        try:
            expected: object = tomllib.loads(text)
        except tomllib.TOMLDecodeError:
            expected = None
        small = longest <= 2 and deepest <= 3  # a number in two brackets
        longest = deepest = 0
        patch.setattr(toml_reader, "MOST_PARTS", 3)
        patch.setattr(toml_reader, "DEEPEST", 3)
        try:
            found: object = parse_toml(text, None)
        except InputError as error:
            found = None if "valid TOML" in str(error) else error
        assert longest <= 3
        assert deepest <= 4
    if not isinstance(found, InputError) or (small and expected is not None):
        assert found == expected


@pytest.mark.parametrize("key", ["a" + ".a" * 16_000, "[a" + '."b"' * 8_000 + "]"])
def test_a_hostile_file_is_refused_in_little_memory(tmp_path: Path, key: str) -> None:
    """32 KB took 1.7 GB: here a process that may have 1 GB of addresses answers."""
    text = f"{key} = 1\n" if key[0] == "a" else f"{key}\n"
    (tmp_path / "hostile.toml").write_text(text)
    code = (
        "import resource, sys, tracemalloc\nfrom pathlib import Path\n"
        "from designer.base.errors import InputError\n"
        "from designer.base.toml_reader import parse_toml\n"
        "resource.setrlimit(resource.RLIMIT_AS, (2**30, 2**30))\n"
        "text = Path(sys.argv[1]).read_text()\ntracemalloc.start()\n"
        "try:\n    parse_toml(text, sys.argv[1])\n"
        "except InputError as error:\n    print(error)\n"
        "print(tracemalloc.get_traced_memory()[1])\n"
    )
    words = [sys.executable, "-P", "-c", code, str(tmp_path / "hostile.toml")]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, check=True)
    said, peak = done.stdout.splitlines()
    assert "line 1: found a dotted key" in said
    assert int(peak) < 20_000_000


def test_every_reader_of_toml_is_this_one() -> None:
    users = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "designer").rglob("*.py")
        if "tomllib." in path.read_text("utf-8")
    }
    assert users == {"designer/base/toml_reader.py"}
