"""What a report says first: does the circuit do it, how many boards work, what to buy, what to
mend. Each answer has one line in bold and the sentences that it rests on."""

from __future__ import annotations

import math

from designer.base.page import Block, Columns, Lead, PageSection, SmallPrint, Verbatim
from designer.circuit.coefficients import EXACT
from designer.report import words
from designer.report.data import ReportData
from designer.report.mending import FEW, remedies
from designer.yields.yield_count import Yield

ORDER = 10
"""Boards of the order whose price an answer names, where the catalogue knows that size."""


def answers(data: ReportData) -> PageSection:
    """The four answers."""
    sections = (
        PageSection("Does the circuit do what the model does?", _match(data)),
        PageSection("How many boards will work?", _yields(data)),
        PageSection("What is there to buy, and what does it cost?", _parts(data)),
        PageSection("What is there to mend?", _remedies(data)),
    )
    return PageSection("In short", [Columns(sections)], "answers")


def _match(data: ReportData) -> list[Block]:
    number = len(data.checked)
    bad = sum(bool(words.problem(c)) for c in data.checked)
    engines = (
        "the model, the exact circuit and ngspice"
        if data.ngspice_ran
        else "the model and the exact circuit (ngspice was not asked)"
    )
    if not number:
        lead, detail = "No response is asked for.", "So none was compared."
    elif not bad:
        every = "The response was" if number == 1 else f"{words.all_of(number)} responses were"
        lead = "Yes, in every engine that was asked."
        detail = f"{every} found, and {engines} agree on {'it' if number == 1 else 'each'}."
    else:
        good, wanted = number - bad, words.plural(number, "response")
        rest = "the other is" if bad == 1 else f"the other {bad} are"
        lead = f"Not all of it: {good} of {wanted}."
        detail = (
            f"{good} of {wanted} {'was' if good == 1 else 'were'} found with {engines} in "
            f"agreement; {rest} named below with what went wrong."
        )
    return [Lead(lead), detail, _coefficients(data)]


def _coefficients(data: ReportData) -> str:
    design = data.design
    worst = design.errors.max_error
    if worst <= EXACT:
        return "Every coefficient of the equations is met exactly."
    text = f"The largest coefficient error is {words.error(worst)}"
    if design.certificate.status == "optimal":
        text += ", proved to be the least that these parts allow"
    return f"{text}."


def _parts(data: ReportData) -> list[Block]:
    design, circuit = data.design, data.design.circuit
    passives = len(circuit.resistors) + len(circuit.capacitors)
    cost = data.board_cost
    lead = f"{passives} resistors and capacitors, {words.plural(len(circuit.packages), 'op-amp')}."
    text = (
        f"The circuit takes {passives} resistors and capacitors of {design.distinct_values} "
        f"different values and {words.plural(len(circuit.packages), 'package')} of the op-amp "
        f"{circuit.opamp}."
    )
    if cost is None or not cost.costs:
        return [Lead(lead), text]
    one = min(cost.costs, key=lambda c: abs(c.boards - ORDER))
    lead = (
        f"{sum(int(row['quantity']) for row in data.bom)} pieces, about {one.total:.0f} € a board."
    )
    price = (
        f"Estimated for an order of {one.boards}: parts {one.parts:.2f} €, bare board "
        f"{one.bare_board:.2f} €, assembly {one.assembly:.2f} €. The list to order from is "
        "bom.csv."
    )
    return [Lead(lead), text, price]


def _remedies(data: ReportData) -> list[Block]:
    listed = remedies(data)
    if not listed:
        return [
            Lead("Nothing that this study shows."),
            "Check the rules of the design, then order boards. DIR is the folder of this design.",
            Verbatim(("designer rules DIR", "designer export DIR --routed")),
        ]
    blocks: list[Block] = [Lead(f"{words.plural(len(listed), 'point')}, the weightiest first.")]
    if any(remedy.command for remedy in listed):
        blocks.append(SmallPrint("DIR is the folder of this design."))
    for remedy in listed:
        blocks += [remedy.text, Verbatim((remedy.command,)) if remedy.command else None]
    return blocks


def _yields(data: ReportData) -> list[Block]:
    rows = [
        (c, y)
        for c, y in zip(data.checked, data.yields, strict=True)
        if y is not None and y.samples
    ]
    if not rows:
        none = "There is no tolerance study: no response could be asked."
        return [Lead("Not known."), none]
    samples = max(y.samples for _, y in rows)
    decided = [(c, y) for c, y in rows if math.isfinite(y.rate)]
    if not decided:
        none = f"Component spread, {samples} simulated boards: not one gave an answer."
        return [Lead("Not known."), none]
    joint = data.study.all_on_one_board
    worst, least = min(decided, key=lambda row: row[1].rate)
    headline = f"{_percent(least)} show {words.name(worst)}."
    if joint is not None and math.isfinite(joint.rate):
        all_ = f"{words.all_of(len(data.checked)).lower()} responses"
        headline = f"{_percent(joint)} show {all_} on one board."
    out = []
    safe = sum(y.ok == y.samples for _, y in rows)
    if safe == len(rows):
        object_ = "it" if len(rows) == 1 else f"{words.all_of(len(rows)).lower()} responses"
        out.append(f"every one shows {object_}: of a thousand, {_of_a_thousand(least)}.")
    else:
        if safe:
            verb = "survives" if safe == 1 else "survive"
            out.append(f"{safe} of {words.plural(len(rows), 'response')} {verb} on every one;")
        out.append(
            f"the most delicate is {words.name(worst)}, shown by {least.ok} of "
            f"{least.samples - least.failed}: of a thousand boards, {_of_a_thousand(least)}."
        )
    if joint is not None and math.isfinite(joint.rate) and safe < len(rows):
        out.append(
            f"{words.all_of(len(data.checked))} responses on one and the same board: {joint.ok} of "
            f"{joint.samples - joint.failed}; of a thousand, {_of_a_thousand(joint)}."
        )
    failed = sum(y.failed for _, y in rows)
    if failed:
        out.append(f"{words.plural(failed, 'run')} gave no answer, which the yields leave out.")
    if samples < FEW and not data.plan.census:
        out.append(f"So few samples ({samples}) leave wide intervals.")
    left = len(data.checked) - len(rows)
    if left:
        out.append(f"{words.plural(left, 'response')} could not be studied.")
    return [Lead(headline), f"{_boards(data, samples)} {' '.join(out)}"]


def _boards(data: ReportData, samples: int) -> str:
    if not data.plan.census:
        return f"Component spread, {samples} simulated boards:"
    if samples > 1:
        return f"All {samples} measured boards, simulated:"
    return "The measured board, simulated:"


def _of_a_thousand(y: Yield) -> str:
    low, high = (round(1000 * v) for v in y.interval)
    if y.census:
        return f"{round(1000 * y.rate)} by share"
    return f"about {round(1000 * y.rate)} (95 % interval {low} to {high})"


def _percent(counted: Yield) -> str:
    low, high = words.span(*counted.interval)
    within = words.limits(counted, f"{low} to {high}\u00a0%")
    return f"{100 * counted.rate:.0f}\u00a0% ({within})"
