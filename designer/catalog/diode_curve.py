"""The diode's curve from the figures of a data sheet: a drop for the exact circuit, a card for
SPICE.

    i = saturation_current · (exp(u/(emission · Vt)) - 1),  u the voltage less i · resistance

A sheet that gives a forward voltage means it at ``TEST_CURRENT``. What small-signal sheets leave
out is assumed: the typical forward voltage where there is only a maximum, the emission coefficient
and the series resistance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from designer.base.errors import InputError
from designer.catalog.entries import DiodeEntry

TEST_CURRENT = 10e-3
"""Current [A] at which the catalogue's forward voltage is meant."""
MOST_JUNCTION = 5.0
"""Forward voltage [V] past which a part is no single diode."""
TEST_LOOP = 100.0
"""Resistance [ohm] of the loop in which sheets measure the recovery, down to a tenth."""
WORKING_CURRENT = 1e-3
"""Current [A] at which the constant drop is taken: what a stage of 10 kΩ parts carries."""
TYPICAL_SHARE = 0.72
"""Assumed: typical forward voltage over the maximum, where a sheet gives the maximum alone."""
EMISSION, RESISTANCE = 1.8, 1.0
"""Assumed: emission coefficient, and series resistance [ohm], of a small silicon diode."""
LEAST_EMISSION = 0.5
"""Least emission coefficient. No junction is steeper than 1; below half of that the figures do not
belong together."""
LEAKAGE_SHARE = 0.5
"""Largest saturation current over the reverse current that the sheet allows."""
TRACE = 2e-14
"""Capacitance [F] at 0 V of a diode without charge. With none, nothing in the loop of an ideal
op-amp and a diode has a memory: a smaller step is then no easier, and ngspice finds no first point.
With this one each hand-over takes some forty steps more, and delays contact by less than a
nanosecond; the 4 pF of a real diode delay it by 100 ns, which the waveform shows."""
THERMAL = 0.025852
"""Vt = kT/q [V] at 300 K."""


@dataclass(frozen=True)
class DiodeModel:
    """The curve of a diode, and the figures of its simulation model."""

    name: str
    saturation_current: float
    """Saturation current [A]."""
    emission: float
    """Emission coefficient."""
    resistance: float
    """Series resistance [ohm]."""
    capacitance: float
    """Junction capacitance at 0 V [F]."""
    transit: float
    """Transit time [s]."""
    reverse_voltage: float
    """Breakdown voltage [V]."""
    assumed: bool
    """Whether the forward voltage was assumed, and not read from a data sheet."""

    def forward(self, current: float) -> float:
        """Voltage [V] at a forward current [A]."""
        junction = self.emission * THERMAL * math.log1p(current / self.saturation_current)
        return junction + current * self.resistance

    def capacitance_at(self, reverse: float) -> float:
        """Capacitance [F] of the junction at a reverse voltage [V]: that of ngspice's diode with
        its own grading of 0.5 and built-in voltage of 1 V, which no sheet gives."""
        return self.capacitance / math.sqrt(1.0 + reverse)

    @property
    def drop(self) -> float:
        """The constant forward voltage [V] of the exact circuit."""
        return self.forward(WORKING_CURRENT)


def diode_model(diode: DiodeEntry) -> DiodeModel:
    """The curve of a catalogued diode.

    It passes through the typical forward voltage at ``TEST_CURRENT`` and leaks less than the sheet
    allows. The transit time makes the recovery time of equal forward and reverse currents, less
    what the capacitance takes.

    Raises
    ------
    InputError : the forward voltage is too small for a junction that leaks so little.
    """
    figure = diode.forward_voltage
    volts = figure.typ if figure.typ is not None else TYPICAL_SHARE * figure.nominal
    junction = volts - TEST_CURRENT * RESISTANCE
    most = LEAKAGE_SHARE * diode.reverse_current.nominal
    emission = EMISSION
    if not (0.0 < junction < MOST_JUNCTION and 0.0 < most < TEST_CURRENT):
        raise _no_diode(diode, volts, most)
    current = TEST_CURRENT / math.expm1(junction / (emission * THERMAL))
    if current > most:
        current = most
        emission = junction / (THERMAL * math.log1p(TEST_CURRENT / most))
    if emission < LEAST_EMISSION:
        raise _no_diode(diode, volts, most)
    # What is left of the reverse current falls to a tenth with the junction's capacitance.
    fall = math.log(10.0) * TEST_LOOP * diode.capacitance.nominal
    return DiodeModel(
        name=diode.name,
        saturation_current=current,
        emission=emission,
        resistance=RESISTANCE,
        capacitance=diode.capacitance.nominal,
        transit=max(diode.recovery.nominal - fall, 0.0) / math.log(2.0),
        reverse_voltage=diode.reverse_voltage.nominal,
        assumed=figure.typ is None,
    )


def _no_diode(diode: DiodeEntry, volts: float, leakage: float) -> InputError:
    figures = f"{volts:g} V at {TEST_CURRENT:g} A beside {leakage:g} A of leakage"
    return InputError(None, f"diode {diode.name}", figures, "the figures of a diode")


def card(model: DiodeModel, name: str, *, charge: bool) -> str:
    """The ``.model`` line. charge : with capacitance, recovery, breakdown, or the curve alone."""
    fields = {"is": model.saturation_current, "n": model.emission, "rs": model.resistance}
    if charge:
        fields |= {"cjo": model.capacitance, "tt": model.transit, "bv": model.reverse_voltage}
    else:
        fields["cjo"] = TRACE
    return f".model {name} d(" + " ".join(f"{k}={float(v)!r}" for k, v in fields.items()) + ")"
