"""How boards differ: what varies by how much, and the boards of uniform numbers.

The reference spread ``bench-1`` of docs/definitions.md is what a ``Spread`` is by default; the
table ``[spread]`` of a model file says more (docs/spread.md). Diodes are exact: their drop stands
inside a loop. The boards of a study are those of (seed, sample index) alone
(``spread.random_streams``).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.catalog.entries import LEAST_LEFT, MOST_DOUBLINGS, ROOM, OpAmp
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import Board
from designer.circuit.netlist import Capacitor, Circuit, Reference, Resistor
from designer.model.distributions import Distribution, Normal, Uniform
from designer.model.measured_values import MeasuredBoards
from designer.spread import random_streams

NAME = "bench-1"
SATURATION_SPREAD = 0.05
NO_BANDWIDTH = (
    "does not enter the yield: the exact circuit and ngspice's rung ideal, on which it is decided, "
    "have no bandwidth (--rung bandwidth has)"
)
"""What a spread of the gain-bandwidth comes with."""

EVEN = Uniform(-1.0, 1.0)
"""Anywhere within the grade."""

Passive = Resistor | Capacitor
BOARD, TEMPERATURE = "board", "temperature"
_WHAT = ("offset", "low", "high", "bias", "gbw", "tempco", "ageing")


@dataclass(frozen=True)
class Group:
    """Parts that vary together.

    The total stays within the grade, and two parts correlate by s²/(s² + (1 - s)²), s the share.
    """

    name: str
    """Name of the network or the reel."""
    parts: tuple[str, ...]
    share: float
    """Share in [0, 1] of a part's deviation that it has in common with the others; the rest is its
    own."""
    reel: bool = False
    """Whether they are from one reel, and not of one network."""


@dataclass(frozen=True)
class OpAmpDrift:
    """What temperature and age do to an op-amp's sections; what is None or 0 stays as it is."""

    offset: Distribution | None = None
    """Change of each section's offset with temperature [V/K]."""
    ageing: Distribution | None = None
    """Change of each section's offset with age [V]."""
    bias_doubling: float | None = None
    """Warming that doubles the bias current [K]."""
    gain_bandwidth: float = 0.0
    """Relative change of the gain-bandwidth with temperature [1/K]."""
    slew: float = 0.0
    """Relative change of the slew rate with temperature [1/K]."""
    limit: float = 0.0
    """Change of the output limits' size with temperature [V/K]."""

    def as_dict(self) -> dict[str, Any]:
        """What is stated, as JSON holds it."""
        return {f.name: _plain(getattr(self, f.name)) for f in dataclasses.fields(self)}


