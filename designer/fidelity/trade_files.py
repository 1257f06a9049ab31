"""What a trade is told in: JSON by the keys of docs/contract.md, a table, and the front."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from designer.base.figure_style import (
    CIRCUIT_COLOUR,
    GRID,
    MODEL_COLOUR,
    MUTED,
    NGSPICE_COLOUR,
    new_figure,
    plain_numbers,
    styled,
)
from designer.base.page import Block, Page, PageSection, Table, bullets, markdown, table, table_of
from designer.base.plain_json import FORMAT, plain
from designer.base.si_unit import drive_text
from designer.fidelity.fidelity_answers import FIDELITIES, VENDOR
from designer.fidelity.fidelity_errors import BOARD, EQUATIONS, FidelityError, Truth
from designer.fidelity.trade_study import RESPONSE, WAVEFORM, Cheapest, Trade
from designer.fidelity.yields import BandwidthYield, BoardTrade, LeftOut
from designer.model.model import SiScales
from designer.spice.opamp_model import MODELS

if TYPE_CHECKING:
    from designer.answers.shared_rows import ProvenanceRow
    from designer.answers.trade_answer import (
        BoardTradeRow,
        BoardTradeShown,
        CheapestRow,
        CheapestShown,
        FidelityRow,
        NamedRow,
        TradeAnswer,
        TruthRow,
        TruthShown,
        YieldDifference,
    )

NONE = "–"
UNITS = (
    "Seconds are of one drive period of each response, for yields of one board of each. "
    "Measured is the largest error with the uncertainty of what it is measured against, or the "
    "number of responses with another n-p-q. Convergence is what the steps of one rung differ by, "
    "where that rung is what the others are measured against: it is no error against anything else."
)
"""What the columns of ``cheapest_table`` say."""
TITLES: Mapping[str, str] = {
    "rk4": "model, Runge-Kutta",
    "model": "model, exact",
    "circuit": "circuit, exact",
    "bandwidth": "circuit, exact, with bandwidth",
    **{name: f"ngspice, {model.words}" for name, model in MODELS.items()},
    "vendor": "ngspice, the vendor's op-amps",
}
_LOOKS = {
    "rk4": ("#0072b2", "s"),
    "model": (MODEL_COLOUR, "o"),
    "circuit": (CIRCUIT_COLOUR, "o"),
    "bandwidth": (CIRCUIT_COLOUR, "*"),
    "ideal": ("#e6a817", "^"),
    "dynamic": (NGSPICE_COLOUR, "D"),
    "full": ("#8c1c13", "v"),
    "vendor": ("#5b3a8c", "P"),
}
_OTHER = ("#555555", "X")


def trade_json(
    result: Trade,
    provenance: ProvenanceRow,
    seconds: float,
    title: str,
    si: SiScales | None = None,
) -> TradeAnswer:
    """``fidelities``, ``cheapest``, ``truths``, ``boards`` and ``left_out``.

    si : each row of a response also gets ``frequency_hz``, of the mechanism's force.
    """
    boards = [r.boards for r in result.responses]
    document: TradeAnswer = {
        "format": FORMAT,
        "title": title,
        "rungs": [_row(row, r.truth) for r in result.responses for row in r.rows],
        "truths": [_truth(r.truth) for r in result.responses],
        "boards": [_boards(b) for b in boards if isinstance(b, BoardTrade)],
        "left_out": [
            {**b.label.as_dict(), "reason": b.reason} for b in boards if isinstance(b, LeftOut)
        ],
        "cheapest": [_cheapest(c) for c in result.cheapest],
        "provenance": provenance,
        "cost": {"seconds": seconds},
    }
    rows: list[NamedRow | CheapestRow] = [
        *document["rungs"],
        *document["truths"],
        *document["boards"],
        *document["left_out"],
        *document["cheapest"],
    ]
    for row in rows:
        if si is not None and row["omega"] is not None:
            row["frequency_hz"] = si.hertz(row["omega"])
    answer: TradeAnswer = plain(document)
    return answer


def _row(row: FidelityError, truth: Truth) -> FidelityRow:
    """No fidelity has an error against itself: what its steps differ by is its convergence."""

    def against(errors: Mapping[str, float], of: str) -> float:
        return math.nan if truth.is_itself(row.rung, of) else errors[of]

    return {
        **row.label.as_dict(),
        "rung": row.rung,
        "level": row.level,
        "settings": row.settings,
        "response": row.response,
        "reason": row.reason,
        "gate": row.gate,
        "right": dict(row.right),
        "error": against(row.error, BOARD),
        "error_of_equations": against(row.error, EQUATIONS),
        "impact_velocity_error": against(row.velocity, BOARD),
        "impact_velocity_error_of_equations": against(row.velocity, EQUATIONS),
        "numerical_error": row.numerical,
        "convergence": row.convergence,
        "seconds_per_period": row.seconds,
    }


def _truth(truth: Truth) -> TruthRow:
    return {
        **truth.label.as_dict(),
        "rung": truth.rung,
        "response": truth.response,
        "sure": truth.sure,
        "uncertainty": truth.error,
        "impact_velocity_uncertainty": truth.velocity,
        "periodic": dict(truth.periodic),
        "impacts": dict(truth.impacts),
    }


def _boards(b: BoardTrade) -> BoardTradeRow:
    difference, low, high = b.difference
    return {
        **b.label.as_dict(),
        "boards": b.boards,
        "ok": b.ok,
        "gained": b.gained,
        "lost": b.lost,
        "undecided": b.undecided,
        "periods": b.periods,
        "resolved": b.resolved,
        "difference": difference,
        "low": low,
        "high": high,
        "seconds_per_board": b.seconds,
        "bandwidth": None if b.bandwidth is None else _with_bandwidth(b.bandwidth),
    }


def _with_bandwidth(b: BandwidthYield) -> YieldDifference:
    difference, low, high = b.difference
    return {
        "boards": b.boards,
        "ok": b.ok,
        "gained": b.gained,
        "lost": b.lost,
        "difference": difference,
        "low": low,
        "high": high,
    }


def _cheapest(c: Cheapest) -> CheapestRow:
    label = c.label
    return {
        "number": None if label is None else label.number,
        "omega": None if label is None else label.omega,
        "b": None if label is None else label.b,
        "expected": None if label is None else label.expected,
        "question": c.question,
        "of": c.of,
        "rung": c.rung,
        "level": c.level,
        "bound": c.bound,
        "measured": c.measured,
        "convergence": c.convergence,
        "shown": c.shown,
        "seconds": c.seconds,
        "note": c.note,
    }


def name(row: NamedRow) -> str:
    """A response as people are told of it: its number, ω and b."""
    return f"{row['number']}: {drive_text(row['omega'], row.get('frequency_hz'))}, b = {row['b']:g}"


def sheet(answer: TradeAnswer) -> str:
    """trade.md: the cheapest fidelity for each question, then every fidelity, from the JSON
    object."""
    head = [
        Markup(
            f"Made by `designer trade` with `--boards {_boards_asked(answer)} --seed "
            f"{answer['provenance']['seed']}`; the data are in `trade.json`."
        ),
        Markup(
            "The cheapest rung and setting that answers each question, for all responses together, "
            "and against what its error is measured: `board` is the nominal circuit with "
            f"{truth_words(answer['truths'])} in ngspice at the finest step, `equations` the exact "
            "flow of the model, `ideal` ngspice with ideal op-amps on the same boards. Where the "
            "bound is not kept by any rung, the one that comes nearest is named. A setting of "
            "ngspice that did not pass the numerics gate is never named; the board itself is, by "
            "what its two finest steps differ by, where nothing less will do."
        ),
        cheapest_table(answer["cheapest"], responses=len(answer["truths"])),
        UNITS,
    ]
    sections = [PageSection("By response", _by_response(answer))]
    if answer["boards"]:
        sections.append(PageSection("Boards", board_blocks(answer["boards"])))
    if answer["left_out"]:
        rows = [f"{name(row)}: {row['reason']}" for row in answer["left_out"]]
        sections.append(PageSection("Left out", ["No boards were asked of:", bullets(rows)]))
    return markdown(Page(f"Time and error: {answer['title']}", head, sections))


def _boards_asked(answer: TradeAnswer) -> int:
    return int(answer["provenance"]["settings"]["trade"]["boards"])


def truth_words(truths: Sequence[TruthShown]) -> str:
    """The op-amps that stand for the board's."""
    vendor = any(t.get("rung") == VENDOR for t in truths)
    return "the vendor's macromodel of the op-amps" if vendor else "full op-amps"


