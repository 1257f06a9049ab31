"""What is drawn together: cells of a schematic, read from a circuit's parts and nets.

A chain is two-pin parts in a row that only meet each other: the two halves of a series composite, a
clamp and its resistor. Each amplifier is a cell of its input chains, its feedback chains and what
hangs on its output; what is left (a reference and its feed) is a cell of rows.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from textwrap import wrap
from types import MappingProxyType

from designer.base.units import format_quantity
from designer.base.views import View
from designer.board.pins import SUPPLY_UNIT
from designer.circuit.netlist import (
    GROUND,
    NEGATIVE,
    POSITIVE,
    Capacitor,
    Circuit,
    Connector,
    Diode,
    Fitting,
    Reference,
    Resistor,
    Section,
    SupplyCapacitor,
    SupplyDiode,
    TestPoint,
    Trimmer,
)
from designer.circuit.stage_title import dead_zone_titles, section_stages, stage_names

TwoPin = Resistor | Capacitor | Diode | Reference | SupplyCapacitor | SupplyDiode


@dataclass(frozen=True)
class Chain:
    """Parts in series between two nets."""

    start: str
    """The net where they begin."""
    end: str
    """The net where they end."""
    parts: tuple[TwoPin, ...]

    @property
    def turned(self) -> Chain:
        return Chain(self.end, self.start, self.parts[::-1])

    @property
    def nets(self) -> frozenset[str]:
        return frozenset((self.start, self.end))

    def forward(self, index: int) -> bool:
        """Whether the first pin of a part (its plus, its anode) is on the side of ``start``."""
        net = self.start
        for part in self.parts[:index]:
            net = next(n for n in part.nets if n != net)
        part = self.parts[index]
        first = part.anode if isinstance(part, Diode | Reference | SupplyDiode) else part.nets[0]
        return first == net


@dataclass(frozen=True)
class Amplifier:
    """A cell around one section."""

    section: Section
    title: str
    inputs: tuple[Chain, ...]
    """Chains to the summing node."""
    feedback: tuple[Chain, ...]
    """Chains from the output to the summing node."""
    series: Chain | None
    """Chain from the output on; None where there is none."""
    shunts: tuple[Chain, ...]
    """Chains from the end of ``series`` to ground."""


@dataclass(frozen=True)
class CellRows:
    """A cell of rows."""

    title: str
    rows: tuple[Chain | str, ...]
    """The rows: each a chain, or a line of text."""
    at: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """Pads that carry a net."""


Cell = Amplifier | CellRows


def chains(parts: Iterable[TwoPin], visible: frozenset[str]) -> list[Chain]:
    """The parts joined to chains. ``visible`` nets are ends, and so are nets where one part ends or
    more than two meet."""
    left = list(parts)
    counts: dict[str, int] = {}
    for part in left:
        for net in part.nets:
            counts[net] = counts.get(net, 0) + 1
    inner = {net for net, count in counts.items() if count == 2 and net not in visible}
    out = []
    while left:
        ends = [p for p in left if not set(p.nets) <= inner]
        first = (ends or left)[0]
        left.remove(first)
        start, net = first.nets if first.nets[0] not in inner else first.nets[::-1]
        series = [first]
        while net in inner:
            following = next((p for p in left if net in p.nets), None)
            if following is None:
                break
            left.remove(following)
            series.append(following)
            net = following.nets[1] if following.nets[0] == net else following.nets[0]
        out.append(Chain(start, net, tuple(series)))
    order = {part: i for i, part in enumerate(parts)} if isinstance(parts, Sequence) else {}
    return sorted(out, key=lambda chain: min((order.get(p, 0) for p in chain.parts), default=0))


def role_lines(role: str, letters: int) -> list[str]:
    """A role in lines of so many letters, two lines at most."""
    lines = wrap(role, letters, break_long_words=False, break_on_hyphens=False)
    return lines if len(lines) < 3 else [lines[0], f"{lines[1]} …"]


def circuit_cells(
    circuit: Circuit, fittings: Sequence[TwoPin] = ()
) -> tuple[tuple[Cell, ...], ...]:
    """Rows of cells: for each mass its velocity, displacement and inverses; then each dead zone,
    and what several of them share. fittings : drawn at the nodes of the circuit, with its parts.
    """
    pins = {net for s in circuit.sections for net in s.nets}
    rails = {GROUND, POSITIVE, NEGATIVE, *circuit.generator_nets}
    shown = {net for part in fittings for net in part.nets}
    visible = frozenset(pins | rails | shown | _stage_outputs(circuit))
    two_pin = [*(p for p in circuit.parts if not isinstance(p, Section)), *fittings]
    left = chains(two_pin, visible)
    stages = section_stages(circuit)
    cells = {s.name: _amplifier(circuit, s, stages[s.name], left) for s in circuit.sections}
    rows: list[tuple[Cell, ...]] = []
    zones: dict[str, list[str]] = {title: [] for title in dead_zone_titles(circuit)}
    for name in cells:
        zones.get(stages[name], []).append(name)
    by_stage = {stages[name]: cell for name, cell in cells.items() if stages[name] not in zones}
    for mass in range(len(circuit.state_nets) // 2):
        wanted = [f"{kind} {2 * mass + s}" for s in (2, 1) for kind in ("integrator", "inverter")]
        rows.append(tuple(by_stage.pop(name) for name in wanted if name in by_stage))
    rows.append(tuple(by_stage.values()))  # amplifiers of no known kind
    owners = stage_names(circuit)
    groups = [(owners[group[0].parts[0].name], net, group) for net, group in _groups(left)]
    for title in dict.fromkeys([*zones, *(stage for stage, _, _ in groups)]):
        chained = [CellRows(f"{stage} · {n}", tuple(g)) for stage, n, g in groups if stage == title]
        rows.append((*chained, *(cells[name] for name in zones.get(title, ()))))
    return tuple(row for row in rows if row)


def _stage_outputs(circuit: Circuit) -> set[str]:
    """Outputs of dead-zone stages, and of their halves where these have one each: what a diode
    joins to an op-amp's output."""
    amplifiers = {net for s in circuit.sections for net in (s.output, s.inverting)}
    joined = {net for s in circuit.sections for net in circuit.output_nets(s)}
    return {*circuit.stage_outputs, *(joined - amplifiers)}


