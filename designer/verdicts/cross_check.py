"""The cross-check of samples in ngspice: what it answers, and which samples it is asked about.

On a sample's *own* orbit of the exact circuit ngspice only has to stay there; from the *nominal*
design's orbit it finds its way itself, which makes it a verdict of its own. Boards are independent
draws from (seed, index), so the first `SUBSET` are a random subset, and the same one however many
follow. Of it the first are asked, and every slow one, since these are few and differ most, as long
as their ways are not too long together; so are the boards nearest to losing the response.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from designer.check.checked_design import as_named_in_ngspice
from designer.dynamics.counts import MAX_PERIOD, read_counts
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.response_table import Response
from designer.spice.read_orbit import name_in_ngspice
from designer.verdicts.verdict import Answer, Question, Verdict

OWN_SAMPLES = 10
"""Of the first so many samples of each response ngspice starts those with a period from their own
orbit too. A run from the nominal orbit that ends on the exact circuit's response shows that it
stays there: only where it ends elsewhere, or near a boundary, does the own orbit say more."""
NOMINAL_SAMPLES = 50
"""How many it starts from the nominal orbit, at least."""
SLOW = 0.9
"""A multiplier above this makes a sample slow."""
SUBSET = 200
"""Boards of the random subset: the first so many, or those from the nominal orbit where these are
more. Every slow one of it starts from the nominal orbit as well."""
BOUNDARY_SAMPLES = 10
"""How many of the boards that are nearest to a boundary are asked, from both starts."""
UNKNOWN_PERIODS = 20
"""Drive periods for a sample without a period: 64 more follow, in which none must be found."""
MOST_PERIODS, MOST_STEPS = 4000, 1_000_000
"""Longest way to an attractor that ngspice is sent, in drive periods and in its own steps (half a
minute on a circuit of four masses); beyond either a sample is left out by name."""
STEPS_EACH = 200_000
"""Steps of a run from the nominal orbit, on average: where the ways of many boards are longer,
fewer of the random subset are asked."""
UNDECIDED = "undecided"
"""The answer where the last two step sizes give different responses: it is not resolved."""
OR = " or "
"""Between the two answers of an undecided board."""


class StartKind(StrEnum):
    """Where ngspice started."""

    OWN = "own"
    NOMINAL = "nominal"


class NgspiceVerdict(StrEnum):
    """How ngspice's answer compares with the exact circuit's."""

    AGREED = "agreed"
    DIFFERED = "differed"
    UNDECIDED = "undecided"
    FAILED = "failed"


class Why(StrEnum):
    """Why a sample was asked about."""

    RANDOM = "random"
    BOUNDARY = "boundary"
    SLOW = "slow"
    ALL = "all"
    DIFFERS = "differs"


@dataclass(frozen=True)
class Ask:
    """One run that ngspice is to make."""

    sample: int
    """Number of the board."""
    question: int
    """Number of the question of the plan."""
    kind: StartKind
    """Where the board was started."""
    why: Why
    """Why the board was asked about."""

    @property
    def key(self) -> tuple[int, int, str]:
        """Tells this run from all others; the order of rows."""
        return self.sample, self.question, str(self.kind)


@dataclass(frozen=True)
class CrossCheck(Ask):
    """What ngspice answered about one sample of one response."""

    response: str
    """n-p-q or status, "undecided" where the last two step sizes differ, "" where the way was too
    long to be asked."""
    reason: str
    """Why; how long the way was where it was too long."""
    remedies: str
    """Remedies that a run needed to converge, in order."""
    periods: int
    """Drive periods left out before the run was judged."""
    symmetric: bool
    """Whether the run's orbit was symmetric; False too where it has none."""
    either: str = ""
    """The last two answers of an undecided one, with `OR` between them."""
    finer: int = 1
    """The number by which the gate's step was divided in the run that answers: above 1 where the
    answer at that step was not the exact circuit's."""

    def agrees(self, answer: Answer) -> bool | None:
        """Whether ngspice names the response that the exact circuit names; None without an answer,
        or where a contact of a periodic one is too near to grazing for ngspice to count. Two step
        sizes that name different ones both differ from a third."""
        exact = name_in_ngspice(answer.response)
        if self.response == OrbitStatus.GRAZING and read_counts(exact) is not None:
            return None
        if is_answer(self.response):
            return self.response == exact
        both = _both(self.either)
        return False if both and exact not in both else None

    def outcome(self, answer: Answer) -> NgspiceVerdict:
        """`FAILED` where there is no answer at all."""
        same = self.agrees(answer)
        if same is None:
            is_open = self.response in (UNDECIDED, OrbitStatus.GRAZING)
            return NgspiceVerdict.UNDECIDED if is_open else NgspiceVerdict.FAILED
        return NgspiceVerdict.AGREED if same else NgspiceVerdict.DIFFERED

    def survives(self, question: Question) -> bool | None:
        """Whether the board shows the wanted response in ngspice; None without an answer."""
        return survives(question.wanted, self.response, self.either, symmetric=self.symmetric)


