"""What an op-amp model does in ngspice, held against the figures it was written from.

Each measurement is the data sheet's own: a small circuit around one op-amp, one analysis, one
number. All of them run in a process ``ngspice -b`` of their own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.base.defaults import Fidelity
from designer.base.guarded_reading import UNREADABLE, reason
from designer.catalog.entries import OpAmp
from designer.catalog.fields import Figure
from designer.catalog.output_stage import HEAVY_LOAD, RATED_LOAD
from designer.spice.batch_backend import BatchNgspice
from designer.spice.opamp_model import (
    MODELS,
    NOISE_FREQUENCY,
    instance,
    recovery,
    subcircuit,
)
from designer.spice.simulator import SimulationFailed

TIGHT = ".options reltol=1e-6 vntol=1e-10 abstol=1e-15"
HARD = 0.25
"""A differential input that drives every op-amp's output to its limit, over the supply."""


@dataclass(frozen=True)
class OpAmpBench:
    """One op-amp on a bench."""

    opamp: OpAmp
    """The catalogue's entry, at its rated supply and with every figure typical."""
    fidelity: Fidelity
    vos: float
    """Input offset voltage [V]."""
    rails: tuple[float, float]
    """Output limits, (low, high) [V]."""

    @classmethod
    def of(cls, opamp: OpAmp, fidelity: Fidelity) -> OpAmpBench:
        """The op-amp with the offset and the limits of the catalogue."""
        limit = opamp.saturation.nominal
        return cls(opamp, fidelity, opamp.offset.nominal, (-limit, limit))

    @property
    def supply(self) -> float:
        """Supply of either rail, ± [V]."""
        return self.opamp.rated_supply

    def deck(self, around: Sequence[str]) -> str:
        """A deck of the op-amp (output ``out``) and the lines around it."""
        lines = [
            "* op-amp bench",
            f"VCC vcc 0 {self.supply!r}",
            f"VEE vee 0 {-self.supply!r}",
            instance("U1", ("inp", "inn", "out"), fidelity=self.fidelity, vos=self.vos,
                     ib=self.opamp.bias.nominal, rails=self.rails),
            *subcircuit(self.fidelity, self.opamp),
            *around,
            ".end",
        ]  # fmt: skip
        return "\n".join(lines) + "\n"

    def open_loop_gain(self) -> float:
        """Change of the output over the change of the differential input, unloaded [V/V]."""
        reach = 0.5 * self.rails[1]
        plot = self._run([
            "VIN in 0 0", "RIN in inn 1e6", "RF inn out 1e6", "VG inp 0 0",
            f".dc VIN {-reach!r} {reach!r} {2 * reach!r}", TIGHT,
        ])  # fmt: skip
        return float(np.ptp(plot["out"]) / (plot["inn"][1] - plot["inn"][0]))

    def response(
        self, low: float, high: float
    ) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
        """Open-loop gain over frequency [Hz]: a servo of 1 GH and 1 GF holds the output at rest."""
        phasors = self._run([
            "VIN inp 0 DC 0 AC 1", "LSERVO out inn 1e9", "CSERVO inn 0 1e9",
            f".ac dec 50 {low!r} {high!r}", TIGHT,
        ])  # fmt: skip
        return phasors["frequency"].real, phasors["out"]

    def unity_gain(self) -> tuple[float, float]:
        """Frequency [Hz] where the open-loop gain is one, and the phase left there [degrees]."""
        frequency, gain = self.response(
            self.opamp.gbw.nominal / 30.0, self.opamp.gbw.nominal * 30.0
        )
        size = np.log(np.abs(gain))
        log_f = float(np.interp(0.0, -size, np.log(frequency)))
        phase = np.unwrap(np.angle(gain))
        return math.exp(log_f), 180.0 + math.degrees(np.interp(log_f, np.log(frequency), phase))

    def slew(self) -> tuple[float, float]:
        """Slope [V/s] of a follower's rising and falling edge, from 30 to 60 % of a large step."""
        top = 0.6 * self.rails[1]
        flight = 2 * top / self.opamp.slew.nominal
        width = 3.0 * flight
        text = [
            f"VIN inp 0 PULSE({-top!r} {top!r} {flight!r} {flight / 1e3!r} {flight / 1e3!r} "
            f"{width!r} {4 * width!r})",
            "RF out inn 1", f".tran {flight / 200!r} {2 * width!r} 0 {flight / 200!r}",
        ]  # fmt: skip
        plot = self._run(text)
        time, out = plot["time"], plot["out"]
        half = time < flight + width
        rise = _between(time[half], out[half], -top + 0.6 * top, -top + 1.2 * top)
        fall = _between(time[~half], -out[~half], -top + 0.6 * top, -top + 1.2 * top)
        return 0.6 * top / rise, 0.6 * top / fall

    def swing(self, load: float) -> tuple[float, float]:
        """Output [V] driven hard down and up, into a load [ohm] to ground."""
        plot = self._run([
            "VIN inp 0 0", "VG inn 0 0", f"RL out 0 {load!r}",
            *self._driven(),
        ])  # fmt: skip
        return float(plot["out"][0]), float(plot["out"][1])

    def offset(self) -> float:
        """Output [V] of a follower of zero."""
        return float(self._follower()["out"][0])

    def bias(self) -> tuple[float, float]:
        """Current [A] into the noninverting and the inverting input."""
        plot = self._run(["VIN inp 0 0", "VF out inn 0", "RL out 0 1e9", ".op", TIGHT])
        into = self._follower()
        return float(-into["vin#branch"][0]), float(plot["vf#branch"][0])

    def recovery(self) -> float:
        """Time [s] from the reversal of a hard overdrive to the output's leaving its limit."""
        wait = 20.0 * recovery(self.opamp) + 10.0 * self.rails[1] / self.opamp.slew.nominal
        step = min(recovery(self.opamp) / 200.0, wait / 1000.0)
        hard = HARD * self.supply
        plot = self._run([
            f"VIN inp 0 PULSE({hard!r} {-hard!r} {wait!r} {step / 10!r} {step / 10!r} 1 2)",
            "VG inn 0 0", "RL out 0 1e6", f".tran {step!r} {2 * wait!r} 0 {step!r}",
        ])  # fmt: skip
        after = plot["time"] > wait
        limit = float(plot["out"][~after][-1])
        left = after & (plot["out"] < 0.99 * limit)
        # The way from the limit to 1 % below it is slewing, no recovery.
        slewing = 0.01 * limit / self.opamp.slew.nominal
        return float(plot["time"][left][0] - wait - slewing)

    def short_circuit(self) -> tuple[float, float]:
        """Current [A] that the output drives into ground, driven hard down and up."""
        plot = self._run(["VIN inp 0 0", "VG inn 0 0", "VSHORT out 0 0", *self._driven()])
        return float(plot["vshort#branch"][0]), float(plot["vshort#branch"][1])

    def supply_current(self, load: float = 1e9) -> tuple[float, float]:
        """Current [A] into the positive and out of the negative supply pin, as a follower of half
        the positive limit into a load [ohm]."""
        plot = self._run([
            f"VIN inp 0 {self.rails[1] / 2!r}", "RF out inn 1", f"RL out 0 {load!r}", ".op",
        ])  # fmt: skip
        return float(-plot["vcc#branch"][0]), float(plot["vee#branch"][0])

    def noise(self, frequency: float) -> float:
        """Noise of a follower [V/sqrt(Hz)] at a frequency [Hz]."""
        text = self.deck([
            "VIN inp 0 DC 0 AC 1", "RF out inn 1e-3",
            f".noise v(out) VIN dec 10 {frequency!r} {10 * frequency!r}",
        ])  # fmt: skip
        plots = BatchNgspice().analyse(text)
        density = next(p.vectors for p in plots if "onoise_spectrum" in p.vectors)
        return float(density["onoise_spectrum"][0])

    def _follower(self) -> dict[str, NDArray[Any]]:
        return self._run(["VIN inp 0 0", "RF out inn 1e-3", "RL out 0 1e9", ".op", TIGHT])

    def _driven(self) -> list[str]:
        """A sweep of the input from hard low to hard high."""
        hard = HARD * self.supply
        return [f".dc VIN {-hard!r} {hard!r} {2 * hard!r}", TIGHT]

    def _run(self, around: Sequence[str]) -> dict[str, NDArray[Any]]:
        return BatchNgspice().analyse(self.deck(around))[-1].vectors


