"""Sections put into a report that is written already.

They stand between two marks, before what the report was made with, and have an entry each in the
table of contents. A report without them has no marks; what stood there before is replaced. Reports
of earlier versions have them before the section on scales.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from designer.base.page import PageSection, paragraphs
from designer.report.design_page import MADE
from designer.report.page_html import render_sections

_MARKS = "<!-- later results -->\n", "<!-- end of later results -->\n"
_BETWEEN = re.compile(f"(?ms)^{_MARKS[0]}.*?^{_MARKS[1]}")
_HTML = (
    ('<section id="made">\n', '<section id="scales">\n'),
    ('<a href="#provenance">', '<a href="#scales">'),
)
_MARKDOWN = (f"## {MADE}\n", "## Scales and conditions\n")


def inserted_html(html: str, sections: Sequence[PageSection]) -> str:
    """``report.html`` with these sections, and with no others that were put into it."""
    entries = "".join(f'<a href="#{s.anchor}">{s.anchor.capitalize()}</a>\n' for s in sections)
    page = _BETWEEN.sub("", html)
    for places, text in zip(_HTML, (render_sections(sections), entries), strict=True):
        page = _before(page, places, text)
    return page


def inserted_markdown(text: str, sections: Sequence[PageSection]) -> str:
    """``report.md`` with these sections, and with no others that were put into it."""
    return _before(_BETWEEN.sub("", text), _MARKDOWN, paragraphs(sections) + "\n")


def _before(text: str, places: Sequence[str], new: str) -> str:
    """A text with another one between marks before the first of these places that it has; as it is
    where it has none, or there is nothing to put there."""
    place = next((one for one in places if f"\n{one}" in text), None)
    if place is None or not new.strip():
        return text
    before, _, after = text.partition(f"\n{place}")
    return f"{before}\n{_MARKS[0]}{new}{_MARKS[1]}{place}{after}"
