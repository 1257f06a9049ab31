"""From terms and values to the circuit: integrators and inverters around the dead-zone stage.

The nets of the paper's Fig. 4 and Fig. 5: v1 … v4 the states, v1n … v4n their inverses, s1 … s4
the summing nodes, fv the nonlinear stage's output. Sections of quads carry the paper's names for
its own circuit; ``circuit.packing`` fills packages with any other's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from designer.catalog.entries import OpAmp
from designer.catalog.output_stage import output_at
from designer.circuit.dead_zone_parts import RAILS, DeadZoneStage, ReferenceRails
from designer.circuit.dead_zone_place import DeadZonePlace
from designer.circuit.netlist import GROUND, Capacitor, Circuit, Generator, Part, Section, Stop
from designer.circuit.packing import packed
from designer.circuit.resistors import Composite, Resistors
from designer.circuit.terms import Term, inverted_states, terms as input_terms
from designer.model.clearance import Clearance
from designer.model.mechanics import MechanicalModel

CHANNELS = Generator("VM1", "vg"), Generator("VM2", "vg2")
"""Of the generator."""

_PAPER_SECTIONS = {
    ("integrator", 0): "U1A",
    ("integrator", 1): "U2C",
    ("integrator", 2): "U1C",
    ("integrator", 3): "U2D",
    ("inverter", 0): "U2A",
    ("inverter", 1): "U1B",
    ("inverter", 2): "U2B",
    ("inverter", 3): "U1D",
}
SATURATING = DeadZoneStage()


def circuit_of(
    model: MechanicalModel,
    values: Mapping[str, float],
    opamp: OpAmp,
    *,
    supply: float,
    saturation: float | None,
    stage: DeadZoneStage = SATURATING,
    composites: Mapping[str, Composite] = MappingProxyType({}),
) -> Circuit:
    """The circuit of a model, as ``build`` makes it of the model's terms.

    saturation : output limit [V] of every pin in this circuit; None: the op-amp's own, by its load.
    """
    system = model.second_order()
    force, second = (system.drive_force(system.own_frequency, k) for k in range(len(CHANNELS)))
    wired = system.wired
    matrices = wired.damping.tolist(), wired.stiffness.tolist(), force.tolist()
    return build(
        input_terms(*matrices, second=second.tolist()),
        values,
        opamp,
        supply=supply,
        saturation=saturation,
        clearances=system.dead_zones,
        constants=wired.constant.tolist(),
        stage=stage,
        composites=composites,
    )


def build(
    terms: Sequence[Term],
    values: Mapping[str, float],
    opamp: OpAmp,
    *,
    supply: float,
    saturation: float | None,
    clearances: tuple[Clearance, ...] = (),
    constants: Sequence[float] = (),
    stage: DeadZoneStage = SATURATING,
    composites: Mapping[str, Composite] = MappingProxyType({}),
) -> Circuit:
    """The circuit of these terms.

    saturation : as of ``circuit_of``.
    values : ohm and farad by part name; holds R100 … for the inverters and, for each clearance, R50
    and the resistors of the dead-zone stage (``dead_zone_place``).
    clearances : each gets a nonlinear stage; bends come last. constants : the constant force on
    each mass, of which only the sign counts here. stage : of the dead zones. composites : resistors
    NAME made of two, whose values are those of NAMEA and NAMEB.

    Raises
    ------
    InputError : a composite of what is no resistor here; a rectifier without its parts; a clearance
        that the stage cannot make.
    """
    resistors = Resistors(values, composites)
    rails = ReferenceRails(stage.reference, resistors, stage.feeds)
    places = stage.places(clearances)
    masses = len({t.quantity[1] for t in terms})
    parts: list[Part] = []
    for state in range(2 * masses):
        parts += _integrator(state, terms, values, resistors, places)
        if state % 2 and any(constants[state // 2 : state // 2 + 1]):
            parts += _constant(state // 2, -constants[state // 2], resistors)
    # A stage may work on a displacement's negative, whether or not a term needs that.
    inverted = {*inverted_states(terms), *(s for p in places for s in p.inverted_states)}
    for state in sorted(inverted):
        parts += _inverter(state, resistors)
    for channel in range(len(CHANNELS)):
        if any(t.inverted for t in terms if t.quantity[::2] == ("force", channel)):
            parts += _generator_inverse(resistors, channel)
    stops: list[Stop] = []
    for place in places:
        parts += place.around(resistors)
        stage_parts, stop = stage.parts(place, resistors, rails)
        parts += stage_parts
        stops.append(stop)
    for force in filter(None, constants):
        sign, end = (-1, "lower") if force > 0.0 else (1, "upper")
        feed = f"feed of the reference, {end} half"
        parts += rails(sign, "reference of the constant forces", feed)
    resistors.done()
    reached = output_at(opamp, supply, saturation)
    circuit = Circuit(
        parts=tuple(parts),
        generator=CHANNELS[0],
        second=CHANNELS[1] if any(t.quantity[::2] == ("force", 1) for t in terms) else None,
        states=tuple(f"C{i + 1}" for i in range(2 * masses)),
        state_nets=tuple(f"v{i + 1}" for i in range(2 * masses)),
        stops=tuple(stop for stop in stops if not stop.bend_of),
        bends=tuple(stop for stop in stops if stop.bend_of),
        opamp=opamp.name,
        gain=opamp.gain.typ or 1e5,
        bias=opamp.bias.typ or 0.0,
        supply=supply,
        saturation=reached.limit,
        saturation_load=reached.load,
        figures=opamp,
    )
    return packed(circuit, opamp)


def constant_resistor(mass: int) -> str:
    """Name of the resistor of the constant force on a mass."""
    return f"R{160 + mass}"


def _role(term: Term) -> str:
    """A term's role in words, for the bill of materials and the drawing."""
    kind, i, j = term.quantity
    if kind == "mass":
        return f"v{term.state + 1}' = v{term.state + 2}: displacement of M{i + 1}"
    if kind == "force":
        return f"force on M{i + 1}" + (", second channel" if j else "")
    source = "velocity" if kind == "damping" else "displacement"
    return f"{kind} of M{i + 1} by the {source} of M{j + 1}"


