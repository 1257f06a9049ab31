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
    def reaction(self) -> str:
        """Net of the output's negative, which drives the other mass."""
        return self.net("fvn")

    @property
    def displacement(self) -> str:
        """Net of the displacement in the clearance, or its negative where the stage inverts."""
        sign = "n" if self.inverts else ""
        own = f"v{self.clearance.watched + 1}"
        return own + sign if self.clearance.other is None else self.net(f"z{sign}")

    @property
    def difference(self) -> tuple[str, int] | None:
        """``Stop.difference``."""
        if self.clearance.other is None:
            return None
        return self.displacement, -1 if self.inverts else 1

    @property
    def inverted_state(self) -> int | None:
        """Index of the state whose negative the stage needs; None where it needs none."""
        own, other = self.clearance.watched, self.clearance.watched_other
        if other is None:
            return own if self.inverts else None
        return other if self.inverts else own

    def between(self, resistors: Resistors) -> list[Part]:
        """The amplifiers of a clearance between two masses: one subtracts the displacements, one
        turns the stage's output for the other mass. None for a clearance to ground."""
        if self.clearance.watched_other is None:
            return []
        own, other = f"v{self.clearance.watched + 1}", f"v{self.clearance.watched_other + 1}"
        first, second = (own, f"{other}n") if self.inverts else (f"{own}n", other)
        role = f"{self.clearance.quantity} in clearance {self.clearance.name}"
        back, node, turned = "reaction on the other mass", self.net("dz"), self.net("df")
        out = self.displacement
        return [
            Section(self.section("U4A"), node, GROUND, out, role),
            *resistors(self.part("R220"), first, node, role),
            *resistors(self.part("R221"), second, node, role),
            *resistors(self.part("R222"), node, out, role),
            Section(self.section("U4B"), turned, GROUND, self.reaction, back),
            *resistors(self.part("R224"), self.output, turned, back),
            *resistors(self.part("R225"), turned, self.reaction, back),
        ]
