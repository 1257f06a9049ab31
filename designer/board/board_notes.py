"""``board.md`` of a design folder: how its board is connected, protected and trimmed."""

from __future__ import annotations

import math
from collections.abc import Sequence

from designer.base.errors import InputError
from designer.base.units import format_quantity
from designer.base.views import View
from designer.board.board_parts import (
    GENERATOR_MOST,
    drive_resistance,
    driven_nodes,
    fault_current,
    protection_offset,
    supply_current,
    trim_reach,
    trimmed_clearance,
)
from designer.board.component import Component
from designer.board.kicad_placement import place
from designer.board.summing_nodes import node_spans
from designer.catalog.parts_catalog import Catalog
from designer.check.synthesis_result import Synthesis
from designer.circuit.board_arrays import Boards
from designer.circuit.board_modes import at_rest
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit, Connector, Fitting, Section, SupplyCapacitor, Trimmer
from designer.model.board_table import BoardChoice

CENTRED = 1e-3
"""Of the distance between two stops: so near to their middle nobody sets a trimmer."""
PROBE = 100e-12
"""Capacitance [F] of a metre of coaxial cable, as the notes assume for a probe."""


def markdown(
    synthesis: Synthesis, circuit: Circuit, choice: BoardChoice, components: Sequence[Component]
) -> str:
    """The notes as Markdown; nothing in them is text of the model file."""
    parts = [
        "# The board",
        "What to buy is in `bom.csv`, the drawing in `schematic.svg`. The generator is set as "
        "`setup.csv` says.",
        _mounting(choice, components),
        "## Connections",
        _connections(circuit, components),
        _supply(circuit, synthesis.catalog),
        _outputs(circuit, choice),
        *_summing_nodes(circuit, components),
        *_reverse_protection(circuit, components),
        *_protection(synthesis, circuit, choice),
        *_trim(synthesis, circuit, choice),
        *_spare(circuit),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _q(value: float, unit: str, digits: int = 3) -> str:
    return format_quantity(value, unit, digits)


def _mounting(choice: BoardChoice, components: Sequence[Component]) -> str:
    text = {
        "mixed": "Parts are in the cases that the catalogue names first, soldered on the surface "
        "or through holes.",
        "smd": "All but connectors are soldered on the surface.",
        "tht": "All parts are soldered through holes.",
    }[choice.spec.mounting]
    pads = [c.reference for c in components if c.bought is None]
    inside = {name for array in choice.arrays for name in array.parts}
    bare = [c.reference for c in components if not c.fitted and c.reference not in inside]
    for array in choice.arrays:
        text += (
            f" {array.name}, {array.bought.part_number}, takes the places of "
            f"{', '.join(array.parts)}: the board has their single pads, and its elements are "
            "wired to these."
        )
    if pads:
        text += f" Bare pads: {', '.join(pads)}."
    if bare:
        text += f" Not fitted: {', '.join(bare)}."
    return text


def _connections(circuit: Circuit, components: Sequence[Component]) -> str:
    rows = ["| connector | pin | net |", "|---|---|---|"]
    connectors = {p.name for p in circuit.fittings if isinstance(p, Connector)}
    for component in components:
        if component.reference in connectors:
            for pin in component.pins:
                net = "ground" if pin.net == "0" else pin.net
                rows.append(f"| {component.reference}, {component.role} | {pin.number} | {net} |")
    return "\n".join(rows)


def _supply(circuit: Circuit, catalog: Catalog) -> str:
    sections = catalog.opamp(circuit.opamp).sections * len(circuit.packages)
    usual, most = supply_current(circuit, catalog)
    return (
        f"Supply: ± {circuit.supply:g} V at `vcc` and `vee`. The {sections} amplifiers draw "
        f"{_q(usual, 'A')} from each rail, {_q(most, 'A')} at "
        "most; what they deliver comes on top."
    )


def _reverse_protection(circuit: Circuit, components: Sequence[Component]) -> list[str]:
    """What the diodes in the rails ask of the supply."""
    diodes = circuit.supply_diodes
    if not diodes:
        return []
    names = " and ".join(d.name for d in diodes)
    bulk = " and ".join(c.name for c in circuit.fittings if _is_bulk(c))
    drop, supply = diodes[0].drop, circuit.supply
    connector = next(c.reference for c in components if diodes[0].source in c.nets.values())
    return [
        "## Reverse polarity",
        f"{names}, {diodes[0].model}, lie between {connector} and the rails: a supply that is "
        f"connected the wrong way round drives no current. Each drops up to {_q(drop, 'V')} at the "
        f"current above, so {connector} wants about ± {supply + drop:.3g} V. Set the supply by the "
        f"voltage across {bulk}, {supply:g} V each: that is what everything here is computed for.",
    ]


def _is_bulk(part: Fitting) -> bool:
    return isinstance(part, SupplyCapacitor) and not part.package


def _outputs(circuit: Circuit, choice: BoardChoice) -> str:
    ohms = choice.spec.probe_resistor
    corner = 1.0 / (2.0 * math.pi * ohms * PROBE)
    return (
        f"Each output is shown through {_q(ohms, 'Ω')}: with {_q(PROBE, 'F')} of cable the signal "
        f"is right up to {_q(corner / 10.0, 'Hz')} or so, and the amplifier does not feel the "
        "cable. Keep probes off the summing nodes: a few picofarads there move the circuit."
    )


def _summing_nodes(circuit: Circuit, components: Sequence[Component]) -> list[str]:
    """How far the pads of each summing node lie apart; nothing of cases that are not drawn here."""
    try:
        placed = place(circuit, [c for c in components if View.BOARD in c.views])
    except InputError:
        return []
    spans = node_spans(circuit, placed)
    rows = [f"| `{net}` | {length:.1f} mm |" for net, length in spans.items()]
    head = (
        "Each picofarad at a summing node moves the circuit. The shortest tree over the pads of "
        "each on the board of `designer export`:"
    )
    return ["## Summing nodes", head, "\n".join(["| node | length |", "|---|---|", *rows])]


def _protection(synthesis: Synthesis, circuit: Circuit, choice: BoardChoice) -> list[str]:
    opamp = synthesis.catalog.opamp(circuit.opamp).over(synthesis.catalog.temperatures)
    most = None if opamp.input_current is None else opamp.input_current.max
    lines = []
    for node in driven_nodes(circuit):
        ohms = drive_resistance(circuit, node)
        current = fault_current(circuit, node, GENERATOR_MOST)
        text = (
            f"`{node}`: {_q(GENERATOR_MOST, 'V')} from the generator, the most that a usual one "
            f"gives, drive {_q(current, 'A')} through {_q(ohms, 'Ω')}."
        )
        if most is not None:
            word = "below" if current < most else "above"
            text += f" That is {word} the {_q(most, 'A')} that an input of the op-amp stands."
        if choice.spec.input_protection:
            level = protection_offset(circuit, node, choice, synthesis.catalog, opamp.offset_limit)
            text += (
                f" The two diodes take it to ground. With {_q(opamp.offset_limit, 'V')} of input "
                f"offset across them they leak as much as {_q(level, 'V')} of DC at the generator."
            )
        lines.append(f"- {text}")
    if not lines:
        return []
    head = "If the generator is on while the supply is off, its current goes into the inputs."
    return ["## Generator before supply", head, "\n".join(lines)]


def _displacement(circuit: Circuit) -> tuple[str, str]:
    """Nets of the displacement in the clearance that the trim sets and of its stage's output; of a
    circuit without a clearance the first mass's."""
    if not circuit.stops:
        return circuit.state_nets[0], circuit.state_nets[0]
    stop = circuit.stops[trimmed_clearance(circuit)]
    state_net = circuit.state_nets[circuit.states.index(stop.state)]
    return (state_net if stop.difference is None else stop.difference[0]), stop.output


def _trim(synthesis: Synthesis, circuit: Circuit, choice: BoardChoice) -> list[str]:
    trimmers = [p for p in circuit.fittings if isinstance(p, Trimmer)]
    if not trimmers:
        return []
    name = trimmers[0].name
    series = next(
        p for p in circuit.fittings if trimmers[0].wiper in p.nets and p is not trimmers[0]
    )
    reach = trim_reach(circuit)
    fit = (
        "It is fitted."
        if View.BOM in trimmers[0].views
        else f"It is not fitted, and not on the bill: the generator's DC offset does the same. Fit "
        f"{name} and {series.name} where the generator has none."
    )
    moving, output = _displacement(circuit)
    several = ""
    if len(circuit.stops) > 1:
        several = f", clearance {circuit.stops[trimmed_clearance(circuit)].clearance}"
    steps = [
        f"Turn {name} until its wiper, net `trim`, is at 0 V.",
        "Start the board as the first line of `setup.csv` says. On the X-Y display, "
        f"`{moving}` against `{output}`{several}, read where `{output}` leaves zero.",
        f"Switch the generator off, leave it connected, and wait until `{moving}` rests.",
        f"Turn the scale of `{moving}` up ten times, and {name} until {_centred(circuit)}. If "
        f"{name} comes to its end first, leave it there.",
        "This one setting is for all responses.",
    ]
    head = (
        f"{name} and {series.name} add to the summing node what a DC of up to ± {_q(reach, 'V')} "
        f"at the generator would (the design asks for ± {_q(choice.trim, 'V')}). They cancel the "
        "constant force of offsets, bias currents and unequal limits."
    )
    numbered = "\n".join(f"{i}. {step}" for i, step in enumerate(steps, start=1))
    return ["## DC trim", f"{head} {fit}", numbered]


def _centred(circuit: Circuit) -> str:
    """Where the displacement in the clearance that the trim sets is to rest."""
    moving, _ = _displacement(circuit)
    nominal = Boards.of(circuit, [nominal_board(circuit)])
    rest, stops = at_rest(nominal, trimmed_clearance(circuit))
    ends = [float(volts[0]) for volts in stops.values()]
    away = float(rest[0]) - sum(ends) / max(len(ends), 1)
    if not ends:
        return f"`{moving}` rests at {_q(away, 'V', 3)}"
    if len(ends) == 1:
        return f"`{moving}` rests {_q(abs(away), 'V', 4)} from that voltage"
    if abs(away) < CENTRED * abs(ends[0] - ends[1]):
        return f"`{moving}` rests in the middle of the two voltages"
    where = "above" if away > 0.0 else "below"
    return f"`{moving}` rests {_q(abs(away), 'V', 4)} {where} the middle of the two voltages"


def _spare(circuit: Circuit) -> list[str]:
    names = [p.name for p in circuit.fittings if isinstance(p, Section)]
    if not names:
        return []
    return [
        "## Spare amplifiers",
        f"{', '.join(names)}: a follower with its input at ground, so that neither input nor "
        "output floats or sits at a limit.",
    ]