def cheapest_table(cheapest: Sequence[CheapestShown], *, responses: int) -> Table | None:
    """What answers each question, of all responses together. responses : how many there are."""
    rows = []
    for c in cheapest:
        if c["number"] is not None and responses != 1:
            continue
        shown = {True: "yes", False: "no", None: NONE}[c["shown"]]
        fidelity = [NONE] * 4
        if c["rung"]:
            errors = c.get("measured"), c.get("convergence")  # earlier versions had no convergence
            fidelity = [TITLES[c["rung"]], c["level"] or NONE]
            fidelity += [_measured(c["question"], error) for error in errors]
        seconds = _short(c["seconds"]) if c["rung"] else NONE
        rows.append((c["question"], c["of"], *fidelity, shown, seconds, c["note"]))
    columns = (
        "question", "against", "rung", "setting", "measured", "convergence", "kept", "CPU seconds",
        "note",
    )  # fmt: skip
    return table(columns, rows)


def _by_response(answer: TradeAnswer) -> list[Block]:
    truths = answer["truths"]
    by = {(row["rung"], row["level"], row["number"]): row for row in answer["rungs"]}
    rows = [
        (TITLES[fidelity], level, *(_cell(by.get((fidelity, level, t["number"]))) for t in truths))
        for fidelity, level in dict.fromkeys((row["rung"], row["level"]) for row in answer["rungs"])
    ]
    heads = (f"{name(t)}: {t['response']}" for t in truths)
    return [
        Markup(
            "Error of x₁ (RMS over its peak) against the board, and CPU milliseconds of a drive "
            "period; another n-p-q than the board's is named. Of the rung that stands for the "
            "board it is the convergence, the difference from its own finest step. `step ×4` is "
            "four times the step that the gate tries first, so coarser; `step ×0.5` is finer."
        ),
        table(("rung", "setting", *heads), rows),
    ]


