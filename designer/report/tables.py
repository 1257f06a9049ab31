"""Tables of a report: cells as text. Here those of responses and studies, and where they come from;
those of the design itself are in ``report_design``."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from designer.base.defaults import DRAWN_STARTS
from designer.base.design_folder import TOLERANCE
from designer.check.checked_design import CheckedResponse
from designer.check.coexistence import beside
from designer.circuit.nominal import nominal_reduction
from designer.dynamics.orbit import OrbitStatus
from designer.report import words
from designer.report.data import ReportData
from designer.report.spread_words import words_of
from designer.spice.numerics_gate import shortest_contact
from designer.yields.ngspice_sampling import NgspiceVerdict, StartKind
from designer.yields.verdict import Answer, Verdict, Yield

REASONS_SHOWN = 5
"""Kinds of loss that are named; the rest is counted."""

PHRASE = 60
"""Characters of a cell that may stand in lines of a few words each."""


@dataclass(frozen=True)
class Table:
    """A table of texts."""

    columns: tuple[str, ...]
    """Headings of the columns."""
    rows: tuple[tuple[str, ...], ...]
    """Cells, row by row."""
    numeric: tuple[int, ...] = ()
    """Indices of the columns that are set flush right."""

    @property
    def broad(self) -> bool:
        """Whether it needs more than a phone's width: many columns, or long text."""
        longest = max((len(cell) for row in self.rows for cell in row), default=0)
        return len(self.columns) > 3 or longest > PHRASE


def _told(columns: Sequence[str], rows: Sequence[tuple[str, ...]], numeric: Sequence[int]) -> Table:
    """A table whose last column stands only where some row says something in it."""
    end = None if any(row[-1] for row in rows) else -1
    return Table(tuple(columns[:end]), tuple(row[:end] for row in rows), tuple(numeric))


def response_table(data: ReportData) -> Table:
    return Table(
        (
            "ω", *_mechanism_head(data), "expected", "model", "exact circuit", "ngspice", "agree",
            "symmetric (model)", "coexisting (model)",
        ),
        tuple(
            (
                words.number(c.model.omega),
                *_mechanism(data, c),
                _expected(c),
                c.model.orbit.response + ("" if c.model.found else " (not what is wanted)"),
                c.circuit.response,
                "not asked" if c.ngspice is None else c.ngspice.response,
                "yes" if c.agrees else "no",
                words.yes(c.model.orbit.symmetric),
                _coexisting(data, c),
            )
            for c in data.checked
        ),
        (0, *_mechanism_columns(data)),
    )  # fmt: skip


def _coexisting(data: ReportData, checked: CheckedResponse) -> str:
    """The other attractors of the model with their shares of the starts."""
    model = replace(data.modelfile.model, b=checked.model.b)
    others = [
        f"{b.orbit.response} ({100 * b.count / DRAWN_STARTS:.3g} %)"
        for b in beside(model, checked.model)
    ]
    return f"{', '.join(others) or 'none'}, of {DRAWN_STARTS} starts"


def settings_table(data: ReportData) -> Table:
    system = nominal_reduction(data.design).system() if data.checked else None
    rows: list[tuple[str, ...]] = []
    for c in data.checked:
        assert system is not None
        contact = words.NONE
        if len(c.circuit.impact_times):
            contact = words.quantity(shortest_contact(c.circuit, system, c.excitation), "s", 3)
        near = min(c.circuit.penetration, c.circuit.miss)
        gate = c.gate
        steps, method, difference = words.NONE, words.NONE, words.NONE
        if gate is not None:
            steps = f"{1.0 / (c.excitation.frequency * gate.settings.max_step):.0f}"
            method = gate.settings.method + ("" if gate.passed else " (not passed)")
            if math.isfinite(gate.difference):
                difference = f"{100 * gate.difference:.2g} %"
        rows.append(
            (
                words.number(c.model.omega),
                *_mechanism(data, c),
                words.number(c.model.b),
                words.quantity(c.excitation.frequency, "Hz"),
                words.quantity(c.excitation.amplitude, "V"),
                contact,
                words.quantity(near, "V", 3) if math.isfinite(near) else words.NONE,
                steps,
                method,
                difference,
            )
        )
    shift = len(_mechanism_columns(data))
    names = (
        "ω", *_mechanism_head(data), "b", "frequency", "amplitude (peak)", "shortest contact",
        "nearest grazing", "ngspice steps per period", "method", "largest difference",
    )  # fmt: skip
    if not any(c.gate is not None for c in data.checked):
        rows = [row[:-3] for row in rows]
        return Table(names[:-3], tuple(rows), tuple(range(len(names) - 3)))
    return Table(names, tuple(rows), (*range(7 + shift), 8 + shift))


def yield_table(data: ReportData) -> Table | None:
    if data.yields is None or not data.checked:
        return None
    rows = []
    for i, c in enumerate(data.checked):
        y = data.yield_of(i)
        if y is None:
            rows.append((words.name(c), *[words.NONE] * 6, f"left out: {_left_out(data, i)}"))
            continue
        rows.append((words.name(c), *_counts(y), _reasons(data.answers_to(i))))
    if data.all_on_one_board is not None:
        rows.append(("all on one board", *_counts(data.all_on_one_board), ""))
    return _told(
        (
            "response", "ok", "lost", "grazing", "failed", "yield", "of 1000 boards (95 %)",
            "what became of the others",
        ),
        rows,
        (1, 2, 3, 4, 5, 6),
    )  # fmt: skip


