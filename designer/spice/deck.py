"""The SPICE deck of a board: literal values, one element a line.

Written for plain ``ngspice -b`` and for the shared library alike. Every op-amp is one subcircuit,
which ``spice.opamp_model`` writes for the fidelity that is asked for. Text from a model file enters
only through ``title_line``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.base.defaults import Fidelity
from designer.catalog.diode_curve import card
from designer.circuit.board_values import Board
from designer.circuit.netlist import Circuit, Excitation, Generator, Reference
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics.drive_shape import Shape
from designer.spice import opamp_model
from designer.spice.opamp_model import literal

FORMAT = 1
IDEAL_GAIN = 1e9
"""Open-loop gain that stands for an infinite one."""


SHUNT_REFERENCE = [
    ".subckt reference cathode anode volts=5 least=1e-4 impedance=1",
    "Rleast cathode anode {volts/least}",
    "Ashunt %vd(cathode anode) %id(cathode anode) shunt",
    ".model shunt limit(in_offset={-volts} gain={1/impedance} out_lower_limit=0 "
    "out_upper_limit=10.0 limit_range={least/100} fraction=FALSE)",
    ".ends reference",
]
"""A shunt voltage reference, from the catalogue's least current and dynamic impedance.

It draws its least current at its voltage, below in proportion to the voltage: fed too little, it
does not reach its voltage. Any current beyond that raises the voltage by the impedance. The upper
limit [A] is beyond anything that a feed resistor lets through."""


@dataclass(frozen=True)
class SolverSettings:
    """What ngspice is told."""

    method: str
    max_step: float
    """Largest step [s]."""
    reltol: float = 1e-4
    """Relative tolerance."""
    abstol: float = 1e-12
    """Absolute tolerance of currents [A]."""
    vntol: float = 1e-7
    """Absolute tolerance of voltages [V]."""

    def as_dict(self) -> dict[str, float | str]:
        return dict(self.__dict__)


def write(
    circuit: Circuit,
    board: Board,
    excitation: Excitation,
    settings: SolverSettings,
    *,
    title: str,
    stop_time: float,
    initial: Array | None = None,
    fidelity: Fidelity = "ideal",
    kept_from: float = 0.0,
    stage: bool = True,
    also: Sequence[str] = (),
    bounded: bool = False,
    notes: Sequence[str] = (),
) -> str:
    """The deck as text, ending in a newline.

    initial : (states,) capacitor voltages at t = 0; discharged where None. fidelity : the op-amps'
    model; those with a memory start at the output voltages that belong to ``initial``. kept_from :
    time [s] before which ngspice keeps no point; what it computes is the same. stage : whether it
    keeps the nonlinear stage's output, beside the states and the generator. also : nets that it
    keeps besides. bounded : whether the steps of Newton's method are (``newton_bounds``). notes :
    lines of a comment at the top.

    Raises
    ------
    ValueError : a fidelity above ``ideal`` for a circuit without the figures of its op-amp.
    """
    drive = excitation
    lines = [
        title_line(title),
        f"* designer deck, format {FORMAT}",
        *map(comment_line, notes),
        *generators(circuit, drive),
    ]
    lines += _sources(circuit, board, fidelity)
    lines += resistors(circuit, board)
    lines += capacitors(circuit, board, initial, drive.at_start)
    lines += diodes(circuit, charge=fidelity != "ideal")
    lines += _opamps(
        circuit, board, fidelity, _outputs(circuit, board, excitation, initial, fidelity)
    )
    lines += [
        f"{options(settings)} noopiter{newton_bounds(circuit, board, fidelity) if bounded else ''}",
        f".save {voltages(circuit, stage=stage, also=also)}",
        f".tran {literal(settings.max_step)} {literal(stop_time)} "
        f"{literal(kept_from) if kept_from else 0} {literal(settings.max_step)} uic",
        ".end",
    ]
    return "\n".join(lines) + "\n"


def _opamps(
    circuit: Circuit, board: Board, fidelity: Fidelity, outputs: Mapping[str, float]
) -> list[str]:
    """One element line for each section, and the model.

    A vendor's model has a bandwidth and limits of its own, which no board changes.
    """
    gain = open_loop_gain(board)
    if fidelity == "ideal":
        return _instances(circuit, board, fidelity, outputs, {}) + opamp_model.ideal(gain)
    if circuit.figures is None:
        raise ValueError(f"rung {fidelity!r}: the circuit has no figures of its op-amp")
    figures, takes = circuit.figures, opamp_model.MODELS[fidelity].takes
    vendor = fidelity == "full" and figures.spice is not None
    gbw_of = {} if vendor else board.gain_bandwidth
    slew_of = {} if vendor else board.slew
    loads = {} if vendor or "load" not in takes else circuit.output_loads(board.values)
    more = {
        s.name: {
            **(opamp_model.load(fidelity, loads[s.name]) if s.name in loads else {}),
            **(
                opamp_model.bandwidth(fidelity, figures, gbw_of[s.name]) if s.name in gbw_of else {}
            ),
            **(opamp_model.slew_rate(fidelity, slew_of[s.name]) if s.name in slew_of else {}),
        }
        for s in circuit.sections
    }
    lines = _instances(circuit, board, fidelity, outputs, more)
    return lines + opamp_model.subcircuit(fidelity, figures, gain)


def _instances(
    circuit: Circuit,
    board: Board,
    fidelity: Fidelity,
    outputs: Mapping[str, float],
    more: Mapping[str, Mapping[str, float]],
) -> list[str]:
    return [
        opamp_model.instance(
            s.name,
            (s.noninverting, s.inverting, s.output),
            fidelity=fidelity,
            vos=board.offset.get(s.name, 0.0),
            ib=board.bias.get(s.name, 0.0),
            rails=board.rails[s.name],
            start=outputs.get(s.name, 0.0),
            more=more.get(s.name),
        )
        for s in circuit.sections
    ]


def _outputs(
    circuit: Circuit,
    board: Board,
    excitation: Excitation,
    initial: Array | None,
    fidelity: Fidelity,
) -> dict[str, float]:
    """Output voltage of each section at t = 0 where nothing is saturated, cut at its limits."""
    if fidelity == "ideal":
        return {}
    x = np.zeros(len(circuit.states)) if initial is None else initial
    reduction = Reduction(circuit, board)
    try:
        volts = reduction.voltages(reduction.system().start, x, excitation.at_start)
    except FloatingCircuit:
        return {}
    return {s.name: float(np.clip(volts[s.output], *board.rails[s.name])) for s in circuit.sections}


def _sources(circuit: Circuit, board: Board, fidelity: Fidelity) -> list[str]:
    """Supplies that a part or a model uses; references at the board's value, fed as on the board.

    A reference is a source on ``ideal``; above, it needs its current and has its resistance.
    """
    supplies = circuit.supplies if fidelity == "ideal" else circuit.rails
    lines = [f"{s.name} {s.net} 0 {literal(board.supply.get(s.name, s.volts))}" for s in supplies]
    shunts = fidelity != "ideal" and any(r.least for r in circuit.references)
    for r in circuit.references:
        volts = board.reference[r.name]
        source = f"{r.name} {r.cathode} {r.anode} {literal(volts)}"
        lines.append(shunt_reference(r, volts) if shunts and r.least else source)
    return lines + (SHUNT_REFERENCE if shunts else [])


def generators(circuit: Circuit, excitation: Excitation, *, turned: bool = True) -> list[str]:
    """The element lines of the generator's channels; turned : as of ``generator``."""
    return [
        line
        for number, channel in enumerate(circuit.generators)
        for line in generator(channel, excitation.channel(number), turned=turned)
    ]


