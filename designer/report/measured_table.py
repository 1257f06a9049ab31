"""Board by board: what became of each measured board, where a study is of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from designer.base.csv_tables import csv_text
from designer.verdicts.verdict import Answer, StudyPlan, Verdict
from designer.yields.yield_count import worst

if TYPE_CHECKING:
    from designer.answers.study_answer import MeasuredBoard
    from designer.yields.study import Study


def rows(study: Study) -> list[MeasuredBoard] | None:
    """One object for each board, in the order of the list; None where the study is not of all the
    boards of one.

    board : its name. sample : its number in the rows of the study. verdicts, shown, reasons,
    cells : by response; null where the response was left out. all : the worst verdict, null where
    a response was left out.
    """
    if not study.plan.census:
        return None
    return table(study.plan, [study.answers_to(i) for i in range(len(study.checked))])


def table(plan: StudyPlan, answers: Sequence[Sequence[Answer]]) -> list[MeasuredBoard]:
    """The rows of ``rows`` from the answers to each response; a response that was left out has
    none."""
    by_sample = [{a.sample: a for a in row} for row in answers]
    out: list[MeasuredBoard] = []
    for sample, label in enumerate(plan.labels):
        one = [row.get(sample) for row in by_sample]
        out.append(
            {
                "board": label,
                "sample": sample,
                "verdicts": [None if a is None else str(a.verdict) for a in one],
                "shown": [None if a is None else a.response for a in one],
                "reasons": [None if a is None else a.reason for a in one],
                "cells": [None if a is None else cell(a) for a in one],
                "all": _all(one),
            }
        )
    return out


def cell(answer: Answer) -> str:
    """A verdict for people: what the board shows instead stands beside it."""
    if answer.verdict is Verdict.OK:
        return str(answer.verdict)
    return f"{answer.verdict} ({answer.reason or answer.response})"


def boards_csv(labels: Sequence[str], boards: Sequence[MeasuredBoard]) -> str:
    """``boards.csv``: a row for each board, a column for each response. labels : of these."""
    columns = ("board", *labels, "all")
    cells = [
        {
            "board": row["board"],
            **{name: text or "" for name, text in zip(labels, row["cells"], strict=True)},
            "all": row["all"] or "",
        }
        for row in boards
    ]
    return csv_text(columns, cells)


def response_labels(omegas: Sequence[tuple[float, str | None]]) -> list[str]:
    """Heads of the columns: number, frequency and expected response, no two alike."""
    return [
        f"{number}: {omega:g} {expected or '-'}"
        for number, (omega, expected) in enumerate(omegas, start=1)
    ]


def _all(answers: Sequence[Answer | None]) -> str | None:
    verdicts = {a.verdict for a in answers if a is not None}
    return None if None in answers or not verdicts else str(worst(verdicts))
