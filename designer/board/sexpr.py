"""S-expressions as KiCad writes them: a reader with positions for errors, and a writer.

``(name atom "text" (name …))``. An atom is bare (a keyword or number) or quoted (text). A line
whose first character is ``#`` is a comment. Files hold one expression; a ``.kicad_dru`` several.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TypeAlias

from designer.base.errors import InputError

DEEPEST = 100
"""Levels of nesting that a file may have; KiCad's own have about a dozen."""
MOST_LISTS, MOST_WORDS, LONGEST = 1_500_000, 1_000_000, 1_000_000
"""Lists of a file, different words of it, characters of a word. A board of 60 parts has 35,000
lists and 20,000 words; each takes up to 400 bytes here."""
LARGEST = 1e9
"""Size of a number: KiCad's own lengths are below 2147 mm. Squares and products stay finite."""

# Digits are not given back: of a long word that is no number each part would be tried again.
_NUMBER = re.compile(r"[+-]?(\d++\.?\d*+|\.\d++)([eE][+-]?\d++)?", re.ASCII)
_TOKEN = re.compile(
    r'^[^\S\n]*\#[^\n]*|\s*\n|[^\S\n]+|(\()|(\))|"((?:[^"\\]++|\\.)*+)"|([^\s()"]+)|(")',
    re.DOTALL | re.MULTILINE,
)
"""A comment or space (no group), or a token: its group says of which kind it is."""
_OPEN, _CLOSE, _QUOTED, _BARE_ATOM, _WITHOUT_END = range(1, 6)
_BARE = re.compile(r'[^\s()"#]+[^\s()"]*')
_ESCAPE = re.compile(r"\\(.)", re.DOTALL)
_MEANS = {"n": "\n", "r": "\r", "t": "\t"}
_WRITTEN = str.maketrans({"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"})


@dataclass(frozen=True, slots=True)
class Atom:
    """A word."""

    text: str
    """The word, without quotation marks."""
    quoted: bool = False
    """Whether it stands in quotation marks."""


@dataclass(frozen=True)
class SourceText:
    """The text that expressions were read from, for messages."""

    text: str
    file: Path | None

    def error(self, offset: int, found: str, expected: str) -> InputError:
        """Something wrong at this offset into the text."""
        line = self.text.count("\n", 0, offset) + 1
        column = offset - self.text.rfind("\n", 0, offset)
        return InputError(self.file, f"line {line}, column {column}", found, expected)


@dataclass(frozen=True)
class Expression:
    """A list of atoms and lists; ``name`` is its first atom."""

    items: tuple[Atom | Expression, ...]
    """The atoms and lists, in order."""
    source: SourceText = field(default=SourceText("", None), compare=False, repr=False)
    """What it was read from, for messages."""
    offset: int = field(default=0, compare=False, repr=False)
    """Where it begins there, in characters."""

    @property
    def name(self) -> str:
        """The first atom; empty where there is none."""
        first = self.items[0] if self.items else None
        return first.text if isinstance(first, Atom) else ""

    @property
    def atoms(self) -> tuple[str, ...]:
        """The texts of the atoms after the name, in order."""
        return tuple(i.text for i in self.items[1:] if isinstance(i, Atom))

    @cached_property
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
        child = self.find(name)
        if child is None:
            raise self.error("no such list", f"({name} …)")
        return child

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
        return self.source.error(self.offset, f"({self.name} …): {found}", expected)


Value: TypeAlias = "Atom | Expression | str | float | bool | None"
Contents: TypeAlias = "Value | tuple[Value, ...] | Mapping[str, Contents]"


def expression(name: str, /, *values: Value, **inner: Contents) -> Expression:
    """A list: text is quoted, numbers are bare, truth is ``yes`` or ``no``, None is left out.

    inner : see ``lists``. ``expression("pad", "1", at=(1, 2))`` is ``(pad "1" (at 1 2))``.
    """
    items = [_item(value) for value in values if value is not None]
    return Expression((Atom(name), *items, *lists(**inner)))


def lists(**named: Contents) -> tuple[Expression, ...]:
    """Lists by name, in order: each with its one value, a tuple of values, or the lists in it.

    What is None is left out, and an empty tuple is a list of its name alone.
    """
    return tuple(_list(name, inner) for name, inner in named.items() if inner is not None)


