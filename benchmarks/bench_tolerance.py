"""The exact circuit of a tolerance study: 10 000 boards as built, both dead-zone stages, p = 1 … 8.

Against settling each board by brute force on the general kernel and against spicelib's Monte Carlo
run, and memory. The designs are those of ``examples/paper.toml`` and ``examples/rectifier.toml``,
each response in the middle of its window; 1-8-8 at b = 0.285, where boards survive.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from benchmarks.bench_flow import commit, machine, table
from benchmarks.figures import Figures
from benchmarks.spicelib_runs import seconds_a_board
from designer.base.defaults import cores
from designer.base.environment import spawn_context
from designer.base.plain_json import dumps
from designer.check.synthesis_result import synthesise
from designer.circuit import nominal
from designer.circuit.board_values import nominal_board
from designer.circuit.nominal import on_circuit
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import describe, shoot
from designer.dynamics.counts import Counts
from designer.dynamics.flow import Flow
from designer.model.model_file import read_model_file
from designer.model.response_table import Response
from designer.spread.spread import Spread, draw
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import BLOCK, Question, StudyPlan, Verdict
from designer.yields.layers import LocalRunner, samples_task
from designer.yields.study_plan import plan_study

ROOT = Path(__file__).parent.parent
REPORT = ROOT / "reports" / "tolerance-speed"
STAGES = ("paper", "rectifier")
BEST = {1: 1.6, 2: 0.865, 3: 0.54, 4: 0.407, 5: 0.334, 6: 0.281, 7: 0.2445, 8: 0.2176}
"""Drive frequency of the 1-p-p response, by p."""
CLEARANCE = {8: 0.285}
SAMPLES, SEED = 10_000, 20
BRUTE_PERIODS, RUNS = 500, 10
"""Drive periods that the others settle; runs of spicelib."""
MANY = (10_000, 100_000)
"""Boards of the studies whose memory is measured."""
GOAL_SECONDS = 8.0
FINE = {"paper": Spread(0.002, 0.002, 3e-4, 1e-3), "rectifier": None}
"""The saturating stage loses boards under bench-1: finer parts, so that 95 % survive."""


@dataclass(frozen=True)
class Row:
    """One response of one stage.

    seconds, cpu : for ``samples`` answers on all cores, drawing to judging. kept : share of ok.
    longest : most drive periods that an answer took. brute : CPU seconds a board by settling for
    BRUTE_PERIODS. spicelib : wall seconds a board of spicelib's run of ngspice on all cores; None
    where that was not timed.
    """

    stage: str
    p: int
    samples: int
    seconds: float
    cpu: float
    kept: float
    longest: int
    brute: float
    spicelib: float | None

    @property
    def ratio(self) -> float:
        """How much longer settling by brute force takes, on one core."""
        return self.brute / (self.cpu / self.samples)

    @property
    def spicelib_ratio(self) -> float | None:
        """How much longer a board takes spicelib, both on all cores."""
        return None if self.spicelib is None else self.spicelib / (self.seconds / self.samples)


def plan_of(stage: str, most: int) -> StudyPlan:
    """The study of a stage's 1-p-p responses, p = 1 … most; its spread is bench-1 or FINE."""
    wanted = tuple(
        Response(omega=w, expect=Counts(1, ((p, p),)), b=CLEARANCE.get(p))
        for p, w in BEST.items()
        if p <= most
    )
    file = replace(read_model_file(ROOT / "examples" / f"{stage}.toml"), responses=wanted)
    made = synthesise(file)
    system = nominal.nominal_reduction(made.design).system()
    questions = tuple(
        Question(
            r.spec,
            made.design.excitation(r.b, r.omega),
            on_circuit(system, made.design, r),
            None,
        )
        for r in made.model_responses
    )
    plan = plan_study(file, made.design, [], made.catalog, samples=0, seed=SEED)
    fine = FINE[stage]
    return replace(plan, questions=questions, spread=plan.spread if fine is None else fine)


