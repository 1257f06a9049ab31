"""The page of the report on the paper's circuit, and its pictures: Fig. 7 and Fig. 8 again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from designer.base.figure_style import (
    CIRCUIT_COLOUR,
    CONTACT,
    GRID,
    INK,
    MODEL_COLOUR,
    NGSPICE_COLOUR,
    new_figure,
    plain_numbers,
    shade_stops,
    styled,
)
from designer.base.page import (
    Block,
    Items,
    Page,
    PageSection,
    Picture,
    SmallPrint,
    bullets,
    table,
    table_of,
)
from designer.circuit.coefficients import EXACT
from designer.circuit.paper_values import MODEL
from designer.paper.circuit_clock import BASE, CLAIM, PERIODS
from designer.paper.circuits import TITLES

Piece = Mapping[str, Any]
CIRCUIT = "ngspice, ideal op-amps"
"""The paper's circuit as the claim is tested on it, at the settings that pass the gate."""
BASES = (BASE, "Runge-Kutta, plain Python", "Runge-Kutta, numba", "SciPy RK45")
NONE = "–"
KEPT, LOST, NO_RUN = "#cfe3d6", "#f2c9b4", "#eeeeee"
"""Fills of the cells of a grid."""


def circuit_page(pieces: Mapping[str, Piece], command: str) -> Page:
    """The page from the pieces by name, as ``reproduce_circuit`` keeps them."""
    circuits = [p for name, p in pieces.items() if name.startswith("circuit-")]
    offsets = [p for name, p in pieces.items() if name.startswith("offsets-")]
    clock, misprints = pieces["clock"], pieces["misprints"]["misprints"]
    head = [
        Markup(f"Made by `{command}`; the data are in `circuit.json`, its pieces in `cases/`."),
        "Four circuits of the paper's model: its values as printed, the same corrected "
        "(docs/errata.md), and this tool's designs with the paper's saturating stage and with the "
        "rectifier stage, both of E96 and E12 parts on the op-amps' full range. Each is started on "
        "the model's own orbit. Errors are the RMS difference of x₁ from the model's over a drive "
        "period, in per cent of its peak.",
    ]
    sections = [
        PageSection("In short", [_short(circuits, misprints, offsets, clock)]),
        PageSection("Fig. 7: the nonlinear stage", _dc(circuits)),
        PageSection("Fig. 8: phase portraits", _portraits(circuits)),
        PageSection("What each misprint would have cost", _misprints(misprints)),
        PageSection("What offsets do", _offsets(offsets)),
        PageSection("A third of the time?", _times(clock)),
    ]
    return Page("The paper's Section 5, measured", head, sections)


def _short(
    circuits: Sequence[Piece], misprints: Sequence[Piece], offsets: Sequence[Piece], clock: Piece
) -> Items:
    out = []
    for one in circuits:
        rows = one["responses"]
        kept = sum(r["kept"] for r in rows)
        spice = sum(r["ngspice_passed"] and r["ngspice"] == r["expected"] for r in rows)
        worst = max((r["error"] for r in rows if r["error"] is not None), default=None)
        out.append(
            f"{one['title']}: {kept} of {len(rows)} responses on the exact circuit, {spice} in "
            f"ngspice behind the gate; largest error {_percent(worst)}, largest coefficient error "
            f"{_percent(one['max_error'])}."
        )
    run = [m for m in misprints if m.get("responses")]
    lost = [m["where"] for m in run if not all(r["kept"] for r in m["responses"])]
    out.append(
        f"Of {len(run)} misprints that were put into the circuit alone, {len(lost)} change an "
        f"n-p-q: {'; '.join(lost) or 'none'}."
    )
    for one in offsets:
        rates = [_share(r["counted"]) for r in one["sizes"]["typical"] if r["there"]]
        if rates:
            out.append(
                f"{one['title']}, typical offsets: responses survive "
                f"{_percent(min(rates))} to {_percent(max(rates))} of the sign patterns."
            )
    for base in BASES:
        ratios = [f"{_ratio(row, base)} at p = {row['p']}" for row in clock["responses"]]
        out.append(f"{CIRCUIT} over {base}: {', '.join(ratios)} (claimed: {CLAIM:.2g}).")
    return bullets(out)