@dataclass(frozen=True)
class Spread:
    """What varies from board to board, and by how much."""

    resistor: float
    """Grade of the resistors, a fraction."""
    capacitor: float
    """Grade of the capacitors, a fraction."""
    offset_sigma: float
    """Standard deviation of the offsets before the cut [V]."""
    offset_limit: float
    """The offsets are cut at ± this [V]."""
    saturation: float = SATURATION_SPREAD
    """Half-width of the output limits as a fraction."""
    reference: float = 1.0
    """Half-width of each reference's voltage over its grade."""
    resistor_shape: Distribution = EVEN
    """Distribution of a resistor's deviation over the grade."""
    capacitor_shape: Distribution = EVEN
    """Distribution of a capacitor's deviation over the grade."""
    bias: Distribution | None = None
    """Input bias current of each section [A]; None: the circuit's, which is the typical figure."""
    gain_bandwidth: Distribution | None = None
    """Gain-bandwidth product of each section [Hz]; None: the circuit's, which is the typical
    figure."""
    supply: float = 0.0
    """Half-width of the rails as a fraction, each rail its own."""
    grades: Mapping[str, float] = field(default_factory=dict)
    """Grades of the parts that have their own, fractions by part."""
    shapes: Mapping[str, Distribution] = field(default_factory=dict)
    """Laws of the deviation over the grade of the parts that have their own, by part."""
    temperature: tuple[float, float] | None = None
    """Range of the board's temperature [°C]."""
    opamps: OpAmpDrift = OpAmpDrift()
    """What temperature and age do to the op-amps."""
    tempco: Mapping[str, Distribution] = field(default_factory=dict)
    """Temperature coefficient [1/K] by part; it counts where there is a temperature."""
    ageing: Mapping[str, Distribution] = field(default_factory=dict)
    """Relative change by part."""
    groups: tuple[Group, ...] = ()
    """Groups of parts that vary together."""
    measured: MeasuredBoards | None = None
    """Measured values of a bench's list, which go before anything drawn."""
    wanted_grades: Mapping[str, float] = field(default_factory=dict)
    """The grade that was asked for, by part, where nobody sells the value at it; these parts are
    drawn at the better one in ``grades`` (``Catalog.part``)."""

    @classmethod
    def bench_1(cls, opamp: OpAmp, resistor_grade: float, capacitor_grade: float) -> Spread:
        """The reference spread for these grades and this op-amp."""
        return cls(resistor_grade, capacitor_grade, opamp.offset_sigma, opamp.offset_limit)

    @property
    def name(self) -> str:
        """``bench-1`` where nothing is added to it; the grade of each part is that of what is
        bought."""
        plain = Spread(
            self.resistor,
            self.capacitor,
            self.offset_sigma,
            self.offset_limit,
            grades={name: self.grades[name] for name in self.wanted_grades},
            wanted_grades=self.wanted_grades,
        )
        return NAME if self == plain else "model file"

    def as_dict(self) -> dict[str, Any]:
        """Everything that decides the boards, as JSON holds it."""
        return {"name": self.name} | {
            f.name: _plain(getattr(self, f.name))
            for f in dataclasses.fields(self)
            # ``grades`` holds what is drawn of the wanted ones. Boards whose op-amps stay as they
            # are were drawn so before there was a key for it.
            if f.name not in ("wanted_grades", *(["opamps"] * (self.opamps == OpAmpDrift())))
        }

    def with_grades(self, resistor: float | None = None, capacitor: float | None = None) -> Spread:
        """The same spread with parts of another grade, whether it is sold or not; those with a
        grade of their own keep it."""
        usual = {"R": self.resistor, "C": self.capacitor}
        new_grades = {"R": resistor, "C": capacitor}
        moved = {
            name
            for name, grade_wanted in self.wanted_grades.items()
            if new_grades[name[0]] is not None and grade_wanted == usual[name[0]]
        }
        return replace(
            self,
            resistor=self.resistor if resistor is None else resistor,
            capacitor=self.capacitor if capacitor is None else capacitor,
            grades={name: grade for name, grade in self.grades.items() if name not in moved},
            wanted_grades={
                name: grade for name, grade in self.wanted_grades.items() if name not in moved
            },
        )

    def at_temperature(self, celsius: float) -> Spread:
        """The same spread with every board at this temperature [°C], for which its parts have
        temperature coefficients (``part_rules.warmed``)."""
        return replace(self, temperature=(celsius, celsius))

    @property
    def as_built(self) -> Spread:
        """The same spread of boards that are new and at ``ROOM``, as they are at a bench; what is
        drawn of both is the same."""
        return replace(self, temperature=None, ageing={}, opamps=replace(self.opamps, ageing=None))

    def coordinates(self, circuit: Circuit) -> tuple[str, ...]:
        """Names of what is drawn for a board of this circuit, in the order of a cube's columns.

        A part's own deviation has the part's name; an op-amp section has ``U1A.offset``,
        ``U1A.low``, ``U1A.high`` and, where they are spread, ``U1A.bias``, ``U1A.gbw``,
        ``U1A.tempco`` and ``U1A.ageing``, the last two of its offset; then ``R1.tempco``,
        ``R1.ageing``, ``VCC``, ``VEE``, ``temperature``, and a group's common ``network:1`` or
        ``reel:R:10k``, with ``.tempco`` and ``.ageing`` as a part has them; ``board`` where several
        were measured. A measured quantity's is that of its tolerance.
        """
        parts = _varying(circuit)
        names = [p.name for p in parts]
        for s in circuit.sections:
            names += [f"{s.name}.{quantity}" for quantity in ("offset", "low", "high")]
            names += [f"{s.name}.bias"] * self._varies(self.bias, f"{s.name}.bias")
            names += [f"{s.name}.gbw"] * self._varies(self.gain_bandwidth, f"{s.name}.gbw")
            names += [f"{s.name}.tempco"] * (self._drifting is not None)
            names += [f"{s.name}.ageing"] * (self.opamps.ageing is not None)
        names += [r.name for r in circuit.rails if self._varies(self.supply, r.name)]
        if self.temperature is not None:
            names.append(TEMPERATURE)
        for suffix, laws in self._slow:
            names += [p.name + suffix for p in parts if p.name in laws]
        for group in self.groups:
            names.append(group.name)
            names += [group.name + suffix for suffix, _ in self._slow]
        if self.measured is not None and len(self.measured.boards) > 1:
            names.append(BOARD)
        return tuple(names)

    def from_cube(self, circuit: Circuit, cube: Array) -> Boards:
        """N boards of a cube (N, K) of uniform numbers in [0, 1), columns as ``coordinates``.

        Every quantity of a board is non-decreasing in its own numbers, the lower output limits and
        the negative rail by their magnitude; below room temperature what changes with temperature
        falls with its coefficient's.
        """
        names = self.coordinates(circuit)
        if cube.ndim != 2 or cube.shape[1] != len(names):
            raise ValueError(f"a cube of {cube.shape}; this circuit has {len(names)} coordinates")
        return _Draw(self, circuit, dict(zip(names, cube.T, strict=True)), len(cube)).boards()

    def _varies(self, spread: Distribution | float | None, name: str) -> bool:
        """Whether this quantity of a board is drawn or was measured."""
        return bool(spread) or (self.measured is not None and name in self.measured.values)

    @property
    def _drifting(self) -> Distribution | None:
        """Of the change of an offset with temperature, where there is one [V/K]."""
        return None if self.temperature is None else self.opamps.offset

    @property
    def _slow(self) -> tuple[tuple[str, Mapping[str, Distribution]], ...]:
        """Slow changes of parts: the suffix of a part's name, and the distributions by part."""
        laws = [(".ageing", self.ageing)] if self.ageing else []
        if self.temperature is not None:
            laws.insert(0, (".tempco", self.tempco))
        return tuple(laws)

    def shape_of(self, part: Passive | Reference) -> Distribution:
        """Of a part's relative deviation over its grade."""
        if part.name in self.shapes:
            return self.shapes[part.name]
        if isinstance(part, Reference):
            return EVEN
        return self.resistor_shape if isinstance(part, Resistor) else self.capacitor_shape

    def grade_of(self, part: Passive | Reference) -> float:
        """The grade of a part: its own, or that of its kind."""
        if part.name in self.grades:
            return self.grades[part.name]
        if isinstance(part, Reference):
            return self.reference * part.grade
        return self.resistor if isinstance(part, Resistor) else self.capacitor


