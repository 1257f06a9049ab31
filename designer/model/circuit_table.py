"""The table ``[circuit]`` of a model file: what the circuit is made of, and what is asked of it.

Names of parts in ``matched`` and ``composites`` are only read here; which parts a model has is
known once its terms are (``synthesis.part_names``).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import BaseModel

from designer.base.eseries import SERIES
from designer.base.schema import (
    STRICT,
    Accepts,
    choice,
    did_you_mean,
    line,
    number,
    physical,
    physical_span,
)
from designer.base.units import parse_quantity
from designer.catalog.entries import FORBIDDEN

DeadZone = Literal["saturation", "rectifier"]
Objective = Literal["match", "yield"]
Names = bool | tuple[str, ...]
"""All of them, none, or those named."""

SIDE_CONDITIONS = ("swing", "level", "load", "noise_gain", "bandwidth", "resistors", "generator")
"""Names of the conditions that a model file can switch off (docs/synthesis.md)."""

_PART = re.compile(r"[RC][1-9][0-9]{0,3}", re.ASCII)


@dataclass(frozen=True)
class CircuitSpec:
    """What the circuit is to be made of and how it is to be chosen; the defaults of a model
    file."""

    opamp: str = "TL074C"
    """The op-amp's name in the catalogue."""
    supply: float = 15.0
    """Supply of either rail, ± [V]."""
    saturation: float | None = None
    """Output limit of the op-amps, ± [V]; None: the catalogue's."""
    resistors: tuple[str, ...] = ("E96",)
    """E series that resistors are chosen from."""
    capacitors: tuple[str, ...] = ("E12",)
    """E series that capacitors are chosen from."""
    resistor_grade: float = 0.01
    """Grade of the resistors, a fraction (0.01 is 1 %)."""
    capacitor_grade: float = 0.01
    """Grade of the capacitors, a fraction (0.01 is 1 %)."""
    resistor_range: tuple[float, float] = (1e3, 1e6)
    """Least and largest resistance [Ω]."""
    capacitor_range: tuple[float, float] = (1e-9, 1e-6)
    """Least and largest capacitance [F]."""
    frequency: tuple[float, float] = (50.0, 1000.0)
    """Band for the frequency of ω = 1 [Hz]."""
    dead_zone: DeadZone = "saturation"
    """Kind of the stage that makes the dead zone."""
    diode: str = "1N4148"
    """The rectifying dead zone's diode, by its name in the catalogue."""
    reference: str = "LM4040C50"
    """The rectifying dead zone's reference, by its name in the catalogue."""
    objective: Objective = "match"
    """What the choice of parts is to make best."""
    matched: tuple[tuple[str, ...], ...] = ()
    """Groups of parts with equal values."""
    preferred: tuple[float, ...] = ()
    """Values [Ω or F] that do not count among the distinct ones."""
    most_values: int | None = None
    """Limit on distinct values; None for none."""
    slack: float = 0.0
    """How much the error may exceed its least for fewer distinct values."""
    composites: Names = False
    """Resistors that may be two parts."""
    side_conditions: Names = True
    """Side conditions that are kept."""
    resistor_family: tuple[str, ...] = ()
    """Names of the catalogue's families that resistors are bought from, or, each with ``!`` in
    front, of those that they are not; none: every family."""
    capacitor_family: tuple[str, ...] = ()
    """Names of the catalogue's families that capacitors are bought from, or, each with ``!`` in
    front, of those that they are not; none: every family."""

    @property
    def kept(self) -> frozenset[str]:
        """The side conditions that are kept, by name."""
        if isinstance(self.side_conditions, bool):
            return frozenset(SIDE_CONDITIONS if self.side_conditions else ())
        return frozenset(self.side_conditions)


# What the fields accept.


def _grade() -> Accepts:
    return number("", "a fraction in (0, 1): 0.01 is 1 %", lambda value: 0.0 < value < 1.0)


def _series() -> Accepts:
    def check(value: object) -> tuple[str, ...]:
        names = [value] if isinstance(value, str) else value
        if not isinstance(names, list) or not names:
            raise ValueError
        return _known(names, SERIES)

    return Accepts("one or a list of " + ", ".join(SERIES), check)


def _families() -> Accepts:
    """Their names are looked up when the catalogue is there."""
    one = line("").check
    expected = (
        'a family of the catalogue or a list of them, or, with "!" in front of each, those that '
        'are not bought from: "Yageo RC0603FR-07" or ["!Vishay CRCW0603 F"]'
    )

    def check(value: object) -> tuple[str, ...]:
        names = [value] if isinstance(value, str) else value
        if not isinstance(names, list) or not names:
            raise ValueError
        read = tuple(dict.fromkeys(str(one(name)).strip() for name in names))
        if len({name.startswith(FORBIDDEN) for name in read}) > 1:
            raise ValueError("all of them with ! or none")
        return read

    return Accepts(expected, check)


def _known(names: Iterable[object], known: Sequence[str]) -> tuple[str, ...]:
    for name in names:
        if not isinstance(name, str):
            raise ValueError
        if name not in known:
            raise ValueError(did_you_mean(name, known))
    return tuple(dict.fromkeys(str(name) for name in names))


