"""From terms and values to the circuit: integrators and inverters around the dead-zone stage.

The nets of the paper's Fig. 4 and Fig. 5: v1 … v4 the states, v1n … v4n their inverses, s1 … s4
the summing nodes, fv the nonlinear stage's output. Sections of quads carry the paper's names for
two masses; for more, packages are filled in order. Other op-amps: ``circuit.packing``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from designer.catalog.entries import OpAmp
from designer.circuit.dead_zone_parts import OUTPUT, DeadZoneStage
from designer.circuit.netlist import GROUND, Capacitor, Circuit, Generator, Part, Section, Stop
from designer.circuit.packing import packed
from designer.circuit.resistors import Composite, Resistors
from designer.circuit.terms import Term, inverted_states, terms as input_terms
from designer.model.mechanics import MechanicalModel

GENERATOR = Generator("VM1", "vg")

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
    saturation: float,
    stage: DeadZoneStage = SATURATING,
    composites: Mapping[str, Composite] = MappingProxyType({}),
) -> Circuit:
    """The circuit of a model, as ``build`` makes it of the model's terms."""
    system = model.second_order()
    matrices = system.damping.tolist(), system.stiffness.tolist(), system.force.tolist()
    return build(
        input_terms(*matrices),
        values,
        opamp,
        supply=supply,
        saturation=saturation,
        clearance=system.clearances[0].name if system.clearances else None,
        stage=stage,
        composites=composites,
    )


def build(
    terms: Sequence[Term],
    values: Mapping[str, float],
    opamp: OpAmp,
    *,
    supply: float,
    saturation: float,
    clearance: str | None,
    stage: DeadZoneStage = SATURATING,
    composites: Mapping[str, Composite] = MappingProxyType({}),
) -> Circuit:
    """The circuit of these terms.

    values : ohm and farad by part name; holds R100 … for the inverters and, where there is a
    clearance, R50 and the resistors of the dead-zone stage.
    clearance : its name, or None for a model without stops: then there is no nonlinear stage.
    stage : of the dead zone. composites : resistors NAME made of two, whose values are those of
    NAMEA and NAMEB.

    Raises
    ------
    InputError : a composite of what is no resistor here; a rectifier without its parts.
    """
    resistors = Resistors(values, composites)
    masses = len({t.quantity[1] for t in terms})
    parts: list[Part] = []
    for state in range(2 * masses):
        stop = clearance is not None and state == 1
        parts += _integrator(state, terms, values, resistors, stop)
    inverted = set(inverted_states(terms))
    if clearance is not None and stage.kind == "rectifier":
        inverted.add(0)  # it works on -v1, whether or not a term needs that
    for state in sorted(inverted):
        parts += _inverter(state, resistors)
    stops: tuple[Stop, ...] = ()
    if clearance is not None:
        stage_parts, dead_zone = stage.parts(clearance, resistors)
        parts += stage_parts
        stops = (dead_zone,)
    resistors.done()
    circuit = Circuit(
        parts=tuple(parts),
        generator=GENERATOR,
        states=tuple(f"C{i + 1}" for i in range(2 * masses)),
        state_nets=tuple(f"v{i + 1}" for i in range(2 * masses)),
        stops=stops,
        opamp=opamp.name,
        gain=opamp.gain.typ or 1e5,
        bias=opamp.bias.typ or 0.0,
        supply=supply,
        saturation=saturation,
        figures=opamp,
    )
    return packed(circuit, opamp)


def _role(term: Term) -> str:
    """A term's role in words, for the bill of materials and the drawing."""
    kind, i, j = term.quantity
    if kind == "mass":
        return f"v{term.state + 1}' = v{term.state + 2}: displacement of M{i + 1}"
    if kind == "force":
        return f"force on M{i + 1}"
    source = "velocity" if kind == "damping" else "displacement"
    return f"{kind} of M{i + 1} by the {source} of M{j + 1}"


def _integrator(
    state: int,
    terms: Sequence[Term],
    values: Mapping[str, float],
    resistors: Resistors,
    stop: bool,
) -> list[Part]:
    node, out, cap = f"s{state + 1}", f"v{state + 1}", f"C{state + 1}"
    what = "velocity" if state % 2 else "displacement"
    mass = state // 2 + 1
    parts: list[Part] = [
        Section(_section("integrator", state), node, GROUND, out, f"integrator, {what} of M{mass}"),
        Capacitor(cap, out, node, values[cap], f"integrator, {what} of M{mass}"),
    ]
    for t in terms:
        if t.state != state:
            continue
        if t.source is None:
            net = GENERATOR.net
        else:
            net = f"v{t.source + 1}" + ("n" if t.inverted else "")
        parts += resistors(t.resistor, net, node, _role(t))
    if stop:
        parts += resistors("R50", OUTPUT, node, "stop force on M1")
    return parts


def _inverter(state: int, resistors: Resistors) -> list[Part]:
    node, net = f"i{state + 1}", f"v{state + 1}"
    role = f"inverter of {net}"
    return [
        Section(_section("inverter", state), node, GROUND, f"{net}n", role),
        *resistors(f"R{100 + 2 * state}", net, node, role),
        *resistors(f"R{101 + 2 * state}", node, f"{net}n", role),
    ]


def _section(kind: str, state: int) -> str:
    known = _PAPER_SECTIONS.get((kind, state))
    if known is not None:
        return known
    # Past the paper's two masses: four sections a package, from U4 on.
    index = 2 * (state - 4) + (kind == "inverter")
    return f"U{4 + index // 4}{'ABCD'[index % 4]}"
