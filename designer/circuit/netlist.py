"""The circuit: the single list of parts and nets that every output is written from.

Net "0" is ground. ``Circuit.parts`` are simulated; ``Circuit.fittings`` are on the board or on the
bill alone, and each part says in which views it stands. Parts carry the names of the paper where it
has them, and the role they play: the term of Eq. (10) that they realise. Resistors, diodes and
op-amp sections of the board alone differ by their ``views``.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from itertools import combinations, product
from typing import Any

import numpy as np

from designer.base.errors import InputError
from designer.base.natural_sort import natural_key
from designer.base.views import View
from designer.catalog.diode_curve import DiodeModel
from designer.catalog.entries import OpAmp
from designer.catalog.output_stage import OutputStage
from designer.dynamics.drive_shape import SINE, Shape, has_harmonics
from designer.dynamics.piecewise_linear import Drive, SecondDrive


@dataclass(frozen=True)
class Contact:
    """How one side of a stop shows: a switch leaves its rest position where contact begins."""

    switch: str
    """Name of the op-amp section or the diode."""
    position: int
    """Position in contact: of a section 1 at its upper limit, -1 at its lower, 0 between; of a
    diode 1 while it conducts, else 0."""
    others: tuple[tuple[str, int], ...] = ()
    """Further switches, each with its position while the stop carries."""


@dataclass(frozen=True)
class Stop:
    """How a clearance shows in the circuit."""

    clearance: str
    state: str
    """Name of the capacitor whose voltage is the displacement, or of two masses the first's; of a
    dead zone of velocities that of the velocity."""
    upper: Contact | None
    """How the upper stop shows; None where there is none."""
    lower: Contact | None
    """How the lower stop shows; None where there is none."""
    output: str
    """Net of the dead-zone stage's output."""
    switches: tuple[str, ...]
    """Names of the stage's op-amp sections and diodes."""
    difference: tuple[str, int] | None = None
    """Between two masses: the net that carries the difference of their displacements, and the sign
    that it has there, 1 or -1."""
    bend_of: str = ""
    """``Clearance.bend_of``."""
    limits: bool = False
    """``Clearance.limits``: the output changes between both contacts, and in none of them."""
    inverse: str = ""
    """Net of the output's negative, where that is what pushes the first mass; "" where it is the
    output."""

    @property
    def driving(self) -> str:
        """Net that pushes the first mass."""
        return self.inverse or self.output

    @cached_property
    def contacts(self) -> tuple[tuple[int, Contact], ...]:
        """The sides that exist, 1 upper and -1 lower, each with its contact."""
        pairs = ((1, self.upper), (-1, self.lower))
        return tuple((side, contact) for side, contact in pairs if contact is not None)

    @property
    def shared(self) -> bool:
        """Whether both sides are ends of one switch: then they have one slope."""
        switches = [contact.switch for _, contact in self.contacts]
        return len(switches) == 2 and switches[0] == switches[1]


@dataclass(frozen=True)
class SupplyCapacitor:
    """A capacitor between the rails, or between a rail and ground."""

    name: str
    plus: str
    """The higher net."""
    minus: str
    """The lower net."""
    value: float
    """Capacitance [F]."""
    role: str
    package: str = ""
    """The op-amp package at whose supply pin it stands; "" for the board's bulk."""
    views: View = View.FITTED

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.plus, self.minus)


@dataclass(frozen=True)
class SupplyDiode:
    """A diode between the supply's connector and a rail, which blocks the wrong polarity."""

    name: str
    anode: str
    """Net of the anode."""
    cathode: str
    """Net of the cathode."""
    source: str
    """The one of both nets that the connector is on."""
    model: str
    """Its name in the catalogue."""
    drop: float
    """Most that it drops at the current that the op-amps draw [V]."""
    role: str
    views: View = View.FITTED

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.anode, self.cathode)

    @property
    def positive(self) -> bool:
        """Whether it stands in the positive rail."""
        return self.anode == self.source


