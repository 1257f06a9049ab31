"""A report's data with something changed, wherever it stands: in the run, its study or its plan."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from designer.report.data import ReportData
from designer.yields.study import Study


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