def ngspice_table(data: ReportData) -> Table | None:
    """How often ngspice, asked about the same boards, said the same as the exact circuit."""
    rows = []
    for i, c in enumerate(data.checked):
        known = {a.sample: a for a in data.answers_to(i)}
        for start, kind in (
            ("its own orbit", StartKind.OWN),
            ("the nominal orbit", StartKind.NOMINAL),
        ):
            asked = [h for h in data.heard_of(i) if h.kind is kind and h.response]
            if not asked:
                continue
            notes: dict[NgspiceVerdict, Counter[str]] = {one: Counter() for one in NgspiceVerdict}
            for h in asked:
                answer = known[h.sample]
                outcome = h.outcome(answer)
                differs = f"{answer.response} but {h.either or h.response}"
                note = (
                    differs if outcome is NgspiceVerdict.DIFFERED else h.reason or "no reason given"
                )
                notes[outcome][note] += 1
            counts = [notes[one].total() for one in NgspiceVerdict]
            del notes[NgspiceVerdict.AGREED]
            told = sorted((t, n) for counted in notes.values() for t, n in counted.items())
            said_ = ", ".join(f"{t} ({n})" for t, n in told[:REASONS_SHOWN])
            rows.append((words.name(c), start, *map(str, (len(asked), *counts)), said_))
    if not rows:
        return None
    return _told(
        (
            "response", "started on", "boards", "agreed", "differed", "undecided", "failed",
            "exact circuit but ngspice (boards); why without answer",
        ),
        rows,
        (2, 3, 4, 5, 6),
    )  # fmt: skip


def equation_table(data: ReportData) -> Table | None:
    """What ngspice says of the circuit's equation: .ac and .dc against the model."""
    if data.equations is None:
        return None
    rows = tuple(
        (
            f.name,
            f.reason or words.error(f.deviation),
            words.error(f.bound),
            words.yes(f.passed),
        )
        for f in data.equations.findings
    )
    return Table(("compared", "largest deviation", "bound", "within"), rows, (1, 2))


def provenance_table(data: ReportData) -> Table:
    said = {k: v for k, v in data.provenance.items() if k != "spread" or data.plan is None}
    rows = [*_flat(said)]
    if data.plan is not None:
        varies = words_of(data.plan.spread, data.design.circuit)
        rows.append(("spread", f"{data.plan.spread.name}: {varies} (part by part in {TOLERANCE})"))
    return Table(("what", "value"), tuple(rows))


def _mechanism_head(data: ReportData) -> tuple[str, ...]:
    """The heading of the frequency in Hz that the mechanism has, where it has SI values."""
    return () if data.modelfile.mechanical is None else ("mechanism",)


def _mechanism_columns(data: ReportData) -> tuple[int, ...]:
    """Where that column stands: beside ω."""
    return () if data.modelfile.mechanical is None else (1,)


def _mechanism(data: ReportData, c: CheckedResponse) -> tuple[str, ...]:
    mechanical = data.modelfile.mechanical
    return () if mechanical is None else (words.quantity(mechanical.hertz(c.model.omega), "Hz"),)


def _expected(c: CheckedResponse) -> str:
    kind = {True: "symmetric", False: "asymmetric", None: ""}[c.model.spec.symmetric]
    return ", ".join(t for t in (c.model.expected, kind) if t) or "any"


def _counts(y: Yield) -> tuple[str, ...]:
    rate = f"{100 * y.rate:.3g} %" if math.isfinite(y.rate) else words.NONE
    return (str(y.ok), str(y.lost), str(y.grazing), str(y.failed), rate, _per_thousand(y))


def _per_thousand(y: Yield) -> str:
    low, high = (round(1000 * v) for v in y.interval)
    if not math.isfinite(y.rate):
        return words.NONE
    return f"{round(1000 * y.rate)} ({words.limits(y, f'{low} to {high}')})"


def _reasons(answers: Sequence[Answer]) -> str:
    """Why boards do not show a response, most frequent first; figures in a reason do not count."""
    met = Counter(_reason(a) for a in answers if a.verdict is not Verdict.OK)
    ranked = sorted(met.items(), key=lambda item: (-item[1], item[0]))
    said = [f"{text} ({n})" for text, n in ranked[:REASONS_SHOWN]]
    rest = ranked[REASONS_SHOWN:]
    if rest:
        said.append(f"{words.plural(len(rest), 'other outcome')} ({sum(n for _, n in rest)})")
    return ", ".join(said)


def _reason(answer: Answer) -> str:
    reason = re.sub(r" by .*", "", answer.reason)
    join = "" if not reason else " " if reason.startswith("to ") else ": "
    return f"{answer.verdict}{join}{reason}"


def _left_out(data: ReportData, i: int) -> str:
    c = data.checked[i]
    if not c.model.found:
        return "the model does not show it"
    if c.circuit.status is not OrbitStatus.PERIODIC:
        return f"the nominal circuit is {words.orbit(c.circuit)}"
    return "it is not part of the study"


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
