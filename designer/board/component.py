"""What stands on the board and what is bought: one list that BOM, KiCad, drawing and rules read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from designer.base.natural_sort import natural_key
from designer.base.units import format_quantity
from designer.base.views import View
from designer.board.pins import Package, Pin, packages, pins
from designer.catalog.entries import DiodeEntry, Kind, PartChoice, Rating, SupplyDiodeEntry, Use
from designer.catalog.parts_catalog import Catalog
from designer.circuit.netlist import (
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
from designer.circuit.stage_title import SUPPLY, stage_names
from designer.model.board_table import BoardChoice, PartArray


@dataclass(frozen=True)
class Bought:
    """What is ordered."""

    manufacturer: str
    """Name of the maker."""
    part_number: str
    """The maker's part number."""
    rating: str
    """What it has to stand."""
    price_class: int
    grade: float | None = None
    """Tolerance, a fraction, or None."""
    substitute: str = ""
    """Another maker's part number, with the maker in front, or ""."""
    dielectric: str = ""
    """What it is made of, or ""."""
    dc_bias: float | None = None
    """Share of a capacitance that is lost at the rated voltage; None where not known."""
    assumed: tuple[str, ...] = ()
    """Figures of the catalogue that no data sheet was compared with, in words."""
    note: str = ""
    """What a buyer has to know beside, or ""."""


@dataclass(frozen=True)
class Component:
    """One physical part."""

    reference: str
    """Its designator on the board."""
    kind: str
    """"resistor", "capacitor", "op-amp", "diode", "reference", "connector", "jack",
    "test point", "trimmer"."""
    value: str
    """Its value, as people write it."""
    quantity: float | None
    """Its value as a number [Ω, F, V], None where there is none."""
    footprint: str
    """Footprint in KiCad, as "Library:Name"."""
    pins: tuple[Pin, ...]
    """Every pad with its net."""
    role: str
    """The terms that it realises."""
    stage: str
    """Its stage, see ``circuit.stage_title``."""
    views: View
    """Where it stands: simulated, on the board, bought."""
    description: str
    """What it is, in words."""
    bought: Bought | None
    """What is ordered; None for what is no part to order, such as a pad."""
    near: str = ""
    """Reference of the component that it has to stand at, or ""."""
    parts: tuple[str, ...] = ()
    """Names of the circuit's parts that it is."""

    @property
    def fitted(self) -> bool:
        """Whether it is on the board when that is populated; bare pads are."""
        return View.BOM in self.views or self.bought is None

    @property
    def units(self) -> dict[str, dict[str, str]]:
        """Pad numbers by name of the pin, for each unit; see ``Pin.unit``."""
        out: dict[str, dict[str, str]] = {}
        for pin in self.pins:
            out.setdefault(pin.unit, {})[pin.name] = pin.number
        return out

    @property
    def nets(self) -> dict[str, str]:
        """The net of each pad; "" where nothing may be connected."""
        return {pin.number: pin.net for pin in self.pins}


UNITS: Mapping[Kind, str] = {"resistor": "Ω", "capacitor": "F"}
Numbers = Mapping[str, Mapping[str, str]]
"""Pad numbers by name of the pin, by name of the section; ``U1P`` has the supply pins of U1."""


def components(circuit: Circuit, catalog: Catalog, choice: BoardChoice) -> tuple[Component, ...]:
    """Everything of the board and the bill, in the order of the circuit; op-amps as packages, in
    the place of their first section.

    Raises
    ------
    Unreachable : a value that cannot be bought at the grade.
    InputError : a part or a case that is not in the catalogue.
    """
    lister = _Lister(circuit, catalog, choice)
    cased = {p.name: p for p in packages(circuit, catalog)}
    out: list[Component] = []
    for part in (*circuit.parts, *circuit.fittings):
        if not part.views & View.FITTED:
            continue
        if isinstance(part, Section):
            package = cased.pop(part.package, None)
            if package is not None:
                out.append(lister.package(package))
        else:
            out.append(lister.one(part))
    return tuple(out)


def designator(name: str) -> str:
    """A part's name on the board, the sheet and the bill.

    KiCad wants a number at the end and calls a sheet with another designator not annotated, so the
    halves of a composite, R50A and R50B, are R50A1 and R50B1 there. Any other name ends in a number
    already and has one letter group, so no two meet.
    """
    return name if name[-1:].isdigit() else f"{name}1"


