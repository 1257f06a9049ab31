"""The table ``[board]`` of a model file: what stands on the board beside the circuit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BaseModel

from designer.base.schema import STRICT, Accepts, choice, flag, number, physical
from designer.catalog.entries import Mounting, PartChoice
from designer.model.circuit_table import CircuitSpec

if TYPE_CHECKING:
    pass

Trim = Literal["none", "unfitted", "fitted"]


@dataclass(frozen=True)
class BoardSpec:
    """What the board has; the defaults of a model file."""

    mounting: Mounting = "mixed"
    """The cases that it takes."""
    test_points: bool = True
    """Whether the outputs have pads."""
    probe_resistor: float = 1e3
    """Resistance between an output and its pad and pin [Ω]."""
    decoupling: float = 100e-9
    """Capacitance at each supply pin [F]."""
    bulk: float = 10e-6
    """Capacitance at the supply connector [F]."""
    dc_trim: Trim = "unfitted"
    """Whether the DC trim has footprints, and whether these are fitted."""
    input_protection: bool = True
    """Whether diodes protect the driven summing nodes."""
    bom: tuple[str, ...] = ("kicad", "jlcpcb")
    """Layouts in which the bill is written beside ``bom.csv``."""


@dataclass(frozen=True)
class BoardChoice:
    """A board for one design: what the model file says, and the figures that it depends on."""

    spec: BoardSpec = BoardSpec()
    """What the model file says of the board."""
    resistor_grade: float = 0.01
    """Grade of the resistors that are bought, a fraction."""
    capacitor_grade: float = 0.01
    """Grade of the capacitors that are bought, a fraction."""
    diode: str = "1N4148"
    """The protection's diode, by its name in the catalogue."""
    trim: float = 0.25
    """Largest DC [V] that the trim stands for, as if the generator had it."""
    grades: Mapping[str, float] = field(default_factory=dict)
    """Grades of the parts that are bought at another one, by name."""
    arrays: tuple[PartArray, ...] = ()
    """Resistor arrays that take the places of single parts."""

    @classmethod
    def of(cls, circuit: CircuitSpec, board: BoardSpec | None = None) -> BoardChoice:
        """The choices of a table [circuit], before the figures of a design are known."""
        return cls(
            spec=board or BoardSpec(),
            resistor_grade=circuit.resistor_grade,
            capacitor_grade=circuit.capacitor_grade,
            diode=circuit.diode,
        )


def _layouts() -> Accepts:
    """Their files are looked for when they are needed."""

    def check(value: object) -> tuple[str, ...]:
        if not isinstance(value, list):
            raise ValueError
        for name in value:
            if not isinstance(name, str) or not re.fullmatch(r"[a-z0-9][a-z0-9-]{0,30}", name):
                raise ValueError("names of small letters, digits and hyphens")
        return tuple(dict.fromkeys(value))

    return Accepts('a list of layouts such as ["kicad", "jlcpcb"]', check)


def _within(low: float, high: float, unit: str, expected: str) -> Accepts:
    return number(unit, expected, lambda value: low <= value <= high)


class BoardTable(BaseModel):
    """The keys of ``[board]``, each with what it accepts."""

    model_config = STRICT
    mounting: Annotated[Mounting, choice("mixed", "smd", "tht")] = BoardSpec.mounting
    test_points: Annotated[bool, flag()] = BoardSpec.test_points
    probe_resistor: Annotated[
        float, _within(100.0, 10e3, "Ω", 'from 100 Ω to 10 kΩ, such as "1k"')
    ] = BoardSpec.probe_resistor
    decoupling: Annotated[float, physical("F")] = BoardSpec.decoupling
    bulk: Annotated[float, physical("F")] = BoardSpec.bulk
    dc_trim: Annotated[Trim, choice("none", "unfitted", "fitted")] = BoardSpec.dc_trim
    input_protection: Annotated[bool, flag()] = BoardSpec.input_protection
    bom: Annotated[tuple[str, ...], _layouts()] = BoardSpec.bom


@dataclass(frozen=True)
class PartArray:
    """One array on the bill, and the parts whose places its elements take."""

    name: str
    """Its reference on the board."""
    bought: PartChoice
    """The array that is bought."""
    parts: tuple[str, ...]
    """Names of the parts whose places its elements take."""
