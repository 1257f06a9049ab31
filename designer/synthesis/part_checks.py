"""What a model file asks of the parts, checked against the catalogue before any part is chosen.

A refusal names the parts or values of the catalogue that would do.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError, Unreachable
from designer.base.schema import did_you_mean
from designer.catalog.diode_curve import diode_model
from designer.catalog.entries import DiodeEntry, Kind, OpAmp, ReferenceEntry
from designer.catalog.parts_catalog import Catalog
from designer.circuit import build
from designer.circuit.dead_zone_parts import DeadZoneStage, dead_zone_stage, stage_kind
from designer.circuit.dead_zone_place import MOST_MASSES
from designer.circuit.netlist import Circuit
from designer.circuit.terms import drive_resistor
from designer.model.circuit_table import CircuitSpec, DeadZone
from designer.model.clearance import Clearance
from designer.model.mechanics import MechanicalModel, SecondOrderSystem, reaches_ground

_SECTION = re.compile("[A-OQ-Z]")
"""Names that sections may have: U1P is the supply of U1."""
Refusal = InputError | None


def check_choices(model: MechanicalModel, spec: CircuitSpec, catalog: Catalog) -> None:
    """Refuse what cannot be built before anything is computed.

    Raises
    ------
    InputError : a part of the catalogue that is not known or cannot be used, a part that the
        circuit does not have, or a choice of the contract that this version does not build.
    Unreachable : no value of the series can be bought in the range.
    """
    check_system(model, spec)
    opamp_of(spec, catalog)
    if spec.saturation is not None and not 0.0 < spec.saturation <= spec.supply:
        expected = f"above 0 and up to {spec.supply:g} V"
        raise InputError(None, "circuit.saturation", spec.saturation, expected)
    system = model.second_order()
    zones = system.dead_zones
    by_diodes = bool(zones) and DeadZoneStage(stage_kind(spec, zones)).rectifies
    if by_diodes:
        diode_of(spec.diode, catalog)
    if by_diodes or system.wired.constant.any():
        _reference_of(spec, catalog)
    if spec.objective == "yield":
        raise InputError(
            None,
            "circuit.objective",
            spec.objective,
            '"margin" or "match": a design for the yield comes from search, run or synthesise with '
            "--out",
        )
    circuit = unit_circuit(model, spec, catalog)
    for group in spec.matched:
        _check_names("circuit.matched", group, tuple(circuit.values))
    if not isinstance(spec.composites, bool):
        _check_names("circuit.composites", spec.composites, matching_resistors(circuit))
    resistors = buyable("resistor", spec, catalog)
    capacitors = buyable("capacitor", spec, catalog)
    for value in spec.preferred:
        values = resistors if value >= 1.0 else capacitors
        if not np.isclose(values, value, rtol=1e-9).any():
            near = nearest(values, value)
            expected = f"values of the series that can be bought in the range, such as {near:g}"
            raise InputError(None, "circuit.preferred", value, expected)


MOST_DEAD_ZONES = 8
"""On one board."""


def check_system(model: MechanicalModel, spec: CircuitSpec) -> None:
    """Refuse what no circuit of ours can do, element by element.

    Raises
    ------
    InputError : the first such element, why, and what would be near.
    """
    system = model.second_order()
    if system.channels(system.own_frequency) is None:
        expected = (
            "for a circuit forces that are the sums of two shapes, of any sizes and signs: a "
            "generator has two channels, and a displacement of the ground takes one beside forces"
        )
        raise InputError(None, "force", "forces of more than two phases or shapes", expected)
    for clearance in system.clearances:
        jumps = [stop.jump for _, stop in clearance.sides if stop.jump]
        if jumps:
            raise InputError(
                None,
                f"clearance {clearance.name}.preload",
                jumps[0],
                "preload_over beside it for a circuit, the depth over which it rises: a force that "
                "jumps at the contact has no stage; a negative gap is a stop in contact at rest",
            )
        follows = system.fixed_stops and system.ground_moves
        if follows and reaches_ground(system.displacement(clearance).tolist()):
            laws = [law.name for law in system.laws if reaches_ground(law.row)]
            raise InputError(
                None,
                "base.stops",
                f'"fixed", beside {laws[0]}, which moves with the ground',
                '"base" for a circuit, or laws between masses alone: the displacement of the '
                "ground is no voltage, so that only stops or only laws can follow it",
            )
    zones = system.dead_zones
    for zone in zones:
        most = max(len(zone.terms), len(zone.pushed))
        if most > MOST_MASSES:
            what = f"law {zone.bend_of}" if zone.bend_of else f"clearance {zone.name}"
            found = f"{most} masses that it is of, or pushes"
            raise InputError(None, what, found, f"at most {MOST_MASSES} for a circuit")
        if zone.damping and len({stop.stiffness for _, stop in zone.sides}) > 1:
            raise InputError(
                None,
                f"clearance {zone.name}.damping",
                zone.damping,
                "for a circuit stops of one stiffness, or a [[clearance]] for each: one capacitor "
                "damps both",
            )
    if len(zones) > MOST_DEAD_ZONES:
        raise InputError(None, "circuit", *_too_many(system))
    refusal = stage_refusal(zones, stage_kind(spec, zones))
    if refusal is not None:
        raise refusal
    scaled = [f"a force that limits ({zone.bend_of})" for zone in zones if zone.limits]
    scaled += [f"stops with damping ({zone.name})" for zone in zones if zone.damping]
    scaled += [f"a combination ({zone.name})" for zone in zones if not zone.plain]
    for key, value in (("most_values", spec.most_values), ("matched", spec.matched)):
        if scaled and value:
            expected = f"none beside {scaled[0]}: the parts are chosen by scales"
            raise InputError(None, f"circuit.{key}", value, expected)


def _too_many(system: SecondOrderSystem) -> tuple[str, str]:
    """What was found and what is expected where there are too many dead zones for a board."""
    zones = system.dead_zones
    bends = Counter(zone.bend_of for zone in zones if zone.bend_of)
    listed = ", ".join(f"{count} for {name}" for name, count in bends.items())
    found = f"{len(zones)} dead zones, of them {listed or 'none for a law'}"
    expected = (
        f"at most {MOST_DEAD_ZONES}, each with an op-amp for either side: fewer points, or a "
        "larger error of a [[cubic_spring]] or of a Hertz contact"
    )
    return found, expected


def stage_refusal(clearances: Sequence[Clearance], kind: DeadZone) -> Refusal:
    """Why the stage of this kind cannot make these clearances; None if it can."""
    stage = DeadZoneStage(kind)
    for clearance in clearances:
        refusal = stage.refused(clearance)
        if refusal is not None:
            return refusal
    if len(clearances) > 1 and not stage.rectifies:
        return InputError(
            None,
            "circuit.dead_zone",
            '"saturation", with several clearances',
            '"rectifier": the thresholds of amplifiers that clip do not keep a ratio',
        )
    return None


def buyable(kind: Kind, spec: CircuitSpec, catalog: Catalog) -> Array:
    """Values of the circuit's resistors [ohm] or capacitors [F] that can be bought, ascending.

    Raises
    ------
    Unreachable : there is none.
    """
    if kind == "resistor":
        return catalog.values(kind, spec.resistors, *spec.resistor_range, spec.resistor_grade)
    return catalog.values(kind, spec.capacitors, *spec.capacitor_range, spec.capacitor_grade)


def nearest(values: Array, wanted: float) -> float:
    """The value nearest in ratio."""
    return float(values[int(np.argmin(np.abs(np.log(values / wanted))))])


def unit_circuit(
    model: MechanicalModel,
    spec: CircuitSpec,
    catalog: Catalog,
    stage: DeadZoneStage | None = None,
) -> Circuit:
    """The circuit of this model with every value 1: the names of its parts are what counts.

    stage : of its dead zones; the one that the file asks for, if None.
    """
    opamp = catalog.opamp(spec.opamp)
    return build.circuit_of(
        model,
        defaultdict(lambda: 1.0),
        opamp,
        supply=spec.supply,
        saturation=spec.saturation,
        stage=dead_zone_stage(model, spec, catalog) if stage is None else stage,
    )


def equal_resistors(circuit: Circuit) -> tuple[frozenset[str], ...]:
    """Groups of resistors that are equal and only set a level: the two of an amplifier that neither
    integrates nor belongs to a dead zone, and the three that sum the halves of one."""
    stored = {net for capacitor in circuit.capacitors for net in capacitor.nets}
    sums = {stop.output for stop in circuit.dead_zones}
    out = []
    for s in circuit.sections:
        at = frozenset(r.name for r in circuit.resistors if s.inverting in r.nets)
        if not s.limits and s.inverting not in stored and (len(at) == 2 or s.output in sums):
            out.append(at)
    return tuple(out)


def drive_resistors(circuit: Circuit, channel: int = 0) -> tuple[str, ...]:
    """Resistors from a channel of the generator, or its inverse, to the masses that it drives, in
    their order."""
    masses = len(circuit.states) // 2
    names = (drive_resistor(masses, mass, channel) for mass in range(masses))
    return tuple(name for name in names if name in circuit.values)


def matching_resistors(circuit: Circuit) -> tuple[str, ...]:
    """Resistors that the coefficients depend on: not those of the inverters, of the drive, or from
    a supply to a reference. Only these can gain from a second part."""
    held = {net for ref in circuit.references for net in ref.nets}
    rails = {supply.net for supply in circuit.supplies}
    others = {*drive_resistors(circuit), *drive_resistors(circuit, 1)}
    others |= frozenset().union(*equal_resistors(circuit))
    return tuple(
        r.name
        for r in circuit.resistors
        if r.name not in others and not (held & set(r.nets) and rails & set(r.nets))
    )


def opamp_of(
    spec: CircuitSpec, catalog: Catalog, fits: Callable[[OpAmp], Refusal] = lambda _: None
) -> OpAmp:
    """The op-amp that a model file names.

    fits : a further condition: why an op-amp does not fit, or None.

    Raises
    ------
    InputError : there is none of this name, or it cannot be used; which ones could.
    """

    def refusal(name: str) -> Refusal:
        why = _opamp_refusal(name, spec, catalog)
        return why if why is not None else fits(catalog.opamp(name))

    _refuse(spec.opamp, "op-amps", [o.name for o in catalog.opamps], refusal)
    return catalog.opamp(spec.opamp)


def diode_of(name: str, catalog: Catalog) -> DiodeEntry:
    """The diode of this name, with the figures of a diode, in a case that the board takes.

    Raises
    ------
    InputError : there is none; which ones could be used.
    """

    def refusal(other: str) -> Refusal:
        return _caught(lambda: diode_model(catalog.diode(other)))

    _refuse(name, "diodes", [d.name for d in catalog.diodes], refusal)
    return catalog.diode(name)


def _reference_of(spec: CircuitSpec, catalog: Catalog) -> ReferenceEntry:
    """The reference that a model file names: one that its rails can feed.

    Raises
    ------
    InputError : there is none in a case that the board takes; which ones could be used.
    Unreachable : the rails cannot feed it; which ones they could.
    """

    def refusal(name: str) -> Refusal:
        why = _caught(lambda: catalog.reference(name))
        if why is not None or catalog.reference(name).voltage < spec.supply:
            return why
        found = f"{name}, of {catalog.reference(name).voltage:g} V"
        expected = f"a reference below the rails of {spec.supply:g} V"
        return Unreachable(None, "circuit.reference", found, expected)

    _refuse(spec.reference, "references", [r.name for r in catalog.references], refusal)
    return catalog.reference(spec.reference)


def _opamp_refusal(name: str, spec: CircuitSpec, catalog: Catalog) -> Refusal:
    """Why no circuit of this specification can be built with an op-amp; None if it can."""
    why = _caught(lambda: catalog.opamp(name, spec.supply))
    if why is not None:
        return why
    opamp = catalog.opamp(name)
    low, high = opamp.supply.min or 0.0, opamp.supply.max or np.inf
    if not opamp.takes(spec.supply):
        expected = f"{low:g} to {high:g} V, the rails of {name}"
        return InputError(None, "circuit.supply", spec.supply, expected)
    limit = opamp.saturation_at(spec.supply)
    if spec.saturation is None and not 0.0 < limit <= spec.supply:
        expected = f"an op-amp whose outputs reach something between 0 and {spec.supply:g} V"
        return InputError(None, "circuit.opamp", f"{name}, which limits at {limit:g} V", expected)
    for section in opamp.pins:
        if not _SECTION.fullmatch(section.name):
            found = f"{name}, with a section {section.name}"
            expected = "an op-amp with sections named by one capital letter each, but not P"
            return InputError(None, "circuit.opamp", found, expected)
    return None


def _refuse(name: str, kind: str, names: Iterable[str], refusal: Callable[[str], Refusal]) -> None:
    """Raise why a part is refused, and which of the catalogue's are not."""
    why = refusal(name)
    if why is None:
        return
    if name not in names or why.field == "board.mounting":
        raise why  # which names the known ones, or those that have a case
    good = [other for other in names if refusal(other) is None]
    instead = f"{kind} of the catalogue that would do: {', '.join(good) or 'none'}"
    raise type(why)(why.file, why.field, why.found, f"{why.expected}; {instead}")


def _caught(look_up: Callable[[], object]) -> Refusal:
    """The error of a look-up, or None."""
    try:
        look_up()
    except InputError as error:
        return error
    return None


def _check_names(field: str, names: Iterable[str], known: tuple[str, ...]) -> None:
    """InputError of the first name that is unknown, with the known ones."""
    for name in names:
        if name not in known:
            hint = did_you_mean(name, known)
            listed = "parts of this model's circuit: " + ", ".join(known)
            raise InputError(None, field, name, listed + (f"; {hint}" if hint else ""))
