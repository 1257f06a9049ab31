"""The question of boards: how far the exact circuit's yield is from ngspice's on the same boards.

Boards of the model file's spread, started on the nominal orbit, each by both engines. Where they
differ by D = +1 or -1 a board, the mean of D is the error of the exact circuit's yield. Its 95 %
interval joins the mid-p limits of both shares with their correlation (Zou and Donner, Statistics
in Medicine 27, 2008, 1693), as the combined yield of a study does: boards without any difference
still leave room for one. Boards that an engine has no answer to are asked all the same, and may
differ either way: D = +1 on each for the upper end, -1 for the lower one.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace

from designer.base.proportion import mid_p
from designer.check.checked_design import CheckedResponse
from designer.check.synthesis_result import Synthesis
from designer.dynamics.orbit import OrbitStatus
from designer.fidelity import fidelity_answers
from designer.fidelity.fidelity_errors import ResponseLabel
from designer.spice.deck import SolverSettings
from designer.spice.pool import SpicePool
from designer.verdicts import exact_circuit
from designer.verdicts.cross_check import Ask, CrossCheck, StartKind, Why
from designer.verdicts.ngspice_runs import cross_checks
from designer.verdicts.verdict import Answer, StudyPlan, Verdict
from designer.yields.study_plan import plan_study

REFINEMENTS = 3
"""Rounds of finer steps of ngspice for a board at most, down to a 64th of the gate's: further than
in a study, for here ngspice is what is measured against, and what it leaves open widens the
interval both ways."""


@dataclass(frozen=True)
class LeftOut:
    """A response of which no boards were asked, and why."""

    label: ResponseLabel
    reason: str
    """Why no boards were asked."""


@dataclass(frozen=True)
class Tally:
    """Counts of boards, which add up."""

    decided: int = 0
    """Boards that both engines decided."""
    ok: int = 0
    """Boards that the exact circuit calls ok."""
    gained: int = 0
    """Boards that only ngspice calls ok."""
    lost: int = 0
    """Boards that only the exact circuit calls ok."""
    undecided: int = 0
    """Boards of which one of them does not say whether they show the response."""
    runs: int = 0
    """Runs of ngspice."""
    periods: float = 0.0
    """Drive periods of ngspice."""
    seconds: float = 0.0
    """CPU time of the exact circuit [s]."""
    resolved: int = 0
    """Boards of which ngspice says something else at the gate's step than at those that agree."""
    lagging_decided: int = 0
    """Boards that the exact circuit decided with bandwidth and without."""
    lagging_ok: int = 0
    """How many of these boards are ok with bandwidth."""
    lagging_gained: int = 0
    """How many of these boards are ok with bandwidth alone."""
    lagging_lost: int = 0
    """How many of these boards are ok without bandwidth alone."""
    lagging_seconds: float = 0.0
    """CPU time of the exact circuit with bandwidth [s]."""

    def __add__(self, other: Tally) -> Tally:
        return Tally(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))


@dataclass(frozen=True)
class BandwidthYield:
    """The same boards on the exact circuit with bandwidth; see ``Tally``."""

    boards: int
    """Boards that were decided with bandwidth and without."""
    ok: int
    """Boards that are ok with bandwidth."""
    gained: int
    """Boards that are ok with bandwidth alone."""
    lost: int
    """Boards that are ok without bandwidth alone."""

    @property
    def difference(self) -> tuple[float, float, float]:
        """Yield with bandwidth less that without, of these boards, and its 95 % interval."""
        d = (self.gained - self.lost) / self.boards if self.boards else math.nan
        return d, *_interval(self.gained, self.lost, self.boards)


@dataclass(frozen=True)
class BoardTrade:
    """One response on its boards; see ``Tally``."""

    label: ResponseLabel
    boards: int
    """Boards that both engines decided."""
    ok: int
    """Boards that the exact circuit calls ok."""
    gained: int
    """Boards that only ngspice calls ok."""
    lost: int
    """Boards that only the exact circuit calls ok."""
    undecided: int
    """Boards of which one engine does not say whether they show the response."""
    periods: float
    """Drive periods of ngspice for a board, mean."""
    seconds: dict[str, float] = field(default_factory=dict)
    """CPU time of a board, by fidelity [s]."""
    resolved: int = 0
    """Boards of which ngspice says something else at the gate's step than at those that agree."""
    bandwidth: BandwidthYield | None = None
    """What bandwidth changes; None of a circuit without figures of its op-amp."""

    @classmethod
    def of(cls, label: ResponseLabel, tally: Tally, spice: float) -> BoardTrade:
        """spice : CPU time of a drive period of ngspice at the gate's settings."""
        asked = tally.decided + tally.undecided
        periods = tally.periods / tally.runs if tally.runs else math.nan
        seconds = {
            "circuit": tally.seconds / asked if asked else math.nan,
            "ideal": periods * spice,
        }
        bandwidth = None
        if tally.lagging_seconds:
            seconds["bandwidth"] = tally.lagging_seconds / asked
            counts = tally.lagging_decided, tally.lagging_ok
            bandwidth = BandwidthYield(*counts, tally.lagging_gained, tally.lagging_lost)
        return cls(
            label,
            tally.decided,
            tally.ok,
            tally.gained,
            tally.lost,
            tally.undecided,
            periods,
            seconds,
            tally.resolved,
            bandwidth,
        )

    @property
    def asked(self) -> int:
        """Boards, decided or not."""
        return self.boards + self.undecided

    @property
    def difference(self) -> tuple[float, float, float]:
        """Exact circuit's yield less ngspice's on the boards that both decided, and the 95 %
        interval that holds however the undecided ones would have turned out."""
        d = (self.lost - self.gained) / self.boards if self.boards else math.nan
        _, high = _interval(self.lost + self.undecided, self.gained, self.asked)
        low, _ = _interval(self.lost, self.gained + self.undecided, self.asked)
        return d, low, high

    @property
    def bound(self) -> float:
        """How large the difference may be."""
        _, low, high = self.difference
        return max(abs(low), abs(high))

    def off(self, bound: float) -> bool:
        """Whether the yields are shown to differ by more than this."""
        _, low, high = self.difference
        return low > bound or high < -bound