def generator(
    channel: Generator, excitation: Excitation, *, turned: bool = True, bottom: str = "0"
) -> list[str]:
    """The element lines of a channel of the generator, at this frequency and amplitude: a source
    for each wave of its shape, one on top of the other, the first with the offset.

    turned : half a turn of phase makes the generator's voltage the negative of the shape; else a
    negative amplitude does, and a phase is written only where a wave has one. bottom : the net that
    the last one stands on.
    """
    name, net = channel.name, channel.net
    waves = sine_waves(excitation.shape)
    below = [f"{net}h{n}" for n, *_ in waves[1:]] + [bottom]
    lines, offset = [], excitation.offset
    for k, (n, size, phase) in enumerate(waves):
        own, top = (name, net) if k == 0 else (f"{name}h{n}", below[k - 1])
        peak, degrees = excitation.amplitude * size, phase
        if turned:
            degrees = (phase + 180.0) % 360.0
        else:
            peak = -peak
        end = f" 0 0 {degrees:.12g}" if turned or degrees else ""
        lines.append(
            f"{own} {top} {below[k]} SIN({literal(offset)} {literal(peak)} "
            f"{literal(n * excitation.frequency)}{end})"
        )
        offset = 0.0
    return lines


def sine_waves(shape: Shape) -> list[tuple[int, float, float]]:
    """(n, amplitude, phase [degrees]) of a shape: amplitude · sin(nωt + phase). One that is a sine
    but for its sign has no phase."""
    out = []
    for n, sine, cosine in shape:
        size, phase = math.hypot(sine, cosine), math.degrees(math.atan2(cosine, sine))
        out.append((n, size, phase) if cosine else (n, sine, 0.0))
    return out


def shunt_reference(reference: Reference, volts: float) -> str:
    """The element line of a reference that is a `SHUNT_REFERENCE`."""
    r = reference
    return (
        f"X{r.name} {r.cathode} {r.anode} reference volts={literal(volts)} "
        f"least={literal(r.least)} impedance={literal(r.impedance)}"
    )


