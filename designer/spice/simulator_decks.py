"""The circuit as a deck for simulators other than ngspice, with every response of a design.

``circuit.cir`` needs ngspice: its op-amps are XSPICE ``limit`` blocks. Here an op-amp is a
controlled current into a resistor, two diodes that clamp it at the output limits, and a controlled
voltage that drives the output. A source with a formula for the limit (``tanh``, ``sqrt``) would be
shorter. With it ngspice finds no first point of a rectifier: a simulator damps its steps at the
junction of a diode, but not in a formula. The clamps are so steep that a limit is met to a
fraction of a millivolt.

``portable`` keeps to what simulators after SPICE 2 share: R, C, D, V, I, linear E and G, without
parameters, expressions or subcircuits. The generator has a negative amplitude in the place of half
a turn of phase; a phase is written only where a force has another. ``ltspice`` has one op-amp as a
subcircuit with parameters, so that another model can take its place, and LTspice's options. Text
from a model file enters only through ``title_line``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from designer.base.arrays import Array
from designer.base.defaults import Dialect
from designer.catalog.diode_curve import THERMAL
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.netlist import GROUND, Circuit, Excitation
from designer.spice import deck, opamp_model
from designer.spice.deck import SolverSettings
from designer.spice.opamp_model import literal

FORMAT = 1
INNER = 1e3
"""Resistance [ohm] inside an op-amp, whose voltage the clamps limit."""
EMISSION, SATURATION_CURRENT = 0.001, 1e-14
"""Curve of the clamps' diodes: no real diode is so steep. Their voltage is 0.7 mV, and changes by
0.12 mV while the current grows a hundredfold."""
CLAMP = f".model clamp d(is={SATURATION_CURRENT!r} n={EMISSION!r})"
LOAD = 1e6
"""Resistance [ohm] on a rail that no part uses: some simulators refuse a node with one element."""


@dataclass(frozen=True)
class ResponseRun:
    """What shows one response: the generator, the start and the analysis."""

    omega: float
    """Dimensionless frequency of the wanted response."""
    expected: str | None
    """The wanted n-p-q; None where any will do."""
    excitation: Excitation
    """The generator's setting."""
    settings: SolverSettings
    stop_time: float
    """End of the run [s]."""
    initial: Array | None
    """(states,) capacitor voltages at t = 0; None for discharged ones."""

    @property
    def name(self) -> str:
        """The run in words, for a comment."""
        return f"omega {self.omega:g}" + (f", {self.expected}" if self.expected else "")


def file_name(dialect: Dialect) -> str:
    """The name of the deck in a design folder."""
    return f"circuit-{dialect}.cir"


def write(
    dialect: Dialect, circuit: Circuit, runs: Sequence[ResponseRun], *, title: str,
    notes: Sequence[str] = (),
) -> str:  # fmt: skip
    """The deck as text, ending in a newline: the nominal board, the first response switched on.

    notes : lines of a comment at the top.
    """
    board, own = nominal_board(circuit), SIMULATORS[dialect]
    lines = [
        deck.title_line(title),
        f"* designer deck for {dialect}, format {FORMAT}",
        *map(deck.comment_line, notes),
        *_supplies(circuit),
        *deck.resistors(circuit, board),
        *deck.diodes(circuit, charge=False),
        *own.opamps(circuit, board),
        deck.options(runs[0].settings) + own.options,
        f"{own.saves} {deck.voltages(circuit)}",
    ]
    for number, run in enumerate(runs, start=1):
        lines += _block(circuit, board, run, number, len(runs))
    return "\n".join([*lines, ".end"]) + "\n"


def _block(circuit: Circuit, board: Board, run: ResponseRun, number: int, count: int) -> list[str]:
    """The lines of one response; those of all but the first are comments."""
    drive, first = run.excitation, number == 1
    step = literal(run.settings.max_step)
    lines = [
        *deck.generators(circuit, drive, turned=False),
        *deck.capacitors(circuit, board, run.initial, drive.at_start),
        f".tran {step} {literal(run.stop_time)} 0 {step} uic",
    ]
    state = "switched on" if first else "switched off: a star stands before each line"
    head = deck.comment_line(f"Response {number} of {count}: {run.name}, {state}")
    return [head, *(line if first else f"*{line}" for line in lines)]


