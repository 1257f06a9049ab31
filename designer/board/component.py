"""What stands on the board and what is bought: one list that BOM, KiCad, drawing and rules read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from designer.base.natural_sort import natural_key
from designer.base.units import format_quantity
from designer.base.views import View
from designer.board.pins import Package, Pin, packages, pins
from designer.catalog.catalog import Catalog
from designer.catalog.entries import Kind, OpAmp, Rating, Use
from designer.circuit.board_parts_only import Connector, SupplyCapacitor, TestPoint, Trimmer
from designer.circuit.netlist import (
    Capacitor,
    Circuit,
    Diode,
    Fitting,
    Reference,
    Resistor,
    Section,
)
from designer.circuit.stage_title import SUPPLY, stage_names
from designer.model.board_table import BoardChoice


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
    """Price class, from 1."""
    grade: float | None = None
    """Tolerance, a fraction, or None."""
    substitute: str = ""
    """Another maker's part number, with the maker in front, or ""."""
    dielectric: str = ""
    """What it is made of, or ""."""
    note: str = ""
    """What a buyer has to know beside, or ""."""


@dataclass(frozen=True)
class Component:
    """One physical part."""

    reference: str
    """Its designator on the board."""
    kind: str
    """"resistor", "capacitor", "op-amp", "diode", "reference", "connector", "test point",
    "trimmer"."""
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
    def nets(self) -> dict[str, str]:
        """The net of each pad; "" where nothing may be connected."""
        return {pin.number: pin.net for pin in self.pins}


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


def pin_numbers(found: Iterable[Component]) -> Numbers:
    """Those of the op-amps among a board's components."""
    out: dict[str, dict[str, str]] = {}
    for component in found:
        if component.kind == "op-amp":
            for pin in component.pins:
                out.setdefault(f"{component.reference}{pin.unit}", {})[pin.name] = pin.number
    return out


def to_buy(found: Iterable[Component], choice: BoardChoice) -> tuple[Component, ...]:
    """These components with the arrays that take the places of some of them: what a bill is of.

    An array stands on the bill alone: the board keeps the single parts' pads.
    """
    out = list(found)
    for array in choice.arrays:
        family, sold = array.bought.family, array.bought
        unit = "Ω" if family.kind == "resistor" else "F"
        said = f"{family.elements} {family.dielectric} {family.kind}s, "
        said += f"{100 * family.grade:g} %, matched to {100 * (family.matching or 0.0):g} %"
        part = Bought(
            manufacturer=sold.manufacturer,
            part_number=sold.part_number,
            rating=rated(sold.rating),
            price_class=sold.price,
            grade=family.grade,
            dielectric=family.dielectric,
        )
        out.append(
            Component(
                reference=array.name,
                kind="array",
                value=format_quantity(sold.value, unit),
                quantity=sold.value,
                footprint=sold.footprint,
                pins=(),
                role=f"in the places of {' '.join(array.parts)}",
                stage=SUPPLY,
                views=View.BOM,
                description=said,
                bought=part,
                parts=array.parts,
            )
        )
    return tuple(out)


