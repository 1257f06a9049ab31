"""An oscilloscope that records voltages as a bench scope does: coarse, noisy and a little wrong."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from designer.base.arrays import Array
from designer.workbench.record import Record

FILLED = 0.8
"""Of a channel's range that the signal fills, as a careful person sets it."""


@dataclass(frozen=True)
class SimulatedScope:
    """The scope, and how it is set."""

    points: int = 10_000
    """Samples of each channel."""
    periods: float = 10.0
    """Drive periods that it records."""
    channels: tuple[str, ...] = ("v1", "fv", "vg")
    """Nets at its inputs, in the order of the channels CH1, CH2, …."""
    bits: int = 8
    """Of its converter."""
    noise: float = 0.01
    """Standard deviation of each channel's noise, of the signal's peak."""
    jitter: float = 1e-5
    """Standard deviation of the time of a sample, of the drive period."""
    gain: float = 0.02
    """Bound of a channel's gain error, probe of 10:1 and scope together."""
    offset: float = 0.01
    """Bound of a channel's offset, of its range."""
    clock: float = 1e-4
    """Bound of the error of its clock, as a fraction."""
    probe: Mapping[str, float] = field(default_factory=dict)
    """Factor that a channel's voltages are shown too small by, for a probe that it was not told."""

    def record(
        self,
        time: Array,
        signals: Mapping[str, Array],
        period: float,
        rng: np.random.Generator,
    ) -> Record:
        """A record of these signals (k,) [V] at these times (k,) [s], which are at equal steps and
        longer than the record; begun at random."""
        start = rng.uniform(time[0], time[-1] - self.periods * period)
        shown = np.linspace(0.0, self.periods * period, self.points)
        clock = 1.0 + rng.uniform(-self.clock, self.clock)
        when = start + shown * clock + self.jitter * period * rng.normal(size=self.points)
        return Record(
            shown - shown[self.points // 2],
            {
                f"CH{k + 1}": self._channel(np.interp(when, time, signals[net]), net, rng)
                for k, net in enumerate(self.channels)
            },
            "simulated scope",
        )

    def _channel(self, volts: Array, net: str, rng: np.random.Generator) -> Array:
        """What a channel makes of a signal (k,) [V]."""
        peak = float(np.ptp(volts)) / 2.0
        extent = 2.0 * peak / FILLED
        seen = (1.0 + rng.uniform(-self.gain, self.gain)) * volts
        seen = seen + rng.uniform(-self.offset, self.offset) * extent
        seen = seen + self.noise * peak * rng.normal(size=len(volts))
        step = extent / 2**self.bits
        centre = float(volts.max() + volts.min()) / 2.0
        levels = np.clip(np.round((seen - centre) / step), -(2 ** (self.bits - 1)), None)
        levels = np.minimum(levels, 2 ** (self.bits - 1) - 1)
        return np.asarray((centre + step * levels) / self.probe.get(net, 1.0))
