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
    """What the board has; the defaults of a model file.

    mounting : the cases that it takes. test_points : pads for the outputs. probe_resistor [Ω] :
    between an output and its pad and pin. decoupling, bulk [F] : at each supply pin, and at the
    supply connector. dc_trim : the footprints of the DC trim, and whether they are fitted.
    input_protection : diodes at the driven summing nodes. bom : layouts in which the bill is
    written beside ``bom.csv``.
    """

    mounting: Mounting = "mixed"
    test_points: bool = True
    probe_resistor: float = 1e3
    decoupling: float = 100e-9
    bulk: float = 10e-6
    dc_trim: Trim = "unfitted"
    input_protection: bool = True
    bom: tuple[str, ...] = ("kicad", "jlcpcb")


@dataclass(frozen=True)
class BoardChoice:
    """A board for one design: what the model file says, and the figures that it depends on.

    resistor_grade, capacitor_grade : of what is bought, fractions; grades : of the parts that are
    bought at another one, by name; arrays : that take the places of single parts. diode : the
    protection's, by its name in the catalogue. trim : largest DC [V] that the trim stands for, as
    if the generator had it.
    """

    spec: BoardSpec = BoardSpec()
    resistor_grade: float = 0.01
    capacitor_grade: float = 0.01
    diode: str = "1N4148"
    trim: float = 0.25
    grades: Mapping[str, float] = field(default_factory=dict)
    arrays: tuple[PartArray, ...] = ()

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
    bought: PartChoice
    parts: tuple[str, ...]
