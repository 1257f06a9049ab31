"""Units of the user: SI values under ``[mechanical]``, the model's dimensionless ones, both ways.

The tool computes with dimensionless quantities. Here a text such as "10 Hz" or "0.5 mm" becomes
one of them, and they become Hz, m and m/s again. The scales are a `SiScales`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from designer.base.errors import InputError
from designer.base.si_unit import Unit, value_text
from designer.base.units import ACCELERATIONS, has_unit, parse_angle, parse_quantity
from designer.model.mechanics import MechanicalModel, state_names
from designer.model.model import SiScales

if TYPE_CHECKING:
    from designer.answers.shared_rows import BasePerVolt, ForceFrequency, MechanismFrequency

MECHANICAL_UNITS = {
    "M1": "kg", "M2": "kg", "C1": "N s/m", "C2": "N s/m", "K0": "N/m", "K1": "N/m", "K2": "N/m",
    "B": "m", "P1": "N", "P2": "N",
}  # fmt: skip
"""Of the table ``[mechanical]``."""
ANGULAR = "rad/s"
FREQUENCIES = '"10 Hz" or "62.8 rad/s"'
"""How a frequency may be written."""
FAR_ABOVE, FAR_BELOW = 5.0, 100.0
"""A plain ω is far out of a model's range above the first times its highest natural frequency (the
stops closed), and below its lowest one (the stops open) over the second."""


def unit_names(model: MechanicalModel) -> dict[str, str]:
    """SI units of a model's quantities, by name; the others have none."""
    states = state_names(model.second_order().size)
    speeds = {name: "m/s" if name.endswith("'") else "m" for name in states}
    return {"omega": "Hz", **speeds, **model.units}


def in_si(si: SiScales | None, model: MechanicalModel) -> bool:
    """Whether plain numbers of a model are SI values: those of a file of format 2 with units."""
    return si == SiScales() and "b" not in model.units


def hertz_json(omega: float, si: SiScales | None) -> ForceFrequency:
    """The frequency of a mechanism's force in Hz; nothing of a model without SI values."""
    return {} if si is None else {"frequency_hz": si.hertz(omega)}


def mechanism_json(omega: float, si: SiScales | None) -> MechanismFrequency:
    """What a generator's frequency stands for in the mechanism, Hz; nothing of a model without SI
    values."""
    return {} if si is None else {"mechanism_hz": si.hertz(omega)}


BASE: Final = "base_m_s2_per_v"


def base_json(per_volt: tuple[int, float] | None, si: SiScales | None) -> BasePerVolt:
    """The acceleration of a moving base per generator volt, m/s²; nothing of a model without SI
    values or without one. per_volt : channel, and the same in model units."""
    if si is None or per_volt is None:
        return {}
    return {BASE: per_volt[1] * si.acceleration_scale}


def units_of(si: SiScales | None, model: MechanicalModel) -> dict[str, Unit]:
    """The SI units that a model's quantities are shown in beside its own numbers, by name: none of
    a model without SI values, and no unit that the numbers have already, but for frequencies,
    lengths and speeds of axes."""
    if si is None:
        return {}
    scales = {"Hz": si.hertz(1.0), "m": si.length_scale, "m/s": si.speed_scale}
    model_units = model.units if in_si(si, model) else ()
    names = unit_names(model)
    return {
        name: Unit(unit, scales[unit]) for name, unit in names.items() if name not in model_units
    }


NO_UNITS: Mapping[str, Unit] = {}
"""Of a model without SI values."""


def angular_frequency(value: str | float) -> float:
    """rad/s of a frequency: a number is in Hz, a text in its unit ("10 Hz", "62.8 rad/s").

    Raises
    ------
    ValueError : not a finite number, or not one in these units.
    """
    if isinstance(value, str) and value.rstrip().endswith(ANGULAR):
        return parse_quantity(value, ANGULAR)
    return 2.0 * math.pi * parse_quantity(value, "Hz")


