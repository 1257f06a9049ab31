"""How many records of boards are named right, how many are left open, and how many are wrong.

The boards are of ``bench-1``, in ngspice with full op-amps (``record_boards``). The scope has 8
bits, 1 % noise, jitter, errors of gain and offset; it takes 2000 to 100 000 points over 3 to 19.9
drive periods, with two to four of the nets on its channels. Names are as ``designer bench`` gives
them. ``--boards`` is the number of boards (56: about 500 records of nine responses; 0: none, and
the page stays as it is).

A second page, ``exact.md``, has records at settings that are in no file (``exact_records``).
``--exact`` is how many of the paper's model are drawn with each of the ``--seeds`` (0: none), of
each other model a quarter.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks import exact_records
from benchmarks.bench_flow import commit, machine, table
from benchmarks.exact_records import ExactRecord, drawn_records
from benchmarks.record_boards import POINTS, RECORDED, Asked, BoardRun, RecordBoards
from designer.base.defaults import cores
from designer.base.errors import InputError
from designer.base.figure_style import new_figure, styled, to_png
from designer.base.plain_json import dumps
from designer.check.synthesis_result import Synthesis, synthesise
from designer.dynamics.counts import Counts
from designer.model.model_file import read_model_file
from designer.spice.read_orbit import ENGINE_ERROR
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.contact_count import extremes
from designer.workbench.dead_zone_curve import fitted
from designer.workbench.naming import NamedMotion, identify_response
from designer.workbench.prediction import BoardPrediction
from tests.shared.simulated_scope import SimulatedScope

ROOT = Path(__file__).parent.parent
REPORT = ROOT / "reports" / "bench"
KEPT = ROOT / "out" / "record-boards"
MODEL = ROOT / "examples" / "paper.toml"
BOARDS, SEED = 56, 31
CHANNELS = (("v1", "fv"), ("v1", "fv", "vg"), ("v1", "v3", "fv", "vg"), ("fv", "v1"))
RIGHT, OPEN, WRONG, NO_TRUTH, REFUSED = "right", "left open", "wrong", "no truth", "refused"
FEWEST_ALIKE = 5
"""Records with the same channels that have a row."""
OUTCOMES = (RIGHT, OPEN, WRONG, NO_TRUTH, REFUSED)
EXACT, EXACT_SEEDS = 200, (1931,)
MODELS = ("paper", "rectifier", "rig", "backlash", "preloaded", "three-masses")
SAME = 2e-3
"""Of a drive frequency: a sure one is as near as that."""
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
        return identify_response(recorded_motion(record, prediction), prediction)
    except InputError:
        return None


@dataclass(frozen=True)
class NamedExact:
    """What became of a record of an exact orbit."""

    model: str
    """Name of the model file."""
    seed: int
    """Of the draws."""
    number: int
    """Of the draw."""
    channels: str
    """The nets on the channels, in alphabetical order."""
    clipped: bool
    """Whether a channel is cut off."""
    clean: bool
    """Whether the scope has no noise and no errors."""
    helped: bool
    """Whether the drive frequency or the channels are said."""
    truth: str
    """What the exact circuit shows."""
    name: str
    """What the record was called, the likeliest first where it was left open; or why it was
    refused."""
    outcome: str
    """One of ``OUTCOMES``."""
    off: float
    """How far off the drive frequency is, as a fraction; nan of a refused one."""
    said: bool
    """Whether a channel that is cut off is said to be."""


def named_exact(
    model: str, seed: int, drawn: ExactRecord, synthesis: Synthesis, prediction: BoardPrediction
) -> NamedExact:
    """What becomes of one. Wrong is what is sure of another response, of another drive frequency or
    of another net on a channel."""
    about = None if drawn.omega is None else synthesis.design.errors.scales.frequency(drawn.omega)
    channels = ", ".join(sorted(drawn.nets))
    helped = drawn.omega is not None or drawn.channels is not None
    known = bool(drawn.clipped), drawn.clean, helped
    outcome = partial(NamedExact, model, seed, drawn.number, channels, *known, drawn.response)
    try:
        motion = recorded_motion(drawn.record, prediction, frequency=about, stated=drawn.channels)
        name = identify_response(motion, prediction)
    except InputError as error:
        return outcome(str(error), REFUSED, math.nan, said=False)
    off = name.motion.frequency / drawn.frequency - 1.0
    nets = {net: f"CH{k + 1}" for k, net in enumerate(drawn.nets)}
    true = name.response == drawn.response and abs(off) < SAME and name.motion.channels == nets
    result = OPEN if not name.sure else RIGHT if true else WRONG
    words = ", ".join((name.response, *name.others))
    return outcome(words, result, off, said=drawn.clipped in name.clipped)


def exact_page(count: int, seeds: Sequence[int]) -> str:
    """Name the records of exact orbits and write ``exact.md``; the result in a line."""
    began, records = time.process_time(), []
    for k, model in enumerate(MODELS):
        synthesis = synthesise(read_model_file(MODEL.with_name(f"{model}.toml")))
        prediction = BoardPrediction(synthesis)
        numbers = range(count if k == 0 else -(-count // 4))
        for seed in seeds:
            drawn = drawn_records(synthesis, numbers, seed)
            records += [named_exact(model, seed, each, synthesis, prediction) for each in drawn]
    seconds = (time.process_time() - began) / max(len(records), 1)
    REPORT.mkdir(parents=True, exist_ok=True)
    command = f"python -m benchmarks records --exact {count} --seeds {' '.join(map(str, seeds))}"
    (REPORT / "exact.md").write_text(exact_report(records, seconds, command), encoding="utf-8")
    answer = {"commit": commit(), "command": command, "seconds": seconds}
    answer |= {"records": [asdict(r) for r in records]}
    (REPORT / "exact.json").write_text(dumps(answer), encoding="utf-8")
    total = Counter(r.outcome for r in records)
    return ", ".join(f"{total[name]} {name}" for name in OUTCOMES if name != NO_TRUTH)


def exact_report(records: Sequence[NamedExact], seconds: float, command: str) -> str:
    """The page: by model file, by kind of record, by channels, and every wrong one."""
    outcomes = [name for name in OUTCOMES if name != NO_TRUTH]

    def row(title: str, of: Sequence[NamedExact]) -> list[str]:
        counts = Counter(r.outcome for r in of)
        return [title, *(str(counts[name]) for name in outcomes)]

    models = [row(m, [r for r in records if r.model == m]) for m in MODELS]
    periodic = [r for r in records if r.truth != "aperiodic"]
    kinds = [
        row("periodic", periodic),
        row("aperiodic", [r for r in records if r.truth == "aperiodic"]),
        row("a channel is cut off", [r for r in records if r.clipped]),
        row("no noise", [r for r in records if r.clean]),
        row("one channel", [r for r in records if ", " not in r.channels]),
        row("drive or channels are said", [r for r in records if r.helped]),
    ]
    channels = Counter(r.channels for r in records if r.model == MODELS[0])
    ways = [
        row(each, [r for r in records if r.model == MODELS[0] and r.channels == each])
        for each, number in channels.most_common()
        if number >= FEWEST_ALIKE
    ]
    cut = [r for r in records if r.clipped and r.outcome != REFUSED]
    open_ = [r for r in records if r.outcome == OPEN]
    among = sum(r.truth in r.name.split(", ") for r in open_)
    named_so = [r for r in records if r.outcome == WRONG]
    return "\n".join(
        [
            "# Records of exact orbits at settings that are in no file",
            "",
            f"Made by `{command}` at commit {commit()} on {machine()}.",
            "",
            (exact_records.__doc__ or "").strip(),
            "",
            *table(["model file", *outcomes], [*models, row("all", records)]),
            "",
            f"Wrong is a record that is sure of another response, of a drive frequency that is off "
            f"by more than {SAME:g}, or of another net on a channel. Of {len(open_)} left open "
            f"{among} have the true name among those that are left. Only a record of many drive "
            "periods tells that a motion is aperiodic.",
            "",
            *table(["records", *outcomes], kinds),
            "",
            f"{len(cut)} of those that were read have a channel that is cut off; of "
            f"{sum(r.said for r in cut)} it is said.",
            "",
            f"By what is on the channels, of `{MODELS[0]}.toml`:",
            "",
            *table(["channels", *outcomes], ways),
            "",
            *(
                f"- wrong: {r.model} {r.seed} {r.number}: {r.truth} named {r.name}"
                for r in named_so
            ),
            *([""] if named_so else []),
            f"{seconds:.2g} CPU s a record, the drawing of it included.",
            "",
        ]
    )


def main(words: Sequence[str] = ()) -> str:
    """Name the records and write ``reports/bench``; the result in a line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks records", description=__doc__)
    parser.add_argument("--boards", type=int, default=BOARDS, help="boards in ngspice")
    parser.add_argument("--exact", type=int, default=EXACT, help="records of exact orbits")
    parser.add_argument("--seeds", type=int, nargs="+", default=EXACT_SEEDS, help="of the latter")
    chosen = parser.parse_args(words)
    done = [exact_page(chosen.exact, chosen.seeds)] if chosen.exact else []
    done += [board_page(chosen.boards)] if chosen.boards else []
    return "; ".join(done)


def board_page(boards: int) -> str:
    """Name the records of boards in ngspice and write their page; the result in a line."""
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
