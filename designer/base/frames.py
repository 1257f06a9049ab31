"""Rows of results as pandas frames, and as small tables of HTML for a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from itertools import islice
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS = 20
"""Of a table in a notebook; what is left out is said."""


def frame(rows: Iterable[Mapping[str, Any]], columns: Sequence[str] = ()) -> pd.DataFrame:
    """The rows as a frame. columns : which it has where there are no rows."""
    import pandas as pd  # takes half a second, and few callers want a frame

    listed = [dict(row) for row in rows]
    return pd.DataFrame(listed) if listed else pd.DataFrame(columns=list(columns))


def flat_frame(rows: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """The same of nested rows: the column "yield.ok" is the entry "ok" of the entry "yield"."""
    import pandas as pd

    return pd.json_normalize([dict(row) for row in rows])


def table_html(title: str, rows: Iterable[Mapping[str, Any]], note: str = "") -> str:
    """The rows as a table of HTML under a title, with a note below; every text is escaped."""
    listed = list(rows)
    first_rows = list(islice(listed, MOST_ROWS))
    heads = list(dict.fromkeys(name for row in first_rows for name in row))
    lines = [
        _row("th", heads),
        *(_row("td", [row.get(name) for name in heads]) for row in first_rows),
    ]
    left = len(listed) - len(first_rows)
    notes = [text for text in (note, f"{left} more rows" if left else "") if text]
    table = f"<table>{''.join(lines)}</table>" if first_rows else ""
    return f"<p><b>{escape(title)}</b></p>{table}" + "".join(f"<p>{escape(n)}</p>" for n in notes)


def _row(tag: str, cells: Sequence[Any]) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(_text(c))}</{tag}>" for c in cells) + "</tr>"


def _text(cell: Any) -> str:
    """What a cell shows: six digits of a number, nothing for None."""
    if cell is None:
        return ""
    return f"{cell:.6g}" if isinstance(cell, float) else str(cell)
