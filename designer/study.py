"""The tolerance study of a design: which responses can be asked, and what became of each board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Literal

from designer import combined, hearing, layers, pipeline
from designer.all_on_one import all_on_one
from designer.bands import Bands
from designer.blocks import BlockStore
from designer.combined import Combined
from designer.hearing import NOMINAL_SAMPLES, Ask, Hearing
from designer.layers import Runner
from designer.orbit import OrbitStatus
from designer.pipeline import Checked
from designer.preconditions import at_least, cores, need_responses
from designer.progress import Progress
from designer.reached import Reached
from designer.recipe import Recipe
from designer.recipe_search import find_recipes
from designer.tuning import Tuned
from designer.verdict import BLOCK, Answer, StudyPlan, Yield, count
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


class Stores:
    """Where the layers of a study are kept; this one keeps nothing."""

    def samples(self, plan: StudyPlan) -> BlockStore[Answer] | None:
        return None

    def ngspice(self, plan: StudyPlan) -> BlockStore[Hearing] | None:
        return None

    def tuned(self, plan: StudyPlan, bands: Bands) -> BlockStore[Tuned] | None:
        return None

    def reached(self, plan: StudyPlan, recipes: Sequence[Recipe]) -> BlockStore[Reached] | None:
        return None


@dataclass(frozen=True)
class Study:
    """A tolerance study of the responses in ``checked``.

    asked : for each question of the plan, the index of its response. left_out : why a response
    is no question, by index. heard : what ngspice said. until : the width that was asked for;
    narrow : whether every interval is narrower (None where no width was asked for). tuned,
    reached : their rows; None where they were not asked for. recipes : one for each question.
    """

    checked: tuple[Checked, ...]
    plan: StudyPlan
    asked: tuple[int, ...]
    left_out: dict[int, str]
    answers: tuple[Answer, ...]
    heard: tuple[Hearing, ...] = ()
    until: float | None = None
    narrow: bool | None = None
    tuned: tuple[Tuned, ...] | None = None
    reached: tuple[Reached, ...] | None = None
    recipes: tuple[Recipe, ...] | None = None

    def answers_to(self, index: int) -> tuple[Answer, ...]:
        """The answers for response number ``index``, by sample."""
        return self._answers.get(index, ())

    def heard_of(self, index: int) -> tuple[Hearing, ...]:
        """What ngspice said about response number ``index``, by sample."""
        return tuple(h for h in self.heard if self.asked[h.question] == index)

    def tuned_of(self, index: int) -> tuple[Tuned, ...]:
        """The rows of the tuned layer of response number ``index``."""
        return tuple(t for t in self.tuned or () if self.asked[t.question] == index)

    def reached_of(self, index: int) -> tuple[Reached, ...]:
        """The rows of the reached layer of response number ``index``."""
        return tuple(r for r in self.reached or () if self.asked[r.question] == index)

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
        """Boards that show every response as built; None unless there are two at least and each
        was asked."""
        return self._on_one(self.answers)

    @property
    def all_tuned(self) -> Yield | None:
        """The same with the generator free within the bands, for each response its own."""
        return self._on_one(self.tuned)

    @property
    def all_reached(self) -> Yield | None:
        """The same from power-up by the recipes."""
        return self._on_one(self.reached)

    def _on_one(self, rows: Sequence[Answer | Tuned | Reached] | None) -> Yield | None:
        if not rows or len(self.asked) < max(len(self.checked), 2):
            return None
        return all_on_one(rows)

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
    tuned: bool = False,
    reached: bool = False,
    seed: int = SEED,
    jobs: int | None = None,
    pool: SpicePool | None = None,
    checked: tuple[Checked, ...] | None = None,
    stores: Stores | None = None,
    runner: Runner | None = None,
    progress: Progress | None = None,
) -> Study:
    """How many boards show each response, under the spread of the model file.

    samples : at least. until : width of the 95 % intervals at which the study stops growing; it
    does not grow if None. rung : ``exact`` asks no ngspice, ``auto`` as ``designer.hearing`` says,
    ``ngspice`` about every board. tuned, reached : whether these layers are wanted.
    checked : of the same design, to save the time of the gate. pool : where ngspice runs; without
    one ngspice is not asked. stores : where rows are read from and written to. runner : who
    computes blocks; this process if None.
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
    study = work.grown(study) if until is not None else work.made(study)
    if tuned:
        study = work.tuned(study, synthesis.modelfile.tuning)
    return work.reached(study) if reached else study


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

    def tuned(self, study: Study, bands: Bands) -> Study:
        """With the generator free within the bands."""
        plan = study.plan
        step = self.said.stage("tuned boards", len(study.answers))
        rows = layers.fill(
            plan,
            self.stores.tuned(plan, bands),
            layers.SEARCH,
            partial(layers.Tunings, plan, study.answers, bands),
            self.runner,
            step,
        )
        return replace(study, tuned=tuple(rows))

    def reached(self, study: Study) -> Study:
        """From power-up, by the recipes that the nominal circuit and a few boards suggest."""
        plan = study.plan
        self.said.stage("start recipes")
        recipes = find_recipes(plan, self.jobs)
        step = self.said.stage("boards from power-up", len(study.answers))
        rows = layers.fill(
            plan,
            self.stores.reached(plan, recipes),
            layers.SEARCH,
            partial(layers.PowerUps, plan, recipes),
            self.runner,
            step,
        )
        return replace(study, reached=tuple(rows), recipes=recipes)

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
    "Stores",
    "Study",
    "check",
    "tolerance",
)
