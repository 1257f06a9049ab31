"""S-expressions as KiCad writes them: a reader with positions for errors, and a writer.

``(name atom "text" (name …))``. An atom is bare (a keyword or number) or quoted (text). A line
whose first character is ``#`` is a comment. Files hold one expression; a ``.kicad_dru`` several.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from designer.base.errors import InputError

DEEPEST = 100
"""Levels of nesting that a file may have; KiCad's own have about a dozen."""
LARGEST = 1e9
"""Size of a number: KiCad's own lengths are below 2147 mm. Squares and products stay finite."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_TOKEN = re.compile(
    r'(?P<space>\s+)|(?P<open>\()|(?P<close>\))|"(?P<quoted>(?:[^"\\]|\\.)*)"'
    r'|(?P<bare>[^\s()"]+)',
    re.DOTALL,
)
_BARE = re.compile(r'[^\s()"#]+[^\s()"]*')
_ESCAPE = re.compile(r"\\(.)", re.DOTALL)
_MEANS = {"n": "\n", "r": "\r", "t": "\t"}
_WRITTEN = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"}


@dataclass(frozen=True)
class Atom:
    """A word."""

    text: str
    """The word, without quotation marks."""
    quoted: bool = False
    """Whether it stands in quotation marks."""
    place: tuple[int, int] = field(default=(0, 0), compare=False, repr=False)
    """(line, column) from 1 where it begins."""


@dataclass(frozen=True)
class Expression:
    """A list of atoms and lists; ``name`` is its first atom."""

    items: tuple[Atom | Expression, ...]
    """The atoms and lists, in order."""
    place: tuple[int, int] = field(default=(0, 0), compare=False, repr=False)
    """(line, column) from 1 where it begins, for messages."""
    file: Path | None = field(default=None, compare=False, repr=False)
    """The file that it was read from, for messages."""

    @property
    def name(self) -> str:
        """The first atom; empty where there is none."""
        first = self.items[0] if self.items else None
        return first.text if isinstance(first, Atom) else ""

    @property
    def atoms(self) -> tuple[str, ...]:
        """The texts of the atoms after the name, in order."""
        return tuple(i.text for i in self.items[1:] if isinstance(i, Atom))

    @property
    def children(self) -> tuple[Expression, ...]:
        """The lists in it, in order."""
        return tuple(i for i in self.items if isinstance(i, Expression))

    def all(self, name: str) -> tuple[Expression, ...]:
        """The lists of this name directly in it."""
        return tuple(child for child in self.children if child.name == name)

    def find(self, name: str) -> Expression | None:
        """The first list of this name directly in it."""
        return next(iter(self.all(name)), None)

    def get(self, name: str) -> Expression:
        """The first list of this name; InputError where there is none."""
        found = self.find(name)
        if found is None:
            raise self.error("no such list", f"({name} …)")
        return found

    def text(self, index: int = 0) -> str:
        """The atom at this place after the name; InputError where there is none."""
        if index >= len(self.atoms):
            raise self.error(f"{len(self.atoms)} values", f"at least {index + 1}")
        return self.atoms[index]

    def number(self, index: int = 0) -> float:
        """The number at this place after the name; InputError where there is none."""
        text = self.text(index)
        if not _NUMBER.fullmatch(text):
            raise self.error(text, "a number")
        value = float(text)
        if abs(value) > LARGEST:
            raise self.error(text, f"a number of a size up to {LARGEST:g}")
        return value

    def walk(self) -> Iterator[Expression]:
        """It and every list in it, in the order of the file."""
        yield self
        for child in self.children:
            yield from child.walk()

    def error(self, found: str, expected: str) -> InputError:
        """Something wrong with this list, with its place in the file."""
        return _error(self.file, self.place, f"({self.name} …): {found}", expected)


def expression(name: str, *values: Atom | Expression | str | float | bool | None) -> Expression:
    """A list: text is quoted, numbers are bare, truth is ``yes`` or ``no``, None is left out."""
    return Expression((Atom(name), *(_item(v) for v in values if v is not None)))


def word(text: str) -> Atom:
    """A bare atom: a keyword."""
    return Atom(text)


def number_text(value: float) -> str:
    """A number of at most six decimals, without exponent, trailing zeros or a negative zero."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def read(text: str, file: Path | None = None) -> Expression:
    """The one expression of a file.

    Raises
    ------
    InputError : not an S-expression, cut off, or more than one; with line and column.
    """
    found = read_all(text, file)
    if len(found) != 1:
        place = found[1].place if found else (1, 1)
        raise _error(file, place, f"{len(found)} expressions", "one")
    return found[0]