def _supplies(circuit: Circuit) -> Iterator[str]:
    """Both rails, a load where a rail has no other element, and the references as sources."""
    used = {rail.name for rail in circuit.supplies}
    for rail in circuit.rails:
        yield f"{rail.name} {rail.net} 0 {literal(rail.volts)}"
        if rail.name not in used:
            yield f"R{rail.name} {rail.net} 0 {literal(LOAD)}"
    for r in circuit.references:
        yield f"{r.name} {r.cathode} {r.anode} {literal(r.volts)}"


def _instances(circuit: Circuit, board: Board) -> Iterator[str]:
    """One subcircuit, and a line for each section."""
    drop = literal(_drop(circuit))
    yield from (
        ".subckt opamp inp inn out vcc vee params: vos=0 ib=0 low=-13 high=13",
        "Voffset inside inp {vos}",
        "Ibiasp inp 0 {ib}",
        "Ibiasn inn 0 {ib}",
        f"Ggain 0 clamped inside inn {literal(deck.open_loop_gain(board) / INNER)}",
        f"Rgain clamped 0 {literal(INNER)}",
        f"Vhigh top 0 {{high-{drop}}}",
        f"Vlow bottom 0 {{low+{drop}}}",
        "Dhigh clamped top clamp",
        "Dlow bottom clamped clamp",
        "Eout out 0 clamped 0 1",
        CLAMP,
        ".ends opamp",
    )
    for s in circuit.sections:
        yield opamp_model.instance(
            s.name,
            (s.noninverting, s.inverting, s.output),
            fidelity="ideal",
            vos=board.offset.get(s.name, 0.0),
            ib=board.bias.get(s.name, 0.0),
            rails=board.rails[s.name],
        )


def _elements(circuit: Circuit, board: Board) -> Iterator[str]:
    """The elements of an op-amp, written out for each section; offsets and bias currents that are
    not 0."""
    limits = list(dict.fromkeys(board.rails[s.name] for s in circuit.sections))
    for number, (low, high) in enumerate(limits):
        yield f"Vhigh{number} high{number} 0 {literal(high - _drop(circuit))}"
        yield f"Vlow{number} low{number} 0 {literal(low + _drop(circuit))}"
    yield CLAMP
    conductance = literal(deck.open_loop_gain(board) / INNER)
    for s in circuit.sections:
        number, inside, plus = limits.index(board.rails[s.name]), f"x{s.name}", s.noninverting
        if volts := board.offset.get(s.name, 0.0):
            plus = f"p{s.name}"
            yield f"V{s.name} {plus} {s.noninverting} {literal(volts)}"
        current = board.bias.get(s.name, 0.0)
        for letter, net in (("p", s.noninverting), ("n", s.inverting)):
            if current and net != GROUND:
                yield f"I{s.name}{letter} {net} 0 {literal(current)}"
        yield f"G{s.name} 0 {inside} {plus} {s.inverting} {conductance}"
        yield f"RX{s.name} {inside} 0 {literal(INNER)}"
        yield f"DH{s.name} {inside} high{number} clamp"
        yield f"DL{s.name} low{number} {inside} clamp"
        yield f"E{s.name} {s.output} 0 {inside} 0 1"


def _drop(circuit: Circuit) -> float:
    """Voltage [V] of a clamp that carries as much current as the resistor at the limit."""
    current = circuit.saturation / INNER
    return EMISSION * THERMAL * math.log1p(current / SATURATION_CURRENT)


@dataclass(frozen=True)
class SimulatorDeck:
    """What differs from one simulator's deck to another's."""

    about: str
    """What it is for, and what its op-amps are: the first line of its notes."""
    opamps: Callable[[Circuit, Board], Iterator[str]]
    """The lines of the op-amps."""
    saves: str
    """The words before the voltages that are kept."""
    options: str = ""
    """Options beside those of the solver."""


SIMULATORS: Mapping[Dialect, SimulatorDeck] = {
    "ltspice": SimulatorDeck(
        "For LTspice. The op-amps are one subcircuit, opamp, at the end of the elements",
        _instances,
        ".save",
        " plotwinsize=0",  # without it LTspice thins out the waves that it writes
    ),
    "portable": SimulatorDeck(
        "For simulators after SPICE 2: R, C, D, V, I, E and G alone", _elements, ".print tran"
    ),
}
