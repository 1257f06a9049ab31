"""SI units that values are shown in: hertz, metres and metres per second, with their prefixes."""

from __future__ import annotations

from dataclasses import dataclass

PREFIXED = {
    "Hz": ((1e7, 1e6, "MHz"), (1e4, 1e3, "kHz"), (0.1, 1.0, "Hz"), (0.0, 1e-3, "mHz")),
    "m": ((1.0, 1.0, "m"), (1e-5, 1e-3, "mm"), (1e-8, 1e-6, "µm"), (0.0, 1e-9, "nm")),
    "m/s": ((1.0, 1.0, "m/s"), (1e-5, 1e-3, "mm/s"), (1e-8, 1e-6, "µm/s"), (0.0, 1e-9, "nm/s")),
}
"""(from which value on, SI value, name) of the units that a value is shown in, largest first."""
DIGITS = 4
"""Significant digits of a value that is shown."""


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

    def text(self, value: float) -> str:
        """A dimensionless value in this unit, such as "54.11 Hz"."""
        return value_text(value * self.scale, self.name)

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


def value_text(value: float, unit: str, digits: int = DIGITS) -> str:
    """An SI value for a table: "54.11 Hz", "0.6488 mm"."""
    factor, name = prefixed(value, unit)
    return f"{value / factor:.{digits}g} {name}"
