"""Side conditions as the search sees them: what each one limits, and how a limit is tightened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.catalog.entries import OpAmp
from designer.catalog.fields import Figure
from designer.circuit.design import ConditionCheck, Design
from designer.circuit.noise_gains import stages
from designer.circuit.resistors import effective
from designer.linear_network.linear_terms import Bounds, Targets
from designer.model.circuit_table import CircuitSpec
from designer.model.find_responses import Peaks, Reach

SWING_SHARE = 0.85
"""Of the op-amp's limit: what the peaks of an output may use; the rest is for spread."""
LEVEL_RATIO = 4.0
"""Largest ratio between the peaks of the state voltages that belong together."""
SHARE = 1.6
"""How much larger than x1's peak voltage another state's may be: the clearance gets the swing."""
LEAST_SIGNAL = 10.0
"""Peak of x1 over the op-amp's largest offset: below it a circuit shows offsets, not dynamics."""
LOAD, SIGNAL = 2e3, (4.7e3, 5e5)
"""Least load of an output [ohm]; range of the signal resistors [ohm], for load and for noise."""
NOISE_GAIN = 30.0
"""Of a stage whose gain is a ratio of resistors: its offset and noise appear so much larger."""
BANDWIDTH_SHARE = 0.05
"""Of the gain-bandwidth: noise gain times frequency of the highest harmonic that matters, so that
the phase error of a stage there, where a velocity has a thousandth of its largest harmonic, stays
below 0.05 rad."""
GENERATOR_PEAK = 5.0
"""Largest amplitude asked of a generator [V]: 10 V peak to peak, what common ones give."""
INVERTER_GAIN = 2.0
"""Noise gain of an inverter, which every circuit has."""
VOLTAGES = ("swing_v", "guaranteed_swing_v", "rectifier_fv_v", "generator_peak_v")
"""Checks that smaller voltages bring inside their limits."""
STEEP = 2.0
"""Most that voltages are lowered by in one round: a limit that falls with the current may be 0."""
MARGIN = 1e-3
"""How much further than the excess a limit is tightened."""


@dataclass(frozen=True)
class Aims:
    """What a choice of parts aims at inside its side conditions; a search moves these."""

    swing: float = SWING_SHARE
    """Share of the op-amp's limit that the peaks of the outputs may use."""
    share: float = SHARE
    """How much larger than x1's peak voltage another state's may be."""
    noise_gain: float = NOISE_GAIN
    """Noise gain of a stage whose gain is a ratio of resistors."""


NO_AIMS = Aims()
"""The side conditions themselves."""


