"""The parts of both dead-zone stages: one that clips (the paper's Fig. 5), one that rectifies.

Both take v1 and give fv, zero inside the clearance; R50, which turns fv into the stop's force,
belongs to the integrator. docs/synthesis.md has the formulas.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from designer.base.errors import InputError
from designer.catalog.catalog import Catalog
from designer.catalog.diode_curve import DiodeModel, diode_model
from designer.catalog.entries import DiodeEntry, ReferenceEntry
from designer.circuit.netlist import (
    GROUND,
    NEGATIVE,
    POSITIVE,
    Circuit,
    Contact,
    Diode,
    Part,
    Reference,
    Section,
    Stop,
)
from designer.circuit.resistors import Resistors
from designer.model.circuit_table import CircuitSpec
from designer.model.mechanics import POSITIONS, MechanicalModel, Sides

Kind = Literal["saturation", "rectifier"]

OUTPUT = "fv"
"""Net of the stage's output."""
MOVING = "C1"
"""Capacitor whose voltage is the displacement at the stop."""


@dataclass(frozen=True)
class DeadZoneStage:
    """Which stage makes the dead zone."""

    kind: Kind = "saturation"
    """"saturation", the paper's stage that clips, or "rectifier", whose dead zone is flat."""
    sides: Sides = "both"
    """The stops that exist."""
    diode: DiodeEntry | None = None
    """The rectifier's diode; None for the other kind."""
    reference: ReferenceEntry | None = None
    """The rectifier's reference; None for the other kind."""

    @property
    def positions(self) -> tuple[int, ...]:
        """1 for the upper stop, -1 for the lower."""
        return POSITIONS[self.sides]

    def parts(self, clearance: str, resistors: Resistors) -> tuple[list[Part], Stop]:
        """The stage's parts, and how the clearance of this name shows in them.

        Raises
        ------
        InputError : a rectifier without its diode or reference.
        """
        make = _saturation if self.kind == "saturation" else _rectifier
        return make(self, clearance, resistors)


def dead_zone_stage(model: MechanicalModel, spec: CircuitSpec, catalog: Catalog) -> DeadZoneStage:
    """The stage that a model file asks for.

    Raises
    ------
    InputError : the catalogue has no such diode or reference.
    """
    stops = model.second_order().clearances
    sides = stops[0].which if stops else "both"
    if spec.dead_zone == "saturation":
        return DeadZoneStage(spec.dead_zone, sides)
    diode, reference = catalog.diode(spec.diode), catalog.reference(spec.reference)
    return DeadZoneStage(spec.dead_zone, sides, diode, reference)


def _saturation(
    stage: DeadZoneStage, clearance: str, resistor: Resistors
) -> tuple[list[Part], Stop]:
    """The saturating path U3B, U3C and the linear path U3A, added by U3D.

    U3C is linear inside the clearance and at its limit in contact. With one stop only, a constant
    moves its range: one limit stays at the stop, the other goes where v1 never is.
    """
    steep, flat = "saturating path of the dead zone", "linear path of the dead zone"
    total = "sum of the dead zone"
    parts: list[Part] = [
        _section("U3B", "d1", "w1", steep),
        *resistor("R200", "v1", "d1", steep),
        *resistor("R201", "d1", "w1", steep),
        _section("U3C", "d2", "w2", steep),
        *resistor("R202", "w1", "d2", steep),
        *resistor("R203", "d2", "w2", steep),
        *resistor("R204", "w2", "v11", "divider of the saturating path"),
        *resistor("R205", "v11", GROUND, "divider of the saturating path"),
        _section("U3A", "d3", "v12", flat),
        *resistor("R206", "v1", "d3", flat),
        *resistor("R207", "d3", "v12", flat),
        _section("U3D", "d4", OUTPUT, total),
        *resistor("R208", "v11", "d4", total),
        *resistor("R209", "v12", "d4", total),
        *resistor("R210", "d4", OUTPUT, total),
    ]
    if stage.sides != "both":
        here, back = (POSITIVE, NEGATIVE) if stage.sides == "upper" else (NEGATIVE, POSITIVE)
        parts += resistor("R211", here, "d1", "shift to one stop")
        parts += resistor("R212", back, "d4", "shift to one stop, taken out again")
    ends = {side: Contact("U3C", side) for side in stage.positions}
    return parts, Stop(clearance, MOVING, ends.get(1), ends.get(-1), OUTPUT)


