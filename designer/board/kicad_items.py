"""The components of a board as symbols: shape, unit and stage, and what stands in their fields."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from designer.base.views import View
from designer.board import kicad_symbols as symbols
from designer.board.component import Component
from designer.board.kicad_layout import Item
from designer.board.kicad_names import LIBRARY, POWER, footprint_name, library_name
from designer.board.kicad_sim import Fields, fields, sources
from designer.board.kicad_symbols import SymbolShape
from designer.board.pins import SUPPLY_UNIT
from designer.check.deck_runs import FirstRun
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit
from designer.circuit.stage_title import SUPPLY, section_stages

SIMULATION = "simulation"
"""Stage of what only the simulation has."""


@dataclass(frozen=True)
class Entry:
    """An item of the sheet with its fields, and where it stands besides the sheet."""

    item: Item
    """The item with its symbol."""
    fields: Fields
    """The fields, by name."""
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
    stages = section_stages(circuit)
    listed = [_entry(c, circuit, stages, library) for c in components]
    for name, net, value, simulation in sources(circuit, run):
        pins = {"1": net, "2": GROUND}
        item = Item(name, value, symbols.source("VSOURCE"), pins, {1: SIMULATION})
        listed.append(Entry(item, simulation))
    for net in (POSITIVE, GROUND, NEGATIVE):
        item = Item(f"#FLG_{POWER[net]}", "PWR_FLAG", symbols.flag(), {"1": net}, {1: SIMULATION})
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
    pins = [(pin.number, pin.name, pin.electrical) for pin in component.pins]
    if kind == "trimmer":  # between the rails: the higher one above, where its symbol points
        pins.sort(key=lambda pin: ("high", "wiper", "low").index(pin[1]))
    letters = component.reference.rstrip("0123456789")
    name = f"Header_{len(pins)}" if kind == "connector" else _named(letters, component)
    # Power symbols at neighbouring pins need room between them.
    return symbols.row(name, letters, pins, 3 if kind == "connector" else 4)


def _entry(
    component: Component, circuit: Circuit, stages: Mapping[str, str], library: str
) -> Entry:
    symbol = shape(component)
    stage_of = {1: component.stage}
    if component.kind == "op-amp":
        units = [name for name in component.units if name != SUPPLY_UNIT]
        stage_of = {
            i: stages.get(f"{component.reference}{name}", SUPPLY)
            for i, name in enumerate(units, start=1)
        } | {len(units) + 1: SUPPLY}
    item = Item(component.reference, component.value, symbol, component.nets, stage_of)
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
