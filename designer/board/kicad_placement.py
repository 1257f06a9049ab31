"""Where the components stand on the board: a block about each op-amp package.

The parts of a section stand at its pins, decoupling at the supply pins. What comes in is left of
the blocks, what goes out is right of them, coaxial jacks outermost.

The parts of an op-amp package stand at its pins, each where its summing node grows least. They are
placed one after another. Each tries every free place on a grid, either way round, and takes the one
that costs least: the length that it adds to the tree of its summing node, and a share of its
distance from the other nets that it joins. Millimetres, y downwards.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise, product

import numpy as np

from designer.base.arrays import Array
from designer.base.views import View
from designer.board.board_parts import probed_nets
from designer.board.component import Component
from designer.board.footprints import footprint
from designer.board.placed_component import ROOM, Label, PlacedBox, PlacedComponent, bounds, overlap
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit, Section, SupplyDiode
from designer.circuit.stage_title import INTERFACE, SUPPLY, stage_names

STEP = 0.25
"""Step of the grid of places [mm]."""
REACH = 30.0
"""Distance from the middle of the package to the farthest place that is tried [mm]."""
CHANNEL = 0.6
"""Round a package, for the tracks of its pins [mm]."""
BETWEEN = 0.35
"""Distance between parts [mm]."""
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
        costs = {angle: self._cost(replace(part, angle=angle), summing) for angle in (0, 180)}
        for angle, label in product(costs, BESIDE if at_node else ABOVE):
            way = replace(part, angle=angle, label=label)
            cost = np.where(self._taken(way), np.inf, costs[angle])
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
                across = [(self.grid + x - a) ** 2 for a, _ in ends]
                down = [(self.grid + y - b) ** 2 for _, b in ends]
                gap = np.full(cost.shape, np.inf)
                for squares in map(np.add.outer, down, across):
                    np.minimum(gap, squares, out=gap)
                cost += (1.0 if net in summing else OTHER) * np.sqrt(gap)
        return cost.round(6)

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


EDGE = 3.0
"""Distance from the outermost part to the board's edge on the left and right [mm]."""
BAND = 8.0
"""The same distance above and below, for screws and the title [mm]."""
SCREW = 4.0
"""Distance from the middle of a mounting hole to both edges [mm]."""
MOUNTING_HOLE = "MountingHole:MountingHole_3.2mm_M3"
MARK, FIDUCIAL = 14.0, "Fiducial:Fiducial_1mm_Mask2mm"
"""Distance from the middle of a mark for the assembler's camera to the side [mm], and its
footprint."""
APART = 2.0
"""Least room between jacks, so that the name below one is not read with the next [mm]."""
PER_COLUMN = 12
"""Amplifiers whose packages stand below one another: those of the paper's circuit."""
ORIGIN = (25.0, 25.0)
"""The board's upper left corner on the sheet."""


@dataclass(frozen=True)
class Placement:
    """Where everything stands on the board."""

    spots: tuple[PlacedComponent, ...]
    """Every component with a footprint."""
    outline: PlacedBox

    @property
    def holes(self) -> tuple[PlacedComponent, ...]:
        """Mounting holes, one at each corner; they are on no sheet and no bill."""
        box = self.outline
        return tuple(
            PlacedComponent(
                _bare(f"H{number}", MOUNTING_HOLE), footprint(MOUNTING_HOLE), x, y, label=label
            )
            for number, (y, (x, label)) in enumerate(
                product(
                    (box.top + SCREW, box.bottom - SCREW),
                    _ends(box.left + SCREW, box.right - SCREW),
                ),
                start=1,
            )
        )

    @property
    def fiducials(self) -> tuple[PlacedComponent, ...]:
        """Marks for the assembler's camera beside three of the holes, where a part is soldered on
        the surface; they are on no sheet and no bill."""
        on_surface = any(s.footprint.soldered and not s.footprint.through_hole for s in self.spots)
        box = self.outline
        if not on_surface or box.width < 3.0 * MARK:
            return ()
        top, bottom = box.top + SCREW, box.bottom - SCREW
        left, right = box.left + MARK, box.right - MARK
        return tuple(
            PlacedComponent(_bare(f"FID{number}", FIDUCIAL), footprint(FIDUCIAL), x, y)
            for number, (x, y) in enumerate(((left, top), (right, top), (left, bottom)), start=1)
        )

    @property
    def beside_title(self) -> float:
        """Room left and right of the title, for screws and marks [mm]."""
        return MARK + 2.0 if self.fiducials else 2.0 * SCREW


