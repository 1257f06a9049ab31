"""Records with the generator off, against the matrix exponential and against ngspice."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import least_squares

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.check.synthesis_result import synthesise
from designer.circuit.reduction import Reduction
from designer.model.model_file import parse_model_file, read_model_file
from designer.workbench.free_decay import FreeDecay, recorded_decay, resonances
from designer.workbench.prediction import BoardPrediction
from designer.workbench.record import Record
from tests.shared.exploring import quick
from tests.shared.model_text import PAPER_TABLE
from tests.shared.paper_cases import synthesised

ROOT = Path(__file__).resolve().parents[2]
CHANNELS = {"v1": "CH1", "fv": "CH2"}
STOPLESS = f'format = 1\ntitle = "x"\n{PAPER_TABLE.replace("k0 = 0.95", "k0 = 0.0")}'
LENGTH, POINTS = 0.11, 8000
"""Of a record [s], and its samples."""


@cache
def prediction() -> BoardPrediction:
    return BoardPrediction(synthesised())


def open_mode(z: Array) -> Array:
    """(n, n) of the free motion of the board at z (K,), from its reduction."""
    prior = prediction().prior
    reduction = Reduction(prior.circuit, prior.boards(z[None]).board(0), bandwidth=True)
    return np.asarray(reduction.system().mode(prior.circuit.open).A)


def decaying(z: Array, noise: float = 0.01, contact: float = 0.01) -> Record:
    """v1 of the board at z (K,) from 3 V and 1 V, by the matrix exponential, with a pulse of fv
    until ``contact`` [s] over which v1 is anything."""
    time = np.linspace(0.0, LENGTH, POINTS)
    step = expm(open_mode(z) * time[1])
    states = [np.array([3.0, 0.0, 1.0, 0.0])]
    for _ in time[1:]:
        states.append(step @ states[-1])
    rng = np.random.default_rng(4)
    v1 = 0.98 * np.array(states)[:, 0] + 0.2
    v1[time < contact] += 2.0
    fv = np.where(time < contact, 20.0, 0.0) + 0.05
    screens = {"CH1": v1, "CH2": fv}
    return Record(
        time, {name: v + noise * 3.0 * rng.normal(size=POINTS) for name, v in screens.items()}, "x"
    )


def board(seed: int) -> Array:
    return np.asarray(0.7 * prediction().prior.draws(2, seed=seed)[1])


def test_resonances_are_those_of_the_motion() -> None:
    """The residual is noise at the board's resonances, and least there: the sizes, the constant
    and what was before the last contact do not enter."""
    z = board(1)
    decay = recorded_decay(decaying(z), CHANNELS, prediction())
    true = np.stack(resonances(open_mode(z)[None]), axis=-1)[0]
    assert np.sqrt((decay.residual(true) ** 2).mean()) == pytest.approx(1.0, abs=0.1)
    np.testing.assert_allclose(decay.of_board(prediction().prior, z), decay.residual(true))

    def rest(values: Array) -> Array:
        return decay.residual(values.reshape(-1, 2))

    at = least_squares(rest, 1.02 * true.ravel()).x
    assert at[:2] == pytest.approx(true[0], rel=0.01)


@pytest.mark.slow
def test_the_op_amps_of_a_rectifier_lag_in_its_resonances_too() -> None:
    """They move these by some 3e-4, as much as a decay's interval is wide."""
    prior = BoardPrediction(synthesise(read_model_file(ROOT / "examples" / "rectifier.toml"))).prior
    z, time = 0.7 * prior.draws(2, seed=1)[1], np.linspace(0.0, LENGTH, 200)
    drawn = prior.boards(z[None]).board(0)
    left = []
    for lag in (True, False):
        mode = Reduction(prior.circuit, drawn, bandwidth=lag).system().mode(prior.circuit.open)
        start = np.eye(len(mode.A))[0]
        volts = np.array([(expm(mode.A * t) @ start)[:1] for t in time])
        left.append(np.abs(FreeDecay(time, volts, np.full(1, 1e-6)).of_board(prior, z)).max())
    assert left[0] < 1.0 < 10.0 < left[1]


def test_slopes_are_those_between_boards() -> None:
    decay = recorded_decay(decaying(board(1)), CHANNELS, prediction())
    prior, z, h = prediction().prior, board(2), 1e-3
    slopes = decay.slopes(prior, z)
    assert slopes.shape == (decay.volts.size, prior.size)
    largest = np.argsort(-np.linalg.norm(slopes, axis=0))[:3]
    for k in largest:
        step = h * np.eye(prior.size)[k]
        between = (decay.of_board(prior, z + step) - decay.of_board(prior, z - step)) / (2.0 * h)
        assert np.linalg.norm(slopes[:, k] - between) < 0.05 * np.linalg.norm(between)


