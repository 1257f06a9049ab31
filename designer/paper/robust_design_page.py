"""The pages of the report on a searched design: two charts, and the text beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from designer.base.figure_style import INK, MUTED, new_figure, styled

Case = Mapping[str, Any]
COLOURS = ("#b0b0b0", "#e69f00", "#56b4e9", "#009e73", "#0072b2")
KINDS = ("as built", "tuned", "reached")
GOAL = 0.99


@styled
def yield_chart(cases: Sequence[Case]) -> Figure:
    """Yield as built of every response, a bar for each circuit, with 95 % intervals."""
    columns = list(_by_response(cases[-2]))
    figure = new_figure(9.0, 3.6)
    axes = figure.subplots()
    width = 0.85 / len(cases)
    for k, case in enumerate(cases):
        known = {name: row["as built"] for name, row in _by_response(case).items()}
        at = [i for i, name in enumerate(columns) if name in known]
        rows = [known[columns[i]] for i in at]
        rates = np.array([100.0 * r["rate"] for r in rows])
        below = rates - [100.0 * r["low"] for r in rows]
        above = np.array([100.0 * r["high"] for r in rows]) - rates
        places = np.array(at) + (k - 0.5 * (len(cases) - 1)) * width
        axes.bar(places, rates, width, color=COLOURS[k], label=case["name"])
        errors = np.maximum(np.stack([below, above]), 0.0)
        axes.errorbar(places, rates, errors, fmt="none", ecolor=INK, elinewidth=0.7)
    axes.axhline(100.0 * GOAL, color=MUTED, linewidth=0.7, linestyle="--")
    axes.set_xticks(range(len(columns)), columns)
    axes.set_ylim(0.0, 105.0)
    axes.set_xlabel("response n-p-q; dashed: 99 %")
    axes.set_ylabel("yield as built [%]")
    figure.legend(loc="outside upper center", ncols=len(cases), fontsize=8, frameon=False)
    return figure


@styled
def lever_chart(cases: Sequence[Case]) -> Figure:
    """Smallest distance of the match design and of the found one, and with one lever moved."""
    search = next(c["search"] for c in cases if "search" in c)
    bars = []
    if search["start"] is not None:
        bars.append(("match design", search["start"]["smallest_distance"], COLOURS[0]))
    levers = search["contributions"]
    bars += [(f"+ {_words(x)}", x["alone"]["smallest_distance"], COLOURS[2]) for x in levers]
    bars.append(("found design", search["final"]["smallest_distance"], COLOURS[4]))
    bars += [(f"− {_words(x)}", x["without"]["smallest_distance"], COLOURS[1]) for x in levers]
    figure = new_figure(8.0, 0.9 + 0.32 * len(bars))
    axes = figure.subplots()
    for i, (_, value, colour) in enumerate(bars):
        axes.barh(i, 0.0 if value is None else value, color=colour)
        text = "no such design" if value is None else f"{value:.2f}"
        end = (max(value or 0.0, 0.0), i)
        axes.annotate(text, end, (4, 0), textcoords="offset points", va="center", size=8)
    axes.axvline(0.0, color=INK, linewidth=0.7)
    axes.set_yticks(range(len(bars)), [name for name, _, _ in bars], size=8)
    axes.invert_yaxis()
    axes.margins(x=0.12)
    axes.set_xlabel("smallest distance from losing a response [σ]; below 0 most boards lose it")
    return figure


def readme(cases: Sequence[Case], command: str, model: str) -> str:
    """``README.md`` of the report."""
    out = [
        "# The design that real parts cannot spoil",
        "",
        f"Made by `{command}` from `examples/{model}`.",
        "Boards are those of `bench-1`, 1 % resistors and capacitors; those of the searches are",
        "drawn from a stream that no study uses. The data are in `robust-design.json`, the",
        "searched designs in `free/` and `nominal/`.",
        "",
        "![Yield as built of every response on every circuit](yields.png)",
        "",
        "## Yields",
        "",
        "Per cent, with the two-sided 95 % interval. The goal is reached where the lower end is at",
        "99 % or above, missed where the upper end is below, else undecided. Tuned and powered-up",
        "boards are more where the first ones left it undecided; such a second look has a chance",
        "of its own to be wrong.",
        "",
    ]
    for kind in KINDS:
        shown = [c for c in cases if any(kind in r for r in c["responses"])]
        if not shown:
            continue
        columns = list(_by_response(shown[-1]))
        out += [
            f"| {kind} | boards | {' | '.join(columns)} | all on one | goal 99 % |",
            "|" + "---|" * (len(columns) + 4),
        ]
        for case in shown:
            rows = _by_response(case)
            known = {name: rows[name].get(kind) if name in rows else None for name in columns}
            whole = case["all_on_one"].get(kind)
            cells = [str(_boards(case, kind)), *(_cell(known[name]) for name in columns)]
            goal = _goal(known | {"all on one": whole})
            out.append(f"| {' | '.join([case['name'], *cells, _cell(whole), goal])} |")
        out.append("")
    out += _confirmations(cases)
    out += ["## Places", ""]
    for case in cases:
        if "search" in case:
            out += [f"**{case['name']}**", "", "| response | ω | b | distance | limited by |"]
            out.append("|---|---|---|---|---|")
            found = case["search"]["final"]["responses"]
            for place, row in zip(found, case["responses"], strict=True):
                distance = "-" if place["distance"] is None else f"{place['distance']:.2f} σ"
                out.append(
                    f"| {row['expect']} | {place['omega']:.5g} | {place['b']:.4g} | {distance} "
                    f"| {row['limited_by']} |"
                )
            out.append("")
    out += [
        "## Blame",
        "",
        "| circuit | response | yield as built | what limits it |",
        "|---|---|---|---|",
    ]
    for case in cases:
        for row in case["responses"]:
            if row["as built"]["rate"] < 1.0:
                out.append(
                    f"| {case['name']} | {row['expect']} | {_cell(row['as built'])} "
                    f"| {row['blame']} |"
                )
    out += ["", "## Price and parts", ""]
    out += ["| circuit | pieces | op-amp packages | distinct values | price, at most | not sold |"]
    out.append("|---|---|---|---|---|---|")
    for case in cases:
        b = case["bill"]
        out.append(
            f"| {case['name']} | {b['parts']} | {b['packages']} | {b['distinct']} "
            f"| {b['price']:.2f} € | {', '.join(b['unsold']) or 'none'} |"
        )
    out += ["", "## What each lever is worth", "", "![Levers](levers.png)", ""]
    out += [
        "The smallest distance over all responses, in standard deviations: of the match design",
        "with one lever moved to where the search put it, and of the found design with it moved",
        "back.",
        "",
    ]
    for case in cases:
        if "search" in case:
            out += [f"**{case['name']}**", "", "| lever | from | to | alone | without |"]
            out.append("|---|---|---|---|---|")
            for lever in case["search"]["contributions"]:
                ends = [lever[k]["smallest_distance"] for k in ("alone", "without")]
                shown_ends = ["no such design" if d is None else f"{d:.2f} σ" for d in ends]
                out.append(
                    f"| {_lever(lever)} | {lever['from']} | {lever['to']} | {shown_ends[0]} "
                    f"| {shown_ends[1]} |"
                )
            out.append("")
    return "\n".join(out).rstrip() + "\n"


def _by_response(case: Case) -> dict[str, Mapping[str, Any]]:
    """Its rows by n-p-q; of two responses with the same one the later has its number behind it."""
    out: dict[str, Mapping[str, Any]] = {}
    for row in case["responses"]:
        name, count = str(row["expect"]), 1
        while name in out:
            count += 1
            name = f"{row['expect']} ({count})"
        out[name] = row
    return out


def _confirmations(cases: Sequence[Case]) -> list[str]:
    """What ngspice says of the same boards."""
    out = ["## On ngspice", ""]
    for case in cases:
        if "confirmation" in case:
            said = case["confirmation"]
            out += [f"**{case['name']}**, rung `{said['rung']}`", ""]
            out += ["| response | numerics gate | boards asked | agree |", "|---|---|---|---|"]
            for row, known in zip(said["responses"], case["responses"], strict=True):
                gate = row["gate"]
                passed = "passed" if gate is not None and gate["passed"] else "not passed"
                out.append(f"| {known['expect']} | {passed} | {row['asked']} | {row['agreed']} |")
            out.append("")
    return out


def _boards(case: Mapping[str, Any], kind: str) -> int:
    counted = next(r[kind] for r in case["responses"] if kind in r)
    return sum(int(counted[name]) for name in ("ok", "lost", "grazing", "failed"))


def _lever(lever: Mapping[str, Any]) -> str:
    """Its name; a lever that ngspice moved costs distance on the exact circuit, if anything."""
    name = str(lever["lever"])
    return f"{name} (for ngspice)" if lever.get("by") == "ngspice" else name


def _words(lever: Mapping[str, Any]) -> str:
    return str(lever["lever"]) if lever["lever"] == "places" else f"{lever['lever']} {lever['to']}"


def _cell(counted: Mapping[str, Any] | None) -> str:
    if counted is None or counted["rate"] is None:
        return "-"
    rate, low, high = (100.0 * counted[name] for name in ("rate", "low", "high"))
    return f"{rate:.2f} ({low:.2f} to {high:.2f})"


def _goal(known: Mapping[str, Mapping[str, Any] | None]) -> str:
    """In words; a response that has no yield, because the nominal circuit does not show it, is
    missed."""
    intervals = {
        name: (0.0, 0.0) if row is None or row["rate"] is None else (row["low"], row["high"])
        for name, row in known.items()
    }
    missed = [name for name, (_, high) in intervals.items() if high < GOAL]
    open_ = [name for name, (low, high) in intervals.items() if low < GOAL <= high]
    said = [f"missed by {', '.join(missed)}"] if missed else []
    said += [f"undecided for {', '.join(open_)}"] if open_ else []
    return "; ".join(said) or "reached"
