"""The parts of an op-amp package at its pins: each where its summing node grows least.

Parts are placed one after another. Each tries every free place on a grid, either way round, and
takes the one that costs least: the length that it adds to the tree of its summing node, and a share
of its distance from the other nets that it joins. Millimetres, y downwards.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import product

import numpy as np

from designer.base.arrays import Array
from designer.board.placed_component import ROOM, Label, PlacedComponent, overlap
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE

STEP = 0.25
"""Of the grid of places [mm]."""
REACH = 30.0
"""From the middle of the package to the farthest place that is tried [mm]."""
CHANNEL = 0.6
"""Round a package, for the tracks of its pins [mm]."""
BETWEEN = 0.35
"""Between parts [mm]."""
OTHER = 0.2
"""Weight of the distance from a net that is no summing node."""
CENTRE = 0.02
"""Weight of the distance from the package."""
BESIDE: tuple[Label, ...] = ("left", "right")
ABOVE: tuple[Label, ...] = ("above",)
"""Where references stand: beside the parts of a summing node, which then lie closer together."""
PLANES = frozenset({GROUND, POSITIVE, NEGATIVE, ""})
"""Nets that draw no part to a place: they are everywhere."""


def block(
    package: PlacedComponent,
    near: Sequence[PlacedComponent],
    mine: Mapping[str, Sequence[PlacedComponent]],
) -> list[PlacedComponent]:
    """A package with its decoupling beside the supply pins and its sections' parts around.

    near : the decoupling capacitors. mine : the parts of each section, by its name.
    """
    return list(_block(package, tuple(near), tuple(map(tuple, mine.values()))))


@lru_cache(maxsize=256)  # bill, project and report of one design ask for the same blocks
def _block(
    package: PlacedComponent,
    near: tuple[PlacedComponent, ...],
    sections: tuple[tuple[PlacedComponent, ...], ...],
) -> tuple[PlacedComponent, ...]:
    out = _Block([package, *_decoupling(package, near)])
    summing = {p.net for p in package.component.pins if p.name == "-"} - PLANES
    parts = [part for names in sorted(sections, key=len, reverse=True) for part in names]
    at_node = [p for p in parts if summing & set(p.component.nets.values())]
    for part in sorted(at_node, key=lambda p: p.box.height):
        out.add(part, summing)
    rest = [p for p in parts if p not in at_node]
    while rest:
        part = next((p for p in rest if out.touches(p)), rest[0])
        rest.remove(part)
        out.add(part, summing)
    return tuple(out.spots)


@dataclass
class _Block:
    """What is placed of a block so far."""

    spots: list[PlacedComponent]
    """The package first."""
    grid: Array = field(default_factory=lambda: np.arange(-REACH, REACH + STEP / 2.0, STEP))
    """Places to the right, and downwards too [mm]."""

    def touches(self, part: PlacedComponent) -> bool:
        """Whether a part joins a net, other than the planes, that is there already."""
        there = {net for s in self.spots for net in s.component.nets.values()} - PLANES
        return bool(there & set(part.component.nets.values()))

    def add(self, part: PlacedComponent, summing: set[str]) -> None:
        """Place a part where it costs least; of equal places the first."""
        best: tuple[float, PlacedComponent] | None = None
        at_node = bool(summing & set(part.component.nets.values()))
        for angle, label in product((0, 180), BESIDE if at_node else ABOVE):
            way = replace(part, angle=angle, label=label)
            cost = np.where(self._taken(way), np.inf, self._cost(way, summing)).round(6)
            row, column = np.unravel_index(int(np.argmin(cost)), cost.shape)
            if best is None or cost[row, column] < best[0]:
                at = way.moved(float(self.grid[column]), float(self.grid[row]))
                best = float(cost[row, column]), at
        assert best is not None
        self.spots.append(best[1])

    def _taken(self, part: PlacedComponent) -> Array:
        """Whether a part at each place, shape (rows, columns), would lie on another."""
        taken = np.zeros((len(self.grid), len(self.grid)), dtype=bool)
        box = part.box
        for index, spot in enumerate(self.spots):
            room, other = BETWEEN if index else CHANNEL, spot.box
            across = (self.grid + box.left < other.right + room) & (
                self.grid + box.right > other.left - room
            )
            down = (self.grid + box.top < other.bottom + room) & (
                self.grid + box.bottom > other.top - room
            )
            taken |= np.outer(down, across)
        return taken

    def _cost(self, part: PlacedComponent, summing: set[str]) -> Array:
        """What each place costs [mm], shape (rows, columns)."""
        cost = CENTRE * np.hypot(self.grid[:, None], self.grid[None, :])
        for number, net in part.component.nets.items():
            ends = [] if net in PLANES else list(self._pads(net))
            if ends:
                x, y = part.pad(number)
                gaps = [
                    np.hypot(self.grid[:, None] + y - b, self.grid[None, :] + x - a)
                    for a, b in ends
                ]
                cost += (1.0 if net in summing else OTHER) * np.min(gaps, axis=0)
        return cost

    def _pads(self, net: str) -> Iterator[tuple[float, float]]:
        for spot in self.spots:
            for number, joined in spot.component.nets.items():
                if joined == net:
                    yield spot.pad(number)


def _decoupling(package: PlacedComponent, near: Sequence[PlacedComponent]) -> list[PlacedComponent]:
    """Each capacitor with one pad at the supply pin of the same net."""
    out: list[PlacedComponent] = []
    for spot in near:
        nets = spot.component.nets
        pin = next(
            p
            for p in package.component.pins
            if p.electrical == "power_in" and p.net in nets.values()
        )
        x, y = package.pad(pin.number)
        side = -1.0 if x < 0.0 else 1.0
        # The pad of the supply's net faces the package.
        number = next(n for n, net in nets.items() if net == pin.net)
        turned = replace(spot, angle=180)
        facing = spot if -side * spot.pad(number)[0] > 0.0 else turned
        left, _, right, _ = package.footprint.courtyard
        edge = left if side < 0.0 else right
        reach = facing.box.right if side < 0.0 else -facing.box.left
        at = facing.moved(edge + side * (reach + ROOM), y)
        while any(overlap(at.box, other.box) for other in out):
            at = at.moved(0.0, 0.5 if y >= 0.0 else -0.5)
        out.append(at)
    return out
