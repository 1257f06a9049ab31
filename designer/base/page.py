"""A page of prose, tables and pictures as data: ``markdown`` and ``report.write`` write it.

Text is plain and is escaped. ``Markup`` is Markdown already: pages that are never HTML may have it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import takewhile
from typing import Literal, TypeVar

from markupsafe import Markup

T = TypeVar("T")

FOLD = 6
"""Rows that say the same from which on a table may fold them into a sentence."""
PHRASE = 60
"""Characters of a cell that may stand in lines of a few words each."""


class SmallPrint(str):
    """A paragraph of small print."""

    __slots__ = ()


class Lead(str):
    """The line that a section comes to, before the sentences that it rests on."""

    __slots__ = ()


@dataclass(frozen=True)
class Table:
    """A table of texts."""

    columns: tuple[str, ...]
    """Headings of the columns."""
    rows: tuple[tuple[str, ...], ...]
    """Cells, row by row."""
    numeric: tuple[int, ...] = ()
    """Indices of the columns that are set flush right."""
    names: int = 0
    """How many first columns name a row, in a table whose equal rows fold; 0: none folds."""

    @cached_property
    def folded(self) -> FoldedTable | None:
        """The table with the rows that say the same, but for their names, as one sentence; None
        where fewer than ``FOLD`` do, or not most of them."""
        repeated = Counter(row[self.names :] for row in self.rows)
        cells, count = repeated.most_common(1)[0] if self.names and self.rows else ((), 0)
        if count < FOLD or 2 * count <= len(self.rows):
            return None
        rest = tuple(row for row in self.rows if row[self.names :] != cells)
        same = tuple(row for row in self.rows if row[self.names :] == cells)
        who = f"All {count}" if not rest else f"{count} of {len(self.rows)}"
        if len(set(cells)) == 1:
            text = cells[0]
        else:
            pairs = zip(self.columns[self.names :], cells, strict=True)
            text = ", ".join(f"{column} {cell}" for column, cell in pairs if cell)
        shown = replace(self, rows=rest, names=0) if rest else None
        return FoldedTable(shown, replace(self, rows=same, names=0), f"{who} agree: {text}.")

    @property
    def broad(self) -> bool:
        """Whether it needs more than a phone's width: many columns, or long text."""
        longest = max((len(cell) for row in self.rows for cell in row), default=0)
        return len(self.columns) > 3 or longest > PHRASE


@dataclass(frozen=True)
class FoldedTable:
    """A table of which most rows say the same."""

    shown: Table | None
    """The other rows; None where there are none."""
    hidden: Table
    """The rows that say the same."""
    sentence: str
    """What they say."""


@dataclass(frozen=True)
class Picture:
    """A figure: a file beside the page, or an element of it."""

    label: str = ""
    """What it shows, in words; an ``svg`` says so itself."""
    caption: str = ""
    file: str = ""
    """Name of the file; "" for a picture that Markdown leaves out."""
    svg: str = ""
    """The ``<svg>`` elements of HTML, as ``Markup``."""
    sketch: tuple[str, ...] = ()
    """Verbatim of characters that show the same in Markdown."""
    warning: str = ""
    """What is wrong with what it shows, or ""."""
    plot: str = ""
    """Name of the plot that HTML draws in its place where scripts run, or ""."""
    width: int = 0
    """Pixels of a screen that it is at least as wide as in HTML, so that its lettering can be read;
    0 leaves it to the page."""


@dataclass(frozen=True)
class Widget:
    """A place that a script of HTML fills; nothing elsewhere."""

    name: str
    """Its name in the page's scripts."""
    without: str
    """What stands there where no script runs."""


@dataclass(frozen=True)
class Gallery:
    """Small pictures side by side, in HTML alone."""

    intro: str
    """What they show."""
    key: Picture
    """Their common legend; without ``svg`` where they need none."""
    pictures: tuple[Picture, ...]


@dataclass(frozen=True)
class Bar:
    """A share with its interval, beside what it is of."""

    name: str
    """What it is of."""
    text: str
    """The share in words, or why there is none."""
    more: str = ""
    """Its interval in words, or ""."""
    share: float | None = None
    """The share, from 0 to 1; None where it is not known."""
    interval: tuple[float, float] | None = None
    """Its interval; None where it has none."""
    svg: str = ""
    """The ``<svg>`` element of what it is of, as ``Markup``."""
    link: str = ""
    """Anchor of the section that says more of it, or ""."""
    warning: str = ""
    """What is wrong with it, or ""."""


@dataclass(frozen=True)
class Bars:
    """Shares side by side, in HTML alone."""

    bars: tuple[Bar, ...]


@dataclass(frozen=True)
class Remedies:
    """What is to be done, each with the command that does it."""

    items: tuple[tuple[str, str], ...]
    """(text, command); a command may be ""."""


@dataclass(frozen=True)
class Items:
    """A list."""

    items: tuple[tuple[str, str], ...]
    """(head, text); a head may be ""."""
    kind: Literal["bullets", "terms"] = "bullets"
    """How HTML sets it."""


@dataclass(frozen=True)
class Verbatim:
    """Verbatim that stay as they are, such as a command or equations."""

    lines: tuple[str, ...]
    equations: bool = False
    """Whether HTML sets them as formulas."""


