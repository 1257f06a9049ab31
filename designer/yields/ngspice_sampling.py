"""What ngspice said of a sample, and which samples it is asked about.

Two kinds of run (``yields.ngspice_runs`` says how long): on the sample's *own* orbit of the
exact circuit rung ngspice only has to stay there; from the *nominal* design's orbit it finds its
way itself, which makes it a verdict of its own.

Who is asked, for each response: boards are independent draws from (seed, index), so the first
`SUBSET` are a random subset, and the same one however many samples follow. Of it the first are
asked whatever their margins, and the slow ones all, since they are few and differ most. The boards
nearest to losing the response are asked besides, since that is where two engines would differ.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.response_table import Response
from designer.yields.verdict import Answer, Question, Verdict

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
UNDECIDED = "undecided"
"""What is heard where the last two step sizes still say different things."""
OR = " or "
"""Between the two answers of an undecided board."""


class StartKind(StrEnum):
    """Where ngspice started."""

    OWN = "own"
    NOMINAL = "nominal"


class NgspiceVerdict(StrEnum):
    """What became of asking ngspice for the response that the exact rung names."""

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


@dataclass(frozen=True)
class Hearing:
    """What ngspice said about one sample of one response."""

    sample: int
    """Number of the board."""
    question: int
    """Number of the question of the plan."""
    kind: StartKind
    """Where the board was started."""
    why: Why
    """Why the board was asked about."""
    response: str
    """n-p-q or status there, "undecided" where two step sizes differ to the last, "" where the way
    was too long to be asked."""
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

    @property
    def decided(self) -> bool:
        """Whether ngspice gave an answer."""
        return is_answer(self.response)

    def agrees(self, answer: Answer) -> bool | None:
        """Whether ngspice names the response that the exact rung names; None without an answer.
        Two step sizes that name different ones both differ from a third."""
        if self.decided:
            return self.response == answer.response
        said = _both(self.either)
        return False if said and answer.response not in said else None

    def outcome(self, answer: Answer) -> NgspiceVerdict:
        """`FAILED` where there is no answer at all."""
        same = self.agrees(answer)
        if same is None:
            return NgspiceVerdict.UNDECIDED if self.response == UNDECIDED else NgspiceVerdict.FAILED
        return NgspiceVerdict.AGREED if same else NgspiceVerdict.DIFFERED

    def survives(self, question: Question) -> bool | None:
        """Whether the board shows the wanted response in ngspice; None where it does not say."""
        return survives(
            question.spec, question.start, self.response, self.either, symmetric=self.symmetric
        )


def survives(
    spec: Response, nominal: Orbit, response: str, either: str, *, symmetric: bool
) -> bool | None:
    """Whether a response that ngspice named is the wanted one, or the nominal orbit's where none
    is; None without an answer, or where a contact is too near to grazing to be counted. Two step
    sizes that name different ones (``either``) need not name the wanted one: then it is lost."""
    if is_answer(response) and response != OrbitStatus.GRAZING:
        return shows(spec, nominal, response, symmetric=symmetric)
    said = _both(either)
    wanted = any(shows(spec, nominal, one, symmetric=True) for one in said)
    return False if said and not wanted else None


def _both(either: str) -> list[str]:
    """The two answers of an undecided board; none if one of them cannot be counted."""
    said = either.split(OR) if either else []
    return [] if OrbitStatus.GRAZING in said else said


def is_answer(response: str) -> bool:
    """Whether what ngspice said is a response or a status of one: "" is no answer, nor is a run
    that failed or has not settled, or two that differ."""
    return response not in ("", OrbitStatus.FAILED, OrbitStatus.NOT_SETTLED, UNDECIDED)


def shows(spec: Response, nominal: Orbit, response: str, *, symmetric: bool) -> bool:
    """Whether n-p-q as text is the wanted response, or the nominal orbit's where none is."""
    parts = response.split("-")
    if len(parts) != 3 or not all(part.isdigit() for part in parts):
        return False
    n, p, q = (int(part) for part in parts)
    if spec.expect is not None:
        wanted = spec.accepts(n, p, q)
    else:
        wanted = n == nominal.n and {p, q} == {nominal.p, nominal.q}
    return wanted and (symmetric or not spec.symmetric)


def distance(answer: Answer, nominal: Orbit) -> float:
    """How far a board is from the next boundary, by the exact margins: 0 there, 1 as far as the
    nominal board.

    The least of 1 - ρ (the orbit loses its stability), the smallest penetration and the nearest
    miss (an impact goes or comes), each over the nominal board's. inf where there is no orbit, nan
    margins do not count.
    """
    pairs = (
        (1.0 - answer.radius, 1.0 - nominal.radius),
        (answer.penetration, nominal.penetration),
        (answer.miss, nominal.miss),
    )
    shares = [
        mine / theirs
        for mine, theirs in pairs
        if math.isfinite(mine) and math.isfinite(theirs) and theirs > 0.0
    ]
    return max(min(shares, default=math.inf), 0.0)


def ask_random(answers: Iterable[Answer], nominal: int = NOMINAL_SAMPLES) -> list[Ask]:
    """Of the random subset: of the first `OWN_SAMPLES` those with a period from their own orbit,
    the first ``nominal`` from the nominal orbit, and every slow one from there."""
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


def ask_boundary(
    answers: Iterable[Answer], questions: Sequence[Question], known: Iterable[Ask] = ()
) -> list[Ask]:
    """The `BOUNDARY_SAMPLES` boards of each response that are nearest to a boundary, from both
    starts, without what is ``known``."""
    near: list[list[tuple[float, int]]] = [[] for _ in questions]
    for a in answers:
        far = distance(a, questions[a.question].start) if _orbits(a) else math.inf
        if far < math.inf:
            near[a.question].append((far, a.sample))
    have = {(k.sample, k.question, k.kind) for k in known}
    return [
        Ask(sample, question, kind, Why.BOUNDARY)
        for question, boards in enumerate(near)
        for _, sample in sorted(boards)[:BOUNDARY_SAMPLES]
        for kind in StartKind
        if (sample, question, kind) not in have
    ]


def ask_differing(
    answers: Iterable[Answer], heard: Iterable[Hearing], known: Iterable[Ask] = ()
) -> list[Ask]:
    """From its own orbit, every board on which ngspice says another response from the nominal one,
    without what is ``known``: where it stays there, the difference is one of basins."""
    mine = {(a.sample, a.question): a for a in answers}
    have = {(k.sample, k.question, k.kind) for k in known}
    return [
        Ask(h.sample, h.question, StartKind.OWN, Why.DIFFERS)
        for h in heard
        if h.kind is StartKind.NOMINAL
        and (h.sample, h.question, StartKind.OWN) not in have
        and h.agrees(mine[h.sample, h.question]) is False
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
    if answer.sample >= OWN_SAMPLES or answer.response == OrbitStatus.APERIODIC:
        return []
    return [Ask(answer.sample, answer.question, StartKind.OWN, Why.RANDOM)]


def _orbits(answer: Answer) -> bool:
    """Whether the exact rung has an attractor, so that ngspice can be told how long to run."""
    return answer.verdict is not Verdict.FAILED