@dataclass(frozen=True)
class Reader:
    """Reads the values that options give, for one model or one of its boards."""

    model: MechanicalModel
    """What plain numbers are of."""
    si: SiScales | None = None
    """What texts with SI units are of; None: they are refused."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Units that plain numbers of a board have, by parameter."""

    def frequency(self, option: str, text: str | float) -> float:
        """The model's frequency of a text such as "10 Hz", or of a number in Hz.

        Raises
        ------
        InputError : no frequency within the range of numbers, or a model without SI values.
        """
        try:
            angular = angular_frequency(text)
        except ValueError:
            angular = 0.0
        if not 0.0 < angular < math.inf:
            raise InputError(None, option, text, f"a frequency > 0 such as {FREQUENCIES}")
        return self._scales(option, text).omega(angular)

    def omega(self, option: str, omega: float) -> float:
        """A plain dimensionless frequency, if it can be meant so.

        Raises
        ------
        InputError : far out of the range of a model with SI values, whose user may have meant
            rad/s. Both readings are named, and how to give each.
        """
        if self.si is None or self.si == SiScales() or not 0.0 < omega < math.inf:
            return omega
        low, high = natural_frequencies(self.model)
        if low / FAR_BELOW <= omega <= FAR_ABOVE * high:
            return omega
        hertz, radians = value_text(self.si.hertz(omega), "Hz"), self.si.omega(omega)
        text = "--frequency" if option == "--omega" else option
        raise InputError(
            None,
            option,
            f"{omega:g}",
            f"ω near the model's natural frequencies, {low:.3g} to {high:.3g}: {omega:g} "
            f"dimensionless would be {hertz}, give {text} '{hertz}' for that; {omega:g} rad/s is "
            f"ω = {radians:.3g}, give {text} '{omega:g} rad/s' or {option} {radians:.3g} for that",
        )

    def value(self, option: str, name: str, value: str | float) -> float:
        """The value of a parameter or state: a plain number as it is, a text in its unit.

        name : such as "omega", "b", "x1" or, of a board, "amplitude".

        Raises
        ------
        InputError : neither, or a frequency that cannot be meant so (`omega`).
        """
        try:
            plain = float(value)
        except OverflowError:  # a whole number, of a page or of Python
            raise InputError(None, option, value, "a number that a float can hold") from None
        except ValueError:
            return self._with_unit(option, name, str(value))
        return self.omega(option, plain) if name == "omega" and not self.units else plain

    def _with_unit(self, option: str, name: str, text: str) -> float:
        if name in self.units:
            return _quantity(option, text, self.units[name])
        if name == "omega" and not self.units:
            return self.frequency(option, text)
        unit = None if self.units else unit_names(self.model).get(name)
        if unit is None:
            raise InputError(None, option, text, f"a number: {name} has no unit")
        quantity = (
            _acceleration(option, text, unit)
            if unit in ACCELERATIONS
            else _quantity(option, text, unit)
        )
        units = units_of(self._scales(option, text), self.model)
        return quantity / units[name].scale if name in units else quantity

    def _scales(self, option: str, text: str | float) -> SiScales:
        if self.si is None:
            raise InputError(
                None,
                option,
                text,
                "a dimensionless number: a value with a unit needs a model file with a table "
                "[mechanical], or one of format 2 with units",
            )
        return self.si


def natural_frequencies(model: MechanicalModel) -> tuple[float, float]:
    """The lowest undamped one with the stops open, and the highest with them closed."""
    system = model.second_order()
    closed = system.natural_frequencies(closed=True)
    return float(system.natural_frequencies()[0]), float(closed[-1])


def _acceleration(option: str, text: str, unit: str) -> float:
    """One in ``unit`` of a text in any of ``ACCELERATIONS``."""
    for own, size in ACCELERATIONS.items():
        if has_unit(text, own):
            value = parse_quantity(text, own)
            return value if own == unit else value * size / ACCELERATIONS[unit]
    raise InputError(None, option, text, f"a number in {unit}, or a text in g or m/s²")


def _quantity(option: str, text: str, unit: str) -> float:
    """A text that ends in the unit; a mass may be in g."""
    try:
        if unit == "rad":
            return parse_angle(text)
        if not text.rstrip().endswith("g" if unit == "kg" else unit):
            raise ValueError
        return parse_quantity(text, unit)
    except ValueError:
        raise InputError(None, option, text, f"a number, or a text in {unit}") from None
