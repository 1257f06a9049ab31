"""The circuit: the single list of parts, pins and nets that every output is written from.

Net "0" is ground. Parts carry the names of the paper where it has them, and the role they play:
the term of Eq. (10) that they realise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from designer.catalogentry import OpAmp
from designer.errors import InputError

GROUND = "0"


@dataclass(frozen=True)
class Resistor:
    """Resistance [ohm] between nets a and b."""

    name: str
    a: str
    b: str
    value: float
    role: str


@dataclass(frozen=True)
class Capacitor:
    """Capacitance [F]; its voltage, a state of the circuit, is v(plus) - v(minus)."""

    name: str
    plus: str
    minus: str
    value: float
    role: str


@dataclass(frozen=True)
class Section:
    """One op-amp of a package: name "U1A" is section A of package U1.

    limits : whether it is meant to reach its output limits (the dead-zone stage).
    """

    name: str
    inverting: str
    noninverting: str
    output: str
    role: str
    limits: bool = False

    @property
    def package(self) -> str:
        return self.name[:-1]


@dataclass(frozen=True)
class Generator:
    """The signal generator: a voltage source from ``net`` to ground."""

    name: str
    net: str


@dataclass(frozen=True)
class Stop:
    """How a clearance shows in the circuit: the section whose limits are its ends.

    upper : the section's position (1 high, -1 low) in contact with the upper stop.
    state : name of the capacitor whose voltage is the displacement.
    """

    clearance: str
    section: str
    upper: int
    state: str


Part = Resistor | Capacitor | Section


@dataclass(frozen=True)
class Circuit:
    """Parts and nets, with what the op-amps are and where the states stand.

    states : capacitor names in the order of the state equations.
    state_nets : nets that carry the states, in the same order.
    opamp : name of the op-amp in the catalogue; gain : its open-loop gain; bias : input current
    [A]; supply, saturation : rails and output limits, ± volts. figures : the catalogue's entry of
    the op-amp, for models above the ideal one.
    """

    parts: tuple[Part, ...]
    generator: Generator
    states: tuple[str, ...]
    state_nets: tuple[str, ...]
    stops: tuple[Stop, ...]
    opamp: str
    gain: float
    bias: float
    supply: float
    saturation: float
    figures: OpAmp | None = None

    def __post_init__(self) -> None:
        names = [p.name for p in self.parts]
        if len(set(names)) != len(names):
            twice = sorted({n for n in names if names.count(n) > 1})
            raise InputError(None, "circuit.parts", ", ".join(twice), "each reference once")

    def of(self, kind: type[Part]) -> Iterator[Part]:
        """The parts of one kind, in order."""
        return (p for p in self.parts if isinstance(p, kind))

    @property
    def resistors(self) -> tuple[Resistor, ...]:
        return tuple(p for p in self.parts if isinstance(p, Resistor))

    @property
    def capacitors(self) -> tuple[Capacitor, ...]:
        return tuple(p for p in self.parts if isinstance(p, Capacitor))

    @property
    def sections(self) -> tuple[Section, ...]:
        return tuple(p for p in self.parts if isinstance(p, Section))

    @property
    def packages(self) -> tuple[str, ...]:
        """Op-amp packages in order of appearance."""
        return tuple(sorted({s.package for s in self.sections}))

    @property
    def nets(self) -> tuple[str, ...]:
        """Every net but ground, sorted."""
        found = {self.generator.net}
        for p in self.parts:
            if isinstance(p, Resistor):
                found |= {p.a, p.b}
            elif isinstance(p, Capacitor):
                found |= {p.plus, p.minus}
            else:
                found |= {p.inverting, p.noninverting, p.output}
        return tuple(sorted(found - {GROUND}))

    @property
    def values(self) -> dict[str, float]:
        """Resistances [ohm] and capacitances [F] by part name."""
        return {p.name: p.value for p in self.parts if not isinstance(p, Section)}


@dataclass(frozen=True)
class Board:
    """One copy of a circuit with its actual values: what a Monte Carlo sample is.

    values : ohm or farad by part name. offset : input offset [V] by section; rails : (low, high)
    output limits [V] by section. inverse_gain : 1/open-loop gain, 0 for ideal op-amps. bias :
    current into each input [A].
    """

    values: Mapping[str, float]
    offset: Mapping[str, float] = field(default_factory=dict)
    rails: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    inverse_gain: float = 0.0
    bias: float = 0.0

    @property
    def mirror_symmetric(self) -> bool:
        """No offset, no bias and equal rails: x → -x is a symmetry."""
        level = all(v == 0.0 for v in self.offset.values()) and self.bias == 0.0
        return level and all(low == -high for low, high in self.rails.values())


def nominal_board(circuit: Circuit, *, ideal: bool = False) -> Board:
    """The board with the nominal values, no offset, equal rails.

    ideal : infinite gain and no bias current, as the matching conditions assume.
    """
    limit = circuit.saturation
    return Board(
        values=circuit.values,
        offset={s.name: 0.0 for s in circuit.sections},
        rails={s.name: (-limit, limit) for s in circuit.sections},
        inverse_gain=0.0 if ideal else 1.0 / circuit.gain,
        bias=0.0 if ideal else circuit.bias,
    )