def pin_numbers(listed: Iterable[Component]) -> Numbers:
    """Those of the op-amps among a board's components."""
    return {
        f"{component.reference}{unit}": numbers
        for component in listed
        if component.kind == "op-amp"
        for unit, numbers in component.units.items()
    }


def to_buy(listed: Iterable[Component], choice: BoardChoice) -> tuple[Component, ...]:
    """These components with the arrays that take the places of some of them: what a bill is of.

    An array stands on the bill alone: the board keeps the single parts' pads.
    """
    return (*listed, *map(_array, choice.arrays))


def _array(array: PartArray) -> Component:
    family, sold = array.bought.family, array.bought
    description = f"{family.elements} {family.dielectric} {family.kind}s, "
    description += f"{100 * family.grade:g} %, matched to {100 * (family.matching or 0.0):g} %"
    return Component(
        reference=array.name,
        kind="array",
        value=format_quantity(sold.value, UNITS[family.kind]),
        quantity=sold.value,
        footprint=sold.footprint,
        pins=(),
        role=f"in the places of {' '.join(array.parts)}",
        stage=SUPPLY,
        views=View.BOM,
        description=description,
        bought=_ordered(sold),
        parts=array.parts,
    )


def joined(listed: Iterable[Component]) -> dict[str, tuple[tuple[str, str], ...]]:
    """What each net joins: (reference, pad) in natural order, nets sorted. Pads without a net are
    left out."""
    out: dict[str, list[tuple[str, str]]] = {}
    for component in listed:
        for pin in component.pins:
            if pin.net:
                out.setdefault(pin.net, []).append((component.reference, pin.number))
    return {
        net: tuple(sorted(out[net], key=lambda pad: (natural_key(pad[0]), natural_key(pad[1]))))
        for net in sorted(out)
    }


