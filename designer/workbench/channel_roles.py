"""Which channel of a record shows which net of the board, told or found by the shapes.

A period of each channel is laid over the predicted wave of each net, at every phase of the drive.
The nets' shapes and sizes tell them apart: the generator is a pure sine of a known amplitude, the
output of a dead zone is flat half of the time, a displacement is neither. All channels share one
phase.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.workbench.drive_estimate import (
    FEWEST_PERIODS,
    drive_frequency,
    refined_frequency,
    sine,
    sine_frequency,
)
from designer.workbench.folding import POINTS, Samples, best_knots, fold, samples_of
from designer.workbench.prediction import POINTS as WAVE_POINTS, BoardPrediction, nearest
from designer.workbench.record import Record, RecordedMotion

BAND = 0.15
"""Of a setting's frequency: how far from it the drive may be."""
ASKED = 3
"""Wanted responses, the nearest in frequency, whose waves channels are laid over."""
GAIN = (0.75, 1.33)
"""How many times its prediction a channel may be."""
ALIKE = 0.35
"""Share of a channel's power that its net's wave may leave, in the mean over the channels."""
APART = 0.02
"""Least difference of that share to the next way of saying which channel is which."""
KNOTS = 64
"""Of a period."""


def recorded_motion(
    record: Record,
    prediction: BoardPrediction,
    *,
    frequency: float | None = None,
    told: Mapping[str, str] | None = None,
) -> RecordedMotion:
    """A record with the nets that its channels show and its drive.

    frequency : about that of the drive [Hz]; else it is looked for near all settings. told : the
    channel of each net; what it does not name is left out. Else the channels are recognised.

    Raises
    ------
    InputError : a net or channel that is not there; a record shorter than two drive periods; or one
        whose channels cannot be told apart.
    """
    if told:
        _check(record, prediction, told)
        if set(told) == {prediction.generator}:
            expected = "a net of the board as well"
            raise InputError(None, "--channels", "the generator alone", expected)
    channels = tuple(dict.fromkeys(told.values())) if told else tuple(record.signals)
    shown = [c for c in channels if record.span[c] > 0.0]
    if not shown:
        raise InputError(record.source, "its channels", "no signal", "a channel that moves")
    low, high = _band(prediction, frequency)
    samples = samples_of(record, shown, high)
    if record.duration * high < FEWEST_PERIODS:
        raise _short(record, record.duration * high)
    drive, _ = drive_frequency(samples, low, high)
    times = _whole(drive, prediction) if frequency is None else 1
    if times > 1:
        drive *= times
    if samples.time[-1] * drive < FEWEST_PERIODS:
        raise _short(record, record.duration * drive)
    for knots in (KNOTS, max(best_knots(samples, drive))):
        drive, error = refined_frequency(samples, drive, knots)
    nets = dict(told) if told else _found(record, samples, shown, drive, prediction)
    return _motion(record, samples, shown, nets, prediction.generator, drive, error)


def _motion(
    record: Record,
    samples: Samples,
    shown: Sequence[str],
    nets: Mapping[str, str],
    generator: str,
    frequency: float,
    error: float,
) -> RecordedMotion:
    """With the drive by the generator's channel, where there is one."""
    channel = nets.get(generator)
    amplitude = offset = phase = math.nan
    if channel is not None and channel in shown:
        values = samples.values[:, list(shown).index(channel)]
        own = sine_frequency(samples.time, values, frequency)
        fit = sine(samples.time, values, own)
        length = float(np.ptp(samples.time))
        by_sine = (
            math.sqrt(6.0 / len(values)) * fit.left / (math.pi * fit.amplitude * length)
        )  # Cramér and Rao's bound
        frequency, error = own, min(error, by_sine)
        amplitude, offset = fit.amplitude, fit.offset
        phase = fit.phase
    return RecordedMotion(record, dict(nets), generator, frequency, error, amplitude, offset, phase)


def _check(record: Record, prediction: BoardPrediction, told: Mapping[str, str]) -> None:
    for net, channel in told.items():
        if net not in prediction.nets:
            expected = f"one of the nets {', '.join(prediction.nets)}"
            raise InputError(None, "--channels", net, expected)
        if channel not in record.signals:
            expected = f"a channel of {record.source}: {', '.join(record.signals)}"
            raise InputError(None, f"--channels {net}", channel, expected)


def _short(record: Record, periods: float) -> InputError:
    return InputError(
        record.source,
        "its length",
        f"{record.duration:.4g} s, {periods:.2g} drive periods",
        "at least two drive periods",
    )


