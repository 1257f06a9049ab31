"""The tolerance study of a design: which responses can be asked, and what became of each board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Literal

from designer import combined, hearing, layers, pipeline
from designer.blocks import BlockStore
from designer.combined import Combined
from designer.hearing import NOMINAL_SAMPLES, Ask, Hearing
from designer.layers import Runner
from designer.orbit import OrbitStatus
from designer.pipeline import Checked
from designer.preconditions import at_least, cores, need_responses
from designer.progress import Progress
from designer.verdict import BLOCK, Answer, StudyPlan, Yield, all_on_one, count
from designer.workers import SpicePool

if TYPE_CHECKING:
    from designer.api import Synthesis

SAMPLES = 200
SEED = 1
MOST_UNTIL = 100_000
"""Samples at which a study that grows until its intervals are narrow gives up."""
MOST_NOMINAL = 1000
"""Boards of each response that ngspice starts from the nominal orbit in such a study, at most."""
MORE_NOMINAL = 50
"""By how many their number grows."""

RungName = Literal["exact", "auto", "ngspice"]
RUNGS: tuple[RungName, ...] = ("exact", "auto", "ngspice")


@dataclass(frozen=True)
class Scope:
    """What a study is to hold.

    samples : at least. until : width of the 95 % intervals at which it stops growing; None: it does
    not grow. rung : ``exact`` asks no ngspice, ``auto`` as ``designer.hearing`` says, ``ngspice``
    about every board.
    """

    samples: int = SAMPLES
    until: float | None = None
    rung: RungName = "auto"


class Stores:
    """Where the layers of a study are kept; this one keeps nothing."""

    def samples(self, plan: StudyPlan) -> BlockStore[Answer] | None:
        return None

    def ngspice(self, plan: StudyPlan) -> BlockStore[Hearing] | None:
        return None


@dataclass(frozen=True)
class Study:
    """A tolerance study of the responses in ``checked``.

    asked : for each question of the plan, the index of its response. left_out : why a response
    is no question, by index. heard : what ngspice said. until : the width that was asked for;
    narrow : whether every interval is narrower (None where no width was asked for).
    """

    checked: tuple[Checked, ...]
    plan: StudyPlan
    asked: tuple[int, ...]
    left_out: dict[int, str]
    answers: tuple[Answer, ...]
    heard: tuple[Hearing, ...] = ()
    until: float | None = None
    narrow: bool | None = None

    def answers_to(self, index: int) -> tuple[Answer, ...]:
        """The answers for response number ``index``, by sample."""
        return self._answers.get(index, ())

    def heard_of(self, index: int) -> tuple[Hearing, ...]:
        """What ngspice said about response number ``index``, by sample."""
        return tuple(h for h in self.heard if self.asked[h.question] == index)

    @property
    def yields(self) -> tuple[Yield | None, ...]:
        """For each response; None where it was left out."""
        return tuple(
            count(self.answers_to(i)) if i in self.asked else None for i in range(len(self.checked))
        )

    @cached_property
    def combined(self) -> tuple[Combined | None, ...]:
        """For each response: both engines together; None where ngspice has no answer."""
        return tuple(
            combined.combine(
                self.answers_to(i), self.heard_of(i), self.plan.questions[self.asked.index(i)]
            )
            if i in self.asked
            else None
            for i in range(len(self.checked))
        )

    @property
    def all_on_one_board(self) -> Yield | None:
        """Boards that show every response; None unless each of at least two was asked."""
        if len(self.asked) < len(self.checked):
            return None
        return all_on_one(((a.sample, a.verdict) for a in self.answers), len(self.asked))

    @cached_property
    def _answers(self) -> dict[int, tuple[Answer, ...]]:
        by: dict[int, list[Answer]] = {index: [] for index in self.asked}
        for a in self.answers:
            by[self.asked[a.question]].append(a)
        return {index: tuple(rows) for index, rows in by.items()}


def check(
    synthesis: Synthesis, pool: SpicePool | None, progress: Progress | None = None
) -> tuple[Checked, ...]:
    """Every response of a design on the exact circuit and, with a pool, in ngspice."""
    said = Progress() if progress is None else progress

    def stage(text: str) -> None:
        said.stage(text)

    return pipeline.check(synthesis.design, synthesis.found, pool, stage)


def tolerance(
    synthesis: Synthesis,
    *,
    samples: int = SAMPLES,
    until: float | None = None,
    rung: RungName = "auto",
    seed: int = SEED,
    jobs: int | None = None,
    pool: SpicePool | None = None,
    checked: tuple[Checked, ...] | None = None,
    stores: Stores | None = None,
    runner: Runner | None = None,
    progress: Progress | None = None,
) -> Study:
    """How many boards show each response, under the spread of the model file.

    samples, until, rung : as `Scope`. checked : of the same design, to save the time of the gate.
    pool : where ngspice runs; without one ngspice is not asked. stores : where rows are read from
    and written to. runner : who computes blocks; this process if None.
    """
    need_responses(synthesis.modelfile)
    said = Progress() if progress is None else progress
    jobs = cores() if jobs is None else jobs
    at_least("--samples", samples, 1)
    at_least("--seed", seed, 0)
    at_least("--jobs", jobs, 1)
    pool = None if rung == "exact" else pool
    checked = check(synthesis, pool, said) if checked is None else checked
    left_out = {i: why for i, c in enumerate(checked) if (why := _why_not(c))}
    asked = tuple(i for i in range(len(checked)) if i not in left_out)
    plan = pipeline.plan_study(
        synthesis.modelfile,
        synthesis.design,
        [checked[i] for i in asked],
        synthesis.catalog,
        samples=samples,
        seed=seed,
    )
    study = Study(checked, plan, asked, left_out, (), until=until)
    if not asked:
        return study
    work = _Work(
        jobs,
        pool,
        Stores() if stores is None else stores,
        layers.Here(jobs) if runner is None else runner,
        said,
        rung,
    )
    return work.grown(study) if until is not None else work.made(study)


@dataclass(frozen=True)
class _Work:
    """Who does the work of a study, and where it goes."""

    jobs: int
    pool: SpicePool | None
    stores: Stores
    runner: Runner
    said: Progress
    rung: RungName

    def made(self, study: Study) -> Study:
        """A study of the plan's samples."""
        return self._all_heard(self._sampled(study, study.plan.samples), NOMINAL_SAMPLES)

    def grown(self, study: Study) -> Study:
        """A study of as many samples as it takes; it stops at edges of blocks only."""
        until = study.until
        assert until is not None
        samples = -(-study.plan.samples // BLOCK) * BLOCK
        nominal = NOMINAL_SAMPLES
        study = self._sampled(study, samples)
        while True:
            asks = self._random(study, nominal)
            study = replace(study, heard=self._heard(study, asks, last=False))
            wide = _widths(study)
            if max(wide) < until:
                break
            # Exact samples narrow the first part of an interval, boards in ngspice the second.
            exact = max(high - low for low, high in (y.interval for y in study.yields if y))
            spoken = self.pool is not None and self.rung == "auto"
            if exact >= 0.7 * until and samples < MOST_UNTIL:
                samples = min(samples + BLOCK, MOST_UNTIL)
                study = self._sampled(study, samples)
            elif spoken and nominal < min(MOST_NOMINAL, samples):
                nominal += MORE_NOMINAL
            elif samples < MOST_UNTIL and exact >= until:
                samples = min(samples + BLOCK, MOST_UNTIL)
                study = self._sampled(study, samples)
            else:
                break
        study = self._all_heard(study, nominal)
        narrow = max(_widths(study)) < until
        if not narrow:
            self.said.note(
                f"the intervals are still wider than {until:g}: a study grows to "
                f"{MOST_UNTIL} samples at most, and to {MOST_NOMINAL} boards in ngspice"
            )
        return replace(study, narrow=narrow)

    def _sampled(self, study: Study, samples: int) -> Study:
        """With the answers of so many samples; those that it has are at an edge of a block."""
        plan = replace(study.plan, samples=samples)
        first = len(study.answers) // len(plan.questions)
        steps = (samples - first) * len(plan.questions)
        step = self.said.stage(
            f"tolerance study, {samples} boards, responses: {len(plan.questions)}", steps
        )
        rows = layers.fill(
            plan,
            self.stores.samples(plan),
            BLOCK,
            partial(layers.Samples, plan),
            self.runner,
            step,
            first,
        )
        return replace(study, plan=plan, answers=(*study.answers, *rows))

    def _random(self, study: Study, nominal: int) -> list[Ask]:
        if self.rung == "ngspice":
            return hearing.ask_all(study.answers)
        return hearing.ask_random(study.answers, nominal)

    def _all_heard(self, study: Study, nominal: int) -> Study:
        """With the boards at a boundary, which are known only once there is no more sample."""
        asks = self._random(study, nominal)
        if self.rung == "auto":
            asks += hearing.ask_boundary(study.answers, study.plan.questions, asks)
        return replace(study, heard=self._heard(study, asks))

    def _heard(
        self, study: Study, asks: Sequence[Ask], *, last: bool = True
    ) -> tuple[Hearing, ...]:
        plan = study.plan
        asks = [a for a in asks if plan.questions[a.question].settings is not None]
        if self.pool is None or not asks:
            return ()
        step = self.said.stage(f"ngspice, {len(asks)} runs", len(asks))
        store = self.stores.ngspice(plan)
        return tuple(
            layers.listen(
                plan, asks, store, self.pool, self.jobs, step, known=study.heard, last=last
            )
        )


def _widths(study: Study) -> list[float]:
    """Of each response's interval, the combined one where there is one."""
    both = [
        (c.low, c.high) if c is not None else y.interval
        for c, y in zip(study.combined, study.yields, strict=True)
        if y is not None
    ]
    return [high - low for low, high in both]


def _why_not(checked: Checked) -> str:
    """Why a response cannot be a question of a study; "" where it can."""
    if not checked.model.found:
        return "the model does not show it"
    if checked.circuit.status is not OrbitStatus.PERIODIC:
        return f"the nominal circuit is {checked.circuit.response}"
    return ""


__all__ = (
    "RUNGS",
    "SAMPLES",
    "SEED",
    "RungName",
    "Scope",
    "Stores",
    "Study",
    "check",
    "tolerance",
)