class _Lister:
    """Looks up each part of one circuit."""

    def __init__(self, circuit: Circuit, catalog: Catalog, choice: BoardChoice) -> None:
        self.circuit, self.catalog, self.choice = circuit, catalog, choice
        self.stages: Mapping[str, str] = stage_names(circuit)
        self.inside = {name for array in choice.arrays for name in array.parts}

    def one(self, part: Fitting) -> Component:
        choice = self.choice
        if isinstance(part, Resistor | Capacitor) and part.name in self.inside:
            part = replace(part, views=part.views & ~View.BOM)
        if isinstance(part, Resistor):
            grade = choice.grades.get(part.name, choice.resistor_grade)
            return self.passive(part, "resistor", grade, "signal")
        if isinstance(part, Capacitor):
            grade = choice.grades.get(part.name, choice.capacitor_grade)
            return self.passive(part, "capacitor", grade, "signal")
        if isinstance(part, SupplyCapacitor):
            return self.passive(part, "capacitor", 1.0, "supply")
        if isinstance(part, Connector):
            return self.jack(part) if part.series else self.connector(part)
        if isinstance(part, TestPoint):
            return self.component(part, "test point", part.net, TEST_POINT, None)
        return self.entry(part)

    def passive(
        self, part: Resistor | Capacitor | SupplyCapacitor, kind: Kind, grade: float, use: Use
    ) -> Component:
        sold = self.catalog.part(kind, part.value, grade, use)
        other = self.catalog.substitute(sold, grade)
        bought = replace(
            _ordered(sold),
            substitute="" if other is None else f"{other.manufacturer} {other.part_number}",
            note=_better(sold.family.grade, grade) if use == "signal" else "",
        )
        value = format_quantity(sold.value, UNITS[kind])
        description = f"{sold.family.dielectric} {kind}, {100 * sold.family.grade:g} %"
        return self.component(part, kind, value, sold.footprint, bought, sold.value, description)

    def entry(self, part: Fitting) -> Component:
        """A part that has an entry of its own in the catalogue."""
        if isinstance(part, Diode):
            return self.diode(part, self.catalog.diode(part.model.name))
        if isinstance(part, SupplyDiode):
            return self.diode(part, self.catalog.supply_diode(part.model), "diode of the supply")
        if isinstance(part, Reference):
            one = self.catalog.reference(part.model)
            rating = format_quantity(one.voltage, "V")
            bought = Bought(one.manufacturer, one.part_number, rating, one.price, one.grade)
            kind, words = "reference", "shunt reference"
            return self.component(part, kind, one.name, one.footprint, bought, one.voltage, words)
        assert isinstance(part, Trimmer)
        sold = self.catalog.trimmer(part.value)
        rating, value = rated(sold.rating), format_quantity(sold.value, "Ω")
        bought = Bought(sold.manufacturer, sold.part_number, rating, sold.price, sold.grade)
        return self.component(part, "trimmer", value, sold.footprint, bought, sold.value)

    def diode(
        self, part: Diode | SupplyDiode, entry: DiodeEntry | SupplyDiodeEntry, words: str = ""
    ) -> Component:
        rating = f"{format_quantity(entry.reverse_voltage.nominal, 'V')} reverse"
        bought = Bought(entry.manufacturer, entry.part_number, rating, entry.price)
        return self.component(part, "diode", entry.name, entry.footprint, bought, description=words)

    def connector(self, part: Connector) -> Component:
        ways = len(part.ways)
        sold = self.catalog.header(ways, keyed=part.role == SUPPLY)
        bought = Bought(sold.manufacturer, sold.number(ways), rated(sold.rating), sold.price)
        value = f"{ways} ways"
        words = f"{'keyed ' if sold.keyed else ''}pin header, {ways} ways"
        return self.component(part, "connector", value, sold.place(ways), bought, description=words)

    def jack(self, part: Connector) -> Component:
        sold = self.catalog.coaxial_jack(part.series)
        bought = Bought(sold.manufacturer, sold.part_number, rated(sold.rating), sold.price)
        value = f"{sold.series.upper()} jack"
        words = f"{value}, for a coaxial cable"
        return self.component(part, "jack", value, sold.footprint, bought, description=words)

    def package(self, package: Package) -> Component:
        opamp, sections = package.opamp, package.sections
        used = [s for s in sections if View.SIMULATION in s.views]
        stages = dict.fromkeys(self.stages[s.name] for s in used)
        count = f"{opamp.sections} section" + ("s" if opamp.sections > 1 else "")
        free = opamp.sections - len(used)
        return Component(
            reference=package.name,
            kind="op-amp",
            value=opamp.name,
            quantity=None,
            footprint=opamp.footprint,
            pins=package.pins,
            role="; ".join(dict.fromkeys(s.role for s in used)),
            stage=next(iter(stages), SUPPLY),
            views=View.EVERYWHERE,
            description=f"op-amp, {count}, {f'{free} spare' if free else 'all used'}",
            bought=Bought(
                opamp.manufacturer,
                opamp.part_number,
                f"± {self.circuit.supply:g} V supply",
                opamp.price,
            ),
            parts=tuple(s.name for s in sections),
        )

    def component(
        self,
        part: Fitting,
        kind: str,
        value: str,
        footprint: str,
        bought: Bought | None,
        quantity: float | None = None,
        description: str = "",
    ) -> Component:
        return Component(
            reference=designator(part.name),
            kind=kind,
            value=value,
            quantity=quantity,
            footprint=footprint,
            pins=pins(part, self.circuit, self.catalog),
            role=part.role,
            stage=self.stages[part.name],
            views=part.views,
            description=description or kind,
            bought=bought,
            near=part.package if isinstance(part, SupplyCapacitor) else "",
            parts=(part.name,),
        )


def _ordered(sold: PartChoice) -> Bought:
    """A resistor, a capacitor or an array as it is ordered."""
    return Bought(
        manufacturer=sold.manufacturer,
        part_number=sold.part_number,
        rating=rated(sold.rating),
        price_class=sold.price,
        grade=sold.family.grade,
        dielectric=sold.family.dielectric,
        dc_bias=sold.family.dc_bias,
        assumed=_figures(sold.family.assumed),
    )


def _figures(assumed: Sequence[str]) -> tuple[str, ...]:
    """What is assumed of a part itself: every price is a class."""
    return tuple(words for words in assumed if not words.startswith("price class"))


def _better(grade: float, wanted: float) -> str:
    """What is said of a part that is bought at another grade than was asked for."""
    if math.isclose(grade, wanted, rel_tol=1e-9):
        return ""
    return f"asked for at {100 * wanted:g} %, at which nobody sells this value"


TEST_POINT = "TestPoint:TestPoint_Pad_D1.5mm"
"""Footprint of a bare pad."""


def rated(rating: Rating) -> str:
    """A rating in words."""
    phrases = []
    if rating.power is not None:
        phrases.append(format_quantity(rating.power, "W"))
    if rating.voltage is not None:
        phrases.append(format_quantity(rating.voltage, "V"))
    return ", ".join(phrases)
