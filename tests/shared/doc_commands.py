"""The command lines and the Python in the project's pages, as a reader would copy them."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", *sorted(f"docs/{p.name}" for p in (ROOT / "docs").glob("*.md")))

_PROGRAM = re.compile(r"(?:\$ )?(?:\.venv/bin/)?designer (?=[a-z])")
_OTHER = re.compile(r"(?:\$ )?(make [a-z-]+|pip|dask|(?:\.venv/bin/)?python) ?(.*)")
_INLINE = re.compile(r"`((?:\.venv/bin/)?designer [a-z][^`]*)`")
_PLACEHOLDER = re.compile(r"[\[\]|…]|\b[A-Z][A-Z0-9]*\b(?![./])")


@dataclass(frozen=True)
class Command:
    """A command line of a page. text : after ``designer``, on one line, without comments; of
    another program all of it. line : where it stands. inline : whether within a sentence."""

    page: str
    line: int
    text: str
    inline: bool = False
    program: str = "designer"

    @property
    def is_pattern(self) -> bool:
        """Whether it stands for many: it has optional parts or names of what is to be filled in."""
        return bool(_PLACEHOLDER.search(re.sub(r'"[^"]*"', "", self.text))) or (
            self.inline and len(self.text.split()) < 2
        )

    @property
    def options(self) -> tuple[str, ...]:
        """Names of its options."""
        return tuple(dict.fromkeys(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", self.text)))


@dataclass(frozen=True)
class Snippet:
    """Python of a page."""

    page: str
    line: int
    text: str


def blocks(page: str) -> Iterator[tuple[int, str, list[str]]]:
    """(line, language, lines) of every block of code: between fences, or indented by four."""
    lines = (ROOT / page).read_text(encoding="utf-8").splitlines()
    number = 0
    while number < len(lines):
        line = lines[number]
        if line.startswith("```"):
            end = next(k for k in range(number + 1, len(lines)) if lines[k].startswith("```"))
            yield number + 2, line[3:].strip(), lines[number + 1 : end]
            number = end + 1
        elif line.startswith("    ") and (number == 0 or not lines[number - 1].strip()):
            end = number
            while end < len(lines) and (lines[end].startswith("    ") or not lines[end].strip()):
                end += 1
            body = [text[4:] for text in lines[number:end]]
            yield number + 1, "", body
            number = end
        else:
            number += 1


def commands(page: str) -> list[Command]:
    """Every command line of a page, those within sentences among them, in its order."""
    found = []
    for first, language, lines in blocks(page):
        if language not in ("", "sh", "bash"):
            continue
        for offset, line in enumerate(lines):
            if _PROGRAM.match(line):
                text = _PROGRAM.sub("", line, count=1)
                for following in lines[offset + 1 :]:
                    if not following.startswith("     "):  # a long one goes on, deeply indented
                        break
                    text += f" {following.strip()}"
                found.append(Command(page, first + offset, _without_comment(text)))
            elif other := _OTHER.match(line):
                text = _without_comment(f"{other[1]} {other[2]}".strip())
                found.append(Command(page, first + offset, text, program=text.split()[0]))
    for number, line in enumerate((ROOT / page).read_text(encoding="utf-8").splitlines(), start=1):
        if line.startswith("    "):
            continue
        for inline in _INLINE.findall(line):
            text = re.sub(r"^(?:\.venv/bin/)?designer ", "", inline).replace("\\|", "|")
            found.append(Command(page, number, text, inline=True))
    return sorted(found, key=lambda c: c.line)


def snippets(page: str) -> list[Snippet]:
    """The Python of a page: what parses and imports something."""
    found = []
    for first, language, lines in blocks(page):
        text = "\n".join(lines)
        if language not in ("", "python"):
            continue
        try:
            tree = ast.parse(text)
        except SyntaxError:
            assert language != "python", f"{page}:{first}: this is no Python"
            continue
        if any(isinstance(node, ast.Import | ast.ImportFrom) for node in ast.walk(tree)):
            found.append(Snippet(page, first, text))
    return found


def _without_comment(text: str) -> str:
    words = shlex.split(text, comments=True) if "[" not in text else text.split("  #")[0].split()
    return " ".join(w if "[" in text else shlex.quote(w) for w in words)