def _dc(circuits: Sequence[Piece]) -> list[Block]:
    columns: dict[str, Callable[[Piece], str]] = {
        "circuit": lambda one: one["title"],
        "threshold": lambda one: f"{1e3 * one['threshold']:.4g} mV",
        "slope in contact": lambda one: f"{one['dc']['slope_contact']:.5g}",
        "inside / in contact": lambda one: (
            f"{100.0 * one['dc']['slope_inside'] / one['dc']['slope_contact']:.3g} %"
        ),
        "ngspice less exact": lambda one: f"{one['dc']['difference']:.1e} V",
    }
    return [
        Picture(
            "DC curves of the nonlinear stages",
            "Upper row: output over v₁. Lower row: what differs from Eq. (20), of the output at "
            "twice the threshold.",
            "fig7.png",
        ),
        table_of(circuits, columns),
    ]


def _portraits(circuits: Sequence[Piece]) -> list[Block]:
    rows = [
        (f"{row[0]['omega']:g}", row[0]["expected"], *map(_compared, row))
        for row in zip(*(one["responses"] for one in circuits), strict=True)
    ]
    return [
        "The exact circuit's n-p-q and error, then ngspice's with the steps of a period that "
        "passed the gate.",
        table(("ω", "wanted", *(one["title"] for one in circuits)), rows),
        *(Picture(one["title"], file=f"fig8-{one['circuit']}.png") for one in circuits),
    ]


def _compared(r: Piece) -> str:
    gate = "" if r["ngspice_passed"] else ", gate not passed"
    return (
        f"{r['circuit']}, {_percent(r['error'])}; {r['ngspice'] or 'not run'}, "
        f"{_percent(r['ngspice_error'])} ({r['steps_a_period']}{gate})"
    )


def _misprints(misprints: Sequence[Piece]) -> list[Block]:
    rows = []
    for m in misprints:
        error, worst, shares = "", "", "reaches no part"
        if m["reaches"]:
            error = "a wrong sign" if m["max_error"] is None else _percent(m["max_error"])
            worst, shown = m["worst"], [r["kept"] for r in m["responses"]]
            shares = f"{sum(shown)} of {len(shown)}" if shown else "not run"
        rows.append((m["where"], m["printed"], m["right"], m["note"], error, worst, shares))
    columns = (
        "where", "printed", "must read", "read as", "coefficient error", "in", "responses kept",
    )  # fmt: skip
    return [
        "Each alone in the corrected circuit, at the ω of Fig. 8; under an n-p-q that is kept "
        "stands its error. The coefficient error is the largest |ln(realised/wanted)| at the best "
        "scales; the generator's amplitude and frequency do not enter it.",
        Picture("n-p-q with each misprint", file="misprints.png"),
        table(columns, rows),
    ]


def _offsets(offsets: Sequence[Piece]) -> list[Block]:
    sizes = [(one["circuit"], size) for one in offsets for size in one["sizes"].values()]
    most = max(sum(r["counted"].values()) for _, size in sizes for r in size)
    rows = [
        (
            TITLES[circuit],
            f"{1e3 * size[0]['size']:g} mV",
            *(", ".join(f"{name} {n}" for name, n in r["to"][:3]) or NONE for r in size),
        )
        for circuit, size in sizes
    ]
    return [
        "Every op-amp section at ± the same offset, all other parts exact, each response from the "
        "nominal circuit's orbit: the share of sign patterns that keep it, of "
        f"{most} each, drawn where there are more. 95 % Wilson intervals stand in circuit.json.",
        Picture("Share of sign patterns that keep each response", file="offsets.png"),
        "What the others show, the most frequent first:",
        table(("circuit", "offset", *(r["expected"] for r in sizes[0][1])), rows),
    ]


