"""How many records of boards are named right, how many are left open, and how many are wrong.

The boards are of ``bench-1``, in ngspice with full op-amps (``record_boards``). The scope has 8
bits, 1 % noise, jitter, errors of gain and offset; it takes 2000 to 100 000 points over 3 to 19.9
drive periods, with two to four of the nets on its channels. Names are as ``designer bench`` gives
them. ``DESIGNER_RECORDS`` is the number of boards (56: about 500 records of nine responses).
"""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.bench_flow import commit, machine, table
from benchmarks.record_boards import POINTS, RECORDED, Asked, BoardRun, RecordBoards
from designer.base.defaults import cores
from designer.base.errors import InputError
from designer.base.figure_style import new_figure, styled, to_png
from designer.base.plain_json import dumps
from designer.check.synthesis_result import synthesise
from designer.dynamics.counts import Counts
from designer.model.model_file import read_model_file
from designer.spice.read_orbit import ENGINE_ERROR
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.contact_count import extremes
from designer.workbench.dead_zone_curve import fitted
from designer.workbench.naming import NamedMotion, named
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
COLOURS = ("#2b6a4d", "#e0b040", "#b03030", "#c8c8c8", "#808080")


@dataclass(frozen=True)
class NamedRecord:
    """What became of one record."""

    question: int
    """Number of the wanted response."""
    sample: int
    """Number of the board."""
    truth: str
    """What ngspice shows."""
    name: str
    """What the record was called, the likeliest first where it was left open."""
    outcome: str
    """One of ``OUTCOMES``."""
    by_board: bool
    """Whether the board behind the record gave its curve the shape."""
    nearest: float
    """Least distance of an extreme of v1 from a stop in ngspice, over the peak."""


def named_record(run: BoardRun, prediction: BoardPrediction) -> NamedRecord:
    """What becomes of one record of a board. A truth that is no n-p-q (grazing, not settled) is
    none."""
    name = _named(run, prediction)
    truth, nearest = run.response, _nearest(run, prediction)
    question, sample = run.asked.question, run.asked.sample
    if name is None:
        return NamedRecord(question, sample, truth, "", REFUSED, False, nearest)
    outcome = OPEN
    if "-" not in truth and truth != "aperiodic":
        outcome = NO_TRUTH
    elif name.sure:
        outcome = RIGHT if name.response == truth else WRONG
    words = ", ".join((name.response, *name.others))
    return NamedRecord(question, sample, truth, words, outcome, name.by_board, nearest)


def _nearest(run: BoardRun, prediction: BoardPrediction) -> float:
    """By the corners of fv over v1, which ngspice has sharp to 1e-5 of the peak."""
    lap = slice(-max(Counts.parse(run.response).n if "-" in run.response else 1, 1) * POINTS, None)
    v1, fv = run.signals["v1"][lap], run.signals["fv"][lap]
    peak = float(np.abs(v1).max())
    ends = fitted(v1, fv, (1e-4 * peak, 1e-3 * peak), prediction.stops[0], len(v1)).ends
    beyond = [side * (v1 - end) for side, end in ends.items()]
    return min(float(np.abs(b[extremes(b, 1e-4 * peak)]).min()) for b in beyond) / peak


def _named(run: BoardRun, prediction: BoardPrediction) -> NamedMotion | None:
    """The name of one record of a run; None where the record is refused."""
    rng = np.random.default_rng([SEED, run.asked.question, run.asked.sample])
    scope = SimulatedScope(
        points=int(2000 * 50 ** rng.uniform()),
        periods=float(rng.uniform(3.0, RECORDED - 0.1)),
        channels=CHANNELS[rng.integers(len(CHANNELS))],
    )
    at = np.arange(RECORDED * POINTS + 1) * run.period / POINTS
    record = scope.record(at, run.signals, run.period, rng)
    try:
        return named(recorded_motion(record, prediction), prediction)
    except InputError:
        return None


def main() -> str:
    """Name the records and write ``reports/bench``; the result in a line."""
    boards = int(os.environ.get("DESIGNER_RECORDS", BOARDS))
    synthesis = synthesise(read_model_file(MODEL))
    prediction = BoardPrediction(synthesis)
    wanted = [f"{r.expected} at ω = {r.omega:g}" for r in synthesis.model_responses]
    drawn = RecordBoards(synthesis, boards, SEED, KEPT, cores())
    asked = [Asked(k, sample) for sample in range(boards) for k in range(len(wanted))]
    began = time.process_time()
    records = [named_record(run, prediction) for run in drawn.runs(asked)]
    seconds = (time.process_time() - began) / max(len(records), 1)
    counts = [Counter(r.outcome for r in records if r.question == k) for k in range(len(wanted))]
    REPORT.mkdir(parents=True, exist_ok=True)
    text = _report(wanted, counts, records, seconds)
    (REPORT / "README.md").write_text(text, encoding="utf-8")
    answer = {"commit": commit(), "seconds": seconds, "records": [asdict(r) for r in records]}
    (REPORT / "records.json").write_text(dumps(answer), encoding="utf-8")
    (REPORT / "records.png").write_bytes(to_png(_figure(wanted, counts)))
    total = Counter(r.outcome for r in records)
    return ", ".join(f"{total[name]} {name}" for name in OUTCOMES)


@styled
def _figure(wanted: Sequence[str], counts: Sequence[Counter[str]]) -> Figure:
    """Records of each response by what became of them."""
    figure = new_figure(7.0, 3.5)
    axes = figure.subplots()
    left = np.zeros(len(wanted))
    for outcome, colour in zip(OUTCOMES, COLOURS, strict=True):
        values = np.array([count[outcome] for count in counts])
        axes.barh(wanted, values, left=left, color=colour, label=outcome)
        left += values
    axes.invert_yaxis()
    axes.set_xlabel("records")
    figure.legend(loc="outside lower center", ncols=len(OUTCOMES), frameon=False)
    return figure


def _report(
    wanted: Sequence[str],
    counts: Sequence[Counter[str]],
    records: Sequence[NamedRecord],
    seconds: float,
) -> str:
    total = Counter(r.outcome for r in records)
    rows = [
        [name, *(str(count[each]) for each in OUTCOMES)]
        for name, count in [*zip(wanted, counts, strict=True), ("all", total)]
    ]
    open_ = [r for r in records if r.outcome == OPEN]
    near = sum(r.nearest < ENGINE_ERROR for r in open_)
    asked = sum(r.by_board and r.outcome == RIGHT for r in records)
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
            "![Records of each response by what became of them](records.png)",
            "",
            f"Of {total[RIGHT]} that are right {asked} are by the board behind the record. Of "
            f"{len(open_)} left open {near} come nearer to a stop than {ENGINE_ERROR:g} of the "
            "peak, which ngspice's own count does not tell.",
            "",
            f"{seconds:.2g} CPU s a record.",
            "",
            "The boards behind such records, and what is advised for them: [fits.md](fits.md).",
            "",
        ]
    )
