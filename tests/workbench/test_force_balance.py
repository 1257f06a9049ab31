"""The linear part of a board against an independent integration, and what it tells of records."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import cast

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.exact_records import ExactRecord, drawn_records
from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.workbench.channel_roles import _recognised, recorded_motion
from designer.workbench.force_balance import Balance, ForceBalance, _linear
from designer.workbench.naming import identify_response
from designer.workbench.prediction import BoardPrediction
from designer.workbench.record import Record
from tests.shared.exploring import quick
from tests.shared.paper_cases import synthesised

SEED = 7


@cache
def prediction() -> BoardPrediction:
    return BoardPrediction(synthesised())


@cache
def drawn(number: int) -> ExactRecord:
    (record,) = drawn_records(synthesised(), range(number, number + 1), SEED)
    return record


def test_the_answer_to_a_force_is_that_of_an_integration() -> None:
    """Of a force that is straight between its samples, from rest."""
    part, rng = _linear(prediction()), np.random.default_rng(3)
    time = np.arange(60) * 4e-4
    force = rng.normal(size=60)
    A = (part.shapes * part.roots) @ np.linalg.inv(part.shapes)
    assert np.abs(A.imag).max() < 1e-6 * np.abs(A).max()

    def rate(t: float, x: Array) -> Array:
        return np.asarray(A.real @ x + part.stops[0] * np.interp(t, time, force))

    exact = solve_ivp(
        rate, (0.0, time[-1]), np.zeros(4), t_eval=time, rtol=1e-9, atol=1e-9, max_step=2e-4
    ).y.T
    answer = part.answer(force, 4e-4, part.stops[0])
    np.testing.assert_allclose(answer, exact, atol=2e-6 * np.abs(exact).max())


def test_the_stops_push_as_in_contact() -> None:
    """Open, and the force of the stage's output, is the same flow as in contact."""
    system, circuit = prediction().reduction.system(), prediction().circuit
    part, (stop,) = _linear(prediction()), prediction().stops
    A = ((part.shapes * part.roots) @ np.linalg.inv(part.shapes)).real
    x = np.array([1.3 * stop.ends[1], 0.7, -2.0, 0.4])
    touching = system.mode(circuit.carrying(circuit.stops[0].contacts[0][1]))
    output = stop.output_of(x[:1])[0]
    np.testing.assert_allclose(
        A @ x + part.stops[0] * output,
        touching.A @ x + touching.d,
        atol=2e-3 * np.abs(touching.A @ x).max(),
    )


def test_only_a_sine_that_is_cut_off_is_one() -> None:
    """Of one pulse in each period that rests on a level else, what is above it is like a sine of
    three times the frequency."""
    time = np.linspace(0.0, 0.1, 4000)
    wave = np.sin(2.0 * np.pi * 83.1 * time)
    pulse = np.where((83.1 * time) % 1.0 < 1.0 / 6.0, np.sin(6.0 * np.pi * 83.1 * time), 0.0)
    cases = {"clipped": np.maximum(wave, -0.6), "pulses": np.maximum(pulse, 0.0)}
    left = {}
    for name, values in cases.items():
        cut = values == values.min()
        balance = ForceBalance(prediction(), time, values[:, None], cut[:, None])
        frequency, left[name] = balance.sine(0)
        assert name == "pulses" or frequency == pytest.approx(83.1, rel=1e-6)
    assert left["clipped"] < 1e-9
    assert left["pulses"] > 0.1


def test_a_sine_alone_is_taken_for_the_generator() -> None:
    time = np.linspace(0.0, 0.1, 4000)
    record = Record(time, {"CH1": 5.0 * np.sin(2.0 * np.pi * 83.1 * time)}, "made")
    with pytest.raises(InputError, match="a net of the board as well"):
        recorded_motion(record, prediction())


@pytest.mark.parametrize("number", quick([8, 35, 43, 73]))
def test_a_setting_that_is_in_no_file(number: int) -> None:
    """These were sure of another frequency, or of another net on a channel: two with the generator
    recorded (one chaotic, one 1-1-1 whose v1 looks like the predicted v3), 1-1-1 at 366 Hz without
    it, and 3-5-5 whose laps were taken for drive periods."""
    truth = drawn(number)
    motion = recorded_motion(truth.record, prediction(), stated=truth.channels)
    name = identify_response(motion, prediction())
    assert name.motion.frequency == pytest.approx(truth.frequency, rel=2e-4)
    assert name.motion.channels == {net: f"CH{k + 1}" for k, net in enumerate(truth.nets)}
    assert (name.response, name.sure) == (truth.response, True)


