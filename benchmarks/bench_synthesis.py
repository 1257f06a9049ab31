"""Synthesis: error and time of the linear block, proved, against other ways to choose the parts.

Twenty random targets and four series of resistors; every method has the same values to choose from
and is judged by the same ten errors. Times are CPU seconds of this process, compiled code cached.
"""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import designer
from benchmarks import rivals
from benchmarks.bench_flow import commit, machine, table
from designer.base.arrays import Array, Index
from designer.base.errors import InputError
from designer.base.eseries import series_values
from designer.linear_network.kernel_linear import Rules, Values
from designer.linear_network.linear_block import PARTS, catalogue, rules_of
from designer.linear_network.linear_search import best
from designer.linear_network.linear_terms import ANY, Bounds, LinearBlock, Targets
from designer.model.circuit_table import CircuitSpec
from designer.model.model import Dimensionless
from designer.model.model_file import ModelFile
from designer.model.response_table import Response

TARGETS, SEED = 20, 2026
SERIES = {"E24": ("E24",), "E96": ("E96",), "E192": ("E192",), "E24 ∪ E96": ("E24", "E96")}
"""Resistors, 1 kΩ to 1 MΩ; capacitors are E12, 1 nF to 1 µF."""
BAND = (50.0, 1000.0)
"""Hz of ω = 1. No other condition holds."""
DRAWS, EVALUATIONS = 1000, 100_000
MILP_TARGETS, MILP_SECONDS = 2, 20.0
"""The one-hot program: how many targets, with E24 and E96 only, and its limit of wall time."""
WHOLE_TARGETS = 3
"""Targets whose finished design (dead zone too) is made as well."""
REPORT = Path(__file__).parent.parent / "reports" / "synthesis"
OURS = "ours, proved optimal"


@dataclass(frozen=True)
class Row:
    """error : largest of the ten coefficient errors. bound : proved from below, or None."""

    series: str
    target: int
    method: str
    error: float
    seconds: float
    bound: float | None = None


@dataclass(frozen=True)
class Whole:
    """A finished design: error with the dead zone, certificate and time, or what was missing."""

    series: str
    target: int
    error: float | None
    linear: float | None
    status: str
    seconds: float


def target(index: int) -> Dimensionless:
    """One of the random targets."""
    draw = np.random.default_rng([SEED, index]).uniform
    return Dimensionless(
        m=draw(0.2, 0.8), k=draw(0.2, 0.8), k0=draw(0.5, 0.98), c=draw(0.2, 0.8),
        zeta=draw(0.02, 0.3), f20=0.0, b=draw(0.05, 1.0),
    )  # fmt: skip


def timed(run: Callable[[], Index]) -> tuple[Index, float]:
    before = time.process_time()
    found = run()
    return found, time.process_time() - before


def ours(t: Targets, resistors: Array, capacitors: Array, bounds: Bounds) -> LinearBlock:
    answer = best(t, resistors, capacitors, np.ones(len(capacitors)), bounds)
    assert isinstance(answer, LinearBlock)
    return answer


def measure(series: str) -> list[Row]:
    """All methods on all targets of one series."""
    resistors = series_values(SERIES[series], 1e3, 1e6)
    capacitors = series_values(["E12"], 1e-9, 1e-6)
    values = catalogue(resistors, capacitors)
    bounds = Bounds(
        (1.0 / (2.0 * np.pi * BAND[1]), 1.0 / (2.0 * np.pi * BAND[0])),
        np.inf, np.inf, 0.0, np.ones(4),
    )  # fmt: skip
    rows = []
    for index in range(TARGETS):
        t = Targets.from_state_matrix(target(index).second_order().state_matrix())
        rules = rules_of(values, t, bounds, ANY)
        if index == 0:
            ours(t, resistors, capacitors, bounds)  # compile
        before = time.process_time()
        answer = ours(t, resistors, capacitors, bounds)
        seconds = time.process_time() - before
        rows.append(
            Row(series, index, OURS, _checked(answer, values, rules), seconds, answer.bound)
        )
        rows += _others(series, index, values, rules)
    return rows


def _checked(answer: LinearBlock, values: Values, rules: Rules) -> float:
    """Error of the answer as that of the others is computed."""
    parts = [
        int(rivals.nearest(values.r if i < 10 else values.c, np.log([answer.values[name]]))[0])
        for i, name in enumerate(PARTS)
    ]
    return float(rivals.errors_of(values, rules, np.array([parts]))[0])


