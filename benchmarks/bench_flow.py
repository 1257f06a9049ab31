"""Work and precision of the flow: ours against general-purpose integrators, the paper's case.

Every method carries the same state, on the 1-p-p response, over 20 drive periods; its error is the
largest difference of a state from 40-digit arithmetic. Speed is the best of several rounds in
which all methods of one frequency take turns, by this process's CPU time, on one core.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from benchmarks.chain_race import Race, races
from benchmarks.figures import Figures
from benchmarks.references import Heyoka, Problem, Stops, rk4, scipy_with_events, truth
from designer.base.arrays import Array
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.model import Dimensionless

FREQUENCIES = {1.55: 1, 0.54: 3, 0.215: 8}
"""Drive frequency and p of its 1-p-p response."""
PERIODS = 20
ROUNDS = 7
LONGEST = 0.25
"""Seconds of one run: a method that is slower runs once only."""
REPORT = Path(__file__).parent.parent / "reports" / "speed"


@dataclass(frozen=True)
class Method:
    """run : (start, periods) → last state. family : a line of the plot. periods : a timed run's."""

    family: str
    setting: str
    run: Callable[[Array, int], Array]
    periods: int = PERIODS


@dataclass(frozen=True)
class Row:
    """error : of the state after 20 periods. speed : drive periods per second of CPU time."""

    omega: float
    family: str
    setting: str
    error: float
    speed: float


def methods(omega: float) -> list[Method]:
    """All competitors at one frequency, set up and ready to run."""
    problem = Problem(omega)
    p = problem
    model = Dimensionless(p.m, p.k, p.k0, p.c, p.zeta, p.f20, p.b)
    fast = Flow(model.second_order().piecewise_linear(), Drive(omega))
    general = Flow(fast.system, fast.drive, fast=False)

    def ours(flow: Flow, tangents: int) -> Callable[[Array, int], Array]:
        def run(x: Array, periods: int) -> Array:
            vectors = np.eye(4)[:, :tangents] if tangents else None
            return np.asarray(flow.run(x, periods, tangent=vectors).strobes[-1])

        return run

    def scipy(name: str, tolerance: float) -> Method:
        return Method(
            f"SciPy {name}, events",
            f"{tolerance:.0e}",
            lambda x, n: scipy_with_events(problem, x, n, name, tolerance),
        )

    def steps(count: int, label: str) -> Method:
        return Method(
            "numba RK4", label, lambda x, n: rk4(problem, x, n, count), periods=10 * PERIODS
        )

    out = [
        Method("ours, fast path", "", ours(fast, 0), 2000),
        Method("ours, with one tangent", "", ours(fast, 1), 500),
        Method("ours, with monodromy", "", ours(fast, 4), 500),
        Method("ours, general kernel", "", ours(general, 0), 500),
        steps(400, "400 a period"),
        steps(round(problem.period / 0.005), "Δt = 0.005"),
        scipy("RK45", 1e-6),
        scipy("RK45", 1e-9),
        scipy("RK45", 1e-12),
        scipy("LSODA", 1e-6),
        scipy("LSODA", 1e-9),
        scipy("LSODA", 1e-12),
        scipy("DOP853", 1e-6),
        scipy("DOP853", 1e-9),
        scipy("DOP853", 1e-13),
    ]
    with contextlib.suppress(ImportError):
        A, B, _ = p.matrices(float, 0)
        stops = [Stops(0, p.k0 / (1.0 - p.k0), p.b)]
        out += [
            Method("heyoka, events", f"{tol:.0e}", Heyoka(A, B, omega, stops, tol), 10 * PERIODS)
            for tol in (1e-6, 1e-9, 1e-12, 2.3e-16)
        ]
    return out


def measure(omega: float) -> list[Row]:
    """Error and best speed of each method; the rounds are interleaved."""
    entries = methods(omega)
    start = entries[0].run(np.zeros(4), 500)
    exact = truth(Problem(omega), start, PERIODS)
    assert exact is not None
    errors, best = [], [np.inf] * len(entries)
    for i, method in enumerate(entries):
        method.run(start, 1)  # compile
        before = time.process_time()
        errors.append(float(np.abs(method.run(start, PERIODS) - exact.strobes[-1]).max()))
        best[i] = (time.process_time() - before) / PERIODS
    for _ in range(ROUNDS):
        for i, method in enumerate(entries):
            if best[i] * method.periods > LONGEST:
                continue
            before = time.process_time()
            method.run(start, method.periods)
            best[i] = min(best[i], (time.process_time() - before) / method.periods)
    return [
        Row(omega, m.family, m.setting, max(e, 1e-17), 1.0 / b)
        for m, e, b in zip(entries, errors, best, strict=True)
    ]


