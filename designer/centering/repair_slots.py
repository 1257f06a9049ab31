"""What can be upgraded part by part: slots of the program, with what each option costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from designer.base.errors import InputError, Unreachable
from designer.catalog.entries import Kind
from designer.catalog.parts_catalog import Catalog
from designer.centering.repair_branch import GRADE, NETWORK, REFERENCE, TRIMMER
from designer.centering.repair_milp import Option, Slot
from designer.centering.repair_upgrade import Upgrades, price, upgraded_file, with_same_parts
from designer.check.synthesis_result import Synthesis
from designer.circuit.netlist import Capacitor, Resistor
from designer.spread.part_grades import bought
from designer.spread.part_rules import spread_of
from designer.yields.trimmed_yield import DcTrim, dc_trim

TRIMMED = 5.0
"""Trouble of trimming each board once."""
CHANGED = 0.01
"""Trouble of one part that is bought at another grade: of two free choices, the smaller change."""


@dataclass(frozen=True)
class PartSlot:
    """One part, all references together, parts that an array may hold, or the board's trimmer."""

    slot: Slot
    """The slot, with its options."""
    parts: tuple[str, ...]
    """Parts whose value it decides."""
    grades: tuple[float, ...] = ()
    """Grades of each option, the first as it is: grade of a part, a fraction."""
    models: tuple[str, ...] = ()
    """Models of each option, the first as it is: model of the references, or family of an array."""
    trim: DcTrim | None = None
    """The trimmer that the second option fits."""
    network: tuple[str, ...] = ()
    """Parts whose places an array may take."""


def part_slots(synthesis: Synthesis, without: frozenset[str] = frozenset()) -> tuple[PartSlot, ...]:
    """Every part of which a better grade can be bought, in the circuit's order; then the
    references.

    A part whose value was measured, or whose grade is not that of anything sold, stays as it is.
    """
    spec, circuit, catalog = (
        synthesis.modelfile.circuit,
        synthesis.design.circuit,
        synthesis.catalog,
    )
    grades = bought(synthesis.modelfile, circuit, catalog)
    measured = synthesis.modelfile.measured
    measured_parts = set() if measured is None else set(measured.values)
    out = []
    if GRADE not in without:
        stated = {name for rule in synthesis.modelfile.spread.part for name in rule.names}
        kinds = {"resistors", "capacitors"} & stated
        every: tuple[Resistor | Capacitor, ...] = (*circuit.resistors, *circuit.capacitors)
        for part in every:
            kind: Kind = "resistor" if isinstance(part, Resistor) else "capacitor"
            if part.name in measured_parts or (f"{kind}s" in kinds and part.name not in grades):
                continue
            if part.name in stated and part.name not in grades:
                continue
            usual = spec.resistor_grade if kind == "resistor" else spec.capacitor_grade
            slot = _grades(catalog, kind, part, grades.get(part.name, usual))
            if slot is not None:
                out.append(slot)
    if REFERENCE not in without:
        out += _references(synthesis)
    return tuple(out)


