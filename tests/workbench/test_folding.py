"""Records of known curves laid on themselves."""

from __future__ import annotations

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.workbench.drive_estimate import (
    drive_frequency,
    refined_frequency,
    sine,
    sine_frequency,
)
from designer.workbench.folding import POINTS, best_knots, fold, samples_of
from designer.workbench.record import Record

FREQUENCY, SIGMA = 83.1, 0.02
TIME = np.linspace(0.0, 12.3 / FREQUENCY, 6000)


def wave(phase: Array) -> Array:
    """A smooth curve with harmonics, of period 1."""
    angle = 2.0 * np.pi * phase
    return np.sin(angle) + 0.4 * np.sin(3.0 * angle + 1.0) + 0.2 * np.cos(8.0 * angle)


def record(periods: float, points: int, double: float = 0.0) -> Record:
    """Noisy samples of the curve; double : amplitude of a part of twice its period."""
    rng = np.random.default_rng([points, int(1e6 * double)])
    time = np.linspace(0.0, periods / FREQUENCY, points)
    volts = wave(time * FREQUENCY) + double * np.sin(np.pi * FREQUENCY * time)
    return Record(time, {"CH1": volts + SIGMA * rng.normal(size=points)}, "made")


def test_the_curve_is_right_within_its_own_error() -> None:
    made = record(11.3, 6000)
    samples = samples_of(made, ["CH1"], FREQUENCY)
    curve = fold(samples, FREQUENCY, 1, best_knots(samples, FREQUENCY))
    off = curve.curve[:, 0] - wave(np.arange(POINTS) / POINTS)
    assert float(np.sqrt((off**2).mean())) == pytest.approx(float(curve.error[0]), rel=0.25)
    assert curve.error[0] < 0.2 * SIGMA
    assert curve.left[0] == pytest.approx(SIGMA, rel=0.05)
    rate = np.gradient(wave(np.arange(POINTS) / POINTS), 1.0 / POINTS)
    assert np.abs(curve.rate[5:-5, 0] - rate[5:-5]).max() < 0.05 * np.abs(rate).max()


def test_knots_are_chosen_on_the_whole_lap() -> None:
    """What a period leaves over of a motion of two hides how fine the curve is."""
    made, fine = record(12.3, 6000, 0.5), 0.05 * np.cos(80.0 * np.pi * FREQUENCY * TIME)
    samples = samples_of(Record(TIME, {"CH1": made.signals["CH1"] + fine}, "made"), ["CH1"], 83.1)
    left = {
        n: fold(samples, FREQUENCY, 2, best_knots(samples, FREQUENCY, n=n)).left[0] for n in (1, 2)
    }
    assert left[1] > 1.5 * SIGMA
    assert left[2] == pytest.approx(SIGMA, rel=0.05)


def test_many_samples_are_averaged_and_few_are_not() -> None:
    few, many = (samples_of(record(4.0, k), ["CH1"], FREQUENCY) for k in (2000, 60_000))
    assert len(few.time) == 2000
    assert len(many.time) < 5000
    assert many.noise[0] == pytest.approx(SIGMA / np.sqrt(60_000 / len(many.time)), rel=0.1)


@pytest.mark.parametrize("periods", [3.2, 19.0])
@pytest.mark.parametrize("double", [0.0, 0.05])
def test_the_frequency_is_found_among_its_multiples(periods: float, double: float) -> None:
    """The record repeats after two and three periods as well, and in part after a third of one."""
    samples = samples_of(record(periods, 8000, double), ["CH1"], 300.0)
    frequency, error = drive_frequency(samples, 35.0, 350.0)
    assert abs(frequency - FREQUENCY) < 6.0 * error + 1e-3 * double * FREQUENCY
    assert error < 1e-3 * FREQUENCY


def test_the_error_of_the_frequency_is_that_of_the_bound() -> None:
    """Cramér and Rao: 1/sigma^2 times the sum of (t x rate)^2 of the curve."""
    made = record(9.0, 5000)
    samples = samples_of(made, ["CH1"], FREQUENCY)
    frequency, error = refined_frequency(samples, 1.002 * FREQUENCY)
    time = made.time - made.time.mean()
    rate = np.gradient(wave(made.time * FREQUENCY), made.time * FREQUENCY)
    bound = SIGMA / np.sqrt(((time * rate) ** 2).sum())
    assert error == pytest.approx(bound, rel=0.1)
    assert abs(frequency - FREQUENCY) < 4.0 * bound


def test_a_sine_is_fitted_with_its_phase() -> None:
    time = np.linspace(0.0, 0.1, 3000)
    values = 4.0 * np.sin(2.0 * np.pi * 140.0 * time + 5.5) - 0.3
    frequency = sine_frequency(time, values, 139.0)
    found = sine(time, values, frequency)
    assert frequency == pytest.approx(140.0, rel=1e-9)
    assert (found.amplitude, found.phase, found.offset) == pytest.approx((4.0, 5.5, -0.3))
