"""What boards are asked, what they answer, and how it is judged and counted.

A verdict is decided on the exact circuit rung, started on the nominal design's orbit
(docs/definitions.md).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
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


@dataclass(frozen=True)
class Question:
    """One wanted response of the nominal design: what every board is asked.

    start : nominal orbit on the exact circuit. settings : ngspice's, from the numerics gate;
    None where the gate did not pass, and ngspice is then not asked.
    """

    spec: Response
    excitation: Excitation
    start: Orbit
    settings: SolverSettings | None

    @property
    def stream(self) -> str:
        """Names what is drawn for this response alone: the same wherever it stands in a plan."""
        assert self.spec.omega is not None
        return f"{self.spec.omega:.9g}:{self.spec.expect}"


@dataclass(frozen=True)
class Answer:
    """One sample of one response.

    response : n-p-q or status on the exact circuit; the margins are its, waveform among them: RMS
    difference of the first displacement from the nominal board's, over its peak.
    """

    sample: int
    question: int
    verdict: Verdict
    response: str
    reason: str
    radius: float
    penetration: float
    miss: float
    asymmetry: float
    periods: int
    waveform: float = float("nan")


@dataclass(frozen=True)
class Yield:
    """Counts, and the two-sided 95 % Wilson interval of ok/(samples - failed).

    census : whether these are all the boards there are; then the interval is the rate itself.
    """

    ok: int
    lost: int
    grazing: int
    failed: int
    census: bool = field(default=False, kw_only=True)

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
    spread: Spread
    seed: int
    samples: int
    questions: tuple[Question, ...]

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


class Judged(Protocol):
    """A row with a verdict, such as an `Answer`."""

    @property
    def verdict(self) -> Verdict: ...


def count(answers: Iterable[Judged], census: bool = False) -> Yield:
    """The yield of a set of answers to one question. census : see ``Yield``."""
    tally = Counter(a.verdict for a in answers)
    return Yield(
        tally[Verdict.OK],
        tally[Verdict.LOST],
        tally[Verdict.GRAZING],
        tally[Verdict.FAILED],
        census=census,
    )


def judge(orbit: Orbit, spec: Response, nominal: Orbit) -> tuple[Verdict, str]:
    """Verdict and reason. Without an expectation the nominal circuit's own response is wanted."""
    if orbit.status is OrbitStatus.GRAZING:
        return Verdict.GRAZING, orbit.reason
    if orbit.status in (OrbitStatus.FAILED, OrbitStatus.NOT_SETTLED, OrbitStatus.DIVERGED):
        return Verdict.FAILED, orbit.reason or str(orbit.status)
    if orbit.status is not OrbitStatus.PERIODIC:
        return Verdict.LOST, str(orbit.status)
    n, p, q = orbit.n, orbit.p, orbit.q
    wanted = (
        spec.accepts(n, p, q)
        if spec.expect is not None
        else (n, p, q) in ((nominal.n, nominal.p, nominal.q), (nominal.n, nominal.q, nominal.p))
    )
    if not wanted:
        return Verdict.LOST, f"to {orbit.response}"
    if spec.symmetric and not orbit.symmetric:
        return Verdict.LOST, f"asymmetric by {orbit.asymmetry:.2g} of the peak"
    return Verdict.OK, ""


def kept(value: float) -> float:
    """A figure to nine digits: its last few depend on how a process lies in memory (which loops of
    the numerical libraries run), and equal studies are equal files."""
    return float(f"{value:.9g}")
