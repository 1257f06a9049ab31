"""What a bench engineer finds at each test point of a new board: the sheet at the end of board.md.

Voltages of the exact circuit: at rest with the generator off, with the spread that the model file
states; and in each wanted response, as soon as it is there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.errors import InputError
from designer.board.board_parts import probed_nets, supply_current
from designer.catalog.design_rule import NotRun
from designer.circuit.board_arrays import Boards
from designer.circuit.board_modes import resting_voltages
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, TestPoint
from designer.design_rules.rule_subject import RuleSubject
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from designer.synthesis.output_loads import FROM_REST

SAMPLES, SEED = 400, 1
"""Boards that the limits at rest are read from, and the study that they are of."""
SHARE = (0.5, 99.5)
"""Percentiles of these boards that the limits are."""
SUPPLY = 0.02
"""How far a rail may be from its voltage: what bench supplies are set to."""
NAMES = {GROUND: "ground", POSITIVE: "positive rail", NEGATIVE: "negative rail"}


NOTE = (
    f"Generator off: the nominal voltage, and where 99 of 100 of {SAMPLES} boards are with the "
    "spread of the model file. In a response: the lowest and the highest voltage of the nominal "
    "circuit. setup.csv says how each response is started."
)


@dataclass(frozen=True)
class BenchSheet:
    """What to expect of a new board, in words."""

    before: str
    """What to look at before the generator is on."""
    head: Sequence[str]
    """Titles of the table's columns."""
    rows: Sequence[Sequence[str]]
    """A row for each test point."""

    @property
    def markdown(self) -> str:
        """A section of ``board.md``."""
        lines = (self.head, ["---"] * len(self.head), *self.rows)
        grid = "\n".join(f"| {' | '.join(row)} |" for row in lines)
        return "\n\n".join(["## At the bench", self.before, grid, NOTE]) + "\n"


def bench_sheet(subject: RuleSubject) -> BenchSheet | None:
    """The sheet of a design; None for a board without test points."""
    points = [p for p in subject.circuit.fittings if isinstance(p, TestPoint)]
    if not points:
        return None
    nets = probed_nets(subject.circuit)
    rest = _rest(subject, nets)
    runs = _responses(subject, nets)
    rows = [
        [point.name, _shown(point.net, nets), *_cells(subject, point.net, nets, rest, runs)]
        for point in points
    ]
    head = ["test point", "net", "generator off", *(f"ω = {name}" for name, _ in runs)]
    return BenchSheet(_before(subject), head, rows)


def _before(subject: RuleSubject) -> str:
    """What to look at before the generator is on."""
    circuit = subject.circuit
    usual, most = supply_current(circuit, subject.catalog)
    fed = sum(_fed(subject, rail) for rail in (POSITIVE, NEGATIVE)) / 2.0
    return (
        f"Limit the current of each rail to {_milli(2.0 * (most + fed))} mA. With ± "
        f"{circuit.supply:g} V, the generator off, about {_milli(usual + fed)} mA flow from each "
        f"rail, and {_milli(most + fed)} mA at most; more is a fault. Then look at the pads, with "
        "the probe's ground on a pad of ground."
    )


def _fed(subject: RuleSubject, rail: str) -> float:
    """Current [A] from a rail into resistors, those before references: an upper bound, each taken
    to the far side's voltage or to ground."""
    circuit = subject.circuit
    held = {r.cathode: r.volts for r in circuit.references} | {
        r.anode: -r.volts for r in circuit.references if r.anode != GROUND
    }
    volts = circuit.supply if rail == POSITIVE else -circuit.supply
    return sum(
        abs(volts - held.get(r.b if r.a == rail else r.a, 0.0)) / r.value
        for r in circuit.resistors
        if rail in r.nets
    )


def _milli(amperes: float) -> str:
    return f"{1e3 * amperes:.3g}"


def _shown(net: str, nets: Sequence[str]) -> str:
    return NAMES.get(net) or _probed(net, nets)


def _probed(net: str, nets: Sequence[str]) -> str:
    """The net of the circuit behind the resistor of a pad."""
    return next((each for each in nets if net == f"{each}_out"), net)


def _cells(
    subject: RuleSubject,
    net: str,
    nets: Sequence[str],
    rest: dict[str, str],
    runs: Sequence[tuple[str, dict[str, str]]],
) -> Iterator[str]:
    if net in NAMES:
        volts = {GROUND: 0.0, POSITIVE: subject.circuit.supply, NEGATIVE: -subject.circuit.supply}
        low, high = sorted(volts[net] * (1.0 + sign * SUPPLY) for sign in (-1.0, 1.0))
        yield "0 V" if net == GROUND else f"{volts[net]:+g} V ({low:+.3g} to {high:+.3g} V)"
        yield from ("the same" for _ in runs)
        return
    own = _probed(net, nets)
    yield rest.get(own, "not known")
    yield from (found.get(own, "not known") for _, found in runs)


def _rest(subject: RuleSubject, nets: Sequence[str]) -> dict[str, str]:
    """Voltage of each net with the generator off, and its limits, in words."""
    synthesis, circuit = subject.synthesis, subject.circuit
    try:
        spread = spread_of(synthesis.modelfile, circuit, synthesis.catalog)
    except InputError:  # a study says so; the design stands
        return {}
    drawn = draw_many(circuit, spread, SEED, range(SAMPLES), "bench sheet")
    nominal, boards = (
        resting_voltages(each, nets)
        for each in (Boards.of(circuit, [nominal_board(circuit)]), drawn)
    )
    out = {}
    for i, net in enumerate(nets):
        low, high = np.nanpercentile(boards[:, i], SHARE)
        if np.isfinite([nominal[0, i], low, high]).all():
            out[net] = f"{_volts(nominal[0, i])} ({_volts(low)} to {_volts(high)})"
    return out


def _responses(subject: RuleSubject, nets: Sequence[str]) -> list[tuple[str, dict[str, str]]]:
    """Of each wanted response its name, and each net's lowest and highest voltage, in words."""
    try:
        each = {n: at for n, at in subject.each_run.items() if not n.endswith(FROM_REST)}
    except NotRun:
        return []
    return [
        (name, {n: f"{_volts(-at.low[n].value)} to {_volts(at.high[n].value)}" for n in nets})
        for name, at in each.items()
        if at.runs
    ]


def _volts(value: float) -> str:
    """Three digits, and no more than a millivolt."""
    return f"{round(float(f'{value:.3g}'), 3) + 0.0:g} V"
