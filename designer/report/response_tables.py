"""Tables of a report about responses, yields and what the results come from."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from designer.base.defaults import DRAWN_STARTS
from designer.base.design_folder import TOLERANCE
from designer.base.page import Table, table, table_of
from designer.base.si_unit import is_angular
from designer.check.checked_design import CheckedResponse
from designer.check.coexistence import coexisting_with
from designer.circuit.nominal import nominal_reduction
from designer.report import words
from designer.report.data import ReportData
from designer.report.spread_words import words_of
from designer.spice.equation_check import EquationCheck, EquationFinding
from designer.spice.numerics_gate import shortest_contact
from designer.verdicts.cross_check import CrossCheck, NgspiceVerdict, StartKind
from designer.verdicts.verdict import Answer
from designer.yields.yield_count import Yield, reasons

REASONS_SHOWN = 5
"""Kinds of loss that are named; the rest is counted."""

Columns = dict[str, Callable[[CheckedResponse], str]]
"""What each column of a table says of a response."""
NOT_WANTED = " (not what is wanted)"
STARTED = {StartKind.OWN: "its own orbit", StartKind.NOMINAL: "the nominal orbit"}


def response_table(data: ReportData) -> Table | None:
    columns: Columns = {
        **_frequencies(data),
        "expected": _expected,
        "model": lambda c: c.model.orbit.response + ("" if c.model.found else NOT_WANTED),
        "exact circuit": lambda c: c.circuit.response,
        "ngspice": lambda c: "not asked" if c.ngspice is None else c.ngspice.response,
        "agree": lambda c: words.yes(c.agrees),
        "symmetric (model)": lambda c: words.yes(c.model.orbit.symmetric),
        "coexisting (model)": partial(_coexisting, data),
    }
    if any(c.exponents for c in data.checked):
        columns["largest exponents"] = _exponents
    return table_of(data.checked, columns, ("ω", "mechanism"))


def _exponents(checked: CheckedResponse) -> str:
    """The exponent by each engine with its standard error, per unit of the model's time."""
    each = [f"{name} {v:.3g} ± {e:.1g}" for name, (v, e) in checked.exponents.items()]
    return ", ".join(each) or words.NONE


def _coexisting(data: ReportData, checked: CheckedResponse) -> str:
    """The other attractors of the model with their shares of the starts."""
    model = data.design.model.at(checked.model.b)
    others = [
        f"{b.orbit.response} ({100 * b.count / DRAWN_STARTS:.3g} %)"
        for b in coexisting_with(model, checked.model)
    ]
    return f"{', '.join(others) or 'none'}, of {DRAWN_STARTS} starts"


def settings_table(data: ReportData) -> Table | None:
    system = nominal_reduction(data.design).system()

    def contact(c: CheckedResponse) -> str:
        if not len(c.circuit.impact_times):
            return words.NONE
        return words.quantity(shortest_contact(c.circuit, system, c.excitation), "s", 3)

    columns: Columns = {
        **_frequencies(data),
        "b": lambda c: words.number(c.model.b),
        "frequency": lambda c: words.quantity(c.excitation.frequency, "Hz"),
        "amplitude (peak)": lambda c: ", ".join(
            words.quantity(volts, "V") for volts in c.excitation.amplitudes
        ),
        "shortest contact": contact,
        "nearest grazing": lambda c: words.quantity(
            min(c.circuit.penetration, c.circuit.miss), "V", 3
        ),
    }
    if any(c.gate is not None for c in data.checked):
        columns |= {"ngspice steps per period": _steps, "method": _method, "largest difference":
                    _difference}  # fmt: skip
    return table_of(data.checked, columns, {*columns} - {"method"})


def _steps(c: CheckedResponse) -> str:
    if c.gate is None:
        return words.NONE
    return f"{1.0 / (c.excitation.frequency * c.gate.settings.max_step):.0f}"


def _method(c: CheckedResponse) -> str:
    if c.gate is None:
        return words.NONE
    return c.gate.settings.method + ("" if c.gate.passed else " (not passed)")


def _difference(c: CheckedResponse) -> str:
    if c.gate is None or not math.isfinite(c.gate.difference):
        return words.NONE
    return f"{100 * c.gate.difference:.2g} %"


