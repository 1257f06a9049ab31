"""The parts of both dead-zone stages: one that clips (the paper's Fig. 5), one that rectifies.

Both take the displacement in a clearance and give fv, zero inside it; R50, which turns fv into the
stop's force, belongs to the integrator. docs/synthesis.md has the formulas. One shunt reference on
each polarity serves all thresholds and constant forces, so the ratio of two thresholds does not
depend on a reference.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from designer.base.errors import InputError
from designer.catalog.diode_curve import DiodeModel, diode_model
from designer.catalog.entries import DiodeEntry, ReferenceEntry
from designer.catalog.parts_catalog import Catalog
from designer.circuit.dead_zone_place import FEEDBACK, DeadZonePlace, part_of
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
from designer.model.circuit_table import CircuitSpec, DeadZone
from designer.model.clearance import Clearance, Side
from designer.model.mechanics import MechanicalModel

RAILS = {1: "vrp", -1: "vrn"}
"""Nets that the references hold, by their sign."""
_NAMES, _SUPPLIES = {1: "VR1", -1: "VR2"}, {1: POSITIVE, -1: NEGATIVE}
RECTIFIER_FEEDS = {1: "R206", -1: "R207"}
"""Resistors from the supplies to the references, beside a rectifier: the paper's stage has other
parts of these names."""
FEEDS = {1: "R180", -1: "R181"}
"""The same in other circuits."""


class ReferenceRails:
    """Makes each reference, with its feed, where it is first needed.

    Raises
    ------
    InputError : a reference is needed and none was given.
    """

    def __init__(
        self, reference: ReferenceEntry | None, resistors: Resistors, feeds: Mapping[int, str]
    ) -> None:
        self._reference = reference
        self._resistors = resistors
        self._feeds = feeds
        self._made: set[int] = set()

    def __call__(self, sign: int, role: str, feed_role: str) -> list[Part]:
        """The reference of this sign and its feed; nothing where they are there already."""
        if self._reference is None:
            raise InputError(None, "circuit.reference", "none", "a reference for this circuit")
        if sign in self._made:
            return []
        self._made.add(sign)
        net, entry = RAILS[sign], self._reference
        ends = (net, GROUND) if sign > 0 else (GROUND, net)
        return [
            Reference(
                _NAMES[sign],
                *ends,
                volts=entry.voltage,
                grade=entry.grade,
                model=entry.name,
                role=role,
                least=entry.least_current,
                impedance=entry.dynamic_impedance,
            ),
            *self._resistors(self._feeds[sign], _SUPPLIES[sign], net, feed_role),
        ]


_RECTIFIER = 'dead_zone = "rectifier" in [circuit] ("saturation" stands where a file says nothing)'


@dataclass(frozen=True)
class DeadZoneStage:
    """Which stage makes the dead zones."""

    kind: DeadZone = "saturation"
    """"saturation", the paper's stage that clips, or "rectifier", whose dead zone is flat."""
    diode: DiodeEntry | None = None
    """The rectifier's diode; None for the other kind."""
    reference: ReferenceEntry | None = None
    """The reference of thresholds and constant forces; None where nothing needs one."""
    apart: frozenset[int] = frozenset()
    """Clearances, by their place in the order, whose halves have an output each."""

    @property
    def rectifies(self) -> bool:
        """Whether diodes make its dead zones, each stop by a half of its own. Every kind but the
        paper's is a rectifier or a variant of it, with its resistors' names and its sizing."""
        return self.kind != "saturation"

    @property
    def feeds(self) -> Mapping[int, str]:
        """Names of the resistors that feed the references, by the reference's sign."""
        return RECTIFIER_FEEDS if self.rectifies else FEEDS

    def places(self, clearances: tuple[Clearance, ...]) -> tuple[DeadZonePlace, ...]:
        """Where the stage of each clearance stands."""
        alone = len(clearances) == 1
        return tuple(
            DeadZonePlace(
                clearance,
                index,
                alone,
                inverts=(self.rectifies and index not in self.apart) != clearance.falls,
                apart=index in self.apart,
            )
            for index, clearance in enumerate(clearances)
        )

    def parts(
        self, place: DeadZonePlace, resistors: Resistors, rails: ReferenceRails
    ) -> tuple[list[Part], Stop]:
        """The parts of the stage at a place, and how its clearance shows in them.

        Raises
        ------
        InputError : a rectifier without its diode or reference; a clearance that the stage cannot
            make (``refused``).
        """
        refusal = self.refused(place.clearance)
        if refusal is not None:
            raise refusal
        if not self.rectifies:
            return _saturation(place, resistors)
        if self.diode is None:
            raise InputError(None, "dead zone", "no diode", "a diode, for a rectifier")
        if place.clearance.limits:
            return _limiter(place, resistors, rails, diode_model(self.diode))
        return _rectifier(place, resistors, rails, diode_model(self.diode))

    def refused(self, clearance: Clearance) -> InputError | None:
        """Why the stage cannot make this clearance; None if it can."""
        name, stops = clearance.name, [stop for _, stop in clearance.sides]
        if self.rectifies:
            return None
        if clearance.bend_of:
            found = f'"saturation", with bends of {clearance.bend_of}'
            expected = f"{_RECTIFIER}; an amplifier that clips makes a clearance alone"
        elif clearance.damping:
            found = f'"saturation", with damping in the stops of clearance {name}'
            expected = (
                f"{_RECTIFIER}; inside a clearance an amplifier that clips is never quite flat"
            )
        elif not clearance.plain:
            found = (
                f'"saturation", with clearance {name} of a combination, or pushed through couplings'
            )
            expected = f"{_RECTIFIER}; an amplifier that clips serves one mass, or two"
        elif any(stop.gap <= 0.0 for stop in stops):
            found = f'"saturation", with the stop of clearance {name} in contact at rest'
            expected = f"{_RECTIFIER}; an amplifier that clips is linear where nothing moves"
        elif len(stops) == 2 and stops[0] != stops[1]:
            found = f'"saturation", with unequal stops in clearance {name}'
            expected = f"{_RECTIFIER}; an amplifier that clips has the same stop on both sides"
        else:
            return None
        return InputError(None, "circuit.dead_zone", found, expected)


