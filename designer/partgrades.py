"""The grade at which each part is bought, where it is not that of its kind."""

from __future__ import annotations

from designer.catalog import Catalog
from designer.catalogentry import Kind
from designer.circuit import Capacitor, Circuit, Resistor
from designer.errors import Unreachable
from designer.modelfile import ModelFile
from designer.spread import Spread


def bought(modelfile: ModelFile, circuit: Circuit, catalog: Catalog) -> dict[str, float]:
    """By name, the grades that ``[[spread.part]]`` states for resistors and capacitors.

    A grade that nobody sells the value at (0 for an exact part, or one that was picked out on the
    bench) is for the study alone: the part is then bought as the others of its kind are.
    """
    stated = Spread.of(modelfile, circuit, catalog).grades
    found = {}
    parts: tuple[Resistor | Capacitor, ...] = (*circuit.resistors, *circuit.capacitors)
    for part in parts:
        grade = stated.get(part.name)
        if grade is None:
            continue
        kind: Kind = "resistor" if isinstance(part, Resistor) else "capacitor"
        try:
            catalog.part(kind, part.value, grade)
        except Unreachable:
            continue
        found[part.name] = grade
    return found