def resistors(circuit: Circuit, board: Board) -> list[str]:
    """The element lines of the resistors."""
    return [f"{r.name} {r.a} {r.b} {literal(board.values[r.name])}" for r in circuit.resistors]


def capacitors(
    circuit: Circuit, board: Board, initial: Array | None, channels: tuple[float, float]
) -> list[str]:
    """The element lines of the capacitors, with their voltages at t = 0. channels : of the
    generator, their voltages then [V]."""
    states = np.zeros(len(circuit.states)) if initial is None else initial
    start = dict(zip(circuit.states, states, strict=True))
    start |= following(circuit, board, states, channels)
    return [
        f"{c.name} {c.plus} {c.minus} {literal(board.values[c.name])} "
        f"IC={literal(start.get(c.name, 0.0))}"
        for c in circuit.capacitors
    ]


def following(
    circuit: Circuit, board: Board, states: Array, channels: tuple[float, float] = (0.0, 0.0)
) -> dict[str, float]:
    """Voltages of the capacitors that follow from the states; 0 V where no mode holds at these."""
    if not circuit.dependent_capacitors:
        return {}
    reduction = Reduction(circuit, board)
    try:
        key = reduction.system().mode_at(states, channels[0], second_drive=channels[1])
        volts = reduction.voltages(key, states, channels)
    except ArithmeticError:
        return {}
    return {c.name: volts[c.plus] - volts[c.minus] for c in circuit.dependent_capacitors}


def diode_names(circuit: Circuit) -> dict[str, str]:
    """The model of each diode; its name in the catalogue stays out of the deck."""
    kinds = list(dict.fromkeys(d.model for d in circuit.diodes))
    return {d.name: f"diode{kinds.index(d.model)}" for d in circuit.diodes}


def diode_cards(circuit: Circuit, *, charge: bool) -> list[str]:
    """A ``.model`` card for each kind of diode. charge : with capacitance and recovery."""
    names = diode_names(circuit)
    models = {names[d.name]: d.model for d in circuit.diodes}
    return [card(model, name, charge=charge) for name, model in models.items()]


def diodes(circuit: Circuit, *, charge: bool) -> list[str]:
    """The element lines of the diodes and their cards."""
    names = diode_names(circuit)
    lines = [f"{d.name} {d.anode} {d.cathode} {names[d.name]}" for d in circuit.diodes]
    return lines + diode_cards(circuit, charge=charge)


def open_loop_gain(board: Board) -> float:
    """The open-loop gain of the board's op-amps, `IDEAL_GAIN` where it is infinite."""
    return 1.0 / board.inverse_gain if board.inverse_gain else IDEAL_GAIN


def options(settings: SolverSettings) -> str:
    """The line ``.options`` that every SPICE understands."""
    return (
        f".options method={settings.method} reltol={literal(settings.reltol)} "
        f"abstol={literal(settings.abstol)} vntol={literal(settings.vntol)}"
    )


def newton_bounds(circuit: Circuit, board: Board, fidelity: Fidelity) -> str:
    """Options that keep Newton's method from stepping from one limit of an op-amp to the other.

    An op-amp without memory is linear while its input is below limit/gain, some 65 uV. An iteration
    that takes it out of a limit overshoots this by far, to the other limit and back, until ngspice
    gives the time step up after a hundred iterations. So no input of an XSPICE block may change by
    more than its own size in an iteration, which takes one that leaves a limit to 0, or by
    limit/gain where that is more. What is solved is the same, and so is the tolerance. Nothing
    at the fidelities above, whose op-amps have memory.
    """
    if fidelity != "ideal" or not circuit.sections:
        return ""
    limit = min(abs(rail) for s in circuit.sections for rail in board.rails[s.name])
    return f" convlimit convstep=1 convabsstep={literal(limit / open_loop_gain(board))}"


def voltages(circuit: Circuit, *, stage: bool = True, also: Sequence[str] = ()) -> str:
    """The voltages that a run saves: states, outputs of the dead zones (``stage``), generator, and
    other nets."""
    nets = circuit.outputs if stage else circuit.state_nets
    return " ".join(f"v({net})" for net in dict.fromkeys((*nets, *circuit.generator_nets, *also)))


def title_line(text: str) -> str:
    """A title that is safe as the first line of a deck: printable ASCII words, one line."""
    # A word of ours first: ngspice takes comments that begin in certain ways for commands.
    return "* title: " + (_plain(text)[:120] or "untitled")


def comment_line(text: str) -> str:
    """A comment of our own words that may have a foreign name in it: printable ASCII, one line."""
    return f"* {_plain(text)}"


def _plain(text: str) -> str:
    safe = "".join(
        ch if ch.isascii() and (ch.isalnum() or ch in " .,:()+-=/_") else " " for ch in text
    )
    return " ".join(safe.split())
