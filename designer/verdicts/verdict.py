"""What boards are asked, what they answer, and how it is judged.

A verdict is decided on the exact circuit, started on the nominal design's orbit
(docs/definitions.md).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

from designer.base.defaults import Fidelity
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit, Excitation
from designer.dynamics.orbit import SETTLED, Orbit, OrbitStatus
from designer.model.response_table import Response
from designer.spice.deck import SolverSettings
from designer.spread.spread import Spread, draw_many

BLOCK = 250
"""Samples in a block; block edges depend on the sample index alone."""


class Verdict(StrEnum):
    """What became of a response on one board (docs/definitions.md)."""

    OK = "ok"
    LOST = "lost"
    GRAZING = "grazing"
    FAILED = "failed"


@dataclass(frozen=True)
class Question:
    """One wanted response of the nominal design: what every board is asked."""

    spec: Response
    excitation: Excitation
    """The generator's setting."""
    start: Orbit
    """Nominal orbit on the exact circuit."""
    settings: SolverSettings | None
    """Settings of ngspice, from the numerics gate; None where the gate did not pass, and ngspice is
    then not asked."""

    @property
    def stream(self) -> str:
        """The name of the stream that is drawn for this response alone: the same wherever it stands
        in a plan."""
        return f"{self.omega:.9g}:{self.spec.expect}"

    @property
    def omega(self) -> float:
        """The drive frequency, dimensionless or [rad/s]."""
        assert self.spec.omega is not None
        return self.spec.omega

    @property
    def steps(self) -> float:
        """Steps of ngspice a drive period; 0 where it is not asked."""
        if self.settings is None:
            return 0.0
        return 1.0 / (self.excitation.frequency * self.settings.max_step)

    @property
    def periodic(self) -> bool:
        """Whether an n-p-q is wanted: only such a response has an orbit that can be followed."""
        return self.wanted.periodic

    @property
    def wanted(self) -> Response:
        """The wanted response; without an expected n-p-q, the nominal orbit's is wanted."""
        return self.spec.completed(self.start)

    def judge(self, orbit: Orbit) -> tuple[Verdict, str]:
        """Verdict and reason of a board with this orbit."""
        return judge(orbit, self.spec, self.start, self.excitation.seconds(self.omega))


@dataclass(frozen=True, slots=True)
class BoardRow:
    """What every layer of a study says about one sample and one response."""

    sample: int
    """Number of the board."""
    question: int
    """Number of the question of the plan."""
    verdict: Verdict
    """What became of the board."""
    response: str
    """n-p-q or status on the exact circuit."""
    reason: str
    """Why it is not ok, or ""."""


@dataclass(frozen=True, slots=True)
class Answer(BoardRow):
    """A board as built. The margins are those of the exact circuit."""

    radius: float
    """Largest modulus of the orbit's multipliers."""
    penetration: float
    """Smallest penetration of all contacts, in units of the moving state."""
    miss: float
    """Nearest approach to a stop without contact, in units of the moving state."""
    asymmetry: float
    """Distance of the orbit from its mirror image (``Orbit.asymmetry``)."""
    periods: int
    """Drive periods that the answer cost."""
    waveform: float = float("nan")
    """RMS difference of the first displacement from the nominal board's, over its peak."""


@dataclass(frozen=True)
class StudyPlan:
    """Everything that decides a study's samples; equal plans give equal answers."""

    circuit: Circuit
    spread: Spread
    """What varies from board to board."""
    seed: int
    """Seed that the boards were drawn with."""
    samples: int
    """How many boards were drawn."""
    questions: tuple[Question, ...]
    """The wanted responses."""
    bandwidth: bool = False
    """Whether the boards are computed with op-amps that lag, see ``reduction.Reduction``."""

    @property
    def fidelity(self) -> Fidelity:
        """The op-amps' model in ngspice that goes with these boards."""
        return "dynamic" if self.bandwidth else "ideal"

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the measured boards that the samples are, one each in turn; empty where boards
        have no names."""
        return () if self.spread.measured is None else self.spread.measured.labels

    @property
    def census(self) -> bool:
        """Whether the samples are all the boards there are, once each."""
        return len(self.labels) == self.samples

    def label(self, sample: int) -> str:
        """Name of the board that a sample is."""
        return self.labels[sample % len(self.labels)]

    def boards(self, indices: range) -> Boards:
        """The boards of these samples."""
        return self.modelled(draw_many(self.circuit, self.spread, self.seed, indices))

    def modelled(self, boards: Boards) -> Boards:
        """Other boards of the circuit, computed as the samples are."""
        return replace(boards, bandwidth=self.bandwidth)

    def nominal(self) -> Boards:
        """The nominal board, as ``Boards`` of one."""
        return self.modelled(Boards.of(self.circuit, [nominal_board(self.circuit)]))

    def blocks(self, size: int = BLOCK) -> Iterator[range]:
        """Sample indices block by block."""
        for first in range(0, self.samples, size):
            yield range(first, min(first + size, self.samples))

    def rows(self, indices: range) -> list[tuple[int, int]]:
        """(place among these samples, question) of every row of a block, in order."""
        return [(i, k) for i in range(len(indices)) for k in range(len(self.questions))]


def judge(
    orbit: Orbit, spec: Response, nominal: Orbit, seconds: float = 1.0
) -> tuple[Verdict, str]:
    """Verdict and reason. Without an expectation the nominal circuit's own response is wanted.

    Whatever a board does, if it is not what is wanted it is lost; failed is only what has no
    answer: a computation that broke off, a motion that has not settled, or an exponent that cannot
    be told from the least that is wanted. seconds : one unit of the model's time on the board, in
    which a wanted exponent counts.
    """
    wanted = spec.completed(nominal)
    if orbit.status is OrbitStatus.GRAZING:
        # Whichever n-p-q it has, it has a period.
        undecided = wanted.periodic
        return (Verdict.GRAZING if undecided else Verdict.LOST), orbit.reason
    if orbit.status in (OrbitStatus.FAILED, OrbitStatus.NOT_SETTLED):
        return Verdict.FAILED, orbit.reason or str(orbit.status)
    if orbit.status not in SETTLED:
        return Verdict.LOST, str(orbit.status)
    difference = wanted.difference(orbit)
    if difference or wanted.least_exponent is None:
        return (Verdict.LOST if difference else Verdict.OK), difference
    value, error = orbit.lyapunov * seconds, orbit.lyapunov_error * seconds
    enough = wanted.has_exponent(value, error)
    if enough:
        return Verdict.OK, ""
    found = f"exponent {value:.3g} ± {error:.1g}"
    if enough is None:
        return Verdict.FAILED, f"{found}, not told from {wanted.least_exponent:g}"
    return Verdict.LOST, found


def rounded(value: float) -> float:
    """A figure to nine digits: its last few depend on how a process lies in memory (which loops of
    the numerical libraries run), and equal studies are equal files."""
    return float(f"{value:.9g}")
