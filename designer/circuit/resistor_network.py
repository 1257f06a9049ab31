"""Conductances between nets, through resistors alone."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from itertools import combinations
from typing import Any


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
