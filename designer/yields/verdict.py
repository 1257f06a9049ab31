"""What boards are asked, what they answer, and how it is judged and counted.

A verdict is decided on the exact circuit rung, started on the nominal design's orbit
(docs/definitions.md).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

from designer.base.proportion import wilson
from designer.circuit.netlist import Circuit, Excitation
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.response_table import Response
from designer.spice.deck import SolverSettings
from designer.spread.spread import Spread

BLOCK = 250
"""Samples in a block; block edges depend on the sample index alone."""


class Verdict(StrEnum):
    """What became of a response on one board (docs/definitions.md)."""

    OK = "ok"
    LOST = "lost"
    GRAZING = "grazing"
    FAILED = "failed"


WORST_FIRST = (Verdict.LOST, Verdict.GRAZING, Verdict.FAILED, Verdict.OK)
"""What decides for a board: one response lost is one too many, whatever the others are."""


@dataclass(frozen=True)
class Question:
    """One wanted response of the nominal design: what every board is asked."""

    spec: Response
    """The wanted response."""
    excitation: Excitation
    """The generator's setting."""
    start: Orbit
    """Nominal orbit on the exact circuit."""
    settings: SolverSettings | None
    """Settings of ngspice, from the numerics gate; None where the gate did not pass, and ngspice is
    then not asked."""

    @property
    def stream(self) -> str:
        """Names what is drawn for this response alone: the same wherever it stands in a plan."""
        assert self.spec.omega is not None
        return f"{self.spec.omega:.9g}:{self.spec.expect}"

    @property
    def wanted(self) -> Response:
        """The wanted response; without an expected n-p-q, the nominal orbit's is wanted."""
        return self.spec.completed(self.start)

    def judge(self, orbit: Orbit) -> tuple[Verdict, str]:
        """Verdict and reason of a board with this orbit."""
        return judge(orbit, self.spec, self.start)


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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
class Yield:
    """Counts of boards, with the two-sided 95 % Wilson interval of ok/(samples - failed)."""

    ok: int
    """Boards that keep the response."""
    lost: int
    """Boards that lose the response."""
    grazing: int
    """Boards whose count of impacts is undecided."""
    failed: int
    """Boards without an answer."""
    census: bool = field(default=False, kw_only=True)
    """Whether these are all the boards there are; then the interval is the rate itself."""

    @property
    def samples(self) -> int:
        return self.ok + self.lost + self.grazing + self.failed

    @property
    def rate(self) -> float:
        """nan where nothing was decided."""
        decided = self.samples - self.failed
        return self.ok / decided if decided else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        decided = self.samples - self.failed
        if self.census and decided:
            return self.rate, self.rate
        return wilson(self.ok, decided)


@dataclass(frozen=True)
class StudyPlan:
    """Everything that decides a study's samples; equal plans give equal answers."""

    circuit: Circuit
    """The nominal circuit."""
    spread: Spread
    """What varies from board to board."""
    seed: int
    """Seed that the boards were drawn with."""
    samples: int
    """How many boards were drawn."""
    questions: tuple[Question, ...]
    """The wanted responses."""

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

    def blocks(self, size: int = BLOCK) -> Iterator[range]:
        """Sample indices block by block."""
        for first in range(0, self.samples, size):
            yield range(first, min(first + size, self.samples))

    def asked(self, indices: range) -> list[tuple[int, int]]:
        """(place among these samples, question) of every row of a block, in order."""
        return [(i, k) for i in range(len(indices)) for k in range(len(self.questions))]


class JudgedSample(Protocol):
    """A verdict on one response of one sample, such as a `BoardRow`."""

    @property
    def sample(self) -> int: ...
    @property
    def verdict(self) -> Verdict: ...


def count(rows: Iterable[JudgedSample], census: bool = False) -> Yield:
    """The yield of a set of rows of one question. census : see ``Yield``."""
    return count_verdicts((row.verdict for row in rows), census)


def count_verdicts(verdicts: Iterable[Verdict], census: bool = False) -> Yield:
    """The yield of boards with these verdicts. census : see ``Yield``."""
    tally = Counter(verdicts)
    return Yield(
        tally[Verdict.OK],
        tally[Verdict.LOST],
        tally[Verdict.GRAZING],
        tally[Verdict.FAILED],
        census=census,
    )


def all_on_one(rows: Iterable[JudgedSample], census: bool = False) -> Yield:
    """Boards by the worst verdict among their rows, which hold every wanted response once: the
    parts are the same for all, the generator's settings are each response's own.

    census : see ``Yield``.
    """
    boards: dict[int, set[Verdict]] = {}
    for row in rows:
        boards.setdefault(row.sample, set()).add(row.verdict)
    return count_verdicts(map(worst, boards.values()), census)


def worst(verdicts: Collection[Verdict]) -> Verdict:
    """What becomes of a board with these verdicts."""
    return next(v for v in WORST_FIRST if v in verdicts)


def judge(orbit: Orbit, spec: Response, nominal: Orbit) -> tuple[Verdict, str]:
    """Verdict and reason. Without an expectation the nominal circuit's own response is wanted."""
    if orbit.status is OrbitStatus.GRAZING:
        return Verdict.GRAZING, orbit.reason
    if orbit.status in (OrbitStatus.FAILED, OrbitStatus.NOT_SETTLED, OrbitStatus.DIVERGED):
        return Verdict.FAILED, orbit.reason or str(orbit.status)
    if orbit.status is not OrbitStatus.PERIODIC:
        return Verdict.LOST, str(orbit.status)
    difference = spec.completed(nominal).difference(orbit)
    return (Verdict.LOST if difference else Verdict.OK), difference


def reasons(rows: Iterable[tuple[Verdict, str]]) -> dict[str, int]:
    """How many boards are not ok for the same reason, by "verdict: reason", most frequent first.

    Reasons that differ only in their figures are one.
    """
    counts = Counter(
        f"{verdict}: {_without_figures(reason)}" if reason else str(verdict)
        for verdict, reason in rows
        if verdict is not Verdict.OK
    )
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))


def _without_figures(reason: str) -> str:
    for kind in ("asymmetric", "not found", "not seen"):
        if reason.startswith(f"{kind} "):
            return kind
    return "most settings gave no answer" if reason.endswith("settings gave no answer") else reason


def rounded(value: float) -> float:
    """A figure to nine digits: its last few depend on how a process lies in memory (which loops of
    the numerical libraries run), and equal studies are equal files."""
    return float(f"{value:.9g}")
