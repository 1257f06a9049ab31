"""A report's data with something changed, wherever it stands: in the run, its study or its plan."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache
from typing import Any

from designer.check import checked_design
from designer.report.data import ReportData
from designer.verdicts.exact_circuit import block
from designer.yields.study import RunResult, Study
from designer.yields.study_plan import plan_study
from tests.shared.paper_cases import synthesised


def plain_report() -> ReportData:
    """Two responses of the paper's case, three boards, no layers."""
    return paper_report(0, 2)


@cache
def paper_report(*responses: int) -> ReportData:
    """These responses of the paper's case, all nine where none is named, three boards, no
    layers."""
    made = synthesised()
    design, every = made.design, range(len(made.model_responses))
    found = tuple(made.model_responses[i] for i in responses or every)
    wanted = tuple(made.modelfile.responses[i] for i in responses or every)
    modelfile = replace(made.modelfile, responses=wanted)
    checked = checked_design.check(design, found, None)
    plan = plan_study(modelfile, design, checked, made.catalog, samples=3, seed=1)
    answers = tuple(block(plan, range(3), 2))
    study = Study(checked, plan, tuple(range(len(found))), {}, answers)
    return ReportData(
        RunResult(modelfile, made.catalog, found, design, checked, study, NO_ORIGIN), "designer"
    )


NO_ORIGIN: Any = {}
"""The provenance of a study that is made up."""


def changed(data: ReportData, **changes: Any) -> ReportData:
    """``data`` with these fields of its study, of its run or of its own, or with a made-up
    ``combined`` of its study."""
    combined = changes.pop("combined", None)
    of_study = {f.name for f in fields(Study)}
    of_run = {f.name for f in fields(data.result)}
    study = {name: value for name, value in changes.items() if name in of_study}
    run = {name: value for name, value in changes.items() if name in of_run}
    own = {name: value for name, value in changes.items() if name not in of_study | of_run}
    run.setdefault("study", replace(data.study, **study))
    if combined is not None:
        vars(run["study"])["combined"] = combined
    return replace(data, result=replace(data.result, **run), **own)