def cold_compilation() -> tuple[float, float]:
    """Seconds to the first answer of both engines with an empty cache, and with a full one."""
    code = (
        "import numpy as np, time\n"
        "from designer.dynamics.flow import Flow\n"
        "from designer.model.model import Dimensionless\n"
        "from designer.dynamics.piecewise_linear import Drive\n"
        "model = Dimensionless(0.5, 0.5, 0.95, 0.5, 0.1, 0.0, 0.25)\n"
        "system = model.second_order().piecewise_linear()\n"
        "start = time.perf_counter()\n"
        "Flow(system, Drive(1.55)).run(np.zeros(4), 2)\n"
        "Flow(system, Drive(1.55), fast=False).run(np.zeros(4), 2)\n"
        "print(time.perf_counter() - start)\n"
    )
    seconds = []
    with tempfile.TemporaryDirectory() as cache:
        for _ in range(2):
            done = subprocess.run(
                [sys.executable, "-c", code],
                check=True,
                capture_output=True,
                text=True,
                cwd=Path(__file__).parent.parent,
                env={**os.environ, "NUMBA_CACHE_DIR": cache},
            )
            seconds.append(float(done.stdout))
    return seconds[0], seconds[1]


def machine() -> str:
    """Processor, cores, and versions: nothing that names the machine."""
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    versions = [f"Python {platform.python_version()}"]
    for package in ("numpy", "scipy", "numba", "heyoka"):
        try:
            versions.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            versions.append(f"{package} not installed")
    return f"{name}, {os.cpu_count()} cores, {platform.system()}; {', '.join(versions)}"


def commit() -> str:
    """Of the source that was measured; says so where files differ from it."""

    def git(*words: str) -> str:
        done = subprocess.run(
            ["git", *words], capture_output=True, text=True, cwd=Path(__file__).parent, check=False
        )
        return done.stdout.strip()

    head = git("rev-parse", "HEAD") or "unknown"
    changed = git("status", "--porcelain", "--", "../designer", "../benchmarks")
    return f"{head}, with uncommitted changes" if changed else head


def speed_of(rows: list[Row], omega: float, family: str, setting: str = "") -> float | None:
    """Periods per second of one row, or None."""
    for row in rows:
        if (row.omega, row.family) == (omega, family) and row.setting == setting:
            return row.speed
    return None


RIVALS = (
    ("heyoka, events", "1e-12", 10.0),
    ("numba RK4", "Δt = 0.005", 10.0),
    ("SciPy RK45, events", "1e-09", 5000.0),
)
"""Whom the fast path is compared with, and the goal; heyoka at the fastest below 1e-13."""


def ratios(rows: list[Row]) -> list[tuple[str, float, list[float | None]]]:
    """(rival, goal, our fast path's speed over it at each frequency)."""
    out = []
    for family, setting, goal in RIVALS:
        values: list[float | None] = []
        for omega in FREQUENCIES:
            theirs, mine = (
                speed_of(rows, omega, family, setting),
                speed_of(rows, omega, "ours, fast path"),
            )
            values.append(mine / theirs if theirs and mine else None)
        out.append((f"{family} {setting}", goal, values))
    return out


def table(header: list[str], body: list[list[str]]) -> list[str]:
    """Lines of a Markdown table whose columns line up in plain text too."""
    widths = [max(len(r[i]) for r in [header, *body]) for i in range(len(header))]

    def line(cells: list[str]) -> str:
        return "| " + " | ".join(c.ljust(w) for c, w in zip(cells, widths, strict=True)) + " |"

    return [line(header), "|" + "|".join("-" * (w + 2) for w in widths) + "|", *map(line, body)]


def report(rows: list[Row], chains: list[Race], cold: tuple[float, float], seconds: float) -> str:
    """flow.md."""
    columns = [f"ω = {omega} (1-{p}-{p})" for omega, p in FREQUENCIES.items()]
    names = list(dict.fromkeys((row.family, row.setting) for row in rows))
    body = []
    for family, setting in names:
        cells = [f"{family} {setting}".strip()]
        for omega in FREQUENCIES:
            row = next(
                r for r in rows if (r.omega, r.family, r.setting) == (omega, family, setting)
            )
            cells.append(f"{row.speed:,.0f}/s, {row.error:.0e}")
        body.append(cells)
    compared = [
        [
            name,
            f"{goal:g}",
            *(
                "not installed" if v is None else f"{v:,.1f}" if v < 100 else f"{v:,.0f}"
                for v in values
            ),
        ]
        for name, goal, values in ratios(rows)
    ]
    error = max(row.error for row in rows if row.family == "ours, fast path")
    lines = [
        "# Speed and accuracy of the flow",
        "",
        "Made by `python -m benchmarks` (`make bench`).",
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}",
        f"- Took {seconds:.0f} s.",
        "",
        "The paper's case (k0 = 0.95, ζ = 0.1, b = 0.25, c = k = m = 0.5, f20 = 0). Each method",
        f"carries the same state, on the response named, over {PERIODS} drive periods. Given are",
        "drive periods per second on one core (CPU time, best of the rounds in which all methods",
        "take turns) and the largest error of a state against 40-digit arithmetic.",
        "",
        *table(["method, tolerance or step", *columns], body),
        "",
        "![Error against speed](flow.svg)",
        "",
        "## Ratios",
        "",
        "Periods per second of our fast path over another's:",
        "",
        *table(["other", "goal", *columns], compared),
        "",
        f"The fast path errs by at most {error:.0e} here.",
        "",
        *chain_section(chains),
        "## What was compared",
        "",
        "- Ours is timed over 2000 periods a call (500 for the general kernel and with tangents);",
        "  a call costs some 20 µs beside them, and tables for a new system about a millisecond.",
        "- heyoka is a Taylor integrator compiled for the equations (PyPI package `heyoka`, or",
        "  conda-forge). One integrator with two terminal events, whose callbacks in Python switch",
        "  the stop's stiffness. Compilation is not counted.",
        "- Its batch mode, and Runge-Kutta over an ensemble: [many boards](ensembles.md).",
        "- numba RK4 has equal steps and does not look for the stops. Δt = 0.005 is the paper's.",
        "- SciPy restarts at each terminal event; the right-hand side is compiled.",
        "",
        "## First use",
        "",
        f"Both engines' first answer takes {cold[0]:.1f} s with no compiled code cached, and",
        f"{cold[1]:.2f} s in a new process afterwards.",
    ]
    return "\n".join(lines) + "\n"