def _times(clock: Piece) -> list[Block]:
    columns: dict[str, Callable[[Piece], str]] = {
        "method": lambda m: m["name"],
        "setting": lambda m: m["setting"],
        "seconds": lambda m: _two_figures(m["seconds"]),
        f"over {BASE}": lambda m: _two_figures(m["ratio"]),
        "RMS error": lambda m: "exact" if m["error"] == 0.0 else _two_figures(m["error"]),
    }
    out: list[Block] = [
        "CPU time of a drive period on one core, all methods taking turns in "
        f"{clock['rounds']} rounds; ratios are taken within a round and their median is shown. "
        "The machine may have been busy: ratios hold better than times. Errors are against the "
        f"exact flow of the same equations after {PERIODS} drive periods; for the full op-amps "
        "that is what ideal ones leave out.",
        Picture("Error over time", file="times.png"),
    ]
    for row in clock["responses"]:
        out.append(SmallPrint(f"ω = {row['omega']:g}, 1-{row['p']}-{row['p']}:"))
        out.append(table_of(row["methods"], columns))
    return out


def _ratio(row: Piece, base: str) -> str:
    """Time of the circuit over another method's, to two figures and without an exponent; both were
    put over the same in each round."""
    ratio = {m["name"]: m["ratio"] for m in row["methods"]}
    if None in (ratio[CIRCUIT], ratio[base]):
        return "nan"
    return f"{float(f'{ratio[CIRCUIT] / ratio[base]:.2g}'):.10g}"


def _two_figures(value: float | None) -> str:
    return NONE if value is None else f"{value:.2g}"


def _share(counted: Piece) -> float:
    decided = sum(counted.values()) - counted["failed"]
    return float(counted["ok"] / decided) if decided else 0.0


def _percent(value: float | None) -> str:
    if value is None:
        return NONE
    return "0" if abs(value) <= EXACT else f"{100.0 * value:.3g} %"


def circuit_figures(pieces: Mapping[str, Piece]) -> dict[str, Figure]:
    """The pictures by name, without endings."""
    circuits = [p for name, p in pieces.items() if name.startswith("circuit-")]
    offset_pieces = [p for name, p in pieces.items() if name.startswith("offsets-")]
    return {
        "fig7": dc_curves(circuits),
        **{f"fig8-{p['circuit']}": portraits(pieces["model"], p) for p in circuits},
        "misprints": misprint_grid(pieces["misprints"]["misprints"]),
        "offsets": offset_grid(offset_pieces),
        "times": error_over_time(pieces["clock"]["responses"]),
    }


