"""Which channel of a record shows which net of the board, told or found by the shapes.

A period of each channel is laid over the predicted wave of each net, at every phase of the drive.
The nets' shapes and sizes tell them apart: the generator is a pure sine of a known amplitude, the
output of a dead zone is flat half of the time, a displacement is neither. All channels share one
phase.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from designer.base.arrays import Array, Mask
from designer.base.errors import InputError
from designer.workbench.drive_estimate import (
    FEWEST_PERIODS,
    drive_frequency,
    near_frequency,
    sine,
    sine_frequency,
)
from designer.workbench.folding import POINTS, Samples, best_knots, fold, samples_of
from designer.workbench.force_balance import Balance, ForceBalance
from designer.workbench.prediction import (
    LEVEL,
    POINTS as WAVE_POINTS,
    SAME_FREQUENCY,
    BoardPrediction,
    nearest,
)
from designer.workbench.record import Record, RecordedMotion

BAND = 0.15
"""How far the drive may be from a setting's frequency, over that frequency."""
ASKED = 3
"""Wanted responses, the nearest in frequency, whose waves channels are laid over."""
GAIN = (0.75, 1.33)
"""How many times its prediction a channel may be."""
ALIKE = 0.35
"""Share of a channel's power that its net's wave may leave, in the mean over the channels."""
APART = 0.02
"""Least difference of that share to the next way of saying which channel is which."""
KNOTS = 64
"""Knots of a period."""
STEPS, STRETCH = 64, 1 << 14
"""Of the fastest that a board does: samples of its period that equations of motion are held
against; and the most samples of a record."""
SINE_LEFT = 0.04
"""What is left of the generator's channel where that is a sine, over its amplitude."""
MOST_WAYS = 6000
"""Ways of giving channels to nets; where there are more, the user has to say which net a channel
shows."""
FITS, LOOSE = 5.0, 10.0
"""Misfit of channels that are taken for those nets; and up to which what they leave is taken for
the drive where they are told."""
CLEARER, LITTLE = 3.0, 1.0
"""Logarithm of how much more an assignment has to explain than the next; and of what it has to
explain at all."""


def recorded_motion(
    record: Record,
    prediction: BoardPrediction,
    *,
    frequency: float | None = None,
    stated: Mapping[str, str] | None = None,
) -> RecordedMotion:
    """A record with the nets that its channels show and its drive.

    frequency : about that of the drive [Hz], for a record without the generator; else it is found.
    stated : the channel of each net; what it does not name is left out. Else the channels are
    recognised: by the board's equations of motion (``force_balance``), and where these say nothing
    by the shapes that the nets have at the nearest settings.

    Raises
    ------
    InputError : a net or channel that is not there; a record shorter than two drive periods; or one
        whose channels are like no nets of the board.
    """
    if stated:
        _check(record, prediction, stated)
        if set(stated) == {prediction.generator}:
            expected = "a net of the board as well"
            raise InputError(None, "--channels", "the generator alone", expected)
    channels = tuple(dict.fromkeys(stated.values())) if stated else tuple(record.signals)
    shown = [c for c in channels if record.moves(c)]
    if not shown:
        raise InputError(record.source, "its channels", "no signal", "a channel that moves")
    band = (0.0, math.inf) if frequency is None else _near(frequency)
    balance = ForceBalance(prediction, *_stretch(record, shown, prediction), band)
    if stated:
        net_of = {channel: net for net, channel in stated.items()}
        best, doubt, remedy = balance.balance([net_of[c] for c in shown]), "", ""
    else:
        best, doubt, remedy = _recognised(balance, shown, prediction.generator)
        _not_alone(record, best.nets, shown[0], prediction)
    nets = dict(stated) if stated else dict(zip(best.nets, shown, strict=False))
    drive = best.frequency
    if best.misfit > LOOSE and prediction.generator not in nets:
        drive = math.nan
    if not math.isfinite(drive):
        drive = _by_shape(record, shown, prediction, frequency)
        if frequency is None and not _is_set(drive, prediction):
            doubt = doubt or "its channels do not tell the drive frequency"
            remedy = remedy or "the generator on a channel as well, or --omega"
    if record.duration * drive < FEWEST_PERIODS:
        raise _short(record, record.duration * drive)
    samples = samples_of(record, shown, drive)
    if not nets:
        nets = _found(record, samples, shown, drive, prediction)
        _not_alone(record, nets, shown[0], prediction)
        doubt = doubt or "its channels were recognised by their shapes alone"
        remedy = remedy or _example(nets)
    if not stated and not doubt and (other := _cut_as_an_output(record, nets, prediction)):
        channel, output = other
        doubt = f"{channel}, which is cut off where {output} rests, may be {output}"
        remedy = _example({**{n: c for n, c in nets.items() if c != channel}, output: channel})
    if not stated and not doubt and prediction.circuit.bends:
        laws = ", ".join(dict.fromkeys(bend.bend_of for bend in prediction.circuit.bends))
        doubt = f"its channels were recognised without the spread of the bends of {laws}"
        remedy = _example(nets)
    motion = _motion(record, samples, shown, nets, prediction.generator, drive)
    return replace(motion, doubt=doubt, remedy=remedy)


