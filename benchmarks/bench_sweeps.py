"""What a sweep and a map cost: the paper's Fig. 2, a 200 × 200 map, periods against impacts.

Wall time is of this process on all its cores, CPU time of all its threads; whatever else the
machine does lengthens the first and hardly the second.
"""

from __future__ import annotations

import json
import os
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.bench_flow import commit, machine, table
from benchmarks.figures import Figures
from designer.base.defaults import cores
from designer.bifurcations import parameter_map, sweep
from designer.bifurcations.parameter_map import MapPlan
from designer.bifurcations.sweep import SweepPlan
from designer.dynamics.steady_state import TransientSettings, by_flow
from designer.model.model import Dimensionless
from designer.model.swept_model import ModelSubject

PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
COURSE = TransientSettings(settle=500, keep=30)
ROUNDS = 3
"""The best is stated, all are kept in the JSON file."""
REPORT = Path(__file__).parent.parent / "reports" / "sweep-speed"


@dataclass(frozen=True)
class Timing:
    """name : what was made. points : steps or cells. periods : drive periods run in all. wall, cpu
    : seconds of each round."""

    name: str
    points: int
    periods: int
    wall: list[float]
    cpu: list[float]


@dataclass(frozen=True)
class Cost:
    """Of one drive period at ω, by the kernel: impacts on the upper stop in it; microseconds to
    settle, with a tangent vector, and to show (least displacement and velocities)."""

    omega: float
    impacts: float
    settle: float
    tangent: float
    show: float
    slow: float


def figure_2(tracks: tuple[str, ...], steps: int = 1801) -> SweepPlan:
    """ω from 0.1 to 1.8, 500 periods left out and 30 shown, with the exponent."""
    values = np.linspace(0.1, 1.8, steps)
    return SweepPlan(ModelSubject(PAPER), "omega", values, tracks, course=COURSE)


def big_map(side: int = 200) -> MapPlan:
    """ω against b, 150 periods a point."""
    xs, ys = np.linspace(0.2, 1.8, side), np.linspace(0.05, 0.5, side)
    return MapPlan(ModelSubject(PAPER), "omega", xs, "b", ys)


def timings(rounds: int = ROUNDS, steps: int = 1801, side: int = 200) -> list[Timing]:
    """Interleaved rounds, after everything is compiled."""
    jobs = cores()
    sweep.run(figure_2(("start 0",), 8), jobs)
    cases: dict[str, Any] = {
        f"Fig. 2, {steps} × 530, from rest at every step": figure_2(("start 0",), steps),
        f"Fig. 2, {steps} × 530, followed down (one core)": figure_2(("down",), steps),
        f"Fig. 2, {steps} × 530, followed down and up": figure_2(("down", "up"), steps),
        f"map {side} × {side}, 150 a point": big_map(side),
    }
    walls: dict[str, list[float]] = {name: [] for name in cases}
    cpus: dict[str, list[float]] = {name: [] for name in cases}
    sizes: dict[str, tuple[int, int]] = {}
    for _ in range(rounds):
        for name, plan in cases.items():
            wall, cpu = time.perf_counter(), time.process_time()
            if isinstance(plan, SweepPlan):
                made = sweep.run(plan, jobs)
                sizes[name] = (len(plan.values) * len(plan.tracks), made.periods)
            else:
                cells = parameter_map.run(plan, jobs).cells
                sizes[name] = (len(cells), 150 * len(cells))
            walls[name].append(time.perf_counter() - wall)
            cpus[name].append(time.process_time() - cpu)
    return [Timing(name, *sizes[name], walls[name], cpus[name]) for name in cases]