def _omega(c: CheckedResponse) -> str:
    return words.number(c.model.omega)


def _frequencies(data: ReportData) -> Columns:
    """ω, and the frequency that the mechanism has where it has SI values; that alone where ω is in
    rad/s."""
    si = data.si
    if si is None:
        return {"ω": _omega}
    mechanism: Columns = {"mechanism": lambda c: words.quantity(si.hertz(c.model.omega), "Hz")}
    return mechanism if is_angular(1.0, si.hertz(1.0)) else {"ω": _omega, **mechanism}


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
            rows.append(
                (words.name(c), *_counts(counted), ", ".join(reasons_of(data.study.answers_to(i))))
            )
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


def reasons_of(answers: Sequence[Answer], most: int = REASONS_SHOWN) -> list[str]:
    """Why boards do not show a response, most frequent first; figures in a reason do not count.
    most : reasons that are named, the others are counted."""
    counts = reasons((a.verdict, a.reason) for a in answers)
    named = [(text.replace(": to ", " to "), n) for text, n in counts.items()]
    ranked = sorted(named, key=lambda item: (-item[1], item[0]))
    phrases = [f"{text} ({n})" for text, n in ranked[:most]]
    rest = ranked[most:]
    if rest:
        phrases.append(f"{words.plural(len(rest), 'other outcome')} ({sum(n for _, n in rest)})")
    return phrases


def ngspice_table(data: ReportData) -> Table | None:
    """How often ngspice, asked about the same boards, answered the same as the exact circuit."""
    rows = []
    for i, c in enumerate(data.checked):
        for kind, start in STARTED.items():
            checks = [
                h
                for h in data.study.rows_of(i, data.study.cross_checks)
                if h.kind is kind and h.response
            ]
            if checks:
                more = data.study.not_asked_of(i) if kind is StartKind.NOMINAL else 0
                cells = _ngspice_cells(data.study.answers_to(i), checks, more)
                rows.append((words.name(c), start, *cells))
    columns = (
        "response", "started on", "boards", "agreed", "differed", "undecided", "failed",
        "exact circuit but ngspice (boards); why without answer",
    )  # fmt: skip
    return table(columns, rows, range(2, 7), names=2)


def _ngspice_cells(
    answers: Sequence[Answer], checks: Sequence[CrossCheck], not_asked: int
) -> tuple[str, ...]:
    answer_of = {a.sample: a for a in answers}
    notes: dict[NgspiceVerdict, Counter[str]] = {one: Counter() for one in NgspiceVerdict}
    for h in checks:
        answer = answer_of[h.sample]
        outcome = h.outcome(answer)
        note = h.reason or "no reason given"
        if outcome is NgspiceVerdict.DIFFERED:
            note = f"{answer.response} but {h.either or h.response}"
        notes[outcome][note] += 1
    counts = [str(notes[one].total()) for one in NgspiceVerdict]
    del notes[NgspiceVerdict.AGREED]
    ranked = sorted((t, n) for counted in notes.values() for t, n in counted.items())
    shown = [f"{t} ({n})" for t, n in ranked[:REASONS_SHOWN]]
    if not_asked:
        shown.append(f"runs of too many steps together, not asked ({not_asked})")
    text = ", ".join(shown)
    return (str(len(checks)), *counts, text)


def equation_table(check: EquationCheck) -> Table | None:
    """What ngspice says of the circuit's equation: .ac and .dc against the model."""
    columns: dict[str, Callable[[EquationFinding], str]] = {
        "compared": lambda f: f.name,
        "largest deviation": lambda f: f.reason or words.deviation(f.deviation),
        "bound": lambda f: words.deviation(f.bound),
        "within": lambda f: words.yes(f.passed),
    }
    return table_of(check.findings, columns, ("largest deviation", "bound"))


def provenance_table(data: ReportData) -> Table | None:
    provenance = {k: v for k, v in data.result.provenance.items() if k != "spread"}
    spread = data.plan.spread
    varies = words_of(spread, data.design.circuit, bandwidth=data.plan.bandwidth)
    text = f"{spread.name}: {varies} (part by part in {TOLERANCE})"
    return table(("what", "value"), [*_flat(provenance), ("spread", text)])


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