def network_slots(
    synthesis: Synthesis, without: frozenset[str] = frozenset()
) -> tuple[PartSlot, ...]:
    """Resistors of one value in sets that an array can hold, those at one summing node together.

    Parts that were measured, that track already or have a grade of their own stay as they are.
    """
    if NETWORK in without:
        return ()
    spec, circuit, catalog = (
        synthesis.modelfile.circuit,
        synthesis.design.circuit,
        synthesis.catalog,
    )
    spread = spread_of(synthesis.modelfile, circuit, catalog)
    measured = synthesis.modelfile.measured
    excluded = {name for g in spread.groups if not g.reel for name in g.parts}
    excluded |= {*(spread.grades.keys() - spread.wanted_grades.keys()), *spread.shapes}
    excluded |= set() if measured is None else measured.values.keys()
    nodes = {s.inverting: k for k, s in enumerate(circuit.sections)}

    def place(part: Resistor) -> int:
        return min((nodes[net] for net in part.nets if net in nodes), default=len(nodes))

    equal: dict[float, list[Resistor]] = {}
    for part in sorted(circuit.resistors, key=place):
        if part.name not in excluded:
            equal.setdefault(float(f"{part.value:.9g}"), []).append(part)
    out = []
    for family in (f for f in catalog.families if f.use == "array" and f.kind == "resistor"):
        for value, same in equal.items():
            try:
                array = catalog.array(family.name, value)
            except (InputError, Unreachable):
                continue
            single = catalog.euro(catalog.part("resistor", value, spec.resistor_grade).price)
            for first in range(0, len(same), family.elements):
                names = tuple(p.name for p in same[first : first + family.elements])
                if len(names) > 1:
                    extra = catalog.euro(array.price) - len(names) * single
                    options = (Option("single parts", 0.0), Option(family.name, extra, CHANGED))
                    slot = Slot(f"array {' '.join(names)}", options)
                    out.append(PartSlot(slot, (), models=("", family.name), network=names))
    return tuple(out)


def trimmer_slot(synthesis: Synthesis, without: frozenset[str] = frozenset()) -> PartSlot | None:
    """The trimmer on the board; None where it is not wanted or there is none.

    Fitting it costs what it adds to the bill of materials, nothing where it is fitted already.
    """
    if TRIMMER in without:
        return None
    fitted = with_same_parts(synthesis, upgraded_file(synthesis.modelfile, Upgrades(trimmer=True)))
    try:
        trim, extra = dc_trim(fitted), price(fitted) - price(synthesis)
    except (Unreachable, InputError):
        return None
    options = (Option("not set", 0.0), Option("set", extra, TRIMMED))
    return None if trim is None else PartSlot(Slot(TRIMMER, options), (), trim=trim)


def _grades(
    catalog: Catalog, kind: Kind, part: Resistor | Capacitor, wanted_grade: float
) -> PartSlot | None:
    """The slot of one part; None where nothing better is sold. A dearer grade that is no better
    than a cheaper one is left out.

    wanted_grade : the grade that the model file asks for; the part is as it is bought there.
    """
    base = catalog.part(kind, part.value, wanted_grade)
    now = base.family.grade
    better = {
        f.grade
        for f in catalog.families
        if f.kind == kind and f.use == "signal" and f.grade < now * (1.0 - 1e-9)
    }
    options, grades = [Option(f"{100.0 * now:g} %", 0.0)], [now]
    for grade in sorted(better):
        sold = catalog.sold(kind, part.value, grade)
        if sold is None or sold.family.grade != grade:  # a better one has its own turn
            continue
        extra = catalog.euro(sold.price) - catalog.euro(base.price)
        if all(extra < o.price for o in options[1:]):
            options.append(Option(f"{100.0 * grade:g} %", extra, CHANGED))
            grades.append(grade)
    if len(options) == 1:
        return None
    return PartSlot(Slot(part.name, tuple(options)), (part.name,), grades=tuple(grades))


def _references(synthesis: Synthesis) -> Sequence[PartSlot]:
    circuit, catalog = synthesis.design.circuit, synthesis.catalog
    if not circuit.references:
        return []
    now = catalog.reference(circuit.references[0].model)
    same = [
        r
        for r in catalog.references
        if abs(r.voltage - now.voltage) < 1e-9 * now.voltage
        and r.grade < now.grade
        and r.least_current <= now.least_current
    ]
    if not same:
        return []
    count = len(circuit.references)
    options = [Option(now.name, 0.0)]
    for r in same:
        extra = count * (catalog.euro(r.price) - catalog.euro(now.price))
        options.append(Option(r.name, extra, CHANGED))
    models = (now.name, *(r.name for r in same))
    slot = Slot("references", tuple(options))
    return [PartSlot(slot, tuple(r.name for r in circuit.references), models=models)]
