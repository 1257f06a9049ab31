"""Tables and lines for people, on standard error; on standard output where they are the answer."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from typing import TYPE_CHECKING

from designer.base.printed import printable

if TYPE_CHECKING:  # a verb's help needs none of it
    from rich.console import Console
    from rich.text import Text

_ANSWERING = ContextVar("_ANSWERING", default=False)


@contextlib.contextmanager
def answering() -> Iterator[None]:
    """A block whose tables and lines are the answer: they go to standard output."""
    token = _ANSWERING.set(True)
    try:
        yield
    finally:
        _ANSWERING.reset(token)


def say(text: str) -> None:
    """A line of any length."""
    _console().print(_text(text), soft_wrap=True)


def table(title: str, rows: Iterable[Mapping[str, str]], gap: int = 2) -> None:
    """A row for each mapping, whose keys are the heads; the same in all rows."""
    rows = list(rows)
    grid(title, list(rows[0]) if rows else [], (list(row.values()) for row in rows), gap)


def grid(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]], gap: int = 2) -> None:
    """A table without lines, so that the longest fits into 80 columns."""
    if not heads:
        say(f"\n{title}: none")
        return
    say(f"\n{title}")
    # A word that is too long goes on in the next line: what is cut off may be the answer.
    from rich.table import Column, Table

    rich_table = Table(*(Column(_text(head), overflow="fold") for head in heads), box=None)
    rich_table.padding = (0, gap, 0, 0)
    for row in rows:
        rich_table.add_row(*(_text(cell) for cell in row))
    _console().print(rich_table)


def _text(text: str) -> Text:
    from rich.text import Text

    return Text(printable(text))


def _console() -> Console:
    """Wide enough for a row where there is no terminal to ask."""
    from rich.console import Console

    stream = sys.stdout if _ANSWERING.get() else sys.stderr
    return Console(file=stream, width=None if stream.isatty() else 120)