@styled
def dc_curves(circuits: Sequence[Piece]) -> Figure:
    """Fig. 7: output of each nonlinear stage over v1, in thresholds; below, what Eq. (20) leaves.

    Upper row: the exact circuit as a line, ngspice as dots, Eq. (20) dashed. Lower row: the curve
    inside the clearance, much enlarged.
    """
    figure = new_figure(2.5 * len(circuits), 4.6)
    grid = figure.subplots(2, len(circuits), squeeze=False, height_ratios=(2.0, 1.0))
    for column, one in enumerate(circuits):
        dc, threshold = one["dc"], one["threshold"]
        v1 = np.array(dc["v1"]) / threshold
        full = dc["slope_contact"] * threshold
        exact, spice = (np.array(dc[k]) / full for k in ("exact", "ngspice"))
        ideal = v1 - np.clip(v1, -1.0, 1.0)
        above, below = grid[0, column], grid[1, column]
        above.plot(v1, ideal, color=MODEL_COLOUR, lw=4.0)
        above.plot(v1, exact, color=CIRCUIT_COLOUR, lw=1.0)
        above.plot(v1[::8], spice[::8], ls="", marker="o", ms=3.0, color=NGSPICE_COLOUR)
        above.set_title(one["title"], loc="left")
        inside = np.abs(v1) < 1.05
        below.plot(v1[inside], 100.0 * (exact - ideal)[inside], color=CIRCUIT_COLOUR, lw=1.0)
        below.plot(
            v1[inside][::4],
            100.0 * (spice - ideal)[inside][::4],
            ls="",
            marker="o",
            ms=2.5,
            color=NGSPICE_COLOUR,
        )
        below.set_ylim(-1.25, 1.25)
        for axes in (above, below):
            axes.grid(True, color=GRID, lw=0.6)
        below.set_xlabel(f"v₁ / {1e3 * threshold:.4g} mV")
    grid[0, 0].set_ylabel("f / (slope · threshold)")
    grid[1, 0].set_ylabel("less Eq. (20) [%]")
    handles = [
        Line2D([], [], color=MODEL_COLOUR, lw=4.0, label="Eq. (20)"),
        Line2D([], [], color=CIRCUIT_COLOUR, lw=1.0, label="exact circuit"),
        Line2D([], [], ls="", marker="o", ms=3.0, color=NGSPICE_COLOUR, label="ngspice"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


@styled
def portraits(model: Piece, one: Piece) -> Figure:
    """Fig. 8: phase portraits of model, exact circuit and ngspice over each other."""
    pairs = list(zip(model["responses"], one["responses"], strict=True))
    columns = min(4, len(pairs))
    rows = -(-len(pairs) // columns)
    figure = new_figure(2.5 * columns, 2.45 * rows + 0.3)
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid[len(pairs) :]:
        axes.set_visible(False)
    for axes, (wanted, shown) in zip(grid, pairs, strict=False):
        _portrait(axes, wanted, shown)
    handles = [
        Line2D([], [], color=MODEL_COLOUR, lw=4.0, label="model"),
        Line2D([], [], color=CIRCUIT_COLOUR, lw=1.0, label="exact circuit"),
        Line2D([], [], color=NGSPICE_COLOUR, lw=1.0, ls=(0, (2, 2)), label="ngspice"),
        Patch(color=CONTACT, label="contact"),
    ]
    figure.suptitle(one["title"], fontsize=10, x=0.01, ha="left")
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _portrait(axes: Axes, wanted: Piece, shown: Piece) -> None:
    x, v = wanted["portrait"]
    reach = 1.15 * max(map(abs, x))
    shade_stops(axes, ((-1, -MODEL.b), (1, MODEL.b)), (-reach, reach))
    axes.plot(x, v, color=MODEL_COLOUR, lw=4.0, zorder=1)
    axes.plot(*shown["portrait"], color=CIRCUIT_COLOUR, lw=1.0, zorder=2)
    axes.plot(*shown["ngspice_portrait"], color=NGSPICE_COLOUR, lw=1.0, ls=(0, (2, 2)), zorder=3)
    axes.set_xlim(-reach, reach)
    axes.set_title(f"ω = {wanted['omega']:g}: {shown['ngspice'] or shown['circuit']}", loc="left")
    axes.set_xlabel("x₁")
    axes.set_ylabel("x₁′")


@styled
def misprint_grid(rows: Sequence[Piece]) -> Figure:
    """What each misprint alone makes of each response: n-p-q in a grid, waveform error by shade."""
    shown = [r for r in rows if r.get("responses")]
    heads = [f["expected"] for f in shown[0]["responses"]]
    figure = new_figure(1.9 + 0.85 * len(heads), 0.6 + 0.3 * len(shown))
    axes = figure.subplots()
    for i, row in enumerate(shown):
        for j, f in enumerate(row["responses"]):
            text = f["circuit"]
            if f["kept"]:
                text += f"\n{100.0 * f['error']:.2g} %"
            _cell(axes, j, i, text, KEPT if f["kept"] else LOST)
    _table(axes, heads, [r["where"] for r in shown])
    return figure


@styled
def offset_grid(pieces: Sequence[Piece]) -> Figure:
    """Share of sign patterns on which each response survives, typical and largest offset."""
    kinds = list(pieces[0]["sizes"])
    heads = [r["expected"] for r in pieces[0]["sizes"][kinds[0]]]
    names, rows = [], []
    for one in pieces:
        for kind in kinds:
            size = one["sizes"][kind]
            names.append(f"{TITLES[one['circuit']]}, ± {1e3 * size[0]['size']:g} mV")
            rows.append(size)
    figure = new_figure(2.6 + 0.75 * len(heads), 0.6 + 0.3 * len(rows))
    axes = figure.subplots()
    for i, row in enumerate(rows):
        for j, r in enumerate(row):
            counted = r["counted"]
            decided = sum(counted.values()) - counted["failed"]
            share = counted["ok"] / decided if decided else float("nan")
            fill = NO_RUN if not r["there"] else _between(LOST, KEPT, share)
            text = f"{100.0 * share:.3g} %" if r["there"] else "not there"
            text += f"\n{counted['failed']} failed" if r["there"] and counted["failed"] else ""
            _cell(axes, j, i, text, fill)
    _table(axes, heads, names)
    return figure


@styled
def error_over_time(rows: Sequence[Piece]) -> Figure:
    """Error against CPU time of a drive period, one panel for each response."""
    figure = new_figure(max(3.3 * len(rows), 7.5), 4.2)
    grid = figure.subplots(1, len(rows), sharey=True, squeeze=False)[0]
    floor = 1e-7
    for axes, row in zip(grid, rows, strict=True):
        for number, m in enumerate(row["methods"]):
            error = m["error"]
            y = floor if error is None or error < floor else error
            axes.plot(m["seconds"], y, ls="", marker=_MARKS[number % len(_MARKS)], ms=6,
                      color=_colour(m["name"]), label=m["name"])  # fmt: skip
        base = next(m["seconds"] for m in row["methods"] if m["name"] == BASE)
        axes.axvspan(base / 3.0, base, color=CONTACT, lw=0, zorder=0)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(0.5 * floor, 1.0)
        plain_numbers(axes.xaxis, axes.yaxis)
        axes.grid(True, color=GRID, lw=0.6)
        axes.set_title(f"ω = {row['omega']:g}, 1-{row['p']}-{row['p']}", loc="left")
        axes.set_xlabel("CPU seconds of a drive period")
    grid[0].set_ylabel("RMS error of x₁ / peak (exact: at the bottom)")
    handles, labels = grid[0].get_legend_handles_labels()
    handles.append(Patch(color=CONTACT))
    labels.append("a third to all of Runge-Kutta in NumPy")
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


_MARKS = "osD^v*PXh<>"


def _colour(name: str) -> str:
    if name.startswith("ngspice"):
        return NGSPICE_COLOUR
    return CIRCUIT_COLOUR if name.startswith("exact") else "#0072b2"


def _cell(axes: Axes, column: int, row: int, text: str, fill: str) -> None:
    axes.fill(
        [column - 0.5, column + 0.5, column + 0.5, column - 0.5],
        [row - 0.5, row - 0.5, row + 0.5, row + 0.5],
        color=fill,
        lw=0,
    )
    axes.text(column, row, text, ha="center", va="center", fontsize=6.5, color=INK)


def _table(axes: Axes, heads: Sequence[str], names: Sequence[str]) -> None:
    axes.set_xlim(-0.5, len(heads) - 0.5)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xticks(range(len(heads)), list(heads))
    axes.set_yticks(range(len(names)), list(names))
    axes.tick_params(length=0, top=False, labeltop=True, bottom=False, labelbottom=False)
    axes.tick_params(axis="both", colors=INK)
    for i in range(1, len(names)):
        axes.axhline(i - 0.5, color="white", lw=1.5)
    for j in range(1, len(heads)):
        axes.axvline(j - 0.5, color="white", lw=1.5)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _between(low: str, high: str, share: float) -> str:
    if np.isnan(share):
        return NO_RUN
    ends = [np.array(to_rgb(colour)) for colour in (low, high)]
    return to_hex(ends[0] + share * (ends[1] - ends[0]))