def place(circuit: Circuit, components: Sequence[Component]) -> Placement:
    """The board; InputError for a footprint that is not known here."""
    return _placement(circuit, tuple(components))


@lru_cache(maxsize=4)  # the notes, the cost, the project and the page of a design ask for the same
def _placement(circuit: Circuit, components: tuple[Component, ...]) -> Placement:
    spots = {
        c.reference: PlacedComponent(
            c,
            footprint(c.footprint),
            pin_labels=_names_of_pins(c, circuit) if c.kind == "connector" else (),
            caption=_names_of_pins(c, circuit)[0] if c.kind in ("jack", "test point") else "",
        )
        for c in components
    }
    owner = _owners(circuit, components)
    blocks: list[list[PlacedComponent]] = []
    packages = [c for c in components if c.kind == "op-amp"]
    for package in packages:
        near = [spots.pop(c.reference) for c in components if c.near == package.reference]
        mine = {
            section: [spots.pop(n) for n in names if n in spots]
            for section, names in owner.items()
            if section in package.parts
        }
        blocks.append(block(spots.pop(package.reference), near, mine))
    middle = [_stack(column) for column in _columns(blocks, len(circuit.sections))]
    height = max((bounds(column).height for column in middle), default=40.0)
    (inlets, incoming), (outlets, outgoing) = map(_jacks_apart, _sides(circuit, spots.values()))
    columns = [
        _spread(inlets, height),
        _strip(incoming, height),
        *middle,
        _strip(outgoing, height),
        _spread(outlets, height),
    ]
    out: list[PlacedComponent] = []
    x = 0.0
    for column in filter(None, columns):
        box = bounds(column)
        out += [s.moved(x - box.left, -box.top) for s in column]
        x += box.width + 2.0 * ROOM
    return _on_board(out)


