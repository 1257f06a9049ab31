"""The free motion that is left when the generator is switched off, and what it tells of a board.

Once the last contact is over the motion is linear: each displacement is a constant and, for each
resonance, a damped oscillation. Frequencies and damping ratios are the board's; the constant and
the sizes are free, so neither the scope's gain nor its zero enters, nor how the motion began. They
are solved for at every board that is asked (variable projection: Golub and Pereyra, SIAM Journal on
Numerical Analysis 10, 1973).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.circuit.board_modes import mode_rows
from designer.workbench.board_prior import PROBE, Prior
from designer.workbench.observation import CELLS, ScopeErrors
from designer.workbench.prediction import BoardPrediction, PredictedStop
from designer.workbench.record import Record

MOST_SAMPLES = 2048
"""Samples that are kept of a channel: of a longer record so many means of neighbours."""
CONTACT = 0.05
"""Of a dead zone's output at a contact as deep as the clearance: how far from where it ends it is
in contact. Inside the clearance it may follow the displacement by a hundredth of that."""
ON = 0.05
"""Of the range of the generator's channel: how far from where it ends it is still on."""
END = 0.1
"""The share of a record at its end where everything rests."""
FEWEST = 1.5
"""Periods of the nominal board's slowest resonance that a decay lasts at least."""
LOUDEST, CLEAR = 2.0, 6.0
"""Times the noise that it is at least in its first period (RMS); and that a contact stands out."""
STEP, LEAST = 1e-4, 1e-2
"""The step of a difference quotient, over the resonance; and the least damping ratio for it."""
REAL = 1e-9
"""An imaginary part that is rounding, over the root."""


@dataclass(frozen=True)
class FreeDecay:
    """Displacements of a board in free motion inside its clearances."""

    time: Array
    """(k,) seconds since the motion is free."""
    volts: Array
    """(k, nets) voltages [V]."""
    sigma: Array
    """(nets,) standard deviation [V] that a sample counts with."""

    def residual(self, resonances: Array) -> Array:
        """(k · nets,) what is left of it by resonances (pairs, 2) [rad/s, damping ratio], over what
        is allowed for."""
        basis, _ = np.linalg.qr(_basis(self.time, resonances))
        volts = self.volts / self.sigma
        return np.asarray(volts - basis @ (basis.T @ volts)).ravel()

    def of_board(self, prior: Prior, z: Array) -> Array:
        """(k · nets,) the same by the resonances of the board at z (K,)."""
        return self.residual(_resonances_of(prior, z[None])[0])

    def slopes(self, prior: Prior, z: Array) -> Array:
        """(k · nets, K) change of that with each coordinate of the board."""
        here, *shifted = _resonances_of(prior, np.vstack([z, z + PROBE * np.eye(len(z))]))
        moved = (np.array(shifted) - here).reshape(len(z), -1) / PROBE
        base, columns = self.residual(here), []
        for index in np.ndindex(here.shape):
            near = here.copy()
            near[index] += STEP * max(abs(near[index]), LEAST)
            columns.append((self.residual(near) - base) / (near[index] - here[index]))
        return np.asarray(np.column_stack(columns) @ moved.T)


def resonances(A: Array) -> tuple[Array, Array]:
    """(N, pairs) undamped frequencies [rad/s] and damping ratios of x' = A x, (N, n, n), by
    frequency. Two real roots count as one pair, of a ratio above 1."""
    roots = np.linalg.eigvals(A).astype(complex)
    real = np.abs(roots.imag) <= REAL * np.abs(roots)
    # Those of an oscillation stand side by side; a real one may lie between two of them in size.
    order = np.lexsort((roots.imag, np.abs(roots), real), axis=1)
    roots = np.take_along_axis(roots, order, axis=1)
    first, second = roots[:, 0::2], roots[:, 1::2]
    frequency = np.sqrt(np.abs(first * second))
    damping = -(first + second).real / (2.0 * frequency)
    order = np.argsort(frequency, axis=1)
    return np.take_along_axis(frequency, order, axis=1), np.take_along_axis(damping, order, axis=1)


