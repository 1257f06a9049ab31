"""The tolerance study of a design: which responses can be asked, and what became of each board."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from designer import confirmation, montecarlo, pipeline
from designer.blocks import BlockStore
from designer.orbit import OrbitStatus
from designer.pipeline import Checked
from designer.preconditions import at_least, cores, need_responses
from designer.progress import Progress
from designer.verdict import Answer, StudyPlan, Yield, count
from designer.workers import SpicePool

if TYPE_CHECKING:
    from designer.api import Synthesis

SAMPLES = 200
SEED = 1


@dataclass(frozen=True)
class Study:
    """A tolerance study of the responses in ``checked``.

    asked : for each question of the plan, the index of its response. left_out : why a response
    is no question, by index.
    """

    checked: tuple[Checked, ...]
    plan: StudyPlan
    asked: tuple[int, ...]
    left_out: dict[int, str]
    answers: tuple[Answer, ...]

    def answers_to(self, index: int) -> tuple[Answer, ...]:
        """The answers for response number ``index``, by sample."""
        if index not in self.asked:
            return ()
        question = self.asked.index(index)
        return tuple(a for a in self.answers if a.question == question)

    @property
    def yields(self) -> tuple[Yield | None, ...]:
        """For each response; None where it was left out."""
        return tuple(
            count(self.answers_to(i)) if i in self.asked else None for i in range(len(self.checked))
        )


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
    seed: int = SEED,
    jobs: int | None = None,
    pool: SpicePool | None = None,
    checked: tuple[Checked, ...] | None = None,
    store: Callable[[StudyPlan], BlockStore] | None = None,
    progress: Progress | None = None,
) -> Study:
    """How many boards out of ``samples`` show each response, under ``bench-1``.

    checked : of the same design, to save the time of the gate. pool : where ngspice runs; without
    one ngspice is not asked. store : where blocks are read from and written to.
    """
    need_responses(synthesis.modelfile)
    said = Progress() if progress is None else progress
    jobs = cores() if jobs is None else jobs
    at_least("--samples", samples, 1)
    at_least("--seed", seed, 0)
    at_least("--jobs", jobs, 1)
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
    blocks = None if store is None else store(plan)
    answers: list[Answer] = []
    steps = samples * len(asked)
    if pool is not None:
        heard = min(samples, confirmation.OWN_SAMPLES) + min(samples, confirmation.NOMINAL_SAMPLES)
        steps += heard * sum(q.settings is not None for q in plan.questions)
    step = said.stage(f"tolerance study, {samples} boards, responses: {len(asked)}", steps)
    for block in plan.blocks() if asked else ():
        known = None if blocks is None else blocks.read(block)
        if known is None:
            known = montecarlo.run_block(plan, block, pool, jobs, step)
            if blocks is not None:
                blocks.write(block, known)
        else:
            for answer in known:
                step()
                for said_ in (answer.ngspice, answer.ngspice_nominal):
                    if said_:
                        step()
        answers += known
    return Study(checked, plan, asked, left_out, tuple(answers))


def _why_not(checked: Checked) -> str:
    """Why a response cannot be a question of a study; "" where it can."""
    if not checked.model.found:
        return "the model does not show it"
    if checked.circuit.status is not OrbitStatus.PERIODIC:
        return f"the nominal circuit is {checked.circuit.response}"
    return ""
