"""TOML as plain data, its size and nesting bounded before it is parsed.

``tomllib`` keeps every beginning of a dotted key, so a key of n parts takes n² memory: 1.7 GB for
32 KB. Here dots between words, open brackets, words and strings are counted as ``tomllib`` would
meet them: what stands inside a string or a comment counts nothing.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any

from designer.base.errors import InputError

MOST_PARTS = 12
"""Parts of a dotted key; the project's own have at most three."""
DEEPEST = 24
"""Levels of lists and tables in a value; the project's own have at most four."""
MOST_WORDS = 150_000
"""Keys and values of a file; each costs up to 0.7 kB when it is read."""

_TOKEN = re.compile(
    r"""
      (?P<space> [ \t]+ | \#[^\n]* )
    | (?P<word> [^\s.=,\[\]{}\#"']+
        | \"{3} (?: [^"\\]++ | \\[\s\S] | "(?!"") )*+ \"{3,5}
        | '{3} (?: [^']++ | '(?!'') )*+ '{3,5}
        | " (?: [^"\\\n]++ | \\[^\n] )*+ "
        | ' [^'\n]*+ ' )
    | (?P<dot> \. )
    | (?P<open> [\[{] )
    | (?P<close> [\]}] )
    | (?P<other> [\s=,]+ )
    """,
    re.VERBOSE,
)
"""A piece of a TOML text. Where none fits, a string has no end, and ``tomllib`` goes no further."""


def parse_toml(text: str, file: str | None) -> dict[str, Any]:
    """The tables of a TOML text.

    Raises
    ------
    InputError : it is none (names the line), or is larger or nested deeper than any such file
        has to be.
    """
    _check_size(text, file)
    try:
        return tomllib.loads(text)
    except ValueError as error:  # includes tomllib.TOMLDecodeError
        message = str(error)
        place = re.search(r" \(at line (\d+), column \d+\)$", message)
        content = text.splitlines()
        row = int(place[1]) if place else max(len(content), 1)
        row_text = content[row - 1].strip() if row <= len(content) else ""
        reason = message[: place.start()] if place else message
        raise InputError(
            file, f"line {row}", row_text or "the end of the file", f"valid TOML ({reason})"
        ) from None


def _check_size(text: str, file: str | None) -> None:
    words = parts = depth = position = 0
    while token := _TOKEN.match(text, position):
        kind, position = token.lastgroup, token.end()
        if kind == "word":
            words += 1
        elif kind == "dot":
            parts += 1
        elif kind == "open":
            depth += 1
        elif kind == "close":
            depth = max(depth - 1, 0)
        if kind in ("open", "close", "other"):
            parts = 0
        if parts >= MOST_PARTS:
            raise _too_large(text, position, file, "a dotted key", MOST_PARTS, "parts")
        if depth > DEEPEST:
            raise _too_large(text, position, file, "lists or tables", DEEPEST, "levels")
        if words > MOST_WORDS:
            raise _too_large(text, position, file, "a file", MOST_WORDS, "keys and values")


def _too_large(
    text: str, position: int, file: str | None, what: str, most: int, unit: str
) -> InputError:
    row = text.count("\n", 0, position) + 1
    return InputError(file, f"line {row}", f"{what} of more than {most} {unit}", f"at most {most}")
