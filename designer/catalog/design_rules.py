"""Every design rule: what it limits, by how much, after whom, and what helps.

The functions that look at a design stand in the package ``design_rules``, by the ids of this list.
docs/rules.md holds the same list as a table.
"""

from __future__ import annotations

from designer.catalog.design_rule import DesignRule

OWN = "this tool's margin"
FAB, FAB_SOURCE = "what the fab makes", "the fab's limits, catalogs/fabs"


def _rule(
    id_: str,
    title: str,
    limit: float | str,
    unit: str,
    source: str,
    do: str,
    *,
    least: bool = False,
    board: bool = False,
) -> DesignRule:
    """limit : a number, or in words what decides it."""
    fixed = not isinstance(limit, str)
    return DesignRule(
        id=id_,
        scope="board" if board else "circuit",
        title=title,
        unit=unit,
        limit=float(limit) if fixed else None,
        limit_is="" if fixed else str(limit),
        least=least,
        source=source,
        do=do,
    )


RULES: tuple[DesignRule, ...] = (
    # Nets and pins.
    _rule(
        "feedback",
        "Share of a section's output that returns to its inverting input, less what returns to the "
        "other",
        0.01, "",
        "below it the loop gain of a TL074C's least open-loop gain, 25 V/mV, is under 250",
        "connect the feedback resistor or capacitor to the inverting input, and check that the "
        "inputs are not exchanged",
        least=True,
    ),
    _rule(
        "drivers",
        "Outputs, rails and generators on one net",
        1, "",
        "two outputs on a net drive a current into each other",
        "put the outputs on nets of their own",
    ),
    _rule(
        "floating-input",
        "Op-amp inputs without a path for their bias current",
        0, "",
        "an input's bias current needs a DC path to ground, a rail or an output",
        "give the input a resistor to a driven net, or tie the section off",
    ),
    _rule(
        "single-pin",
        "Nets with a single pin",
        0, "",
        "a wire joins two pins or more",
        "connect the pin, or mark it as not connected",
    ),
    _rule(
        "references",
        "Designators that two components share",
        0, "",
        "a board and its bill name each component once; KiCad's own checks do not see this",
        "rename one of the two",
    ),
    _rule(
        "supply-pins",
        "Supply pins of op-amps that are not on their rail",
        0, "",
        "the pin table of the op-amp's data sheet, as the catalogue has it",
        "connect V+ to the positive and V- to the negative rail",
    ),
    _rule(
        "decoupling",
        "Capacitance from a supply pin's rail to ground, at its package",
        100e-9, "F",
        "TI, OP07C, SLOS099G 12.1: 0.1 µF ceramic between each supply pin and ground",
        "add a ceramic capacitor at the pin (board.decoupling in the model file)",
        least=True,
    ),
    # Ratings and limits of the parts.
    _rule(
        "swing",
        "Peak output voltage of a section that must stay linear",
        "the op-amp's guaranteed swing at the current that its output gives", "V",
        "the op-amp's data sheet: least swing into 10 kΩ and 2 kΩ, in proportion between the two",
        "scale the voltages down (a lower saturation in the model file does that), or take an "
        "op-amp that swings nearer to its rails",
    ),
    _rule(
        "load",
        "Resistance on an output, every resistor there taken to ground",
        2e3, "Ω",
        "the least load that data sheets of the TL07x guarantee a swing for",
        "raise circuit.resistor_range, or lower the capacitors' range",
        least=True,
    ),
    _rule(
        "output-current",
        "Peak current of an output",
        "the op-amp's least guaranteed output current", "A",
        "the op-amp's data sheet",
        "take larger resistors at that output",
    ),
    _rule(
        "fault-current",
        "Current into an input while the supply is off and the generator gives 10 V",
        "the op-amp's largest input current; 2 mA where its data sheet gives none", "A",
        "the op-amp's data sheet, absolute maximum ratings; 2 mA is that of the MCP6004, DS21733J; "
        "10 V is what common generators give into a high impedance",
        "fit the input protection (board.input_protection), or drive through a larger resistor",
    ),
    _rule(
        "power",
        "Mean power of a resistor over its rating",
        0.5, "",
        f"the part family's rating; half of it is {OWN}",
        "take a family with a higher rating, or a larger resistance",
    ),
    _rule(
        "power-stuck",
        "Mean power of a resistor over its rating, with any one op-amp stuck at a rail",
        1, "",
        "the part family's rating",
        "take a family with a higher rating, or a larger resistance",
    ),
    _rule(
        "capacitor-voltage",
        "Peak voltage of a capacitor over its rating, also with an op-amp stuck at a rail",
        0.8, "",
        f"the part family's rating; a fifth of it is {OWN}",
        "take a family with a higher voltage",
    ),
    _rule(
        "common-mode",
        "Room between an op-amp's inputs and the ends of its common-mode range",
        0, "V",
        "the op-amp's data sheet; a virtual ground leaves ground while its output is at a limit, "
        "and past the range some op-amps drive their output the other way",
        "lower the stage's gain or its feedback's share of the node, or take an op-amp with a "
        "wider range",
        least=True,
    ),
    _rule(
        "bulk",
        "Capacitance of a rail's bulk capacitors at its voltage, over that of all capacitors at "
        "the op-amps' pins",
        2, "",
        f"{OWN}: the bulk refills what the op-amps take; a ceramic of X5R or X7R keeps a share of "
        "its capacitance under DC that the catalogue states or assumes",
        "take a larger bulk capacitor, or one of a higher voltage (board.bulk in the model file)",
        least=True,
    ),
    _rule(
        "reference-current",
        "Least current through a shunt reference over what it needs to regulate",
        1, "",
        "the reference's data sheet",
        "raise the supply, or take a smaller resistor before the reference",
        least=True,
    ),
    _rule(
        "temperature",
        "Room between the boards' temperatures and the ends of the op-amp's range",
        0, "°C",
        "the op-amp's data sheet; [spread] temperature of the model file, 25 °C without it",
        "take an op-amp of a wider range (TL074H, OPA4192), or keep the boards at other "
        "temperatures",
        least=True,
    ),
    _rule(
        "slew",
        "Fastest change of an output over the least guaranteed slew rate",
        0.2, "",
        f"the op-amp's data sheet; a fifth is {OWN}",
        "lower circuit.frequency, or take a faster op-amp",
    ),
    _rule(
        "gain-bandwidth",
        "Noise gain of a stage times the highest frequency that matters",
        "5 % of the op-amp's least gain-bandwidth", "Hz",
        "docs/synthesis.md, side condition bandwidth: a phase error below 0.05 rad",
        "lower circuit.frequency, or take a faster op-amp",
    ),
    # Errors referred to the clearance.
    _rule(
        "offset-force",
        "Offsets of all sections as a constant force at the clearance, over the drive",
        0.05, "",
        "root of the sum of squares of the largest offsets of the data sheet; "
        f"a twentieth of the drive is {OWN}",
        "scale the voltages up, take an op-amp with less offset (TL074H, OPA4192), or use the DC "
        "trim",
    ),
    _rule(
        "bias-force",
        "Bias currents of all sections as a constant force at the clearance, over the drive",
        0.01, "",
        f"the data sheet's largest bias current, all signs against us; a hundredth is {OWN}",
        "take smaller resistors or an op-amp with less bias current",
    ),
    _rule(
        "noise-force",
        "Noise of op-amps and resistors up to the highest frequency that matters, RMS, as a force "
        "at the clearance, over the drive",
        0.002, "",
        "the data sheet's noise density and corner, Johnson noise at 25 °C; the limit is the "
        "strobe tolerance of ngspice (docs/definitions.md)",
        "scale the voltages up, or take a quieter op-amp",
    ),
    _rule(
        "leakage-force",
        "Leakage over the board into the worst summing node, and through diodes that block, as a "
        "constant force at the clearance, over the drive",
        0.01, "",
        "a rail over 1 GΩ, assumed: ten times the 100 MΩ that IPC J-STD-004 asks of flux residues "
        "in damp heat (not compared with the standard); the diodes' largest reverse current; a "
        f"hundredth is {OWN}",
        "clean the board, put a guard ring around the node, take smaller resistors",
    ),
    _rule(
        "absorption-force",
        "What the integrators' dielectrics give back after an output stood at its limit, as a "
        "constant force at the clearance, over the drive",
        0.01, "",
        "WIMA, characteristics of dielectrics: polypropylene 0.1 %, C0G 0.6 %, X7R 2.5 %, of the "
        f"charge, here within 1 s; a hundredth is {OWN}",
        "take polypropylene, or wait after power-up before counting",
    ),
    _rule(
        "dead-zone-stiffness",
        "Stiffness left inside the clearance, over K1: nominal, and one standard deviation of the "
        "resistors' grades",
        0.5, "",
        "the spread bench-1 (docs/definitions.md); at half of K1 the model inside the clearance is "
        "another one",
        "take resistors of a better grade in the dead zone, or the rectifier, which has none",
    ),
    _rule(
        "far-slope",
        "Error of the slope beyond the bends of a force law that falls, with all that is linear: "
        "one standard deviation of the resistors' grades, over that slope",
        0.5, "",
        "at twice this one board in forty has a slope of the other sign there, and nothing holds "
        "the mass far out",
        "take resistors of a better grade, a larger velocity of the [[friction]], or a larger "
        "[[damper]] beside it",
    ),
    # The board.
    _rule(
        "part-value",
        "Parts whose value on the board is not the design's; values may be written in any way",
        0, "",
        "bom.csv of the design, and the parts of design.json",
        "update the board from the schematic",
        board=True,
    ),
    _rule(
        "part-number",
        "Parts with another part number (the field MPN) than the design's or its substitute's",
        0, "",
        "bom.csv of the design",
        "update the board's fields from the schematic",
        board=True,
    ),
    _rule(
        "part-footprint",
        "Parts in another footprint, or in one of another library than the project's and KiCad's",
        0, "",
        "bom.csv of the design",
        "update the board from the schematic",
        board=True,
    ),
    _rule(
        "part-fitted",
        "Parts that are marked DNP, or left out of the positions or the bill, although the design "
        "needs them; and parts without the mark that the design leaves out",
        0, "",
        "bom.csv of the design, which has the parts that are fitted",
        "set the footprint's attribute as the schematic has it (board.dc_trim in the model file "
        "decides about the trim)",
        board=True,
    ),
    _rule(
        "pin-hole",
        "Diameter of a pad's hole over that of the lead that goes through it, a square one's by "
        "its diagonal",
        0.08, "mm",
        "the least that is left where a fab's hole is 0.08 mm too small, which JLCPCB's "
        "capabilities allow; leads as JEDEC and the makers state them, where they are known",
        "make the hole larger",
        least=True, board=True,
    ),
    _rule(
        "unconnected",
        "Connections of nets that no copper makes yet",
        0, "",
        "KiCad's list of unconnected items",
        "route these nets, and fill the zones anew",
        board=True,
    ),
    _rule(
        "short-circuit",
        "Places where copper of two nets touches",
        0, "",
        "KiCad's check: shorting items, crossing tracks, zones that intersect",
        "move the copper apart",
        board=True,
    ),
    _rule(
        "kicad-errors",
        "Errors of KiCad's own check beside those that other rules tell",
        0, "",
        "KiCad's check at its own severities, without the board's exclusions; a footprint that "
        "differs from the library's is an error too",
        "mend what KiCad's check names",
        board=True,
    ),
    _rule(
        "schematic-parity",
        "Differences between the board and the schematic beside it",
        0, "",
        "KiCad's check of schematic parity",
        "update the board from the schematic, or the schematic from the board",
        board=True,
    ),
    _rule(
        "clearance",
        "Copper of different nets, by the largest voltage between them",
        "IPC-2221, table 6-1, column B2, at the voltage between the rails", "mm",
        "IPC-2221, table 6-1, column B2: external conductors, uncoated, up to 3050 m",
        "move the copper apart",
        least=True, board=True,
    ),
    _rule(
        "summing-clearance",
        "Copper of other nets from a summing node, where not both are pads",
        0.3, "mm",
        f"{OWN} against leakage, and the net class of the exported project; never less than the "
        "limit of clearance",
        "move the copper away from the summing node",
        least=True, board=True,
    ),
    _rule(
        "pad-clearance",
        "Pads of different nets, by the largest voltage between them",
        "IPC-2221, table 6-1, column A6, at the voltage between the rails", "mm",
        "IPC-2221, table 6-1, column A6: external component leads, uncoated",
        "move the components apart, or take a larger case",
        least=True, board=True,
    ),
    _rule(
        "board-outline",
        "From a component's pad to the edge of the board; below 0 by how far a pad is outside",
        0.5, "mm",
        "the distance from copper to an edge that KiCad asks for unless told otherwise; its own "
        "check says nothing of what lies outside altogether",
        "move the component onto the board, or the edge outwards",
        least=True, board=True,
    ),
    _rule(
        "mounting-holes",
        "Bare holes of 2.5 mm and more, for screws",
        4, "",
        f"{OWN}: the exported board has one at each corner",
        "put a mounting hole at each corner",
        least=True, board=True,
    ),
    _rule(
        "board-thickness",
        "How far the thickness of the board is from that of the exported one, 1.6 mm",
        0, "mm",
        f"{OWN}: what is ordered is what was designed; jacks at the edge and headers are for 1.6 "
        "mm",
        "set the board's thickness in KiCad",
        board=True,
    ),
    _rule(
        "board-layers",
        "Inner layers that nothing lies on, of a board with tracks",
        0, "",
        f"{OWN}: a layer that is ordered is used",
        "take the layers away in KiCad's board setup, or route on them",
        board=True,
    ),
    _rule(
        "fab-track",
        "The finest track",
        FAB, "mm",
        FAB_SOURCE,
        "widen the track, or order from a fab that makes it",
        least=True, board=True,
    ),
    _rule(
        "fab-hole",
        "How far the diameter of a round hole is outside what the fab drills",
        0, "mm",
        FAB_SOURCE,
        "change the via or the pad, or order from a fab that drills it",
        board=True,
    ),
    _rule(
        "fab-ring",
        "Ring of copper round the hole of a via or of a plated pad",
        FAB, "mm",
        FAB_SOURCE,
        "widen the via or the pad, or make its hole smaller",
        least=True, board=True,
    ),
    _rule(
        "fab-slot",
        "How far the width of a slot in a pad is outside what the fab mills",
        0, "mm",
        FAB_SOURCE,
        "widen the slot, or make it a round hole",
        board=True,
    ),
    _rule(
        "fab-silk",
        "Height of letters in silk, and width of its lines",
        FAB, "mm",
        FAB_SOURCE,
        "make the text larger and its lines wider, or hide it",
        least=True, board=True,
    ),
    _rule(
        "fab-layers",
        "Copper layers",
        FAB, "",
        FAB_SOURCE,
        "take fewer layers, or order from another fab",
        board=True,
    ),
    _rule(
        "fab-thickness",
        "How far the board's thickness is outside what the fab makes",
        0, "mm",
        FAB_SOURCE,
        "set the board's thickness in KiCad, or order from another fab",
        board=True,
    ),
    _rule(
        "component-spacing",
        "Courtyards of two components",
        0.25, "mm",
        f"{OWN}: room for an iron and for a probe",
        "move the components apart",
        least=True, board=True,
    ),
    _rule(
        "summing-length",
        "Track of one summing node, in all",
        50, "mm",
        f"{OWN}: about 5 pF and a short antenna at a node of high impedance",
        "move the node's resistors to the op-amp's input",
        board=True,
    ),
    _rule(
        "summing-span",
        "Shortest tree over the pads of one summing node",
        "25 mm; 45 mm where a part of the node stands in holes", "mm",
        f"{OWN}: what a good placement reaches; each millimetre of track adds about 0.1 pF",
        "move the node's parts to the op-amp's input",
        board=True,
    ),
    _rule(
        "summing-vias",
        "Vias in one summing node",
        2, "",
        f"{OWN}: a summing node changes sides and back at most",
        "keep the node on one side",
        board=True,
    ),
    _rule(
        "decoupling-distance",
        "From a supply pin to the nearest pad of its decoupling capacitor",
        10, "mm",
        f"{OWN}; SLOS099G 12.1 has: as close to the device as possible",
        "move the capacitor to the pin",
        board=True,
    ),
    _rule(
        "supply-width",
        "Track of a rail or of ground",
        0.3, "mm",
        f"{OWN}; IPC-2221, chart 6-4, asks less at the currents of this circuit",
        "widen the track, or pour a zone",
        least=True, board=True,
    ),
)  # fmt: skip

BY_ID: dict[str, DesignRule] = {rule.id: rule for rule in RULES}
"""The rules by id."""
