"""The exact circuit and ngspice together: one yield from both, and where they differ.

All N boards have the exact circuit's verdict X; some have ngspice's from the nominal orbit too, Y.
The estimate of ngspice's yield is the difference estimator (the exact circuit is the control
variate), in strata h that the exact circuit defines: boards nearest to a boundary, slow ones, the
rest::

    p = mean of X over all + sum over h of (N_h/N) · mean of (Y - X) over those asked in h

Given the exact answers, those asked in a stratum are a simple random sample of it (of the first so
many indices of independent draws; all of those at a boundary), so the estimate is unbiased if all
of them have an answer. Those without are left out as if they were like the others, which they need
not be (the way to an attractor is longest next to the loss of its stability); the estimates if all
of them were lost, and if all were ok, stand beside. The variance is that of two-phase sampling,
S_Y²/N + Σ (N_h/N)² (1/n_h - 1/N_h) S_D² (Cochran, Sampling Techniques, 1977, 12.2 and 7.2; Särndal,
Swensson and Wretman, 1992, 9.6). The interval joins the terms by the method of variance estimates
recovery (Zou and Donner, Statistics in Medicine 27, 2008, 1693): each enters with its own limits
instead of its standard error, Wilson's of the yield, those of the mid-p value of D = +1 and D = -1.
So fifty boards without a difference do not make the exact circuit's interval ngspice's: the
disagreement may be as large as fifty boards can hide, 5.8 %.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from designer.base.proportion import mid_p, wilson
from designer.dynamics.orbit import OrbitStatus
from designer.spice.read_orbit import STROBE_TOLERANCE
from designer.verdicts.cross_check import (
    BOUNDARY_SAMPLES,
    SLOW,
    CrossCheck,
    StartKind,
    Why,
    margin_share,
)
from designer.verdicts.verdict import Answer, Question, Verdict


class Explanation(StrEnum):
    """Why two engines differ on a board, where a margin or another run of ngspice shows it.

    That a board is slow or its period long shows nothing: such boards can differ for any reason.
    """

    GRAZING = "grazing margin"
    BASIN = "another attractor from the nominal orbit"
    CLIPPED = "clipped"
    NONE = "unexplained"


@dataclass(frozen=True)
class Disagreement:
    """One board on which ngspice shows another response than the exact circuit."""

    sample: int
    """Number of the board."""
    kind: StartKind
    """Where the board was started."""
    why: Why
    """Why the board was asked about."""
    exact: str
    """n-p-q or status on the exact circuit."""
    ngspice: str
    """n-p-q or status in ngspice."""
    distance: float
    """How far the board is from losing the response (``cross_check.margin_share``)."""
    explanation: Explanation
    """What explains the difference."""


@dataclass(frozen=True)
class Rate:
    """A share of boards."""

    count: int
    """Boards that have the property."""
    of: int
    """Boards in all."""

    @property
    def interval(self) -> tuple[float, float]:
        return wilson(float(self.count), self.of)


@dataclass(frozen=True)
class Stratum:
    """A part of the boards, of which ngspice was asked about some."""

    name: str
    samples: int
    """Boards in the stratum, N_h."""
    asked: int
    """Boards in the stratum with an answer of ngspice, n_h."""
    gained: int
    """How many of the boards ``asked`` only ngspice calls ok."""
    lost: int
    """How many of the boards ``asked`` only the exact circuit calls ok."""
    could_gain: int
    """Boards in the stratum that the exact circuit does not call ok."""
    could_lose: int
    """Boards in the stratum that the exact circuit calls ok."""


@dataclass(frozen=True)
class Combined:
    """The yield by both engines."""

    estimate: float
    """Estimate of the yield."""
    low: float
    """Lower end of its 95 % interval."""
    high: float
    """Upper end of its 95 % interval."""
    disagreement: Rate
    """Share of boards with another n-p-q, on the random subset from the nominal orbit."""
    undecided: int
    """Boards that were asked and have no answer."""
    if_lost: float
    """The estimate if ngspice lost all undecided boards."""
    if_ok: float
    """The estimate if ngspice called all undecided boards ok."""
    strata: tuple[Stratum, ...]
    """The strata that it was estimated from."""
    differences: tuple[Disagreement, ...]
    """Boards on which the engines differ."""

    @property
    def width(self) -> float:
        return self.high - self.low


def combine(
    answers: Sequence[Answer],
    checks: Sequence[CrossCheck],
    question: Question,
    *,
    census: bool = False,
) -> Combined | None:
    """Both engines on one question; None where ngspice has no answer from the nominal orbit.

    answers, checks : of this question, by sample. census : whether these are all the boards there
    are; what ngspice was not asked is then all that is uncertain.
    """
    mine = {a.sample: a for a in answers if a.verdict is not Verdict.FAILED}
    nominal = [c for c in checks if c.kind is StartKind.NOMINAL and c.sample in mine]
    survives = {c.sample: c.survives(question) for c in nominal}
    in_ngspice = {sample: ok for sample, ok in survives.items() if ok is not None}
    if not in_ngspice:
        return None
    ok = sum(a.verdict is Verdict.OK for a in mine.values())
    undecided = [sample for sample, answer in survives.items() if answer is None]

    def strata_of(in_ngspice: dict[int, bool]) -> list[Stratum]:
        return _strata(list(mine.values()), in_ngspice, checks, question)

    def estimate_if(verdict: bool) -> float:
        return interval(ok, strata_of({**in_ngspice, **dict.fromkeys(undecided, verdict)}))[0]

    strata = tuple(strata_of(in_ngspice))
    estimate, low, high = interval(ok, strata, census)
    random = [c for c in nominal if c.why in (Why.RANDOM, Why.ALL)]
    agreed = [c.agrees(mine[c.sample]) for c in random]
    return Combined(
        estimate,
        low,
        high,
        Rate(sum(a is False for a in agreed), sum(a is not None for a in agreed)),
        len(undecided),
        estimate_if(False),
        estimate_if(True),
        strata,
        tuple(differences(answers, checks, question)),
    )


def interval(
    ok: int, strata: Sequence[Stratum], census: bool = False
) -> tuple[float, float, float]:
    """Estimate and 95 % limits, from ``ok`` boards on the exact circuit and the strata. census :
    the boards are no sample of others."""
    total = sum(s.samples for s in strata)
    estimate = ok / total
    below = above = 0.0
    for s in strata:
        share = s.samples / total
        estimate += share * (s.gained - s.lost) / s.asked
        gain_below, gain_above = _off(s.gained, s.could_gain, s)
        loss_below, loss_above = _off(s.lost, s.could_lose, s)
        below += share**2 * (gain_below**2 + loss_above**2)
        above += share**2 * (gain_above**2 + loss_below**2)
    estimate = min(max(estimate, 0.0), 1.0)
    low, high = (estimate, estimate) if census else wilson(estimate * total, total)
    return (
        estimate,
        max(estimate - math.sqrt((estimate - low) ** 2 + below), 0.0),
        min(estimate + math.sqrt((high - estimate) ** 2 + above), 1.0),
    )


def _off(count: int, could: int, stratum: Stratum) -> tuple[float, float]:
    """How far below and above its estimate a rate of differences may be in its stratum.

    could : boards of the stratum that could differ this way: only an ok one can be lost.
    """
    if stratum.asked == stratum.samples:
        return 0.0, 0.0
    rate = count / stratum.asked
    low, high = mid_p(count, stratum.asked)
    high = max(min(high, could / stratum.samples), rate)
    # Of a finite number of boards; what was asked is no longer uncertain.
    finite = math.sqrt(1.0 - stratum.asked / stratum.samples)
    return finite * (rate - low), finite * (high - rate)


def _strata(
    answers: Sequence[Answer],
    in_ngspice: dict[int, bool],
    checks: Iterable[CrossCheck],
    question: Question,
) -> list[Stratum]:
    """Boundary, slow, rest; one without an answer goes with the rest, the rest with another."""
    near = set[int]()
    if any(c.why is Why.BOUNDARY for c in checks):
        far = sorted((margin_share(a, question.start), a.sample) for a in answers)
        near = {sample for d, sample in far[:BOUNDARY_SAMPLES] if d < math.inf}
    groups: dict[str, list[Answer]] = {"boundary": [], "slow": [], "rest": []}
    for a in answers:
        name = "boundary" if a.sample in near else "slow" if a.radius > SLOW else "rest"
        groups[name].append(a)
    spoken = [n for n, group in groups.items() if any(a.sample in in_ngspice for a in group)]
    home = next(name for name in ("rest", "slow", "boundary") if name in spoken)
    for name, group in groups.items():
        if name not in spoken:
            groups[home] = groups[home] + group
    return [_stratum(name, groups[name], in_ngspice) for name in groups if name in spoken]


def _stratum(name: str, answers: Sequence[Answer], in_ngspice: dict[int, bool]) -> Stratum:
    ok = {a.sample: a.verdict is Verdict.OK for a in answers}
    samples = [sample for sample in ok if sample in in_ngspice]
    return Stratum(
        name,
        len(ok),
        len(samples),
        sum(in_ngspice[s] and not ok[s] for s in samples),
        sum(ok[s] and not in_ngspice[s] for s in samples),
        sum(not o for o in ok.values()),
        sum(ok.values()),
    )


def differences(
    answers: Sequence[Answer], checks: Sequence[CrossCheck], question: Question
) -> list[Disagreement]:
    """Every board on which ngspice shows another n-p-q, or two others at two step sizes, with what
    explains it, if anything does."""
    answer_of = {a.sample: a for a in answers}
    stayed = {
        c.sample
        for c in checks
        if c.kind is StartKind.OWN and c.sample in answer_of and c.agrees(answer_of[c.sample])
    }
    return [
        Disagreement(
            c.sample,
            c.kind,
            c.why,
            answer_of[c.sample].response,
            c.either or c.response,
            margin_share(answer_of[c.sample], question.start),
            _explain(answer_of[c.sample], c, question, c.sample in stayed),
        )
        for c in checks
        if c.sample in answer_of and c.agrees(answer_of[c.sample]) is False
    ]


def _explain(answer: Answer, check: CrossCheck, question: Question, stayed: bool) -> Explanation:
    """The first that applies: what ngspice cannot resolve comes before what is only unlikely."""
    extremes = question.start.extremes
    peak = float(np.abs(extremes[0]).max()) if len(extremes) else math.nan
    grazes = OrbitStatus.GRAZING in (answer.response, check.response)
    if grazes or min(answer.penetration, answer.miss) < STROBE_TOLERANCE * peak:
        return Explanation.GRAZING
    if OrbitStatus.CLIPPED in (answer.response, check.response):
        return Explanation.CLIPPED
    if check.kind is StartKind.NOMINAL and stayed:
        return Explanation.BASIN
    return Explanation.NONE
