"""Boards of one response that are drawn as points of a cube, and what they show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import BRIEF, Ensemble
from designer.dynamics.orbit import WITHOUT_PERIOD, Orbit, OrbitStatus
from designer.spread.board_quantities import between
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import Question, StudyPlan, Verdict
from designer.yields.stored_parts import AnswerLog

BLOCK = 500
"""Boards at a time."""
SCOUTED = 40_000
"""Steps that a board may take which only says where to draw."""
SURE = 4
"""Of boards that show no period briefly and were drawn where they are lost, one of so many is asked
until it is known; the others count as lost, less what these say."""
TRIED = 64
"""Boards as they are that say whether answers come quickly."""
OTHER = "no n-p-q"
"""The kind of loss of all boards that neither clip nor have an n-p-q."""


@dataclass(frozen=True)
class Sample:
    """Boards that were asked. points : (N, coordinates). responses : of each what it shows."""

    points: Array
    component: Index
    lost: Mask
    unanswered: Mask
    responses: tuple[str, ...]
    stands: Array
    """(N,) for how many boards of brief answers each stands, itself one of them; 0 of one that was
    asked briefly and is taken for lost."""

    def first(self, count: int) -> Sample:
        """So many of them."""
        return Sample(*(getattr(self, each.name)[:count] for each in fields(self)))

    def joined(self, other: Sample) -> Sample:
        """Both samples, one after the other."""
        return Sample(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.component, other.component]),
            np.concatenate([self.lost, other.lost]),
            np.concatenate([self.unanswered, other.unanswered]),
            (*self.responses, *other.responses),
            np.concatenate([self.stands, other.stands]),
        )


@dataclass(frozen=True)
class Drawing:
    """What draws boards of one question and asks them. Boards are given by points (N, coordinates)
    of the cube; wide : (N,) by how much more off than they may be, None for not at all."""

    plan: StudyPlan
    question: Question
    jobs: int
    progress: Callable[[], None]
    log: AnswerLog
    """Has what was answered before an interruption."""

    @property
    def names(self) -> tuple[str, ...]:
        return self.plan.spread.coordinates(self.plan.circuit)

    @cached_property
    def quick(self) -> bool:
        """Whether the compiled way answers for boards as they are."""
        if not self.question.excitation.drive.is_sine:
            return False
        ensemble = Ensemble(self.plan.boards(range(TRIED)), jobs=self.jobs)
        open_ = sum(orbit is None for orbit in self._quickly(ensemble))
        return ensemble.compiled and open_ <= 1

    @property
    def within(self) -> int:
        """Steps that a scouted board may take: chaos that is wanted has to be known for it."""
        return SCOUTED if self.question.periodic else BRIEF

    def _quickly(self, ensemble: Ensemble) -> list[Orbit | None]:
        """What the compiled way says of these boards, None where it leaves it open."""
        count, q = len(ensemble), self.question
        starts = np.tile(q.start.start, (count, 1))
        orbits = ensemble.quick(range(count), [q.excitation.drive] * count, starts, jobs=self.jobs)
        for _ in orbits:
            self.progress()
        return orbits

    def boards(self, points: Array, wide: Array | None = None) -> Boards:
        boards = self.plan.modelled(self.plan.spread.from_cube(self.plan.circuit, points))
        return boards if wide is None else between(boards, wide)

    def asked(
        self, points: Array, wide: Array | None = None, *, within: int | None = None
    ) -> list[tuple[Verdict, str]]:
        """The verdict of each board and what it shows. within : as of ``Ensemble.respond``."""

        def ask() -> list[str]:
            answers = self._verdicts(self.boards(points, wide), within)
            return [f"{verdict} {response}" for verdict, response in answers]

        lines = self._known(("asked", within), points, wide, ask)
        pairs = (line.partition(" ") for line in lines)
        return [(Verdict(verdict), response) for verdict, _, response in pairs]

    def foretold(self, points: Array, wide: Array, *, whole: bool) -> list[str]:
        """The kind of loss of each board, "" where it is fine. whole : whether boards are asked
        that the compiled way leaves open; they count as fine otherwise."""

        def ask() -> list[str]:
            return self._kinds(self.boards(points, wide), whole=whole)

        return self._known(("foretold", whole), points, wide, ask)

    def _known(
        self, how: object, points: Array, wide: Array | None, ask: Callable[[], list[str]]
    ) -> list[str]:
        question = [repr(how).encode("ascii"), points.tobytes()]
        question += [] if wide is None else [wide.tobytes()]
        return self.log.answer(b"".join(question), len(points), ask)

    def _verdicts(self, boards: Boards, within: int | None) -> list[tuple[Verdict, str]]:
        q = self.question
        out: list[tuple[Verdict, str]] = []
        for first in range(0, len(boards), BLOCK):
            some = range(first, min(first + BLOCK, len(boards)))
            ensemble = Ensemble(boards.take(np.array(some)), jobs=self.jobs)
            cases: list[Case] = [(i, q, q.excitation, q.start.start) for i in range(len(some))]
            rows = settled(ensemble, cases, self.jobs, self.progress, within=within)
            out += [(verdict, orbit.response) for orbit, verdict, _ in rows]
        return out

    def _kinds(self, boards: Boards, *, whole: bool) -> list[str]:
        out = [""] * len(boards)
        slow = list(range(len(boards)))
        if self.quick:
            orbits = self._quickly(Ensemble(boards, jobs=self.jobs))
            slow = [k for k, orbit in enumerate(orbits) if orbit is None]
            for k, orbit in enumerate(orbits):
                if orbit is not None and self.question.judge(orbit)[0] is not Verdict.OK:
                    out[k] = kind_of(orbit.response)
        if slow and (whole or not self.quick):
            asked = self._verdicts(boards.take(np.array(slow)), self.within)
            for k, (verdict, response) in zip(slow, asked, strict=True):
                out[k] = "" if verdict is Verdict.OK else kind_of(response)
        return out

    def scouted(self, points: Array, component: Index, wide: Array | None = None) -> Sample:
        """These boards asked briefly, which is enough to find where to draw: one that takes long to
        settle is lost here."""
        verdicts = self.asked(points, wide, within=self.within)
        lost = np.array([v is not Verdict.OK for v, _ in verdicts], dtype=bool)
        responses, alone = tuple(response for _, response in verdicts), np.ones(len(points))
        return Sample(points, component, lost, np.zeros_like(lost), responses, alone)

    def lost_first(self, points: Array, wide: Array | None, count: int) -> Mask:
        """(rows, count) which boards are lost, of rows of so many one after the other, up to the
        first of each row: one that takes long is asked until that is known."""
        brief = self.asked(points, wide, within=self.within)
        lost = np.array([v is not Verdict.OK for v, _ in brief], dtype=bool)
        slow = lost & np.array([_is_open(*answer) for answer in brief], dtype=bool)
        each = lost.reshape(-1, count)  # the same memory
        while True:
            first = np.arange(len(each)) * count + each.argmax(axis=1)
            if not (on := first[slow[first]]).size:
                return each
            found = self.asked(points[on], None if wide is None else wide[on])
            lost[on] = [v not in (Verdict.OK, Verdict.FAILED) for v, _ in found]
            slow[on] = False

    def sample(self, points: Array, component: Index, rng: np.random.Generator) -> Sample:
        """These boards asked. Where a period is wanted, a board that shows none briefly hardly ever
        comes to it, and to know that takes long: of those that are no plain ones one of ``SURE`` is
        asked on (double sampling: J. Neyman, J. Am. Stat. Assoc. 33, 1938, 101)."""
        brief = self.question.periodic
        found = self.asked(points, within=self.within if brief else None)
        open_ = np.array([_is_open(*answer) for answer in found], dtype=bool)
        open_ &= brief
        stands = np.where(open_ & (component > 0), float(SURE), 1.0)
        on = open_ & (rng.random(len(points)) * stands < 1.0)
        if on.any():
            for k, answer in zip(np.flatnonzero(on), self.asked(points[on]), strict=True):
                found[k] = answer
        stands[open_ & ~on] = 0.0
        failed = np.array([v is Verdict.FAILED for v, _ in found], dtype=bool) & (stands > 0.0)
        fine = np.array([v is Verdict.OK for v, _ in found], dtype=bool)
        responses = tuple(response for _, response in found)
        return Sample(points, component, ~fine & ~failed, failed, responses, stands)


def _is_open(verdict: Verdict, response: str) -> bool:
    """Whether a brief answer may be another one once the board has settled."""
    return verdict is Verdict.FAILED or response in WITHOUT_PERIOD


def kind_of(shown: str) -> str:
    """The kind of loss of a board that shows this."""
    named = shown == OrbitStatus.CLIPPED or shown[:1].isdigit()
    return shown if named else OTHER