def survives(wanted: Response, response: str, either: str, *, symmetric: bool) -> bool | None:
    """Whether a response that ngspice named is the wanted one; None without an answer, or where a
    contact is too near to grazing to be counted.

    Two step sizes that name different ones (``either``) need not name the wanted one: then it is
    lost.
    """
    wanted = as_named_in_ngspice(wanted)
    if is_answer(response) and (response != OrbitStatus.GRAZING or not wanted.periodic):
        return wanted.accepts_text(response, symmetric=symmetric)
    both = _both(either)
    possible = any(wanted.accepts_text(one, symmetric=True) for one in both)
    return False if both and not possible else None


def _both(either: str) -> list[str]:
    """The two answers of an undecided board; none if one of them cannot be counted."""
    answers = either.split(OR) if either else []
    return [] if OrbitStatus.GRAZING in answers else answers


def is_answer(response: str) -> bool:
    """Whether ngspice named a response or a status of one: "" is no answer, nor is a run that
    failed or has not settled, or two that differ."""
    return response not in ("", OrbitStatus.FAILED, OrbitStatus.NOT_SETTLED, UNDECIDED)


def margin_share(answer: Answer, nominal: Orbit) -> float:
    """The margins of a board's own orbit over the nominal board's, the least of them: 0 at the next
    boundary.

    The margins are 1 - ρ (the orbit loses its stability), the least penetration and the nearest
    miss (an impact goes or comes); nan margins do not count. inf without an orbit. It needs no
    other board, unlike the distance in standard deviations of `yields.margins`.
    """
    pairs = (
        (1.0 - answer.radius, 1.0 - nominal.radius),
        (answer.penetration, nominal.penetration),
        (answer.miss, nominal.miss),
    )
    shares = [
        margin / reference
        for margin, reference in pairs
        if math.isfinite(margin) and math.isfinite(reference) and reference > 0.0
    ]
    return max(min(shares, default=math.inf), 0.0)


def ask_random(answers: Iterable[Answer], nominal: int = NOMINAL_SAMPLES) -> list[Ask]:
    """The asks about the random subset: of the first `OWN_SAMPLES` those with a period from their
    own orbit, the first ``nominal`` from the nominal orbit, and every slow one from there."""
    asks = []
    for a in answers:
        if not _orbits(a):
            continue
        asks += _ask_own(a)
        if a.sample < nominal:
            asks.append(Ask(a.sample, a.question, StartKind.NOMINAL, Why.RANDOM))
        elif a.sample < SUBSET and a.radius > SLOW:
            asks.append(Ask(a.sample, a.question, StartKind.NOMINAL, Why.SLOW))
    return asks


def least_way(n: int, radius: float) -> float:
    """Drive periods from the nominal orbit to an attractor of period n, at least: 5n/(1 - ρ),
    rounded up; inf for an unstable one. Without a period, or with one that ngspice does not look
    for, `UNKNOWN_PERIODS`."""
    if not 0 < n <= MAX_PERIOD:
        return UNKNOWN_PERIODS
    return math.ceil(5.0 * n / (1.0 - radius)) if radius < 1.0 else math.inf