def joined(found: Iterable[Component]) -> dict[str, tuple[tuple[str, str], ...]]:
    """What each net joins: (reference, pad) in natural order, nets sorted. Pads without a net are
    left out."""
    out: dict[str, list[tuple[str, str]]] = {}
    for component in found:
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
        if isinstance(part, Resistor | Capacitor) and part.name in self.inside:
            part = replace(part, views=part.views & ~View.BOM)
        if isinstance(part, Resistor):
            grade = self.choice.grades.get(part.name, self.choice.resistor_grade)
            return self.passive(part, "resistor", "Ω", grade, "signal")
        if isinstance(part, Capacitor):
            grade = self.choice.grades.get(part.name, self.choice.capacitor_grade)
            return self.passive(part, "capacitor", "F", grade, "signal")
        if isinstance(part, SupplyCapacitor):
            return self.passive(part, "capacitor", "F", 1.0, "supply", near=part.package)
        if isinstance(part, Diode):
            return self.diode(part)
        if isinstance(part, Reference):
            return self.reference(part)
        if isinstance(part, Trimmer):
            return self.trimmer(part)
        if isinstance(part, Connector):
            return self.connector(part)
        assert isinstance(part, TestPoint)
        return self.component(part, "test point", part.net, None, TEST_POINT, "", None)

    def passive(
        self,
        part: Resistor | Capacitor | SupplyCapacitor,
        kind: Kind,
        unit: str,
        grade: float,
        use: Use,
        near: str = "",
    ) -> Component:
        found = self.catalog.part(kind, part.value, grade, use)
        other = self.catalog.substitute(found, grade)
        bought = Bought(
            manufacturer=found.manufacturer,
            part_number=found.part_number,
            rating=rated(found.rating),
            price_class=found.price,
            grade=found.family.grade,
            substitute="" if other is None else f"{other.manufacturer} {other.part_number}",
            dielectric=found.family.dielectric,
            note=_better(found.family.grade, grade) if use == "signal" else "",
        )
        value = format_quantity(found.value, unit)
        made = f"{found.family.dielectric} {kind}, {100 * found.family.grade:g} %"
        return self.component(
            part, kind, value, found.value, found.footprint, made, bought, near=near
        )

    def diode(self, part: Diode) -> Component:
        found = self.catalog.diode(part.model.name)
        rating = f"{format_quantity(found.reverse_voltage.nominal, 'V')} reverse"
        bought = Bought(found.manufacturer, found.part_number, rating, found.price)
        return self.component(part, "diode", found.name, None, found.footprint, "diode", bought)

    def reference(self, part: Reference) -> Component:
        found = self.catalog.reference(part.model)
        rating = format_quantity(found.voltage, "V")
        bought = Bought(found.manufacturer, found.part_number, rating, found.price, found.grade)
        return self.component(
            part,
            "reference",
            found.name,
            found.voltage,
            found.footprint,
            "shunt reference",
            bought,
        )

    def trimmer(self, part: Trimmer) -> Component:
        found = self.catalog.trimmer(part.value)
        bought = Bought(
            found.manufacturer, found.part_number, rated(found.rating), found.price, found.grade
        )
        value = format_quantity(found.value, "Ω")
        return self.component(
            part, "trimmer", value, found.value, found.footprint, "trimmer", bought
        )

    def connector(self, part: Connector) -> Component:
        ways = len(part.ways)
        found = self.catalog.header(ways)
        bought = Bought(found.manufacturer, found.number(ways), rated(found.rating), found.price)
        return self.component(
            part,
            "connector",
            f"{ways} ways",
            None,
            found.place(ways),
            f"pin header, {ways} ways",
            bought,
        )

    def package(self, package: Package) -> Component:
        opamp, sections = package.opamp, package.sections
        used = [s for s in sections if View.SIMULATION in s.views]
        stages = dict.fromkeys(self.stages[s.name] for s in used)
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
            description=f"op-amp, {_sections(opamp)}, {_spare(opamp.sections - len(used))}",
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
        quantity: float | None,
        footprint: str,
        description: str,
        bought: Bought | None,
        near: str = "",
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
            near=near,
            parts=(part.name,),
        )


def _better(grade: float, asked: float) -> str:
    """What is said of a part that is bought at another grade than was asked for."""
    if math.isclose(grade, asked, rel_tol=1e-9):
        return ""
    return f"asked for at {100 * asked:g} %, at which nobody sells this value"


def _sections(opamp: OpAmp) -> str:
    return "1 section" if opamp.sections == 1 else f"{opamp.sections} sections"


def _spare(count: int) -> str:
    return f"{count} spare" if count else "all used"


TEST_POINT = "TestPoint:TestPoint_Pad_D1.5mm"
"""Footprint of a bare pad."""


def rated(rating: Rating) -> str:
    """A rating in words."""
    shown = []
    if rating.power is not None:
        shown.append(format_quantity(rating.power, "W"))
    if rating.voltage is not None:
        shown.append(format_quantity(rating.voltage, "V"))
    return ", ".join(shown)