def chain_section(chains: list[Race]) -> list[str]:
    """The race on chains of masses; nothing where heyoka is not installed."""
    if not chains:
        return []
    body = [
        [
            f"{r.masses}, {r.clearances}",
            f"{r.omega:g}",
            f"{r.impacts:g}",
            f"{r.ours:,.0f}/s",
            f"{r.heyoka:,.0f}/s",
            f"{r.ratio:.1f}",
            f"{r.difference:.0e}",
        ]
        for r in chains
    ]
    header = ["masses, clearances", "ω", "impacts a period", "ours", "heyoka 1e-12", "ratio"]
    return [
        "## Chains of masses",
        "",
        "Equal masses in a row, a spring and a damper between neighbours and from the last to",
        "ground, the first one driven; stops at the first and the last mass, or two pairs at one",
        "mass. Our fast path and heyoka take turns; the ratio is their median (goal: 8).",
        "The last column is the largest difference of a state after three drive periods.",
        "",
        *table([*header, "difference"], body),
        "",
    ]


STYLES = {
    "ours, fast path": ("#d62728", "*", 13),
    "ours, with monodromy": ("#000000", "x", 6),
    "ours, general kernel": ("#8c564b", "P", 8),
    "heyoka, events": ("#9467bd", "D", 6),
    "numba RK4": ("#1f77b4", "s", 6),
    "SciPy RK45, events": ("#7f7f7f", "o", 6),
    "SciPy LSODA, events": ("#2ca02c", "^", 6),
    "SciPy DOP853, events": ("#17becf", "v", 6),
}


def plot(rows: list[Row]) -> Figure:
    """Error against speed, one panel for each frequency: good is at the lower right.

    A single tangent is left out: it would hide behind the monodromy matrix.
    """
    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    axes = figure.subplots(1, len(FREQUENCIES), sharex=True, sharey=True)
    for ax, (omega, p) in zip(axes, FREQUENCIES.items(), strict=True):
        for family, (colour, marker, size) in STYLES.items():
            points = [(r.speed, r.error) for r in rows if (r.omega, r.family) == (omega, family)]
            if points:
                x, y = zip(*points, strict=True)
                ax.loglog(x, y, marker=marker, ms=size, lw=1.0, color=colour, label=family)
        ax.set_title(f"ω = {omega}, response 1-{p}-{p}", fontsize=10)
        ax.set_xlabel("drive periods per second, one core")
        ax.grid(visible=True, which="major", lw=0.4, alpha=0.6)
        ax.set_axisbelow(True)
    axes[0].set_ylabel(f"error after {PERIODS} periods")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    return figure


def main() -> Figures:
    """Measure, print, write reports/speed/flow.md and its plot; returns the ratios."""
    begin = time.perf_counter()
    rows = [row for omega in FREQUENCIES for row in measure(omega)]
    chains = races()
    cold = cold_compilation()
    text = report(rows, chains, cold, time.perf_counter() - begin)
    print(text)
    REPORT.mkdir(parents=True, exist_ok=True)
    (REPORT / "flow.md").write_text(text, encoding="utf-8")
    figure = plot(rows)
    with mpl.rc_context({"svg.hashsalt": "flow", "svg.fonttype": "none"}):
        figure.savefig(REPORT / "flow.svg", metadata={"Date": None})
    figure.savefig(REPORT / "flow.png", dpi=130)
    parts, found = [], dict[str, float]()
    for name, _, values in ratios(rows):
        pairs = zip(FREQUENCIES, values, strict=True)
        found |= {f"ω = {omega}, over {name}": v for omega, v in pairs if v is not None}
        shown = "/".join("-" if v is None else f"{v:.0f}" for v in values)
        parts.append(f"{shown} x {name}")
    parts += [f"{min(r.ratio for r in chains):.1f} x heyoka on chains"] if chains else []
    found |= {f"chain of {r.masses}, {r.clearances}, ω = {r.omega}": r.ratio for r in chains}
    return Figures("fast path " + ", ".join(parts), found)


if __name__ == "__main__":
    print(main())
