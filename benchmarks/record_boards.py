"""Boards whose motion ngspice knows: what the oscilloscope of ``bench_records`` records.

Each board is drawn from ``bench-1``, started on its own exact orbit and run on the rung ``full``
until it has settled there. What ngspice calls the motion, by the board's own thresholds, is the
truth; the last periods are what a scope may record.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from designer.base.arrays import Array
from designer.check.synthesis_result import Synthesis
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Excitation
from designer.circuit.nominal import circuit_flow, nominal_reduction, on_circuit
from designer.dynamics.orbit import Orbit
from designer.spice import deck, numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import Reading, clearance_rows, read
from designer.spice.simulator import SimulationFailed, SpiceJob, Waveforms
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from designer.verdicts.ngspice_runs import way_to_rung

RECORDED = 20
"""Drive periods that are kept of each run."""
POINTS = 2000
"""Of a period, of what is kept: 20 or more in the shortest contacts here."""


@dataclass(frozen=True)
class BoardRun:
    """The motion of one board in ngspice."""

    question: int
    """Number of the wanted response."""
    sample: int
    """Number of the board."""
    exact: str
    """What the exact circuit shows: n-p-q or a status."""
    response: str
    """What ngspice shows: the truth."""
    excitation: Excitation
    """The generator's setting."""
    signals: Mapping[str, Array]
    """(RECORDED · POINTS + 1,) voltage of each net [V], from a strobe of the generator on."""
    graze: float
    """Shallowest contact or nearest miss, of the peak of v1."""

    @property
    def period(self) -> float:
        """Drive period [s]."""
        return 1.0 / self.excitation.frequency


def runs(
    synthesis: Synthesis, samples: Sequence[int], seed: int, jobs: int, folder: Path
) -> Iterator[BoardRun]:
    """The run of each wanted response on each of these boards; those that ngspice does not make are
    left out. folder : where runs are kept from one time to the next."""
    folder.mkdir(parents=True, exist_ok=True)
    subjects = {
        key: subject
        for key, subject in _subjects(synthesis, samples, seed)
        if not _file(folder, key).exists()
    }
    with SpicePool(jobs, timeout=300.0) as pool:
        keys = list(subjects)
        for number, result in pool.map(_job(subjects[key]) for key in keys):
            key = keys[number]
            if isinstance(result, SimulationFailed):
                print(f"{key}: {result.reason}")
                continue
            orbit, signals = result
            subject = subjects[key]
            _keep(_file(folder, key), subject, orbit, signals)
            print(f"{key}: exact {subject.orbit.response}, ngspice {orbit.response}", flush=True)
    for path in sorted(folder.glob("*.npz")):
        run = _kept(path)
        if run.sample in samples:
            yield run


def _subjects(
    synthesis: Synthesis, samples: Sequence[int], seed: int
) -> Iterator[tuple[tuple[int, int], GateSubject]]:
    """What ngspice needs of each board, sample by sample."""
    design, system = synthesis.design, nominal_reduction(synthesis.design).system()
    spread = spread_of(synthesis.modelfile, design.circuit, synthesis.catalog)
    ensemble = Ensemble(draw_many(design.circuit, spread, seed, range(max(samples) + 1)))
    responses = synthesis.model_responses
    starts = [on_circuit(system, design, r).start for r in responses]
    drives = [circuit_flow(system, design, r).drive for r in responses]
    for sample in samples:
        orbits = ensemble.settle([sample] * len(responses), drives, np.array(starts))
        for k, (orbit, drive) in enumerate(zip(orbits, drives, strict=True)):
            if len(orbit.start):
                excitation = Excitation(drive.omega / (2.0 * np.pi), -drive.amplitude)
                way = way_to_rung(orbit)
                yield (
                    (k, sample),
                    GateSubject(
                        ensemble.reduction(sample), excitation, orbit, discard=way, rung="full"
                    ),
                )


def _job(subject: GateSubject) -> SpiceJob[tuple[Orbit, dict[str, Array]]]:
    """The run: at least ``RECORDED`` periods after what is discarded."""
    circuit, period = subject.circuit, subject.period
    contact = numerics_gate.shortest_contact(subject.orbit, subject.system, subject.excitation)
    steps = numerics_gate.first_steps(subject, contact)
    periods = max(numerics_gate.length(subject), subject.discard + RECORDED)
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
        SolverSettings("trap", period / steps, 1e-4),
        title="a board on the bench",
        stop_time=periods * period,
        initial=subject.orbit.start,
        rung=subject.rung,
        kept_from=max(subject.discard - 1, 0) * period,
    )
    nets = (*circuit.outputs, circuit.generator.net)
    return SpiceJob(text, nets, periods * period, partial(_reduce, reading=reading))


def _reduce(waveforms: Waveforms, reading: Reading) -> tuple[Orbit, dict[str, Array]]:
    """ngspice's orbit, and the last periods at equal intervals."""
    end = np.floor(waveforms.axis[-1] / reading.period * (1.0 + 1e-9)) * reading.period
    time = end - reading.period * RECORDED * np.linspace(1.0, 0.0, RECORDED * POINTS + 1)
    signals = {
        net: np.interp(time, waveforms.axis, wave) for net, wave in waveforms.signals.items()
    }
    return read(waveforms, reading).orbit, signals


def _file(folder: Path, key: tuple[int, int]) -> Path:
    return folder / f"{key[0]}-{key[1]:04d}.npz"


def _keep(path: Path, subject: GateSubject, orbit: Orbit, signals: Mapping[str, Array]) -> None:
    drive, place = subject.excitation, path.stem.split("-")
    peak = float(np.abs(signals[subject.circuit.state_nets[subject.system.moving]]).max())
    partial_file = path.with_suffix(".partial.npz")
    np.savez(
        partial_file,
        key=[int(n) for n in place],
        words=[subject.orbit.response, orbit.response],
        drive=[drive.frequency, drive.amplitude, drive.offset],
        graze=min(orbit.penetration, orbit.miss) / peak,
        nets=list(signals),
        waves=np.array(list(signals.values()), dtype=np.float32),
    )
    partial_file.rename(path)


def _kept(path: Path) -> BoardRun:
    with np.load(path) as stored:
        waves = stored["waves"].astype(np.float64)
        question, sample = (int(number) for number in stored["key"])
        exact, response = (str(word) for word in stored["words"])
        frequency, amplitude, offset = (float(number) for number in stored["drive"])
        return BoardRun(
            question=question,
            sample=sample,
            exact=exact,
            response=response,
            excitation=Excitation(frequency, amplitude, offset),
            signals=dict(zip((str(net) for net in stored["nets"]), waves, strict=True)),
            graze=float(stored["graze"]),
        )
