"""The SPICE deck of a board: literal values, one element a line.

Written for plain ``ngspice -b`` and for the shared library alike. The op-amp is one subcircuit with
an input offset, an open-loop gain and two output limits: the rung called ``ideal``. The offset is a
source in series, not the limiter's own parameter: with the parameter every op-amp starts Newton's
method beyond its limit, where the slope is zero, and no board with offsets ever starts. Text from a
model file enters only through ``title_line``.
"""

from __future__ import annotations

from dataclasses import dataclass

from designer.circuit import Board, Circuit
from designer.dead_zone_parts import OUTPUT
from designer.diode_model import card
from designer.system import Array

FORMAT = 1
LIMIT_RANGE = 1e-3
"""Width [V] over which the limiter's corner is rounded, so that Newton's method converges."""


@dataclass(frozen=True)
class SolverSettings:
    """What ngspice is told: integration method, largest step [s], relative tolerance."""

    method: str
    max_step: float
    reltol: float = 1e-4
    abstol: float = 1e-12
    vntol: float = 1e-7

    def as_dict(self) -> dict[str, float | str]:
        return dict(self.__dict__)


@dataclass(frozen=True)
class Excitation:
    """The generator's setting: frequency [Hz], amplitude [V peak], offset [V].

    The generator starts at phase π: the force enters the inverting integrators with its sign
    turned, so that the model's sin(ωt) and the circuit agree.
    """

    frequency: float
    amplitude: float
    offset: float = 0.0


def write(
    circuit: Circuit,
    board: Board,
    excitation: Excitation,
    settings: SolverSettings,
    *,
    title: str,
    stop_time: float,
    initial: Array | None = None,
) -> str:
    """The deck as text, ending in a newline.

    initial : (states,) capacitor voltages at t = 0; discharged where None.
    """
    lines = [
        title_line(title),
        f"* designer deck, format {FORMAT}",
        f"{circuit.generator.name} {circuit.generator.net} 0 "
        f"SIN({_n(excitation.offset)} {_n(excitation.amplitude)} {_n(excitation.frequency)} "
        "0 0 180)",
    ]
    lines += _sources(circuit, board)
    voltages = dict(zip(circuit.states, initial if initial is not None else (), strict=False))
    lines += [f"{r.name} {r.a} {r.b} {_n(board.values[r.name])}" for r in circuit.resistors]
    for c in circuit.capacitors:
        start = float(voltages.get(c.name, 0.0))
        lines.append(f"{c.name} {c.plus} {c.minus} {_n(board.values[c.name])} IC={_n(start)}")
    lines += _diodes(circuit)
    for s in circuit.sections:
        low, high = board.rails[s.name]
        lines.append(
            f"X{s.name} {s.noninverting} {s.inverting} {s.output} opamp "
            f"vos={_n(board.offset.get(s.name, 0.0))} low={_n(low)} high={_n(high)}"
        )
        if board.bias:
            lines.append(f"I{s.name} {s.inverting} 0 {_n(board.bias)}")
    gain = 1.0 / board.inverse_gain if board.inverse_gain else 1e9
    nets = [*circuit.state_nets, *([OUTPUT] if circuit.stops else []), circuit.generator.net]
    lines += [
        ".subckt opamp inp inn out vos=0 low=-13 high=13",
        "Voffset inside inp {vos}",
        "Alimit %vd(inside inn) out limiter",
        f".model limiter limit(in_offset=0 gain={_n(gain)} out_lower_limit={{low}} "
        f"out_upper_limit={{high}} limit_range={_n(LIMIT_RANGE)} fraction=FALSE)",
        ".ends opamp",
        f".options method={settings.method} reltol={_n(settings.reltol)} "
        f"abstol={_n(settings.abstol)} vntol={_n(settings.vntol)} noopiter",
        ".save " + " ".join(f"v({net})" for net in nets),
        f".tran {_n(settings.max_step)} {_n(stop_time)} 0 {_n(settings.max_step)} uic",
        ".end",
    ]
    return "\n".join(lines) + "\n"


def _sources(circuit: Circuit, board: Board) -> list[str]:
    """Supplies that a part uses; references at the board's value, fed as on the board."""
    lines = [f"{s.name} {s.net} 0 {_n(s.volts)}" for s in circuit.supplies]
    return lines + [
        f"{r.name} {r.cathode} {r.anode} {_n(board.reference[r.name])}" for r in circuit.references
    ]


def _diodes(circuit: Circuit) -> list[str]:
    """The diodes, and a model for each kind; its name in the catalogue stays out of the deck."""
    kinds = list(dict.fromkeys(d.model for d in circuit.diodes))
    lines = [f"{d.name} {d.anode} {d.cathode} diode{kinds.index(d.model)}" for d in circuit.diodes]
    return lines + [card(model, f"diode{i}", charge=False) for i, model in enumerate(kinds)]


def title_line(text: str) -> str:
    """A title that is safe as the first line of a deck: printable ASCII words, one line."""
    kept = "".join(
        ch if ch.isascii() and (ch.isalnum() or ch in " .,:()+-=/_") else " " for ch in text
    )
    # A word of ours first: ngspice takes comments that begin in certain ways for commands.
    return "* title: " + (" ".join(kept.split())[:120] or "untitled")


def _n(value: float) -> str:
    """A number that SPICE reads back as the same float: no unit letters, all digits."""
    return repr(float(value))
