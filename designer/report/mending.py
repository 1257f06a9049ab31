"""What is to be mended, and the command that mends it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from designer.base.si_unit import value_text
from designer.check.checked_design import CheckedResponse
from designer.report import words
from designer.report.data import ReportData
from designer.yields.blame_analysis import BlameStage

FEW = 100
"""Below so many samples the report says that the intervals are wide."""
MANY = 1000
"""Boards that a study is told to take then."""
WANTED = 0.95
"""Below this yield a cure is advised; a user may want more or less."""
NAMED = 3
"""Parts that an advice names."""


@dataclass(frozen=True)
class Remedy:
    """One thing that is not as it should be."""

    text: str
    """What it is, in words."""
    command: str = ""
    """The command that mends it, with DIR for the folder of the design; "" where none does."""


def remedies(data: ReportData) -> list[Remedy]:
    """What is to be mended, the most important first; nothing where all is well."""
    parts = (_design, _responses, _netlist, _low_yields, _study, _board)
    return [remedy for part in parts for remedy in part(data)]


def _design(data: ReportData) -> Iterator[Remedy]:
    """Design rules that fail, or what else stands first on the page."""
    if names := ", ".join(rule["id"] for rule in data.failed_rules):
        count = words.plural(len(data.failed_rules), "design rule")
        yield Remedy(f"The circuit does not keep {count}: {names}.", "designer rules DIR")
    elif data.warnings:
        yield Remedy("The design, as the first section of this page says.")


def _responses(data: ReportData) -> Iterator[Remedy]:
    """Responses that are not found, or on which the engines differ."""
    for c in data.checked:
        if problem := words.problem(c):
            yield Remedy(f"{problem}.", _response_command(c))


def _response_command(c: CheckedResponse) -> str:
    """Where the response lives, if the model does not show it; else a match by other parts."""
    if not c.model.found:
        hertz = c.model.omega / (2.0 * math.pi) if c.model.spec.in_hertz else None
        low, high = (
            words.number(share * c.model.omega, 3)
            if hertz is None
            else f"'{value_text(share * hertz, 'Hz', 3)}'"
            for share in (0.8, 1.2)
        )
        return f"designer bifurcation DIR --from {low} --to {high}"
    return "designer rules DIR"


def _netlist(data: ReportData) -> Iterator[Remedy]:
    check = data.result.equations
    if check is not None and check.problem:
        yield Remedy(check.problem, "designer rules DIR")


def _low_yields(data: ReportData) -> Iterator[Remedy]:
    low = [
        (i, y)
        for i, y in enumerate(data.yields)
        if y is not None and math.isfinite(y.rate) and y.rate < WANTED
    ]
    if not low:
        return
    place, least = min(low, key=lambda row: row[1].rate)
    text = (
        f"{words.plural(len(low), 'response')} below {100 * WANTED:g} % yield, the least is "
        f"{words.name(data.checked[place])} with {100 * least.rate:.3g} %."
    )
    if parts := _blamed_parts(data, place):
        text += f" Most losses would be avoided if {parts} were exact."
    yield Remedy(text, f"designer search DIR --yield {WANTED:g}")


def _blamed_parts(data: ReportData, response: int) -> str:
    """The parts that avoid most losses of a response, were they exact; "" where none is known."""
    blame = data.blame_of(response)
    if blame is None:
        return ""
    helpful = [s for s in blame.subjects if s.kind != "group" and s.avoided]
    return " or ".join(s.name for s in helpful[:NAMED])


def _study(data: ReportData) -> Iterator[Remedy]:
    """What would make the figures surer."""
    samples = max((y.samples for y in data.yields if y is not None), default=0)
    if 0 < samples < FEW and not data.plan.census:
        text = f"The intervals are wide: {words.plural(samples, 'board')}."
        yield Remedy(text, f"designer tolerance DIR --samples {MANY}")
    if samples and not data.ngspice_ran and not any(map(words.problem, data.checked)):
        yield Remedy("ngspice was not asked.", "designer tolerance DIR --rung auto")
    if data.study.blame_status.stage is BlameStage.NOT_YET:
        yield Remedy("The blame is not worked out yet.", "designer tolerance DIR --resume")


def _board(data: ReportData) -> Iterator[Remedy]:
    board = data.board_file
    if board is not None and not board.copper:
        yield Remedy("The board is placed and not routed.", "designer export DIR --routed")
