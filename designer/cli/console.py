"""Tables and lines for people, on standard error."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence

from rich.console import Console
from rich.table import Column, Table
from rich.text import Text


def say(text: str) -> None:
    """A line of any length."""
    _console().print(Text(text), soft_wrap=True)


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
    rich_table = Table(*(Column(Text(head)) for head in heads), box=None)
    rich_table.padding = (0, gap, 0, 0)
    for row in rows:
        rich_table.add_row(*(Text(cell) for cell in row))
    _console().print(rich_table)


def _console() -> Console:
    """Wide enough for a row where there is no terminal to ask."""
    return Console(stderr=True, width=None if sys.stderr.isatty() else 120)