def _list(name: str, inner: Contents) -> Expression:
    if isinstance(inner, Mapping):
        return expression(name, **inner)
    return expression(name, *(inner if isinstance(inner, tuple) else (inner,)))


def word(text: str) -> Atom:
    """A bare atom: a keyword."""
    return Atom(text)


def number_text(value: float) -> str:
    """A number of at most six decimals, without exponent, trailing zeros or a negative zero."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


# A board of half a megabyte is read by the router, the rules and each picture of a page.
@lru_cache(maxsize=4)
def read(text: str, file: Path | None = None) -> Expression:
    """The one expression of a file. The last few files are remembered.

    Raises
    ------
    InputError : not an S-expression, cut off, or more than one; with line and column. One of more
        lists, levels or words than a file needs.
    """
    expressions = read_all(text, file)
    if len(expressions) != 1:
        offset = expressions[1].offset if expressions else 0
        raise SourceText(text, file).error(offset, f"{len(expressions)} expressions", "one")
    return expressions[0]


def read_all(text: str, file: Path | None = None) -> tuple[Expression, ...]:
    """The expressions of a file; InputError as in ``read``."""
    source = SourceText(text, file)
    # Counted before anything is made of them; one in quotation marks counts too.
    if (count := text.count("(")) > MOST_LISTS:
        raise InputError(file, "the file", f"{count} lists", f"at most {MOST_LISTS}")
    finished: list[Expression] = []
    words: dict[tuple[str, bool], Atom] = {}
    stack: list[tuple[int, list[Atom | Expression]]] = []
    for match in _TOKEN.finditer(text):
        kind = match.lastindex
        if kind is None:
            continue
        if kind == _OPEN:
            if len(stack) == DEEPEST:
                expected = "a file as KiCad writes"
                raise source.error(match.start(), f"more than {DEEPEST} levels", expected)
            stack.append((match.start(), []))
        elif kind == _WITHOUT_END:
            expected = "a quotation mark that closes it"
            raise source.error(match.start(), "text without an end", expected)
        elif not stack:
            wrong = (
                ('")"', "nothing after the last expression")
                if kind == _CLOSE
                else (match[0][:40], '"("')
            )
            raise source.error(match.start(), *wrong)
        elif kind == _CLOSE:
            offset, items = stack.pop()
            (stack[-1][1] if stack else finished).append(Expression(tuple(items), source, offset))
        else:
            # One object for each word: a board repeats its words many times.
            quoted = kind == _QUOTED
            atom = words.get((match[kind], quoted))
            if atom is None:
                expected = "a file as KiCad writes"
                if len(match[kind]) > LONGEST:
                    found = f"a word of more than {LONGEST} characters"
                    raise source.error(match.start(), found, expected)
                if len(words) == MOST_WORDS:
                    found = f"more than {MOST_WORDS} different words"
                    raise source.error(match.start(), found, expected)
                atom = Atom(_unescaped(match[kind]) if quoted else match[kind], quoted)
                words[match[kind], quoted] = atom
            stack[-1][1].append(atom)
    if stack:
        raise source.error(stack[-1][0], 'a "(" that nothing closes', "a whole file")
    return tuple(finished)


def expression_text(tree: Expression) -> str:
    """The expression as text that ends in a newline: lists of atoms on one line, others indented.

    Raises
    ------
    ValueError : a bare atom that would not be read as one.
    """
    pieces: list[str] = []
    _add(tree, "", pieces)
    return "".join(pieces) + "\n"


def write_all(trees: Iterable[Expression]) -> str:
    """Several expressions, a blank line between them."""
    return "\n".join(expression_text(each) for each in trees)


def _add(tree: Expression, tabs: str, pieces: list[str]) -> None:
    """Atoms stay on the line of their list; each list in it has lines of its own."""
    space, end = tabs + "(", ")"
    for item in tree.items:
        if isinstance(item, Atom):
            pieces.append(space + _atom(item))
        else:
            pieces.append((space if space != " " else "") + "\n")
            _add(item, tabs + "\t", pieces)
            end = f"\n{tabs})"
        space = " "
    pieces.append(end if tree.items else space + end)


def _atom(atom: Atom) -> str:
    if atom.quoted:
        return f'"{atom.text.translate(_WRITTEN)}"'
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
    if "\\" not in text:
        return text
    return _ESCAPE.sub(lambda m: _MEANS.get(m.group(1), m.group(1)), text)