def stage_kind(spec: CircuitSpec, clearances: Sequence[Clearance]) -> DeadZone:
    """Kind of the stage: as stated; else the saturating one where it makes these clearances."""
    if spec.dead_zone is not None:
        return spec.dead_zone
    saturates = DeadZoneStage("saturation")
    able = len(clearances) < 2 and all(saturates.refused(c) is None for c in clearances)
    return "saturation" if able else "rectifier"


def dead_zone_stage(
    model: MechanicalModel, spec: CircuitSpec, catalog: Catalog, parts: Collection[str] = ()
) -> DeadZoneStage:
    """The stage that a model file asks for.

    parts : names of the parts of a circuit that is there, which say whose halves are apart.

    Raises
    ------
    InputError : the catalogue has no such diode or reference.
    """
    system = model.second_order()
    kind = stage_kind(spec, system.dead_zones)
    if DeadZoneStage(kind).rectifies:
        diode, reference = catalog.diode(spec.diode), catalog.reference(spec.reference)
        apart = frozenset(
            index
            for index, zone in enumerate(system.dead_zones)
            if zone.damping or part_of(index, FEEDBACK) in parts
        )
        return DeadZoneStage(kind, diode, reference, apart)
    if system.wired.constant.any():
        return DeadZoneStage(kind, None, catalog.reference(spec.reference))
    return DeadZoneStage(kind)


