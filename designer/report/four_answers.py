"""What a report says first: does the circuit do it, how many boards work, what to buy, what to
mend. Each answer has one line in bold and the sentences that it rests on. Then what each question
comes to, in a line: what stands there while it is folded.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, replace

from designer.answers.rare_words import any_lost_words, loss_words
from designer.base.page import (
    Bar,
    Bars,
    Block,
    Columns,
    Gallery,
    Lead,
    PageSection,
    Picture,
    Remedies,
    SmallPrint,
)
from designer.base.plain_json import plain
from designer.base.si_unit import value_text
from designer.check.checked_design import CheckedResponse
from designer.circuit.coefficients import EXACT
from designer.report import words
from designer.report.data import ReportData
from designer.report.response_tables import reasons_of
from designer.yields.loss_attribution import AttributionStage
from designer.yields.yield_count import Yield

FEW = 100
"""Samples below which the report says that the intervals are wide."""
MANY = 1000
"""Boards that a study is told to take then."""
WANTED = 0.95
"""Yield below which a repair is advised; a user may want more or less."""
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
    if parts := _attributed_parts(data, place):
        text += f" Most losses would be avoided if {parts} were exact."
    if all(c.periodic for c in data.checked):
        yield Remedy(text, f"designer search DIR --yield {WANTED:g}")
    else:  # a search follows orbits
        yield Remedy(text, "designer tolerance DIR --tuned --reached")


def _attributed_parts(data: ReportData, response: int) -> str:
    """The parts that avoid most losses of a response, were they exact; "" where none is known."""
    attribution = data.attribution_of(response)
    if attribution is None:
        return ""
    helpful = [s for s in attribution.subjects if s.kind != "group" and s.avoided]
    return " or ".join(s.name for s in helpful[:NAMED])


def _study(data: ReportData) -> Iterator[Remedy]:
    """What would make the figures surer."""
    samples = max((y.samples for y in data.yields if y is not None), default=0)
    if 0 < samples < FEW and not data.plan.census:
        text = f"The intervals are wide: {words.plural(samples, 'board')}."
        yield Remedy(text, f"designer tolerance DIR --samples {MANY}")
    if samples and not data.ngspice_ran and not any(map(words.problem, data.checked)):
        yield Remedy("ngspice was not asked.", "designer tolerance DIR --rung auto")
    if data.study.blame_status.stage is AttributionStage.NOT_YET:
        yield Remedy("The blame is not worked out yet.", "designer tolerance DIR --resume")


def _board(data: ReportData) -> Iterator[Remedy]:
    board = data.board_file
    if board is not None and not board.copper:
        yield Remedy("The board is placed and not routed.", "designer export DIR --routed")


ORDER = 10
"""Boards of the order whose price an answer names, where the catalogue knows that size."""


def answers(data: ReportData, portraits: Picture | Gallery | None = None) -> PageSection:
    """The four answers, below the share of the boards that show each response. portraits : a small
    one of each response, in HTML."""
    sections = (
        PageSection("Does the circuit do what the model does?", _match(data)),
        PageSection("How many boards will work?", _yields(data)),
        PageSection("What is there to buy, and what does it cost?", _parts(data)),
    )
    mend = PageSection("What is there to mend?", _remedies(data))
    blocks: list[Block] = [_bars(data, portraits), Columns(sections), Columns((mend,))]
    return PageSection("In short", blocks, "answers")


def _bars(data: ReportData, portraits: Picture | Gallery | None) -> Bars | None:
    """Each response with its share of the boards; then all of them on one board."""
    if not data.checked:
        return None
    small = portraits.pictures if isinstance(portraits, Gallery) else ()
    names, yields = data.rated
    bars = []
    for i, (name, counted) in enumerate(zip(names, yields, strict=True)):
        of_one = i < len(data.checked)
        problem = words.problem(data.checked[i]) if of_one else ""
        bar = Bar(
            words.name(data.checked[i]) if of_one else name,
            "not studied",
            svg=small[i].svg if i < len(small) else "",
            link="portraits",
            warning="not as wanted" if problem else "",
        )
        bars.append(bar if counted is None else _rated(bar, counted))
    return Bars(tuple(bars))


def _rated(bar: Bar, counted: Yield) -> Bar:
    """A bar with the yield that was counted."""
    if not math.isfinite(counted.rate):
        return replace(bar, text="no answer")
    low, high = words.span(*counted.interval)
    return replace(
        bar,
        text=f"{100 * counted.rate:.3g}\u00a0%",
        more=words.limits(counted, f"({low} to {high})"),
        share=counted.rate,
        interval=None if counted.census else counted.interval,
    )


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
    return [Lead(lead), detail, coefficients(data)]


def coefficients(data: ReportData) -> str:
    """How well the coefficients are met, in a sentence."""
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
    pieces = sum(int(row["quantity"]) for row in data.bom)
    lead = f"{pieces} pieces, about {one.total:.0f}\u00a0€ a board."
    price = (
        f"Estimated for an order of {one.boards}: parts {one.parts:.2f}\u00a0€, bare board "
        f"{one.bare_board:.2f}\u00a0€, assembly {one.assembly:.2f}\u00a0€. The list to order "
        "from is bom.csv."
    )
    return [Lead(lead), text, price]


def _remedies(data: ReportData) -> list[Block]:
    listed = remedies(data)
    lead = f"{words.plural(len(listed), 'point')}, the weightiest first."
    if not listed:
        lead = "Nothing that this study shows."
        listed = [
            Remedy("Check the rules of the design.", "designer rules DIR"),
            Remedy("Then lay the tracks and order boards.", "designer export DIR --routed"),
        ]
    folder = shlex.quote(data.folder) if data.folder else "DIR"
    items = tuple((r.text, r.command.replace("DIR", folder)) for r in listed)
    blocks: list[Block] = [Lead(lead), Remedies(items)]
    if any(command for _, command in items):
        where = f"Commands run beside {folder}, the folder of this design."
        blocks.insert(1, SmallPrint(where if data.folder else "DIR is the folder of this design."))
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
    headline = working(data)
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
    if data.study.rare:
        most = max(data.study.rare, key=lambda each: (each.lost, each.high))
        name = words.name(data.checked[data.study.response_indices[most.question]])
        out.append(f"{name}: {loss_words(most.as_dict())}.")
        if data.study.any_lost is not None:
            out.append(f"{any_lost_words(plain(data.study.any_lost))}.")
    failed = sum(y.failed for _, y in rows)
    if failed:
        out.append(f"{words.plural(failed, 'run')} gave no answer, which the yields leave out.")
    if samples < FEW and not data.plan.census:
        out.append(f"So few samples ({samples}) leave wide intervals.")
    left = len(data.checked) - len(rows)
    if left:
        out.append(f"{words.plural(left, 'response')} could not be studied.")
    return [Lead(headline), f"{_boards(data, samples)} {' '.join(out)}"]


def working(data: ReportData) -> str:
    """The share of the boards that work, in a sentence; "" where it is not known."""
    decided = [
        (c, y)
        for c, y in zip(data.checked, data.yields, strict=True)
        if y is not None and math.isfinite(y.rate)
    ]
    if not decided:
        return ""
    joint = data.study.all_on_one_board
    if joint is not None and math.isfinite(joint.rate):
        all_ = f"{words.all_of(len(data.checked)).lower()} responses"
        return f"{_percent(joint)} show {all_} on one board."
    worst, least = min(decided, key=lambda row: row[1].rate)
    return f"{_percent(least)} show {words.name(worst)}."


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


MADE_LINE = "The command that makes it again, versions, seed and settings."
WORDS_LINE = "n-p-q, ω, exact circuit, ok, lost, grazing, tuned, reached and others."


def shown_line(data: ReportData) -> str:
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


def working_line(data: ReportData) -> str:
    """How many boards work, and what most of the others show."""
    said = working(data) or "Not known."
    decided = [
        (y.rate, i) for i, y in enumerate(data.yields) if y is not None and math.isfinite(y.rate)
    ]
    rate, place = min(decided, default=(1.0, 0))
    if rate >= 1.0:
        return said
    why = reasons_of(data.study.answers_to(place), 1)
    return f"{said} Of {words.name(data.checked[place])} most often {why[0]}." if why else said


def attributed_line(data: ReportData) -> str:
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


def chosen_line(data: ReportData) -> str:
    """How good the choice of parts is."""
    circuit, proof = data.design.circuit, data.design.certificate.status
    passives = len(circuit.resistors) + len(circuit.capacitors)
    text = f"{passives} resistors and capacitors, {words.plural(len(circuit.packages), 'op-amp')}. "
    open_ = proof != "optimal" and data.design.errors.max_error > EXACT
    return text + coefficients(data) + " Not proved to be the least." * open_


def built_line(data: ReportData) -> str:
    """What there is to order, and how far the board is."""
    pieces = f"{sum(int(row['quantity']) for row in data.bom)} pieces"
    if data.board_cost is not None and data.board_cost.costs:
        one = min(data.board_cost.costs, key=lambda c: abs(c.boards - ORDER))
        pieces += f", about {one.total:.0f}\u00a0€ a board at {one.boards}"
    board = data.board_file
    if board is None:
        return f"{pieces}."
    return f"{pieces}; the board is {'routed' if board.copper else 'placed and not routed'}."
