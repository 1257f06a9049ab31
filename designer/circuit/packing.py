"""Amplifiers into op-amp packages: which section of which package each one is.

The paper's circuit keeps the paper's names in quads. Any other circuit, and any other op-amp, fills
as few packages as hold the amplifiers, stages that belong together first: those of one mass, or an
integrator with its inverter where a package has no room for a mass; those of one dead zone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from designer.catalog.entries import OpAmp
from designer.circuit.netlist import Circuit, Contact, Section, Stop
from designer.circuit.stage_title import dead_zone_titles, section_stages

QUAD = "ABCD"
"""Sections of the packages that the paper's names speak of."""
OF_A_MASS = 4
"""Amplifiers of one mass: two integrators, each with its inverter."""


def packed(circuit: Circuit, opamp: OpAmp) -> Circuit:
    """The circuit with its amplifiers named as sections of this op-amp's packages.

    Nothing but the names of sections changes: the parts, their order and their nets stay.
    """
    names = assignment(circuit, opamp)
    if all(old == new for old, new in names.items()):
        return circuit
    return replace(
        circuit,
        parts=tuple(
            replace(part, name=names[part.name]) if isinstance(part, Section) else part
            for part in circuit.parts
        ),
        stops=_renamed(circuit.stops, names),
        bends=_renamed(circuit.bends, names),
    )


def assignment(circuit: Circuit, opamp: OpAmp) -> dict[str, str]:
    """The name of each amplifier by the name that ``build`` gives it.

    A quad's amplifiers stay in the paper's packages where those have all of them. Else, with s
    sections a package, N amplifiers go into ceil(N / s) packages: each group of related amplifiers
    fills as many whole packages as it can, and what is left over of all groups fills further ones
    in turn. Packages are numbered in the order of the states, the dead zones last.
    """
    letters = sorted(pin.name for pin in opamp.pins)
    if len(letters) == len(QUAD) and _is_papers(circuit):
        return {s.name: s.package + letters[QUAD.index(s.name[-1])] for s in circuit.sections}
    groups = _related(circuit, len(letters))
    order = [name for group in groups for name in group]
    whole = [len(group) - len(group) % len(letters) for group in groups]
    packages = [
        chunk
        for group, cut in zip(groups, whole, strict=True)
        for chunk in _chunks(group[:cut], len(letters))
    ]
    rest = [name for group, cut in zip(groups, whole, strict=True) for name in group[cut:]]
    packages += _chunks(rest, len(letters))
    packages.sort(key=lambda names: order.index(names[0]))
    return {
        name: f"U{number}{letter}"
        for number, names in enumerate(packages, start=1)
        for name, letter in zip(names, letters, strict=False)
    }


def _is_papers(circuit: Circuit) -> bool:
    """Whether the paper's packages have every amplifier of a circuit of two masses."""
    return len(circuit.states) == 4 and set(circuit.packages) <= {"U1", "U2", "U3"}


def _related(circuit: Circuit, size: int) -> list[list[str]]:
    """Names of the amplifiers that belong together, in packages of ``size``: of each mass, or of
    each state where they are too many for a package; of each dead zone; all others."""
    stages = section_stages(circuit)
    place = {
        f"{kind} {state + 1}": state // 2 if size >= OF_A_MASS else state
        for state in range(len(circuit.states))
        for kind in ("integrator", "inverter")
    }
    zones = dead_zone_titles(circuit)
    groups: dict[object, list[str]] = {key: [] for key in (*place.values(), *zones, None)}
    for stage in (*place, *zones):
        key = place.get(stage, stage)
        groups[key] += [name for name, title in stages.items() if title == stage]
    known = {name for group in groups.values() for name in group}
    groups[None] = [name for name in stages if name not in known]
    return [group for group in groups.values() if group]


def _chunks(names: Sequence[str], size: int) -> Iterator[Sequence[str]]:
    return (names[i : i + size] for i in range(0, len(names), size))


def _renamed(stops: Sequence[Stop], names: Mapping[str, str]) -> tuple[Stop, ...]:
    """The same with the new names of their switches."""
    return tuple(
        replace(
            stop,
            upper=_moved(stop.upper, names),
            lower=_moved(stop.lower, names),
            switches=tuple(names.get(name, name) for name in stop.switches),
        )
        for stop in stops
    )


def _moved(contact: Contact | None, names: Mapping[str, str]) -> Contact | None:
    """A contact whose switches have their new names; diodes keep theirs."""
    if contact is None:
        return None
    others = tuple((names.get(name, name), position) for name, position in contact.others)
    return Contact(names.get(contact.switch, contact.switch), contact.position, others)