@dataclass(frozen=True)
class Connector:
    """A row of pins, or a coaxial jack."""

    name: str
    ways: tuple[str, ...]
    """Nets of pins 1, 2, …; of a jack the signal's and the shell's."""
    role: str
    series: str = ""
    """The series of a coaxial jack, "sma" or "bnc"; "" of a row of pins."""
    views: View = View.FITTED

    @property
    def nets(self) -> tuple[str, ...]:
        return self.ways


@dataclass(frozen=True)
class TestPoint:
    """A bare pad for a probe: on the board, but nothing to buy."""

    __test__ = False  # no test class, whatever its name begins with

    name: str
    net: str
    """The net that it carries."""
    role: str
    views: View = View.BOARD

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.net,)


@dataclass(frozen=True)
class Trimmer:
    """A trimming potentiometer."""

    name: str
    low: str
    """Net of the track's lower end."""
    wiper: str
    """Net of the wiper."""
    high: str
    """Net of the track's upper end."""
    value: float
    """Resistance of the track [ohm]."""
    role: str
    views: View = View.FITTED

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.low, self.wiper, self.high)


@dataclass(frozen=True)
class Conductance:
    """A conductance between two nets."""

    a: str
    """Net of one end."""
    b: str
    """Net of the other end."""
    siemens: Any
    """Its size [S], a number or an array with one for each board."""

    def other(self, net: str) -> str:
        """The end that is not this net."""
        return self.b if net == self.a else self.a


def without_inner_nets(wires: Iterable[Conductance], held: Collection[str]) -> list[Conductance]:
    """The same between the nets ``held`` alone: every other net is taken out, star to mesh, such as
    the middle of two resistors in series and the tap of a divider."""
    out = list(wires)
    for net in sorted({end for wire in out for end in (wire.a, wire.b)} - set(held)):
        star = [wire for wire in out if net in (wire.a, wire.b)]
        total = sum(wire.siemens for wire in star)
        out = [wire for wire in out if net not in (wire.a, wire.b)]
        out += [
            Conductance(one.other(net), two.other(net), one.siemens * two.siemens / total)
            for one, two in combinations(star, 2)
        ]
    return out


GROUND = "0"
POSITIVE, NEGATIVE = "vcc", "vee"
"""Nets of the supplies."""


@dataclass(frozen=True)
class Resistor:
    """A resistor."""

    name: str
    a: str
    """Net of one end."""
    b: str
    """Net of the other end."""
    value: float
    """Resistance [ohm]."""
    role: str
    views: View = View.EVERYWHERE

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.a, self.b)


@dataclass(frozen=True)
class Capacitor:
    """A capacitor; its voltage, v(plus) - v(minus), is a state of the circuit, or follows from the
    states (``Circuit.dependent_capacitors``)."""

    name: str
    plus: str
    """Net of the end where its voltage counts as positive."""
    minus: str
    """Net of the other end."""
    value: float
    """Capacitance [F]."""
    role: str
    views: View = View.EVERYWHERE

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.plus, self.minus)


@dataclass(frozen=True)
class Section:
    """One op-amp of a package."""

    name: str
    """Name such as "U1A", section A of package U1."""
    inverting: str
    """Net of the inverting input."""
    noninverting: str
    """Net of the non-inverting input."""
    output: str
    """Net of the output."""
    role: str
    limits: bool = False
    """Whether it is meant to reach its output limits (the dead-zone stage)."""
    views: View = View.EVERYWHERE

    @property
    def package(self) -> str:
        return self.name[:-1]

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.inverting, self.noninverting, self.output)


@dataclass(frozen=True)
class Diode:
    """A diode."""

    name: str
    anode: str
    """Net of the anode."""
    cathode: str
    """Net of the cathode."""
    model: DiodeModel
    rest: bool
    """Whether it conducts with every displacement at zero."""
    role: str
    views: View = View.EVERYWHERE

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.anode, self.cathode)