def test_a_generator_that_is_still_on_is_waited_for() -> None:
    record = decaying(board(1), contact=0.0)
    time = record.time
    late = np.where(time < 0.03, np.sin(2000.0 * time), 0.0)
    channels = {**CHANNELS, "vg": "CH3"}
    whole = Record(time, {**record.signals, "CH3": late}, "x")
    lasts = [
        float(recorded_decay(whole, roles, prediction()).time[-1]) for roles in (CHANNELS, channels)
    ]
    assert lasts[0] > lasts[1]
    assert lasts[1] == pytest.approx(LENGTH - 0.03, abs=0.002)


def test_a_real_pair_may_straddle_an_oscillation() -> None:
    """Companion blocks of s² + 4 s + 1 and of s² + 0.1 s + 1.4425."""
    A = np.zeros((1, 4, 4))
    A[0, :2, :2] = [[0.0, 1.0], [-1.0, -4.0]]
    A[0, 2:, 2:] = [[0.0, 1.0], [-1.4425, -0.1]]
    frequency, damping = resonances(A)
    slow = np.sqrt(1.4425)
    np.testing.assert_allclose(frequency[0], [1.0, slow])
    np.testing.assert_allclose(damping[0], [2.0, 0.05 / slow])


@pytest.mark.parametrize("damping", quick([1.0, 0.3, 1.5]))
def test_nothing_is_left_of_a_long_free_motion(damping: float) -> None:
    """By the matrix exponential, over two seconds at 100 Hz."""
    omega, time = 200.0 * np.pi, np.linspace(0.0, 2.0, 400)
    A = np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]])
    volts = np.array([(expm(A * t) @ [1.0, 30.0])[:1] for t in time])
    decay = FreeDecay(time, volts, np.full(1, 1e-3))
    left = decay.residual(np.array([[omega, damping]]))
    np.testing.assert_allclose(left, 0.0, atol=1e-6)


def test_a_dead_channel_is_left_out() -> None:
    record = decaying(board(1))
    dead = Record(record.time, {**record.signals, "CH3": np.zeros(POINTS)}, "x")
    decay = recorded_decay(dead, {**CHANNELS, "v3": "CH3"}, prediction())
    assert decay.volts.shape[1] == 1
    assert (decay.sigma > 0.0).all()
    alone = Record(record.time, {**record.signals, "CH1": np.ones(POINTS)}, "x")
    with pytest.raises(InputError, match="clearly above the noise"):
        recorded_decay(alone, CHANNELS, prediction())


def test_a_rest_on_a_stop_is_refused() -> None:
    record, end = decaying(board(1)), prediction().stops[0].ends[1]
    beyond = {**record.signals, "CH1": record.signals["CH1"] + 1.5 * end}
    with pytest.raises(InputError, match="inside clearance"):
        recorded_decay(Record(record.time, beyond, "x"), CHANNELS, prediction())


def test_without_a_wanted_response_a_decay_is_read_all_the_same() -> None:
    made = synthesised()
    none = BoardPrediction(
        replace(made, modelfile=replace(made.modelfile, responses=()), model_responses=())
    )
    whole, bare = (recorded_decay(decaying(board(1)), CHANNELS, p) for p in (prediction(), none))
    assert bare.time[-1] >= whole.time[-1]


def test_without_stops_all_of_it_is_free() -> None:
    prediction = BoardPrediction(synthesise(parse_model_file(STOPLESS)))
    prior = prediction.prior
    z, time = np.zeros(prior.size), np.linspace(0.0, LENGTH, 400)
    reduction = Reduction(prior.circuit, prior.boards(z[None]).board(0), bandwidth=True)
    mode = reduction.system().mode(prior.circuit.open).A
    v1 = np.array([(expm(mode * t) @ np.eye(len(mode))[0])[0] for t in time])
    noise = 1e-3 * np.random.default_rng(5).normal(size=len(time))
    decay = recorded_decay(Record(time, {"CH1": v1 + noise}, "x"), {"v1": "CH1"}, prediction)
    assert np.sqrt((decay.of_board(prior, z) ** 2).mean()) < 1.5


@pytest.mark.parametrize(
    ("channels", "contact", "noise", "expected"),
    [
        ({"v1": "CH1"}, 0.0, 0.01, "a displacement and fv"),
        ({"fv": "CH2"}, 0.0, 0.01, "a displacement and fv"),
        (CHANNELS, 0.1, 0.01, "ms or more"),
        (CHANNELS, 0.01, 3.0, "clearly above the noise"),
    ],
)
def test_what_tells_nothing_is_refused(
    channels: dict[str, str], contact: float, noise: float, expected: str
) -> None:
    with pytest.raises(InputError, match=expected):
        recorded_decay(decaying(board(1), noise, contact), channels, prediction())


def test_a_rest_without_motion_is_a_constant() -> None:
    """Nothing is left of a constant, whatever the resonances."""
    decay = FreeDecay(np.linspace(0.0, 1.0, 50), np.full((50, 1), 3.0), np.ones(1))
    np.testing.assert_allclose(decay.residual(np.array([[10.0, 0.1], [20.0, 1.5]])), 0.0, atol=1e-9)
