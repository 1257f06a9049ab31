"""ngspice as the study uses it: warm starts, errors, throughput against a naive flow, memory.

The paper's design (``examples/paper.toml``) on its 1-p-p responses, p = 1 … 8, at the settings that
pass the numerics gate.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.bench_flow import commit, machine, table
from benchmarks.figures import Figures
from benchmarks.ngspice_figures import (
    NAIVE_PERIODS,
    SETTLED,
    Throughput,
    WarmStart,
    boards,
    memory,
    naive,
    throughput,
    warm,
    warm_job,
)
from designer.base.defaults import cores
from designer.base.plain_json import dumps
from designer.check.synthesis_result import Synthesis, synthesise
from designer.circuit import nominal
from designer.circuit.nominal import on_circuit
from designer.model.model_file import read_model_file
from designer.spice import numerics_gate as gate
from designer.spice.batch_backend import program_version
from designer.spice.numerics_gate import WAVE_BOUND, GateResult, GateSubject
from designer.spice.opamp_model import FIDELITIES
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import STROBE_TOLERANCE, Read
from designer.spread.spread import Spread

ROOT = Path(__file__).parent.parent
REPORT = ROOT / "reports" / "ngspice"
SAMPLES, RUNS = 1000, 5000
TIMED = {1: 4, 8: 2}
"""p of the responses whose throughput is measured, and the samples of the naive flow."""
GOAL_SECONDS, GOAL_RATIO = 60.0, 20.0
SHOWN = 40
"""Drive periods of a warm start that the picture and the JSON show."""


@dataclass(frozen=True)
class Case:
    """One response: p, drive frequency, the exact circuit's largest multiplier, gate, RMS error
    of ``ideal`` and warm starts by fidelity (None where the run failed or has no period)."""

    p: int
    omega: float
    radius: float
    gate: GateResult
    rms: float
    warm: dict[str, WarmStart | None]
    discarded: dict[str, int]


@dataclass(frozen=True)
class Speed:
    """exact : seconds that the exact circuit took for the same boards."""

    p: int
    ours: Throughput
    exact: float
    naive: Throughput

    @property
    def ratio(self) -> float:
        """How much longer the naive flow takes for a sample, on as many workers."""
        return (self.naive.seconds / self.naive.samples) / (
            (self.ours.seconds + self.exact) / self.ours.samples
        )


@dataclass(frozen=True)
class Measured:
    cases: list[Case]
    speeds: list[Speed]
    memory: list[float]
    jobs: int
    seconds: float


def subjects(made: Synthesis) -> dict[int, tuple[float, GateSubject]]:
    """Drive frequency and nominal subject of each 1-p-p response, by p; the first where several."""
    reduction = nominal.nominal_reduction(made.design)
    system = reduction.system()
    out: dict[int, tuple[float, GateSubject]] = {}
    for r in made.model_responses:
        orbit = on_circuit(system, made.design, r)
        if orbit.n == 1 and orbit.p == orbit.q and orbit.p not in out:
            excitation = made.design.excitation(r.b, r.omega)
            out[orbit.p] = r.omega, GateSubject(reduction, excitation, orbit)
    return out


def measure(samples: int = SAMPLES, runs: int = RUNS, most: int = 8) -> Measured:
    """Everything; smaller numbers for a quick look. most : largest p."""
    began = time.perf_counter()
    made = synthesise(read_model_file(ROOT / "examples" / "paper.toml"))
    wanted = {p: s for p, s in subjects(made).items() if p <= most}
    jobs = cores()
    with SpicePool(jobs, timeout=900.0) as pool:
        cases = _cases(pool, wanted)
        speeds = [
            _speed(pool, made, case, wanted[case.p][1], samples, jobs)
            for case in cases
            if case.p in TIMED
        ]
    sizes = memory(wanted[1][1], cases[0].gate.settings, runs)
    return Measured(cases, speeds, sizes, jobs, time.perf_counter() - began)


def _cases(pool: SpicePool, wanted: dict[int, tuple[float, GateSubject]]) -> list[Case]:
    gates, warms = {}, {}
    for fidelity in FIDELITIES:
        at_fidelity = [replace(s, fidelity=fidelity) for _, s in wanted.values()]
        gates[fidelity] = gate.check(pool, at_fidelity)
        jobs = [warm_job(s, g.settings) for s, g in zip(at_fidelity, gates[fidelity], strict=True)]
        heard = dict(pool.map(jobs))
        warms[fidelity] = [
            warm(s, r) if isinstance(r := heard[i], Read) else None
            for i, s in enumerate(at_fidelity)
        ]
    out = []
    for i, (p, (omega, s)) in enumerate(wanted.items()):
        passed = gates["ideal"][i]
        out.append(
            Case(
                p,
                omega,
                s.orbit.radius,
                passed,
                passed.wave,
                {fidelity: warms[fidelity][i] for fidelity in FIDELITIES},
                {fidelity: gates[fidelity][i].discarded for fidelity in FIDELITIES},
            )
        )
    return out


def _speed(
    pool: SpicePool, made: Synthesis, case: Case, nominal: GateSubject, samples: int, jobs: int
) -> Speed:
    spec = made.modelfile.circuit
    spread = Spread.bench_1(
        made.catalog.opamp(spec.opamp), spec.resistor_grade, spec.capacitor_grade
    )
    began = time.perf_counter()
    drawn = boards(made.design.circuit, spread, nominal, samples, jobs)
    exact = time.perf_counter() - began
    ours = throughput(pool, drawn, case.gate.settings, jobs)
    few = naive(drawn[: max(TIMED[case.p], jobs)], case.gate.settings, jobs)
    return Speed(case.p, ours, exact, few)


# ---------------------------------------------------------------------------------------------
# The report


def _ends(start: WarmStart | None) -> str:
    return "failed" if start is None else f"{start.needed} ({start.response})"


def report(m: Measured) -> str:
    """ngspice.md."""
    first = m.speeds[0]
    whole = first.ours.seconds + first.exact
    settled = [
        float(w.gaps[2:].max()) for c in m.cases if (w := c.warm["ideal"]) and c.radius < 0.9
    ]
    later = m.memory[len(m.memory) // 10 :]
    lines = [
        "# ngspice as the study uses it",
        "",
        "Made by `python -m benchmarks ngspice` (a part of `make bench`).",
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}; ngspice {program_version()}; {m.jobs} workers",
        f"- Took {m.seconds:.0f} s.",
        "",
        "The design of `examples/paper.toml` on its 1-p-p responses. Starts are on the exact",
        "circuit's orbit; distances are of each state's peak, the worst state counts.",
        "",
        "## In short",
        "",
        *table(
            ["figure", "goal", "measured"],
            [
                [
                    f"{first.ours.samples} samples at p = 1, exact rung and ngspice",
                    f"< {GOAL_SECONDS:.0f} s for 1000",
                    f"{whole:.1f} s",
                ],
                *(
                    [
                        f"naive flow over ours, a sample, p = {s.p}",
                        f">= {GOAL_RATIO:.0f}",
                        f"{s.ratio:.0f}",
                    ]
                    for s in m.speeds
                ),
                [
                    "`ideal`, strobe from the third period on (ρ < 0.9)",
                    f"< {STROBE_TOLERANCE:.0e}",
                    f"{max(settled, default=float('nan')):.1e}",
                ],
                [
                    "`ideal`, RMS error, worst p",
                    f"< {WAVE_BOUND:.0e}",
                    f"{max(c.rms for c in m.cases):.1e}",
                ],
                [
                    f"memory, growth over {len(m.memory)} runs (after the first tenth)",
                    "flat",
                    f"{later[-1] - later[0]:+.1f} MB of {later[-1]:.0f} MB",
                ],
            ],
        ),
        "",
        "## Settings and errors",
        "",
        "What the gate found; the RMS error is of the last period at those settings against the",
        "exact circuit.",
        "",
        *table(
            ["p", "ω", "ρ", "steps a period", "steps a contact", "gate's difference", "RMS error"],
            [
                [
                    str(c.p),
                    f"{c.omega:g}",
                    f"{c.radius:.3f}",
                    str(c.gate.tried[-1]) + ("" if c.gate.passed else " (not passed)"),
                    f"{c.gate.contact_steps:.0f}",
                    f"{c.gate.difference:.1e}",
                    f"{c.rms:.1e}",
                ]
                for c in m.cases
            ],
        ),
        "",
        "## Warm starts",
        "",
        f"Periods until every later strobe is within {STROBE_TOLERANCE:g} of the same rung settled",
        f"for {SETTLED} periods; in brackets where it ends. `dynamic` and `full` have orbits of",
        "their own, so a start on the exact circuit's has a way to go. Discarded is what the gate",
        "predicts from a short run: c ρᵏ below the tolerance, ρ the exact circuit's multiplier or",
        "what the short run shows where that is larger; at most 400.",
        "",
        *table(
            ["p", "ideal: needed", "dynamic: needed", "discarded", "full: needed", "discarded"],
            [
                [
                    str(c.p),
                    _ends(c.warm["ideal"]),
                    _ends(c.warm["dynamic"]),
                    str(c.discarded["dynamic"]),
                    _ends(c.warm["full"]),
                    str(c.discarded["full"]),
                ]
                for c in m.cases
            ],
        ),
        "",
        "## Throughput",
        "",
        "Ours: boards under the reference spread, drawn, solved on the exact rung, then in ngspice",
        "from the orbit so found, on all workers. Naive: a process for every sample, from",
        f"discharged capacitors, {NAIVE_PERIODS} periods, on as many workers, on a few samples.",
        "",
        *table(
            ["p", "flow", "samples", "periods each", "exact rung, s", "ngspice, s", "ms a sample",
             "agreed", "failed"],
            [
                row
                for s in m.speeds
                for row in (
                    [str(s.p), "ours", *_cells(s.ours, s.exact)],
                    [str(s.p), "naive", *_cells(s.naive, 0.0)],
                )
            ],
        ),
        "",
        "Agreed: shows the exact circuit's n-p-q. Boards that lost the response are among them",
        "(at p = 8 most did), and from rest some settle on another attractor.",
        "",
        "![Warm starts, errors, throughput, memory](ngspice.svg)",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _cells(t: Throughput, exact: float) -> list[str]:
    return [
        str(t.samples),
        f"{t.periods:.1f}",
        f"{exact:.1f}" if exact else "",
        f"{t.seconds:.1f}",
        f"{1e3 * (t.seconds + exact) / t.samples:.1f}",
        str(t.agreed),
        str(t.failed),
    ]


def as_dict(m: Measured) -> dict[str, Any]:
    """ngspice.json."""
    return {
        "format": 1,
        "commit": commit(),
        "machine": machine(),
        "ngspice": program_version(),
        "jobs": m.jobs,
        "cases": [
            {
                "p": c.p,
                "omega": c.omega,
                "radius": c.radius,
                "gate": c.gate.as_dict(),
                "rms": c.rms,
                "warm": {
                    fidelity: None
                    if w is None
                    else {
                        "needed": w.needed,
                        "predicted": w.predicted,
                        "predicted_by_exact_multiplier": w.exact,
                        "discarded": c.discarded[fidelity],
                        "response": w.response,
                        "gaps": w.gaps[: SHOWN + 1],
                    }
                    for fidelity, w in c.warm.items()
                },
            }
            for c in m.cases
        ],
        "throughput": [
            {
                "p": s.p,
                "ratio": s.ratio,
                "exact_seconds": s.exact,
                "ours": dict(s.ours.__dict__),
                "naive": dict(s.naive.__dict__),
            }
            for s in m.speeds
        ],
        "memory_mb": m.memory[:: max(len(m.memory) // 200, 1)],
        "cost": {"seconds": m.seconds},
    }


def plot(m: Measured) -> Figure:
    """Warm starts by fidelity above; errors, throughput, memory below."""
    figure = Figure(figsize=(11.5, 7.0), layout="constrained")
    axes = figure.subplots(2, 3)
    colours = mpl.colormaps["viridis"](np.linspace(0.0, 0.9, len(m.cases)))
    for ax, fidelity in zip(axes[0], FIDELITIES, strict=True):
        for c, colour in zip(m.cases, colours, strict=True):
            w = c.warm[fidelity]
            if w is not None:
                shown = np.maximum(w.gaps[1 : SHOWN + 1], 1e-6)
                ax.semilogy(
                    np.arange(1, len(shown) + 1), shown, color=colour, lw=1.2, label=f"p = {c.p}"
                )
        ax.axhline(STROBE_TOLERANCE, color="black", lw=0.8, ls="--")
        ax.set(
            title=f"{fidelity}: distance from the settled strobe", xlabel="period", ylim=(1e-6, 1)
        )
        _grid(ax)
    axes[0, 0].set_ylabel("of the peak")
    axes[0, 2].legend(fontsize=7, ncols=2)
    rms, speed, size = axes[1]
    rms.bar([c.p for c in m.cases], [c.rms for c in m.cases], color="#1f77b4")
    rms.axhline(WAVE_BOUND, color="black", lw=0.8, ls="--")
    rms.set(title="ideal: RMS error against the exact circuit", xlabel="p", ylabel="of the peak")
    names = [f"p = {s.p}\n{who}" for s in m.speeds for who in ("ours", "naive")]
    times = [
        1e3 * value
        for s in m.speeds
        for value in (
            (s.ours.seconds + s.exact) / s.ours.samples,
            s.naive.seconds / s.naive.samples,
        )
    ]
    bars = speed.bar(names, times, color=["#d62728", "#7f7f7f"] * len(m.speeds))
    speed.bar_label(bars, [f"{t:,.0f}" for t in times], fontsize=8)
    speed.set_yscale("log")
    speed.set(title=f"wall time a sample, {m.jobs} workers", ylabel="ms")
    speed.margins(y=0.15)
    size.plot(np.arange(1, len(m.memory) + 1), m.memory, color="#2ca02c", lw=1.2)
    size.set(title="resident memory of a worker", xlabel="runs", ylabel="MB")
    size.set_ylim(0.0, 1.3 * max(m.memory))
    rms.set_xticks([c.p for c in m.cases])
    for ax in (rms, speed, size):
        _grid(ax)
    return figure


def _grid(ax: Axes) -> None:
    ax.grid(visible=True, which="major", lw=0.4, alpha=0.6)
    ax.set_axisbelow(True)
    ax.title.set_fontsize(10)


def write(m: Measured, folder: Path) -> str:
    """Write ngspice.md, .json, .svg and .png; returns the text."""
    text = report(m)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "ngspice.md").write_text(text, encoding="utf-8")
    (folder / "ngspice.json").write_text(dumps(as_dict(m)), encoding="utf-8")
    figure = plot(m)
    with mpl.rc_context({"svg.hashsalt": "ngspice", "svg.fonttype": "none"}):
        figure.savefig(folder / "ngspice.svg", metadata={"Date": None})
    figure.savefig(folder / "ngspice.png", dpi=120)
    return text


def main() -> Figures:
    """Measure, print, write reports/ngspice/; returns a line of figures."""
    m = measure()
    print(write(m, REPORT))
    line = ", ".join(f"p = {s.p}: {s.ratio:.0f} times the naive flow" for s in m.speeds)
    return Figures(line, {f"p = {s.p}, over the naive flow": s.ratio for s in m.speeds})
