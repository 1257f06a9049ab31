"""What boards are asked, what they answer, and how it is judged and counted.

A verdict is decided on the exact circuit rung, started on the nominal design's orbit
(docs/definitions.md).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from scipy.stats import binomtest

from designer.circuit import Circuit
from designer.confirmation import UNDECIDED
from designer.deck import Excitation, SolverSettings
from designer.modelfile import Response
from designer.orbit import Orbit, OrbitStatus
from designer.spread import Spread

BLOCK = 25
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


@dataclass(frozen=True)
class Answer:
    """One sample of one response.

    response : n-p-q or status on the exact circuit; the margins are its, waveform among them: RMS
    difference of the first displacement from the nominal board's, over its peak. ngspice : n-p-q
    or status there from this sample's own orbit, "undecided" where two step sizes differ to the
    last, "" where ngspice was not asked. ngspice_nominal : likewise from the nominal orbit, after
    ngspice_nominal_periods drive periods; where the reason alone is given, the way was too long to
    be asked. The remedies are those that a run needed to converge, in order.
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
    ngspice: str = ""
    ngspice_reason: str = ""
    ngspice_remedies: str = ""
    ngspice_nominal: str = ""
    ngspice_nominal_reason: str = ""
    ngspice_nominal_remedies: str = ""
    ngspice_nominal_periods: int = 0

    @property
    def agrees(self) -> bool | None:
        """None where ngspice was not asked, failed or is undecided."""
        return self._says_so(self.ngspice)

    @property
    def agrees_from_nominal(self) -> bool | None:
        """The same of its start from the nominal orbit."""
        return self._says_so(self.ngspice_nominal)

    def _says_so(self, heard: str) -> bool | None:
        return None if heard in ("", OrbitStatus.FAILED, UNDECIDED) else heard == self.response


@dataclass(frozen=True)
class Yield:
    """Counts, and the two-sided 95 % Wilson interval of ok/(samples - failed)."""

    ok: int
    lost: int
    grazing: int
    failed: int

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
        if not decided:
            return (0.0, 1.0)
        ci = binomtest(self.ok, decided).proportion_ci(0.95, method="wilson")
        return (float(ci.low), float(ci.high))


@dataclass(frozen=True)
class StudyPlan:
    """Everything that decides a study's samples; equal plans give equal answers."""

    circuit: Circuit
    spread: Spread
    seed: int
    samples: int
    questions: tuple[Question, ...]

    def blocks(self) -> Iterator[range]:
        """Sample indices block by block."""
        for first in range(0, self.samples, BLOCK):
            yield range(first, min(first + BLOCK, self.samples))


def count(answers: Sequence[Answer]) -> Yield:
    """The yield of a set of answers to one question."""
    tally = {v: sum(a.verdict is v for a in answers) for v in Verdict}
    return Yield(
        tally[Verdict.OK], tally[Verdict.LOST], tally[Verdict.GRAZING], tally[Verdict.FAILED]
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
