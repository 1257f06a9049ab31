"""The report's table of measured boards, a row for each."""

from __future__ import annotations

from designer.report import words
from designer.report.data import ReportData
from designer.report.measured_table import table as boards_of
from designer.report.tables import Table


def table(data: ReportData) -> Table | None:
    """Every board of a list with its verdict for each response; None where the study is not of all
    the boards of a list."""
    if data.plan is None or not data.census:
        return None
    answers = [data.answers_to(i) for i in range(len(data.checked))]
    rows = [
        (b["board"], *(cell or words.NONE for cell in b["cells"]), b["all"] or words.NONE)
        for b in boards_of(data.plan, answers)
    ]
    heads = ("board", *(words.name(c) for c in data.checked), "all of them")
    return Table(heads, tuple(rows))