@dataclass(frozen=True)
class Reference:
    """A shunt reference; without ``least`` and ``impedance`` it is a source."""

    name: str
    cathode: str
    """Net of the cathode."""
    anode: str
    """Net of the anode."""
    volts: float
    """The voltage that it keeps, v(cathode) - v(anode) [V]."""
    grade: float
    """Tolerance of the voltage, ± as a fraction."""
    model: str
    """Its name in the catalogue."""
    role: str
    least: float = 0.0
    """Current that it needs [A]."""
    impedance: float = 0.0
    """Dynamic impedance [ohm]."""
    views: View = View.EVERYWHERE

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.cathode, self.anode)


@dataclass(frozen=True)
class Supply:
    """A rail of the power supply."""

    name: str
    net: str
    """The net that it holds."""
    volts: float
    """Voltage of the net to ground [V]."""


@dataclass(frozen=True)
class Generator:
    """A channel of the signal generator: a voltage source from ``net`` to ground."""

    name: str
    net: str
    """The net that it drives."""


Part = Resistor | Capacitor | Section | Diode | Reference
"""What is simulated."""
Fitting = Part | SupplyCapacitor | SupplyDiode | Connector | TestPoint | Trimmer
"""What may stand on the board or the bill alone, or be any part of a view. ``role`` says in
words what a part is for, ``views`` where it stands: simulated, on the board, bought."""


