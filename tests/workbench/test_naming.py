"""Boards that ngspice ran with full op-amps, recorded coarsely: what the records are called."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from designer.base.errors import InputError
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.naming import NamedMotion, identify_response
from designer.workbench.prediction import BoardPrediction
from designer.workbench.record import Record
from tests.shared.exploring import quick
from tests.shared.paper_cases import synthesised
from tests.workbench.stored_records import COUNT, stored


@cache
def prediction() -> BoardPrediction:
    return BoardPrediction(synthesised())


@cache
def name_of(number: int) -> NamedMotion:
    return identify_response(recorded_motion(stored(number).record, prediction()), prediction())


@pytest.mark.parametrize("number", quick(range(COUNT), 3))
def test_channels_and_drive_are_recognised(number: int) -> None:
    truth, motion = stored(number), name_of(number).motion
    assert motion.channels == {net: f"CH{k + 1}" for k, net in enumerate(truth.nets)}
    assert motion.frequency == pytest.approx(truth.frequency, rel=2e-4)
    assert np.isfinite(motion.amplitude) == ("vg" in truth.nets)
    if "vg" in truth.nets:
        assert motion.amplitude == pytest.approx(4.95, rel=0.03)


@pytest.mark.parametrize("number", quick(range(COUNT), 3))
def test_the_response_is_right_or_left_open(number: int) -> None:
    """Eight of the nine are sure, the eighth by the orbit of the board behind it; the last stands
    next to grazing, and its truth is among what is left open."""
    truth, name = stored(number), name_of(number)
    assert truth.response in (name.response, *name.others)
    assert name.sure == (number < 8)
    assert name.by_board == (number > 6)
    if name.sure:
        assert name.response == truth.response
        assert (name.reason, name.would_tell, name.others) == ("", "", ())
    else:
        assert name.reason
        assert name.would_tell


def test_the_stops_are_those_of_the_board() -> None:
    """Every record sees thresholds within the spread of the nominal ones, to a hundredth of a
    volt."""
    for number in range(COUNT):
        (zone,) = name_of(number).dead_zones.values()
        for side, end in prediction().stops[0].ends.items():
            assert abs(zone.ends[side] - end) < 0.12 * abs(end)
            assert zone.end_errors[side] < 0.02


@pytest.mark.parametrize("nets", [("v1",), ("fv",)])
def test_one_channel_is_enough_where_contacts_are_deep(nets: tuple[str, ...]) -> None:
    truth = stored(3)
    told = {net: f"CH{truth.nets.index(net) + 1}" for net in nets}
    motion = recorded_motion(truth.record, prediction(), frequency=truth.frequency, stated=told)
    name = identify_response(motion, prediction())
    assert name.response == truth.response
    assert not name.dead_zones


@pytest.mark.slow
def test_a_sine_that_drifts_is_no_period() -> None:
    """Two lines whose ratio is irrational never repeat; a decaying one settles."""
    truth, rng = stored(1), np.random.default_rng(4)
    time = np.linspace(0.0, 40.0 / truth.frequency, 20_000)
    base = 6.0 * np.sin(2.0 * np.pi * truth.frequency * time)
    beat = np.sin(2.0 * np.pi * truth.frequency * 0.6180339887 * time)
    fade = np.exp(-truth.frequency * time / 6.0)
    for more, response in ((beat, "aperiodic"), (2.0 * beat * fade, "not settled")):
        noisy = base + more + 0.02 * rng.normal(size=len(time))
        record = Record(time, {"CH1": noisy}, "made")
        motion = recorded_motion(
            record, prediction(), frequency=truth.frequency, stated={"v1": "CH1"}
        )
        assert identify_response(motion, prediction()).response == response


@pytest.mark.parametrize(("drift", "sure"), [(0.0, True), (1.5, False)])
def test_laps_that_drift_within_the_noise_are_not_sure(drift: float, sure: bool) -> None:
    """Under three periods of a sine whose height goes up and down by little more than the noise:
    one period leaves hardly more over than noise does, but it is of one sign for longer."""
    frequency, noise, rng = stored(1).frequency, 0.06, np.random.default_rng(6)
    time = np.linspace(0.0, 2.9 / frequency, 10_000)
    height = 6.0 + drift * noise * np.sin(2.0 * np.pi * 0.19 * frequency * time)
    volts = height * np.sin(2.0 * np.pi * frequency * time) + noise * rng.normal(size=len(time))
    record = Record(time, {"CH1": volts}, "made")
    motion = recorded_motion(record, prediction(), frequency=frequency, stated={"v1": "CH1"})
    name = identify_response(motion, prediction())
    assert (name.response.split("-")[0], name.sure) == ("1", sure)
    assert sure or "laps" in name.reason


def corners(points: int, periods: float, noise: float, subharmonic: float) -> Record:
    """A displacement of one sine and its fifth, and what is beyond two stops, by a converter of 8
    bits. noise : of each channel's range. subharmonic : height of half the frequency [V]."""
    frequency, rng = 80.0, np.random.default_rng(1)
    time = np.linspace(0.0, periods / frequency, points)
    angle = 2.0 * np.pi * frequency * time
    x = 6.0 * np.sin(angle) + 2.0 * np.sin(5.0 * angle) + subharmonic * np.sin(angle / 2.0)
    y = np.where(np.abs(x) > 4.0, x - 4.0 * np.sign(x), 0.0)
    signals = {}
    for name, volts in (("CH1", x), ("CH2", y)):
        noisy = volts + noise * np.ptp(volts) * rng.normal(size=points)
        step = np.ptp(noisy) * 1.1 / 256.0
        signals[name] = step * np.round(noisy / step)
    return Record(time, signals, "made")


