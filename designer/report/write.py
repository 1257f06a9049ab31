"""The report: what was asked, what was found, how many boards will work, what to buy.

``report.html`` is one file that loads nothing; ``report.md`` says the same as text. Both are made
from the same page (``report.design_page``), hold no time and no path, and are equal for equal
results and command lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from designer.base.atomic_write import write
from designer.base.page import PageSection, markdown
from designer.report.board_columns import boards_json
from designer.report.data import ReportData
from designer.report.design_page import design_page
from designer.report.inserted import inserted_html, inserted_markdown
from designer.report.interactive_plots import plots
from designer.report.page_html import render_page
from designer.report.pictures import pictures


def write_report(
    data: ReportData, html: Path, text: Path, sections: Sequence[PageSection] = ()
) -> None:
    """Write both reports; each appears whole or not at all. sections : of what later verbs answered
    of the same design (``verb_sections``).

    Raises
    ------
    InputError : a file cannot be written.
    """
    write(text, inserted_markdown(render_markdown(data), sections))
    write(html, inserted_html(render_html(data), sections))


def render_html(data: ReportData) -> str:
    """``report.html`` as text."""
    return render_page(design_page(data, pictures(data)), plots(data), boards_json(data))


def render_markdown(data: ReportData) -> str:
    """``report.md`` as text."""
    return markdown(design_page(data, {}))
