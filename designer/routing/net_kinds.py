"""Kinds of nets: how wide a track is and how far others stay from it, under a board's rules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from designer.board.kicad_names import kicad_net
from designer.board.kicad_rules import CustomRule
from designer.board.net_classes import CLASSES, DEFAULT, SUMMING, SUPPLY, VIA
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit


@dataclass(frozen=True)
class NetKind:
    """What all nets of a kind have in common."""

    name: str
    """Name of the net class; "ground" is a kind of its own, of the class of supplies."""
    half: float
    """Half the width of a track [mm]."""
    clearance: float
    """Least gap to copper of other nets [mm]."""
    front: int
    """Factor of a step on the front, in units of ``kernel_router.UNIT``."""
    back: int
    """Factor of a step on the back."""
    via: int
    """Cost of a via, in the cost of steps."""
    yields: int
    """What the nets in its way cost it, in units of UNIT: the less, the more others make way."""


VIA_RADIUS = VIA["via_diameter"] / 2.0
"""Radius of every via [mm]."""
GROUND_KIND = "ground"


def net_kinds(rules: Sequence[CustomRule]) -> tuple[NetKind, ...]:
    """The kinds in the order in which they are routed.

    A summing node goes on the front and changes sides only where no way is left; ground goes on the
    back, where its pour is to be whole.
    """
    limits = {rule.id: rule for rule in rules}
    least = limits["clearance"].limit
    supply = max(limits["supply-width"].limit, CLASSES[SUPPLY]["track_width"])

    def kind(
        name: str, width: float, clearance: float, front: int, back: int, via: int, yields: int
    ) -> NetKind:
        return NetKind(name, width / 2.0, clearance, front, back, via, yields)

    summing_clearance = max(least, limits["summing-clearance"].limit)
    return (
        kind(SUMMING, CLASSES[SUMMING]["track_width"], summing_clearance, 16, 24, 500_000, 4),
        kind(DEFAULT, CLASSES[DEFAULT]["track_width"], least, 16, 20, 16_000, 16),
        kind(SUPPLY, supply, least, 16, 18, 12_000, 16),
        kind(GROUND_KIND, supply, least, 20, 16, 6_000, 16),
    )


def kinds_of_nets(circuit: Circuit, names: Mapping[int, str]) -> dict[int, str]:
    """Name of the kind of each net, by its number."""
    summing = {kicad_net(s.inverting) for s in circuit.sections} - {kicad_net(GROUND)}
    rails = {kicad_net(net) for net in (POSITIVE, NEGATIVE, *circuit.supply_inputs)}
    out = {}
    for number, name in names.items():
        supply = SUPPLY if name in rails else DEFAULT
        out[number] = SUMMING if name in summing else supply
        if name == kicad_net(GROUND):
            out[number] = GROUND_KIND
    return out