def _band(prediction: BoardPrediction, frequency: float | None) -> tuple[float, float]:
    """Least and greatest drive frequency [Hz] that is looked for."""
    known = [s.frequency_hz for s in prediction.settings] if frequency is None else [frequency]
    if not known:
        raise InputError(None, "--omega", "no wanted response in the design", "the drive frequency")
    return (1.0 - BAND) * min(known), (1.0 + BAND) * max(known)


def _whole(frequency: float, prediction: BoardPrediction) -> int:
    """How many times this the drive frequency is: a motion may repeat after several periods only,
    and without the generator's channel the settings say which are drive frequencies."""
    for times in range(1, 5):
        gaps = [abs(times * frequency / s.frequency_hz - 1.0) for s in prediction.settings]
        if min(gaps) < BAND:
            return times
    return 1


def _found(
    record: Record,
    samples: Samples,
    shown: Sequence[str],
    frequency: float,
    prediction: BoardPrediction,
) -> dict[str, str]:
    """Channel by net, by the shapes."""
    curve = fold(samples, frequency, 1, KNOTS).curve[:: POINTS // WAVE_POINTS]
    ways: list[tuple[float, dict[str, str]]] = []
    for response in nearest(prediction.responses, frequency)[:ASKED]:
        waves = np.array([_lap(response.waves[net]) for net in prediction.nets])
        for image in (waves, -np.roll(waves, WAVE_POINTS // 2, axis=1)):
            for rows in _assignments(_shares(curve.T, image)):
                share, places = rows
                ways.append((share, {prediction.nets[n]: shown[c] for c, n in enumerate(places)}))
    if not ways:
        expected = "--channels, such as v1=CH1,fv=CH2: the design has no wave to compare with"
        raise InputError(record.source, "its channels", ", ".join(shown), expected)
    ways.sort(key=lambda way: way[0])
    best = ways[0]
    others = [share for share, nets in ways if nets != best[1]]
    if best[0] > ALIKE or (others and others[0] - best[0] < APART):
        alike = "like no nets of the board" if best[0] > ALIKE else "like several nets of the board"
        example = ",".join(f"{net}={channel}" for net, channel in best[1].items())
        expected = f"--channels, such as {example}"
        raise InputError(record.source, "its channels", f"{', '.join(shown)} {alike}", expected)
    return best[1]


def _lap(wave: Array) -> Array:
    """(WAVE_POINTS,) mean of a wave's periods."""
    return np.asarray(wave.reshape(-1, WAVE_POINTS).mean(axis=0))


def _shares(channels: Array, waves: Array) -> Array:
    """(shifts, channels, nets) share of each channel's power that each wave leaves at each phase,
    the mean left out and the gain free within `GAIN`.

    channels, waves : (c, WAVE_POINTS), (m, WAVE_POINTS).
    """
    c = channels - channels.mean(axis=1, keepdims=True)
    w = waves - waves.mean(axis=1, keepdims=True)
    spectra = np.fft.rfft(c)[:, None] * np.conj(np.fft.rfft(w))[None]
    product = np.moveaxis(np.fft.irfft(spectra, WAVE_POINTS, axis=2), 2, 0)
    power_c = (c**2).sum(axis=1)[None, :, None]
    power_w = np.maximum((w**2).sum(axis=1)[None, None, :], 1e-300)
    gain = np.clip(product / power_w, *GAIN)
    return np.asarray((power_c - 2.0 * gain * product + gain**2 * power_w) / power_c)


def _assignments(shares: Array) -> list[tuple[float, tuple[int, ...]]]:
    """The best way to give each channel a net of its own, at each phase: the mean share, and the
    net's number for each channel; only the best of each way."""
    best: dict[tuple[int, ...], float] = {}
    for share in shares:
        if share.shape[0] > share.shape[1]:
            continue
        rows, columns = linear_sum_assignment(share)
        places = tuple(int(n) for n in columns)
        mean = float(share[rows, columns].mean())
        best[places] = min(mean, best.get(places, math.inf))
        # The next best way at this phase: one of the pairs forbidden in turn.
        for row, column in zip(rows, columns, strict=True):
            other = share.copy()
            other[row, column] = 1e6
            again, instead = linear_sum_assignment(other)
            mean = float(other[again, instead].mean())
            key = tuple(int(n) for n in instead)
            best[key] = min(mean, best.get(key, math.inf))
    return [(mean, places) for places, mean in best.items()]
