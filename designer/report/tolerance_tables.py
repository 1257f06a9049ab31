"""Tables of a report about what a study has beside its boards as built: other kinds of yield,
disagreements, start recipes, attribution, maps. None for what it does not have."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from designer.answers.rare_words import boards_text, share_text
from designer.base.page import Table, table, table_of
from designer.base.si_unit import celsius_text, value_text
from designer.model.model import SiScales
from designer.report import words
from designer.report.data import ReportData
from designer.report.measured_table import table as measured_boards
from designer.report.response_tables import STARTED
from designer.report.spread_words import warm_words
from designer.verdicts.verdict import BoardRow
from designer.yields.loss_attribution import ResponseAttribution
from designer.yields.loss_replay import PartAttribution
from designer.yields.rare_losses import WIDEST, LossRegion, RareLosses, ToleranceMargin
from designer.yields.two_engine_yield import Combined
from designer.yields.worst_corner import NOISE, Corner, Index
from designer.yields.yield_count import Yield, count
from designer.yields.yield_maps import YieldMap

PARTS_SHOWN = 4
DIFFERENCES_SHOWN = 20
NO_LOSS = "no board was lost"


def boards(data: ReportData) -> Table | None:
    """Every board of a list with its verdict for each response."""
    if not data.plan.census:
        return None
    answers = [data.study.answers_to(i) for i in range(len(data.checked))]
    rows = [
        (b["board"], *(cell or words.NONE for cell in b["cells"]), b["all"] or words.NONE)
        for b in measured_boards(data.plan, answers)
    ]
    columns = ("board", *(words.name(c) for c in data.checked), "all of them")
    return table(columns, rows, names=1)


def kinds(data: ReportData) -> Table | None:
    """The yields as built, tuned, trimmed, reached and of both engines together, side by side."""
    study, census = data.study, data.plan.census
    bench = [replace(t, verdict=t.bench_verdict) for t in study.tuned or ()]

    def of_layer(rows: Sequence[BoardRow], response: int) -> str:
        return _share(count(study.rows_of(response, rows), census))

    columns: dict[str, tuple[Callable[[int], str], Yield | None]] = {
        "as built": (lambda i: _share(data.yields[i]), study.all_on_one_board)
    }
    layers: dict[str, Sequence[BoardRow] | None] = {
        "tuned": study.tuned,
        "tuned on the bench": None if study.tuned is None else bench,
        "trimmed": study.trimmed,
        "reached": study.power_ups,
    }
    for name, rows in layers.items():
        if rows is not None:
            columns[name] = (partial(of_layer, rows), study.on_one_board(rows))
    if any(study.combined):
        columns["both engines together"] = (lambda i: _both(study.combined[i]), None)
    if len(columns) == 1 or not data.checked:
        return None
    lines = [(words.name(c), *(cell(i) for cell, _ in columns.values()))
             for i, c in enumerate(data.checked)]  # fmt: skip
    if study.all_on_one_board is not None:
        lines.append(("all on one board", *(_share(joint) for _, joint in columns.values())))
    return table(("response", *columns), lines, range(1, len(columns) + 1))


def _share(counted: Yield | None) -> str:
    if counted is None or not math.isfinite(counted.rate):
        return words.NONE
    low, high = counted.interval
    within = words.limits(counted, f"{100 * low:.3g} to {100 * high:.3g}")
    text = f"{100 * counted.rate:.3g} % ({within})"
    return text + (f", {counted.failed} failed" if counted.failed else "")


def _both(both: Combined | None) -> str:
    if both is None:
        return words.NONE
    text = f"{100 * both.estimate:.3g} %"
    if both.low < both.high:  # not so where all the boards there are were asked
        text += f" ({100 * both.low:.3g} to {100 * both.high:.3g})"
    if both.undecided:
        text += (
            f", {both.undecided} without an answer in ngspice: {100 * both.if_lost:.3g} % if these "
            f"are lost, {100 * both.if_ok:.3g} % if ok"
        )
    return text


def differences(data: ReportData) -> Table | None:
    """Boards on which the engines disagree."""
    rows = []
    for c, both in zip(data.checked, data.study.combined, strict=True):
        if both is None:
            continue
        d = both.disagreement
        low, high = d.interval
        boards_text = [
            f"board {x.sample} from {STARTED[x.kind]}: exact circuit {x.exact}, "
            f"ngspice {x.ngspice} ({x.explanation})"
            for x in both.differences[:DIFFERENCES_SHOWN]
        ]
        more = len(both.differences) - len(boards_text)
        boards_text += [f"{more} more"] if more > 0 else []
        rate = f"{d.count} of {d.of} ({100 * low:.2g} to {100 * high:.2g} %)"
        rows.append((words.name(c), rate, "; ".join(boards_text) or "none"))
    columns = (
        "response",
        "another n-p-q in ngspice, of the random boards",
        "boards, and where ngspice started",
    )
    return table(columns, rows, names=1)


def recipes(data: ReportData) -> Table | None:
    study = data.study
    rows = [(words.name(c), text) for c, text in zip(data.checked, data.starts, strict=False)]
    if not data.starts:
        rows = [
            (words.name(data.checked[i]), recipe.text)
            for i, recipe in zip(study.response_indices, study.recipes or (), strict=False)
        ]
    return table(("response", "how to reach it"), [row for row in rows if row[1]])


def _attributed(data: ReportData) -> list[tuple[str, ResponseAttribution]]:
    """Name and attribution of each response that has one."""
    attributions = ((words.name(c), data.attribution_of(i)) for i, c in enumerate(data.checked))
    return [(name, attribution) for name, attribution in attributions if attribution is not None]


def limits(data: ReportData) -> Table | None:
    """What limits each response, and how many verdicts the margin foretells."""
    rows = []
    for name, attribution in _attributed(data):
        p = attribution.prediction
        decided = p.ok + p.lost
        foretold = words.NONE
        if decided:
            foretold = f"{p.right} of {decided}" if p.lost else NO_LOSS
            if p.right < decided:
                foretold += f" (lost boards missed: {p.missed}, false alarms: {p.alarms})"
        rows.append((name, attribution.limited_by, foretold))
    if all(row[-1] in (NO_LOSS, words.NONE) for row in rows):
        rows = [(*row[:-1], "") for row in rows]
    return table(("response", "what limits it", "verdicts foretold by the margin"), rows)


def avoided(data: ReportData) -> Table | None:
    """Losses that are avoided if one group of parts, or one part, were exact."""
    rows = []
    for name, attribution in _attributed(data):
        if not attribution.subjects:
            continue
        groups = [s for s in attribution.subjects if s.kind == "group"]
        parts = [s for s in attribution.subjects if s.kind != "group" and s.avoided][:PARTS_SHOWN]
        rows.append(
            (
                name,
                str(attribution.lost),
                ", ".join(map(_saved, groups)) or words.NONE,
                ", ".join(map(_saved, parts)) or attribution.skipped or "none by itself",
            )
        )
    columns = ("response", "lost", "losses avoided if a group were exact", "if one part were")
    return table(columns, rows, (1,))


def _saved(subject: PartAttribution) -> str:
    low, high = (100 * v for v in subject.interval)
    text = f"{subject.name}: {subject.avoided} of {subject.replayed}"
    if subject.avoided:
        text += f" ({low:.0f} to {high:.0f} %)"
    if subject.caused:
        text += f", {subject.caused} of {subject.kept} ok boards lost"
    return text


def indices(data: ReportData) -> Table | None:
    """The largest Sobol indices of each margin, with their noise."""
    rows = [
        (name, index)
        for name, attribution in _attributed(data)
        for index in attribution.indices[:PARTS_SHOWN]
    ]
    columns: dict[str, Callable[[tuple[str, Index]], str]] = {
        "response": lambda row: row[0],
        "coordinate": lambda row: row[1].coordinate,
        "first-order": lambda row: _noisy(row[1].first, row[1].first_error),
        "total": lambda row: _noisy(row[1].total, row[1].total_error),
    }
    return table_of(rows, columns, ("first-order", "total"))


def _noisy(value: float, error: float) -> str:
    """An index in per cent with its 95 % noise, where that is known."""
    if not math.isfinite(value):
        return words.NONE
    noise = f" ± {100 * NOISE * error:.0f}" if math.isfinite(error) else ""
    return f"{100 * value:.0f}{noise} %".replace("-", "−")


def corners(data: ReportData) -> Table | None:
    """The worst corner of each response."""
    rows = [
        (name, attribution.corner)
        for name, attribution in _attributed(data)
        if attribution.corner is not None
    ]
    columns: dict[str, Callable[[tuple[str, Corner]], str]] = {
        "response": lambda row: row[0],
        "worst corner, all else in the middle": lambda row: ", ".join(
            f"{name} {end}" for name, end in zip(row[1].coordinates, row[1].worst, strict=True)
        ),
        "the board there": lambda row: f"{row[1].verdict}: {row[1].response}",
        "corners survived": lambda row: f"{row[1].survived} of {row[1].corners}",
    }
    return table_of(rows, columns, ("corners survived",))


def rare(data: ReportData) -> Table | None:
    """How many of a million boards lose each response, and what the estimate stands on."""
    columns: dict[str, Callable[[RareLosses], str]] = {
        "response": lambda r: _asked(data, r),
        "lost of a million": lambda r: _millions(r.lost) if r.drawn_lost else "0",
        "95 %": lambda r: f"{_millions(r.low)} to {_millions(r.high)}",
        "boards asked": lambda r: f"{r.boards} and {r.pilots} before",
        "of these lost": lambda r: str(r.drawn_lost),
        "effective number": lambda r: f"{r.effective:.0f}",
        "plain boards for as much": lambda r: (
            words.NONE if math.isnan(r.gain) else f"{r.gain:.3g} times as many"
        ),
        "may be unseen": lambda r: f"up to {_millions(r.unseen)}",
    }
    rows = [[cell(r) for cell in columns.values()] for r in data.study.rare]
    if (joint := data.study.any_lost) is not None:
        cells = [f"{_millions(joint.least)} to {_millions(joint.most)}"]
        cells.append(
            f"{_millions(joint.low)} to {_millions(joint.high)}, by these and what may be unseen"
        )
        rows.append(["at least one, on one board", *cells, *[words.NONE] * (len(columns) - 3)])
    return table(list(columns), rows, (4, 5))


def loss_regions(data: ReportData) -> Table | None:
    """Where in the spread boards lose a response."""
    rows = [(r, region) for r in data.study.rare for region in r.regions]
    columns: dict[str, Callable[[tuple[RareLosses, LossRegion]], str]] = {
        "response": lambda row: _asked(data, row[0]),
        "found by": lambda row: row[1].found_by,
        "becomes": lambda row: row[1].becomes,
        "of the losses": lambda row: share_text(row[1].share),
        "parts that lead there": lambda row: ", ".join(row[1].parts) or words.NONE,
    }
    return table_of(rows, columns)


def tolerance_margins(data: ReportData) -> Table | None:
    """The factors by which tolerances would have to widen until the first loss."""
    rows = [(r, margin) for r in data.study.rare for margin in r.margins]
    columns: dict[str, Callable[[tuple[RareLosses, ToleranceMargin]], str]] = {
        "response": lambda row: _asked(data, row[0]),
        "moved": lambda row: row[1].part or "all parts, to their worse ends",
        "lost first at": lambda row: (
            f"not up to {WIDEST:g} times its tolerance"
            if row[1].widening is None
            else f"{row[1].widening:.3g} times the tolerance"
        ),
    }
    return table_of(rows, columns)


def _asked(data: ReportData, found: RareLosses) -> str:
    return words.name(data.checked[data.study.response_indices[found.question]])


def _millions(share: float) -> str:
    return boards_text(1e6 * share)


def maps(data: ReportData) -> Table | None:
    """Window, setting in use and recommended setting of each yield map."""
    angular = data.result.modelfile.angular

    def shown(value: float, axis: str) -> str:
        if axis == "grade":
            return f"{100 * value:g} % parts"
        if axis == "omega" and angular:
            return value_text(SiScales().hertz(value), "Hz")
        return words.number(value)

    names = {"omega": "frequency" if angular else "ω"}
    columns: dict[str, Callable[[YieldMap], str]] = {
        "response": lambda one: words.name(data.checked[data.study.response_indices[one.question]]),
        "over": lambda one: " × ".join(names.get(a.name, a.name) for a in one.axes),
        "nominal window": lambda one: _window(one, shown),
        "in use": lambda one: _in_use(one, shown),
        "recommended": lambda one: _recommended(one, shown),
    }
    return table_of([one for one in data.study.maps if one.over != "temperature"], columns)


def over_temperature(data: ReportData) -> Table | None:
    """The share of the boards that keep each response at each temperature."""
    rows = [one for one in data.study.maps if one.over == "temperature"]
    if not rows:
        return None

    def share(index: int) -> Callable[[YieldMap], str]:
        return lambda one: _share(one.at(index))

    columns: dict[str, Callable[[YieldMap], str]] = {
        "response": lambda one: words.name(data.checked[data.study.response_indices[one.question]])
    }
    columns |= {
        f"{celsius_text(celsius)}{'*' * rows[0].outside(celsius)}": share(index)
        for index, celsius in enumerate(rows[0].axes[0].values)
    }
    return table_of(rows, columns)


def what_temperature_moves(data: ReportData) -> str:
    """The sentences above that table; "" where there is none."""
    rows = [one for one in data.study.maps if one.over == "temperature"]
    if not rows or rows[0].drift is None:
        return ""
    said = [
        "The same boards at each temperature. It moves parts by their temperature coefficients "
        f"and, of the op-amps, {warm_words(rows[0].drift, bandwidth=data.study.plan.bandwidth)}."
    ]
    if any(rows[0].outside(celsius) for celsius in rows[0].axes[0].values):
        low, high = rows[0].specified
        ends = [] if low is None else [f"from {celsius_text(low)}"]
        ends += [] if high is None else [f"up to {celsius_text(high)}"]
        said.append(f"* The op-amp is specified {' '.join(ends)}, not here.")
    return " ".join(said)


def _window(one: YieldMap, shown: Callable[[float, str], str]) -> str:
    if one.window is None:
        return words.NONE
    return " to ".join(
        f"{shown(edge, one.axes[0].name)}{' (as far as was looked)' if open_ else ''}"
        for edge, open_ in zip(one.window, one.open, strict=True)
    )


def _in_use(one: YieldMap, shown: Callable[[float, str], str]) -> str:
    if one.over == "grade" or one.used not in one.axes[0].values:
        return words.NONE
    place = [one.axes[0].values.index(one.used)]
    if len(one.axes) > 1:
        best = one.recommended
        place.append(0 if best is None else one.axes[1].values.index(best[1]))
    return f"{shown(one.used, one.axes[0].name)}: {_share(one.at(*place))}"


def _recommended(one: YieldMap, shown: Callable[[float, str], str]) -> str:
    best = one.recommended
    if best is None:
        return "nowhere"
    place = tuple(axis.values.index(v) for axis, v in zip(one.axes, best, strict=True))
    setting = ", ".join(shown(v, axis.name) for axis, v in zip(one.axes, best, strict=True))
    return f"{setting}: {_share(one.at(*place))}"
