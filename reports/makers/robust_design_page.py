"""The pages of the report on a searched design: two charts, and the text beside them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from designer.base.figure_style import INK, MUTED, new_figure, styled
from designer.base.page import Block, Page, PageSection, Picture, Table, table, table_of

Case = Mapping[str, Any]
Columns = dict[str, Callable[[Mapping[str, Any]], str]]
"""What each column of a table says of a row of the data."""
COLOURS = ("#b0b0b0", "#e69f00", "#56b4e9", "#009e73", "#0072b2")
KINDS = ("as built", "tuned", "reached")
GOAL = 0.99
NONE = "-"


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
        rates, low, high = (
            np.array([100.0 * r[end] for r in rows]) for end in ("rate", "low", "high")
        )
        middles = np.array(at) + (k - 0.5 * (len(cases) - 1)) * width
        axes.bar(middles, rates, width, color=COLOURS[k], label=case["name"])
        errors = np.maximum(np.stack([rates - low, high - rates]), 0.0)
        axes.errorbar(middles, rates, errors, fmt="none", ecolor=INK, elinewidth=0.7)
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
    names = [x["lever"] if x["lever"] == "places" else f"{x['lever']} {x['to']}" for x in levers]
    for name, x in zip(names, levers, strict=True):
        bars.append((f"+ {name}", x["alone"]["smallest_distance"], COLOURS[2]))
    bars.append(("found design", search["final"]["smallest_distance"], COLOURS[4]))
    for name, x in zip(names, levers, strict=True):
        bars.append((f"− {name}", x["without"]["smallest_distance"], COLOURS[1]))
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


def robust_design_page(cases: Sequence[Case], command: str, model: str) -> Page:
    """``README.md`` of the report."""
    searched = [case for case in cases if "search" in case]
    head: list[Block] = [
        Markup(
            f"Made by `{command}` from `examples/{model}`. Boards are those of `bench-1`, 1 % "
            "resistors and capacitors; those of the searches are drawn from a stream that no study "
            "uses. The data are in `robust-design.json`, the searched designs in `free/` and "
            "`nominal/`."
        ),
        Picture("Yield as built of every response on every circuit", file="yields.png"),
    ]
    levers: list[Block] = [
        Picture("Levers", file="levers.png"),
        "The smallest distance over all responses, in standard deviations: of the match design "
        "with one lever moved to where the search put it, and of the found design with it moved "
        "back.",
    ]
    levers += [PageSection(c["name"], [_levers(c["search"]["contributions"])]) for c in searched]
    confirmed = [case for case in cases if "confirmation" in case]
    sections = [
        PageSection("Yields", _yields(cases)),
        PageSection("On ngspice", [_ngspice(case) for case in confirmed]),
        PageSection("Places", [PageSection(c["name"], [_places(c)]) for c in searched]),
        PageSection("Blame", [_attribution(cases)]),
        PageSection("Price and parts", [_bills(cases)]),
        PageSection("What each lever is worth", levers),
    ]
    return Page("The design that real parts cannot spoil", head, sections)


def _yields(cases: Sequence[Case]) -> list[Block]:
    out: list[Block] = [
        "Per cent, with the two-sided 95 % interval. The goal is reached where the lower end is at "
        "99 % or above, missed where the upper end is below, else undecided. Tuned and powered-up "
        "boards are more where the first ones left it undecided; such a second look has a chance "
        "of its own to be wrong. Boards without an answer are left out of a yield, and how many "
        "stands beside it."
    ]
    for kind in KINDS:
        shown = [c for c in cases if any(kind in r for r in c["responses"])]
        if not shown:
            continue
        columns = list(_by_response(shown[-1]))
        rows = []
        for case in shown:
            known = _by_response(case)
            counts = {name: known.get(name, {}).get(kind) for name in columns}
            counts["all on one"] = case["all_on_one"].get(kind)
            one = next(r[kind] for r in case["responses"] if kind in r)
            boards = sum(one[name] for name in ("ok", "lost", "grazing", "failed"))
            cells = map(_cell, counts.values())
            rows.append((case["name"], str(boards), *cells, _goal(counts)))
        out.append(table((kind, "boards", *columns, "all on one", "goal 99 %"), rows))
    return out


def _ngspice(case: Case) -> PageSection:
    """What ngspice says of the same boards."""
    answer = case["confirmation"]
    rows = []
    for row, known in zip(answer["responses"], case["responses"], strict=True):
        passed = row["gate"] is not None and row["gate"]["passed"]
        gate = "passed" if passed else "not passed"
        rows.append((known["expect"], gate, str(row["asked"]), str(row["agreed"])))
    columns = ("response", "numerics gate", "boards asked", "agree")
    return PageSection(f"{case['name']}, rung {answer['rung']}", [table(columns, rows)])


def _places(case: Case) -> Table | None:
    places = case["search"]["final"]["responses"]
    rows = [{**row, **place} for place, row in zip(places, case["responses"], strict=True)]
    columns: Columns = {
        "response": lambda row: row["expect"],
        "ω": lambda row: f"{row['omega']:.5g}",
        "b": lambda row: f"{row['b']:.4g}",
        "distance": lambda row: NONE if row["distance"] is None else f"{row['distance']:.2f} σ",
        "limited by": lambda row: row["limited_by"],
    }
    return table_of(rows, columns)


def _attribution(cases: Sequence[Case]) -> Table | None:
    rows = [{**row, "name": case["name"]} for case in cases for row in case["responses"]]
    columns: Columns = {
        "circuit": lambda row: row["name"],
        "response": lambda row: row["expect"],
        "yield as built": lambda row: _cell(row["as built"]),
        "what limits it": lambda row: row["blame"],
    }
    return table_of([row for row in rows if row["as built"]["rate"] < 1.0], columns)


def _bills(cases: Sequence[Case]) -> Table | None:
    columns: Columns = {
        "circuit": lambda case: case["name"],
        "pieces": lambda case: str(case["bill"]["parts"]),
        "op-amp packages": lambda case: str(case["bill"]["packages"]),
        "distinct values": lambda case: str(case["bill"]["distinct"]),
        "price, at most": lambda case: f"{case['bill']['price']:.2f} €",
        "not sold": lambda case: ", ".join(case["bill"]["unsold"]) or "none",
    }
    return table_of(cases, columns)


def _levers(levers: Sequence[Mapping[str, Any]]) -> Table | None:
    def sigma(end: Mapping[str, Any]) -> str:
        distance = end["smallest_distance"]
        return "no such design" if distance is None else f"{distance:.2f} σ"

    def name(lever: Mapping[str, Any]) -> str:
        """A lever that real op-amps moved costs distance on the exact circuit, if anything."""
        by = lever.get("by", "exact")
        note = "" if by == "exact" else f" (for {by})"
        return f"{lever['lever']}{note}"

    columns: Columns = {
        "lever": name,
        "from": lambda x: str(x["from"]),
        "to": lambda x: str(x["to"]),
        "alone": lambda x: sigma(x["alone"]),
        "without": lambda x: sigma(x["without"]),
    }
    return table_of(levers, columns)


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


def _cell(counted: Mapping[str, Any] | None) -> str:
    if counted is None or counted["rate"] is None:
        return NONE
    rate, low, high = (100.0 * counted[name] for name in ("rate", "low", "high"))
    text = f"{rate:.2f} ({low:.2f} to {high:.2f})"
    return text + (f", {counted['failed']} failed" if counted["failed"] else "")


def _goal(counts: Mapping[str, Mapping[str, Any] | None]) -> str:
    """In words; a response that has no yield, because the nominal circuit does not show it, is
    missed."""
    intervals = {
        name: (0.0, 0.0) if row is None or row["rate"] is None else (row["low"], row["high"])
        for name, row in counts.items()
    }
    missed = [name for name, (_, high) in intervals.items() if high < GOAL]
    open_ = [name for name, (low, high) in intervals.items() if low < GOAL <= high]
    parts = [f"missed by {', '.join(missed)}"] if missed else []
    parts += [f"undecided for {', '.join(open_)}"] if open_ else []
    return "; ".join(parts) or "reached"
