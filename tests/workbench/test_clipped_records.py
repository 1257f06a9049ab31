"""Records with channels that are cut off: it is said, and what the rest tells is named."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from benchmarks.exact_records import drawn_records
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.force_balance import ForceBalance
from designer.workbench.naming import NamedMotion, identify_response
from designer.workbench.prediction import BoardPrediction
from designer.workbench.record import Record
from tests.shared.paper_cases import synthesised
from tests.workbench.stored_records import stored


@cache
def prediction() -> BoardPrediction:
    return BoardPrediction(synthesised())


def cut(number: int, net: str, share: float, sides: tuple[int, ...] = (1, -1)) -> NamedMotion:
    """The name of a stored record whose channel of a net is cut off at a share of its range."""
    truth = stored(number)
    told = {net: f"CH{k + 1}" for k, net in enumerate(truth.nets)}
    record = clipped_record(number, net, share, sides)
    return identify_response(recorded_motion(record, prediction(), stated=told), prediction())


def clipped_record(number: int, net: str, share: float, sides: tuple[int, ...] = (1, -1)) -> Record:
    """A stored record whose channel of a net is cut off at a share of its range."""
    truth = stored(number)
    channel = f"CH{truth.nets.index(net) + 1}"
    signal = truth.record.signals[channel]
    middle, half = (signal.max() + signal.min()) / 2.0, share * np.ptp(signal) / 2.0
    low = middle - half if -1 in sides else -np.inf
    high = middle + half if 1 in sides else np.inf
    signals = {**truth.record.signals, channel: np.clip(signal, low, high)}
    return Record(truth.record.time, signals, "made")


@pytest.mark.parametrize("net", ["v1", "fv"])
@pytest.mark.parametrize("number", [0, 2, 3])
def test_a_record_that_is_cut_off_at_three_quarters_is_named(number: int, net: str) -> None:
    """It was aperiodic, for its noise seemed smaller than it is."""
    truth, name = stored(number), cut(number, net, 0.75)
    assert set(name.clipped) == {net}
    assert None not in name.clipped[net]
    assert name.response == truth.response
    assert name.motion.frequency == pytest.approx(truth.frequency, rel=2e-4)


@pytest.mark.parametrize("net", ["v1", "fv"])
@pytest.mark.parametrize("number", [0, 3, 7])
def test_what_is_cut_off_is_held_against_the_equations_by_the_rest(number: int, net: str) -> None:
    """The right nets were refused, for what was cut off was taken for the signal: their misfit was
    4 to 33, and 5 is the most; so another net on the channel was left as the only one."""
    truth, record = stored(number), clipped_record(number, net, 0.65)
    names = tuple(record.signals)
    time = record.time - record.time[0]
    values = np.column_stack([record.signals[name] for name in names])
    gone = np.column_stack([record.cut(name) for name in names])
    assert gone[:, truth.nets.index(net)].mean() > 0.02
    balance = ForceBalance(prediction(), time, values, gone)
    right = balance.balance(truth.nets)
    assert right.misfit < 2.0
    others = [each for each in balance.assignments(6000) if each.nets != truth.nets]
    assert all(each.explained < right.explained for each in others if each.misfit < 5.0)


def test_an_output_that_is_cut_off_unseen_does_not_shift_the_stops() -> None:
    """Short tops are cut off before the noise comes in, which nothing shows. Through the dead zone
    the output moved the curve by four errors, and 1-8-6 was surely 1-8-5."""
    (truth,) = drawn_records(synthesised(), range(12, 13), 77)
    motion = recorded_motion(truth.record, prediction(), stated=truth.channels)
    name = identify_response(motion, prediction())
    assert truth.clipped == "fv"
    assert truth.response in (name.response, *name.others)
    assert not name.sure


def test_an_output_at_rest_is_not_cut_off() -> None:
    """Where nothing is noise, most samples of a dead zone's output are one value."""
    (stop,) = prediction().stops
    x = 2.0 * stop.ends[1] * np.sin(np.linspace(0.0, 30.0, 3000))
    touching = (x > stop.ends[1]) | (x < stop.ends[-1])
    resting = stop.resting(stop.output_of(x))
    assert resting[~touching].all()
    assert np.mean(resting[touching]) < 0.1


def test_a_displacement_that_is_cut_off_inside_the_clearance_does_not_count() -> None:
    """Below the stop it says nothing of contact; the output does."""
    stop = prediction().stops[0].ends[1]
    peak = np.abs(stored(2).record.signals["CH1"]).max()
    name = cut(2, "v1", 0.8 * stop / peak)
    assert name.response == stored(2).response


def test_only_one_side_is_cut_off() -> None:
    name = cut(3, "v1", 0.75, sides=(1,))
    low, high = name.clipped["v1"]
    assert low is None
    assert high is not None
