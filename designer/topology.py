"""From terms and values to the circuit: integrators, inverters, dead-zone stage.

The nets of the paper's Fig. 4 and Fig. 5: v1 … v4 the states, v1n … v4n their inverses, s1 … s4
the summing nodes, fv the nonlinear stage's output. Sections carry the paper's names for two
masses; for more, packages are filled in order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from designer.catalog import OpAmp
from designer.circuit import (
    GROUND,
    Capacitor,
    Circuit,
    Generator,
    Part,
    Resistor,
    Section,
    Stop,
)
from designer.matching import Term, inverted_states

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
DEAD_ZONE_PARTS = tuple(f"R{i}" for i in range(200, 211))
"""R200 … R210: the paper's nonlinear stage."""


def build(
    terms: Sequence[Term],
    values: Mapping[str, float],
    opamp: OpAmp,
    *,
    supply: float,
    saturation: float,
    clearance: str | None,
) -> Circuit:
    """The circuit of these terms.

    values : ohm and farad by part name; holds R100 … for the inverters and, where there is a
    clearance, R50 and R200 … R210.
    clearance : its name, or None for a model without stops: then there is no nonlinear stage.
    """
    masses = len({t.quantity[1] for t in terms})
    parts: list[Part] = []
    for state in range(2 * masses):
        parts += _integrator(state, terms, values, clearance is not None and state == 1)
    for state in inverted_states(terms):
        parts += _inverter(state, values)
    stops: tuple[Stop, ...] = ()
    if clearance is not None:
        parts += _dead_zone(values)
        stops = (Stop(clearance, "U3C", 1, "C1"),)
    return Circuit(
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


def inverter_resistors(state: int) -> tuple[str, str]:
    """Input and feedback resistor of the inverter of one state: R100 and R101 for v1, …"""
    return f"R{100 + 2 * state}", f"R{101 + 2 * state}"


def describe_quantity(term: Term) -> str:
    """A term's role in words, for the bill of materials and the drawing."""
    kind, i, j = term.quantity
    if kind == "mass":
        return f"v{term.state + 1}' = v{term.state + 2}: displacement of M{i + 1}"
    if kind == "force":
        return f"force on M{i + 1}"
    source = "velocity" if kind == "damping" else "displacement"
    return f"{kind} of M{i + 1} by the {source} of M{j + 1}"


def _integrator(
    state: int, terms: Sequence[Term], values: Mapping[str, float], stop: bool
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
        parts.append(Resistor(t.resistor, net, node, values[t.resistor], describe_quantity(t)))
    if stop:
        parts.append(Resistor("R50", "fv", node, values["R50"], "stop force on M1"))
    return parts


def _inverter(state: int, values: Mapping[str, float]) -> list[Part]:
    r_in, r_fb = inverter_resistors(state)
    node, net = f"i{state + 1}", f"v{state + 1}"
    role = f"inverter of {net}"
    return [
        Section(_section("inverter", state), node, GROUND, f"{net}n", role),
        Resistor(r_in, net, node, values[r_in], role),
        Resistor(r_fb, node, f"{net}n", values[r_fb], role),
    ]


def _dead_zone(values: Mapping[str, float]) -> list[Part]:
    """Fig. 5: the saturating path U3B, U3C and the linear path U3A, added by U3D."""

    def resistor(name: str, a: str, b: str, role: str) -> Resistor:
        return Resistor(name, a, b, values[name], role)

    def section(name: str, node: str, out: str, role: str) -> Section:
        return Section(name, node, GROUND, out, role, limits=True)

    steep, flat = "saturating path of the dead zone", "linear path of the dead zone"
    return [
        section("U3B", "d1", "w1", steep),
        resistor("R200", "v1", "d1", steep),
        resistor("R201", "d1", "w1", steep),
        section("U3C", "d2", "w2", steep),
        resistor("R202", "w1", "d2", steep),
        resistor("R203", "d2", "w2", steep),
        resistor("R204", "w2", "v11", "divider of the saturating path"),
        resistor("R205", "v11", GROUND, "divider of the saturating path"),
        section("U3A", "d3", "v12", flat),
        resistor("R206", "v1", "d3", flat),
        resistor("R207", "d3", "v12", flat),
        section("U3D", "d4", "fv", "sum of the dead zone"),
        resistor("R208", "v11", "d4", "sum of the dead zone"),
        resistor("R209", "v12", "d4", "sum of the dead zone"),
        resistor("R210", "d4", "fv", "sum of the dead zone"),
    ]


def _section(kind: str, state: int) -> str:
    known = _PAPER_SECTIONS.get((kind, state))
    if known is not None:
        return known
    # Past the paper's two masses: four sections a package, from U4 on.
    index = 2 * (state - 4) + (kind == "inverter")
    return f"U{4 + index // 4}{'ABCD'[index % 4]}"
