"""How many records of boards are named right, how many are left open, and how many are wrong.

The boards are of ``bench-1``, in ngspice with full op-amps (``record_boards``). The scope has 8
bits, 1 % noise, jitter, errors of gain and offset; it takes 2000 to 100 000 points over 3 to 19.9
drive periods, with two to four of the nets on its channels. What names the records simulates
nothing. ``DESIGNER_RECORDS`` is the number of boards (56: about 500 records of nine responses).
"""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.bench_flow import commit, machine, table
from benchmarks.record_boards import POINTS, RECORDED, BoardRun, runs
from designer.base.defaults import cores
from designer.base.errors import InputError
from designer.check.synthesis_result import synthesise
from designer.model.model_file import read_model_file
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.naming import named
from designer.workbench.prediction import BoardPrediction
from tests.shared.simulated_scope import SimulatedScope

ROOT = Path(__file__).parent.parent
REPORT = ROOT / "reports" / "bench"
KEPT = ROOT / "out" / "record-boards"
MODEL = ROOT / "examples" / "paper.toml"
BOARDS, SEED = 56, 31
CHANNELS = (("v1", "fv"), ("v1", "fv", "vg"), ("v1", "v3", "fv", "vg"), ("fv", "v1"))
RIGHT, OPEN, WRONG, NO_TRUTH, REFUSED = "right", "left open", "wrong", "no truth", "refused"
OUTCOMES = (RIGHT, OPEN, WRONG, NO_TRUTH, REFUSED)


def outcome(run: BoardRun, prediction: BoardPrediction) -> str:
    """What becomes of one record of a board. A truth that is no n-p-q (grazing, not settled) is
    none."""
    rng = np.random.default_rng([SEED, run.question, run.sample])
    scope = SimulatedScope(
        points=int(2000 * 50 ** rng.uniform()),
        periods=float(rng.uniform(3.0, RECORDED - 0.1)),
        channels=CHANNELS[rng.integers(len(CHANNELS))],
    )
    at = np.arange(RECORDED * POINTS + 1) * run.period / POINTS
    record = scope.record(at, run.signals, run.period, rng)
    try:
        name = named(recorded_motion(record, prediction), prediction)
    except InputError:
        return REFUSED
    if "-" not in run.response and run.response != "aperiodic":
        return NO_TRUTH
    if not name.sure:
        return OPEN
    return RIGHT if name.response == run.response else WRONG


def main() -> str:
    """Name the records and write ``reports/bench``; the result in a line."""
    boards = int(os.environ.get("DESIGNER_RECORDS", BOARDS))
    synthesis = synthesise(read_model_file(MODEL))
    prediction = BoardPrediction(synthesis)
    wanted = [f"{r.expected} at ω = {r.omega:g}" for r in synthesis.model_responses]
    counts: list[Counter[str]] = [Counter() for _ in wanted]
    seconds = 0.0
    for run in runs(synthesis, range(boards), SEED, cores(), KEPT):
        began = time.perf_counter()
        counts[run.question][outcome(run, prediction)] += 1
        seconds += time.perf_counter() - began
    total = sum(counts, Counter[str]())
    REPORT.mkdir(parents=True, exist_ok=True)
    (REPORT / "README.md").write_text(_report(wanted, counts, total, seconds), encoding="utf-8")
    return ", ".join(f"{total[name]} {name}" for name in OUTCOMES)


def _report(
    wanted: Sequence[str], counts: Sequence[Counter[str]], total: Counter[str], seconds: float
) -> str:
    rows = [
        [name, *(str(count[each]) for each in OUTCOMES)]
        for name, count in [*zip(wanted, counts, strict=True), ("all", total)]
    ]
    number = max(total.total(), 1)
    return "\n".join(
        [
            "# Records of boards, named",
            "",
            f"Made by `python -m benchmarks records` at commit {commit()} on {machine()}.",
            "",
            (__doc__ or "").strip(),
            "",
            *table(["wanted there", *OUTCOMES], rows),
            "",
            f"{seconds / number:.2g} s a record.",
            "",
        ]
    )