def _saturation(place: DeadZonePlace, resistor: Resistors) -> tuple[list[Part], Stop]:
    """The saturating path U3B, U3C and the linear path U3A, added by U3D.

    U3C is linear inside the clearance and at its limit in contact. With one stop only, a constant
    moves its range: one limit stays at the stop, the other goes where v1 never is.
    """
    steep, flat = "saturating path of the dead zone", "linear path of the dead zone"
    total = "sum of the dead zone"
    v, out, part = place.displacement, place.output, place.part
    d1, d2, d3, d4, w1, w2, v11, v12 = map(
        place.net, ("d1", "d2", "d3", "d4", "w1", "w2", "v11", "v12")
    )
    parts: list[Part] = [
        _section(place.section("U3B"), d1, w1, steep),
        *resistor(part("R200"), v, d1, steep),
        *resistor(part("R201"), d1, w1, steep),
        _section(place.section("U3C"), d2, w2, steep),
        *resistor(part("R202"), w1, d2, steep),
        *resistor(part("R203"), d2, w2, steep),
        *resistor(part("R204"), w2, v11, "divider of the saturating path"),
        *resistor(part("R205"), v11, GROUND, "divider of the saturating path"),
        _section(place.section("U3A"), d3, v12, flat),
        *resistor(part("R206"), v, d3, flat),
        *resistor(part("R207"), d3, v12, flat),
        _section(place.section("U3D"), d4, out, total),
        *resistor(part("R208"), v11, d4, total),
        *resistor(part("R209"), v12, d4, total),
        *resistor(part("R210"), d4, out, total),
    ]
    sides = place.clearance.which
    if sides != "both":
        here, back = (POSITIVE, NEGATIVE) if sides == "upper" else (NEGATIVE, POSITIVE)
        parts += resistor(part("R211"), here, d1, "shift to one stop")
        parts += resistor(part("R212"), back, d4, "shift to one stop, taken out again")
    switch = place.section("U3C")
    ends = {side: Contact(switch, side) for side in place.clearance.positions}
    return parts, _stop(place, ends, parts)


@dataclass(frozen=True)
class HalfNames:
    """Names and nets of one half of the rectifier.

    source, threshold, feedback : resistors from the displacement's negative, the reference and fv
    to the summing node. series, clamp : diodes, and the net between the clamp and its resistor.
    """

    section: str
    """The amplifier."""
    node: str
    """Its summing node."""
    output: str
    """Net of its output."""
    source: str
    """Resistor from the displacement's negative."""
    threshold: str
    """Resistor from the reference."""
    feedback: str
    """Resistor from the stage's output."""
    series: str
    """Diode to the stage's output."""
    clamp: str
    """Diode that holds the amplifier inside the clearance."""
    between: str
    """Net between the clamp and its resistor."""
    lift: str
    """The clamp's resistor."""


_HALVES = {
    1: HalfNames("U3A", "d1", "w1", "R200", "R201", "R202", "D200", "D201", "c1", "R208"),
    -1: HalfNames("U3B", "d2", "w2", "R203", "R204", "R205", "D202", "D203", "c2", "R209"),
}


def half_names(place: DeadZonePlace, side: int) -> HalfNames:
    """The names of one half, 1 upper or -1 lower, at a place."""
    h, net = _HALVES[side], place.net
    return replace(
        half_parts(place.index, side),
        section=place.section(h.section),
        node=net(h.node),
        output=net(h.output),
        between=net(h.between),
    )


def half_parts(index: int, side: int) -> HalfNames:
    """The same for a clearance by its place in their order; nets and section are the first's."""
    h = _HALVES[side]
    parts = ("source", "threshold", "feedback", "series", "clamp", "lift")
    return replace(h, **{name: part_of(index, getattr(h, name)) for name in parts})


