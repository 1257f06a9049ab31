"""How many boards will show the response: Monte Carlo over component spread.

Every verdict is decided on the exact circuit rung, started on the nominal design's orbit. ngspice
repeats samples of each response from the attractor that the exact rung reached, and others from
the nominal orbit (``designer.confirmation``). Finished blocks of samples go to disk at once
(``designer.blocks``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from scipy.stats import binomtest

from designer.attractor import settle
from designer.circuit import Circuit
from designer.confirmation import (
    NOMINAL_REFINEMENTS,
    OWN_REFINEMENTS,
    OWN_SAMPLES,
    UNDECIDED,
    Heard,
    Query,
    confirm,
    periods_to_settle,
    starts_from_nominal,
)
from designer.deck import Excitation, SolverSettings
from designer.flow import Flow
from designer.gate import Subject
from designer.modelfile import Response
from designer.orbit import Orbit, OrbitStatus
from designer.reduction import FloatingCircuit, Reduction
from designer.spread import Spread, draw
from designer.system import Drive
from designer.threads import parallel
from designer.workers import SpicePool

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

    response : n-p-q or status on the exact circuit; the margins are its. ngspice : n-p-q or
    status there from this sample's own orbit, "undecided" where two step sizes differ to the
    last, "" where ngspice was not asked. ngspice_nominal : likewise from the nominal
    orbit, after ngspice_nominal_periods drive periods; where the reason alone is given, the way
    was too long to be asked. The remedies are those that a run needed to converge, in order.
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


def run_block(
    plan: StudyPlan,
    block: range,
    pool: SpicePool | None,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> list[Answer]:
    """Answers for every sample of the block and every question, in order.

    ``progress`` is called once per answer, and once more for each run that ngspice is asked for.
    """
    pieces = parallel(lambda index: _exact(plan, index, progress), block, jobs)
    found = [pair for piece in pieces for pair in piece]
    answers = [answer for answer, _ in found]
    if pool is None:
        return answers
    own, far = {}, {}
    for k, (answer, subject) in enumerate(found):
        question = plan.questions[answer.question]
        if subject is None or question.settings is None:
            continue
        if answer.sample < OWN_SAMPLES:
            own[k] = Query(subject, question.settings, answer.response)
        if starts_from_nominal(answer.sample, subject.orbit):
            way = _from_nominal(subject, question)
            if way is None:
                answers[k] = replace(answer, ngspice_nominal_reason="too long a way to be asked")
                progress()
            else:
                far[k] = Query(way, question.settings, answer.response)
    for k, heard in _ask(pool, own, OWN_REFINEMENTS, progress):
        answers[k] = replace(
            answers[k],
            ngspice=heard.response,
            ngspice_reason=heard.reason,
            ngspice_remedies=heard.remedies,
        )
    for k, heard in _ask(pool, far, NOMINAL_REFINEMENTS, progress):
        answers[k] = replace(
            answers[k],
            ngspice_nominal=heard.response,
            ngspice_nominal_reason=heard.reason,
            ngspice_nominal_remedies=heard.remedies,
            ngspice_nominal_periods=far[k].subject.discard,
        )
    return answers


def _ask(
    pool: SpicePool, queries: dict[int, Query], refinements: int, progress: Callable[[], None]
) -> Iterator[tuple[int, Heard]]:
    heard = confirm(pool, list(queries.values()), refinements, progress)
    return zip(queries, heard, strict=True)


def _from_nominal(subject: Subject, question: Question) -> Subject | None:
    """The sample's run from the nominal orbit, long enough to arrive; None if that is too long."""
    start = question.start.start
    periods = periods_to_settle(_flow(subject, question), start, subject.orbit)
    return None if periods is None else replace(subject, start=start, discard=periods)


def _flow(subject: Subject, question: Question) -> Flow:
    e = question.excitation
    return Flow(subject.system, Drive(2.0 * np.pi * e.frequency, -e.amplitude))


def _exact(
    plan: StudyPlan, index: int, progress: Callable[[], None]
) -> list[tuple[Answer, Subject | None]]:
    """One board on the exact rung: an answer per question, and what ngspice would need."""
    board = draw(plan.circuit, plan.spread, plan.seed, index)
    out: list[tuple[Answer, Subject | None]] = []
    reduction = Reduction(plan.circuit, board)
    system = reduction.system()
    for number, question in enumerate(plan.questions):
        excitation = question.excitation
        subject: Subject | None = None
        try:
            drive = Drive(2.0 * np.pi * excitation.frequency, -excitation.amplitude)
            orbit = settle(Flow(system, drive), question.start.start)
            verdict, reason = judge(orbit, question.spec, question.start)
            if len(orbit.start):
                subject = Subject(reduction, excitation, orbit)
        except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError) as error:
            orbit, verdict, reason = Orbit(OrbitStatus.FAILED), Verdict.FAILED, str(error)
        out.append(
            (
                Answer(
                    sample=index,
                    question=number,
                    verdict=verdict,
                    response=orbit.response,
                    reason=reason,
                    radius=_kept(orbit.radius),
                    penetration=_kept(orbit.penetration),
                    miss=_kept(orbit.miss),
                    asymmetry=_kept(orbit.asymmetry),
                    periods=orbit.periods,
                ),
                subject,
            )
        )
        progress()
    return out


def _kept(value: float) -> float:
    """A margin to nine digits: its last few depend on how a process lies in memory (which loops of
    the numerical libraries run), and equal studies are equal files."""
    return float(f"{value:.9g}")
