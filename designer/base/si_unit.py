"""SI units that values are shown in: hertz, metres and metres per second, with their prefixes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from designer.base.units import ACCELERATIONS, spaced_quantity

PREFIXED = {
    "Hz": ((1e7, 1e6, "MHz"), (1e4, 1e3, "kHz"), (0.1, 1.0, "Hz"), (0.0, 1e-3, "mHz")),
    "m": ((1.0, 1.0, "m"), (1e-5, 1e-3, "mm"), (1e-8, 1e-6, "µm"), (0.0, 1e-9, "nm")),
    "N": (
        (1e6, 1e6, "MN"),
        (1e3, 1e3, "kN"),
        (1.0, 1.0, "N"),
        (1e-3, 1e-3, "mN"),
        (0.0, 1e-6, "µN"),
    ),
    "m/s": ((1.0, 1.0, "m/s"), (1e-5, 1e-3, "mm/s"), (1e-8, 1e-6, "µm/s"), (0.0, 1e-9, "nm/s")),
}
"""(from which value on, SI value, name) of the units that a value is shown in, largest first."""
DIGITS = 4
"""Significant digits of a value that is shown."""


def celsius_text(low: float, high: float | None = None) -> str:
    """A temperature [°C], such as "−20 °C", or a range: "−20 to 60 °C"."""
    text = f"{low:g} °C" if high is None or high == low else f"{low:g} to {high:g} °C"
    return text.replace("-", "−")


@dataclass(frozen=True)
class Unit:
    """The SI unit of a dimensionless quantity."""

    name: str
    """"Hz", "m" or "m/s"."""
    scale: float
    """How many of them are one dimensionless unit."""

    @property
    def suffix(self) -> str:
        """The end of a JSON key for values in this unit."""
        return suffix(self.name)

    @property
    def own_si(self) -> bool:
        """Whether the numbers are SI values themselves: m, m/s or rad/s."""
        radian = 2.0 * math.pi if self.name == "Hz" else 1.0
        return math.isclose(radian * self.scale, 1.0, rel_tol=1e-12)

    def text(self, value: float, digits: int = DIGITS) -> str:
        """A dimensionless value in this unit, such as "54.11 Hz"."""
        return value_text(value * self.scale, self.name, digits)

    def axis(self, largest: float) -> tuple[float, str]:
        """For an axis of dimensionless values up to ``largest``: how many shown units are one
        dimensionless unit, and the shown unit's name, such as "mm"."""
        factor, name = prefixed(largest * self.scale, self.name)
        return self.scale / factor, name


def suffix(unit: str) -> str:
    """The end of a JSON key for values in a unit: "hz", "m" or "m_s"."""
    return unit.lower().replace("/", "_")


def prefixed(value: float, unit: str) -> tuple[float, str]:
    """The unit in which an SI value is shown, as its SI value and its name: 6e-4, "m" has
    (1e-3, "mm")."""
    size = abs(value)
    for least, factor, name in PREFIXED[unit]:
        if size >= least > 0.0 or (size == 0.0 and name == unit):
            return factor, name
    _, factor, name = PREFIXED[unit][-1]
    return factor, name


def is_angular(omega: float, hertz: float | None) -> bool:
    """Whether ω is in rad/s, by the same frequency in hertz; None where there is none."""
    return hertz is not None and math.isclose(omega, 2.0 * math.pi * hertz, rel_tol=1e-9)


def drive_text(omega: float, hertz: float | None, digits: int = DIGITS) -> str:
    """A drive frequency for people: "36 Hz" where ω is in rad/s, else "ω = 0.85"."""
    if hertz is not None and is_angular(omega, hertz):
        return value_text(hertz, "Hz", digits)
    return f"ω = {omega:.{digits}g}"


def quantity_text(value: float, unit: str, digits: int = DIGITS) -> str:
    """A value in any SI unit for a table or a picture: "0.4 mm", "36 Hz", "30 kN/m", "120 g"."""
    if unit in PREFIXED:
        return value_text(value, unit, digits)
    return spaced_quantity(value, unit, digits).replace("\u00a0", " ")


def span_text(low: float, high: float, unit: str, si: Unit | None = None) -> str:
    """A range of plain numbers as they were taken: "from 20 to 40 rad/s (3.183 Hz to 6.366 Hz)",
    "from 0.3 mm to 0.5 mm", "from 1.2 to 1.8". unit : of the numbers, "" without. si : the unit
    that they are shown in too."""
    if si is not None and si.own_si and unit != "rad/s":
        unit = si.name
    if unit in PREFIXED:
        return f"from {quantity_text(low, unit)} to {quantity_text(high, unit)}"
    plain = f"from {low:.6g} to {high:.6g}" + (f" {unit}" if unit else "")
    return plain if si is None else f"{plain} ({si.text(low)} to {si.text(high)})"


def acceleration_text(value: float) -> str:
    """An acceleration in m/s² for people: "3.2 m/s² (0.3263 g)"."""
    return f"{value:.{DIGITS}g} m/s² ({value / ACCELERATIONS['g']:.{DIGITS}g} g)"


def value_text(value: float, unit: str, digits: int = DIGITS) -> str:
    """An SI value for a table: "54.11 Hz", "0.6488 mm"."""
    factor, name = prefixed(value, unit)
    return f"{value / factor:.{digits}g} {name}"
