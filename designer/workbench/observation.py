"""A record made ready to be held against orbits: volts of nets over the phase of the drive.

What an oscilloscope adds to a voltage is a gain of its own for each channel, an offset, a shift in
time and noise. Gains, offsets and shifts are unknowns of a fit, with the limits that a data sheet
gives them (``ScopeErrors``); the noise is the record's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.circuit.netlist import Excitation
from designer.workbench.record import RecordedMotion

MOST_SAMPLES = 8192
"""Samples that are kept of a channel: of a longer record so many means of neighbours."""
CELLS = 10
"""Stretches of a drive period in which what the exact circuit leaves out is independent."""


@dataclass(frozen=True)
class ScopeErrors:
    """Standard deviations of what stands between a board and its record."""

    gain: float = 0.02
    """Error of the gain of each channel, probe and all, a fraction."""
    offset: float = 0.02
    """Error of the offset of each channel, over the range of the screen."""
    shift: float = 1e-3
    """Error of the time between the generator's channel and the others, in drive periods."""
    amplitude: float = 0.0
    """Error of the generator's amplitude, a fraction. 0: the generator is the standard of the fit;
    its own error is not seen in a record and goes with every setting."""
    model: float = 5e-4
    """What the exact circuit with its op-amps' bandwidth leaves out, over the peak of the orbit:
    slew, second poles, recovery (measured against ngspice on full op-amps)."""


@dataclass(frozen=True)
class Observation:
    """Voltages of a board's nets in steady motion under one setting of the generator."""

    excitation: Excitation
    """The generator's setting."""
    nets: tuple[str, ...]
    """Nets of the board that were recorded, without the generator's."""
    phase: Array
    """(k,) drive periods since the phase at which orbits start (``Excitation.drive``)."""
    volts: Array
    """(k, nets) voltages [V]."""
    noise: Array
    """(nets,) standard deviation of the noise on ``volts`` [V]."""
    room: Array
    """(nets,) standard deviation of the scope's offset [V]."""
    aligned: bool
    """Whether the phase is known: the generator was recorded."""
    scope: ScopeErrors
    """What else the scope does."""
    n: int | None = None
    """Drive periods after which the motion repeats; None where that is not known."""
    first: float = 0.0
    """Drive periods since that phase at the record's first sample."""

    def spread_of(self, peak: Array) -> Array:
        """(nets,) standard deviation [V] that a sample counts with.

        peak : (nets,) of the orbit [V]. The noise averages out over the samples, what the exact
        circuit leaves out does not: it comes back in every period. So it counts as one error for
        each of ``CELLS`` stretches of a drive period.
        """
        span = min(float(np.ptp(self.phase)), 16.0)
        cells = CELLS * max(span, 1.0)
        return np.asarray(
            np.sqrt(self.noise**2 + (self.scope.model * peak) ** 2 * len(self.phase) / cells)
        )


def observe(
    motion: RecordedMotion,
    nets: Sequence[str],
    excitation: Excitation | None = None,
    n: int | None = None,
) -> Observation:
    """What a record says of these nets, those of them that were recorded.

    n : drive periods after which the motion repeats, where they are known. excitation : the
    generator's setting as it was set; without it the amplitude that was recorded, which is known
    as well as the scope's gain.

    Raises
    ------
    InputError : none of the nets was recorded in full, for a channel that is cut off says nothing;
        or the amplitude is neither given nor recorded.
    """
    scope = ScopeErrors()
    cut = motion.record.clipped
    there = tuple(net for net in nets if motion.has(net) and motion.channels[net] not in cut)
    source = motion.record.source
    if not there:
        raise InputError(None, source, "none of them", f"a channel that shows {' or '.join(nets)}")
    if excitation is None:
        if not np.isfinite(motion.amplitude):
            raise InputError(None, source, "no generator", "the amplitude that the generator has")
        excitation = Excitation(motion.frequency, motion.amplitude)
        scope = replace(scope, amplitude=max(scope.amplitude, scope.gain))
    aligned = bool(np.isfinite(motion.phase))
    time = motion.record.time - motion.record.time[0]
    # The board's drive is -amplitude · sin: half a period behind the generator's own sine.
    first = (motion.phase if aligned else 0.0) / (2.0 * np.pi) + 0.5
    volts = np.column_stack([motion.signal(net) for net in there])
    noise = np.array([motion.noise(net) for net in there])
    width = -(-len(time) // MOST_SAMPLES)
    return Observation(
        excitation=excitation,
        nets=there,
        phase=_means(first + motion.frequency * time, width),
        volts=_means(volts, width),
        noise=noise / np.sqrt(width),
        room=scope.offset * np.maximum(np.ptp(volts, axis=0), 256.0 * _quanta(motion, there)),
        aligned=aligned,
        scope=scope,
        n=n,
        first=first,
    )


def _quanta(motion: RecordedMotion, nets: Sequence[str]) -> Array:
    return np.array([motion.record.quantum[motion.channels[net]] for net in nets])


def _means(values: Array, width: int) -> Array:
    """Means of ``width`` neighbours along the first axis; what is left over at the end is cut."""
    count = len(values) // width
    shape = (count, width, *values.shape[1:])
    return np.asarray(values[: count * width].reshape(shape).mean(axis=1))
