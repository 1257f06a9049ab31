"""A record laid over the prediction: the nominal board's exact orbit under the recorded drive, and
a board's motion in ngspice there.

The motion in ngspice is that of full op-amps: its response, and its last periods. The run starts on
the board's exact orbit and is left to settle on ngspice's own, as ``verdicts.way_to_fidelity`` says
how long. Its step follows the shortest contact.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from designer.base.arrays import Array
from designer.circuit.design import GeneratorSetting
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit
from designer.spice import deck, numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.read_orbit import Reading, clearance_rows, read
from designer.spice.simulator import SpiceJob, Waveforms
from designer.verdicts.ngspice_runs import way_to_fidelity
from designer.workbench.board_fit import BoardFit
from designer.workbench.folding import POINTS as CURVE_POINTS
from designer.workbench.naming import NamedMotion
from designer.workbench.prediction import POINTS, BoardPrediction, nearest

RELTOL, FINER = 1e-5, 4
"""ngspice's relative tolerance, and its steps over those with which the numerics gate begins. With
the gate's own and 1e-4 v1 is off by 0.08 to 0.35 % of its peak, with these by 0.01 to 0.05 % (RMS,
six boards of the paper's circuit, held against the exact circuit with bandwidth)."""


@dataclass(frozen=True)
class NgspiceMotion:
    """How a board moves in ngspice."""

    orbit: Orbit
    """The orbit as read by the board's own stops."""
    signals: Mapping[str, Array]
    """(periods · points + 1,) voltage of each net [V] at equal steps, from a strobe of the
    generator to the last one of the run."""


def full_subject(reduction: Reduction, excitation: Excitation, orbit: Orbit) -> GateSubject:
    """A board on full op-amps under a setting of the generator. orbit : its exact one there."""
    return GateSubject(
        reduction, excitation, orbit, discard=way_to_fidelity(orbit), fidelity="full"
    )


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
        fidelity=subject.fidelity,
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


ASKED = 3
"""Wanted responses, the nearest in frequency, from whose orbits the nominal board is settled."""


@dataclass(frozen=True)
class NgspiceWave:
    """The motion of a board in ngspice, laid over a record."""

    response: str
    """What it shows there: n-p-q or status."""
    fitted: bool
    """Whether it is the board that was fitted to the record; else the nominal one."""
    waves: Array
    """(k, nets) its waves at the phases of the overlay's [V]."""
    errors: Mapping[str, float]
    """The errors by net, as those of the overlay."""