def _columns(
    blocks: Sequence[list[PlacedComponent]], amplifiers: int
) -> Iterator[Sequence[list[PlacedComponent]]]:
    """The blocks in their order, shared out evenly among as many columns as the amplifiers take."""
    count = max(1, math.ceil(amplifiers / PER_COLUMN))
    ends = [len(blocks) * i // count for i in range(count + 1)]
    yield from (blocks[start:end] for start, end in pairwise(ends))


def _on_board(spots: Sequence[PlacedComponent]) -> Placement:
    """The outline round the parts, its corner at ``ORIGIN``, everything on steps of 0.05 mm."""
    box = bounds(spots)
    dx, dy = ORIGIN[0] + EDGE - box.left, ORIGIN[1] + BAND - box.top
    outline = PlacedBox(
        *ORIGIN,
        ORIGIN[0] + math.ceil(box.width + 2.0 * EDGE),
        ORIGIN[1] + math.ceil(box.height + 2.0 * BAND),
    )
    placed = [replace(s, x=_step(s.x + dx), y=_step(s.y + dy)) for s in spots]
    return Placement(tuple(placed), outline)


def _ends(left: float, right: float) -> tuple[tuple[float, Label], tuple[float, Label]]:
    return (left, "right"), (right, "left")


def _bare(reference: str, place: str) -> Component:
    """What is on the board alone: a hole or a mark."""
    words = "mounting hole" if place == MOUNTING_HOLE else "fiducial"
    return Component(
        reference=reference,
        kind=words,
        value="M3" if place == MOUNTING_HOLE else "fiducial",
        quantity=None,
        footprint=place,
        pins=(),
        role=words,
        stage=SUPPLY,
        views=View.BOARD,
        description=words,
        bought=None,
    )


def _names_of_pins(component: Component, circuit: Circuit) -> tuple[str, ...]:
    """What is written at the pins of a connector."""
    volts = f"{circuit.supply:g} V"
    names = {
        GROUND: "0 V",
        POSITIVE: f"+{volts}",
        NEGATIVE: f"-{volts}",
        **dict(zip(circuit.generator_nets, ("generator", "generator 2"), strict=False)),
        **{d.source: _input_label(circuit, d) for d in circuit.supply_diodes},
    }
    return tuple(names.get(pin.net, pin.net.removesuffix("_out")) for pin in component.pins)


def _input_label(circuit: Circuit, diode: SupplyDiode) -> str:
    """The voltage that a pin before a diode wants, for the rail to be at the supply's."""
    return f"{'+' if diode.positive else '-'}{circuit.supply + diode.drop:.3g} V"


def _owners(circuit: Circuit, components: Sequence[Component]) -> dict[str, list[str]]:
    """References of the parts that belong to each section, by the section's name.

    A part at a summing node is its section's, the trim's and the protection's too; another one of a
    stage is that section's whose output it touches, or goes to the stage's first.
    """
    stages = stage_names(circuit)
    sections = [p for p in (*circuit.parts, *circuit.fittings) if isinstance(p, Section)]
    out: dict[str, list[str]] = {s.name: [] for s in sections}
    for component in components:
        if component.kind == "op-amp":
            continue
        nets = set(component.nets.values())
        ranked = [s for s in sections if s.inverting in nets - {GROUND, s.output}]
        if component.stage not in (SUPPLY, INTERFACE):
            stage = [s for s in sections if stages[s.name] == component.stage]
            ranked += [s for s in stage if s.output in nets] + stage
        if ranked:
            out[ranked[0].name].append(component.reference)
    return out


def _stack(blocks: Sequence[Sequence[PlacedComponent]]) -> list[PlacedComponent]:
    """Blocks below one another, their packages in one column."""
    out: list[PlacedComponent] = []
    y = 0.0
    for each in blocks:
        box = bounds(each)
        out += [s.moved(0.0, y - box.top) for s in each]
        y += box.height + 2.0 * ROOM
    return out


def _sides(
    circuit: Circuit, spots: Iterable[PlacedComponent]
) -> tuple[list[PlacedComponent], list[PlacedComponent]]:
    """What comes in, and what goes out: parts that a state's or the dead zone's output drives."""
    incoming: list[PlacedComponent] = []
    outgoing: list[PlacedComponent] = []
    simulated = set(circuit.nets) | {GROUND}
    for spot in spots:
        outside = {net for net in spot.component.nets.values() if net and net not in simulated}
        drives = {
            net
            for p in (*circuit.parts, *circuit.fittings)
            if outside & set(p.nets)
            for net in p.nets
        }
        out = bool(drives & set(probed_nets(circuit)))
        (outgoing if out else incoming).append(spot)
    return incoming, outgoing


def _strip(spots: Sequence[PlacedComponent], height: float) -> list[PlacedComponent]:
    """Columns of parts about as high as the blocks."""
    columns: list[list[PlacedComponent]] = []
    y = math.inf
    for s in spots:
        tall = s.box.height + ROOM
        if y + tall > max(height, tall):
            columns.append([])
            y = 0.0
        columns[-1].append(s.moved(-s.box.left, y - s.box.top))
        y += tall
    out: list[PlacedComponent] = []
    x = 0.0
    for column in columns:
        box = bounds(column)
        out += [s.moved(x, 0.0) for s in column]
        x += box.width + ROOM
    return out


def _jacks_apart(
    spots: Sequence[PlacedComponent],
) -> tuple[list[PlacedComponent], list[PlacedComponent]]:
    """Coaxial jacks, which stand at the edge, and all others."""
    jacks = [s for s in spots if s.component.kind == "jack"]
    return jacks, [s for s in spots if s.component.kind != "jack"]


def _spread(spots: Sequence[PlacedComponent], height: float) -> list[PlacedComponent]:
    """One column, evenly over the height; higher than that where they need more."""
    free = height - sum(s.box.height for s in spots)
    gap = max(APART, free / max(len(spots) - 1, 1))
    out: list[PlacedComponent] = []
    y = 0.0
    for s in spots:
        out.append(s.moved(0.0, y - s.box.top))
        y += s.box.height + gap
    return out


def _step(value: float) -> float:
    return round(value * 20.0) / 20.0