def recorded_decay(
    record: Record,
    channels: Mapping[str, str],
    prediction: BoardPrediction,
) -> FreeDecay:
    """The free part of a record that begins while the generator is on, or just after.

    channels : channel by net. It begins after the last contact that the dead zones' outputs show,
    by the longest period there is of drive and resonances: the drive, or a contact too slight to be
    seen, may come after it. Where the generator was recorded, not before it is off.

    Raises
    ------
    InputError : no displacement or not every dead zone's output is among the channels; what is left
        after the last contact is too short or too faint; or the board comes to rest on a stop.
    """
    named = {net: record.signals.get(channel) for net, channel in channels.items()}
    signals = {net: signal for net, signal in named.items() if signal is not None}
    outputs = [stop.output for stop in prediction.stops]
    nets = [net for net in prediction.circuit.displacements if net in signals]
    if not nets or not all(net in signals for net in outputs):
        found = ", ".join(signals) or "none of them"
        expected = f"a displacement and {' and '.join(outputs)}, as in the other records"
        raise InputError(record.source, "its channels", found, expected)
    middle = np.zeros((1, prediction.prior.size))
    slowest = 2.0 * np.pi / float(_resonances_of(prediction.prior, middle)[0, 0, 0])
    wait = max([slowest, *(1.0 / setting.frequency_hz for setting in prediction.settings)])
    time = record.time - record.time[0]
    over = [
        _last(record, channels[stop.output], CONTACT * _deep(stop)) for stop in prediction.stops
    ]
    begin = max(over, default=0.0) + wait
    if prediction.generator in signals:
        channel = channels[prediction.generator]
        begin = max(begin, _last(record, channel, ON * record.span[channel]))
    free = time >= begin
    lasts = float(time[-1] - begin)
    early = free & (time < begin + slowest)
    noise = {net: record.noise[channels[net]] for net in nets}
    nets = [n for n in nets if early.any() and np.std(signals[n][early]) > LOUDEST * noise[n]]
    if lasts < FEWEST * slowest or not nets:
        found = f"{1e3 * max(lasts, 0.0):.3g} ms of free motion after the last contact"
        expected = f"{1e3 * FEWEST * slowest:.3g} ms or more, clearly above the noise"
        raise InputError(record.source, "its length", found, expected)
    for stop in prediction.stops:
        _check_rest(stop, signals, record)
    volts = np.column_stack([signals[net][free] for net in nets])
    width = -(-len(volts) // MOST_SAMPLES)
    count = len(volts) // width
    kept = volts[: count * width].reshape(count, width, -1).mean(axis=1)
    peak = np.ptp(kept, axis=0) / 2.0
    cells = CELLS * max(lasts / slowest, 1.0)
    sigma = np.sqrt(
        np.array([noise[net] for net in nets]) ** 2 / width
        + (ScopeErrors().model * peak) ** 2 * count / cells
    )
    times = time[free][: count * width].reshape(count, width).mean(axis=1) - begin
    return FreeDecay(times, kept, sigma)


def _check_rest(stop: PredictedStop, signals: Mapping[str, Array], record: Record) -> None:
    """InputError where a board comes to rest on a stop: its free motion is that in contact."""
    if not all(net in signals for net in stop.displacement):
        return
    rest = sum(factor * _rest(signals[net]) for net, factor in stop.displacement.items())
    for side, end in stop.ends.items():
        if side * (rest - end) > 0.0:
            expected = f"one inside clearance {stop.clearance}, which ends at {end:.3g} V"
            raise InputError(record.source, "its end", f"a rest at {rest:.3g} V", expected)


def _rest(signal: Array) -> float:
    """Where a channel ends [V]."""
    return float(np.median(signal[-max(1, round(END * len(signal))) :]))


def _deep(stop: PredictedStop) -> float:
    """Output [V] of a contact as deep as the clearance, on the nominal board."""
    return max(abs(gain * stop.ends[side]) for side, gain in stop.gains.items())


def _last(record: Record, channel: str, least: float) -> float:
    """When a channel is last so far away from where it ends [V], [s since the first sample]; 0
    where it never is, or never leaves the noise."""
    signal = record.signals[channel]
    away = np.nonzero(np.abs(signal - _rest(signal)) > max(least, CLEAR * record.noise[channel]))[0]
    return float(record.time[away[-1]] - record.time[0]) if len(away) else 0.0


def _resonances_of(prior: Prior, z: Array) -> Array:
    """(N, pairs, 2) frequencies [rad/s] and damping ratios of the boards at z (N, K) with every
    clearance open."""
    circuit, n = prior.circuit, len(prior.circuit.states)
    rows = mode_rows(prior.boards(z), circuit.open, circuit.state_nets[:1])
    # Op-amps that drive diodes have states of their own, which do not act on the others here.
    return np.stack(resonances(rows.rates[:, :n, :n]), axis=-1)


def _basis(time: Array, resonances: Array) -> Array:
    """(k, 1 + 2 pairs) a constant and the free motions of each pair (pairs, 2), each of size 1."""
    columns = [np.ones_like(time)]
    for frequency, damping in resonances:
        if damping < 1.0:
            turn = np.sqrt(1.0 - damping**2) * frequency
            decay = np.exp(-damping * frequency * time)
            columns += [decay * np.cos(turn * time), decay * np.sinc(turn * time / np.pi) * time]
        else:  # the slower of two exponentials outside, so that neither overflows
            apart = np.sqrt(damping**2 - 1.0) * frequency
            decay = np.exp((apart - damping * frequency) * time)
            gone = -np.expm1(-2.0 * apart * time)
            columns += [
                decay * (1.0 - gone / 2.0),
                decay * (gone / (2.0 * apart) if apart else time),
            ]
        columns[-1] *= frequency
    return np.column_stack(columns)
