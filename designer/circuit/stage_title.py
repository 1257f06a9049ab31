"""Which stage each part belongs to, read from the nets."""

from __future__ import annotations

from collections.abc import Mapping

from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit, Fitting, Section

SUPPLY, INTERFACE, DEAD_ZONE = "supply", "interface", "dead zone"
"""Stages that are no amplifier's own: supply and decoupling; connectors, probes; the dead zone."""


def section_stages(circuit: Circuit) -> dict[str, str]:
    """The stage of each section: "integrator 1" drives v1, "inverter 1" makes -v1."""
    return {s.name: _stage(circuit, s) for s in circuit.sections}


def stage_names(circuit: Circuit) -> dict[str, str]:
    """The stage of each part of every view, by name, in the order of ``circuit.parts``.

    A part belongs where the summing node is that it reaches without passing an output, a supply
    or ground: a resistor to the stage that it feeds, a feed to the reference that it feeds.
    """
    owner = _owners(circuit)
    sections = section_stages(circuit)
    out: dict[str, str] = {}
    for part in (*circuit.parts, *circuit.fittings):
        if part.name in sections:
            out[part.name] = sections[part.name]
            continue
        if isinstance(part, Section) or set(part.nets) <= {POSITIVE, NEGATIVE, GROUND}:
            out[part.name] = SUPPLY
            continue
        owned = [owner[net] for net in part.nets if net in owner]
        out[part.name] = owned[0] if owned else _between(circuit, part, sections)
    return out


def _stage(circuit: Circuit, section: Section) -> str:
    if section.limits:
        return DEAD_ZONE
    nets = circuit.state_nets
    if section.output in nets:
        return f"integrator {nets.index(section.output) + 1}"
    source = next((i for i, net in enumerate(nets) if section.output == f"{net}n"), None)
    return f"amplifier {section.name}" if source is None else f"inverter {source + 1}"


def _owners(circuit: Circuit) -> dict[str, str]:
    """The stage that each inner net belongs to, from the summing nodes outwards."""
    sections = section_stages(circuit)
    shared = {GROUND, POSITIVE, NEGATIVE, circuit.generator.net, *circuit.stage_outputs}
    shared |= {s.output for s in circuit.sections}
    owner = {s.inverting: sections[s.name] for s in circuit.sections}
    parts = [p for p in circuit.parts if not isinstance(p, Section)]
    grown = True
    while grown:
        grown = False
        for part in parts:
            for net in part.nets:
                known = [owner[n] for n in part.nets if n in owner]
                if known and net not in owner and net not in shared:
                    owner[net], grown = known[0], True
    return owner


def _between(circuit: Circuit, part: Fitting, sections: Mapping[str, str]) -> str:
    """The stage of a part between outputs: a diode, or what loads an output."""
    drivers = {s.output: sections[s.name] for s in circuit.sections}
    driven = [drivers[net] for net in part.nets if net in drivers]
    return driven[0] if driven and part not in circuit.fittings else INTERFACE
