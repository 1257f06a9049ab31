"""How far the pads of each summing node lie apart on a board."""

from __future__ import annotations

import math
from collections.abc import Sequence

from designer.base.natural_sort import natural_key
from designer.board.kicad_placement import Placement
from designer.circuit.netlist import GROUND, Circuit

Point = tuple[float, float]


def node_spans(circuit: Circuit, placement: Placement) -> dict[str, float]:
    """Length [mm] of the shortest tree over the pads of each summing node, by its net.

    A track of the node is about as long: each picofarad that it adds is at a node of high
    impedance.
    """
    nodes = {s.inverting for s in circuit.sections} - {GROUND}
    pads: dict[str, list[Point]] = {node: [] for node in sorted(nodes, key=natural_key)}
    for spot in placement.spots:
        for number, net in spot.component.nets.items():
            if net in pads:
                pads[net].append(spot.pad(number))
    return {node: shortest_tree(of_node) for node, of_node in pads.items()}


def shortest_tree(points: Sequence[Point]) -> float:
    """Length of the minimum spanning tree of points, by Prim's rule; 0 of fewer than two."""
    gaps = dict.fromkeys(points[1:], math.inf)
    last, length = points[:1], 0.0
    while gaps:
        gaps = {p: min(gap, math.dist(p, last[0])) for p, gap in gaps.items()}
        nearest = min(gaps, key=gaps.__getitem__)
        length += gaps.pop(nearest)
        last = [nearest]
    return length
