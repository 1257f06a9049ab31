"""The table ``[board]`` of a model file: what stands on the board beside the circuit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from designer.base.schema import (
    Accepts,
    FileTable,
    choice,
    flag,
    number,
    physical,
    several,
    text,
)
from designer.catalog.entries import Mounting, PartChoice
from designer.model.circuit_table import CircuitSpec

Trim = Literal["none", "unfitted", "fitted"]
Connectors = Literal["pins", "sma", "bnc"]


def _layout() -> Accepts:
    """Its file is looked for when it is needed."""
    name = text("[a-z0-9][a-z0-9-]{0,30}", "names of small letters, digits and hyphens")
    return Accepts(name.expected, name.read, json=name.json)


def _date() -> Accepts:
    """A tool that writes the same files every day knows no date of its own."""
    return text(
        r"|[0-9]{4}-(0[1-9]|1[0-2])-(0[1-9]|[12][0-9]|3[01])", 'a date such as "2026-11-23"'
    )


@dataclass(frozen=True)
class BoardSpec(FileTable):
    """What the board has; the defaults of a model file."""

    mounting: Annotated[Mounting, choice("mixed", "smd", "tht")] = "mixed"
    """The cases that it takes."""
    test_points: Annotated[bool, flag()] = True
    """Whether the outputs have pads."""
    probe_resistor: Annotated[
        float,
        number("Ω", 'from 100 Ω to 10 kΩ, such as "1k"', lambda value: 100.0 <= value <= 10e3),
    ] = 1e3
    """Resistance between an output and its pad and pin [Ω]."""
    decoupling: Annotated[float, physical("F")] = 100e-9
    """Capacitance at each supply pin [F]."""
    bulk: Annotated[float, physical("F")] = 10e-6
    """Capacitance at the supply connector [F]."""
    dc_trim: Annotated[Trim, choice("none", "unfitted", "fitted")] = "unfitted"
    """Whether the DC trim has footprints, and whether these are fitted."""
    input_protection: Annotated[bool, flag()] = True
    """Whether diodes protect the driven summing nodes."""
    reverse_protection: Annotated[
        str, text(".*", 'the name of a supply diode of the catalogue, such as "1N5819", or ""')
    ] = "1N5819"
    """The diode between each pin of the supply and its rail, by its name in the catalogue; "" for
    none."""
    connectors: Annotated[Connectors, choice("pins", "sma", "bnc")] = "pins"
    """What generator and outputs are connected by: rows of pins, or a coaxial jack each."""
    bom: Annotated[
        tuple[str, ...], several('a list of layouts such as ["kicad", "jlcpcb"]', _layout())
    ] = ("kicad", "jlcpcb")
    """Layouts in which the bill is written beside ``bom.csv``."""
    date: Annotated[str, _date()] = ""
    """Date in the title blocks of sheet and board, such as "2026-11-23"; "" leaves it out."""


@dataclass(frozen=True)
class PartArray:
    """One array on the bill, and the parts whose places its elements take."""

    name: str
    """Its reference on the board."""
    bought: PartChoice
    """The array that is bought."""
    parts: tuple[str, ...]
    """Names of the parts whose places its elements take."""


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
