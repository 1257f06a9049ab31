"""What a board needs that no equation knows of: supplies, connectors, probes, trim, protection.

Everything is added to ``Circuit.fittings``; the simulated parts stay as they are, and every
addition is neutral while the circuit works (docs/board.md says why).

The rails keep the model file's ``supply``: it is what every equation and rule is computed with. At
the connector the supply has to be higher by what the diodes drop.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Protocol

from designer.base.errors import InputError, Unreachable
from designer.base.units import format_quantity
from designer.base.views import View
from designer.catalog.diode_curve import THERMAL, diode_model
from designer.catalog.entries import SupplyDiodeEntry
from designer.catalog.parts_catalog import Catalog
from designer.circuit.design import Design
from designer.circuit.netlist import (
    GROUND,
    NEGATIVE,
    POSITIVE,
    Circuit,
    Connector,
    Diode,
    Fitting,
    Generator,
    Resistor,
    Section,
    SupplyCapacitor,
    SupplyDiode,
    TestPoint,
    Trimmer,
)
from designer.circuit.stage_title import SUPPLY
from designer.model.board_table import BoardChoice
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile
from designer.spread.part_grades import arrays, bought

LEAST_TRIM = 0.01
"""Least reach of the DC trim, as a share of the generator's amplitude."""
TRIMMER = 10e3
"""The trimmer's resistance [Ω]: it lies between the rails and loads them with some milliamperes."""
LEAST_SERIES = 10e3
"""Least resistance [Ω] after the wiper, so that the trimmer's own does not count."""
MOST_SERIES = 10e6
"""Most resistance [Ω] after the wiper: beyond it a board's own leakage counts."""
PROBES = 10
"""Probes that the numbers before the trim's leave room for; with more, the trim's moves on."""
PROTECTION = 10
"""Diodes of summing nodes that the numbers before the supply's leave room for; with more, the
supply's move on."""
WAYS = 40
"""Most ways of a header that each output has a pin of ground beside its own on."""
GENERATOR_MOST = 10.0
"""Most [V peak] that a usual function generator gives without a load."""


class Designed(Protocol):
    """A model file with the design that was made for it."""

    @property
    def modelfile(self) -> ModelFile: ...

    @property
    def catalog(self) -> Catalog: ...

    @property
    def model_responses(self) -> tuple[ModelResponse, ...]: ...

    @property
    def design(self) -> Design: ...


def fitted(circuit: Circuit, choice: BoardChoice, catalog: Catalog) -> Circuit:
    """The circuit with everything that its board needs; what was fitted before is replaced.

    Raises
    ------
    InputError : an op-amp, a diode or a connector that the catalogue does not have, or a diode that
        does not stand the supply.
    Unreachable : no resistor for a trim that is to be fitted can be bought. Footprints that stay
        empty are left out then.
    """
    bare = replace(circuit, fittings=())
    spec = choice.spec
    parts: list[Fitting] = [*_spare(bare, catalog), *_supply(bare, choice, catalog)]
    parts.append(Connector("J2", (bare.generator.net, GROUND), "generator", _series(choice)))
    parts += _probes(bare, choice)
    if bare.second is not None:
        number = 1 + sum(isinstance(part, Connector) for part in parts)
        pins, role = (bare.second.net, GROUND), "generator, second channel"
        parts.append(Connector(f"J{number}", pins, role, _series(choice)))
    if spec.input_protection:
        parts += _protection(bare, choice, catalog)
    if spec.dc_trim != "none":
        parts += _trim(bare, choice, catalog)
    return replace(bare, fittings=tuple(parts))


def board_choice(
    modelfile: ModelFile, design: Design, responses: Sequence[ModelResponse] = ()
) -> BoardChoice:
    """The choices of a model file for its design.

    The trim reaches as far as the DC offset that a bench may set at the largest amplitude of the
    wanted responses (``[tuning]``, ``offset``), and at least ``LEAST_TRIM`` of that amplitude.
    """
    amplitude = max((design.amplitude(r.b, r.omega) for r in responses), default=design.amplitude())
    reach = amplitude * max(modelfile.tuning.offset, LEAST_TRIM)
    return replace(BoardChoice.of(modelfile.circuit, modelfile.board), trim=reach)


