"""From nets to the pins of a case: which pad of a part carries which net."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from designer.base.errors import InputError
from designer.catalog.entries import OpAmp
from designer.catalog.parts_catalog import Catalog
from designer.circuit.netlist import (
    NEGATIVE,
    POSITIVE,
    Capacitor,
    Circuit,
    Connector,
    Diode,
    Fitting,
    Reference,
    Resistor,
    Section,
    SupplyCapacitor,
    SupplyDiode,
    TestPoint,
    Trimmer,
)

Electrical = Literal["passive", "input", "output", "power_in", "no_connect"]
"""What a pin is to an electrical rule check, in KiCad's words."""

SUPPLY_UNIT = "P"
"""Unit of the supply pins of a package."""


@dataclass(frozen=True)
class Pin:
    """A pin of a component."""

    number: str
    """Number of its pad."""
    name: str
    net: str
    """The net on it; "" where nothing may be connected."""
    electrical: Electrical = "passive"
    """Electrical type, in KiCad's words."""
    unit: str = ""
    """The section of a package, ``SUPPLY_UNIT`` for its supply pins, "" for a part of one unit."""


@dataclass(frozen=True)
class Package:
    """An op-amp package."""

    name: str
    """Its designator, such as "U1"."""
    sections: tuple[Section, ...]
    """Its sections that the circuit has, tied-off ones included."""
    opamp: OpAmp
    """The catalogue's entry of the op-amp."""

    @property
    def pins(self) -> tuple[Pin, ...]:
        """Pins of the sections, then the supply's.

        Raises
        ------
        InputError : a section that the op-amp does not have.
        """
        pins = [pin for s in self.sections for pin in section_pins(s, self.opamp)]
        positive, negative = self.opamp.supply_pins
        return (
            *pins,
            Pin(positive, "V+", POSITIVE, "power_in", SUPPLY_UNIT),
            Pin(negative, "V-", NEGATIVE, "power_in", SUPPLY_UNIT),
        )


def packages(circuit: Circuit, catalog: Catalog) -> tuple[Package, ...]:
    """The op-amp packages, each with its sections of every view, in the order of their pins."""
    opamp = catalog.opamp(circuit.opamp)
    tied = [p for p in circuit.fittings if isinstance(p, Section)]
    sections = sorted((*circuit.sections, *tied), key=lambda s: s.name)
    return tuple(
        Package(name, tuple(s for s in sections if s.package == name), opamp)
        for name in circuit.packages
    )


def pins(part: Fitting, circuit: Circuit, catalog: Catalog) -> tuple[Pin, ...]:
    """The pins of one part; of a section its own, without the package's supply pins.

    Two-pin parts are 1 and 2; KiCad's diodes have their cathode at 1.

    Raises
    ------
    InputError : a part that the catalogue does not have, or has in no such case.
    """
    if isinstance(part, Resistor):
        return (Pin("1", "1", part.a), Pin("2", "2", part.b))
    if isinstance(part, Capacitor | SupplyCapacitor):
        return (Pin("1", "+", part.plus), Pin("2", "-", part.minus))
    if isinstance(part, Section):
        return section_pins(part, catalog.opamp(circuit.opamp))
    if isinstance(part, Diode):
        entry = catalog.diode(part.model.name)
        return _named(entry.pins, {"cathode": part.cathode, "anode": part.anode})
    if isinstance(part, SupplyDiode):
        series = catalog.supply_diode(part.model)
        return _named(series.pins, {"cathode": part.cathode, "anode": part.anode})
    if isinstance(part, Reference):
        reference = catalog.reference(part.model)
        return _named(reference.pins, {"cathode": part.cathode, "anode": part.anode})
    if isinstance(part, Connector) and part.series:
        jack = catalog.coaxial_jack(part.series)
        return _named(jack.pins, dict(zip(("signal", "shell"), part.ways, strict=True)))
    if isinstance(part, Connector):
        numbered = enumerate(part.ways, start=1)
        return tuple(Pin(str(i), str(i), net) for i, net in numbered)
    if isinstance(part, Trimmer):
        nets = {"low": part.low, "wiper": part.wiper, "high": part.high}
        return _named(catalog.trimmer(part.value).pins, nets)
    assert isinstance(part, TestPoint)
    return (Pin("1", "1", part.net),)


def section_pins(section: Section, opamp: OpAmp) -> tuple[Pin, ...]:
    """The three pins of one section."""
    unit = section.name.removeprefix(section.package)
    for pin in opamp.pins:
        if pin.name == unit:
            return (
                Pin(pin.output, "OUT", section.output, "output", unit),
                Pin(pin.inverting, "-", section.inverting, "input", unit),
                Pin(pin.noninverting, "+", section.noninverting, "input", unit),
            )
    names = ", ".join(pin.name for pin in opamp.pins)
    raise InputError(
        None, "circuit.opamp", opamp.name, f"an op-amp with a section {unit}; it has {names}"
    )


def _named(numbers: Mapping[str, str], nets: Mapping[str, str]) -> tuple[Pin, ...]:
    """Pins by the catalogue's map from names to pads; a name without a net is not connected."""
    return tuple(
        Pin(number, name, nets.get(name, ""), "passive" if name in nets else "no_connect")
        for name, number in numbers.items()
    )