@dataclass(frozen=True)
class FileLinks:
    """Links to files that stand beside the page."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class PageSection:
    """A heading with what stands below it."""

    title: str
    blocks: Sequence[Block]
    """Paragraphs, tables, pictures, sections of the next level; None stands for nothing."""
    anchor: str = ""
    """Name of the section in links."""
    entry: str = ""
    """What the table of contents calls it; "" where it calls it by its anchor."""
    summary: str = ""
    """What it comes to, in a line. HTML folds a section that has one and shows the line alone."""

    @property
    def linked(self) -> list[PageSection]:
        """The sections within it that have an anchor, in their order; itself where it has none."""
        inner = [s for block in self.blocks if isinstance(block, PageSection) for s in block.linked]
        return inner or [self] * bool(self.anchor)


@dataclass(frozen=True)
class Columns:
    """Sections side by side, where there is room."""

    sections: tuple[PageSection, ...]


Block = (
    str | Table | Picture | Widget | Gallery | Bars | Remedies | Items | Verbatim | FileLinks
    | PageSection | Columns | None
)  # fmt: skip


@dataclass(frozen=True)
class Page:
    """A page."""

    title: str
    head: Sequence[Block]
    """What stands before the first section."""
    sections: Sequence[PageSection]

    @property
    def open(self) -> Sequence[PageSection]:
        """The sections before the first that HTML folds: what is read first."""
        return list(takewhile(lambda section: not section.summary, self.sections))

    @property
    def folded(self) -> Sequence[PageSection]:
        """The first section that HTML folds, and those after it."""
        return self.sections[len(self.open) :]

    @property
    def linked(self) -> list[PageSection]:
        """The sections of the table of contents, in their order."""
        return [one for section in self.sections for one in section.linked]


def titled(title: str, block: Block) -> PageSection | None:
    """A section of one block; None where there is none."""
    return None if block is None else PageSection(title, [block])


def bullets(texts: Iterable[str]) -> Items:
    """A list of texts without heads."""
    return Items(tuple(("", text) for text in texts))


def table(
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    numeric: Sequence[int] = (),
    names: int = 0,
) -> Table | None:
    """A table, or None where there are no rows. A last column that says nothing is left out."""
    cells = [tuple(row) for row in rows]
    if not cells:
        return None
    end = len(columns) if any(row[-1] for row in cells) else len(columns) - 1
    return Table(tuple(columns[:end]), tuple(row[:end] for row in cells), tuple(numeric), names)


def table_of(
    items: Iterable[T], columns: Mapping[str, Callable[[T], str]], numeric: Collection[str] = ()
) -> Table | None:
    """The same with a row for each item. columns : what each says of an item, by heading. numeric :
    headings of those that are set flush right."""
    rows = [[cell(item) for cell in columns.values()] for item in items]
    return table(list(columns), rows, [i for i, name in enumerate(columns) if name in numeric])


def markdown(page: Page) -> str:
    """The page as Markdown. A section of pictures alone is left out."""
    title = f"# {plain(page.title)}"
    return "\n\n".join([title, *_texts([*page.head, *page.sections], 2)]) + "\n"


def paragraphs(blocks: Sequence[Block]) -> str:
    """Blocks of a page as Markdown, below its title."""
    return "\n\n".join(_texts(blocks, 2)) + "\n"


def _texts(blocks: Sequence[Block], level: int) -> list[str]:
    return [text for block in blocks for text in _block(block, level)]


def _block(block: Block, level: int) -> list[str]:
    match block:
        case str():
            return [str(plain(block))]
        case Table(folded=FoldedTable() as folded):
            rest = [] if folded.shown is None else [_table(folded.shown)]
            return [*rest, str(plain(folded.sentence))]
        case Table():
            return [_table(block)]
        case Picture():
            return _picture(block)
        case Items():
            return ["\n".join(_item(head, text) for head, text in block.items)] * bool(block.items)
        case Remedies():
            return [text for item in block.items for text in _remedy(*item)]
        case Verbatim():
            return [_verbatim(" ".join(line.split()) for line in block.lines)]
        case FileLinks():
            return [f"Beside this page: {', '.join(f'[{n}]({n})' for n in block.names)}."]
        case PageSection():
            below = _texts(block.blocks, level + 1)
            summary = [str(plain(block.summary))] * bool(block.summary)
            return [f"{'#' * level} {plain(block.title)}", *summary, *below] if below else []
        case Columns():
            return _texts(block.sections, level)
    return []


def _item(head: str, text: str) -> str:
    return f"- **{plain(head)}**: {plain(text)}" if head else f"- {plain(text)}"


def _remedy(text: str, command: str) -> list[str]:
    return [str(plain(text)), *[_verbatim([" ".join(command.split())])] * bool(command)]


def _picture(picture: Picture) -> list[str]:
    if not picture.file and not picture.sketch:
        return []
    image = f"![{plain(picture.label)}]({picture.file})"
    if picture.sketch:
        image = _verbatim(picture.sketch)
    return [image, str(plain(picture.caption))] if picture.caption else [image]


def _verbatim(lines: Iterable[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)


def plain(text: str) -> str:
    """Any text in Markdown: one line, and nothing in it is markup."""
    if isinstance(text, Markup):
        return text
    flat = " ".join(text.split())
    flat = flat.replace("\\", "\\\\").replace("&", "&amp;").replace("<", "&lt;")
    return re.sub(r"([`*_\[\]|])", r"\\\1", flat)


def _table(table: Table) -> str:
    """A Markdown table whose columns line up in plain text too."""
    rows = [[plain(cell) for cell in row] for row in (table.columns, *table.rows)]
    widths = [max(3, *(len(row[i]) for row in rows)) for i in range(len(table.columns))]
    right = [i in table.numeric for i in range(len(widths))]
    rule = ["-" * (w - 1) + (":" if r else "-") for w, r in zip(widths, right, strict=True)]
    lines = [
        [c.rjust(w) if r else c.ljust(w) for c, w, r in zip(row, widths, right, strict=True)]
        for row in (rows[0], rule, *rows[1:])
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
