"""The SPICE deck of a board: literal values, one element a line.

Written for plain ``ngspice -b`` and for the shared library alike. Every op-amp is one subcircuit,
which ``spice.opamp_model`` writes for the rung that is asked for. Text from a model file enters
only through ``title_line``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.catalog.diode_curve import card
from designer.circuit.dead_zone_parts import OUTPUT
from designer.circuit.netlist import Board, Circuit, Excitation
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.spice import opamp_model, reference_model
from designer.spice.opamp_model import Parameters, Rung

FORMAT = 1
IDEAL_GAIN = 1e9
"""Open-loop gain that stands for an infinite one."""


@dataclass(frozen=True)
class SolverSettings:
    """What ngspice is told."""

    method: str
    """Integration method."""
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
    rung: Rung = "ideal",
    kept_from: float = 0.0,
    stage: bool = True,
    notes: Sequence[str] = (),
) -> str:
    """The deck as text, ending in a newline.

    initial : (states,) capacitor voltages at t = 0; discharged where None. rung : the op-amps'
    model; those with a memory start at the output voltages that belong to ``initial``. kept_from :
    time [s] before which ngspice keeps no point; what it computes is the same. stage : whether it
    keeps the nonlinear stage's output, beside the states and the generator. notes : lines of a
    comment at the top.

    Raises
    ------
    ValueError : a rung above ``ideal`` for a circuit without the figures of its op-amp.
    """
    lines = [
        title_line(title),
        f"* designer deck, format {FORMAT}",
        *map(comment_line, notes),
        f"{circuit.generator.name} {circuit.generator.net} 0 "
        f"SIN({_n(excitation.offset)} {_n(excitation.amplitude)} {_n(excitation.frequency)} "
        "0 0 180)",
    ]
    lines += _sources(circuit, board, rung)
    voltages = dict(zip(circuit.states, initial if initial is not None else (), strict=False))
    lines += [f"{r.name} {r.a} {r.b} {_n(board.values[r.name])}" for r in circuit.resistors]
    for c in circuit.capacitors:
        start = float(voltages.get(c.name, 0.0))
        lines.append(f"{c.name} {c.plus} {c.minus} {_n(board.values[c.name])} IC={_n(start)}")
    lines += _diodes(circuit, rung)
    lines += _opamps(circuit, board, rung, _outputs(circuit, board, excitation, initial, rung))
    nets = [
        *circuit.state_nets,
        *([OUTPUT] if circuit.stops and stage else []),
        circuit.generator.net,
    ]
    lines += [
        f".options method={settings.method} reltol={_n(settings.reltol)} "
        f"abstol={_n(settings.abstol)} vntol={_n(settings.vntol)} noopiter",
        ".save " + " ".join(f"v({net})" for net in nets),
        f".tran {_n(settings.max_step)} {_n(stop_time)} "
        f"{_n(kept_from) if kept_from else 0} {_n(settings.max_step)} uic",
        ".end",
    ]
    return "\n".join(lines) + "\n"


def _opamps(circuit: Circuit, board: Board, rung: Rung, outputs: Mapping[str, float]) -> list[str]:
    """One element line for each section, and the model.

    A vendor's model has a bandwidth of its own, which no board changes.
    """
    gain = 1.0 / board.inverse_gain if board.inverse_gain else IDEAL_GAIN
    if rung == "ideal":
        return _instances(circuit, board, rung, outputs, {}) + opamp_model.ideal(gain)
    if circuit.figures is None:
        raise ValueError(f"rung {rung!r}: the circuit has no figures of its op-amp")
    parameters = Parameters.of(circuit.figures, gain)
    vendor = circuit.figures.spice if rung == "full" else None
    bandwidths = {
        name: opamp_model.bandwidth(rung, parameters, gbw)
        for name, gbw in board.gain_bandwidth.items()
        if vendor is None
    }
    lines = _instances(circuit, board, rung, outputs, bandwidths)
    return lines + opamp_model.subcircuit(rung, parameters, vendor)


def _instances(
    circuit: Circuit,
    board: Board,
    rung: Rung,
    outputs: Mapping[str, float],
    bandwidths: Mapping[str, Mapping[str, float]],
) -> list[str]:
    return [
        opamp_model.instance(
            s.name,
            (s.noninverting, s.inverting, s.output),
            rung=rung,
            vos=board.offset.get(s.name, 0.0),
            ib=board.bias.get(s.name, 0.0),
            rails=board.rails[s.name],
            start=outputs.get(s.name, 0.0),
            bandwidth=bandwidths.get(s.name),
        )
        for s in circuit.sections
    ]


def _outputs(
    circuit: Circuit, board: Board, excitation: Excitation, initial: Array | None, rung: Rung
) -> dict[str, float]:
    """Output voltage of each section at t = 0 where nothing is saturated, cut at its limits."""
    if rung == "ideal":
        return {}
    x = np.zeros(len(circuit.states)) if initial is None else initial
    reduction = Reduction(circuit, board)
    try:
        voltage = reduction.solution(reduction.system().start).voltage
    except FloatingCircuit:
        return {}
    return {
        s.name: float(
            np.clip(
                voltage[s.output] @ np.concatenate([x, [excitation.offset, 1.0]]),
                *board.rails[s.name],
            )
        )
        for s in circuit.sections
    }


def _sources(circuit: Circuit, board: Board, rung: Rung) -> list[str]:
    """Supplies that a part or a model uses; references at the board's value, fed as on the board.

    A reference is a source on ``ideal``; above, it needs its current and has its resistance.
    """
    supplies = circuit.supplies if rung == "ideal" else circuit.rails
    lines = [f"{s.name} {s.net} 0 {_n(board.supply.get(s.name, s.volts))}" for s in supplies]
    shunts = False
    for r in circuit.references:
        volts = board.reference[r.name]
        if rung == "ideal" or r.least == 0.0:
            lines.append(f"{r.name} {r.cathode} {r.anode} {_n(volts)}")
            continue
        shunts = True
        lines.append(
            reference_model.instance(
                r.name, r.cathode, r.anode, volts=volts, least=r.least, impedance=r.impedance
            )
        )
    return lines + (reference_model.subcircuit() if shunts else [])


def _diodes(circuit: Circuit, rung: Rung) -> list[str]:
    """The diodes, and a model for each kind; its name in the catalogue stays out of the deck.

    On ``ideal`` a diode is its curve alone; above, it has its capacitance and recovers.
    """
    kinds = list(dict.fromkeys(d.model for d in circuit.diodes))
    lines = [f"{d.name} {d.anode} {d.cathode} diode{kinds.index(d.model)}" for d in circuit.diodes]
    charge = rung != "ideal"
    return lines + [card(model, f"diode{i}", charge=charge) for i, model in enumerate(kinds)]


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


def _n(value: float) -> str:
    """A number that SPICE reads back as the same float: no unit letters, all digits."""
    return repr(float(value))