def board_circuit(synthesis: Designed) -> tuple[Circuit, BoardChoice]:
    """The circuit of a design with its fittings, and the choices that they were made by."""
    choice = board_choice(synthesis.modelfile, synthesis.design, synthesis.model_responses)
    grades = bought(synthesis.modelfile, synthesis.design.circuit, synthesis.catalog)
    inside = arrays(synthesis.modelfile, synthesis.design.circuit, synthesis.catalog)
    choice = replace(choice, grades=grades, arrays=inside)
    return fitted(synthesis.design.circuit, choice, synthesis.catalog), choice


def probed_nets(circuit: Circuit) -> tuple[str, ...]:
    """The nets with a probe: the circuit's outputs, and the displacement in each clearance between
    two masses."""
    between = [stop.difference[0] for stop in circuit.stops if stop.difference is not None]
    return (*circuit.outputs, *between)


def driven_nodes(
    circuit: Circuit, channel: Generator | None = None
) -> dict[str, tuple[Resistor, ...]]:
    """The summing nodes that the generator drives, each with the resistors of its path. channel :
    of the generator, whose nodes they are; None: of any."""
    driven: dict[str, tuple[Resistor, ...]] = {}
    nodes = {s.inverting for s in circuit.sections}
    channels = circuit.generators if channel is None else (channel,)
    for first, one in product(circuit.resistors, channels):
        if one.net not in first.nets:
            continue
        net, path = _far(first, one.net), [first]
        while net not in nodes:  # the middle of a composite
            second = next(r for r in circuit.resistors if net in r.nets and r not in path)
            path.append(second)
            net = _far(second, net)
        driven[net] = (*driven.get(net, ()), *path)
    return driven


def _far(resistor: Resistor, net: str) -> str:
    return resistor.b if resistor.a == net else resistor.a


def drive_resistance(circuit: Circuit, node: str) -> float:
    """Resistance [Ω] between the generator and a driven summing node, of both channels together
    where both drive it."""
    return 1.0 / sum(1.0 / ohms for ohms in _resistances(circuit, node))


def _resistances(circuit: Circuit, node: str) -> Iterator[float]:
    """Resistance between each channel and a node that it drives [Ω]."""
    for channel in circuit.generators:
        path = driven_nodes(circuit, channel).get(node, ())
        if path and all(set(r.nets) == {channel.net, node} for r in path):
            yield 1.0 / sum(1.0 / r.value for r in path)
        elif path:
            yield sum(r.value for r in path)


def fault_current(circuit: Circuit, node: str, volts: float) -> float:
    """Current [A] into a driven summing node that is at 0 V, from so many volts at each channel of
    the generator: what the inputs of an unpowered op-amp, or the diodes before them, have to
    take."""
    return volts / drive_resistance(circuit, node)


def protection_offset(
    circuit: Circuit, node: str, choice: BoardChoice, catalog: Catalog, across: float
) -> float:
    """DC at the generator [V] that acts as the leakage of the two diodes does, with ``across``
    volts of input offset at the node: 2 Is sinh(V/nVt) through the drive's resistance."""
    model = diode_model(catalog.diode(choice.diode))
    leakage = 2.0 * model.saturation_current * math.sinh(across / (model.emission * THERMAL))
    return leakage * drive_resistance(circuit, node)


def trim_reach(circuit: Circuit) -> float:
    """DC at the generator [V] that the trim stands for at either end of its travel; 0 without."""
    trimmer = next((p for p in circuit.fittings if isinstance(p, Trimmer)), None)
    if trimmer is None:
        return 0.0
    series = next(
        p for p in circuit.fittings if isinstance(p, Resistor) and trimmer.wiper in p.nets
    )
    return circuit.supply * drive_resistance(circuit, series.b) / series.value