def brute(plan: StudyPlan, question: Question, boards: int) -> float:
    """CPU seconds a board: the general kernel for BRUTE_PERIODS, then the orbit it is on."""
    drive = question.excitation.drive
    nominal = Reduction(plan.circuit, nominal_board(plan.circuit)).system()
    describe(Flow(nominal, drive, fast=False), question.start.start, 1, np.eye(4))  # compiled code
    began = time.process_time()
    for index in range(boards):
        board = draw(plan.circuit, plan.spread, plan.seed, index)
        flow = Flow(Reduction(plan.circuit, board).system(), drive, fast=False)
        run = flow.run(question.start.start, BRUTE_PERIODS)
        found = shoot(flow, run.strobes[-1], 1, run.mode)
        if found is not None:
            describe(flow, found[0], 1, found[1])
    return (time.process_time() - began) / boards


def memory(plan: StudyPlan, samples: int) -> float:
    """[MB] a new process's peak over a study of so many boards, all answers kept."""
    with ProcessPoolExecutor(1, spawn_context()) as pool:
        return pool.submit(_memory, plan, samples).result()


def _memory(plan: StudyPlan, samples: int) -> float:
    asked = replace(plan, samples=samples)
    tasks = (samples_task(asked, block) for block in asked.blocks())
    kept = [answers for _, answers in LocalRunner(cores()).run(tasks, lambda: None)]
    assert sum(len(answers) for answers in kept) == samples * len(plan.questions)
    # Not getrusage: what it tells of a new process includes the one that started it.
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return float(next(line.split()[1] for line in status.splitlines() if "VmHWM" in line)) / 1024.0


def measure(
    plans: Mapping[str, StudyPlan], samples: int = SAMPLES, boards: int = 10, runs: int = RUNS
) -> list[Row]:
    """Every row; smaller numbers for a quick look. runs : of spicelib, for each stage's first."""
    rows = []
    for stage, plan in plans.items():
        for number, question in enumerate(plan.questions):
            asked = replace(plan, questions=(question,))
            exact_circuit.block(asked, range(2), 1)  # compiled code, tables of the nominal board
            began, spent = time.perf_counter(), time.process_time()
            verdicts: Counter[Verdict] = Counter()
            longest = 0
            wanted = replace(asked, samples=samples)
            tasks = (samples_task(wanted, block) for block in wanted.blocks())
            for _, answers in LocalRunner(cores()).run(tasks, lambda: None):
                verdicts.update(answer.verdict for answer in answers)
                longest = max(longest, *(answer.periods for answer in answers))
            seconds, cpu = time.perf_counter() - began, time.process_time() - spent
            rows.append(
                Row(
                    stage=stage,
                    p=question.start.p,
                    samples=samples,
                    seconds=seconds,
                    cpu=cpu,
                    kept=verdicts[Verdict.OK] / samples,
                    longest=longest,
                    brute=brute(plan, question, boards),
                    spicelib=seconds_a_board(
                        plan, question.excitation, runs=runs, periods=BRUTE_PERIODS, jobs=cores()
                    )
                    if runs and number == 0
                    else None,
                )
            )
    return rows


