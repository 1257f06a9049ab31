"""What a report says first: its summary, and the few figures at its head."""

from __future__ import annotations

import math

from designer.circuit.coefficients import EXACT
from designer.report import words
from designer.report.data import ReportData
from designer.yields.yield_count import Yield

FEW = 100
"""Below so many samples the report says that the intervals are wide."""


def summary(data: ReportData) -> list[str]:
    """The first paragraphs of a report."""
    design, circuit = data.design, data.design.circuit
    number = len(data.checked)
    wanted = words.plural(number, "response")
    title = data.result.modelfile.title
    purpose = f"Asked for: an op-amp circuit that behaves like the model “{title}”"
    out = [
        f"{purpose} and shows {wanted} of it." if number else f"{purpose}; no response is named."
    ]
    if number:
        bad = [c for c in data.checked if words.problem(c)]
        engines = (
            "the model, the exact circuit and ngspice"
            if data.ngspice_ran
            else "the model and the exact circuit (ngspice was not asked)"
        )
        if not bad:
            every = "The response was" if number == 1 else f"{words.all_of(number)} responses were"
            out.append(f"{every} found, and {engines} agree on {'it' if number == 1 else 'each'}.")
        else:
            good = number - len(bad)
            rest = "the other is" if len(bad) == 1 else f"the other {len(bad)} are"
            out.append(
                f"{good} of {wanted} {'was' if good == 1 else 'were'} found with {engines} in "
                f"agreement; {rest} named below with what went wrong."
            )
    passives = len(circuit.resistors) + len(circuit.capacitors)
    worst = design.errors.max_error
    match = "every coefficient of the equations is met exactly"
    if worst > EXACT:
        match = f"the largest coefficient error is {words.error(worst)}"
        if design.certificate.status == "optimal":
            match += ", proved to be the least that these parts allow"
    out.append(
        f"The circuit takes {passives} resistors and capacitors of {design.distinct_values} "
        f"different values and {words.plural(len(circuit.packages), 'package')} of the op-amp "
        f"{circuit.opamp}; {match}."
    )
    return [*out, _yield_words(data)]


def _yield_words(data: ReportData) -> str:
    rows = [
        (c, y)
        for c, y in zip(data.checked, data.yields, strict=True)
        if y is not None and y.samples
    ]
    if not rows:
        return "There is no tolerance study: no response could be asked."
    samples = max(y.samples for _, y in rows)
    decided = [(c, y) for c, y in rows if math.isfinite(y.rate)]
    if not decided:
        return f"Component spread, {samples} simulated boards: not one gave an answer."
    out = []
    safe = sum(y.ok == y.samples for _, y in rows)
    worst, least = min(decided, key=lambda row: row[1].rate)
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
    joint = data.study.all_on_one_board
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
    boards = f"Component spread, {samples} simulated boards:"
    if data.plan.census:
        boards = "The measured board, simulated:"
        if samples > 1:
            boards = f"All {samples} measured boards, simulated:"
    return f"{boards} {' '.join(out)}"


def _of_a_thousand(y: Yield) -> str:
    low, high = (round(1000 * v) for v in y.interval)
    if y.census:
        return f"{round(1000 * y.rate)} by share"
    return f"about {round(1000 * y.rate)} (95 % interval {low} to {high})"


def tiles(data: ReportData) -> list[tuple[str, str]]:
    """(figure, what it is) for the head of the page."""
    good = sum(not words.problem(c) for c in data.checked)
    out = []
    if data.checked:
        engines = "all engines agree" if data.ngspice_ran else "ngspice was not asked"
        name = "response" if len(data.checked) == 1 else "responses"
        out.append((f"{good} of {len(data.checked)}", f"{name} found, {engines}"))
    worst = data.design.errors.max_error
    if worst <= EXACT:
        out.append(("exact", "every coefficient of the equations"))
    else:
        out.append((words.error(worst), "largest coefficient error"))
    out.append((str(data.design.distinct_values), "different R and C values"))
    rated = [y for y in data.yields if y and math.isfinite(y.rate)]
    if rated:
        name = "yield" if len(rated) == 1 else "least yield"
        out.append(_yield_tile(name, min(rated, key=lambda y: y.rate)))
    joint = data.study.all_on_one_board
    if joint is not None and math.isfinite(joint.rate):
        out.append(_yield_tile("all on one board", joint))
    return out


def _yield_tile(name: str, counted: Yield) -> tuple[str, str]:
    low, high = words.span(*counted.interval)
    within = words.limits(counted, f"{low} to {high}\u00a0%")
    return f"{100 * counted.rate:.0f} %", f"{name} ({within})"