def _others(series: str, index: int, values: Values, rules: Rules) -> list[Row]:
    def row(method: str, parts: Index, seconds: float, bound: float | None = None) -> Row:
        errors = rivals.errors_of(values, rules, np.atleast_2d(parts))
        return Row(series, index, method, float(errors.min()), seconds, bound)

    rows = []
    parts, seconds = timed(lambda: rivals.papers_way(values, rules))
    rows.append(row("the paper's way, rounded", parts, seconds))
    parts, seconds = timed(lambda: rivals.continuous_then_rounded(values, rules))
    rows.append(row("continuous, rounded", parts, seconds))
    parts, seconds = timed(lambda: rivals.continuous_then_rounded(values, rules, DRAWS))
    rows.append(row(f"continuous, best of {DRAWS} rounded", parts, seconds))
    start = parts[int(np.argmin(rivals.errors_of(values, rules, parts)))]
    parts, more = timed(lambda: rivals.annealed(values, rules, start, EVALUATIONS, SEED + index))
    rows.append(row("annealing", parts, seconds + more))
    if index < MILP_TARGETS and series in ("E24", "E96"):
        before = time.process_time()
        found, bound = rivals.one_hot(values, rules, MILP_SECONDS)
        seconds = time.process_time() - before
        if found is not None:
            rows.append(row("one-hot MILP", found, seconds, bound))
    return rows


def whole(series: str, index: int) -> Whole:
    """A finished design by the public function, side conditions off."""
    spec = CircuitSpec(
        resistors=SERIES[series], capacitors=("E12",), frequency=BAND, side_conditions=False
    )
    file = ModelFile("benchmark", target(index), None, None, (Response(omega=1.0),), spec, "")
    before = time.process_time()
    try:
        made = designer.synthesise(file).design
    except InputError as error:
        return Whole(series, index, None, None, str(error), time.process_time() - before)
    return Whole(
        series,
        index,
        made.errors.max_error,
        made.certificate.lower_bound,
        made.certificate.status,
        time.process_time() - before,
    )


def _methods(rows: list[Row]) -> list[str]:
    return list(dict.fromkeys(row.method for row in rows))


def _span(numbers: list[float]) -> str:
    return f"{median(numbers):.2g} ({min(numbers):.2g} to {max(numbers):.2g})"


def report(rows: list[Row], designs: list[Whole], seconds: float) -> str:
    """synthesis.md."""
    body = []
    for method in _methods(rows):
        for series in SERIES:
            own = [r for r in rows if (r.method, r.series) == (method, series)]
            if own:
                body.append(
                    [
                        method,
                        series,
                        str(len(own)),
                        _span([r.error for r in own]),
                        _span([r.seconds for r in own]),
                    ]
                )
    mine = [r for r in rows if r.method == OURS]
    proved = [r for r in mine if r.bound is not None and r.error <= r.bound + 1e-6]
    milp = [r for r in rows if r.method == "one-hot MILP"]
    finished = [
        [
            d.series,
            str(d.target),
            "-" if d.error is None else f"{d.error:.2g}",
            "-" if d.linear is None else f"{d.linear:.2g}",
            d.status,
            f"{d.seconds:.1f}",
        ]
        for d in designs
    ]
    lines = [
        "# Error and time of the synthesis",
        "",
        "Made by `python -m benchmarks` (`make bench`); the data are in `synthesis.json`.",
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}",
        f"- Took {seconds:.0f} s.",
        "",
        f"{TARGETS} random targets, seed {SEED}: m, k, c in 0.2 to 0.8, ζ in 0.02 to 0.3, k0 in",
        "0.5 to 0.98, b in 0.05 to 1, f20 = 0. Resistors 1 kΩ to 1 MΩ of the series named,",
        "capacitors E12, 1 nF to 1 µF, ω = 1 at 50 to 1000 Hz, no side condition. The error is",
        "the largest of the ten coefficient errors of the linear block (docs/definitions.md), all",
        "scales free. Given are median and range over the targets; times are CPU seconds, with the",
        "compiled code cached.",
        "",
        f"Ours proved {len(proved)} of {len(mine)} answers optimal; the slowest took "
        f"{max(r.seconds for r in mine):.2f} s.",
        "",
        *table(["method", "resistors", "targets", "error", "seconds"], body),
        "",
        "![Error against time](synthesis.svg)",
        "",
        "## What was compared",
        "",
        "- The paper's way: C1 = C3 = 10 nF, C2 = C4 = 100 nF, R1 = R7 and R4 are chosen for the",
        "  middle of the band, the rest follows from the matching conditions and is rounded.",
        "- Continuous, rounded: the exact real solution whose resistors lie closest to 30 kΩ for",
        f"  these capacitors, rounded; and the best of {DRAWS} at random scales and capacitors.",
        f"- Annealing: from the best of those, {EVALUATIONS:,} moves of one part.",
        "- One-hot MILP: one binary for each value in each place, the scales continuous; HiGHS",
        f"  with {MILP_SECONDS:.0f} s, one thread; first {MILP_TARGETS} targets, E24 and E96 only."
        " Largest lower",
        f"  bound that it reached: {max((r.bound or 0.0 for r in milp), default=0.0):.1g}.",
        "",
        "## Finished designs",
        "",
        f"The whole of `designer.synthesise` on the first {WHOLE_TARGETS} targets, side conditions "
        "off, for the response",
        "at ω = 1. The error counts the dead zone's slope and null too; the bound is that of the",
        "certificate. Seconds include finding the response.",
        "",
        *table(["resistors", "target", "error", "bound", "certificate", "seconds"], finished),
    ]
    return "\n".join(lines) + "\n"


