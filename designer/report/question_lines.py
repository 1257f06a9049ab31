"""What each question of a report comes to, in a line: what stands there while it is folded."""

from __future__ import annotations

import math

from designer.circuit.coefficients import EXACT
from designer.report import words
from designer.report.data import ReportData
from designer.report.four_answers import ORDER, coefficients, working as boards_that_work
from designer.report.response_tables import reasons_of

MADE_WITH = "The command that makes it again, versions, seed and settings."
WORDS = "n-p-q, ω, exact circuit, ok, lost, grazing, tuned, reached and others."


def shown(data: ReportData) -> str:
    """What the engines show."""
    checked = data.checked
    if not checked:
        return "No response is asked for."
    wrong = [c for c in checked if words.problem(c)]
    engines = "model, exact circuit and ngspice" if data.ngspice_ran else "model and exact circuit"
    if not wrong:
        number = "The response" if len(checked) == 1 else f"{words.all_of(len(checked))} responses"
        return f"{number} as wanted, in {engines}."
    return f"{len(checked) - len(wrong)} of {len(checked)} as wanted. {words.problem(wrong[0])}."


def working(data: ReportData) -> str:
    """How many boards work, and what most of the others show."""
    said = boards_that_work(data) or "Not known."
    decided = [
        (y.rate, i) for i, y in enumerate(data.yields) if y is not None and math.isfinite(y.rate)
    ]
    rate, place = min(decided, default=(1.0, 0))
    if rate >= 1.0:
        return said
    why = reasons_of(data.study.answers_to(place), 1)
    return f"{said} Of {words.name(data.checked[place])} most often {why[0]}." if why else said


def attributed(data: ReportData) -> str:
    """What limits the response that fewest boards show."""
    known = [
        (math.inf if y is None or not math.isfinite(y.rate) else y.rate, i)
        for i, y in enumerate(data.yields)
        if data.attribution_of(i) is not None
    ]
    if not known:
        return "Not worked out."
    place = min(known)[1]
    attribution = data.attribution_of(place)
    assert attribution is not None
    return f"{words.name(data.checked[place])}: {attribution.limited_by}."


def chosen(data: ReportData) -> str:
    """How good the choice of parts is."""
    circuit, proof = data.design.circuit, data.design.certificate.status
    passives = len(circuit.resistors) + len(circuit.capacitors)
    text = f"{passives} resistors and capacitors, {words.plural(len(circuit.packages), 'op-amp')}. "
    open_ = proof != "optimal" and data.design.errors.max_error > EXACT
    return text + coefficients(data) + " Not proved to be the least." * open_


def built(data: ReportData) -> str:
    """What there is to order, and how far the board is."""
    pieces = f"{sum(int(row['quantity']) for row in data.bom)} pieces"
    if data.board_cost is not None and data.board_cost.costs:
        one = min(data.board_cost.costs, key=lambda c: abs(c.boards - ORDER))
        pieces += f", about {one.total:.0f}\u00a0€ a board at {one.boards}"
    board = data.board_file
    if board is None:
        return f"{pieces}."
    return f"{pieces}; the board is {'routed' if board.copper else 'placed and not routed'}."
