"""Boards whose motion ngspice knows: what the oscilloscope of ``bench_records`` records.

Each board is drawn from ``bench-1``, started on its own exact orbit and run on the rung ``full``
until it has settled there. What ngspice calls the motion, by the board's own thresholds, is the
truth; the last periods are what a scope may record.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from designer.base.arrays import Array
from designer.check.synthesis_result import Synthesis
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Excitation
from designer.circuit.nominal import circuit_flow, nominal_reduction, on_circuit
from designer.spice.numerics_gate import GateSubject
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from designer.workbench.ngspice_motion import NgspiceMotion, full_subject, motion_job

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
        runs_ = (motion_job(subjects[key], RECORDED, POINTS) for key in keys)
        for number, result in pool.map(runs_):
            key = keys[number]
            if isinstance(result, SimulationFailed):
                print(f"{key}: {result.reason}")
                continue
            subject = subjects[key]
            _keep(_file(folder, key), subject, result)
            shown = result.orbit.response
            print(f"{key}: exact {subject.orbit.response}, ngspice {shown}", flush=True)
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
                yield (k, sample), full_subject(ensemble.reduction(sample), excitation, orbit)


def _file(folder: Path, key: tuple[int, int]) -> Path:
    return folder / f"{key[0]}-{key[1]:04d}.npz"


def _keep(path: Path, subject: GateSubject, motion: NgspiceMotion) -> None:
    drive, place = subject.excitation, path.stem.split("-")
    orbit, signals = motion.orbit, motion.signals
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
