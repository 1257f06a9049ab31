"""A record: its interval, the converter's steps and the noise, against what it was made with."""

from __future__ import annotations

import numpy as np
import pytest

from designer.workbench.record import Record, RecordedMotion, noise_of, step_of

RNG = np.random.default_rng(20261123)
TIME = np.linspace(-0.01, 0.09, 10001)
SINE = 3.0 * np.sin(2.0 * np.pi * 150.0 * TIME) + 0.4


@pytest.mark.parametrize("sigma", [1e-3, 0.03, 0.3])
def test_noise_is_that_of_the_draw(sigma: float) -> None:
    """Within its standard error, about 1.2 σ/√k for the median, with room for six estimates."""
    noisy = SINE + RNG.normal(0.0, sigma, len(TIME))
    assert noise_of(noisy) == pytest.approx(sigma, rel=0.06)


def test_a_kinked_signal_without_noise_shows_little() -> None:
    assert noise_of(np.abs(SINE)) < 1e-6 * np.ptp(SINE)


@pytest.mark.parametrize("bits", [8, 10, 12])
def test_a_converter_is_seen_by_its_steps(bits: int) -> None:
    step = 12.0 / 2**bits
    levels = step * np.round((SINE + RNG.normal(0.0, 0.03, len(TIME))) / step)
    written = np.array([float(f"{v:.6e}") for v in levels])
    assert step_of(written) == pytest.approx(step, rel=1e-4)


def test_values_that_do_not_come_back_have_no_step() -> None:
    assert step_of(SINE + RNG.normal(0.0, 0.03, len(TIME))) == 0.0
    assert step_of(np.full(50, 1.25)) == 0.0


def test_a_quiet_channel_has_the_noise_of_its_rounding() -> None:
    """Where the noise is far below a step most differences are 0; the step is what is not known."""
    step = 12.0 / 2**8
    record = Record(TIME, {"CH1": step * np.round(SINE / step)}, "here")
    assert record.noise["CH1"] >= step / np.sqrt(12.0) * (1.0 - 1e-9)


def test_a_motion_answers_by_nets_of_the_board() -> None:
    record = Record(TIME, {"CH1": SINE, "CH2": np.zeros_like(SINE)}, "here")
    motion = RecordedMotion(record, {"v1": "CH1"}, "vm", 150.0, 0.01, np.nan, np.nan, np.nan)
    assert record.interval == pytest.approx(1e-5)
    assert motion.periods == pytest.approx(15.0)
    assert motion.has("v1")
    assert not motion.has("vm")
    np.testing.assert_array_equal(motion.signal("v1"), SINE)


@pytest.mark.parametrize("share", [0.6, 0.75, 0.9])
@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize("noise", [0.002, 0.01, 0.02])
def test_a_channel_that_is_cut_off_is_seen(share: float, before: bool, noise: float) -> None:
    """By the converter, or before the noise comes in; the noise is what it is elsewhere."""
    rng = np.random.default_rng(5)
    peak, level = 3.0, 0.4 + share * 3.0
    signal = np.minimum(SINE, level) if before else SINE
    noisy = signal + noise * peak * rng.normal(size=len(TIME))
    noisy = noisy if before else np.minimum(noisy, level)
    step = 2.0 * peak / 200
    record = Record(TIME, {"CH1": step * np.round(noisy / step)}, "here")
    low, high = record.limits["CH1"]
    assert low == -np.inf
    assert high == pytest.approx(level, abs=4.0 * max(noise * peak, step))
    assert record.clipped == ("CH1",)
    assert record.noise["CH1"] == pytest.approx(
        np.hypot(noise * peak, step / np.sqrt(12.0)), rel=0.5
    )


@pytest.mark.parametrize("bits", [6, 8, 12])
@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01, 0.05])
def test_round_tops_are_not_cut_off(bits: int, noise: float) -> None:
    """A sine, one with a flat third harmonic, and pulses, however coarse the converter."""
    rng, phase = np.random.default_rng(6), 2.0 * np.pi * 150.0 * TIME
    waves = [np.sin(phase), np.sin(phase) + np.sin(3.0 * phase) / 12.0, np.sin(phase) ** 5]
    for wave in waves:
        noisy = wave + noise * rng.normal(size=len(TIME))
        step = 2.5 / 2**bits
        record = Record(TIME, {"CH1": step * np.round(noisy / step)}, "here")
        assert record.clipped == ()