def _spare(circuit: Circuit, catalog: Catalog) -> Iterator[Section]:
    """Sections of a package that the circuit has no use for: followers of ground."""
    used = {s.name for s in circuit.sections}
    for package in circuit.packages:
        for pin in catalog.opamp(circuit.opamp).pins:
            name = f"{package}{pin.name}"
            if name not in used:
                net = f"{name.lower()}x"
                yield Section(name, net, GROUND, net, "spare, tied off", views=View.BOARD)


def _supply(circuit: Circuit, choice: BoardChoice, catalog: Catalog) -> Iterator[Fitting]:
    diodes: tuple[SupplyDiode, ...] = ()
    if choice.spec.reverse_protection:
        first = 901 + max(PROTECTION, 2 * len(driven_nodes(circuit)))
        diodes = tuple(supply_diodes(circuit, choice.spec.reverse_protection, catalog, first))
    positive, negative = (d.source for d in diodes) if diodes else (POSITIVE, NEGATIVE)
    yield Connector("J1", (positive, GROUND, negative), SUPPLY)
    yield from diodes
    number = 901
    for package in ("", *circuit.packages):
        value = choice.spec.decoupling if package else choice.spec.bulk
        role = f"decoupling of {package}" if package else "bulk of the supply"
        for plus, minus in ((POSITIVE, GROUND), (GROUND, NEGATIVE)):
            yield SupplyCapacitor(f"C{number}", plus, minus, value, role, package)
            number += 1


def _probes(circuit: Circuit, choice: BoardChoice) -> Iterator[Fitting]:
    """A resistor for each output, its pad behind it, and the connectors."""
    behind = []
    for i, net in enumerate(probed_nets(circuit), start=1):
        out = f"{net}_out"
        behind.append(out)
        value, role = choice.spec.probe_resistor, f"probe of {net}"
        yield Resistor(f"R{900 + i}", net, out, value, role, View.FITTED)
        if choice.spec.test_points:
            yield TestPoint(f"TP{i}", out, f"probe of {net}")
    if choice.spec.test_points:
        grounds = [(GROUND, "ground of the probes"), (GROUND, "ground of the probes, again")]
        rails = [(POSITIVE, "positive rail"), (NEGATIVE, "negative rail")]
        for number, (net, role) in enumerate((*grounds, *rails), start=len(behind) + 1):
            yield TestPoint(f"TP{number}", net, role)
    if series := _series(choice):
        for number, (net, out) in enumerate(zip(probed_nets(circuit), behind, strict=True), 3):
            yield Connector(f"J{number}", (out, GROUND), f"output {net}", series)
        return
    paired = tuple(net for out in behind for net in (out, GROUND))
    yield Connector("J3", paired if len(paired) <= WAYS else (*behind, GROUND), "outputs")


def _series(choice: BoardChoice) -> str:
    """The series of the jacks; "" for rows of pins."""
    return "" if choice.spec.connectors == "pins" else choice.spec.connectors


def _protection(circuit: Circuit, choice: BoardChoice, catalog: Catalog) -> Iterator[Diode]:
    """Two diodes, opposed, from each driven summing node to ground."""
    model = diode_model(catalog.diode(choice.diode))
    number = 901
    for node in driven_nodes(circuit):
        role = f"protects {node} while the supply is off"
        for anode, cathode in ((node, GROUND), (GROUND, node)):
            yield Diode(f"D{number}", anode, cathode, model, False, role, View.FITTED)
            number += 1


def _trimmed_node(circuit: Circuit) -> str | None:
    """The driven summing node that the trim feeds: of the mass at ``trimmed_clearance`` if that is
    driven, else the first; None where nothing is driven."""
    driven = driven_nodes(circuit, circuit.generator) or driven_nodes(circuit)
    own = _driven_at(circuit, trimmed_clearance(circuit)) if circuit.stops else ()
    return next(iter((*own, *driven)), None)


