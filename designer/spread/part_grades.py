"""How each part is bought, where it is not as the others of its kind: its grade, its array.

What is bought of a value at a grade is ``Catalog.sold``'s to say: a study draws each part at the
grade of that (``spread.part_rules``), and the bill of materials lists that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from designer.base.errors import Unreachable
from designer.base.natural_sort import natural_key
from designer.catalog.entries import Kind
from designer.catalog.parts_catalog import Catalog
from designer.circuit.netlist import Capacitor, Circuit, Resistor
from designer.model.board_table import PartArray
from designer.model.model_file import ModelFile
from designer.spread.part_rules import kind_of, spread_of


@dataclass(frozen=True)
class BetterGrade:
    """A part of which nobody sells the value at the grade that was asked for."""

    wanted: float
    """The grade that was asked for, a fraction."""
    bought: float
    """The grade that it is bought and drawn at, a fraction."""


def better_grades(
    modelfile: ModelFile, circuit: Circuit, catalog: Catalog
) -> dict[str, BetterGrade]:
    """The parts that are bought, and drawn, at a better grade than was asked for, by name."""
    spread = spread_of(modelfile, circuit, catalog)
    return {
        name: BetterGrade(wanted, spread.grades[name])
        for name, wanted in sorted(
            spread.wanted_grades.items(), key=lambda item: natural_key(item[0])
        )
    }


def better_grades_text(better: Mapping[str, BetterGrade]) -> str:
    """One sentence on these parts, by grade; "" where there are none."""
    groups: dict[BetterGrade, list[str]] = {}
    for name, grade in better.items():
        groups.setdefault(grade, []).append(name)
    listed = [
        f"{' '.join(names)} ({100 * g.bought:g} % for {100 * g.wanted:g} %)"
        for g, names in groups.items()
    ]
    if not listed:
        return ""
    return (
        "Nobody sells these values at the grade that was asked for, so they are bought, and drawn, "
        f"at a better one: {', '.join(listed)}."
    )


def once_otherwise(modelfile: ModelFile, catalog: Catalog) -> bool:
    """Whether folders of this file may hold a bill of other grades than their study drew.

    They were once made so: the cheapest part of the grade or a better one was bought, and the grade
    that was asked for was drawn.
    """
    catalog, spec = modelfile.choices(catalog), modelfile.circuit
    ways: tuple[tuple[Kind, tuple[str, ...], tuple[float, float], float], ...] = (
        ("resistor", spec.resistors, spec.resistor_range, spec.resistor_grade),
        ("capacitor", spec.capacitors, spec.capacitor_range, spec.capacitor_grade),
    )
    for kind, series, between, usual in ways:
        stated = {
            rule.grade
            for rule in modelfile.spread.part
            if rule.grade and any(name[0].upper() == kind[0].upper() for name in rule.names)
        }
        for grade in sorted({usual, *stated}):
            try:
                values = catalog.values(kind, series, *between, grade)
            except Unreachable:
                continue
            for value in values.tolist():
                cheapest = catalog.cheapest(kind, value, grade)
                if cheapest is not None and cheapest.family.grade != grade:
                    return True
    return False


def bought(modelfile: ModelFile, circuit: Circuit, catalog: Catalog) -> dict[str, float]:
    """By name, the grades that are asked for of single resistors and capacitors.

    A grade that nobody sells the value at (0 for an exact part, or one that was picked out on the
    bench) is for the study alone: the part is then bought as the others of its kind are. Elements
    of arrays are not bought one by one.
    """
    spread = spread_of(modelfile, circuit, catalog)
    stated = {**spread.grades, **spread.wanted_grades}
    inside = {name for a in arrays(modelfile, circuit, catalog) for name in a.parts}
    grades = {}
    parts: tuple[Resistor | Capacitor, ...] = (*circuit.resistors, *circuit.capacitors)
    for part in parts:
        grade = stated.get(part.name)
        if grade is None or part.name in inside:
            continue
        if catalog.sold(kind_of(part), part.value, grade) is not None:
            grades[part.name] = grade
    return grades


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
