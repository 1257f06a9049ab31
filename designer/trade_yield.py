"""The question of boards: how far the exact circuit's yield is from ngspice's on the same boards.

Boards of the model file's spread, started on the nominal orbit, each by both engines. Where they
differ by D = +1 or -1 a board, the mean of D is the error of the exact circuit's yield. Its 95 %
interval joins the Wilson limits of both shares with their correlation (Zou and Donner, Statistics
in Medicine 27, 2008, 1693): boards without any difference still leave room for one.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

from designer import exact, pipeline
from designer.api import Synthesis
from designer.confirmation import hear
from designer.hearing import Ask, Hearing, Kind, Why
from designer.orbit import OrbitStatus
from designer.pipeline import Checked
from designer.preconditions import cores
from designer.progress import Progress
from designer.proportion import wilson
from designer.verdict import Answer, Question, Verdict
from designer.workers import SpicePool

BOARDS = 100
"""Boards of each response."""


@dataclass(frozen=True)
class BoardTrade:
    """One response on boards that both engines decided.

    gained, lost : boards that only ngspice calls ok, and that only the exact circuit does.
    undecided : boards that one of them has no answer to. periods : drive periods of ngspice for a
    board, mean. seconds : CPU time of a board, by rung.
    """

    omega: float
    expected: str | None
    boards: int
    ok: int
    gained: int
    lost: int
    undecided: int
    periods: float
    seconds: dict[str, float]

    @property
    def difference(self) -> tuple[float, float, float]:
        """Exact circuit's yield less ngspice's, and its 95 % interval."""
        n = self.boards
        if n == 0:
            return math.nan, -1.0, 1.0
        up, down = self.lost / n, self.gained / n
        (up_low, up_high), (down_low, down_high) = wilson(self.lost, n), wilson(self.gained, n)
        # A board counts for one share at most: they go against each other.
        rest = (1.0 - up) * (1.0 - down)
        against = math.sqrt(up * down / rest) if rest > 0.0 else 1.0
        d = up - down
        return (
            d,
            d - _joined(up - up_low, down_high - down, against),
            d + _joined(up_high - up, down - down_low, against),
        )

    @property
    def bound(self) -> float:
        """How large the difference may be."""
        _, low, high = self.difference
        return max(abs(low), abs(high))

    def off(self, bound: float) -> bool:
        """Whether the yields are shown to differ by more than this."""
        _, low, high = self.difference
        return low > bound or high < -bound


def boards(
    made: Synthesis,
    checked: tuple[Checked, ...],
    pool: SpicePool,
    spice_seconds: tuple[float, ...],
    *,
    count: int = BOARDS,
    seed: int = 1,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> tuple[BoardTrade | None, ...]:
    """For each response; None where it can be no question of a study.

    checked : of this design. spice_seconds : CPU time of a drive period of the rung ``ideal`` at
    the gate's settings, by response.
    """
    said = Progress() if progress is None else progress
    jobs = cores() if jobs is None else jobs
    asked = [
        i
        for i, c in enumerate(checked)
        if c.model.found
        and c.circuit.status is OrbitStatus.PERIODIC
        and c.gate is not None
        and c.gate.passed
    ]
    out: list[BoardTrade | None] = [None] * len(checked)
    if not asked:
        return tuple(out)
    plan = pipeline.plan_study(
        made.modelfile,
        made.design,
        [checked[i] for i in asked],
        made.catalog,
        samples=count,
        seed=seed,
    )
    step = said.stage(f"{count} boards, exact circuit", count * len(asked))
    began = time.process_time()
    answers = exact.block(plan, range(count), jobs, step)
    exactly = (time.process_time() - began) / max(len(answers), 1)
    asks = [
        Ask(a.sample, a.question, Kind.NOMINAL, Why.ALL)
        for a in answers
        if a.verdict is not Verdict.FAILED
    ]
    step = said.stage(f"{count} boards, ngspice", len(asks))
    heard = {(h.sample, h.question): h for h in hear(plan, asks, pool, jobs, step)}
    for number, i in enumerate(asked):
        mine = [a for a in answers if a.question == number]
        pairs = [(a, heard.get((a.sample, number))) for a in mine]
        out[i] = _of_one(plan.questions[number], pairs, exactly, spice_seconds[i])
    return tuple(out)


def _joined(a: float, b: float, against: float) -> float:
    return math.sqrt(a * a + b * b + 2.0 * against * a * b)


def _of_one(
    question: Question,
    pairs: list[tuple[Answer, Hearing | None]],
    exactly: float,
    spice: float,
) -> BoardTrade:
    assert question.spec.omega is not None
    expect = question.spec.expect
    both = []
    for answer, hearing in pairs:
        said = None if hearing is None else hearing.survives(question)
        if answer.verdict in (Verdict.OK, Verdict.LOST) and said is not None:
            both.append((answer.verdict is Verdict.OK, said))
    periods = [h.periods + 4 * max(question.start.n, 1) for _, h in pairs if h is not None]
    mean = sum(periods) / len(periods) if periods else math.nan
    return BoardTrade(
        omega=question.spec.omega,
        expected=None if expect is None else str(expect),
        boards=len(both),
        ok=sum(mine for mine, _ in both),
        gained=sum(theirs and not mine for mine, theirs in both),
        lost=sum(mine and not theirs for mine, theirs in both),
        undecided=len(pairs) - len(both),
        periods=mean,
        seconds={"circuit": exactly, "ideal": mean * spice},
    )