def _integrator(
    state: int,
    terms: Sequence[Term],
    values: Mapping[str, float],
    resistors: Resistors,
    places: Sequence[DeadZonePlace],
) -> list[Part]:
    node, out, cap = f"s{state + 1}", f"v{state + 1}", f"C{state + 1}"
    what = "velocity" if state % 2 else "displacement"
    mass = state // 2
    role = f"integrator, {what} of M{mass + 1}"
    parts: list[Part] = [
        Section(_section("integrator", state), node, GROUND, out, role),
        Capacitor(cap, out, node, values[cap], role),
    ]
    for t in terms:
        if t.state == state:
            parts += resistors(t.resistor, _source(t), node, _role(t))
    for place in places if state % 2 else ():
        bends = place.clearance.bend_of
        force = f"force of {bends} on M{mass + 1}" if bends else f"stop force on M{mass + 1}"
        for each in place.forces:
            if each.mass != mass:
                continue
            parts += resistors(each.resistor, each.source, node, force)
            if place.clearance.damping:
                name = each.capacitor
                damper = f"damper of the {force}"
                parts.append(Capacitor(name, each.source, node, values[name], damper))
    return parts


def _source(term: Term) -> str:
    """The net that feeds a term's resistor."""
    if term.source is None:
        net = CHANNELS[term.quantity[2]].net
        return f"{net}n" if term.inverted else net
    return f"v{term.source + 1}" + ("n" if term.inverted else "")


def _constant(mass: int, sign: float, resistors: Resistors) -> list[Part]:
    """The resistor of a constant force, from the reference of this sign: integrators invert."""
    net, node = RAILS[1 if sign > 0.0 else -1], f"s{2 * mass + 2}"
    return [*resistors(constant_resistor(mass), net, node, f"constant force on M{mass + 1}")]


def _inverter(state: int, resistors: Resistors) -> list[Part]:
    node, net = f"i{state + 1}", f"v{state + 1}"
    role = f"inverter of {net}"
    return [
        Section(_section("inverter", state), node, GROUND, f"{net}n", role),
        *resistors(f"R{100 + 2 * state}", net, node, role),
        *resistors(f"R{101 + 2 * state}", node, f"{net}n", role),
    ]


def _generator_inverse(resistors: Resistors, channel: int) -> list[Part]:
    """The negative of a channel, for forces in antiphase to others of it."""
    net, node = CHANNELS[channel].net, ("ig", "ig2")[channel]
    role = "inverter of the generator" + (", second channel" if channel else "")
    return [
        Section(("U4C", "U4D")[channel], node, GROUND, f"{net}n", role),
        *resistors(f"R{190 + 2 * channel}", net, node, role),
        *resistors(f"R{191 + 2 * channel}", node, f"{net}n", role),
    ]


def _section(kind: str, state: int) -> str:
    """The paper's name of an amplifier; past its two masses a provisional one."""
    known = _PAPER_SECTIONS.get((kind, state))
    return known or f"U{1000 + state}{'AB'[kind == 'inverter']}"