def read_all(text: str, file: Path | None = None) -> tuple[Expression, ...]:
    """The expressions of a file; InputError as in ``read``."""
    done: list[Expression] = []
    stack: list[tuple[tuple[int, int], list[Atom | Expression]]] = []
    line, line_start, at = 1, 0, 0
    blank = True  # nothing but space on this line so far
    while at < len(text):
        place = (line, at - line_start + 1)
        if blank and text[at] == "#":
            end = text.find("\n", at)
            at = len(text) if end < 0 else end
            continue
        match = _TOKEN.match(text, at)
        if match is None:
            raise _error(file, place, "text without an end", "a quotation mark that closes it")
        kind, token = match.lastgroup, match.group()
        if kind == "open":
            if len(stack) == DEEPEST:
                raise _error(file, place, f"more than {DEEPEST} levels", "a file as KiCad writes")
            stack.append((place, []))
        elif kind == "close":
            if not stack:
                raise _error(file, place, '")"', "nothing after the last expression")
            began, items = stack.pop()
            made = Expression(tuple(items), began, file)
            (stack[-1][1] if stack else done).append(made)
        elif kind != "space":
            if not stack:
                raise _error(file, place, token[:40], '"("')
            quoted = kind == "quoted"
            inside = _unescaped(match.group("quoted")) if quoted else token
            stack[-1][1].append(Atom(inside, quoted, place))
        at = match.end()
        newlines = token.count("\n")
        if newlines:
            line += newlines
            line_start = match.start() + token.rindex("\n") + 1
        blank = (blank or newlines > 0) if kind == "space" else False
    if stack:
        raise _error(file, stack[-1][0], 'a "(" that nothing closes', "a whole file")
    return tuple(done)


def expression_text(made: Expression) -> str:
    """The expression as text that ends in a newline: lists of atoms on one line, others indented.

    Raises
    ------
    ValueError : a bare atom that would not be read as one.
    """
    return "\n".join(_lines(made, 0)) + "\n"


def write_all(made: Iterable[Expression]) -> str:
    """Several expressions, a blank line between them."""
    return "\n".join(expression_text(each) for each in made)


def _lines(made: Expression, depth: int) -> Iterator[str]:
    """Atoms stay on the line of their list; each list in it has lines of its own."""
    tabs = "\t" * depth
    line = tabs + "("
    began = True
    for item in made.items:
        if isinstance(item, Atom):
            line += ("" if began else " ") + _atom(item)
        else:
            yield line
            *before, line = _lines(item, depth + 1)
            yield from before
        began = False
    if made.children:
        yield line
        line = tabs
    yield line + ")"


def _atom(atom: Atom) -> str:
    if atom.quoted:
        return '"' + "".join(_WRITTEN.get(c, c) for c in atom.text) + '"'
    if not _BARE.fullmatch(atom.text):
        raise ValueError(f"{atom.text!r} has to be quoted")
    return atom.text


def _item(value: Atom | Expression | str | float | bool) -> Atom | Expression:
    if isinstance(value, Atom | Expression):
        return value
    if isinstance(value, bool):
        return Atom("yes" if value else "no")
    if isinstance(value, str):
        return Atom(value, quoted=True)
    return Atom(number_text(value))


def _unescaped(text: str) -> str:
    return _ESCAPE.sub(lambda m: _MEANS.get(m.group(1), m.group(1)), text)


def _error(file: Path | None, place: tuple[int, int], found: str, expected: str) -> InputError:
    return InputError(file, f"line {place[0]}, column {place[1]}", found, expected)