def question(
    made: Synthesis,
    number: int,
    settings: SolverSettings | None,
    *,
    samples: int,
    seed: int,
) -> StudyPlan | str:
    """The study of response ``number`` alone; where it can be no question of one, why not.

    settings : of ngspice, those that passed the gate.
    """
    response = made.model_responses[number - 1]
    if not response.found:
        return "the model does not show it"
    nominal = fidelity_answers.subject(made, response)
    if nominal.orbit.status is not OrbitStatus.PERIODIC:
        return f"the nominal circuit is {nominal.orbit.response}"
    if settings is None:
        return "the numerics gate did not pass"
    checked = CheckedResponse(response, nominal.orbit, nominal.excitation, None)
    plan = plan_study(
        made.modelfile, made.design, [checked], made.catalog, samples=samples, seed=seed
    )
    (asked,) = plan.questions
    return replace(plan, questions=(replace(asked, settings=settings),))


def tally(
    plan: StudyPlan,
    samples: range,
    pool: SpicePool,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> Tally:
    """These boards of a study of one response, by both engines; progress : called once a board."""
    answers, seconds = _timed(plan, samples, jobs)
    asks = [
        Ask(a.sample, 0, StartKind.NOMINAL, Why.ALL) for a in answers if a.verdict != Verdict.FAILED
    ]
    hearings = cross_checks(plan, asks, pool, jobs, progress, refinements=REFINEMENTS)
    by_sample = {h.sample: h for h in hearings}
    asked = plan.questions[0]
    both = []
    for answer in answers:
        hearing = by_sample.get(answer.sample)
        survived = None if hearing is None else hearing.survives(asked)
        if answer.verdict in (Verdict.OK, Verdict.LOST) and survived is not None:
            both.append((answer.verdict is Verdict.OK, survived))
    # The first run of each; too long a way is none.
    periods = [h.periods + 4 * max(asked.start.n, 1) for h in by_sample.values() if h.response]
    counts = Tally(
        decided=len(both),
        ok=sum(mine for mine, _ in both),
        gained=sum(theirs and not mine for mine, theirs in both),
        lost=sum(mine and not theirs for mine, theirs in both),
        undecided=len(answers) - len(both),
        runs=len(periods),
        periods=float(sum(periods)),
        seconds=seconds,
        resolved=sum(_resolved(by_sample.get(answer.sample), answer) for answer in answers),
    )
    if plan.circuit.figures is None:
        return counts
    return counts + _lagging(answers, *_timed(replace(plan, bandwidth=True), samples, jobs))


def _timed(plan: StudyPlan, samples: range, jobs: int) -> tuple[list[Answer], float]:
    """What the exact circuit says of these boards, and its CPU time [s]."""
    # What is compiled on the way is no cost of a board.
    exact_circuit.block(plan, samples[:1], jobs)
    began = time.process_time()
    answers = exact_circuit.block(plan, samples, jobs)
    return answers, time.process_time() - began


def _lagging(without: list[Answer], lagging: list[Answer], seconds: float) -> Tally:
    """Counts of the same boards without bandwidth and with it."""
    decisive = (Verdict.OK, Verdict.LOST)
    pairs = [
        (a.verdict is Verdict.OK, b.verdict is Verdict.OK)
        for a, b in zip(without, lagging, strict=True)
        if a.verdict in decisive and b.verdict in decisive
    ]
    return Tally(
        lagging_decided=len(pairs),
        lagging_ok=sum(b for _, b in pairs),
        lagging_gained=sum(b and not a for a, b in pairs),
        lagging_lost=sum(a and not b for a, b in pairs),
        lagging_seconds=seconds,
    )


def _resolved(check: CrossCheck | None, answer: Answer) -> bool:
    """Whether the engines differ at the gate's step alone."""
    return check is not None and check.finer > 1 and check.agrees(answer) is True


def _interval(lost: int, gained: int, n: int) -> tuple[float, float]:
    """95 % interval of the difference of two yields on the same n boards."""
    if n == 0:
        return -1.0, 1.0
    up, down = lost / n, gained / n
    (up_low, up_high), (down_low, down_high) = mid_p(lost, n), mid_p(gained, n)
    # A board counts for one share at most: they go against each other.
    rest = (1.0 - up) * (1.0 - down)
    against = math.sqrt(up * down / rest) if rest > 0.0 else 1.0
    d = up - down
    return (
        d - _joined(up - up_low, down_high - down, against),
        d + _joined(up_high - up, down - down_low, against),
    )


def _joined(a: float, b: float, against: float) -> float:
    return math.sqrt(a * a + b * b + 2.0 * against * a * b)
