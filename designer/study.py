"""The tolerance study of a design: which responses can be asked, and what became of each board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from designer import combined, layers, pipeline
from designer.all_on_one import all_on_one
from designer.blame import Blame
from designer.combined import Combined
from designer.gate import GateResult
from designer.hearing import Hearing
from designer.layers import Runner
from designer.orbit import OrbitStatus
from designer.pipeline import Checked
from designer.preconditions import at_least, cores, need_responses
from designer.progress import Progress
from designer.reached import Reached
from designer.recipe import Recipe
from designer.spread import NO_BANDWIDTH
from designer.study_work import RUNGS, RungName, Stores, Work
from designer.trimmer import Trimmed, dc_trim
from designer.tuning import Tuned
from designer.verdict import Answer, StudyPlan, Yield, count
from designer.workers import SpicePool
from designer.yield_maps import Over, YieldMap

if TYPE_CHECKING:
    from designer.api import Synthesis

SAMPLES = 200
SEED = 1


@dataclass(frozen=True)
class Study:
    """A tolerance study of the responses in ``checked``.

    asked : for each question of the plan, the index of its response. left_out : why a response
    is no question, by index. heard : what ngspice said. until : the width that was asked for;
    narrow : whether every interval is narrower (None where no width was asked for). tuned,
    reached : their rows; None where they were not asked for. trimmed : likewise; None where no
    trimmer is fitted. recipes : one for each question.
    blame, maps : by question, where they were asked for.
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
    trimmed: tuple[Trimmed, ...] | None = None
    reached: tuple[Reached, ...] | None = None
    recipes: tuple[Recipe, ...] | None = None
    blame: Blame | None = None
    maps: tuple[YieldMap, ...] = ()

    def answers_to(self, index: int) -> tuple[Answer, ...]:
        """The answers for response number ``index``, by sample."""
        return self._answers.get(index, ())

    def heard_of(self, index: int) -> tuple[Hearing, ...]:
        """What ngspice said about response number ``index``, by sample."""
        return tuple(h for h in self.heard if self.asked[h.question] == index)

    def tuned_of(self, index: int) -> tuple[Tuned, ...]:
        """The rows of the tuned layer of response number ``index``."""
        return tuple(t for t in self.tuned or () if self.asked[t.question] == index)

    def trimmed_of(self, index: int) -> tuple[Trimmed, ...]:
        """The rows of the trimmed layer of response number ``index``."""
        return tuple(t for t in self.trimmed or () if self.asked[t.question] == index)

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
    def all_trimmed(self) -> Yield | None:
        """The same with the trimmer at its one setting, the generator as built."""
        return self._on_one(self.trimmed)

    @property
    def all_reached(self) -> Yield | None:
        """The same from power-up by the recipes."""
        return self._on_one(self.reached)

    def _on_one(self, rows: Sequence[Answer | Tuned | Trimmed | Reached] | None) -> Yield | None:
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
    synthesis: Synthesis,
    pool: SpicePool | None,
    progress: Progress | None = None,
    gates: Sequence[GateResult] | None = None,
) -> tuple[Checked, ...]:
    """Every response of a design on the exact circuit and, with a pool, in ngspice.

    gates : see ``pipeline.check``.
    """
    said = Progress() if progress is None else progress

    def stage(text: str) -> None:
        said.stage(text)

    return pipeline.check(synthesis.design, synthesis.found, pool, stage, gates=gates)


def tolerance(
    synthesis: Synthesis,
    *,
    samples: int = SAMPLES,
    until: float | None = None,
    rung: RungName = "auto",
    tuned: bool = False,
    reached: bool = False,
    blamed: bool = True,
    maps: Sequence[Over] = (),
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
    ``ngspice`` about every board. tuned, reached, blamed : whether these are wanted; a
    fitted trimmer is always asked for.
    maps : settings over which the yield is wanted (``yield_maps.OVERS``).
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
    if plan.spread.gain_bandwidth is not None:
        said.note(f"the spread of the gain-bandwidth {NO_BANDWIDTH}")
    study = Study(checked, plan, asked, left_out, (), until=until)
    if not asked:
        return study
    work = Work(
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
    trim = dc_trim(synthesis)
    if trim is not None:
        study = work.trimmed(study, trim)
    if reached:
        study = work.reached(study)
    if blamed:
        study = work.blamed(study)
    return work.mapped(study, maps) if maps else study


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