def _not_alone(
    record: Record, nets: Iterable[str], channel: str, prediction: BoardPrediction
) -> None:
    """InputError for a record that shows nothing but the generator."""
    if tuple(nets) == (prediction.generator,):
        found = f"{channel}, which is like the generator{_cut_off(record, [channel])}"
        expected = f"a net of the board as well, or --channels, such as v1={channel}"
        raise InputError(record.source, "its channels", found, expected)


def _cut_off(record: Record, shown: Sequence[str]) -> str:
    """Words on the channels whose signal is beyond their range; "" where none is."""
    return "".join(f"; {c} is cut off at its range's end" for c in shown if c in record.clipped)


def _recognised(
    balance: ForceBalance, shown: Sequence[str], generator: str
) -> tuple[Balance, str, str]:
    """The assignment that obeys the equations and explains most of the channels by each other, with
    what speaks against it; one of no nets where they leave it open, with the frequency of a channel
    that is a sine.

    It is sure where every other one explains clearly less: a channel that could be any net, for
    nothing tests it or needs it, is one of which another assignment explains as much. A channel
    that is a sine is taken for the generator's where that fits, however much it explains as a
    displacement: in a linear part of the board, far from the stops, that is one as well.
    """
    loose = [each for each in balance.assignments(MOST_WAYS) if not each.misfit >= LOOSE]
    loose.sort(key=lambda each: -each.explained)
    every = [each for each in loose if not each.misfit >= FITS]
    if not every or not every[0].explained > LITTLE:
        return _by_shapes(balance, shown)
    # One that hardly fits is not taken, but rules out that another is sure.
    best = every[0]
    others = [each for each in loose if each is not best]
    example = _example(dict(zip(best.nets, shown, strict=True)))
    if len(shown) == 1:
        return best, "one channel alone may show another net", example
    sine_as = _with_generator(balance, best, every, generator)
    if sine_as is not None:
        place = sine_as.nets.index(generator)
        doubt = f"{shown[place]}, a sine as the generator's, may be {best.nets[place]} as well"
        return sine_as, doubt, _example(dict(zip(sine_as.nets, shown, strict=True)))
    if others and best.explained - others[0].explained < CLEARER:
        if not best.whole:
            return _by_shapes(balance, shown)
        other = ", ".join(f"{net}={c}" for net, c in zip(others[0].nets, shown, strict=True))
        return best, f"its channels may be {other} as well", example
    return best, "", ""


def _cut_as_an_output(
    record: Record, nets: Mapping[str, str], prediction: BoardPrediction
) -> tuple[str, str] | None:
    """A channel taken for a displacement that is cut off where a dead zone's output that was not
    recognised rests inside its clearance, and that output: in contact it follows the displacement.
    """
    for net, channel in nets.items():
        room = LEVEL * record.span[channel]
        for stop in prediction.stops:
            near = any(abs(end - stop.inside[0]) <= room for end in record.limits[channel])
            if near and stop.output not in nets and net in stop.displacement:
                return channel, stop.output
    return None