def _rectifier(
    place: DeadZonePlace, resistor: Resistors, rails: ReferenceRails, model: DiodeModel
) -> tuple[list[Part], Stop]:
    """A half-wave rectifier for each stop, both on one output node, or on one each which an
    inverting amplifier sums (``DeadZonePlace.apart``).

    Inside the clearance the clamp diode holds the half's output away and the feedback resistor
    holds fv at 0 V; beyond the threshold the clamp lets go and the series diode takes over. A
    preloaded stop takes the reference of the other sign, so that its half drives fv at rest.

    While one half drives fv, the other's series diode has to stay off: its op-amp's output must
    stand above fv (below it, in the upper half). A resistor in series with the clamp sees to that:
    between equal halves the clamp then carries 2 Vref/R201, whatever the depth of the contact, so
    the output stands at 2 Vref R208/R201 and a drop. It has R201's value unless it is given one of
    its own. Without the other half on its node there is nothing to keep off. ``idle_limits`` has
    unequal ones.
    """
    parts: list[Part] = []
    contacts: dict[int, Contact] = {}
    shared = place.shared
    for side, stop in place.clearance.sides:
        half = half_names(place, side)
        parts += _half(place, half, side, stop, resistor, rails, model, shared=shared)
        contacts[side] = Contact(half.clamp, 0, ((half.series, 1),))
    # The amplifier that sums is linear, so it is none of the stop's switches.
    return [*parts, *place.summed(resistor)], _stop(place, contacts, parts)


def _limiter(
    place: DeadZonePlace, resistor: Resistors, rails: ReferenceRails, model: DiodeModel
) -> tuple[list[Part], Stop]:
    """Two half-wave rectifiers, one behind the other, for a force that rises between two places and
    stays there: the first gives nothing past the upper place, the second nothing below the lower.

    With G = R202/R200, H = R205/R203 and the places a and b above and below rest the first gives
    G (a - v) up to a, the second G H (v + b) from -b on and G H (a + b) beyond a. So the output is
    flat beyond both places whatever the parts, and G H b at rest, which a constant force takes
    away (``SecondOrderSystem.wired``).
    """
    parts: list[Part] = []
    contacts: dict[int, Contact] = {}
    between, role, ends = place.net("fu"), "limiter", dict(place.clearance.sides)
    for side, source, output in ((1, place.displacement, between), (-1, between, place.output)):
        half = half_names(place, side)
        word = "upper" if side > 0 else "lower"
        parts += [
            _section(half.section, half.node, half.output, f"{word} end of the {role}"),
            *resistor(half.source, source, half.node, f"{word} end of the {role}"),
        ]
        if side < 0 or ends[side].gap:
            parts += resistor(half.threshold, RAILS[-1], half.node, f"{word} end of the {role}")
        parts += [
            *resistor(half.feedback, half.node, output, f"{word} end of the {role}"),
            _diode(half.series, half.output, output, 1, model, True, f"{word} end of the {role}"),
            _diode(half.clamp, half.node, half.output, 1, model, False, f"clamp of the {role}"),
        ]
        contacts[side] = Contact(half.series, 0, ((half.clamp, 1),))
    parts += rails(-1, f"reference of the {role}", "feed of the reference, lower half")
    return parts, _stop(place, contacts, parts)


def _half(
    place: DeadZonePlace,
    half: HalfNames,
    side: int,
    stop: Side,
    resistor: Resistors,
    rails: ReferenceRails,
    model: DiodeModel,
    *,
    shared: bool,
) -> list[Part]:
    """The half of one stop; ``shared``: the other one is on its node."""
    word = "upper" if side > 0 else "lower"
    role, clamped = f"{word} half of the dead zone", half.output
    sign, preloaded = reference_sign(place, side, stop), stop.gap < 0.0
    acting, driven = place.acting(side), place.half_output(side)
    parts: list[Part] = [
        _section(half.section, half.node, half.output, role),
        *resistor(half.source, place.displacement, half.node, role),
    ]
    if stop.gap:
        parts += resistor(half.threshold, RAILS[sign], half.node, f"threshold of the {role}")
    parts += [
        *resistor(half.feedback, half.node, driven, role),
        _diode(half.series, half.output, driven, acting, model, preloaded, role),
    ]
    if shared:
        clamped = half.between
        like = half.threshold if stop.gap else half.source
        parts += resistor(half.lift, clamped, half.output, f"clamp of the {role}", like=like)
    clamps = f"clamp of the {role}"
    parts.append(_diode(half.clamp, half.node, clamped, acting, model, not preloaded, clamps))
    if stop.gap:
        end = "upper" if sign > 0 else "lower"
        parts += rails(sign, f"reference of the {role}", f"feed of the reference, {end} half")
    return parts


