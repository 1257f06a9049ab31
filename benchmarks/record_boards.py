"""Boards whose motion ngspice knows: what the oscilloscope of ``bench_records`` and ``bench_fits``
records.

Each board is drawn from ``bench-1``, started on its own exact orbit and run at the fidelity
``full`` until it has settled there. What ngspice calls the motion, by the board's own thresholds,
is the truth; the last periods are what a scope may record.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.atomic_write import appearing
from designer.base.plain_json import dumps
from designer.check.synthesis_result import Synthesis
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Excitation
from designer.circuit.nominal import circuit_flow, nominal_reduction, on_circuit
from designer.spice import deck
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed, SpiceJob, Waveforms
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from designer.workbench.overlay import FINER, RELTOL, NgspiceMotion, full_subject, motion_job
from designer.yields.adjustment import AS_BUILT, Adjustment

RECORDED = 20
"""Drive periods that are kept of each run."""
POINTS = 2000
"""Of a period, of what is kept: 20 or more in the shortest contacts here."""
DECAY, DECAY_POINTS = 0.12, 24_000
"""How long a board is followed after its generator was switched off [s], and in how many steps."""


@dataclass(frozen=True)
class Asked:
    """A board at a setting of the generator."""

    question: int
    """Number of the wanted response."""
    sample: int
    """Number of the board."""
    setting: Adjustment = AS_BUILT
    """Off what ``setup.csv`` says of the response."""

    @property
    def name(self) -> str:
        """Of the file that keeps its run."""
        turned = "".join(f"_{change.hex()}" for change in self.setting.vector.tolist())
        return f"{self.question}-{self.sample:04d}" + (
            "" if self.setting == AS_BUILT else f"-{sha256(turned.encode()).hexdigest()[:12]}"
        )


@dataclass(frozen=True)
class BoardRun:
    """The motion of one board in ngspice."""

    asked: Asked
    """The board, and where the generator was turned to."""
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


class RecordBoards:
    """Boards of a design's own spread, and their runs, kept in a folder from one time to the next.

    count : how many boards there are. jobs : runs at a time.
    """

    def __init__(
        self, synthesis: Synthesis, count: int, seed: int, folder: Path, jobs: int
    ) -> None:
        design, system = synthesis.design, nominal_reduction(synthesis.design).system()
        responses = synthesis.model_responses
        spread = spread_of(synthesis.modelfile, design.circuit, synthesis.catalog)
        self.drawn = draw_many(design.circuit, spread, seed, range(count))
        self.starts = [on_circuit(system, design, r).start for r in responses]
        self._drives = [circuit_flow(system, design, r).drive for r in responses]
        self._ensemble = Ensemble(self.drawn)
        # A folder for what the runs depend on: none of other steps, parts or boards is taken over.
        circuit = design.circuit
        parts = {
            **{r.name: r.value for r in circuit.resistors},
            **{c.name: c.value for c in circuit.capacitors},
        }
        settings = (seed, parts, dumps(spread.as_dict()), FINER, RELTOL, RECORDED, POINTS)
        self._folder = folder / sha256(repr(settings).encode()).hexdigest()[:12]
        self._folder.mkdir(parents=True, exist_ok=True)
        self._jobs = jobs

    def runs(self, asked: Iterable[Asked]) -> Iterator[BoardRun]:
        """The run of each; those that ngspice does not make are left out."""
        every = list(dict.fromkeys(asked))
        missing = [each for each in every if not self._file(each).exists()]
        subjects = {each: subject for each in missing if (subject := self._subject(each))}
        keys = list(subjects)
        with SpicePool(self._jobs, timeout=300.0) as pool:
            jobs = (motion_job(subjects[each], RECORDED, POINTS) for each in keys)
            for number, result in pool.map(jobs):
                each = keys[number]
                if isinstance(result, SimulationFailed):
                    print(f"{each.name}: {result.reason}")
                    continue
                _keep(self._file(each), subjects[each], result)
                exact, shown = subjects[each].orbit.response, result.orbit.response
                print(f"{each.name}: exact {exact}, ngspice {shown}", flush=True)
        for each in every:
            if self._file(each).exists():
                yield _kept(self._file(each), each)

    def decay(self, sample: int) -> Mapping[str, Array] | None:
        """(DECAY_POINTS + 1,) voltage of each net [V] of a board whose generator was switched off
        while it showed the first response; None where ngspice makes no run."""
        path = self._folder / f"decay-{sample:04d}.npz"
        subject = None if path.exists() else self._subject(Asked(0, sample))
        if subject is not None:
            with SpicePool(1, timeout=300.0) as pool:
                for _, result in pool.map([_decay_job(subject)]):
                    if not isinstance(result, SimulationFailed):
                        _save(path, nets=list(result), waves=np.array([*result.values()]))
        if not path.exists():
            return None
        with np.load(path) as stored:
            return dict(zip(stored["nets"].tolist(), stored["waves"], strict=True))

    def _subject(self, asked: Asked) -> GateSubject | None:
        """What ngspice needs, from where the nominal board's orbit leads; None without an orbit."""
        drive = self._drives[asked.question]
        as_set = Excitation(drive.omega / (2.0 * np.pi), -drive.amplitude)
        excitation, start = asked.setting.of(as_set), self.starts[asked.question]
        (orbit,) = self._ensemble.settle([asked.sample], [excitation.drive], start[None])
        if not len(orbit.start):
            return None
        return full_subject(self._ensemble.reduction(asked.sample), excitation, orbit)

    def _file(self, asked: Asked) -> Path:
        return self._folder / f"{asked.name}.npz"


def _decay_job(subject: GateSubject) -> SpiceJob[dict[str, Array]]:
    circuit = subject.circuit
    text = deck.write(
        circuit,
        subject.board,
        replace(subject.excitation, amplitude=0.0),
        SolverSettings("trap", subject.period / POINTS, RELTOL),
        title="a board whose generator is off",
        stop_time=DECAY,
        initial=subject.orbit.start[: len(circuit.states)],
        fidelity="full",
    )
    return SpiceJob(text, circuit.outputs, DECAY, _decayed)


def _decayed(waveforms: Waveforms) -> dict[str, Array]:
    time = np.linspace(0.0, DECAY, DECAY_POINTS + 1)
    return {net: np.interp(time, waveforms.axis, w) for net, w in waveforms.signals.items()}


def _keep(path: Path, subject: GateSubject, motion: NgspiceMotion) -> None:
    drive = subject.excitation
    orbit, signals = motion.orbit, motion.signals
    peak = float(np.abs(signals[subject.circuit.state_nets[subject.system.moving]]).max())
    _save(
        path,
        words=[subject.orbit.response, orbit.response],
        drive=[drive.frequency, drive.amplitude, drive.offset],
        graze=min(orbit.penetration, orbit.miss) / peak,
        nets=list(signals),
        waves=np.array(list(signals.values()), dtype=np.float32),
    )


def _save(path: Path, **arrays: Any) -> None:
    """Whole or not at all, whoever else writes the same."""
    with appearing(path) as partial_file, partial_file.open("wb") as file:
        np.savez(file, **arrays)


def _kept(path: Path, asked: Asked) -> BoardRun:
    with np.load(path) as stored:
        waves = stored["waves"].astype(np.float64)
        exact, response = (str(word) for word in stored["words"])
        frequency, amplitude, offset = (float(number) for number in stored["drive"])
        return BoardRun(
            asked=asked,
            exact=exact,
            response=response,
            excitation=Excitation(frequency, amplitude, offset),
            signals=dict(zip((str(net) for net in stored["nets"]), waves, strict=True)),
            graze=float(stored["graze"]),
        )
