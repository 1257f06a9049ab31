"""Verbs on a design folder that end where their work would begin, when everything is read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import pytest

from designer.check import simulation
from designer.folders import design_files
from designer.folders.design_source import read_design
from designer.jobs import (
    bifurcation_job,
    repair_job,
    rules_job,
    study_stage,
    synthesise_job,
    trade_job,
)
from designer.workbench import record_formats


@contextmanager
def work_stopped(folder: Path) -> Iterator[None]:
    """Inside, the work of a verb on this folder, or on a copy, stops at once, as by Ctrl-C."""

    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    responses = read_design(folder).model_responses
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(design_files, "find", lambda *_: responses)
        patched.setattr(study_stage, "SpicePool", lambda *_, **__: nullcontext())
        patched.setattr(study_stage, "require_ngspice", lambda _: None)
        patched.setattr(study_stage, "checks", stop)
        patched.setattr(rules_job, "checked", stop)
        patched.setattr(simulation, "simulate", stop)
        patched.setattr(bifurcation_job, "_make", stop)
        patched.setattr(repair_job, "find_repair", stop)
        patched.setattr(trade_job, "_document", stop)
        patched.setattr(synthesise_job, "_comparison", stop)
        patched.setattr(record_formats, "read_record", stop)
        patched.setattr("designer.jobs.export_job.kicad_files.texts", stop)
        yield
