"""The motion of a board in ngspice on full op-amps: its response, and its last periods.

The run starts on the board's exact orbit and is left to settle on ngspice's own, as
``verdicts.way_to_rung`` says how long. Its step follows the shortest contact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from designer.base.arrays import Array
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.orbit import Orbit
from designer.spice import deck, numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.read_orbit import Reading, clearance_rows, read
from designer.spice.simulator import SpiceJob, Waveforms
from designer.verdicts.ngspice_runs import way_to_rung

RELTOL, FINER = 1e-5, 4
"""ngspice's relative tolerance, and its steps over those with which the numerics gate begins. With
the gate's own and 1e-4 v1 is off by 0.08 to 0.35 % of its peak, with these by 0.01 to 0.05 % (RMS,
six boards of the paper's circuit, held against the exact circuit with bandwidth)."""


@dataclass(frozen=True)
class NgspiceMotion:
    """How a board moves in ngspice."""

    orbit: Orbit
    """As read by the board's own stops."""
    signals: Mapping[str, Array]
    """(periods · points + 1,) voltage of each net [V] at equal steps, from a strobe of the
    generator to the last one of the run."""


def full_subject(reduction: Reduction, excitation: Excitation, orbit: Orbit) -> GateSubject:
    """A board on full op-amps under a setting of the generator. orbit : its exact one there."""
    return GateSubject(reduction, excitation, orbit, discard=way_to_rung(orbit), rung="full")


def motion_job(subject: GateSubject, periods: int, points: int) -> SpiceJob[NgspiceMotion]:
    """The run of a subject. periods : drive periods that are kept, after what is discarded.
    points : of each, at equal steps."""
    circuit, period = subject.circuit, subject.period
    contact = numerics_gate.shortest_contact(subject.orbit, subject.system, subject.excitation)
    steps = FINER * numerics_gate.first_steps(subject, contact)
    length = max(numerics_gate.length(subject), subject.discard + periods)
    reading = Reading(
        period=period,
        discard=subject.discard,
        nets=circuit.state_nets,
        shift=subject.shift,
        clearances=clearance_rows(subject.system),
        generator=circuit.generator.net,
    )
    text = deck.write(
        circuit,
        subject.board,
        subject.excitation,
        SolverSettings("trap", period / steps, RELTOL),
        title="a board on the bench",
        stop_time=length * period,
        initial=subject.orbit.start[: len(circuit.states)],
        rung=subject.rung,
        kept_from=max(subject.discard - 1, 0) * period,
    )
    nets = (*circuit.outputs, circuit.generator.net)
    kept = partial(_kept, reading=reading, periods=periods, points=points)
    return SpiceJob(text, nets, length * period, kept)


def _kept(waveforms: Waveforms, reading: Reading, periods: int, points: int) -> NgspiceMotion:
    end = np.floor(waveforms.axis[-1] / reading.period * (1.0 + 1e-9)) * reading.period
    time = end - reading.period * periods * np.linspace(1.0, 0.0, periods * points + 1)
    signals = {
        net: np.interp(time, waveforms.axis, wave) for net, wave in waveforms.signals.items()
    }
    return NgspiceMotion(read(waveforms, reading).orbit, signals)
