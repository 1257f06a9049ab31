"""Which stage each part belongs to, read from the nets."""

from __future__ import annotations

from collections.abc import Mapping

from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit, Fitting, Section, Stop

SUPPLY, INTERFACE = "supply", "interface"
"""Stages that are no amplifier's own: supply and decoupling; connectors, probes."""
REFERENCES = "references"
"""Stage of the references that serve more than one dead zone."""
DEAD_ZONE = "dead zone"
"""Stage of the dead zone; where there are several, its name follows."""


def section_stages(circuit: Circuit) -> dict[str, str]:
    """The stage of each section: "integrator 1" drives v1, "inverter 1" makes -v1."""
    known = {net: f"integrator {i}" for i, net in enumerate(circuit.state_nets, start=1)}
    known |= {f"{net}n": f"inverter {i}" for i, net in enumerate(circuit.state_nets, start=1)}
    out = {s.name: known.get(s.output, s.role or f"amplifier {s.name}") for s in circuit.sections}
    for title, stop in zip(dead_zone_titles(circuit), circuit.dead_zones, strict=True):
        inner = _inside(circuit, stop)
        out |= {s.name: title for s in circuit.sections if s.inverting in inner}
    return out


def dead_zone_titles(circuit: Circuit) -> tuple[str, ...]:
    """The stage of each dead zone, in their order."""
    if len(circuit.dead_zones) == 1:
        return (DEAD_ZONE,)
    return tuple(f"{DEAD_ZONE} {stop.clearance}" for stop in circuit.dead_zones)


def stage_names(circuit: Circuit) -> dict[str, str]:
    """The stage of each part of every view, by name, in the order of ``circuit.parts``.

    A part belongs where the summing node is that it reaches without passing an output, a supply
    or ground: a resistor to the stage that it feeds, a feed to the reference that it feeds.
    """
    owner = _owners(circuit)
    sections = section_stages(circuit)
    supply = {POSITIVE, NEGATIVE, GROUND, *circuit.supply_inputs}
    out: dict[str, str] = {}
    for part in (*circuit.parts, *circuit.fittings):
        if part.name in sections:
            out[part.name] = sections[part.name]
            continue
        if isinstance(part, Section) or set(part.nets) <= supply:
            out[part.name] = SUPPLY
            continue
        owned = [stage for net, stage in owner.items() if net in part.nets]
        out[part.name] = owned[0] if owned else _between(circuit, part, sections)
    return out


def _inside(circuit: Circuit, stop: Stop) -> set[str]:
    """The nets of a stop's dead zone: what is joined to its output without passing a state, its
    negative, a state's summing node, a reference, a supply or the generator."""
    states = {s for c in circuit.capacitors if c.name in circuit.states for s in c.nets}
    border = states | {f"{net}n" for net in circuit.state_nets} | _rails(circuit)
    border |= {GROUND, POSITIVE, NEGATIVE, *circuit.generator_nets}
    inside, grown = {stop.output}, True
    while grown:
        near = {net for p in circuit.parts if inside & set(p.nets) for net in p.nets} - border
        grown = not near <= inside
        inside |= near
    return inside


def _rails(circuit: Circuit) -> set[str]:
    """The nets that references hold."""
    return {net for reference in circuit.references for net in reference.nets} - {GROUND}


def _owners(circuit: Circuit) -> dict[str, str]:
    """The stage that each inner net belongs to, from the summing nodes outwards; last those of the
    references."""
    sections, rails = section_stages(circuit), _rails(circuit)
    shared = {GROUND, POSITIVE, NEGATIVE, *circuit.generator_nets, *circuit.stage_outputs}
    shared |= rails | {s.output for s in circuit.sections}
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
    for rail in sorted(rails):
        served = {owner[n] for p in parts if rail in p.nets for n in p.nets if n in owner}
        owner[rail] = served.pop() if len(served) == 1 else REFERENCES
    return owner


def _between(circuit: Circuit, part: Fitting, sections: Mapping[str, str]) -> str:
    """The stage of a part between outputs: a diode, or what loads an output."""
    drivers = {s.output: sections[s.name] for s in circuit.sections}
    driven = [drivers[net] for net in part.nets if net in drivers]
    return driven[0] if driven and part not in circuit.fittings else INTERFACE