def costs(
    omegas: tuple[float, ...] = (1.55, 0.85, 0.54, 0.337, 0.215, 0.1), periods: int = 2000
) -> list[Cost]:
    """Best of three, on one core."""
    out = []
    for omega in omegas:
        (setting,) = ModelSubject(PAPER).settings([{"omega": omega}])
        start = setting.steady(np.zeros(4), TransientSettings(500, 16, 0)).end

        def cpu(course: TransientSettings, x: Any = start, s: Any = setting) -> float:
            best = np.inf
            for _ in range(3):
                before = time.process_time()
                s.steady(x, course)
                best = min(best, time.process_time() - before)
            return best

        none = cpu(TransientSettings(0, 1, 0))
        plain = cpu(TransientSettings(periods, 1, 0)) - none  # half of it with a tangent
        shown = cpu(TransientSettings(0, periods, 0)) - none
        flow = setting.flow()
        free = np.inf
        for _ in range(3):
            before = time.process_time()
            flow.run(start, periods)
            free = min(free, time.process_time() - before)
        before = time.process_time()
        by_flow(flow, start, TransientSettings(0, 50, 0))
        slow = (time.process_time() - before) / 50
        seen = setting.steady(start, TransientSettings(0, 100, 0))
        per = 1e6 / periods
        out.append(
            Cost(
                omega,
                len(seen.velocities) / 100,
                free * per,
                (2.0 * plain - free) * per,
                shown * per,
                slow * 1e6,
            )
        )
    return out


def report(timed: list[Timing], cost: list[Cost]) -> str:
    """sweeps.md."""
    rows = [
        [
            t.name,
            f"{min(t.wall):.2f} s",
            f"{min(t.cpu):.2f} s",
            f"{t.points:,}",
            f"{t.periods:,}",
            f"{min(t.cpu) / t.periods * 1e6:.2f} µs",
        ]
        for t in timed
    ]
    each = [
        [
            f"{c.omega:g}",
            f"{c.impacts:.1f}",
            f"{c.settle:.2f} µs",
            f"{c.tangent:.2f} µs",
            f"{c.show:.2f} µs",
            f"{c.slow:.0f} µs",
        ]
        for c in cost
    ]
    lines = [
        "# What sweeps and maps cost",
        "",
        "Made by `python -m benchmarks sweeps` (`make bench`).",
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}; load average at the start "
        f"{', '.join(f'{v:.1f}' for v in os.getloadavg())}",
        "",
        "The paper's case (k0 = 0.95, ζ = 0.1, b = 0.25 in Fig. 2, c = k = m = 0.5, f20 = 0).",
        "Compiled beforehand; with set-up of all tables, the exponent (sweeps), the naming of each",
        f"motion and the periods that this adds. Best of {len(timed[0].wall)} interleaved rounds;",
        "wall time on all cores, CPU time of all threads.",
        "",
        *table(["", "wall", "CPU", "points", "periods", "CPU per period"], rows),
        "",
        "The goals were 3 s for Fig. 2 and 20 s for the map, wall time on two cores.",
        "",
        "## Cost of a drive period, against its impacts",
        "",
        "CPU time on one core. Impacts are on the upper stop; the lower one has as many or about",
        "as many. *Shown* are the periods kept, with least displacement and impact velocities;",
        "*slow* is the general flow, which serves boards and whatever the fast path does not fit.",
        "",
        *table(["ω", "impacts", "settling", "with a tangent", "shown", "slow, shown"], each),
        "",
    ]
    return "\n".join(lines)


def main(
    folder: Path = REPORT, rounds: int = ROUNDS, steps: int = 1801, side: int = 200
) -> Figures:
    """Write sweeps.md and sweeps.json."""
    timed, cost = timings(rounds, steps, side), costs()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "sweeps.md").write_text(report(timed, cost), encoding="utf-8")
    said = {
        "format": 1,
        "commit": commit(),
        "machine": machine(),
        "timings": [asdict(t) for t in timed],
        "costs": [asdict(c) for c in cost],
    }
    (folder / "sweeps.json").write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    line = "; ".join(f"{t.name}: {min(t.wall):.2f} s" for t in timed)
    return Figures(line, {f"ω = {c.omega}, over the general flow": c.slow / c.show for c in cost})
