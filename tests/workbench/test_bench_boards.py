"""Boards of other designs, and one with its generator off, from ngspice to the fitted figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from benchmarks.record_boards import DECAY, POINTS, RECORDED, Asked, BoardRun, RecordBoards
from designer.base.arrays import Array
from designer.check.synthesis_result import synthesise
from designer.model.model_file import read_model_file
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.fitted_board import NORMAL, FittedBoard, board_behind, board_figures
from designer.workbench.free_decay import recorded_decay
from designer.workbench.naming import NamedMotion, identify_response
from designer.workbench.prediction import BoardPrediction
from tests.shared.paper_cases import synthesised
from tests.shared.simulated_scope import SimulatedScope

EXAMPLES = Path(__file__).parents[2] / "examples"
SEED, SAMPLE = 31, 1

pytestmark = pytest.mark.slow


def recorded(run: BoardRun, prediction: BoardPrediction, nets: Sequence[str]) -> NamedMotion:
    """A scope's record of a run, named."""
    scope = SimulatedScope(points=20_000, periods=8.0, channels=tuple(nets))
    at = np.arange(RECORDED * POINTS + 1) * run.period / POINTS
    record = scope.record(at, run.signals, run.period, np.random.default_rng(SEED))
    return identify_response(recorded_motion(record, prediction), prediction)


def check_figures(board: FittedBoard, truth: Mapping[str, Array], sure: Sequence[str]) -> None:
    """What is told holds what the drawn parts make of it, with room for a figure in a hundred; the
    sure ones are told."""
    assert board.misfit == pytest.approx(0.9, abs=0.3)
    assert {figure.name for figure in board.figures} >= set(sure)
    for figure in board.figures:
        sigma = (figure.high - figure.low) / (2.0 * NORMAL)
        assert abs(figure.value - truth[figure.name][SAMPLE]) < 3.0 * sigma, figure


@pytest.mark.parametrize(
    ("example", "nets", "shown", "sure"),
    [
        ("backlash", ("v1", "v3", "fv"), ["1-1-1"], ("constant force",)),
        ("hammer-base", ("v1", "fv"), ["1-0-1"], ("lower gap", "constant force")),
        (
            "rectifier",
            ("v1", "fv"),
            ["1-1-1", "1-3-3"],
            ("upper gap", "lower gap", "constant force"),
        ),
    ],
)
def test_boards_of_other_designs_are_fitted(
    example: str, nets: tuple[str, ...], shown: list[str], sure: tuple[str, ...], tmp_path: Path
) -> None:
    """Two masses with the clearance between them and one mass on a moving base, from files of
    format 2, and the rectifier stage; on full op-amps."""
    synthesis = synthesise(read_model_file(EXAMPLES / f"{example}.toml"))
    prediction = BoardPrediction(synthesis)
    boards = RecordBoards(synthesis, SAMPLE + 1, SEED, tmp_path, 1)
    runs = list(boards.runs([Asked(k, SAMPLE) for k in range(len(shown))]))
    records = [recorded(run, prediction, nets) for run in runs]
    assert [run.response for run in runs] == shown
    assert [record.response for record in records] == shown
    assert all(record.sure for record in records)
    board = board_behind("", [(f"{k}.csv", r) for k, r in enumerate(records)], prediction)
    truth = board_figures(synthesis.design.circuit, boards.drawn)
    check_figures(board, {name: values for name, (_, values) in truth.items()}, sure)
    assert [advice.as_set for advice in board.advice[: len(shown)]] == [1.0] * len(shown)


def test_a_record_with_the_generator_off_sharpens_the_fit(tmp_path: Path) -> None:
    """A record of 1-2-2 alone, and with the free decay of the same board in ngspice."""
    synthesis = synthesised()
    prediction = BoardPrediction(synthesis)
    boards = RecordBoards(synthesis, SAMPLE + 1, SEED, tmp_path, 1)
    (run,) = boards.runs([Asked(2, SAMPLE)])
    record = recorded(run, prediction, ("v1", "fv"))
    signals = boards.decay(SAMPLE)
    assert signals is not None
    scope = SimulatedScope(8000, 0.98, ("v1", "fv"))
    at = np.linspace(0.0, DECAY, len(signals["v1"]))
    off = scope.record(at, signals, DECAY, np.random.default_rng(SEED))
    free = recorded_decay(off, record.motion.channels, prediction)
    truth = board_figures(synthesis.design.circuit, boards.drawn)
    figures = {name: values for name, (_, values) in truth.items()}
    widths = []
    for decays in ([], [("off.csv", free)]):
        board = board_behind("", [("on.csv", record)], prediction, [], decays)
        check_figures(board, figures, ("upper gap", "lower gap", "resonance 1, open"))
        widths.append({figure.name: figure.high - figure.low for figure in board.figures})
    alone, both = widths
    assert both["resonance 1, open"] < 0.1 * alone["resonance 1, open"]
    assert both["upper gap"] + both["lower gap"] < alone["upper gap"] + alone["lower gap"]
