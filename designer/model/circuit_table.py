"""The table ``[circuit]`` of a model file: what the circuit is made of, and what is asked of it.

Names of parts in ``matched`` and ``composites`` are only read here; which parts a model has is
known once its terms are (``synthesis.part_checks``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from designer.base.eseries import SERIES
from designer.base.json_schema import either, listed
from designer.base.schema import (
    Accepts,
    FileTable,
    choice,
    fraction,
    line,
    number,
    physical,
    physical_span,
    several,
    text,
    whole_number,
)
from designer.base.units import parse_quantity
from designer.catalog.entries import FORBIDDEN

DeadZone = Literal["saturation", "rectifier"]
DEAD_ZONES: tuple[DeadZone, ...] = get_args(DeadZone)
Objective = Literal["margin", "match", "yield"]
Names = bool | tuple[str, ...]
"""All of them, none, or those named."""

SIDE_CONDITIONS = ("swing", "level", "load", "noise_gain", "bandwidth", "resistors", "generator")
"""Names of the conditions that a model file can switch off (docs/synthesis.md)."""

_SERIES = several("one or a list of " + ", ".join(SERIES), choice(*SERIES), least=1, single=True)
_GRADE = fraction("0.01 is 1 %")
_PARTS = several("", text("[RC][1-9][0-9]{0,3}", ""))
_RESISTORS = several("", text("R[1-9][0-9]{0,3}", ""))


def _families() -> Accepts:
    """Their names are looked up when the catalogue is there."""
    expected = (
        'a family of the catalogue or a list of them, or, with "!" in front of each, those that '
        'are not bought from: "Yageo RC0603FR-07" or ["!Vishay CRCW0603 F"]'
    )
    families = several(expected, line(""), least=1, single=True)

    def check(value: object) -> tuple[str, ...]:
        names = tuple(dict.fromkeys(name.strip() for name in families.check(value)))
        if len({name.startswith(FORBIDDEN) for name in names}) > 1:
            raise ValueError("all of them with ! or none")
        return names

    return Accepts(expected, check, json=families.json)


def _flag_or(expected: str, names: Accepts) -> Accepts:
    """true, false, or a list of names."""
    return Accepts(
        f"true, false or a list of {expected}",
        lambda value: value if isinstance(value, bool) else names.check(value),
        json=either({"type": "boolean"}, names.json),
    )


def _matched() -> Accepts:
    """Groups that share a part are one group."""

    def check(value: object) -> tuple[tuple[str, ...], ...]:
        if not isinstance(value, list):
            raise ValueError
        groups: list[tuple[str, ...]] = []
        for names in value:
            group = _PARTS.check(names)
            if len(group) < 2:
                raise ValueError("a group has two parts or more")
            if len({name[0] for name in group}) > 1:
                raise ValueError("resistors and capacitors have no value in common")
            sharing = [g for g in groups if set(g) & set(group)]
            groups = [g for g in groups if g not in sharing]
            groups.append(tuple(dict.fromkeys(n for g in (*sharing, group) for n in g)))
        return tuple(groups)

    expected = 'a list of groups of parts such as [["R1", "R7"], ["C2", "C4"]]'
    return Accepts(expected, check, json=listed(_PARTS.json))


def _preferred() -> Accepts:
    """Resistances and capacitances tell themselves apart by size: no resistor is below 1 Ω."""

    def value_of(item: object) -> float:
        if isinstance(item, bool) or not isinstance(item, int | float | str):
            raise ValueError
        farads = isinstance(item, str) and item.rstrip().endswith("F")
        value = parse_quantity(item, "F" if farads else "Ω")
        if not value > 0.0:
            raise ValueError
        return value

    def check(value: object) -> tuple[float, ...]:
        if not isinstance(value, list):
            raise ValueError
        return tuple(sorted({value_of(item) for item in value}))

    expected = 'a list of values in Ω or F such as ["10k", "10n"]'
    return Accepts(expected, check, json=listed({"type": ["number", "string"]}))


@dataclass(frozen=True)
class CircuitSpec(FileTable):
    """What the circuit is to be made of and how it is to be chosen; the defaults of a model
    file."""

    opamp: Annotated[str, line("the name of an op-amp of the catalogue")] = "TL074C"
    """The op-amp's name in the catalogue."""
    supply: Annotated[float, physical("V")] = 15.0
    """Supply of either rail, ± [V]."""
    saturation: Annotated[float | None, physical("V")] = None
    """Output limit of the op-amps, ± [V]; None: the catalogue's."""
    resistors: Annotated[tuple[str, ...], _SERIES] = ("E96",)
    """E series that resistors are chosen from."""
    capacitors: Annotated[tuple[str, ...], _SERIES] = ("E12",)
    """E series that capacitors are chosen from."""
    resistor_grade: Annotated[float, _GRADE] = 0.01
    """Grade of the resistors, a fraction (0.01 is 1 %)."""
    capacitor_grade: Annotated[float, _GRADE] = 0.01
    """Grade of the capacitors, a fraction (0.01 is 1 %)."""
    resistor_range: Annotated[tuple[float, float], physical_span("Ω")] = (1e3, 1e6)
    """Least and largest resistance [Ω]."""
    capacitor_range: Annotated[tuple[float, float], physical_span("F")] = (1e-9, 1e-6)
    """Least and largest capacitance [F]."""
    frequency: Annotated[tuple[float, float], physical_span("Hz")] = (50.0, 1000.0)
    """Band for the frequency of ω = 1 [Hz]."""
    dead_zone: Annotated[DeadZone | None, choice(*DEAD_ZONES)] = None
    """Kind of the stage that makes the dead zone."""
    diode: Annotated[str, line("the name of a diode of the catalogue")] = "1N4148"
    """The rectifying dead zone's diode, by its name in the catalogue."""
    reference: Annotated[str, line("the name of a voltage reference of the catalogue")] = (
        "LM4040C50"
    )
    """The rectifying dead zone's reference, by its name in the catalogue."""
    objective: Annotated[Objective, choice("margin", "match", "yield")] = "margin"
    """What the choice of parts is to make best."""
    matched: Annotated[tuple[tuple[str, ...], ...], _matched()] = ()
    """Groups of parts with equal values."""
    preferred: Annotated[tuple[float, ...], _preferred()] = ()
    """Values [Ω or F] that do not count among the distinct ones."""
    most_values: Annotated[int | None, whole_number("a whole number >= 1", 1)] = None
    """Limit on distinct values; None for none."""
    slack: Annotated[
        float, number("", "a number from 0 to 0.1", lambda value: 0.0 <= value <= 0.1)
    ] = 0.0
    """How much the error may exceed its least for fewer distinct values."""
    max_error: Annotated[
        float | None, number("", "a number above 0", lambda value: value > 0.0)
    ] = None
    """The largest coefficient error that is accepted; None for any."""
    composites: Annotated[Names, _flag_or('resistors such as ["R50", "R203"]', _RESISTORS)] = False
    """Resistors that may be two parts."""
    side_conditions: Annotated[
        Names, _flag_or(", ".join(SIDE_CONDITIONS), several("", choice(*SIDE_CONDITIONS)))
    ] = True
    """Side conditions that are kept."""
    resistor_family: Annotated[tuple[str, ...], _families()] = ()
    """Names of the catalogue's families that resistors are bought from, or, each with ``!`` in
    front, of those that they are not; none: every family."""
    capacitor_family: Annotated[tuple[str, ...], _families()] = ()
    """Names of the catalogue's families that capacitors are bought from, or, each with ``!`` in
    front, of those that they are not; none: every family."""

    @property
    def active_conditions(self) -> frozenset[str]:
        """The side conditions that are kept, by name."""
        if isinstance(self.side_conditions, bool):
            return frozenset(SIDE_CONDITIONS if self.side_conditions else ())
        return frozenset(self.side_conditions)