def board_blocks(boards: Sequence[BoardTradeShown]) -> list[Block]:
    """What both engines say of the same boards. boards : of the JSON object."""
    columns: dict[str, Callable[[BoardTradeShown], str]] = {
        "response": name,
        "boards": lambda b: str(b["boards"]),
        "ok": lambda b: str(b["ok"]),
        "only exact": lambda b: str(b["lost"]),
        "only ngspice": lambda b: str(b["gained"]),
        "at the gate's step alone": lambda b: str(b.get("resolved", 0)),
        "undecided": lambda b: str(b["undecided"]),
        "difference": lambda b: _percent(b["difference"]),
        "interval": lambda b: f"{_percent(b['low'])} to {_percent(b['high'])}",
    }
    return [
        "Yield of the exact circuit less that of ngspice with ideal op-amps on the boards that "
        "both decided, with its 95 % interval. Where they differ, ngspice's step is divided by "
        "four, at most three times, until its answer depends on it no more: boards that differ at "
        "the gate's step alone are charged to ngspice. The interval holds for all boards that were "
        "asked: those that one of them left undecided count as ok on the exact circuit alone "
        "for its upper end, and in ngspice alone for its lower end.",
        table_of(boards, columns),
        *_bandwidth_blocks([(b, with_it) for b in boards if (with_it := b.get("bandwidth"))]),
    ]


def _bandwidth_blocks(boards: Sequence[tuple[NamedRow, YieldDifference]]) -> list[Block]:
    if not boards:
        return []
    columns: dict[str, Callable[[tuple[NamedRow, YieldDifference]], str]] = {
        "response": lambda b: name(b[0]),
        "boards": lambda b: str(b[1]["boards"]),
        "ok": lambda b: str(b[1]["ok"]),
        "only with": lambda b: str(b[1]["gained"]),
        "only without": lambda b: str(b[1]["lost"]),
        "difference": lambda b: _percent(b[1]["difference"]),
        "interval": lambda b: f"{_percent(b[1]['low'])} to {_percent(b[1]['high'])}",
    }
    return [
        "What no engine with ideal op-amps sees: the yield of the exact circuit with bandwidth "
        "less that without, on the boards that both decided, with its 95 % interval.",
        table_of(boards, columns),
    ]


def _measured(question: str, error: float | None) -> str:
    if error is None:
        return NONE
    return f"{error:.0f} wrong" if question == RESPONSE else _percent(error)


def _cell(row: FidelityRow | None) -> str:
    if row is None:
        return NONE
    error = _percent(row["error"])
    if row["error"] is None and row["convergence"] is not None:
        error = f"convergence {_percent(row['convergence'])}"
    error = error if row["right"][BOARD] else row["response"]
    seconds = row["seconds_per_period"]
    text = f"{error}, {_short(None if seconds is None else 1e3 * seconds)}"
    return f"{text} (gate not passed)" if row["gate"] is False else text


