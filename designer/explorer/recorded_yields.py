"""How many boards keep the responses that a model file wants, as a saved page lists it."""

from __future__ import annotations

from dataclasses import dataclass

from designer.base.errors import DesignerError
from designer.base.progress import Progress
from designer.centering import stage_choice
from designer.check import checked_design
from designer.dynamics.orbit import OrbitStatus
from designer.explorer.wire import Message
from designer.jobs.options import Options
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile
from designer.verdicts import exact_rung
from designer.verdicts.verdict import Answer, StudyPlan
from designer.yields.study import plan_study
from designer.yields.yield_count import Yield, all_on_one, count

PIECE = 10
"""Boards between two steps of the progress."""


@dataclass(frozen=True)
class RecordedYield:
    """What becomes of one wanted response on real parts."""

    omega: float | None
    """Drive frequency in the model's units; None of all responses on one board."""
    summary: str
    """The response in words."""
    words: str
    """How many boards keep it, or what the nominal circuit shows instead."""

    def message(self) -> Message:
        """What the page writes of it."""
        return {"omega": self.omega, "summary": self.summary, "words": self.words}


@dataclass(frozen=True)
class RecordedYields:
    """The yields of a file, or why there are none."""

    words: str
    """On what they stand, or why there are none."""
    rows: tuple[RecordedYield, ...] = ()
    """One for each wanted response, then all of them on one board."""


def yields(modelfile: ModelFile, options: Options, progress: Progress) -> RecordedYields:
    """Parts for all wanted responses of the file, and its yields on the exact circuit."""
    if not modelfile.responses:
        return RecordedYields("the model file wants no response")
    try:
        return _counted(modelfile, options, progress)
    except DesignerError as error:
        return RecordedYields(str(error))


def _counted(modelfile: ModelFile, options: Options, progress: Progress) -> RecordedYields:
    progress.stage("parts for the wanted responses")
    synthesis = stage_choice.synthesise(modelfile, all_found=False, jobs=options.workers)
    design, responses = synthesis.design, synthesis.model_responses
    checked = checked_design.check(design, responses, None)
    asked = [each for each in checked if each.circuit.status is OrbitStatus.PERIODIC]
    studied = modelfile, design, asked, synthesis.catalog
    plan = plan_study(*studied, samples=options.samples, seed=options.seed)
    answers = _answers(plan, options, progress)
    rows = []
    for each in checked:
        words = f"the circuit shows: {each.circuit.response}"
        if each in asked:
            question = asked.index(each)
            words = _words(count(a for a in answers if a.question == question))
        rows.append(RecordedYield(each.model.omega, _summary(each.model), words))
    if len(asked) == len(checked) > 1:
        rows.append(RecordedYield(None, "all of them on one board", _words(all_on_one(answers))))
    words = f"{plan.samples} boards under the spread of the file, seed {plan.seed}"
    return RecordedYields(words, tuple(rows))


def _answers(plan: StudyPlan, options: Options, progress: Progress) -> list[Answer]:
    """Those of every board on the exact circuit."""
    step, answers = progress.stage("boards", plan.samples), []
    for indices in plan.blocks(PIECE) if plan.questions else ():
        answers += exact_rung.block(plan, indices, options.workers)
        for _ in indices:
            step()
    return answers


def _summary(response: ModelResponse) -> str:
    shown = "any response" if response.spec.expect is None else str(response.spec.expect)
    return f"{shown} at {response.spec.place_text(6)}"


def _words(counted: Yield) -> str:
    low, high = counted.interval
    rate = 100.0 * counted.rate
    return f"{rate:.1f} % keep it ({100.0 * low:.1f} to {100.0 * high:.1f} %)"