def reference_sign(place: DeadZonePlace, side: int, stop: Side) -> int:
    """Sign of the reference that sets a threshold of a rectifier: of the side on which the stage
    meets the stop, of a preloaded stop the other. Both of a limiter are negative."""
    if place.clearance.limits:
        return -1
    return place.acting(side) if stop.gap >= 0.0 else -place.acting(side)


def _stop(place: DeadZonePlace, contacts: Mapping[int, Contact], parts: Sequence[Part]) -> Stop:
    clearance, source = place.clearance, place.forces[0].source
    return Stop(
        clearance.name,
        f"C{clearance.watched + 1}",
        contacts.get(1),
        contacts.get(-1),
        place.output,
        tuple(part.name for part in parts if isinstance(part, Section | Diode)),
        place.difference,
        clearance.bend_of,
        clearance.limits,
        "" if source == place.output else source,
    )


def idle_limits(circuit: Circuit, values: Mapping[str, float]) -> dict[str, tuple[str, float]]:
    """How far a half of a rectifier may drive fv [V] before the other's series diode conducts.

    By the driving section: that diode, and the voltage with the sign that fv has then. At a depth d
    of the contact the idle half's clamp carries (t + t')/R' + d (1/R' - s/F'): t and t' are the
    thresholds of the driving and the idle half, s the driving half's gain, R' and F' the idle
    half's input and feedback resistor. The clamp's resistor and two drops are what keeps the diode
    off; a half steeper than the idle one takes from that current, a flat one adds to it. values :
    [ohm] by name, a composite's as one. Left out is what no voltage ends, and a clearance whose
    halves have an output each.
    """
    out = {}
    for index, stop in enumerate(circuit.dead_zones):
        if circuit.diodes and len(stop.contacts) == 2:
            for side in (1, -1):
                driving, idle = (half_parts(index, end) for end in (side, -side))
                if idle.lift not in values:
                    continue
                diodes = {d.name: d for d in circuit.diodes}
                feeding = diodes[driving.series].nets
                section = next(s.name for s in circuit.sections if s.output in feeding)
                reach = _idle_reach(circuit, values, driving, idle)
                if math.isfinite(reach):
                    out[section] = (idle.series, side * reach)
    return out


def _idle_reach(
    circuit: Circuit, values: Mapping[str, float], driving: HalfNames, idle: HalfNames
) -> float:
    """Size of the limit of ``idle_limits`` [V]; infinite where there is none."""
    diodes = {d.name: d for d in circuit.diodes}
    volts = max((r.volts for r in circuit.references), default=0.0)
    signs = [-1.0 if diodes[half.series].rest else 1.0 for half in (driving, idle)]
    own, other = (
        sign * volts * values[half.source] / values[half.threshold]
        if half.threshold in values
        else 0.0
        for half, sign in zip((driving, idle), signs, strict=True)
    )
    if other:
        share = (1.0 + own / other) * signs[1]
        lift = share * volts * values[idle.lift] / values[idle.threshold]
    else:
        lift = own * values[idle.lift] / values[idle.source]
    gain = values[idle.feedback] / values[idle.source]
    steeper = 1.0 - gain / (values[driving.feedback] / values[driving.source])
    taken = 1.0 + values[idle.lift] / values[idle.feedback] * steeper
    reach = lift + 2.0 * diodes[idle.series].model.drop
    return reach / taken if taken > 0.0 else float("inf")


def _section(name: str, node: str, out: str, role: str) -> Section:
    return Section(name, node, GROUND, out, role, limits=True)


def _diode(name: str, a: str, b: str, side: int, model: DiodeModel, rest: bool, role: str) -> Diode:
    """A diode from a to b in the upper half, the other way round in the lower."""
    anode, cathode = (a, b) if side > 0 else (b, a)
    return Diode(name, anode, cathode, model, rest, role)
