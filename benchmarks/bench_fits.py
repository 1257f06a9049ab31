"""Whether the board behind a record is found, and whether what is then advised brings a lost
response back.

The boards are of ``bench-1``, in ngspice with full op-amps (``record_boards``). The scope is that
of ``bench_records`` with v1 and fv on its channels. Truth of a figure is what the drawn parts make
of it; truth of a response is what ngspice shows. ``DESIGNER_FITS`` is the number of boards that are
fitted (40), ``DESIGNER_LOST`` the number of lost ones of each response that are advised (8).
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace

import numpy as np

from benchmarks.bench_flow import commit
from benchmarks.bench_records import KEPT, MODEL, REPORT, SEED
from benchmarks.fit_report import (
    KINDS,
    LOST_OF,
    ONE,
    THREE,
    TWO,
    AdvisedBoard,
    BoardError,
    FigureError,
    fit_figure,
    fit_report,
    shows,
)
from benchmarks.record_boards import DECAY, POINTS, RECORDED, Asked, BoardRun, RecordBoards
from designer.base.defaults import cores
from designer.base.environment import spawn_context
from designer.base.errors import InputError
from designer.base.figure_style import to_png
from designer.base.plain_json import dumps
from designer.check.synthesis_result import synthesise
from designer.circuit.ensemble import Ensemble
from designer.model.model_file import read_model_file
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.fitted_board import (
    BoardFigure,
    FittedBoard,
    board_behind,
    board_figures,
    figures,
)
from designer.workbench.free_decay import FreeDecay, recorded_decay
from designer.workbench.naming import NamedMotion, identify_response
from designer.workbench.prediction import BoardPrediction
from designer.yields.adjustment import Adjustment
from designer.yields.setting_search import BoardCase, seek
from tests.shared.simulated_scope import SimulatedScope

BOARDS, LOST = 40, 8
DRAWN = 80
"""Boards among which lost ones are sought."""


class _Bench:
    """A design, its boards, and a scope beside them."""

    def __init__(self, jobs: int) -> None:
        synthesis = synthesise(read_model_file(MODEL))
        self.synthesis, self.prediction = synthesis, BoardPrediction(synthesis)
        self.boards = RecordBoards(synthesis, DRAWN, SEED, KEPT, jobs)
        self.wanted = [str(r.expected) for r in synthesis.model_responses]
        truth = board_figures(synthesis.design.circuit, self.boards.drawn)
        self.truth = {name: values for name, (_, values) in truth.items()}
        self._names: dict[Asked, tuple[str, NamedMotion] | None] = {}

    def pair(self, sample: int) -> tuple[int, int]:
        """Numbers of the responses of which a board is recorded."""
        drawn = np.random.default_rng([SEED, sample]).choice(len(self.wanted), 2, replace=False)
        return int(drawn[0]), int(drawn[1])

    def named(self, run: BoardRun) -> tuple[str, NamedMotion] | None:
        """A record of a run, named once; None where it is refused."""
        if run.asked not in self._names:
            self._names[run.asked] = self._named(run)
        return self._names[run.asked]

    def _named(self, run: BoardRun) -> tuple[str, NamedMotion] | None:
        rng = np.random.default_rng([SEED, run.asked.question, run.asked.sample, 1])
        scope = SimulatedScope(
            points=int(2000 * 50 ** rng.uniform()),
            periods=float(rng.uniform(3.0, RECORDED - 0.1)),
            channels=("v1", "fv"),
        )
        at = np.arange(RECORDED * POINTS + 1) * run.period / POINTS
        record = scope.record(at, run.signals, run.period, rng)
        try:
            motion = recorded_motion(record, self.prediction)
        except InputError:
            return None
        return f"{run.asked.question}.csv", identify_response(motion, self.prediction)

    def behind(
        self, runs: Sequence[BoardRun], wanted: Sequence[int] = (), *, decay: bool = False
    ) -> FittedBoard:
        """The board behind records of these runs, and of its free decay, with advice for the wanted
        responses."""
        records = [record for run in runs if (record := self.named(run)) is not None]
        responses = [self.prediction.responses[k] for k in wanted]
        free = self.decay(runs[0].asked.sample) if decay else None
        decays = [] if free is None else [("off.csv", free)]
        return board_behind("", records, self.prediction, responses, decays)

    def decay(self, sample: int) -> FreeDecay | None:
        """A record of a board whose generator was switched off; None where it tells nothing."""
        signals = self.boards.decay(sample)
        if signals is None:
            return None
        rng = np.random.default_rng([SEED, sample, 2])
        at = np.linspace(0.0, DECAY, len(signals["v1"]))
        scope = SimulatedScope(int(2000 * 50 ** rng.uniform()), 0.98, ("v1", "fv"))
        record = scope.record(at, signals, DECAY, rng)
        try:
            return recorded_decay(record, {"v1": "CH1", "fv": "CH2"}, self.prediction)
        except InputError:
            return None

    def error(self, runs: Sequence[BoardRun], kind: str) -> BoardError:
        """How far the fit to records of these runs is from the drawn board."""
        began, sample = time.process_time(), runs[0].asked.sample
        if kind == THREE and self.decay(sample) is None:
            shown = tuple(run.response for run in runs)
            return BoardError(sample, kind, shown, (), float("nan"), "no free decay to read", 0.0)
        board = self.behind(runs, decay=kind == THREE)
        seconds = time.process_time() - began
        every = [] if board.fit is None else figures(board.fit)
        return BoardError(
            sample=sample,
            kind=kind,
            responses=tuple(run.response for run in runs),
            figures=tuple(_figure_error(f, float(self.truth[f.name][sample])) for f in every),
            misfit=float("nan") if board.misfit is None else board.misfit,
            reason=board.reason,
            seconds=seconds,
        )

    def errors(self, sample: int) -> list[BoardError]:
        """A board by each of ``KINDS``; none where ngspice has no run."""
        pair = self.pair(sample)
        both = list(self.boards.runs([Asked(k, sample) for k in pair]))
        if len(both) < len(pair):
            return []
        return [self.error(both[:1] if kind == ONE else both, kind) for kind in KINDS]

    def lost(self, question: int, most: int) -> list[Asked]:
        """The first boards that do not show a response in ngspice. Those that show it on the exact
        circuit with bandwidth are taken to show it."""
        boards = Ensemble(replace(self.boards.drawn, bandwidth=True))
        response = self.prediction.responses[question]
        drive = response.question.excitation.drive
        starts = np.tile(response.orbit.start, (len(boards), 1))
        orbits = boards.settle(range(len(boards)), [drive] * len(boards), starts)
        wanted = self.wanted[question]
        maybe = [Asked(question, i) for i, o in enumerate(orbits) if not shows(o.response, wanted)]
        runs = self.boards.runs(maybe[: 2 * most])
        return [run.asked for run in runs if not shows(run.response, wanted)][:most]

    def advised(self, lost: Asked) -> AdvisedBoard:
        """A lost board, advised by a record of what it shows and one of another response."""
        wanted, (run,) = self.wanted[lost.question], self.boards.runs([lost])
        board = self.behind([run, *self.boards.runs([self._other(lost)])], [lost.question])
        to = board.advice[0].setting if board.advice else None
        at = self._known(lost)
        return AdvisedBoard(
            question=lost.question,
            sample=lost.sample,
            as_set=run.response,
            advised=None if to is None else _numbers(to),
            share=0.0 if to is None else board.advice[0].share,
            shows=self._shown(lost, to),
            known=None if at is None else _numbers(at),
            known_shows=self._shown(lost, at),
            wanted=wanted,
            reason=board.reason,
        )

    def _shown(self, asked: Asked, setting: Adjustment | None) -> str:
        """What ngspice shows at a setting; "" without one, or where it makes no run."""
        if setting is None:
            return ""
        runs = self.boards.runs([replace(asked, setting=setting)])
        return next((run.response for run in runs), "")

    def _other(self, asked: Asked) -> Asked:
        """A record of another response of the same board."""
        pair = self.pair(asked.sample)
        return Asked(next(k for k in pair if k != asked.question), asked.sample)

    def _known(self, asked: Asked) -> Adjustment | None:
        """Where the drawn board itself shows the response on the exact circuit with bandwidth."""
        board = Ensemble(replace(self.boards.drawn.take([asked.sample]), bandwidth=True))
        case = BoardCase(0, self.prediction.responses[asked.question].question, 0.0)
        seek(board, [case], self.synthesis.modelfile.tuning)
        return None if case.best is None else case.best.setting


def _numbers(setting: Adjustment) -> tuple[float, float, float]:
    return setting.frequency, setting.amplitude, setting.offset


def _figure_error(figure: BoardFigure, truth: float) -> FigureError:
    return FigureError(
        name=figure.name,
        value=figure.value,
        low=figure.low,
        high=figure.high,
        truth=truth,
        sigma=figure.sigma,
        told=figure.determined,
    )


_own: list[_Bench] = []
"""The bench of a worker process."""


def _begin() -> None:
    _own.append(_Bench(1))


def _errors(sample: int) -> list[BoardError]:
    errors = _own[0].errors(sample)
    print(f"board {sample}: {', '.join(' '.join(e.responses) for e in errors)}", flush=True)
    return errors


def _advised(lost: Asked) -> AdvisedBoard:
    board = _own[0].advised(lost)
    print(f"board {lost.sample}, {board.wanted}: advised {board.shows or 'nothing'}", flush=True)
    return board


def main() -> str:
    """Fit and advise the boards and write ``reports/bench/fits.md``; the result in a line."""
    boards = int(os.environ.get("DESIGNER_FITS", BOARDS))
    most = int(os.environ.get("DESIGNER_LOST", LOST))
    bench = _Bench(cores())
    wanted = bench.wanted
    lost = [asked for k in LOST_OF for asked in bench.lost(k, most)]
    del bench
    with ProcessPoolExecutor(cores(), spawn_context(), _begin) as workers:
        fits = workers.map(_errors, range(boards))
        advised = list(workers.map(_advised, lost))
        errors = [error for board in fits for error in board]
    REPORT.mkdir(parents=True, exist_ok=True)
    answer = {
        "commit": commit(),
        "fits": [asdict(board) for board in errors],
        "advised": [asdict(board) for board in advised],
    }
    (REPORT / "fits.json").write_text(dumps(answer), encoding="utf-8")
    text = fit_report(__doc__ or "", errors, advised, wanted)
    (REPORT / "fits.md").write_text(text, encoding="utf-8")
    (REPORT / "fits.png").write_bytes(to_png(fit_figure(errors, advised, wanted)))
    tunable = [board for board in advised if board.tunable]
    two = [board for board in errors if board.kind == TWO]
    return (
        f"gaps right on {sum(b.gaps_right for b in two)} of {len(two)} boards, force on "
        f"{sum(b.force_right for b in two)}; {sum(b.helped for b in tunable)} of "
        f"{len(tunable)} tunable boards brought back"
    )