def _conditions() -> Accepts:
    def check(value: object) -> Names:
        if isinstance(value, bool):
            return value
        if not isinstance(value, list):
            raise ValueError
        return _known(value, SIDE_CONDITIONS)

    return Accepts("true, false or a list of " + ", ".join(SIDE_CONDITIONS), check)


def _parts(names: object, letters: str) -> tuple[str, ...]:
    if not isinstance(names, list):
        raise ValueError
    for name in names:
        if not isinstance(name, str) or not _PART.fullmatch(name) or name[0] not in letters:
            raise ValueError
    return tuple(dict.fromkeys(names))


def _composites() -> Accepts:
    def check(value: object) -> Names:
        return value if isinstance(value, bool) else _parts(value, "R")

    return Accepts('true, false or a list of resistors such as ["R50", "R203"]', check)


def _matched() -> Accepts:
    """Groups that share a part are one group."""

    def check(value: object) -> tuple[tuple[str, ...], ...]:
        if not isinstance(value, list):
            raise ValueError
        groups: list[tuple[str, ...]] = []
        for names in value:
            group = _parts(names, "RC")
            if len(group) < 2:
                raise ValueError("a group has two parts or more")
            if len({name[0] for name in group}) > 1:
                raise ValueError("resistors and capacitors have no value in common")
            sharing = [g for g in groups if set(g) & set(group)]
            groups = [g for g in groups if g not in sharing]
            groups.append(tuple(dict.fromkeys(n for g in (*sharing, group) for n in g)))
        return tuple(groups)

    return Accepts('a list of groups of parts such as [["R1", "R7"], ["C2", "C4"]]', check)


def _preferred() -> Accepts:
    """Resistances and capacitances tell themselves apart by size: no resistor is below 1 Ω."""

    def value_of(item: object) -> float:
        if isinstance(item, bool) or not isinstance(item, int | float | str):
            raise ValueError
        farads = isinstance(item, str) and item.rstrip().endswith("F")
        found = parse_quantity(item, "F" if farads else "Ω")
        if not found > 0.0:
            raise ValueError
        return found

    def check(value: object) -> tuple[float, ...]:
        if not isinstance(value, list):
            raise ValueError
        return tuple(sorted({value_of(item) for item in value}))

    return Accepts('a list of values in Ω or F such as ["10k", "10n"]', check)


def _slack() -> Accepts:
    return number("", "a number from 0 to 0.1", lambda value: 0.0 <= value <= 0.1)


def _count() -> Accepts:
    def check(value: object) -> int:
        if type(value) is not int or value < 1:
            raise ValueError
        return value

    return Accepts("a whole number >= 1", check)


class CircuitTable(BaseModel):
    """The keys of ``[circuit]``, each with what it accepts."""

    model_config = STRICT
    opamp: Annotated[str, line("the name of an op-amp of the catalogue")] = CircuitSpec.opamp
    supply: Annotated[float, physical("V")] = CircuitSpec.supply
    saturation: Annotated[float | None, physical("V")] = CircuitSpec.saturation
    resistors: Annotated[tuple[str, ...], _series()] = CircuitSpec.resistors
    capacitors: Annotated[tuple[str, ...], _series()] = CircuitSpec.capacitors
    resistor_grade: Annotated[float, _grade()] = CircuitSpec.resistor_grade
    capacitor_grade: Annotated[float, _grade()] = CircuitSpec.capacitor_grade
    resistor_range: Annotated[tuple[float, float], physical_span("Ω")] = CircuitSpec.resistor_range
    capacitor_range: Annotated[tuple[float, float], physical_span("F")] = (
        CircuitSpec.capacitor_range
    )
    frequency: Annotated[tuple[float, float], physical_span("Hz")] = CircuitSpec.frequency
    dead_zone: Annotated[DeadZone, choice("saturation", "rectifier")] = CircuitSpec.dead_zone
    diode: Annotated[str, line("the name of a diode of the catalogue")] = CircuitSpec.diode
    reference: Annotated[str, line("the name of a voltage reference of the catalogue")] = (
        CircuitSpec.reference
    )
    objective: Annotated[Objective, choice("match", "yield")] = CircuitSpec.objective
    matched: Annotated[tuple[tuple[str, ...], ...], _matched()] = CircuitSpec.matched
    preferred: Annotated[tuple[float, ...], _preferred()] = CircuitSpec.preferred
    most_values: Annotated[int | None, _count()] = CircuitSpec.most_values
    slack: Annotated[
        float, number("", "a number from 0 to 0.1", lambda value: 0.0 <= value <= 0.1)
    ] = CircuitSpec.slack
    composites: Annotated[Names, _composites()] = CircuitSpec.composites
    side_conditions: Annotated[Names, _conditions()] = CircuitSpec.side_conditions
    resistor_family: Annotated[tuple[str, ...], _families()] = CircuitSpec.resistor_family
    capacitor_family: Annotated[tuple[str, ...], _families()] = CircuitSpec.capacitor_family
