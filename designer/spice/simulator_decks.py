"""The circuit as a deck for simulators other than ngspice, with every response of a design.

``circuit.cir`` needs ngspice: its op-amps are XSPICE ``limit`` blocks. Here an op-amp is a
controlled current into a resistor, two diodes that clamp it at the output limits, and a controlled
voltage that drives the output. A source with a formula for the limit (``tanh``, ``sqrt``) would be
shorter. With it ngspice finds no first point of a rectifier: a simulator damps its steps at the
junction of a diode, but not in a formula. The clamps are so steep that a limit is met to a
fraction of a millivolt.

``portable`` keeps to what simulators after SPICE 2 share: R, C, D, V, I, linear E and G, without
parameters, expressions, subcircuits or a phase of the generator (its amplitude is negative
instead). ``ltspice`` has one op-amp as a subcircuit with parameters, so that another model can take
its place, and LTspice's options. Text from a model file enters only through ``title_line``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from designer.base.arrays import Array
from designer.catalog.diode_curve import THERMAL, card
from designer.circuit.dead_zone_parts import OUTPUT
from designer.circuit.netlist import (
    GROUND,
    NEGATIVE,
    POSITIVE,
    Board,
    Circuit,
    Excitation,
    nominal_board,
)
from designer.spice.deck import IDEAL_GAIN, SolverSettings, comment_line, title_line

Dialect = Literal["ltspice", "portable"]
DIALECTS: tuple[Dialect, ...] = get_args(Dialect)
FORMAT = 1
INNER = 1e3
"""Resistance [ohm] inside an op-amp, whose voltage the clamps limit."""
EMISSION, SATURATION_CURRENT = 0.001, 1e-14
"""Of the clamps: no diode is so steep. Their voltage is 0.7 mV, and changes by 0.12 mV while the
current grows a hundredfold."""
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
    """Settings of ngspice."""
    stop_time: float
    """End of the run [s]."""
    initial: Array | None
    """(states,) capacitor voltages at t = 0; None for discharged ones."""

    @property
    def name(self) -> str:
        """In words for a comment."""
        return f"omega {self.omega:g}" + (f", {self.expected}" if self.expected else "")


def file_name(dialect: Dialect) -> str:
    """Of the deck in a design folder."""
    return f"circuit-{dialect}.cir"


def write(
    dialect: Dialect, circuit: Circuit, runs: Sequence[ResponseRun], *, title: str,
    notes: Sequence[str] = (),
) -> str:  # fmt: skip
    """The deck as text, ending in a newline: the nominal board, the first response switched on.

    notes : lines of a comment at the top.
    """
    board = nominal_board(circuit)
    nets = [*circuit.state_nets, *([OUTPUT] if circuit.stops else []), circuit.generator.net]
    shown = " ".join(f"v({net})" for net in nets)
    lines = [
        title_line(title),
        f"* designer deck for {dialect}, format {FORMAT}",
        *map(comment_line, notes),
        *_supplies(circuit),
        *(f"{r.name} {r.a} {r.b} {_n(board.values[r.name])}" for r in circuit.resistors),
        *_diodes(circuit),
        *(_instances(circuit, board) if dialect == "ltspice" else _elements(circuit, board)),
        *_options(dialect, runs[0].settings),
        f".save {shown}" if dialect == "ltspice" else f".print tran {shown}",
    ]
    for number, run in enumerate(runs, start=1):
        lines += _block(circuit, board, run, number, len(runs))
    return "\n".join([*lines, ".end"]) + "\n"


def _block(circuit: Circuit, board: Board, run: ResponseRun, number: int, count: int) -> list[str]:
    """The lines of one response; those of all but the first are comments."""
    drive, first = run.excitation, number == 1
    starts = dict(zip(circuit.states, run.initial if run.initial is not None else (), strict=False))
    step = _n(run.settings.max_step)
    lines = [
        # Half a turn of phase, so that the model's sine and the circuit agree (``Excitation``).
        f"{circuit.generator.name} {circuit.generator.net} 0 "
        f"SIN({_n(drive.offset)} {_n(-drive.amplitude)} {_n(drive.frequency)})",
        *(
            f"{c.name} {c.plus} {c.minus} {_n(board.values[c.name])} "
            f"IC={_n(starts.get(c.name, 0.0))}"
            for c in circuit.capacitors
        ),
        f".tran {step} {_n(run.stop_time)} 0 {step} uic",
    ]
    state = "switched on" if first else "switched off: a star stands before each line"
    head = comment_line(f"Response {number} of {count}: {run.name}, {state}")
    return [head, *(line if first else f"*{line}" for line in lines)]


def _options(dialect: Dialect, settings: SolverSettings) -> list[str]:
    options = f".options method={settings.method} reltol={_n(settings.reltol)} "
    options += f"abstol={_n(settings.abstol)} vntol={_n(settings.vntol)}"
    # LTspice thins out the waves that it writes unless told not to.
    return [f"{options} plotwinsize=0" if dialect == "ltspice" else options]


def _supplies(circuit: Circuit) -> Iterator[str]:
    """Both rails, a load where a rail has no other element, and the references as sources."""
    used = {rail.name for rail in circuit.supplies}
    for rail in circuit.rails:
        yield f"{rail.name} {rail.net} 0 {_n(rail.volts)}"
        if rail.name not in used:
            yield f"R{rail.name} {rail.net} 0 {_n(LOAD)}"
    for r in circuit.references:
        yield f"{r.name} {r.cathode} {r.anode} {_n(r.volts)}"


def _diodes(circuit: Circuit) -> list[str]:
    """The diodes, and a model for each kind: its curve alone."""
    kinds = list(dict.fromkeys(d.model for d in circuit.diodes))
    lines = [f"{d.name} {d.anode} {d.cathode} diode{kinds.index(d.model)}" for d in circuit.diodes]
    return lines + [card(model, f"diode{i}", charge=False) for i, model in enumerate(kinds)]


def _instances(circuit: Circuit, board: Board) -> Iterator[str]:
    """One subcircuit, and a line for each section."""
    drop = _n(_drop(circuit))
    yield ".subckt opamp inp inn out vcc vee params: vos=0 ib=0 low=-13 high=13"
    yield "Voffset inside inp {vos}"
    yield "Ibiasp inp 0 {ib}"
    yield "Ibiasn inn 0 {ib}"
    yield f"Ggain 0 clamped inside inn {_n(_gain(board) / INNER)}"
    yield f"Rgain clamped 0 {_n(INNER)}"
    yield f"Vhigh top 0 {{high-{drop}}}"
    yield f"Vlow bottom 0 {{low+{drop}}}"
    yield "Dhigh clamped top clamp"
    yield "Dlow bottom clamped clamp"
    yield "Eout out 0 clamped 0 1"
    yield CLAMP
    yield ".ends opamp"
    for s in circuit.sections:
        lowest, highest = board.rails[s.name]
        yield (
            f"X{s.name} {s.noninverting} {s.inverting} {s.output} {POSITIVE} {NEGATIVE} opamp "
            f"vos={_n(board.offset.get(s.name, 0.0))} ib={_n(board.bias.get(s.name, 0.0))} "
            f"low={_n(lowest)} high={_n(highest)}"
        )


def _elements(circuit: Circuit, board: Board) -> Iterator[str]:
    """The same elements once more for each section; offsets and bias currents that are not 0."""
    limits = list(dict.fromkeys(board.rails[s.name] for s in circuit.sections))
    for number, (low, high) in enumerate(limits):
        yield f"Vhigh{number} high{number} 0 {_n(high - _drop(circuit))}"
        yield f"Vlow{number} low{number} 0 {_n(low + _drop(circuit))}"
    yield CLAMP
    for s in circuit.sections:
        number, inside, plus = limits.index(board.rails[s.name]), f"x{s.name}", s.noninverting
        if volts := board.offset.get(s.name, 0.0):
            plus = f"p{s.name}"
            yield f"V{s.name} {plus} {s.noninverting} {_n(volts)}"
        current = board.bias.get(s.name, 0.0)
        for letter, net in (("p", s.noninverting), ("n", s.inverting)):
            if current and net != GROUND:
                yield f"I{s.name}{letter} {net} 0 {_n(current)}"
        yield f"G{s.name} 0 {inside} {plus} {s.inverting} {_n(_gain(board) / INNER)}"
        yield f"RX{s.name} {inside} 0 {_n(INNER)}"
        yield f"DH{s.name} {inside} high{number} clamp"
        yield f"DL{s.name} low{number} {inside} clamp"
        yield f"E{s.name} {s.output} 0 {inside} 0 1"


def _drop(circuit: Circuit) -> float:
    """Voltage [V] of a clamp that carries as much current as the resistor at the limit."""
    current = circuit.saturation / INNER
    return EMISSION * THERMAL * math.log1p(current / SATURATION_CURRENT)


def _gain(board: Board) -> float:
    return 1.0 / board.inverse_gain if board.inverse_gain else IDEAL_GAIN


def _n(value: float) -> str:
    """A number that SPICE reads back as the same float."""
    return repr(float(value))
