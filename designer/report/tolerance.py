"""The report's part on tolerance: yields side by side, disagreements, recipes, blame, maps.

Whatever a study does not have leaves no trace: its table is None and its section is missing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from designer.report import words
from designer.report.data import ReportData
from designer.report.layers import Benched, Both, LayerRow
from designer.report.tables import Table
from designer.yields.blame_analysis import Blame, ResponseBlame
from designer.yields.blame_replay import BlamedPart
from designer.yields.joint_yield import all_on_one
from designer.yields.ngspice_sampling import StartKind
from designer.yields.verdict import Verdict, Yield, count

PARTS_SHOWN = 4
DIFFERENCES_SHOWN = 20
NO_LOSS = "no board was lost"
STARTED: dict[str, str] = {StartKind.OWN: "its own orbit", StartKind.NOMINAL: "the nominal orbit"}


def facts(data: ReportData) -> dict[str, Any]:
    """The tables of this part by name; None for what the study does not have."""
    kinds = _kinds(data)
    return {
        "kinds_table": kinds,
        "kinds_heading": "" if kinds is None else _heading(kinds.columns[1:]),
        "difference_table": _differences(data),
        "recipe_table": _recipes(data),
        "limit_table": _limits(data),
        "avoided_table": _avoided(data),
        "corner_table": _corners(data),
        "map_table": _maps(data),
        "blame_heading": _blame_heading(data.layers.blame),
        "blame_note": _blame_note(data.layers.blame),
    }


def blame_of(data: ReportData, response: int) -> ResponseBlame | None:
    """The blame of response number ``response``."""
    number = data.question_of[response]
    if data.layers.blame is None or number is None:
        return None
    return next((b for b in data.layers.blame.responses if b.question == number), None)


def _kinds(data: ReportData) -> Table | None:
    """As built, tuned, trimmed, reached and both engines together, side by side."""
    layers = data.layers
    columns: list[tuple[str, Callable[[int], str]]] = []
    columns.append(("as built", lambda i: _share(data.yield_of(i))))
    if layers.tuned is not None:
        rows, benched = layers.tuned, [_Bench(r) for r in layers.tuned]
        columns.append(("tuned", lambda i: _share(_count(data, rows, i))))
        columns.append(("tuned on the bench", lambda i: _share(_count(data, benched, i))))
    if layers.trimmed is not None:
        trimmed = layers.trimmed
        columns.append(("trimmed", lambda i: _share(_count(data, trimmed, i))))
    if layers.reached is not None:
        reached = layers.reached
        columns.append(("reached", lambda i: _share(_count(data, reached, i))))
    if any(c is not None for c in layers.combined):
        columns.append(("both engines together", lambda i: _both(layers.combined[i])))
    if len(columns) == 1 or not data.checked:
        return None
    table = [(words.name(c), *(cell(i) for _, cell in columns)) for i, c in enumerate(data.checked)]
    whole = _whole(data)
    if whole:
        table.append(("all on one board", *(whole.get(name, words.NONE) for name, _ in columns)))
    names = tuple(name for name, _ in columns)
    return Table(("response", *names), tuple(table), tuple(range(1, len(columns) + 1)))


def _heading(kinds: Sequence[str]) -> str:
    """What a table of these kinds of yield shows."""
    text = f"{', '.join(kinds[:-1])} and {kinds[-1]}"
    return f"{text[0].upper()}{text[1:]}"


@dataclass(frozen=True)
class _Bench:
    """The row of a board that a person tuned."""

    row: Benched

    @property
    def sample(self) -> int:
        return self.row.sample

    @property
    def question(self) -> int:
        return self.row.question

    @property
    def verdict(self) -> Verdict:
        return self.row.bench_verdict


def _whole(data: ReportData) -> dict[str, str]:
    """All responses on one board, by kind of yield."""
    if data.all_on_one_board is None:
        return {}
    out = {"as built": _share(data.all_on_one_board)}

    def whole(rows: Iterable[LayerRow]) -> str:
        return _share(all_on_one(rows, data.census))

    if data.layers.tuned is not None:
        out["tuned"] = whole(data.layers.tuned)
        out["tuned on the bench"] = whole(_Bench(r) for r in data.layers.tuned)
    if data.layers.trimmed is not None:
        out["trimmed"] = whole(data.layers.trimmed)
    if data.layers.reached is not None:
        out["reached"] = whole(data.layers.reached)
    return out


def _count(data: ReportData, rows: Iterable[LayerRow], response: int) -> Yield | None:
    question = data.question_of[response]
    if question is None:
        return None
    return count((r for r in rows if r.question == question), data.census)


def _share(counted: Yield | None) -> str:
    if counted is None or not math.isfinite(counted.rate):
        return words.NONE
    low, high = counted.interval
    within = words.limits(counted, f"{100 * low:.3g} to {100 * high:.3g}")
    said = f"{100 * counted.rate:.3g} % ({within})"
    return said + (f", {counted.failed} failed" if counted.failed else "")


def _both(both: Both | None) -> str:
    if both is None:
        return words.NONE
    said = f"{100 * both.estimate:.3g} %"
    if both.low < both.high:  # not so where all the boards there are were asked
        said += f" ({100 * both.low:.3g} to {100 * both.high:.3g})"
    if both.undecided:
        said += (
            f", {both.undecided} without an answer in ngspice: {100 * both.if_lost:.3g} % if these "
            f"are lost, {100 * both.if_ok:.3g} % if ok"
        )
    return said


def _differences(data: ReportData) -> Table | None:
    rows = []
    for i, both in enumerate(data.layers.combined):
        if both is None:
            continue
        d = both.disagreement
        low, high = d.interval
        said = [
            f"board {x.sample} from {STARTED[x.kind]}: exact circuit {x.exact}, "
            f"ngspice {x.ngspice} ({x.explanation})"
            for x in both.differences[:DIFFERENCES_SHOWN]
        ]
        more = len(both.differences) - len(said)
        said += [f"{more} more"] if more > 0 else []
        rate = f"{d.count} of {d.of} ({100 * low:.2g} to {100 * high:.2g} %)"
        rows.append((words.name(data.checked[i]), rate, "; ".join(said) or "none"))
    if not rows:
        return None
    return Table(
        (
            "response",
            "another n-p-q in ngspice, of the random boards",
            "boards, and where ngspice started",
        ),
        tuple(rows),
    )


def _recipes(data: ReportData) -> Table | None:
    if data.starts:
        rows = [(words.name(c), s) for c, s in zip(data.checked, data.starts, strict=True) if s]
    else:
        rows = [
            (words.name(c), data.layers.recipes[number].text)
            for i, c in enumerate(data.checked)
            for number in [data.question_of[i]]
            if number is not None and number < len(data.layers.recipes)
        ]
    return Table(("response", "how to reach it"), tuple(rows)) if rows else None


def _limits(data: ReportData) -> Table | None:
    rows: list[tuple[str, ...]] = []
    for i, c in enumerate(data.checked):
        b = blame_of(data, i)
        if b is None:
            continue
        p = b.prediction
        decided = p.ok + p.lost
        said = words.NONE
        if decided:
            said = f"{p.right} of {decided}" if p.lost else NO_LOSS
            if p.right < decided:
                said += f" (lost boards missed: {p.missed}, false alarms: {p.alarms})"
        rows.append((words.name(c), b.limited_by, said))
    if not rows:
        return None
    columns: tuple[str, ...] = ("response", "what limits it", "verdicts foretold by the margin")
    if all(row[-1] in (NO_LOSS, words.NONE) for row in rows):
        columns, rows = columns[:-1], [row[:-1] for row in rows]
    return Table(columns, tuple(rows))


def _avoided(data: ReportData) -> Table | None:
    rows = []
    for i, c in enumerate(data.checked):
        b = blame_of(data, i)
        if b is None or not b.subjects:
            continue
        groups = [s for s in b.subjects if s.kind == "group"]
        parts = [s for s in b.subjects if s.kind != "group" and s.avoided][:PARTS_SHOWN]
        rows.append(
            (
                words.name(c),
                str(b.lost),
                ", ".join(map(_saved, groups)) or words.NONE,
                ", ".join(map(_saved, parts)) or b.skipped or "none by itself",
            )
        )
    if not rows:
        return None
    return Table(
        ("response", "lost", "losses avoided if a group were exact", "if one part were"),
        tuple(rows),
        (1,),
    )


def _saved(subject: BlamedPart) -> str:
    low, high = (100 * v for v in subject.interval)
    said = f"{subject.name}: {subject.avoided} of {subject.replayed}"
    if subject.avoided:
        said += f" ({low:.0f} to {high:.0f} %)"
    if subject.caused:
        said += f", {subject.caused} of {subject.kept} ok boards lost"
    return said


def _corners(data: ReportData) -> Table | None:
    rows = []
    for i, c in enumerate(data.checked):
        b = blame_of(data, i)
        if b is None or b.corner is None:
            continue
        k = b.corner
        worst = ", ".join(f"{n} {end}" for n, end in zip(k.coordinates, k.worst, strict=True))
        rows.append(
            (words.name(c), worst, f"{k.verdict}: {k.response}", f"{k.survived} of {k.corners}")
        )
    if not rows:
        return None
    return Table(
        ("response", "worst corner, all else in the middle", "the board there", "corners survived"),
        tuple(rows),
        (3,),
    )


def _maps(data: ReportData) -> Table | None:
    rows = []
    for found in data.layers.maps:
        label = _label_of(data, found.question)
        best = found.recommended
        names = [a.name for a in found.axes]
        window = words.NONE
        if found.window is not None:
            window = " to ".join(
                f"{words.number(edge)}{' (as far as was looked)' if open_ else ''}"
                for edge, open_ in zip(found.window, found.open, strict=True)
            )
        in_use = words.NONE
        if found.over != "grade" and found.used in found.axes[0].values:
            at = found.axes[0].values.index(found.used)
            grade = 0 if best is None else found.axes[-1].values.index(best[-1])
            y = found.at(at) if len(names) == 1 else found.at(at, grade)
            in_use = f"{words.number(found.used)}: {_share(y)}"
        recommended = "nowhere"
        if best is not None:
            place = tuple(a.values.index(v) for a, v in zip(found.axes, best, strict=True))
            setting = ", ".join(_setting(n, v) for n, v in zip(names, best, strict=True))
            recommended = f"{setting}: {_share(found.at(*place))}"
        rows.append(
            (
                label,
                " × ".join("ω" if n == "omega" else n for n in names),
                window,
                in_use,
                recommended,
            )
        )
    if not rows:
        return None
    return Table(("response", "over", "nominal window", "in use", "recommended"), tuple(rows))


def _setting(name: str, value: float) -> str:
    return f"{100 * value:g} % parts" if name == "grade" else words.number(value)


def _label_of(data: ReportData, question: int) -> str:
    return next(
        (words.name(c) for i, c in enumerate(data.checked) if data.question_of[i] == question),
        f"question {question + 1}",
    )


def _blame_heading(found: Blame | None) -> str:
    if found is None:
        return ""
    lost = any(b.lost for b in found.responses)
    return "Which part is to blame" if lost else "What comes nearest to a loss"


def _blame_note(found: Blame | None) -> str:
    if found is None:
        return ""
    asked = "No board was lost, so none was asked again. "
    if any(b.lost for b in found.responses):
        asked = (
            "Lost boards were asked again with one part or one group exact and all else as drawn; "
            "shares do not add up, since a board can be lost by several parts together. "
        )
    return asked + (
        "The margin is the distance to the loss, linear in the parts; its indices tell whose "
        "spread moves it, and are worth as much as the verdicts that it foretells. Cost: "
        f"{words.plural(found.attractors, 'attractor')} and "
        f"{words.plural(found.orbits, 'step')} of following orbits."
    )