def report(rows: list[Row], memories: Mapping[int, float], seconds: float) -> str:
    """tolerance-speed.md."""
    body = [
        [
            "saturation" if row.stage == "paper" else row.stage,
            f"1-{row.p}-{row.p}",
            f"{row.seconds:.1f}",
            f"{1e3 * row.cpu / row.samples:.2f}",
            f"{100 * row.kept:.1f} %",
            f"{row.longest}",
            f"{1e3 * row.brute:.0f}",
            f"{row.ratio:.0f}",
            "" if row.spicelib is None else f"{1e3 * row.spicelib:.0f}",
            "" if row.spicelib_ratio is None else f"{row.spicelib_ratio:.0f}",
        ]
        for row in rows
    ]
    header = ["stage", "response", "s", "ms CPU", "ok", "most periods", "brute ms", "ratio"]
    header += ["spicelib ms", "ratio"]
    lines = [
        "# Speed of the exact rung",
        "",
        "Made by `python -m benchmarks tolerance` (`make bench`).",
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}",
        f"- Took {seconds:.0f} s, at a load of {os.getloadavg()[2]:.1f} in the last 15 minutes:",
        "  wall times are for an idle machine only where that is at most the number of cores.",
        "",
        f"{rows[0].samples} boards as built, in blocks of {BLOCK}, on {cores()} cores: drawing,",
        "reduction, settling, margins, judging. `s` is wall time for all, compilation left out;",
        f"the goal for 10 000 boards is {GOAL_SECONDS:g} s where 95 % are ok. `ms CPU` is for a",
        "board; `most periods` is what the dearest board took. `brute ms` is the CPU time of a",
        f"board by {BRUTE_PERIODS} periods of the general kernel, without compiled settling, and",
        "`ratio` that over ours. `spicelib ms` is wall time for a board of spicelib's Monte Carlo",
        f"run: a process of ngspice for each, {BRUTE_PERIODS} periods from rest, of which it gives",
        "the waveform and no verdict; the last `ratio` is that over our wall time, both on all",
        f"cores ({RUNS} runs; other settings or fewer periods would change it in proportion).",
        "The saturating stage has parts of 0.2 % here, the rectifying one bench-1 at 1 %.",
        "",
        *table(header, body),
        "",
        *(
            f"A new process that answers {n} boards (1-1-1, saturating stage) and keeps every "
            f"answer peaks at {megabytes:.0f} MB."
            for n, megabytes in memories.items()
        ),
        "",
        "![Seconds by response](tolerance-speed.svg)",
    ]
    return "\n".join(lines) + "\n"


def plot(rows: list[Row]) -> Figure:
    """Milliseconds of CPU a board by response, ours and brute force."""
    figure = Figure(figsize=(7.0, 4.4), layout="constrained")
    ax = figure.subplots()
    for stage, colour in zip(STAGES, ("#1f77b4", "#d62728"), strict=True):
        mine = [row for row in rows if row.stage == stage]
        name = "saturation" if stage == "paper" else stage
        p = [row.p for row in mine]
        cost = [1e3 * row.cpu / row.samples for row in mine]
        ax.semilogy(p, cost, "o-", color=colour, label=f"{name}, an answer")
        ax.semilogy(
            p, [1e3 * row.brute for row in mine], "s--", color=colour, label=f"{name}, brute force"
        )
    ax.set_xlabel("p of the response 1-p-p")
    ax.set_ylabel("ms of CPU a board")
    ax.grid(visible=True, which="major", lw=0.4, alpha=0.6)
    ax.legend(fontsize=8, frameon=False)
    return figure


def main() -> Figures:
    """Measure, print, write reports/tolerance-speed/; returns a line of figures."""
    began = time.perf_counter()
    plans = {stage: plan_of(stage, 8) for stage in STAGES}
    rows = measure(plans)
    first = replace(plans["paper"], questions=plans["paper"].questions[:1])
    memories = {n: memory(first, n) for n in MANY}
    text = report(rows, memories, time.perf_counter() - began)
    print(text)
    REPORT.mkdir(parents=True, exist_ok=True)
    (REPORT / "tolerance-speed.md").write_text(text, encoding="utf-8")
    data = {
        "format": 1,
        "commit": commit(),
        "machine": machine(),
        "rows": [asdict(r) for r in rows],
        "memory": [{"samples": n, "megabytes": m} for n, m in memories.items()],
    }
    (REPORT / "tolerance-speed.json").write_text(dumps(data), encoding="utf-8")
    figure = plot(rows)
    with mpl.rc_context({"svg.hashsalt": "tolerance", "svg.fonttype": "none"}):
        figure.savefig(REPORT / "tolerance-speed.svg", metadata={"Date": None})
    figure.savefig(REPORT / "tolerance-speed.png", dpi=130)
    slowest = max(row.seconds for row in rows if row.kept >= 0.95)
    line = f"{rows[0].samples} boards in at most {slowest:.1f} s where 95 % are ok"
    return Figures(line, {f"{row.stage}, p = {row.p}, over settling": row.ratio for row in rows})


if __name__ == "__main__":
    print(main())
