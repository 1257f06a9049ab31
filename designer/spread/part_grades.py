"""How each part is bought, where it is not as the others of its kind: its grade, its array."""

from __future__ import annotations

from designer.base.errors import Unreachable
from designer.catalog.catalog import Catalog
from designer.catalog.entries import Kind
from designer.circuit.netlist import Capacitor, Circuit, Resistor
from designer.model.board_table import PartArray
from designer.model.model_file import ModelFile
from designer.spread.part_rules import spread_of


def bought(modelfile: ModelFile, circuit: Circuit, catalog: Catalog) -> dict[str, float]:
    """By name, the grades that ``[[spread.part]]`` states for resistors and capacitors.

    A grade that nobody sells the value at (0 for an exact part, or one that was picked out on the
    bench) is for the study alone: the part is then bought as the others of its kind are. Elements
    of arrays are not bought one by one.
    """
    stated = spread_of(modelfile, circuit, catalog).grades
    inside = {name for a in arrays(modelfile, circuit, catalog) for name in a.parts}
    found = {}
    parts: tuple[Resistor | Capacitor, ...] = (*circuit.resistors, *circuit.capacitors)
    for part in parts:
        grade = stated.get(part.name)
        if grade is None or part.name in inside:
            continue
        kind: Kind = "resistor" if isinstance(part, Resistor) else "capacitor"
        try:
            catalog.part(kind, part.value, grade)
        except Unreachable:
            continue
        found[part.name] = grade
    return found


def arrays(modelfile: ModelFile, circuit: Circuit, catalog: Catalog) -> tuple[PartArray, ...]:
    """The arrays that ``[[spread.network]]`` names by their family, RN1 first."""
    rules = modelfile.spread.network
    if not any(rule.family for rule in rules):
        return ()
    groups = {g.name: g.parts for g in spread_of(modelfile, circuit, catalog).groups}
    out: list[PartArray] = []
    for number, rule in enumerate(rules, start=1):
        if rule.family is not None:
            parts = groups[f"network:{number}"]
            choice = catalog.array(rule.family, circuit.values[parts[0]])
            out.append(PartArray(f"RN{len(out) + 1}", choice, parts))
    return tuple(out)