COLOURS = ("#d62728", "#1f77b4", "#2ca02c", "#17becf", "#9467bd", "#7f7f7f")


def plot(rows: list[Row]) -> Figure:
    """Error against time, one panel a series: dots are targets, bars medians with their range."""
    figure = Figure(figsize=(12.0, 4.4), layout="constrained")
    axes = figure.subplots(1, len(SERIES), sharex=True, sharey=True)
    for ax, series in zip(axes, SERIES, strict=True):
        for colour, method in zip(COLOURS, _methods(rows), strict=True):
            own = [r for r in rows if (r.series, r.method) == (series, method)]
            if not own:
                continue
            x = np.maximum([r.seconds for r in own], 1e-4)
            y = np.array([r.error for r in own])
            mid = np.array([[np.median(x)], [np.median(y)]])
            ax.plot(x, y, ".", ms=4, color=colour, alpha=0.35)
            ax.errorbar(
                *mid,
                xerr=np.abs(mid[0] - [[x.min()], [x.max()]]),
                yerr=np.abs(mid[1] - [[y.min()], [y.max()]]),
                fmt="*" if method == OURS else "o",
                ms=12 if method == OURS else 6,
                color=colour,
                label=method,
            )
        ax.set(xscale="log", yscale="log", title=series, xlabel="CPU seconds")
        ax.grid(visible=True, which="major", lw=0.4, alpha=0.6)
        ax.set_axisbelow(True)
    axes[0].set_ylabel("largest coefficient error")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, fontsize=8, frameon=False)
    figure.suptitle(
        "Choosing the linear block's parts: 20 random targets, median and range "
        "(lower left is better)",
        fontsize=10,
    )
    return figure


def main() -> str:
    """Measure, print, write reports/synthesis; returns a line of results."""
    begin = time.perf_counter()
    rows = [row for series in SERIES for row in measure(series)]
    designs = [whole(series, i) for series in SERIES for i in range(WHOLE_TARGETS)]
    text = report(rows, designs, time.perf_counter() - begin)
    print(text)
    REPORT.mkdir(parents=True, exist_ok=True)
    (REPORT / "synthesis.md").write_text(text, encoding="utf-8")
    data = {
        "format": 1,
        "commit": commit(),
        "python": platform.python_version(),
        "targets": [asdict(target(i)) for i in range(TARGETS)],
        "rows": [asdict(row) for row in rows],
        "designs": [asdict(d) for d in designs],
    }
    (REPORT / "synthesis.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    figure = plot(rows)
    with mpl.rc_context({"svg.hashsalt": "synthesis", "svg.fonttype": "none"}):
        figure.savefig(REPORT / "synthesis.svg", metadata={"Date": None})
    figure.savefig(REPORT / "synthesis.png", dpi=130)
    shown = []
    for series in SERIES:
        own = [r for r in rows if (r.method, r.series) == (OURS, series)]
        shown.append(f"{series} {median(r.error for r in own):.1e}")
    return "medians " + ", ".join(shown)


if __name__ == "__main__":
    print(main())
