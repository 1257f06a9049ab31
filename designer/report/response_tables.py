"""Tables of a report about responses, yields and what the results come from."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from designer.base.defaults import DRAWN_STARTS
from designer.base.design_folder import TOLERANCE
from designer.base.page import Table, table
from designer.check.checked_design import CheckedResponse
from designer.check.coexistence import beside
from designer.circuit.nominal import nominal_reduction
from designer.report import words
from designer.report.data import ReportData
from designer.report.spread_words import words_of
from designer.spice.equation_check import EquationCheck
from designer.spice.numerics_gate import shortest_contact
from designer.yields.ngspice_sampling import Hearing, NgspiceVerdict, StartKind
from designer.yields.verdict import Answer, Verdict, Yield

REASONS_SHOWN = 5
"""Kinds of loss that are named; the rest is counted."""

STARTED = {StartKind.OWN: "its own orbit", StartKind.NOMINAL: "the nominal orbit"}


def response_table(data: ReportData) -> Table | None:
    columns = (
        "ω", "mechanism", "expected", "model", "exact circuit", "ngspice", "agree",
        "symmetric (model)", "coexisting (model)",
    )  # fmt: skip
    rows = [
        (
            words.number(c.model.omega),
            _hertz(data, c),
            _expected(c),
            c.model.orbit.response + ("" if c.model.found else " (not what is wanted)"),
            c.circuit.response,
            "not asked" if c.ngspice is None else c.ngspice.response,
            "yes" if c.agrees else "no",
            words.yes(c.model.orbit.symmetric),
            _coexisting(data, c),
        )
        for c in data.checked
    ]
    return _of_mechanism(data, columns, rows, (0, 1))


def _coexisting(data: ReportData, checked: CheckedResponse) -> str:
    """The other attractors of the model with their shares of the starts."""
    model = replace(data.design.model, b=checked.model.b)
    others = [
        f"{b.orbit.response} ({100 * b.count / DRAWN_STARTS:.3g} %)"
        for b in beside(model, checked.model)
    ]
    return f"{', '.join(others) or 'none'}, of {DRAWN_STARTS} starts"


def settings_table(data: ReportData) -> Table | None:
    system = nominal_reduction(data.design).system()
    columns: tuple[str, ...] = (
        "ω", "mechanism", "b", "frequency", "amplitude (peak)", "shortest contact",
        "nearest grazing", "ngspice steps per period", "method", "largest difference",
    )  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for c in data.checked:
        contact = math.nan
        if len(c.circuit.impact_times):
            contact = shortest_contact(c.circuit, system, c.excitation)
        rows.append(
            (
                words.number(c.model.omega),
                _hertz(data, c),
                words.number(c.model.b),
                words.quantity(c.excitation.frequency, "Hz"),
                words.quantity(c.excitation.amplitude, "V"),
                words.quantity(contact, "s", 3),
                words.quantity(min(c.circuit.penetration, c.circuit.miss), "V", 3),
                *_gate_cells(c),
            )
        )
    if not any(c.gate is not None for c in data.checked):
        columns, rows = columns[:-3], [row[:-3] for row in rows]
    return _of_mechanism(data, columns, rows, (*range(min(8, len(columns))), 9)[: len(columns)])


def _gate_cells(c: CheckedResponse) -> tuple[str, str, str]:
    """Steps of a period, method, and the largest difference of ngspice's runs."""
    if c.gate is None:
        return (words.NONE, words.NONE, words.NONE)
    settings = c.gate.settings
    return (
        f"{1.0 / (c.excitation.frequency * settings.max_step):.0f}",
        settings.method + ("" if c.gate.passed else " (not passed)"),
        f"{100 * c.gate.difference:.2g} %" if math.isfinite(c.gate.difference) else words.NONE,
    )


def _of_mechanism(
    data: ReportData,
    columns: Sequence[str],
    rows: Sequence[tuple[str, ...]],
    numeric: Sequence[int],
) -> Table | None:
    """A table of responses; its column 1, the mechanism's frequency, only where there is one."""
    if data.mechanical is not None:
        return table(columns, rows, numeric)
    shifted = [0, *(i - 1 for i in numeric if i > 1)]
    return table([columns[0], *columns[2:]], [(row[0], *row[2:]) for row in rows], shifted)


def _hertz(data: ReportData, c: CheckedResponse) -> str:
    """The frequency that the mechanism has, where it has SI values."""
    if data.mechanical is None:
        return words.NONE
    return words.quantity(data.mechanical.hertz(c.model.omega), "Hz")


def _expected(c: CheckedResponse) -> str:
    kind = {True: "symmetric", False: "asymmetric", None: ""}[c.model.spec.symmetric]
    return ", ".join(t for t in (c.model.expected, kind) if t) or "any"