@dataclass(frozen=True)
class _Half:
    """Names and nets of one half of the rectifier.

    source, threshold, feedback : resistors from v1n, the reference and fv to the summing node.
    series, clamp : diodes, and the net between the clamp and its resistor.
    reference, its rail, and the resistor that feeds it from a supply.
    """

    section: str
    node: str
    output: str
    source: str
    threshold: str
    feedback: str
    series: str
    clamp: str
    between: str
    lift: str
    reference: str
    rail: str
    feed: str
    supply: str


_HALVES = {
    1: _Half(
        section="U3A", node="d1", output="w1", source="R200", threshold="R201", feedback="R202",
        series="D200", clamp="D201", between="c1", lift="R208",
        reference="VR1", rail="vrp", feed="R206", supply=POSITIVE,
    ),
    -1: _Half(
        section="U3B", node="d2", output="w2", source="R203", threshold="R204", feedback="R205",
        series="D202", clamp="D203", between="c2", lift="R209",
        reference="VR2", rail="vrn", feed="R207", supply=NEGATIVE,
    ),
}  # fmt: skip


def _rectifier(
    stage: DeadZoneStage, clearance: str, resistor: Resistors
) -> tuple[list[Part], Stop]:
    """A half-wave rectifier for each stop, both on one output node.

    Inside the clearance the clamp diode holds the half's output away and the feedback resistor
    holds fv at 0 V; beyond the threshold the clamp lets go and the series diode takes over.

    While one half drives fv, the other's series diode has to stay off: its op-amp's output must
    stand above fv (below it, in the upper half). A resistor in series with the clamp sees to that:
    the clamp then carries 2 Vref/R201, whatever the depth of the contact, so the output stands at
    2 Vref R208/R201 and a drop. It has R201's value unless it is given one of its own. Without the
    other half there is nothing to keep off.
    """
    if stage.diode is None or stage.reference is None:
        raise InputError(None, "dead zone", "no diode or reference", "both, for a rectifier")
    model = diode_model(stage.diode)
    parts: list[Part] = []
    contacts: dict[int, Contact] = {}
    for side in stage.positions:
        half = _HALVES[side]
        word = "upper" if side > 0 else "lower"
        role, clamped = f"{word} half of the dead zone", half.output
        parts += [
            _section(half.section, half.node, half.output, role),
            *resistor(half.source, "v1n", half.node, role),
            *resistor(half.threshold, half.rail, half.node, f"threshold of the {role}"),
            *resistor(half.feedback, half.node, OUTPUT, role),
            _diode(half.series, half.output, OUTPUT, side, model, False, role),
        ]
        if stage.sides == "both":
            clamped = half.between
            parts += resistor(
                half.lift, clamped, half.output, f"clamp of the {role}", like=half.threshold
            )
        ground = (half.rail, GROUND) if side > 0 else (GROUND, half.rail)
        parts += [
            _diode(half.clamp, half.node, clamped, side, model, True, f"clamp of the {role}"),
            Reference(
                half.reference,
                *ground,
                volts=stage.reference.voltage,
                grade=stage.reference.grade,
                model=stage.reference.name,
                role=f"reference of the {role}",
                least=stage.reference.least_current,
                impedance=stage.reference.dynamic_impedance,
            ),
            *resistor(half.feed, half.supply, half.rail, f"feed of the reference, {word} half"),
        ]
        contacts[side] = Contact(half.clamp, 0, ((half.series, 1),))
    return parts, Stop(clearance, MOVING, contacts.get(1), contacts.get(-1), OUTPUT)


def idle_limits(circuit: Circuit, values: Mapping[str, float]) -> dict[str, tuple[str, float]]:
    """How far a half of the rectifier may drive fv [V] before the other's series diode conducts.

    By the driving section: that diode, and 2 Vref R208/R201 and two drops of the idle half, with
    the sign that fv has then. values : [ohm] by name, a composite's as one. Empty where there are
    not both halves.
    """
    references = {r.name: r for r in circuit.references}
    if any(half.reference not in references for half in _HALVES.values()):
        return {}
    out = {}
    for side, driving in _HALVES.items():
        idle = _HALVES[-side]
        lift = 2.0 * references[idle.reference].volts * values[idle.lift] / values[idle.threshold]
        drop = next(d.model.drop for d in circuit.diodes if d.name == idle.series)
        section = next(s.name for s in circuit.sections if s.inverting == driving.node)
        out[section] = (idle.series, side * (lift + 2.0 * drop))
    return out


def _section(name: str, node: str, out: str, role: str) -> Section:
    return Section(name, node, GROUND, out, role, limits=True)


def _diode(name: str, a: str, b: str, side: int, model: DiodeModel, rest: bool, role: str) -> Diode:
    """From a to b in the upper half, the other way round in the lower."""
    anode, cathode = (a, b) if side > 0 else (b, a)
    return Diode(name, anode, cathode, model, rest, role)
