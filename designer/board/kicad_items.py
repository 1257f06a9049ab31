"""The components of a board as symbols: shape, unit and stage, and what stands in their fields."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from designer.base.views import View
from designer.board import kicad_symbols as symbols
from designer.board.component import Component
from designer.board.kicad_names import LIBRARY, POWER, footprint_name, library_name
from designer.board.kicad_sim import Fields, fields, sources
from designer.board.kicad_symbols import PART_ROW, SymbolShape
from designer.board.pins import SUPPLY_UNIT
from designer.check.deck_runs import FirstRun
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit


@dataclass(frozen=True)
class Item:
    """Something with a symbol."""

    reference: str
    value: str
    shape: SymbolShape
    pins: Mapping[str, str]
    """Net by pin number, "" where none is."""


@dataclass(frozen=True)
class Entry:
    """An item of the sheet with its fields, and where it stands besides the sheet."""

    item: Item
    fields: Fields
    component: Component | None = None
    """The component; None for sources, flags and power symbols."""

    @property
    def bought(self) -> bool:
        """Whether it stands on the bill."""
        return self.component is not None and View.BOM in self.component.views

    @property
    def placed(self) -> bool:
        """Whether it stands on the board."""
        return self.component is not None and View.BOARD in self.component.views

    @property
    def simulated(self) -> bool:
        """Whether it stands in the simulation."""
        return self.component is None or View.SIMULATION in self.component.views

    @property
    def fitted(self) -> bool:
        """Whether it is soldered to the board."""
        return self.component is None or self.component.fitted


def entries(
    circuit: Circuit, components: Sequence[Component], run: FirstRun, library: str
) -> tuple[Entry, ...]:
    """Every component, then what the simulation needs besides. library : file of its models."""
    listed = [_entry(c, circuit, library) for c in components]
    for name, net, value, simulation in sources(circuit, run, library):
        pins = {"1": net, "2": GROUND}
        item = Item(name, value, symbols.source("VSOURCE"), pins)
        listed.append(Entry(item, simulation))
    for net in (POSITIVE, GROUND, NEGATIVE):
        item = Item(f"#FLG_{POWER[net]}", "PWR_FLAG", symbols.flag(), {"1": net})
        listed.append(Entry(item, ()))
    return tuple(listed)


def shape(component: Component) -> SymbolShape:
    """The symbol of a component."""
    numbers = {pin.name: pin.number for pin in component.pins}
    kind = component.kind
    if kind == "resistor":
        return symbols.resistor()
    if kind == "capacitor":
        return symbols.capacitor()
    if kind in ("diode", "reference"):
        zener = kind == "reference"
        free = [(pin.number, pin.name) for pin in component.pins if not pin.net]
        prefix = "VR" if zener else "D"
        name = _named(prefix, component)
        ends = numbers["anode"], numbers["cathode"]
        return symbols.diode(name, *ends, prefix=prefix, zener=zener, free=free)
    if kind == "op-amp":
        units = component.units
        supply = units.pop(SUPPLY_UNIT)
        sections = [(u["-"], u["+"], u["OUT"]) for u in units.values()]
        return symbols.opamp(_named("", component), sections, (supply["V+"], supply["V-"]))
    if kind == "test point":
        return symbols.probe_pad()
    if kind == "jack":
        return symbols.coaxial_jack(_named("", component), numbers["signal"], numbers["shell"])
    pins = [(pin.number, pin.name, pin.electrical) for pin in component.pins]
    if kind == "trimmer":  # between the rails: the higher one above, where its symbol points
        pins.sort(key=lambda pin: ("high", "wiper", "low").index(pin[1]))
    letters = component.reference.rstrip("0123456789")
    if kind == "trimmer":  # power symbols at its ends need room
        return symbols.row(_named(letters, component), letters, pins, 4)
    ways = [pin.net for pin in component.pins]
    wide = any(GROUND not in pair for pair in pairwise(ways))
    name = f"Header_{len(pins)}_wide" if wide else f"Header_{len(pins)}"
    return symbols.row(name, letters, pins, PART_ROW if wide else PART_ROW // 2)


def section_units(component: Component) -> dict[str, int]:
    """The unit of the symbol, from 1, of each section of an op-amp package; last the supply's."""
    names = [name for name in component.units if name != SUPPLY_UNIT]
    return {name: i for i, name in enumerate([*names, SUPPLY_UNIT], start=1)}


def _entry(component: Component, circuit: Circuit, library: str) -> Entry:
    symbol = shape(component)
    item = Item(component.reference, component.value, symbol, component.nets)
    return Entry(item, (*_bought(component), *fields(component, circuit, library)), component)


def _bought(component: Component) -> Iterator[tuple[str, str]]:
    """The fields that a bill of materials is made from."""
    yield "Footprint", f"{LIBRARY}:{footprint_name(component.footprint)}"
    yield "Description", component.description
    yield "Role", component.role
    if component.bought is not None:
        yield "Manufacturer", component.bought.manufacturer
        yield "MPN", component.bought.part_number
        if component.bought.substitute:
            yield "Substitute", component.bought.substitute


def _named(prefix: str, component: Component) -> str:
    """A library name for symbols whose pins belong to one kind of part."""
    return library_name("_".join(filter(None, (prefix, component.value))))