def yield_table(data: ReportData) -> Table | None:
    columns = (
        "response", "ok", "lost", "grazing", "failed", "yield", "of 1000 boards (95 %)",
        "what became of the others",
    )  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for i, (c, counted) in enumerate(zip(data.checked, data.yields, strict=True)):
        if counted is None:
            reason = f"left out: {data.study.left_out[i]}"
            rows.append((words.name(c), *[words.NONE] * 6, reason))
        else:
            rows.append((words.name(c), *_counts(counted), _reasons(data.study.answers_to(i))))
    if data.study.all_on_one_board is not None:
        rows.append(("all on one board", *_counts(data.study.all_on_one_board), ""))
    return table(columns, rows, range(1, 7))


def _counts(y: Yield) -> tuple[str, ...]:
    rate = thousand = words.NONE
    if math.isfinite(y.rate):
        low, high = (round(1000 * v) for v in y.interval)
        rate = f"{100 * y.rate:.3g} %"
        thousand = f"{round(1000 * y.rate)} ({words.limits(y, f'{low} to {high}')})"
    return (str(y.ok), str(y.lost), str(y.grazing), str(y.failed), rate, thousand)


def _reasons(answers: Sequence[Answer]) -> str:
    """Why boards do not show a response, most frequent first; figures in a reason do not count."""
    counts = Counter(_reason(a) for a in answers if a.verdict is not Verdict.OK)
    ranked = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    shown = [f"{text} ({n})" for text, n in ranked[:REASONS_SHOWN]]
    rest = ranked[REASONS_SHOWN:]
    if rest:
        shown.append(f"{words.plural(len(rest), 'other outcome')} ({sum(n for _, n in rest)})")
    return ", ".join(shown)


def _reason(answer: Answer) -> str:
    reason = re.sub(r" by .*", "", answer.reason)
    join = "" if not reason else " " if reason.startswith("to ") else ": "
    return f"{answer.verdict}{join}{reason}"


def ngspice_table(data: ReportData) -> Table | None:
    """How often ngspice, asked about the same boards, answered the same as the exact circuit."""
    rows = []
    for i, c in enumerate(data.checked):
        for kind, start in STARTED.items():
            asked = [h for h in data.study.heard_of(i) if h.kind is kind and h.response]
            if asked:
                cells = _ngspice_cells(data.study.answers_to(i), asked)
                rows.append((words.name(c), start, *cells))
    columns = (
        "response", "started on", "boards", "agreed", "differed", "undecided", "failed",
        "exact circuit but ngspice (boards); why without answer",
    )  # fmt: skip
    return table(columns, rows, range(2, 7))


def _ngspice_cells(answers: Sequence[Answer], asked: Sequence[Hearing]) -> tuple[str, ...]:
    known = {a.sample: a for a in answers}
    notes: dict[NgspiceVerdict, Counter[str]] = {one: Counter() for one in NgspiceVerdict}
    for h in asked:
        answer = known[h.sample]
        outcome = h.outcome(answer)
        note = h.reason or "no reason given"
        if outcome is NgspiceVerdict.DIFFERED:
            note = f"{answer.response} but {h.either or h.response}"
        notes[outcome][note] += 1
    counts = [str(notes[one].total()) for one in NgspiceVerdict]
    del notes[NgspiceVerdict.AGREED]
    ranked = sorted((t, n) for counted in notes.values() for t, n in counted.items())
    shown = ", ".join(f"{t} ({n})" for t, n in ranked[:REASONS_SHOWN])
    return (str(len(asked)), *counts, shown)


def equation_table(check: EquationCheck) -> Table | None:
    """What ngspice says of the circuit's equation: .ac and .dc against the model."""
    rows = [
        (f.name, f.reason or words.error(f.deviation), words.error(f.bound), words.yes(f.passed))
        for f in check.findings
    ]
    return table(("compared", "largest deviation", "bound", "within"), rows, (1, 2))


def provenance_table(data: ReportData) -> Table | None:
    known = {k: v for k, v in data.result.provenance.items() if k != "spread"}
    spread = data.plan.spread
    text = f"{spread.name}: {words_of(spread, data.design.circuit)} (part by part in {TOLERANCE})"
    return table(("what", "value"), [*_flat(known), ("spread", text)])


def _flat(values: Mapping[str, Any], prefix: str = "") -> Iterable[tuple[str, str]]:
    """Nested provenance as rows; ngspice's settings stand in a table of their own, cost nowhere."""
    for key, value in values.items():
        name = f"{prefix}{key}".replace("_", " ")
        if key == "cost" or name == "settings ngspice" or value is None:
            continue
        if isinstance(value, Mapping):
            yield from _flat(value, f"{name} ")
        elif isinstance(value, float):
            yield name, f"{value:g}"
        elif isinstance(value, list | tuple):
            yield name, ", ".join(str(v) for v in value)
        else:
            yield name, str(value)