def test_corners_without_noise_are_no_longer_period() -> None:
    """A curve does not follow a corner, and of that each lap has other samples: the record was
    taken for one of twice the period, then for none."""
    (truth,) = drawn_records(synthesised(), range(10, 11), 20261)
    assert truth.clean
    name = identify_response(
        recorded_motion(truth.record, prediction(), stated=truth.channels), prediction()
    )
    assert (name.response, name.sure) == (truth.response, True)


def test_what_hardly_fits_is_not_taken_but_leaves_nothing_sure() -> None:
    """Of three channels one way explains most, and misses the greatest misfit by a little; one that
    explains less was then the only one, and sure."""

    class Given:
        """Two ways, whatever the channels are."""

        def __init__(self, misfit: float) -> None:
            self.misfit = misfit

        def assignments(self, most: int) -> Iterator[Balance]:
            assert most > 0
            yield Balance(("fv", "v3", "v1"), self.misfit, 15.7, True, 193.4)
            yield Balance(("fv", "vg", "v3"), 1.1, 11.3, True, 193.4)

    shown = ["CH1", "CH2", "CH3"]
    best, doubt, _ = _recognised(cast(ForceBalance, Given(5.2)), shown, "vg")
    assert best.nets == ("fv", "vg", "v3")
    assert "v3=CH2" in doubt
    best, doubt, _ = _recognised(cast(ForceBalance, Given(50.0)), shown, "vg")
    assert (best.nets, doubt) == (("fv", "vg", "v3"), "")


@pytest.mark.parametrize("third", [0.0, 0.15])
def test_a_sine_that_could_be_a_displacement_is_the_generator_but_not_sure(third: float) -> None:
    """As a displacement it was sure, for so it explained another channel as well; with a third
    harmonic it cannot be the generator's."""

    class Given(ForceBalance):
        """Two ways, whatever the channels are."""

        def assignments(self, most: int) -> Iterator[Balance]:
            assert most > 0
            yield Balance(("fv", "v3"), 0.7, 20.6, True, 83.1)
            yield Balance(("fv", "vg"), 0.1, 12.4, False, 83.1)

    time = np.linspace(0.0, 0.1, 4000)
    angle = 2.0 * np.pi * 83.1 * time
    wave = np.sin(angle) + third * np.sin(3.0 * angle)
    values = np.column_stack([np.maximum(np.abs(wave) - 0.5, 0.0), wave])
    balance = Given(prediction(), time, values, np.zeros(values.shape, dtype=bool))
    best, doubt, remedy = _recognised(balance, ["CH1", "CH2"], "vg")
    if third:
        assert (best.nets, doubt, remedy) == (("fv", "v3"), "", "")
    else:
        assert best.nets == ("fv", "vg")
        assert "CH2, a sine as the generator's, may be v3 as well" in doubt
        assert "vg=CH2" in remedy


def test_without_what_tells_the_drive_nothing_is_sure() -> None:
    """fv alone, 297 Hz: one period of it may be of one drive period or of several."""
    truth = drawn(46)
    assert truth.nets == ("fv",)
    motion = recorded_motion(truth.record, prediction(), stated={"fv": "CH1"})
    name = identify_response(motion, prediction())
    assert not name.sure
    assert "the drive frequency" in name.reason
    assert "--omega" in name.would_tell
    said = recorded_motion(
        truth.record, prediction(), stated={"fv": "CH1"}, frequency=0.99 * truth.frequency
    )
    name = identify_response(said, prediction())
    assert (name.response, name.sure) == (truth.response, True)


def test_one_channel_that_was_not_said_is_not_sure() -> None:
    truth = drawn(70)
    assert truth.nets == ("v1",)
    open_ = identify_response(recorded_motion(truth.record, prediction()), prediction())
    assert not open_.sure
    assert "--channels v1=CH1" in open_.would_tell
    said = identify_response(
        recorded_motion(truth.record, prediction(), stated={"v1": "CH1"}), prediction()
    )
    assert (said.response, said.sure) == (truth.response, True)
    assert said.motion.frequency == pytest.approx(truth.frequency, rel=2e-4)
