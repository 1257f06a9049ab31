"""Amplifiers into op-amp packages: which section of which package each one is.

The sections of the paper's circuit come with the paper's names, which are those of quads. For any
other op-amp or circuit they are put into as few packages as hold them, stages that belong together
first: an integrator with its inverter, the two halves of each path of the dead zone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from designer.catalog.entries import OpAmp
from designer.circuit.netlist import Circuit, Contact, Section

QUAD = "ABCD"
"""Sections of the packages that the paper's names speak of."""
PAPER_PACKAGES = frozenset({"U1", "U2", "U3"})
PAPER_STATES = 4


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
        stops=tuple(
            replace(
                stop,
                upper=_moved(stop.upper, names),
                lower=_moved(stop.lower, names),
                switches=tuple(names.get(name, name) for name in stop.switches),
            )
            for stop in circuit.stops
        ),
    )


def assignment(circuit: Circuit, opamp: OpAmp) -> dict[str, str]:
    """The name of each amplifier by the name that it has in the paper's packages.

    The amplifiers of the paper's circuit stay in its quads. With s sections a package, N amplifiers
    go into ceil(N / s) packages: each group of related amplifiers fills as many whole packages as
    it can, and what is left over of all groups fills further ones in turn. Packages are numbered in
    the order of the states, the dead zones last.
    """
    letters = sorted(pin.name for pin in opamp.pins)
    papers = len(circuit.states) == PAPER_STATES
    papers = papers and PAPER_PACKAGES.issuperset(s.package for s in circuit.sections)
    if papers and len(letters) == len(QUAD):
        return {s.name: s.package + letters[QUAD.index(s.name[-1])] for s in circuit.sections}
    groups = list(_related(circuit))
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


def _related(circuit: Circuit) -> Iterator[list[str]]:
    """Names of the amplifiers that belong together: of each state, then of the dead zone."""
    for net in circuit.state_nets:
        yield [s.name for s in circuit.sections if s.output in (net, f"{net}n")]
    driven = {name for net in circuit.state_nets for name in (net, f"{net}n")}
    yield [s.name for s in circuit.sections if s.output not in driven]


def _chunks(names: Sequence[str], size: int) -> Iterator[Sequence[str]]:
    return (names[i : i + size] for i in range(0, len(names), size))


def _moved(contact: Contact | None, names: Mapping[str, str]) -> Contact | None:
    """A contact whose switches have their new names; diodes keep theirs."""
    if contact is None:
        return None
    others = tuple((names.get(name, name), position) for name, position in contact.others)
    return Contact(names.get(contact.switch, contact.switch), contact.position, others)
