"""The pages of the tolerance report: a sheet of heat maps, and the text beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from designer.base.figure_style import INK, MUTED, new_figure, styled
from designer.base.proportion import wilson
from designer.paper.tolerance_cases import OMEGA, REFERENCE, TITLES
from designer.yields.setting_search import MOST_TRIES

if TYPE_CHECKING:
    from designer.paper.tolerance_rows import YieldRow

_KINDS = ("as built", "tuned", "reached")
GROUPS_SHOWN = 3


@styled
def yield_sheet(rows: Sequence[YieldRow]) -> Figure:
    """Yield in per cent: a column of panels for each circuit, a row for each kind of yield."""
    circuits = [c for c in TITLES if any(r.circuit == c for r in rows)]
    cases = _cases(rows)
    figure = new_figure(1.3 + 3.1 * len(circuits), 0.7 + 3 * (0.19 * len(cases) + 0.55))
    grid = figure.subplots(3, len(circuits), squeeze=False, sharex=True, sharey=True)
    image = None
    for i, kind in enumerate(_KINDS):
        for j, circuit in enumerate(circuits):
            chosen = {
                (_case_of(r), r.expect): r for r in rows if r.circuit == circuit and r.kind == kind
            }
            image = _panel(grid[i, j], chosen, cases)
            if i == 0:
                grid[i, j].set_title(TITLES[circuit], color=INK, size=9)
        grid[i, 0].set_ylabel(kind, color=INK, size=9)
    if image is not None:
        bar = figure.colorbar(image, ax=grid, pad=0.01, fraction=0.02)
        bar.set_label("yield [%]; ×: the nominal circuit does not show it")
    figure.supxlabel(
        "p of the response 1-p-p; rows: grade of resistors / capacitors, offsets on or off",
        size=8.5,
    )
    return figure


def _panel(
    axes: Axes, chosen: Mapping[tuple[tuple[float, float, bool], str], YieldRow],
    cases: Sequence[tuple[float, float, bool]],
) -> Any:  # fmt: skip
    values = np.full((len(cases), len(OMEGA)), np.nan)
    for i, case in enumerate(cases):
        for j, p in enumerate(OMEGA):
            row = chosen.get((case, f"1-{p}-{p}"))
            if row is not None and row.there:
                values[i, j] = 100.0 * row.counted.rate
    image = axes.imshow(values, cmap="cividis", vmin=0.0, vmax=100.0, aspect="auto")
    axes.set_facecolor("#d9d9d9")
    for i, j in np.ndindex(*values.shape):
        if np.isfinite(values[i, j]):
            ink = "white" if values[i, j] < 55.0 else INK
            axes.text(j, i, f"{values[i, j]:.0f}", ha="center", va="center", color=ink, size=6)
        else:
            axes.text(j, i, "×", ha="center", va="center", color=MUTED, size=6)
    axes.set_yticks(range(len(cases)), [_words(c) for c in cases], size=6.5, color=INK)
    axes.set_xticks(range(len(OMEGA)), [str(p) for p in OMEGA], color=INK)
    axes.tick_params(length=0, labelbottom=True)
    return image


def readme(
    rows: Sequence[YieldRow], document: Mapping[str, Any], *, samples: int, seed: int
) -> str:
    """``README.md`` of the report."""
    short = document["provenance"]["settings"]["short"]
    out = [
        "# Tolerance of the paper's circuit",
        "",
        f"Made by `designer reproduce tolerance --samples {samples} --seed {seed}`. The data are "
        "in `tolerance.json` and `tolerance.parquet`, case by case in `cases/`.",
        "",
        "Three circuits for the paper's model (b = 0.25): its values as printed, driven as "
        "printed; the same corrected (R50, R204, amplitude, frequency; see docs/errata.md); and "
        "a design of this tool with the rectifier stage, whose voltages use the op-amps' range. "
        "All with the TL074C, under the spread `bench-1` (docs/definitions.md) with the grades "
        "named, and with input offsets as in `bench-1` or without.",
        "",
        f"Per cent of boards that show each 1-p-p: as built ({samples} boards), tuned within the "
        f"bands (a setting that works was found among at most {MOST_TRIES} tries: a lower bound), "
        f"tuned by the bench procedure, and reached by the start recipe ({short} boards "
        "each). × stands where the nominal circuit does not show the response. Intervals (95 %, "
        "Wilson) are in the data; "
        + (
            f"at {samples} boards they are at most ± {50.0 * _widest(samples):.1f} points wide, "
            f"at {short} boards ± {50.0 * _widest(short):.1f}."
        ),
        "",
        "![yields](yields.png)",
        "",
    ]
    for circuit in TITLES:
        mine = [r for r in rows if r.circuit == circuit]
        if mine:
            out += [f"## {TITLES[circuit].capitalize()}", "", *_table(mine), ""]
            out += _blame_lines(document["blame"].get(circuit), mine)
    return "\n".join(out).rstrip() + "\n"


def _table(rows: Sequence[YieldRow]) -> list[str]:
    columns = ["R", "C", "offsets", "yield", *(f"1-{p}-{p}" for p in OMEGA)]
    out = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    kinds = list(dict.fromkeys(r.kind for r in rows))
    for case in _cases(rows):
        for kind in kinds:
            known = {r.expect: r for r in rows if _case_of(r) == case and r.kind == kind}
            cells = [_cell(known.get(f"1-{p}-{p}")) for p in OMEGA]
            resistor, capacitor, offsets = case
            head = [f"{100 * resistor:g} %", f"{100 * capacitor:g} %", "on" if offsets else "off"]
            out.append("| " + " | ".join([*head, kind, *cells]) + " |")
    return out


def _cell(row: YieldRow | None) -> str:
    if row is None or not row.there:
        return "×"
    said = f"{100 * row.counted.rate:.0f}" if np.isfinite(row.counted.rate) else "–"
    return said + (f" ({row.failed} failed)" if row.failed else "")


def _blame_lines(found: Mapping[str, Any] | None, rows: Sequence[YieldRow]) -> list[str]:
    if found is None:
        return []
    asked = [f"1-{p}-{p}" for p in OMEGA if any(r.expect == f"1-{p}-{p}" and r.there for r in rows)]
    r, c, _ = REFERENCE
    out = [
        f"What limits it, with {100 * r:g} % resistors, {100 * c:g} % capacitors and offsets:",
        "",
    ]
    for blamed in found["responses"]:
        p = blamed["prediction"]
        decided = p["ok"] + p["lost"]
        groups = [s for s in blamed["subjects"] if s["kind"] == "group"][:GROUPS_SHOWN]
        said = ", ".join(f"{s['name']} {s['avoided']} of {s['replayed']}" for s in groups)
        line = f"- **{asked[blamed['question']]}**: {blamed['limited_by']}."
        line += f" Losses avoided if exact: {said}." if said else ""
        line += f" The margin foretells {p['right']} of {decided} verdicts." if decided else ""
        out.append(line)
    return [*out, ""]


def _widest(samples: int) -> float:
    """Width of Wilson's interval at one half."""
    low, high = wilson(0.5 * samples, samples)
    return high - low


def _cases(rows: Sequence[YieldRow]) -> list[tuple[float, float, bool]]:
    return sorted({_case_of(r) for r in rows}, key=lambda c: (not c[2], -c[0], -c[1]))


def _case_of(row: YieldRow) -> tuple[float, float, bool]:
    return (row.resistor, row.capacitor, row.offsets)


def _words(case: tuple[float, float, bool]) -> str:
    return f"{100 * case[0]:g} / {100 * case[1]:g} %, {'on' if case[2] else 'off'}"