@dataclass(frozen=True)
class Circuit:
    """Parts and nets, with what the op-amps are and where the states stand."""

    parts: tuple[Part, ...]
    """The parts that are simulated."""
    generator: Generator
    states: tuple[str, ...]
    """Capacitor names in the order of the state equations."""
    state_nets: tuple[str, ...]
    """Nets that carry the states, in the same order."""
    stops: tuple[Stop, ...]
    """How the clearances show."""
    opamp: str
    """Name of the op-amp in the catalogue."""
    gain: float
    """Its open-loop gain."""
    bias: float
    """Input current [A]."""
    supply: float
    """Voltage of the rails, ± [V]."""
    saturation: float
    """Output limits of the op-amps, ± [V]."""
    figures: OpAmp | None = None
    """The catalogue's entry of the op-amp, for models above the ideal one."""
    saturation_load: float | None = field(default=None, repr=False)
    """Load that ``saturation`` is reached into [ohm]; None: each output's own, whatever it is."""
    bends: tuple[Stop, ...] = ()
    """How the dead zones show that are no clearance (``Clearance.bend_of``)."""
    second: Generator | None = field(default=None, repr=False)
    """The generator's second channel."""
    fittings: tuple[Fitting, ...] = ()
    """Parts of the board and the bill that are not simulated (``board.board_parts``)."""

    def __post_init__(self) -> None:
        names = [p.name for p in (*self.parts, *self.fittings)]
        if len(set(names)) != len(names):
            twice = sorted({n for n in names if names.count(n) > 1})
            raise InputError(None, "circuit.parts", ", ".join(twice), "each reference once")
        for wanted, parts in ((True, self.parts), (False, self.fittings)):
            lost = [p.name for p in parts if (View.SIMULATION in p.views) is not wanted]
            if lost:
                field_ = "circuit.parts" if wanted else "circuit.fittings"
                expected = "simulated parts" if wanted else "parts that are not simulated"
                raise InputError(None, field_, ", ".join(lost), expected)

    @property
    def generators(self) -> tuple[Generator, ...]:
        """The generator's channels."""
        return (self.generator,) if self.second is None else (self.generator, self.second)

    @property
    def generator_nets(self) -> tuple[str, ...]:
        """The nets that its channels drive."""
        return tuple(each.net for each in self.generators)

    @property
    def gain_bandwidth(self) -> float:
        """Typical gain-bandwidth of the op-amp [Hz]; nan where its figures are not known."""
        return self.figures.gbw.nominal if self.figures is not None else math.nan

    @property
    def output_stage(self) -> OutputStage:
        """How far the op-amps' outputs reach."""
        return OutputStage.of(self.figures, self.saturation, self.saturation_load)

    def wires(self, values: Mapping[str, Any] | None = None) -> list[Conductance]:
        """Conductances between the nets that more than resistors meet. values : [ohm] by part, one
        number or an array of boards; the circuit's own where None."""
        ohms = values or self.values
        held = {GROUND, *self.generator_nets, *(supply.net for supply in self.supplies)}
        held = held.union(*(p.nets for p in self.parts if not isinstance(p, Resistor)))
        every = [Conductance(r.a, r.b, 1.0 / ohms[r.name]) for r in self.resistors]
        return without_inner_nets(every, held)

    def output_nets(self, section: Section) -> frozenset[str]:
        """Net of a section's output, and those that a diode joins to it while it conducts."""
        joined = {net for d in self.diodes if section.output in d.nets for net in d.nets}
        return frozenset({section.output, *joined} - {section.inverting})

    def output_loads(self, values: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Load [ohm] of each section's output, every resistor there taken to ground; infinite
        without one. values : as of ``wires``."""
        wires, loads = self.wires(values), {}
        for section in self.sections:
            outputs = self.output_nets(section)
            siemens = [w.siemens for w in wires if w.a in outputs or w.b in outputs]
            loads[section.name] = 1.0 / sum(siemens) if siemens else math.inf
        return loads

    def output_limits(self) -> dict[str, float]:
        """Nominal output limit [V] of each section into its own load, no further than the rails."""
        stage = self.output_stage
        if stage.load is None:
            return {s.name: stage.limit for s in self.sections}
        loads = self.output_loads()
        return {name: min(stage.limit_into(load), self.supply) for name, load in loads.items()}

    @cached_property
    def resistors(self) -> tuple[Resistor, ...]:
        return tuple(p for p in self.parts if isinstance(p, Resistor))

    @cached_property
    def capacitors(self) -> tuple[Capacitor, ...]:
        return tuple(p for p in self.parts if isinstance(p, Capacitor))

    @cached_property
    def dependent_capacitors(self) -> tuple[Capacitor, ...]:
        """The capacitors whose voltages the states decide: the dampers of stops."""
        return tuple(c for c in self.capacitors if c.name not in self.states)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        return tuple(p for p in self.parts if isinstance(p, Section))

    @cached_property
    def diodes(self) -> tuple[Diode, ...]:
        return tuple(p for p in self.parts if isinstance(p, Diode))

    @cached_property
    def references(self) -> tuple[Reference, ...]:
        return tuple(p for p in self.parts if isinstance(p, Reference))

    @property
    def supply_diodes(self) -> tuple[SupplyDiode, ...]:
        """The diodes between the supply's connector and the rails; none on most boards."""
        return tuple(p for p in self.fittings if isinstance(p, SupplyDiode))

    @property
    def supply_inputs(self) -> tuple[str, ...]:
        """The nets of the supply's connector that diodes part from the rails."""
        return tuple(diode.source for diode in self.supply_diodes)

    @property
    def rails(self) -> tuple[Supply, ...]:
        """Both rails of the power supply."""
        return (Supply("VCC", POSITIVE, self.supply), Supply("VEE", NEGATIVE, -self.supply))

    @property
    def supplies(self) -> tuple[Supply, ...]:
        """The rails that a part other than an op-amp is connected to."""
        return tuple(r for r in self.rails if r.net in self.nets)

    @cached_property
    def dead_zones(self) -> tuple[Stop, ...]:
        """Every dead zone that has a stage: the clearances, then the others."""
        return (*self.stops, *self.bends)

    @cached_property
    def chains(self) -> Mapping[str, Sequence[Stop]]:
        """The dead zones of each clearance and of each law, the first to be met first."""
        chains: dict[str, list[Stop]] = {stop.clearance: [stop] for stop in self.stops}
        for bend in self.bends:
            chains.setdefault(bend.bend_of, []).append(bend)
        return chains

    @property
    def stage_outputs(self) -> tuple[str, ...]:
        """Nets of the dead-zone stages' outputs, in the order of ``dead_zones``."""
        return tuple(stop.output for stop in self.dead_zones)

    @property
    def outputs(self) -> tuple[str, ...]:
        """The nets that are shown: the states, and the output of each dead-zone stage."""
        return (*self.state_nets, *self.stage_outputs)

    @property
    def displacements(self) -> tuple[str, ...]:
        """Nets that carry the displacements of the masses."""
        return self.state_nets[::2]

    @cached_property
    def switches(self) -> tuple[str, ...]:
        """What changes the circuit's mode: op-amp sections in order, then diodes."""
        return (*(s.name for s in self.sections), *(d.name for d in self.diodes))

    @cached_property
    def rest(self) -> tuple[int, ...]:
        """Position of each switch with every displacement at zero: op-amps linear, diodes as they
        say. A preloaded stop carries force there."""
        return (*(0 for _ in self.sections), *(int(d.rest) for d in self.diodes))

    @cached_property
    def open(self) -> tuple[int, ...]:
        """Position of each switch with every clearance open."""
        contacts = [contact for stop in self.dead_zones for _, contact in stop.contacts]
        moved = {
            name: int(position == 0)
            for contact in contacts
            for name, position in ((contact.switch, contact.position), *contact.others)
        }
        return self._moved(self.rest, moved)

    def carrying(self, contact: Contact) -> tuple[int, ...]:
        """Position of each switch while this stop alone carries force."""
        return self._moved(self.open, dict([(contact.switch, contact.position), *contact.others]))

    def in_contact(self, sides: Sequence[int]) -> tuple[int, ...]:
        """Position of each switch while each dead zone carries force on this side, 1 or -1, or is
        open, 0; those that are not told are open."""
        moved: dict[str, int] = {}
        for stop, side in zip(self.dead_zones, sides, strict=False):
            if side:
                contact = dict(stop.contacts)[side]
                moved |= dict([(contact.switch, contact.position), *contact.others])
        return self._moved(self.open, moved)

    def _moved(self, key: tuple[int, ...], moved: Mapping[str, int]) -> tuple[int, ...]:
        pairs = zip(self.switches, key, strict=True)
        return tuple(moved.get(name, position) for name, position in pairs)

    @cached_property
    def working(self) -> tuple[tuple[int, ...], ...]:
        """Position of each switch in the modes between which a good board moves, the open one
        first: each clearance open, or on the way into a contact one switch after the other,
        whatever the others do. The bends of a law, or of a stop, follow each other."""
        ways = [[turned for way in chain for turned in way] for chain in self._ways]
        return tuple(dict.fromkeys(self._turned(each) for each in product(*ways)))

    @cached_property
    def ways_in(self) -> tuple[frozenset[tuple[int, ...]], ...]:
        """The working modes on the way into the same contacts, for all contacts that there may be
        at once."""
        return tuple(
            frozenset(self._turned(each) for each in product(*ways))
            for ways in product(*self._ways)
        )

    @cached_property
    def _ways(self) -> list[list[list[dict[str, int]]]]:
        """For each clearance, or each law, the positions of its switches: open, then on the way
        into each contact, then past each further bend on that side."""
        return [self._ways_along(chain) for chain in self.chains.values()]

    @staticmethod
    def _ways_along(chain: Sequence[Stop]) -> list[list[dict[str, int]]]:
        """chain : dead zones of one displacement, the first to be met first."""
        ways: list[list[dict[str, int]]] = [[{}]]
        for side in (1, -1):
            turned: dict[str, int] = {}
            contacts = (dict(stop.contacts).get(side) for stop in chain)
            for contact in filter(None, contacts):
                way = []
                for switch, position in ((contact.switch, contact.position), *contact.others):
                    turned = {**turned, switch: position}
                    way.append(turned)
                ways.append(way)
        return ways

    def _turned(self, turned: Iterable[Mapping[str, int]]) -> tuple[int, ...]:
        """Position of each switch with every clearance open, but for these."""
        return self._moved(self.open, {name: at for each in turned for name, at in each.items()})

    def may_limit(self, section: Section, position: int) -> bool:
        """Whether a section may stand at this limit, 1 upper or -1 lower: those of the dead-zone
        stage may; one that is a stop's switch only at the end where a stop is. The free end of a
        one-sided stage would be a second stop that the model does not have."""
        ends = {
            contact.position
            for stop in self.dead_zones
            for _, contact in stop.contacts
            if contact.switch == section.name
        }
        return section.limits and (not ends or position in ends)

    @property
    def packages(self) -> tuple[str, ...]:
        """Op-amp packages in the order of their numbers."""
        return tuple(sorted({s.package for s in self.sections}, key=natural_key))

    @cached_property
    def nets(self) -> tuple[str, ...]:
        """Every net but ground, sorted."""
        nets = {*self.generator_nets}.union(*(p.nets for p in self.parts))
        return tuple(sorted(nets - {GROUND}))

    @property
    def values(self) -> dict[str, float]:
        """Resistances [ohm] and capacitances [F] by part name."""
        return {p.name: p.value for p in self.parts if isinstance(p, Resistor | Capacitor)}


@dataclass(frozen=True)
class Excitation:
    """The generator's setting.

    The generator's voltage is the negative of the force's shape: the force enters the inverting
    integrators with its sign turned, so that the model's sin(ωt) and the circuit agree.
    """

    frequency: float
    """Frequency [Hz]."""
    amplitude: float
    """Peak amplitude [V]."""
    offset: float = 0.0
    """DC offset [V]."""
    shape: Shape = SINE
    """What the voltage is the negative of, but for the offset, over the amplitude."""
    second: SecondDrive | None = None
    """What the second channel's voltage is the negative of; None where there is one channel."""

    @property
    def amplitudes(self) -> tuple[float, ...]:
        """The amplitude of each channel [V peak]."""
        return (self.amplitude,) if self.second is None else (self.amplitude, self.second.amplitude)

    @property
    def second_phase_deg(self) -> float:
        """How far the second channel is ahead of the first [degrees]; 0 where their waveforms, from
        one beginning on, hold it."""
        if self.second is None or self.is_waveform:
            return 0.0
        (_, *first), (_, *second) = self.shape[0], self.second.shape[0]
        ahead = math.degrees(math.atan2(*second[::-1]) - math.atan2(*first[::-1]))
        return (ahead + 180.0) % 360.0 - 180.0

    @property
    def is_waveform(self) -> bool:
        """Whether a channel gives no sine, so that all have to be given their waveforms."""
        return has_harmonics(self.shape, () if self.second is None else self.second.shape)

    def channel(self, number: int) -> Excitation:
        """What one of the generator's channels gives, as of a generator that has no other; nothing
        of a second one that is not set."""
        if number == 0:
            return replace(self, second=None)
        own = self.second or SecondDrive(0.0, SINE)
        return Excitation(self.frequency, own.amplitude, shape=own.shape)

    def louder(self, factor: float) -> Excitation:
        """The excitation with the amplitudes of all channels multiplied by this factor."""
        second = self.second and replace(self.second, amplitude=factor * self.second.amplitude)
        return replace(self, amplitude=factor * self.amplitude, second=second)

    def seconds(self, omega: float) -> float:
        """One unit of a model's time [s], where its drive has the frequency ``omega``."""
        return omega / (2.0 * math.pi * self.frequency)

    @property
    def at_start(self) -> tuple[float, float]:
        """Voltages of the generator's channels at t = 0 [V]."""
        start = np.zeros(1)
        return float(self.drive.at(start)[0]), float(self.drive.second_at(start)[0])

    def as_dict(self) -> dict[str, Any]:
        """Its fields; the shape where it is no sine, the second channel where there is one."""
        plain = {"shape": SINE, "second": None}
        return {k: v for k, v in asdict(self).items() if k not in plain or v != plain[k]}

    @property
    def drive(self) -> Drive:
        """The voltage at the generator's net, as the exact circuit is driven by it."""
        second = self.second and replace(self.second, amplitude=-self.second.amplitude)
        omega = 2.0 * np.pi * self.frequency
        return Drive(omega, -self.amplitude, self.offset, self.shape, second)
