"""Whether measured values can be of a circuit."""

from __future__ import annotations

import math
from collections.abc import Collection

from designer.base.errors import InputError
from designer.base.schema import did_you_mean
from designer.base.units import format_quantity
from designer.circuit.netlist import Circuit
from designer.model.measured_values import MeasuredBoards

_FACTOR = 2.0
"""A part is no further from the value it is sold for: a slip of a prefix is a factor of 1000."""


def check_measured(measured: MeasuredBoards, circuit: Circuit) -> None:
    """Refuse what cannot be of this circuit.

    Raises
    ------
    InputError : a part that it lacks, or a value far from the one that the part is sold for.
    """
    check_measured_names(measured, circuit)
    nominal = _nominal(circuit)
    for name, values in measured.values.items():
        line = f"line {measured.lines.get(name, 0)}"
        low, high, unit = nominal[name]
        for value in values:
            if not math.isnan(value) and not low <= value <= high:
                ends = " to ".join(format_quantity(end, unit) for end in (low, high))
                text = f"{name}, {format_quantity(value, unit)}"
                raise InputError(measured.source, line, text, f"a value within {ends}")


def check_measured_names(
    measured: MeasuredBoards, circuit: Circuit, more: Collection[str] = ()
) -> None:
    """Refuse parts that are neither of this circuit nor among ``more``.

    Raises
    ------
    InputError : names the first of them.
    """
    measurable = [*_nominal(circuit), *more]
    for name in measured.values:
        if name not in measurable:
            hint = did_you_mean(name, measurable)
            expected = "a part of this design" + (f"; {hint}" if hint else "")
            line = f"line {measured.lines.get(name, 0)}"
            raise InputError(measured.source, line, name, expected)


def _nominal(circuit: Circuit) -> dict[str, tuple[float, float, str]]:
    """Lowest and highest value, and unit, of everything that can be measured on a board."""

    def about(value: float, unit: str) -> tuple[float, float, str]:
        ends = sorted((value / _FACTOR, value * _FACTOR))
        return ends[0], ends[1], unit

    ranges = {r.name: about(r.value, "Ω") for r in circuit.resistors}
    ranges |= {c.name: about(c.value, "F") for c in circuit.capacitors}
    ranges |= {r.name: about(r.volts, "V") for r in circuit.references}
    ranges |= {rail.name: about(rail.volts, "V") for rail in circuit.rails}
    supply = circuit.supply
    for s in circuit.sections:
        ranges[f"{s.name}.offset"] = (-supply, supply, "V")
        ranges[f"{s.name}.low"] = (-_FACTOR * supply, 0.0, "V")
        ranges[f"{s.name}.high"] = (0.0, _FACTOR * supply, "V")
        ranges[f"{s.name}.bias"] = (-1e-3, 1e-3, "A")
        ranges[f"{s.name}.gbw"] = (1.0, 1e12, "Hz")
    return ranges