def draw(circuit: Circuit, spread: Spread, seed: int, index: int) -> Board:
    """Board number ``index`` of the study with this seed."""
    return draw_many(circuit, spread, seed, range(index, index + 1)).board(0)


def draw_many(
    circuit: Circuit, spread: Spread, seed: int, indices: range, stream: str = ""
) -> Boards:
    """The boards of these numbers of the study with this seed.

    stream : goes before the coordinates' names: boards that no study has, whatever its seed.
    """
    names = spread.coordinates(circuit)
    cube = random_streams.cube(seed, [stream + name for name in names], indices)
    if BOARD in names and spread.measured is not None:  # in turn: they are what there is
        count = len(spread.measured.boards)
        cube[:, names.index(BOARD)] = (np.asarray(indices) % count + 0.5) / count
    return spread.from_cube(circuit, cube)


def part_of(coordinate: str) -> str:
    """The part, section, rail or group that a coordinate belongs to: ``U1A.offset`` is U1A's."""
    head, _, quantity = coordinate.rpartition(".")
    return head if quantity in _WHAT else coordinate


class _Draw:
    """The boards of one cube. u : (N,) uniform numbers by coordinate."""

    def __init__(
        self, spread: Spread, circuit: Circuit, u: Mapping[str, Array], count: int
    ) -> None:
        self.spread, self.circuit, self.u, self.count = spread, circuit, u, count
        self.group = {name: group for group in spread.groups for name in group.parts}
        self.measured = spread.measured
        if spread.measured is not None:
            boards = len(spread.measured.boards)
            which = u.get(BOARD, np.zeros(count))
            self.which = np.minimum((which * boards).astype(np.intp), boards - 1)

    def boards(self) -> Boards:
        c = self.circuit
        sections = [s.name for s in c.sections]
        supply = self.supply()
        low, high = self.limits(supply)
        return Boards(
            circuit=c,
            values={p.name: self.value(p, p.value) for p in _passives(c)},
            offset={s: self.offset(s) for s in sections},
            low=low,
            high=high,
            bias={s: self.bias(s) for s in sections},
            reference={r.name: self.value(r, r.volts) for r in c.references},
            drop={d.name: self.same(d.model.drop) for d in c.diodes},
            supply=supply,
            gain_bandwidth=self.gain_bandwidth(sections),
            inverse_gain=self.same(1.0 / c.gain),
            slew=self.slew(sections),
        )

    def same(self, value: float) -> Array:
        return np.full(self.count, value)

    def of_section(self, name: str, law: Distribution | None, typical: float) -> Array:
        """(N,) a quantity of each section by itself; the measured value where there is one."""
        return self.or_measured(name, self.same(typical) if law is None else law.ppf(self.u[name]))

    @cached_property
    def warmer(self) -> Array:
        """(N,) by how much each board is warmer than ``ROOM`` [K]."""
        if self.spread.temperature is None:
            return self.same(0.0)
        return Uniform(*self.spread.temperature).ppf(self.u[TEMPERATURE]) - ROOM

    def changed(self, slope: float) -> Array:
        """(N,) what is left of a figure that changes by this share with each kelvin."""
        return np.maximum(1.0 + slope * self.warmer, LEAST_LEFT)

    def offset(self, section: str) -> Array:
        """(N,) input offset [V]: as made or measured, aged, at the board's temperature."""
        spread = self.spread
        law = Normal(spread.offset_sigma, spread.offset_limit)
        offset = self.of_section(f"{section}.offset", law, 0.0)
        for suffix, more, by in (
            ("ageing", spread.opamps.ageing, 1.0),
            ("tempco", spread.opamps.offset, self.warmer),
        ):
            if more is not None and f"{section}.{suffix}" in self.u:
                offset = offset + more.ppf(self.u[f"{section}.{suffix}"]) * by
        return offset

    def bias(self, section: str) -> Array:
        """(N,) bias current [A] at the board's temperature."""
        bias = self.of_section(f"{section}.bias", self.spread.bias, self.circuit.bias)
        doubling = self.spread.opamps.bias_doubling
        if doubling is None:
            return bias
        return bias * np.exp2(np.minimum(self.warmer / doubling, MOST_DOUBLINGS))

    def gain_bandwidth(self, sections: Sequence[str]) -> dict[str, Array]:
        """By section [Hz], of those of which it is drawn, or changes with temperature."""
        spread, typical = self.spread, self.circuit.gain_bandwidth
        slope = spread.opamps.gain_bandwidth if spread.temperature is not None else 0.0
        return {
            s: self.of_section(f"{s}.gbw", spread.gain_bandwidth, typical) * self.changed(slope)
            for s in sections
            if f"{s}.gbw" in self.u or slope
        }

    def slew(self, sections: Sequence[str]) -> dict[str, Array]:
        """By section [V/s], where it changes with temperature."""
        figures, slope = self.circuit.figures, self.spread.opamps.slew
        if figures is None or self.spread.temperature is None or not slope:
            return {}
        return dict.fromkeys(sections, figures.slew.nominal * self.changed(slope))

    def or_measured(self, name: str, values: Array) -> Array:
        """(N,) the measured value, within its tolerance, where there is one; ``values`` else."""
        if self.measured is None or name not in self.measured.values:
            return values
        value = np.array(self.measured.values[name])[self.which]
        width = np.array(self.measured.tolerances[name])[self.which]
        return np.where(np.isnan(value), values, value + width * (2.0 * self.u[name] - 1.0))

    def value(self, part: Passive | Reference, sold: float) -> Array:
        """A part's value on the day: as made or measured, aged, at the board's temperature."""
        spread, name = self.spread, part.name
        off = spread.grade_of(part) * self.shared(name, "", spread.shape_of(part))
        value = self.or_measured(name, sold * (1.0 + off))
        if name in spread.ageing:
            value = value * (1.0 + self.shared(name, ".ageing", spread.ageing[name]))
        if spread.temperature is not None and name in spread.tempco:
            tempco = self.shared(name, ".tempco", spread.tempco[name])
            value = value * (1.0 + tempco * self.warmer)
        return value

    def shared(self, name: str, suffix: str, law: Distribution) -> Array:
        """(N,) a part's own draw; in a group it is mixed with the group's common draw."""
        part_draw = law.ppf(self.u[name + suffix])
        group = self.group.get(name)
        if group is None:
            return part_draw
        common = law.ppf(self.u[group.name + suffix])
        return group.share * common + (1.0 - group.share) * part_draw

    def supply(self) -> dict[str, Array]:
        """By rail; without those that are exact."""
        law = Uniform(-self.spread.supply, self.spread.supply)
        return {
            r.name: self.or_measured(r.name, r.volts * (1.0 + law.ppf(self.u[r.name])))
            for r in self.circuit.rails
            if r.name in self.u
        }

    def limits(self, supply: Mapping[str, Array]) -> tuple[dict[str, Array], dict[str, Array]]:
        """Lowest and highest output of each section: its distance to the rail stays when the rail
        moves, and no output passes its rail, whatever the temperature."""
        c = self.circuit
        law = Uniform(-self.spread.saturation, self.spread.saturation)
        exact = self.same(c.supply)
        above, below = supply.get("VCC", exact), -supply.get("VEE", -exact)  # of ground

        def limit(name: str, nominal: float, rail: Array, sign: float) -> Array:
            wanted = nominal * (1.0 + law.ppf(self.u[name])) + (rail - c.supply)
            size = sign * self.or_measured(name, sign * np.minimum(wanted, rail))
            warm = size + self.spread.opamps.limit * self.warmer
            return sign * np.clip(warm, LEAST_LEFT * size, np.maximum(size, rail))

        nominal = c.output_limits()
        low = {name: limit(f"{name}.low", v, below, -1.0) for name, v in nominal.items()}
        high = {name: limit(f"{name}.high", v, above, 1.0) for name, v in nominal.items()}
        return low, high


def _passives(circuit: Circuit) -> tuple[Passive, ...]:
    return (*circuit.resistors, *circuit.capacitors)


def _varying(circuit: Circuit) -> tuple[Passive | Reference, ...]:
    """The parts that have a deviation of their own."""
    return (*_passives(circuit), *circuit.references)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _plain(item) for name, item in sorted(value.items())}
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, Group):
        return dataclasses.asdict(value)
    return value.as_dict() if hasattr(value, "as_dict") else value
