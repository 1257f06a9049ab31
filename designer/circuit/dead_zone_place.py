"""Names of the parts and nets around one clearance.

The first clearance has the paper's numbers: R50, R200 …, D200 …. The next ones have them 10 (R50)
and 100 (the others) higher, from the sixth on 2000 higher still. Where there are several, nets bear
the clearance's name.
"""

from __future__ import annotations

from dataclasses import dataclass

from designer.circuit.netlist import GROUND, Part, Section
from designer.circuit.resistors import Resistors
from designer.model.clearance import Clearance

OUTPUT = "fv"
"""Net of a stage's output where there is one clearance."""
SUMMED = {1: "R210", -1: "R211"}
"""Into the amplifier that sums the halves of a rectifier, by side: 1 upper, -1 lower."""
FEEDBACK = "R212"
"""Of that amplifier."""
MOST_MASSES = 10
"""That one clearance can be of, or push: their parts have numbers of their own."""
PLAIN = 5
"""Clearances whose numbers follow the paper's; further ones would meet those of inverters."""
BEYOND = 2000
"""Added to the numbers of the others."""


def part_of(index: int, first: str) -> str:
    """The name of a part of this clearance that is called so in the first one."""
    number = int(first[1:])
    step = 10 if number < 100 else 100
    return f"{first[0]}{number + step * index + (BEYOND if index >= PLAIN else 0)}"


@dataclass(frozen=True)
class SumInput:
    """One input of the amplifier that sums displacements in front of a stage."""

    resistor: str
    """Name of its resistor."""
    state: int
    """Index of the state."""
    factor: float
    """With which it stands in the sum."""
    inverted: bool
    """Whether its negative is fed."""


@dataclass(frozen=True)
class StopForce:
    """What a stage's output does to one mass."""

    resistor: str
    """Name of the resistor into the velocity's summing node."""
    capacitor: str
    """Name of the capacitor beside it, where the stops have damping."""
    mass: int
    """Index of the mass."""
    factor: float
    """Of the force: 1 of the first mass, or -1."""
    source: str
    """Net that drives both: the stage's output, or its negative."""