@dataclass(frozen=True)
class Overlay:
    """A record and the nominal board's orbit at the recorded drive, in phase."""

    named: NamedMotion
    """The record, and what it shows."""
    setting: GeneratorSetting
    """The generator's setting that the exact circuit has: the recorded frequency, and the recorded
    amplitude where the generator was recorded, else that of the nearest setting."""
    orbit: Orbit
    """The exact circuit's orbit that is nearest to the record."""
    nets: tuple[str, ...]
    """The recorded nets, but the generator."""
    recorded: Array
    """(k, nets) curve of the record over a common lap [V]."""
    predicted: Array
    """(k, nets) the orbit's waves at the same phases [V]."""
    points: int = POINTS
    """Points of both curves in a drive period."""
    ngspice: NgspiceWave | None = None
    """The motion in ngspice on full op-amps; None where it was not run."""

    @property
    def errors(self) -> Mapping[str, float]:
        """By net: root of the mean square of the difference over the orbit's peak. The scope's own
        errors of gain and offset are in it."""
        return self._errors(self.predicted)

    def _errors(self, waves: Array) -> dict[str, float]:
        off = np.sqrt(((self.recorded - waves) ** 2).mean(axis=0))
        peaks = np.abs(waves).max(axis=0)
        return dict(zip(self.nets, (float(x) for x in off / peaks), strict=True))

    @property
    def excitation(self) -> Excitation:
        """The generator's setting that the exact circuit has."""
        return self.setting.excitation

    def ngspice_job(
        self, prediction: BoardPrediction, fit: BoardFit | None = None, number: int = 0
    ) -> SpiceJob[NgspiceMotion]:
        """The run of a board under the drive of the overlay: the nominal one, or that of a fit.

        number : which of the fit's records this is.
        """
        reduction, orbit = prediction.reduction, self.orbit
        if fit is not None:
            circuit = prediction.circuit
            reduction = Reduction(circuit, fit.prior.boards(fit.centre[None]).board(0))
            start = fit.orbits[number].start[: len(circuit.states)]
            orbit = settle(Flow(reduction.system(), self.excitation.drive), start)
        periods = len(self.predicted) // self.points
        return motion_job(full_subject(reduction, self.excitation, orbit), periods, self.points)

    def with_ngspice(
        self, motion: NgspiceMotion, prediction: BoardPrediction, *, fitted: bool
    ) -> Overlay:
        """The overlay with ngspice's motion, or its mirror twin where that is nearer, in phase."""
        table = np.column_stack([motion.signals[net][:-1] for net in self.nets])
        waves = [_in_phase(self.recorded, image) for image in _images(table, prediction)]
        best = min(waves, key=lambda wave: sum(self._errors(wave).values()))
        shown = NgspiceWave(motion.orbit.response, fitted, best, self._errors(best))
        return replace(self, ngspice=shown)


def overlaid(named: NamedMotion, prediction: BoardPrediction) -> Overlay | None:
    """The record over the orbit of the nominal board that is nearest to it; None where the record
    has no period, or the board no orbit near this frequency."""
    curve = named.curve
    if curve is None or not prediction.responses:
        return None
    recorded = curve.curve[:: CURVE_POINTS // POINTS]
    best: Overlay | None = None
    for setting, orbit in _orbits(named, prediction):
        waves = prediction.waves(orbit, setting)
        table = np.column_stack([waves[net] for net in named.nets])
        for image in _images(table, prediction):
            laps = math.lcm(curve.n, orbit.n)
            shown = np.tile(recorded, (laps // curve.n, 1))
            wave = _in_phase(shown, np.tile(image, (laps // orbit.n, 1)))
            candidate = Overlay(named, setting, orbit, named.nets, shown, wave)
            if best is None or sum(candidate.errors.values()) < sum(best.errors.values()):
                best = candidate
    return best


def _orbits(
    named: NamedMotion, prediction: BoardPrediction
) -> Iterator[tuple[GeneratorSetting, Orbit]]:
    """Orbits of the nominal board at the recorded drive, from those of the wanted responses."""
    motion, system = named.motion, prediction.reduction.system()
    for response in nearest(prediction.responses, motion.frequency)[:ASKED]:
        amplitude = response.setting.amplitude_v_peak
        if not math.isnan(motion.amplitude):
            amplitude = motion.amplitude
        setting = replace(
            response.setting, frequency_hz=motion.frequency, amplitude_v_peak=amplitude
        )
        orbit = settle(Flow(system, setting.excitation.drive), response.orbit.start)
        if orbit.n:
            yield setting, orbit


def _images(table: Array, prediction: BoardPrediction) -> Sequence[Array]:
    """The waves (k, nets), and those of the mirror twin where there are stops on both sides."""
    return [table, -np.roll(table, POINTS // 2, axis=0)] if prediction.twins else [table]


def _in_phase(recorded: Array, wave: Array) -> Array:
    """The wave (k, nets), turned to where it is most like the record (k, nets)."""
    scale = np.ptp(wave, axis=0)
    spectra = np.fft.rfft(recorded / scale, axis=0) * np.conj(np.fft.rfft(wave / scale, axis=0))
    product = np.fft.irfft(spectra.sum(axis=1), len(wave))
    return np.roll(wave, int(np.argmax(product)), axis=0)
