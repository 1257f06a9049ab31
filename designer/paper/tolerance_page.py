"""The pages of the tolerance report: a sheet of heat maps, and the text beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from designer.base.figure_style import INK, MUTED, new_figure, number_cells, styled
from designer.base.page import Block, Page, PageSection, Picture, bullets, table
from designer.base.proportion import wilson
from designer.paper.circuits import OMEGA
from designer.paper.tolerance_cases import REFERENCE, TITLES, YieldRow
from designer.yields.setting_search import MOST_TRIES

SHOWN = ("as built", "tuned", "reached")
"""Kinds of yield in the sheet."""
GROUPS_SHOWN = 3
RESPONSES = [f"1-{p}-{p}" for p in OMEGA]


@styled
def yield_sheet(rows: Sequence[YieldRow]) -> Figure:
    """Yield in per cent: a column of panels for each circuit, a row for each kind of yield."""
    circuits = [c for c in TITLES if any(r.circuit == c for r in rows)]
    spreads = _spreads(rows)
    figure = new_figure(1.3 + 3.1 * len(circuits), 0.7 + 3 * (0.19 * len(spreads) + 0.55))
    grid = figure.subplots(3, len(circuits), squeeze=False, sharex=True, sharey=True)
    image = None
    for i, kind in enumerate(SHOWN):
        for j, circuit in enumerate(circuits):
            chosen = [r for r in rows if (r.circuit, r.kind) == (circuit, kind)]
            image = _panel(grid[i, j], chosen, spreads)
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
    axes: Axes, rows: Sequence[YieldRow], spreads: Sequence[tuple[float, float, bool]]
) -> AxesImage:
    values = np.full((len(spreads), len(OMEGA)), np.nan)
    for row in rows:
        if row.there:
            place = spreads.index(row.spread), RESPONSES.index(row.expect)
            values[place] = 100.0 * row.counted.rate
    image = axes.imshow(values, cmap="cividis", vmin=0.0, vmax=100.0, aspect="auto")
    axes.set_facecolor("#d9d9d9")
    number_cells(axes, values, size=6)
    for i, j in np.argwhere(~np.isfinite(values)):
        axes.text(j, i, "×", ha="center", va="center", color=MUTED, size=6)
    names = [f"{100 * r:g} / {100 * c:g} %, {'on' if on else 'off'}" for r, c, on in spreads]
    axes.set_yticks(range(len(spreads)), names, size=6.5, color=INK)
    axes.set_xticks(range(len(OMEGA)), [str(p) for p in OMEGA], color=INK)
    axes.tick_params(length=0, labelbottom=True)
    return image


def tolerance_page(
    rows: Sequence[YieldRow], attribution: Mapping[str, Any], *, samples: int, short: int, seed: int
) -> Page:
    """``README.md``. attribution : of the reference cases, by circuit, as JSON has it. short :
    boards that were tuned and powered up."""
    head: list[Block] = [
        Markup(
            f"Made by `designer reproduce tolerance --samples {samples} --seed {seed}`. The data "
            "are in `tolerance.json` and `tolerance.parquet`, case by case in `cases/`."
        ),
        Markup(
            "Three circuits for the paper's model (b = 0.25): its values as printed, driven as "
            "printed; the same corrected (R50, R204, amplitude, frequency; see docs/errata.md); "
            "and a design of this tool with the rectifier stage, whose voltages use the op-amps' "
            "range. All with the TL074C, under the spread `bench-1` (docs/definitions.md) with "
            "the grades named, and with input offsets as in `bench-1` or without."
        ),
        f"Per cent of boards that show each 1-p-p: as built ({samples} boards), tuned within the "
        f"bands (a setting that works was found among at most {MOST_TRIES} tries: a lower bound), "
        f"tuned by the bench procedure, and reached by the start recipe ({short} boards "
        "each). × stands where the nominal circuit does not show the response. Intervals (95 %, "
        f"Wilson) are in the data; at {samples} boards they are at most ± {_half_width(samples)} "
        f"points wide, at {short} boards ± {_half_width(short)}.",
        Picture("yields", file="yields.png"),
    ]
    sections = []
    for circuit, title in TITLES.items():
        mine = [r for r in rows if r.circuit == circuit]
        if mine:
            blocks = [_table(mine), *_limits(attribution.get(circuit), mine)]
            sections.append(PageSection(title.capitalize(), blocks))
    return Page("Tolerance of the paper's circuit", head, sections)


def _table(rows: Sequence[YieldRow]) -> Block:
    known = {(r.spread, r.kind, r.expect): r for r in rows}
    lines = [
        (
            f"{100 * spread[0]:g} %",
            f"{100 * spread[1]:g} %",
            "on" if spread[2] else "off",
            kind,
            *(_cell(known.get((spread, kind, expect))) for expect in RESPONSES),
        )
        for spread in _spreads(rows)
        for kind in dict.fromkeys(r.kind for r in rows)
    ]
    return table(("R", "C", "offsets", "yield", *RESPONSES), lines)


def _cell(row: YieldRow | None) -> str:
    if row is None or not row.there:
        return "×"
    rate = row.counted.rate
    text = f"{100 * rate:.0f}" if np.isfinite(rate) else "–"
    return text + (f" ({row.failed} failed)" if row.failed else "")


def _limits(attribution: Mapping[str, Any] | None, rows: Sequence[YieldRow]) -> list[Block]:
    """What limits each response in the reference case."""
    if attribution is None:
        return []
    asked = [e for e in RESPONSES if any(r.expect == e and r.there for r in rows)]
    lines = []
    for attributed in attribution["responses"]:
        p = attributed["prediction"]
        decided = p["ok"] + p["lost"]
        groups = [s for s in attributed["subjects"] if s["kind"] == "group"][:GROUPS_SHOWN]
        avoided = ", ".join(f"{s['name']} {s['avoided']} of {s['replayed']}" for s in groups)
        line = f"**{asked[attributed['question']]}**: {attributed['limited_by']}."
        line += f" Losses avoided if exact: {avoided}." if avoided else ""
        line += f" The margin foretells {p['right']} of {decided} verdicts." if decided else ""
        lines.append(Markup(line))
    r, c, _ = REFERENCE
    note = f"What limits it, with {100 * r:g} % resistors, {100 * c:g} % capacitors and offsets:"
    return [note, bullets(lines)]


def _half_width(samples: int) -> str:
    """The half width of Wilson's interval at one half, in points."""
    low, high = wilson(0.5 * samples, samples)
    return f"{50.0 * (high - low):.1f}"


def _spreads(rows: Sequence[YieldRow]) -> list[tuple[float, float, bool]]:
    return sorted({r.spread for r in rows}, key=lambda s: (not s[2], -s[0], -s[1]))