def _with_generator(
    balance: ForceBalance, best: Balance, every: Sequence[Balance], generator: str
) -> Balance | None:
    """The assignment with a channel that is a sine as the generator's, if it is among those that
    fit."""
    for each in every:
        differing = [k for k, net in enumerate(each.nets) if net != best.nets[k]]
        if [each.nets[k] for k in differing] == [generator] and math.isfinite(
            balance.sine_of_all(differing)
        ):
            return each
    return None


def _by_shapes(balance: ForceBalance, shown: Sequence[str]) -> tuple[Balance, str, str]:
    """No assignment, and the frequency of a channel that is a sine."""
    frequency = balance.sine_of_all(range(len(shown)))
    return Balance((), math.nan, 0.0, False, frequency), "", ""


def _example(nets: Mapping[str, str]) -> str:
    return "--channels " + ",".join(f"{net}={channel}" for net, channel in nets.items())


def _stretch(
    record: Record, shown: Sequence[str], prediction: BoardPrediction
) -> tuple[Array, Array, Mask]:
    """Times (k,) [s] and voltages (k, c) of the record's begin, neighbours averaged to what the
    board's equations need, and where they are cut off (k, c)."""
    fastest = max([prediction.fastest, *(s.frequency_hz for s in prediction.settings)])
    width = max(int(1.0 / (fastest * STEPS * record.interval)), 1)
    return record.means(shown, width, STRETCH)


def _by_shape(
    record: Record, shown: Sequence[str], prediction: BoardPrediction, frequency: float | None
) -> float:
    """The drive frequency [Hz] at which the record lies on itself, near the settings or near the
    one that was said; of several the nearest to that."""
    low, high = _band(prediction, frequency)
    samples = samples_of(record, shown, high)
    if record.duration * high < FEWEST_PERIODS:
        raise _short(record, record.duration * high)
    drive, _ = drive_frequency(samples, low, high)
    return drive


def _is_set(frequency: float, prediction: BoardPrediction) -> bool:
    """Whether a frequency is that of a setting, as a scope's clock shows it."""
    return any(abs(frequency / s.frequency_hz - 1.0) < SAME_FREQUENCY for s in prediction.settings)


def _motion(
    record: Record,
    samples: Samples,
    shown: Sequence[str],
    nets: Mapping[str, str],
    generator: str,
    frequency: float,
) -> RecordedMotion:
    """The motion with the drive by the generator's channel, where there is one; else by how the
    record lies on itself."""
    channel = nets.get(generator)
    amplitude = offset = phase = math.nan
    if channel is not None and channel in shown:
        place = list(shown).index(channel)
        free = ~samples.cut[:, place]
        time, values = samples.time[free], samples.values[free, place]
        frequency = sine_frequency(time, values, frequency)
        fit = sine(time, values, frequency)
        if fit.left > SINE_LEFT * fit.amplitude:  # no clean sine: how the record repeats says more
            frequency, _ = near_frequency(samples, frequency, (KNOTS,))
            fit = sine(time, values, frequency)
        length = float(np.ptp(time))
        error = (
            math.sqrt(6.0 / len(values)) * fit.left / (math.pi * fit.amplitude * length)
        )  # Cramér and Rao's bound
        amplitude, offset = fit.amplitude, fit.offset
        phase = fit.phase
    else:
        knots = (KNOTS, max(best_knots(samples, frequency)))
        frequency, error = near_frequency(samples, frequency, knots)
    return RecordedMotion(record, dict(nets), generator, frequency, error, amplitude, offset, phase)


def _check(record: Record, prediction: BoardPrediction, stated: Mapping[str, str]) -> None:
    for net, channel in stated.items():
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


def _near(frequency: float) -> tuple[float, float]:
    return (1.0 - BAND) * frequency, (1.0 + BAND) * frequency


def _band(prediction: BoardPrediction, frequency: float | None) -> tuple[float, float]:
    """Least and greatest drive frequency [Hz] that is looked for by shape."""
    if frequency is not None:
        return _near(frequency)
    known = [s.frequency_hz for s in prediction.settings]
    if not known:
        raise InputError(None, "--omega", "no wanted response in the design", "the drive frequency")
    return (1.0 - BAND) * min(known), (1.0 + BAND) * max(known)


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
        found = f"{', '.join(shown)} {alike}{_cut_off(record, shown)}"
        expected = f"--channels, such as {example}"
        raise InputError(record.source, "its channels", found, expected)
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