def trimmed_clearance(circuit: Circuit) -> int:
    """Index of the clearance in which the trim sets the rest point: the first whose mass is driven,
    else the first."""
    places = range(len(circuit.stops))
    return next((k for k in places if _driven_at(circuit, k)), 0)


def _driven_at(circuit: Circuit, clearance: int) -> tuple[str, ...]:
    """The summing node of the mass at a clearance, if the generator drives it."""
    state = circuit.states.index(circuit.stops[clearance].state)
    plates = {c.name: c.nets for c in circuit.capacitors}[circuit.states[state + 1]]
    return tuple(node for node in driven_nodes(circuit, circuit.generator) if node in plates)


def _trim(circuit: Circuit, choice: BoardChoice, catalog: Catalog) -> Iterator[Fitting]:
    """A trimmer between the rails, and a resistor from its wiper into the driven summing node.

    Where the resistor that is wanted lies outside what is used, the nearest end of that range is
    taken: ``trim_reach`` says how far it goes.
    """
    views = View.FITTED if choice.spec.dc_trim == "fitted" else View.BOARD
    node = _trimmed_node(circuit)
    if node is None:
        return
    wanted = circuit.supply * drive_resistance(circuit, node) / choice.trim
    try:
        sold = catalog.values("resistor", ["E24"], LEAST_SERIES, MOST_SERIES, choice.resistor_grade)
    except Unreachable:
        if views & View.BOM:
            raise
        return  # footprints that nobody could fill
    value = float(max((v for v in sold if v <= wanted), default=sold[0]))
    role = "DC trim"
    yield Trimmer("RV901", NEGATIVE, "trim", POSITIVE, TRIMMER, role, views)
    number = 901 + max(PROBES, len(probed_nets(circuit)))
    yield Resistor(f"R{number}", "trim", node, value, role, views)


KEY = "board.reverse_protection"


def supply_current(circuit: Circuit, catalog: Catalog) -> tuple[float, float]:
    """Current [A] that the amplifiers draw from each rail without a load: typical, and at most."""
    opamp = catalog.opamp(circuit.opamp)
    sections, current = opamp.sections * len(circuit.packages), opamp.supply_current
    most = current.nominal if current.max is None else current.max
    return sections * current.nominal, sections * most


def supply_diodes(
    circuit: Circuit, name: str, catalog: Catalog, first: int
) -> Iterator[SupplyDiode]:
    """A diode in each rail, from nets of their own.

    name : of the diode in the catalogue. first : number of the one in the positive rail.

    Raises
    ------
    InputError : no such diode, or one that does not stand the supply's current or voltage.
    """
    entry = catalog.supply_diode(name)
    drop = _drop(entry, circuit, catalog)
    for number, rail in enumerate((POSITIVE, NEGATIVE), start=first):
        source = f"{rail}_in"
        ends = (source, rail) if rail == POSITIVE else (rail, source)
        role = "against reverse polarity"
        yield SupplyDiode(f"D{number}", *ends, source, name, drop, role)


def _drop(entry: SupplyDiodeEntry, circuit: Circuit, catalog: Catalog) -> float:
    """Most that the diode drops [V]; it has to stand the current, and a supply that is turned round
    while the bulk capacitor of the rail is charged."""
    _, current = supply_current(circuit, catalog)
    drop = entry.drop(current)
    if drop is None:
        text = format_quantity(current, "A")
        raise InputError(None, KEY, entry.name, f"a diode for the {text} that the op-amps draw")
    across, reverse_voltage = 2.0 * circuit.supply + drop, entry.reverse_voltage.nominal
    if reverse_voltage < across:
        found = f"{entry.name}, for {reverse_voltage:g} V"
        expected = f"a diode for {across:g} V in reverse, twice the supply"
        raise InputError(None, KEY, found, expected)
    return drop
