"""The report: what was asked, what was found, how many boards will work, what to buy.

``report.html`` is one file that loads nothing; ``report.md`` says the same as text. Both are made
from the same facts (``report.facts``), hold no time and no path, and are equal for equal
results and command lines.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from designer.base.atomic_write import write
from designer.report.data import ReportData
from designer.report.facts import facts
from designer.report.pictures import pictures
from designer.report.tables import Table

_NPQ = r"(?:\d+-\d+-\d+|n-p-q|n-q-p)"
_WHOLE = re.compile(rf"ω = [\d.]+(?: \({_NPQ}\))?|(?<![\w-]){_NPQ}(?![\w-])")


def write_report(data: ReportData, html: Path, markdown: Path) -> None:
    """Write both reports; each appears whole or not at all.

    Raises
    ------
    InputError : a file cannot be written.
    """
    said = facts(data)
    for path, text in ((markdown, _markdown(said)), (html, _html(data, said))):
        write(path, text)


def render_html(data: ReportData) -> str:
    """``report.html`` as text."""
    return _html(data, facts(data))


def render_markdown(data: ReportData) -> str:
    """``report.md`` as text."""
    return _markdown(facts(data))


def _html(data: ReportData, said: Mapping[str, Any]) -> str:
    pages = Environment(
        loader=PackageLoader("designer.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    pages.filters["text"] = _unbroken
    page = pages.get_template("report.html.j2")
    return page.render(**said, **pictures(data))


def _markdown(said: Mapping[str, Any]) -> str:
    pages = Environment(
        loader=PackageLoader("designer.report", "templates"),
        autoescape=False,
        finalize=_plain,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    pages.filters["table"] = _text_table
    pages.filters["verbatim"] = lambda text: Markup("    " + " ".join(str(text).split()))
    pages.filters["preformatted"] = lambda line: Markup("    " + line)
    return pages.get_template("report.md.j2").render(**said)


def _unbroken(value: object) -> Markup:
    """Any text in HTML: no line ends inside an n-p-q, or between a frequency and its n-p-q."""
    text = str(escape(str(value)))
    return Markup(_WHOLE.sub(lambda m: f'<span class="whole">{m[0]}</span>', text))


def _plain(value: object) -> object:
    """Any text in Markdown: one line, and nothing in it is markup."""
    if isinstance(value, Markup):
        return value
    flat = " ".join(str(value).split())
    flat = flat.replace("\\", "\\\\").replace("&", "&amp;").replace("<", "&lt;")
    return re.sub(r"([`*_\[\]|])", r"\\\1", flat)


def _text_table(table: Table) -> Markup:
    """A Markdown table whose columns line up in plain text too."""
    rows = [[str(_plain(cell)) for cell in row] for row in (table.columns, *table.rows)]
    widths = [max(3, *(len(row[i]) for row in rows)) for i in range(len(table.columns))]

    def line(row: Sequence[str]) -> str:
        cells = (
            cell.rjust(width) if i in table.numeric else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        return f"| {' | '.join(cells)} |"

    rule = [
        "-" * (width - 1) + (":" if i in table.numeric else "-") for i, width in enumerate(widths)
    ]
    return Markup("\n".join([line(rows[0]), line(rule), *(line(row) for row in rows[1:])]))
