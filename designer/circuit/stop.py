"""How the clearances show in a circuit: which switches are where while a stop is touched."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property


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
    """Its name."""
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