def _amplifier(circuit: Circuit, section: Section, stage: str, left: list[Chain]) -> Amplifier:
    """The cell of a section; takes its chains out of ``left``."""
    node, out = section.inverting, section.output
    nodes = {s.inverting for s in circuit.sections}
    # Behind its diode a rectifier's output is the stage's.
    beyond = {net for net in _stage_outputs(circuit) for c in left if c.nets == {out, net}}
    ends = {out, *beyond} - nodes
    inputs: list[Chain] = []
    feedback: list[Chain] = []
    shunts: list[Chain] = []
    series: Chain | None = None
    for chain in list(left):
        if node in chain.nets:
            turned = chain if chain.end == node else chain.turned
            (feedback if turned.start in ends else inputs).append(turned)
        elif out in chain.nets and not (chain.nets & nodes):
            turned = chain if chain.start == out else chain.turned
            if series is None and turned.end != GROUND:
                series = turned
            else:
                shunts.append(turned)
        else:
            continue
        left.remove(chain)
    if series is not None:
        for chain in [c for c in left if c.nets == {series.end, GROUND}]:
            shunts.append(chain if chain.start == series.end else chain.turned)
            left.remove(chain)
    return Amplifier(
        section, f"{stage} · {section.name}", tuple(inputs), tuple(feedback), series, tuple(shunts)
    )


def _groups(left: Sequence[Chain]) -> Iterator[tuple[str, list[Chain]]]:
    """What no amplifier took, by the net that it makes."""
    rails = {GROUND, POSITIVE, NEGATIVE}
    groups: dict[str, list[Chain]] = {}
    for chain in left:
        net = next((n for n in (chain.start, chain.end) if n not in rails), chain.end)
        groups.setdefault(net, []).append(chain if chain.end == net else chain.turned)
    yield from groups.items()


def board_cells(
    circuit: Circuit, numbers: Mapping[str, Mapping[str, str]] = MappingProxyType({})
) -> tuple[Cell, ...]:
    """What the board has beside the circuit: outputs, generator and trim, supply, decoupling.

    numbers : pads by name of the pin, by unit of a package (``drawing_cells.Numbers``).
    """
    fittings = circuit.fittings
    if not fittings:
        return ()
    pads = _pads(fittings)
    outputs: list[Chain | str] = []
    drive: list[Chain | str] = []
    notes: list[str] = []
    for part in fittings:
        if isinstance(part, Resistor):
            (outputs if part.b in pads else drive).append(Chain(part.a, part.b, (part,)))
        elif isinstance(part, Diode):
            drive.append(Chain(part.anode, part.cathode, (part,)))
        elif isinstance(part, Trimmer):
            value = format_quantity(part.value, "Ω")
            notes.append(f"{part.name} {value}: {part.low} … {part.wiper} … {part.high}")
            if View.BOM not in part.views:
                notes.append("the DC trim is not fitted")
    tied = [p.name for p in fittings if isinstance(p, Section)]
    outside = [*(circuit.supply_inputs or (POSITIVE, NEGATIVE))]
    outside.insert(1, GROUND)
    supply = [f"{shown_net(n)}: {', '.join(pads[n])}" for n in outside]
    behind = [n for n in (POSITIVE, NEGATIVE) if n not in outside and n in pads]
    supply += [f"{rail}: {', '.join(pads[rail])}" for rail in behind]
    supply = [*(f"{net}: {', '.join(pads[net])}" for net in circuit.generator_nets), *supply]
    for package in circuit.packages:
        pads_of = numbers.get(f"{package}{SUPPLY_UNIT}", {})
        if pads_of:
            listed = ", ".join(f"{shown_net(pin)} {pad}" for pin, pad in pads_of.items())
            supply.append(f"{package}: {listed}")
    if tied:
        supply.append(f"spare, followers of ground: {', '.join(tied)}")
    cells = [
        CellRows("board: outputs", tuple(outputs), pads),
        CellRows("board: generator", (*drive, *notes)),
        CellRows(
            "board: supply", tuple(Chain(d.anode, d.cathode, (d,)) for d in circuit.supply_diodes)
        ),
        CellRows("board: connectors", tuple(supply)),
    ]
    for rail in (NEGATIVE, POSITIVE):
        near = [p for p in fittings if isinstance(p, SupplyCapacitor) and rail in p.nets]
        rows = tuple(Chain(p.plus, p.minus, (p,)) for p in near)
        cells.insert(2, CellRows(f"board: decoupling of {rail}", rows))
    return tuple(cell for cell in cells if cell.rows)


def _pads(fittings: Sequence[Fitting]) -> dict[str, list[str]]:
    """The test points and connector pins of each net."""
    pads: dict[str, list[str]] = {}
    for part in fittings:
        if isinstance(part, TestPoint):
            pads.setdefault(part.net, []).append(part.name)
        if isinstance(part, Connector):
            for way, net in enumerate(part.ways, start=1):
                pads.setdefault(net, []).append(f"{part.name}-{way}")
    return pads


def shown_net(net: str) -> str:
    """The name of a net in a drawing."""
    return "GND" if net == GROUND else net
