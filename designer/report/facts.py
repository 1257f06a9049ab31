"""Everything that both pages of a report say: its prose, and its tables by name."""

from __future__ import annotations

import math
from typing import Any

from designer.circuit.coefficients import EXACT
from designer.circuit.design import Design
from designer.model.ascii_sketch import sketch
from designer.report import (
    boards as report_boards,
    design_tables,
    model_page,
    tables,
    tolerance,
    words,
)
from designer.report.data import ReportData
from designer.report.spread_words import words_of
from designer.spread.part_grades import better_grades_text
from designer.yields.verdict import Yield

FORMAT = 1

FEW = 100
"""Below so many samples the report says that the intervals are wide."""


def facts(data: ReportData) -> dict[str, Any]:
    """Everything that both pages say, as text and tables."""
    design = data.design
    return {
        "format": FORMAT,
        "title": data.modelfile.title,
        "summary": _summary(data),
        "tiles": _tiles(data),
        "equations": model_page.equations(data),
        "sketch": sketch(design.model).splitlines(),
        "drawing_note": model_page.drawing_note(data),
        "model_table": design_tables.model_table(data),
        "mechanical_table": design_tables.mechanical_table(data),
        "response_table": tables.response_table(data),
        "settings_table": tables.settings_table(data),
        "settings_note": _settings_note(data),
        "problems": _problems(data),
        "yield_table": tables.yield_table(data),
        "ngspice_table": tables.ngspice_table(data),
        "study_note": _study_note(data),
        "bom_table": design_tables.bom_table(data),
        "part_table": design_tables.part_table(data),
        "opamp_table": design_tables.opamp_table(data),
        "parts_note": _parts_note(data),
        "error_table": design_tables.error_table(design),
        "error_note": _error_note(design),
        "equation_table": tables.equation_table(data),
        "equation_note": _equation_note(data),
        "certificate": _certificate(design),
        "scale_table": design_tables.scale_table(data),
        "scale_note": _scale_note(data),
        "condition_table": design_tables.condition_table(design),
        "provenance_table": tables.provenance_table(data),
        "command": data.command,
        "glossary": _GLOSSARY,
        "board_table": report_boards.table(data),
        "all_boards": data.census,
        **tolerance.facts(data),
    }


_GLOSSARY = (
    (
        "n-p-q",
        "a response that repeats after n periods of the drive, with p impacts on the upper stop "
        "and q on the lower one in that time; n-q-p is its mirror twin",
    ),
    ("ω", "frequency of the drive, dimensionless; ω = 1 is one radian per unit of model time"),
    ("model", "the mechanical model, solved exactly piece by piece"),
    (
        "exact circuit",
        "the circuit's own equations (nodal analysis, finite op-amp gain, limits), solved likewise",
    ),
    (
        "ngspice",
        "the SPICE deck, at solver settings that passed a gate first: two step sizes and two "
        "integration methods have to agree",
    ),
    ("ok", "started on the nominal design's orbit, the board settles on the wanted response"),
    ("lost", "the board settles on something else, or on nothing periodic, or an op-amp clips"),
    ("grazing", "too close to call: a contact too shallow or a miss too near to count"),
    ("failed", "no answer; such boards are not part of the yield"),
    (
        "tuned",
        "a setting of the generator within the stated bands was found that works. Where none was "
        "found among the settings tried the board counts as lost, though there may be one: the "
        "yield is a lower bound. On the bench: what the bench procedure finds works",
    ),
    (
        "trimmed",
        "the trimmer on the board is set once, by the bench procedure, and every response is "
        "judged at that setting with the generator as in setup.csv",
    ),
    ("reached", "switched on by the recipe, from discharged capacitors, the board ends on it"),
    (
        "both engines together",
        "the yield of the exact circuit, corrected by the boards that ngspice was asked about",
    ),
)