@dataclass(frozen=True)
class FigureCheck:
    """One figure of the catalogue, and what the model shows."""

    figure: str
    unit: str
    expected: float
    """What the catalogue says."""
    measured: float
    """What was measured in ngspice."""
    tolerance: float
    """Largest relative difference that is allowed."""
    assumed: bool
    """Whether the catalogue's figure is assumed."""

    @property
    def agrees(self) -> bool:
        return abs(self.measured - self.expected) <= self.tolerance * abs(self.expected)


def checks(opamp: OpAmp, fidelity: Fidelity = "full") -> list[FigureCheck]:
    """Every figure that this fidelity's model has, measured; a vendor's model on ``full`` if named.

    Raises
    ------
    SimulationFailed : ngspice has no answer for one of them, or one that is none.
    EnvironmentMissing : ngspice is missing.
    """
    try:
        return _measured(opamp, fidelity)
    except (*UNREADABLE, StopIteration) as error:
        raise SimulationFailed(f"ngspice's answer is none: {reason(error)}") from error


def _measured(opamp: OpAmp, fidelity: Fidelity) -> list[FigureCheck]:
    bench, out = OpAmpBench.of(opamp, fidelity), list[FigureCheck]()

    def add(name: str, unit: str, figure: Figure | None, measured: float, tolerance: float) -> None:
        if figure is not None:
            expected = figure.nominal
            out.append(FigureCheck(name, unit, expected, measured, tolerance, figure.assumed))

    add("gain", "V/V", opamp.gain, bench.open_loop_gain(), 0.01)
    add("offset", "V", opamp.offset, bench.offset(), 0.01)
    for pin, current in zip(("noninverting", "inverting"), bench.bias(), strict=True):
        add(f"bias, {pin} input", "A", opamp.bias, current, 0.01)
    light = bench.swing(RATED_LOAD)
    add("swing into 10 kΩ, low", "V", opamp.saturation, -light[0], 0.01)
    add("swing into 10 kΩ, high", "V", opamp.saturation, light[1], 0.01)
    takes = MODELS[fidelity].takes
    if "gbw" not in takes:
        return out
    at = opamp.gbw.nominal / 10.0
    frequency, gain = bench.response(at, 2.0 * at)
    add("gain-bandwidth", "Hz", opamp.gbw, float(abs(gain[0]) * frequency[0]), 0.02)
    if "slew" in takes:
        for edge, slope in zip(("rising", "falling"), bench.slew(), strict=True):
            add(f"slew, {edge}", "V/s", opamp.slew, slope, 0.02)
        add("recovery", "s", opamp.recovery, bench.recovery(), 0.1)
    if "load" not in takes:
        return out
    heavy = bench.swing(HEAVY_LOAD)
    add("swing into 2 kΩ, low", "V", opamp.swing_2k, -heavy[0], 0.01)
    add("swing into 2 kΩ, high", "V", opamp.swing_2k, heavy[1], 0.01)
    add("phase margin", "°", opamp.phase_margin, bench.unity_gain()[1], 0.05)
    for side, current in zip(("sinking", "sourcing"), bench.short_circuit(), strict=True):
        add(f"short circuit, {side}", "A", opamp.output_current, abs(current), 0.02)
    add("supply current", "A", opamp.supply_current, bench.supply_current()[0], 0.01)
    add("noise at 1 kHz", "V/√Hz", opamp.noise, bench.noise(NOISE_FREQUENCY), 0.01)
    return out


def _between(time: NDArray[np.float64], wave: NDArray[np.float64], a: float, b: float) -> float:
    """Time that a rising wave takes from level a to level b."""
    first = np.flatnonzero(wave >= a)[0]
    last = np.flatnonzero(wave >= b)[0]
    ends = [
        float(np.interp(level, wave[i - 1 : i + 1], time[i - 1 : i + 1]))
        for level, i in ((a, first), (b, last))
    ]
    return ends[1] - ends[0]
