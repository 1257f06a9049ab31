"""The plan of a study: which boards, and what each is asked."""

from __future__ import annotations

from collections.abc import Sequence

from designer.catalog.parts_catalog import Catalog
from designer.check.checked_design import CheckedResponse
from designer.circuit.design import Design
from designer.model.model_file import ModelFile
from designer.spread.part_rules import spread_of
from designer.verdicts.verdict import Question, StudyPlan


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

    Every one of ``checked`` is a question: leave out those on which the nominal circuit does not
    settle, since there is no nominal orbit to start from.
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