@dataclass(frozen=True)
class DeadZonePlace:
    """Where the stage of one clearance stands."""

    clearance: Clearance
    index: int
    """Its place in the order of the clearances."""
    alone: bool
    """Whether there is no other."""
    inverts: bool
    """Whether the stage works on the displacement's negative: a rectifier does, whose output then
    has the displacement's sign, unless something inverts it or its stiffness takes from a slope."""
    apart: bool = False
    """Whether each half of a rectifier has an output of its own, which an inverting amplifier
    sums: a half then drives nothing of the other one, however unequal they are, and the sum drives
    a capacitor either way, as a diode cannot."""

    def part(self, first: str) -> str:
        """The name of a part that is called so in the first clearance's stage."""
        return part_of(self.index, first)

    def section(self, first: str) -> str:
        """The provisional name of an op-amp section; ``packing`` gives all but the paper's own."""
        return f"U{int(first[1:-1]) + 10 * self.index}{first[-1]}"

    def net(self, first: str) -> str:
        """The name of a net that is called so where there is one clearance."""
        return first if self.alone else f"{first}_{self.clearance.name}"

    @property
    def output(self) -> str:
        """Net of the stage's output."""
        return self.net(OUTPUT)

    def half_output(self, side: int) -> str:
        """Net that a half of a rectifier drives, 1 upper or -1 lower."""
        return self.net("fu" if side > 0 else "fl") if self.apart else self.output

    @property
    def shared(self) -> bool:
        """Whether the two halves of a rectifier drive one output."""
        clearance = self.clearance
        return clearance.which == "both" and not (self.apart or clearance.limits)

    def acting(self, side: int) -> int:
        """The side on which the stage meets this stop: the other one where it works on the
        displacement itself."""
        return side if self.inverts else -side

    @property
    def sum_resistors(self) -> tuple[str, ...]:
        """Resistors of the amplifier that sums the halves, equal, the feedback last; none where
        the halves drive the stage's output themselves."""
        if not self.apart:
            return ()
        inputs = [name for side, name in SUMMED.items() if side in self.clearance.positions]
        return tuple(self.part(name) for name in (*inputs, FEEDBACK))

    def summed(self, resistors: Resistors) -> list[Part]:
        """The amplifier that sums the halves; nothing where they drive the stage's output."""
        if not self.apart:
            return []
        role, node = "sum of the dead zone", self.net("d3")
        *inputs, back = self.sum_resistors
        halves = zip(inputs, self.clearance.positions, strict=True)
        return [
            Section(self.section("U3D"), node, GROUND, self.output, role),
            *(
                p
                for name, side in halves
                for p in resistors(name, self.half_output(side), node, role)
            ),
            *resistors(back, node, self.output, role),
        ]

    @property
    def sums(self) -> bool:
        """Whether an amplifier in front of the stage sums the displacements of several masses."""
        return len(self.clearance.terms) > 1

    @property
    def inputs(self) -> tuple[SumInput, ...]:
        """Of that amplifier, the first mass's first; none without it."""
        if not self.sums:
            return ()
        clearance, sign = self.clearance, 1.0 if self.inverts else -1.0
        numbers = ("R220", "R221", *(f"R{230 + k}" for k in range(MOST_MASSES)))
        return tuple(
            SumInput(self.part(name), clearance.state_of(mass), factor, sign * factor < 0.0)
            for name, (mass, factor) in zip(numbers, clearance.terms, strict=False)
        )

    @property
    def forces(self) -> tuple[StopForce, ...]:
        """On each mass that the stops push, the first mass's first."""
        return tuple(
            StopForce(
                self.part(f"R{50 + k}"),
                self.part(f"C{50 + k}"),
                mass,
                factor,
                self.output if factor > 0.0 else self.net("fvn"),
            )
            for k, (mass, factor) in enumerate(self.clearance.pushed)
        )

    @property
    def displacement(self) -> str:
        """Net of the displacement in the clearance, or its negative where the stage inverts."""
        sign = "n" if self.inverts else ""
        own = f"v{self.clearance.watched + 1}"
        return self.net(f"z{sign}") if self.sums else own + sign

    @property
    def difference(self) -> tuple[str, int] | None:
        """``Stop.difference``."""
        return (self.displacement, -1 if self.inverts else 1) if self.sums else None

    @property
    def inverted_states(self) -> tuple[int, ...]:
        """Indices of the states whose negatives the stage needs."""
        if self.sums:
            return tuple(each.state for each in self.inputs if each.inverted)
        return (self.clearance.watched,) if self.inverts else ()

    def around(self, resistors: Resistors) -> list[Part]:
        """The amplifiers beside the stage: one sums the displacements of several masses, one turns
        the output for those that the stops push the other way."""
        parts: list[Part] = []
        if self.sums:
            role = f"{self.clearance.quantity} in clearance {self.clearance.name}"
            node, out = self.net("dz"), self.displacement
            parts.append(Section(self.section("U4A"), node, GROUND, out, role))
            for each in self.inputs:
                source = f"v{each.state + 1}" + ("n" if each.inverted else "")
                parts += resistors(each.resistor, source, node, role)
            parts += resistors(self.part("R222"), node, out, role)
        turned = [force.source for force in self.forces if force.factor < 0.0]
        if turned:
            plain = self.clearance.plain
            back = "reaction on the other mass" if plain else "reaction on the other masses"
            node, out = self.net("df"), turned[0]
            parts += [
                Section(self.section("U4B"), node, GROUND, out, back),
                *resistors(self.part("R224"), self.output, node, back),
                *resistors(self.part("R225"), node, out, back),
            ]
        return parts