def _percent(value: float | None) -> str:
    return NONE if value is None else f"{100.0 * value:.2g} %"


def _short(value: float | None) -> str:
    """A number to two figures, without an exponent where none is needed."""
    if value is None:
        return NONE
    return f"{float(f'{value:.2g}'):.10g}"


ErrorKey = Literal["error", "numerical_error"]
KEYS: dict[str, ErrorKey] = {"trade": "error", "trade-numerics": "numerical_error"}
"""Pictures, and which error each shows."""
_AXES = {
    "error": "RMS error of x₁ / peak,\nagainst the board",
    "numerical_error": "RMS error of x₁ / peak, against the rung's\nown equations, or convergence",
}
_PALE = 0.3
"""Opacity of what did not pass the gate."""


@styled
def front(answer: TradeAnswer, key: ErrorKey = "error") -> Figure:
    """Error over the time of a drive period, a panel for each response; hollow where the n-p-q is
    not the board's, pale where ngspice's setting did not pass the gate. What the error is measured
    against is not shown.

    key : "error", against the board, where a line joins what no other fidelity beats in both; or
    "numerical_error", against the exact flow of the fidelity's own equations, or where there is
    none its convergence, so that fidelities do not compete.
    """
    rungs = answer["rungs"]
    if key == "numerical_error":
        rungs = [{**row, "numerical_error": row[key] or row["convergence"]} for row in rungs]
    truths = answer["truths"]
    columns = min(3, len(truths))
    rows = -(-len(truths) // columns)
    figure = new_figure(max(3.3 * columns, 7.2), 2.7 * rows + 0.9)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for axes in grid[len(truths) :]:
        axes.set_visible(False)
    # Neither none nor exactly 0: those are not on the axes.
    shown = [row for row in rungs if row[key] and row["seconds_per_period"]]
    for i, (axes, truth) in enumerate(zip(grid, truths, strict=False)):
        _panel(axes, [row for row in shown if row["number"] == truth["number"]], key)
        axes.set_title(f"{name(truth)}: {truth['response']}", loc="left")
        if i % columns == 0:
            axes.set_ylabel(_AXES[key])
        if i + columns >= len(truths):
            axes.set_xlabel("CPU seconds of a drive period")
            axes.tick_params(labelbottom=True)  # also where the row below is not full
    used = [r for r in FIDELITIES if any(row["rung"] == r for row in shown)]
    handles = [_mark(*_LOOKS.get(r, _OTHER), TITLES[r]) for r in used]
    if any(not row["right"][BOARD] for row in shown):
        handles.append(_mark(MUTED, "o", "hollow: another n-p-q", mfc="white"))
    if any(row["gate"] is False for row in shown):
        handles.append(_mark(MUTED, "o", "pale: gate not passed", alpha=_PALE))
    if key == "error":
        handles.append(Line2D([], [], color=MUTED, lw=0.9, label="front"))
    handles.append(Line2D([], [], color=MUTED, lw=0.9, ls=(0, (4, 2)), label="0.1 %"))
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _mark(colour: str, marker: str, label: str, **look: Any) -> Line2D:
    return Line2D([], [], ls="", marker=marker, color=colour, ms=5, label=label, **look)


def _panel(axes: Axes, rows: Sequence[FidelityRow], key: ErrorKey) -> None:
    points = []
    for row in rows:
        colour, marker = _LOOKS.get(row["rung"], _OTHER)
        right, passed = row["right"][BOARD], row["gate"] is not False
        at = float(row["seconds_per_period"] or 0.0), float(row[key] or 0.0)
        face, alpha = colour if right else "white", None if passed else _PALE
        axes.plot(*at, ls="", marker=marker, ms=5, color=colour, mfc=face, alpha=alpha, zorder=3)
        if right and passed:
            points.append(at)
    line: list[tuple[float, float]] = []
    for at in sorted(points):
        if not line or at[1] < line[-1][1]:
            line.append(at)
    if key == "error" and line:
        axes.plot([p[0] for p in line], [p[1] for p in line], color=MUTED, lw=0.9, zorder=2)
    axes.axhline(WAVEFORM, color=MUTED, lw=0.9, ls=(0, (4, 2)), zorder=1)
    axes.set_xscale("log")
    axes.set_yscale("log")
    plain_numbers(axes.xaxis, axes.yaxis)
    axes.grid(True, color=GRID, lw=0.6)