def _summary(data: ReportData) -> list[str]:
    design, circuit = data.design, data.design.circuit
    number = len(data.checked)
    wanted = words.plural(number, "response")
    asked = f"Asked for: an op-amp circuit that behaves like the model “{data.modelfile.title}”"
    out = [f"{asked} and shows {wanted} of it." if number else f"{asked}; no response is named."]
    if number:
        bad = [c for c in data.checked if words.problem(c)]
        engines = (
            "the model, the exact circuit and ngspice"
            if data.ngspice_asked
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
    return [*out, *_yield_words(data)]


def _yield_words(data: ReportData) -> list[str]:
    rows = [(c, y) for i, c in enumerate(data.checked) for y in [data.yield_of(i)] if y is not None]
    rows = [(c, y) for c, y in rows if y.samples]
    if not rows:
        why = "no response could be asked" if data.yields is not None else "none was made"
        return [f"There is no tolerance study: {why}."]
    samples = max(y.samples for _, y in rows)
    decided = [(c, y) for c, y in rows if math.isfinite(y.rate)]
    if not decided:
        return [f"Component spread, {samples} simulated boards: not one gave an answer."]
    said = []
    safe = sum(y.ok == y.samples for _, y in rows)
    worst, least = min(decided, key=lambda row: row[1].rate)
    if safe == len(rows):
        shown = "it" if len(rows) == 1 else f"{words.all_of(len(rows)).lower()} responses"
        said.append(f"every one shows {shown}: of a thousand, {_of_a_thousand(least)}.")
    else:
        if safe:
            verb = "survives" if safe == 1 else "survive"
            said.append(f"{safe} of {words.plural(len(rows), 'response')} {verb} on every one;")
        said.append(
            f"the most delicate is {words.name(worst)}, shown by {least.ok} of "
            f"{least.samples - least.failed}: of a thousand boards, {_of_a_thousand(least)}."
        )
    whole = data.all_on_one_board
    if whole is not None and math.isfinite(whole.rate) and safe < len(rows):
        said.append(
            f"{words.all_of(len(data.checked))} responses on one and the same board: {whole.ok} of "
            f"{whole.samples - whole.failed}; of a thousand, {_of_a_thousand(whole)}."
        )
    failed = sum(y.failed for _, y in rows)
    if failed:
        said.append(f"{words.plural(failed, 'run')} gave no answer, which the yields leave out.")
    if samples < FEW and not data.census:
        said.append(f"So few samples ({samples}) leave wide intervals.")
    left = len(data.checked) - len(rows)
    if left:
        said.append(f"{words.plural(left, 'response')} could not be studied.")
    if data.census:
        boards = f"All {samples} measured boards" if samples > 1 else "The measured board"
        return [f"{boards}, simulated: " + " ".join(said)]
    return [f"Component spread, {samples} simulated boards: " + " ".join(said)]


def _of_a_thousand(y: Yield) -> str:
    low, high = (round(1000 * v) for v in y.interval)
    if y.census:
        return f"{round(1000 * y.rate)} by share"
    return f"about {round(1000 * y.rate)} (95 % interval {low} to {high})"


def _tiles(data: ReportData) -> list[tuple[str, str]]:
    """(figure, what it is) for the head of the page."""
    good = sum(not words.problem(c) for c in data.checked)
    out = []
    if data.checked:
        asked = "all engines agree" if data.ngspice_asked else "ngspice was not asked"
        what = "response" if len(data.checked) == 1 else "responses"
        out.append((f"{good} of {len(data.checked)}", f"{what} found, {asked}"))
    worst = data.design.errors.max_error
    if worst <= EXACT:
        out.append(("exact", "every coefficient of the equations"))
    else:
        out.append((words.error(worst), "largest coefficient error"))
    out.append((str(data.design.distinct_values), "different R and C values"))
    rates = [y for i in range(len(data.checked)) for y in [data.yield_of(i)] if y and y.samples]
    known = [y for y in rates if math.isfinite(y.rate)]
    if known:
        least = min(known, key=lambda y: y.rate)
        low, high = words.span(*least.interval)
        within = words.limits(least, f"{low} to {high}\u00a0%")
        what = "yield" if len(known) == 1 else "least yield"
        out.append((f"{100 * least.rate:.0f} %", f"{what} ({within})"))
    whole = data.all_on_one_board
    if whole is not None and math.isfinite(whole.rate):
        low, high = words.span(*whole.interval)
        within = words.limits(whole, f"{low} to {high}\u00a0%")
        out.append((f"{100 * whole.rate:.0f} %", f"all on one board ({within})"))
    return out


def _study_note(data: ReportData) -> str:
    if data.plan is None:
        return "No tolerance study was made."
    status = data.layers.status
    blame = "" if status is None else status.sentence
    limits = "Intervals are Wilson's, at 95 %."
    if data.census:
        limits = "These are all the boards there are, so their shares have no interval."
    varies = words_of(data.plan.spread, data.design.circuit)
    return (
        f"{words.plural(data.plan.samples, 'board')}, seed {data.plan.seed}: {varies}. "
        "Boards run as built: the generator stays at the settings above. Verdicts are those of "
        f"the exact circuit. {limits}" + (f" {blame}" if blame else "")
    )


def _settings_note(data: ReportData) -> str:
    said = (
        "Amplitudes into a high impedance; a generator set for 50 Ω shows half. No DC. Shortest "
        "contact and nearest grazing (the smaller of shallowest contact and nearest miss) are "
        "those of the nominal circuit."
    )
    if any(c.gate is not None for c in data.checked):
        said += (
            " The largest difference is between ngspice's runs at the strobes, in per cent of "
            "the peak."
        )
    return said


def _parts_note(data: ReportData) -> str:
    c = data.design.circuit
    better = better_grades_text(data.better_grades)
    return (
        f"Supply ± {c.supply:g} V, op-amp output limits ± {c.saturation:g} V nominal. "
        f"{words.plural(len(c.sections), 'section')} of {c.opamp} in "
        f"{words.plural(len(c.packages), 'package')}; {len(c.resistors)} resistors, "
        f"{len(c.capacitors)} capacitors, {data.design.distinct_values} different values."
        + (f" {better}" if better else "")
    )


def _error_note(design: Design) -> str:
    worst = design.errors.max_error
    said = "All are exact." if worst <= EXACT else f"Largest: {words.error(worst)}."
    return (
        "Of the finished circuit, reduced by nodal analysis with ideal op-amps, at the time and "
        f"voltage scales that suit it best. {said} The clearance and the force are set at the "
        "generator and do not count."
    )


def _problems(data: ReportData) -> list[str]:
    """Of each response, and of the netlist."""
    said = [words.problem(c) for c in data.checked]
    if data.equations is not None:
        said.append(data.equations.problem)
    return [problem for problem in said if problem]


def _equation_note(data: ReportData) -> str:
    check = data.equations
    if check is None:
        return ""
    low, high = (words.quantity(f, "Hz", 3) for f in (check.low, check.high))
    return (
        f"ngspice on the deck itself, by .ac from {low} to {high} from the generator to v1, the "
        "clearance held open and closed by a constant force, and by .dc through the dead zone and "
        "into contact; against the model at the scales below. The bounds follow from the "
        "coefficient errors."
    )


def _certificate(design: Design) -> str:
    c, reached = design.certificate, words.error(design.errors.max_error)
    if c.status == "optimal":
        said = (
            "Proved optimal: under the conditions kept, no choice of parts from this catalogue "
            f"has a largest error below {reached}."
            if design.errors.max_error > EXACT
            else "Proved optimal: an exact match cannot be improved on."
        )
    elif c.status == "bound":
        said = (
            f"Not proved optimal: this design reaches {reached}; what is proved is that no choice "
            f"from this catalogue stays below {words.error(c.lower_bound)}. Whether a choice in "
            "between exists is open."
        )
    else:
        said = f"Status {c.status}; lower bound {words.error(c.lower_bound)}."
    return f"{said} Basis: {c.proof}."


def _scale_note(data: ReportData) -> str:
    model = data.design.model
    said = f"For the model's own clearance b = {words.number(model.b)}."
    if any(c.model.b != model.b for c in data.checked):
        said += (
            " A response wanted at another b is driven with the amplitude times b(model)/b, and "
            "its volts stand for other lengths by the same factor; the threshold stays."
        )
    return said