def longest_way(question: Question) -> float:
    """Drive periods of the longest way that ngspice is sent."""
    return min(MOST_PERIODS, MOST_STEPS // max(question.steps, 1.0))


def affordable(
    asks: Iterable[Ask],
    answers: Iterable[Answer],
    questions: Sequence[Question],
    boards: int = NOMINAL_SAMPLES,
) -> list[Ask]:
    """The asks that fit a limit of ngspice's steps: of each question together `STEPS_EACH` times
    ``boards`` from the nominal orbit.

    asks : by sample. From a board's own orbit all are kept. From the nominal one none is kept after
    the first that exceeds the limit, however short its way, or too long to be run: so boards that
    are asked are a random part of the slow ones, and of the rest.
    """
    mine = {(a.sample, a.question): a for a in answers}
    left = [float(STEPS_EACH * boards)] * len(questions)
    kept = []
    for ask in asks:
        if ask.kind is StartKind.NOMINAL:
            left[ask.question] -= _steps(mine[ask.sample, ask.question], questions[ask.question])
        if ask.kind is StartKind.OWN or left[ask.question] >= 0.0:
            kept.append(ask)
    return kept


def _steps(answer: Answer, question: Question) -> float:
    """Steps of a board's run from the nominal orbit, at least; 0 where its way is too long."""
    counts = read_counts(name_in_ngspice(answer.response))
    way = least_way(0 if counts is None else counts.n, answer.radius)
    return way * question.steps if way <= longest_way(question) else 0.0


def not_asked(
    wanted: Iterable[Ask], asks: Iterable[Ask], questions: Sequence[Question]
) -> tuple[int, ...]:
    """How many boards of each question were wanted from the nominal orbit and are not asked."""
    have = {a.key for a in asks}
    missing = [a.question for a in wanted if a.key not in have]
    return tuple(missing.count(k) for k in range(len(questions)))


def ask_boundary(
    answers: Iterable[Answer], questions: Sequence[Question], earlier: Iterable[Ask] = ()
) -> list[Ask]:
    """The `BOUNDARY_SAMPLES` boards of each response that are nearest to a boundary, from both
    starts, without the ``earlier`` asks."""
    near: list[list[tuple[float, int]]] = [[] for _ in questions]
    for a in answers:
        far = margin_share(a, questions[a.question].start) if _orbits(a) else math.inf
        if far < math.inf:
            near[a.question].append((far, a.sample))
    have = {k.key for k in earlier}
    return [
        Ask(sample, question, kind, Why.BOUNDARY)
        for question, boards in enumerate(near)
        for _, sample in sorted(boards)[:BOUNDARY_SAMPLES]
        for kind in StartKind
        if (sample, question, kind) not in have
    ]


def ask_differing(
    answers: Iterable[Answer], checks: Iterable[CrossCheck], earlier: Iterable[Ask] = ()
) -> list[Ask]:
    """From its own orbit, every board on which ngspice finds another response from the nominal one,
    without the ``earlier`` asks: where it stays there, the difference is one of basins."""
    mine = {(a.sample, a.question): a for a in answers}
    have = {k.key for k in earlier}
    return [
        Ask(c.sample, c.question, StartKind.OWN, Why.DIFFERS)
        for c in checks
        if c.kind is StartKind.NOMINAL
        and (c.sample, c.question, StartKind.OWN) not in have
        and c.agrees(mine[c.sample, c.question]) is False
    ]


def ask_all(answers: Iterable[Answer]) -> list[Ask]:
    """Every sample from the nominal orbit; of the first `OWN_SAMPLES` those with a period from
    their own too."""
    asks = []
    for a in answers:
        if _orbits(a):
            asks += _ask_own(a)
            asks.append(Ask(a.sample, a.question, StartKind.NOMINAL, Why.ALL))
    return asks


def _ask_own(answer: Answer) -> list[Ask]:
    if answer.sample >= OWN_SAMPLES or name_in_ngspice(answer.response) == OrbitStatus.APERIODIC:
        return []
    return [Ask(answer.sample, answer.question, StartKind.OWN, Why.RANDOM)]


def _orbits(answer: Answer) -> bool:
    """Whether the exact circuit has an attractor, so that ngspice can be told how long to run."""
    return answer.verdict is not Verdict.FAILED
