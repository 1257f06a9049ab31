"""What a tolerance study asks of each board."""

from __future__ import annotations

from collections.abc import Sequence

from designer.base.reason import Reason
from designer.catalog.catalog import Catalog
from designer.check.checked_design import CheckedResponse
from designer.check.trust import Trust
from designer.circuit.design import Design
from designer.model.model_file import ModelFile
from designer.spread.part_rules import spread_of
from designer.yields.verdict import Answer, Question, StudyPlan, Yield, count


def plan_study(
    modelfile: ModelFile,
    design: Design,
    checked: Sequence[CheckedResponse],
    catalog: Catalog,
    *,
    samples: int,
    seed: int,
) -> StudyPlan:
    """The Monte Carlo study of these responses, boards as the model file says.

    Every one of ``checked`` is a question; who calls leaves out what the nominal circuit does not
    show periodically (``study.tolerance``), since there is no nominal orbit to start from.
    """
    return StudyPlan(
        circuit=design.circuit,
        spread=spread_of(modelfile, design.circuit, catalog),
        seed=seed,
        samples=samples,
        questions=tuple(
            Question(
                c.model.spec,
                c.excitation,
                c.circuit,
                c.gate.settings if c.gate is not None and c.gate.passed else None,
            )
            for c in checked
        ),
    )


def yields(plan: StudyPlan, answers: Sequence[Answer]) -> tuple[Yield, ...]:
    """The yield of each question of the plan."""
    return tuple(count([a for a in answers if a.question == i]) for i in range(len(plan.questions)))


def of_yield(counted: Yield, nominal: Trust) -> Trust:
    """Of a yield: not better than the nominal orbit's that each board starts on, nor with so many
    boards without an answer that they could move it out of its own interval."""
    doubts = [Reason(f"the nominal response: {d.words}", d.figures) for d in nominal.doubts]
    if counted.failed:
        least = counted.ok / counted.samples
        most = (counted.ok + counted.failed) / counted.samples
        low, high = counted.interval
        if counted.failed == counted.samples or least < low or most > high:
            # Counts of boards, which the study's rows have: no measured figures.
            said = (
                f"{counted.failed} of {counted.samples} boards have no answer; whatever they "
                f"were, the yield lies between {100 * least:.3g} and {100 * most:.3g} %"
            )
            doubts.append(Reason(said))
    return Trust(error=nominal.error, doubts=tuple(doubts), answered=True)