@pytest.mark.parametrize(
    ("points", "periods", "noise", "subharmonic", "n"),
    [(13_000, 12.58, 5e-4, 0.0, "1"), (6000, 5.9, 1e-3, 0.03, "2")],
)
def test_steps_of_a_converter_are_no_longer_period(
    points: int, periods: float, noise: float, subharmonic: float, n: str
) -> None:
    """The first was of 5 drive periods, and sure: a longer lap draws some of the rounding. Its
    noise is too small to carry the signal from step to step, and the samples come nearly at the
    same times of every third lap: 1 or 3 it may be. A line at half the frequency, of half a
    hundredth of the peak, is a longer period."""
    record = corners(points, periods, noise, subharmonic)
    told = {"v1": "CH1", "fv": "CH2"}
    name = identify_response(
        recorded_motion(record, prediction(), frequency=80.0, stated=told), prediction()
    )
    assert name.response.split("-")[0] == n
    assert ("3 drive periods" in name.reason) == (noise < 1e-3)
    assert not (name.sure and noise < 1e-3)


@pytest.mark.parametrize("n", [5, 0])
def test_corners_between_few_samples_are_not_surely_aperiodic(n: int) -> None:
    """Straight lines between 11 corners a drive period, 60 samples, no noise. No curve follows the
    corners, so laps of 5 drive periods left far more than noise, and that was surely aperiodic.
    Corners that never come again, n = 0, are."""
    frequency, periods, samples, rng = 80.0, 40, 60.37, np.random.default_rng(2)
    place, laps = np.sort(rng.uniform(size=11)), np.arange(periods + 1)
    height = 6.0 * np.sin(2.0 * np.pi * place) + rng.normal(size=(n or len(laps), 11))
    cycles = 1.0 + np.arange(int((periods - 1) * samples)) / samples
    corner = (laps[:, None] + place).ravel(), height[laps % len(height)].ravel()
    record = Record(cycles / frequency, {"CH1": np.interp(cycles, *corner)}, "made")
    motion = recorded_motion(record, prediction(), frequency=frequency, stated={"v1": "CH1"})
    # What is doubtful of its drive is left out here.
    name = identify_response(replace(motion, doubt="", remedy=""), prediction())
    assert (name.response, name.sure) == ("aperiodic", not n)
    if n:
        assert f"laps of {n} drive periods" in name.reason
        assert name.would_tell == "more samples a drive period"


@pytest.mark.parametrize(("laps", "sure"), [(7.3, False), (10.5, True)])
def test_a_few_laps_of_three_periods_are_not_sure(laps: float, sure: bool) -> None:
    """Of a rig whose motion was intermittent, 7.3 laps near 3-3-3 were sure."""
    frequency, rng = stored(1).frequency, np.random.default_rng(8)
    time = np.linspace(0.0, 3.0 * laps / frequency, 12_000)
    angle = 2.0 * np.pi * frequency * time
    volts = 7.0 * np.sin(angle) + np.sin(angle / 3.0) + 0.02 * rng.normal(size=len(time))
    record = Record(time, {"CH1": volts}, "made")
    motion = recorded_motion(record, prediction(), frequency=frequency, stated={"v1": "CH1"})
    name = identify_response(motion, prediction())
    assert (name.response.split("-")[0], name.sure) == ("3", sure)
    assert sure or name.would_tell == "a record of 30 drive periods or more"


@pytest.mark.parametrize(
    ("told", "field", "found"),
    [
        ({"v9": "CH1"}, "--channels", "v9"),
        ({"v1": "CH7"}, "--channels v1", "CH7"),
        ({}, "its length", "drive periods"),
    ],
)
def test_what_cannot_be_is_refused(told: dict[str, str], field: str, found: str) -> None:
    record = stored(2).record
    short = replace(
        record,
        time=record.time[:600],
        signals={name: signal[:600] for name, signal in record.signals.items()},
    )
    with pytest.raises(InputError) as error:
        recorded_motion(short, prediction(), stated=told)
    assert error.value.field == field
    assert found in str(error.value)


def test_one_channel_that_is_like_the_generator_is_refused() -> None:
    """``v1``, cut off at 0, is: nothing was left to be named."""
    truth = stored(3)
    alone = {"CH1": np.maximum(truth.record.signals["CH1"], 0.0)}
    with pytest.raises(InputError, match=r"CH1 is cut off.*--channels, such as v1=CH1"):
        recorded_motion(Record(truth.record.time, alone, "made"), prediction())


def test_channels_that_look_like_nothing_are_asked_for() -> None:
    truth, rng = stored(2), np.random.default_rng(9)
    time = truth.record.time
    square = np.sign(np.sin(2.0 * np.pi * truth.frequency * time)) + 0.1 * rng.normal(size=4000)
    with pytest.raises(InputError, match="--channels, such as"):
        recorded_motion(Record(time, {"CH1": square, "CH2": -square}, "made"), prediction())