@dataclass(frozen=True)
class ConditionLimits:
    """Limits of the side conditions; those of conditions that do not hold are infinite or zero."""

    conditions: frozenset[str]
    """Names of the conditions that hold."""
    seconds: tuple[float, float]
    """Range of the time scale [s per unit of model time]."""
    swing: float
    """What the peaks of the outputs are aimed at [V], whether or not it is a condition."""
    level: float
    """Largest ratio between the peaks of the state voltages of one mass."""
    share: float
    """How much larger than x1's peak voltage another state's may be."""
    load: float
    """Least resistance that a part may put on an output [ohm]."""
    signal: tuple[float, float]
    """Range of the signal resistors [ohm]."""
    noise_gain: float
    """Largest noise gain of a ratio stage."""

    def bounds(self, mu: float, peaks: Peaks, resistors: Array, mass: int = 0) -> Bounds:
        """What the linear block has to keep. mu : stop stiffness over that of the mass's springs
        (K1); 0 without a stop. mass : index of the one at the first stop."""
        least = max(self.load, float(resistors.min()))
        return Bounds(
            seconds=self.seconds,
            level=self.level,
            share=self.share,
            stop=least * mu / output_gain(peaks, mass),
            peaks=peaks.states,
            signal=self.signal,
            mass=mass,
        )

    def tightened(
        self, broken: Sequence[ConditionCheck], design: Design, *, slower: bool
    ) -> ConditionLimits:
        """Limits that should bring these checks of a finished design inside theirs.

        slower : whether bandwidth is sought in a slower time scale; otherwise in a smaller gain of
        the dead zone's stages, which costs nothing where it can be had.
        """
        out = self
        # The swing of a design that is well inside it is lowered from where the design is.
        top = max((c.found for c in design.checks if c.quantity == "swing_v"), default=np.inf)
        for check in broken:
            by = check.excess * (1.0 + MARGIN)
            if check.quantity in VOLTAGES:
                out = replace(out, swing=min(out.swing, top) / min(by, STEEP))
            elif check.quantity == "signal_level_ratio":
                out = replace(out, level=out.level / by)
            elif check.quantity == "signal_share_ratio":
                out = replace(out, share=out.share / by)
            elif check.name == "load":
                out = out._lighter(design, check.where)
            elif check.name == "noise_gain":
                out = replace(out, noise_gain=out.noise_gain / by)
            elif check.name == "bandwidth" and slower:
                seconds = design.errors.scales.seconds * by
                out = replace(out, seconds=(seconds, out.seconds[1]))
            elif check.name == "bandwidth":
                gain = next(s.gain for s in stages(design.circuit) if s.section.name == check.where)
                out = replace(out, noise_gain=min(out.noise_gain, gain / by))
        return out

    def _lighter(self, design: Design, section: str) -> ConditionLimits:
        """Without the resistor that loads this section's output most, and any as small."""
        outputs = next(s.outputs for s in stages(design.circuit) if s.section.name == section)
        values = effective(design.circuit.values, design.composites)
        loads = [r for r in design.circuit.resistors if outputs & set(r.nets)]
        heaviest = min(loads, key=lambda r: r.value)
        floor = values.get(heaviest.name, heaviest.value) * (1.0 + MARGIN)
        own = heaviest.name in Targets.of(design.model).resistors
        low = max(floor, self.signal[0]) if own else self.signal[0]
        return replace(self, load=max(floor, self.load), signal=(low, self.signal[1]))


def limits(
    spec: CircuitSpec,
    conditions: frozenset[str],
    opamp: OpAmp,
    saturation: float,
    fastest: float,
    aims: Aims = NO_AIMS,
    unit: float = 1.0,
) -> ConditionLimits:
    """The limits of these conditions for an op-amp with this output limit [V].

    fastest : angular frequency, in model units, of the highest harmonic that matters. unit : the
    angular frequency, in model units, that shall lie in the file's band.
    """
    low, high = spec.frequency
    seconds = unit / (2.0 * np.pi * high), unit / (2.0 * np.pi * low)
    if "bandwidth" in conditions:
        least = INVERTER_GAIN * fastest / (2.0 * np.pi * bandwidth_limit(opamp))
        seconds = max(seconds[0], least), seconds[1]
    inf = float("inf")
    return ConditionLimits(
        conditions=conditions,
        seconds=seconds,
        swing=min(SWING_SHARE, aims.swing) * saturation,
        level=LEVEL_RATIO if "level" in conditions else inf,
        share=min(SHARE, aims.share) if "level" in conditions else inf,
        load=LOAD if "load" in conditions else 0.0,
        signal=SIGNAL if "resistors" in conditions else (0.0, inf),
        noise_gain=min(NOISE_GAIN, aims.noise_gain) if "noise_gain" in conditions else inf,
    )


def bandwidth_limit(opamp: OpAmp) -> float:
    """Largest product of noise gain and frequency [Hz]."""
    return BANDWIDTH_SHARE * guaranteed(opamp.gbw)


def guaranteed(figure: Figure) -> float:
    """A figure's minimum; where the data sheet has none, its typical value."""
    return figure.min if figure.min is not None else figure.nominal


def output_gain(peaks: Peaks, mass: int = 0) -> float:
    """Largest slope of fv: the displacement of the stop's mass fills the swing, fv at the deepest
    penetration of a stop too."""
    peak = float(peaks.states[2 * mass])
    return peak / depth(Reach(peaks.penetration), peak)


def depth(reach: Reach, peak: float) -> float:
    """Deepest penetration of a stop, in model units; a stop that is hardly met counts a little of
    the displacement's ``peak``."""
    return max(reach.penetration, 0.02 * peak)
