"""A search: design, study of fresh boards, confirmation in ngspice."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from designer.base import progress
from designer.base.defaults import SAMPLES, StudyEngine
from designer.base.design_folder import Folder
from designer.base.manifest import Stages
from designer.base.plain_json import FORMAT, dumps, plain
from designer.catalog.parts_catalog import load_catalog
from designer.centering.limiting_parts import limitings
from designer.centering.ngspice_check import FIDELITY, LEVELS
from designer.centering.result_json import confirmation_json
from designer.check.synthesis_result import Synthesis
from designer.folders import design_files
from designer.folders.design_source import grade_inputs
from designer.folders.model_source import design_inputs_of, source
from designer.folders.origin import provenance
from designer.folders.study_stores import FolderStores
from designer.jobs import fidelity_choice
from designer.jobs.fidelity_choice import LEAST, SEARCH
from designer.jobs.job_outcome import JobOutcome
from designer.jobs.options import Options
from designer.jobs.search_stage import searched_into
from designer.jobs.study_job import run_into
from designer.jobs.study_stage import RANDOM, SPICE_TIMEOUT, StudyHelp, study_of
from designer.model.model_file import ModelFile
from designer.spice.batch_backend import program_version
from designer.spice.pool import SpicePool, require_ngspice
from designer.verdicts import ngspice_runs
from designer.verdicts.cross_check import Ask, StartKind, Why
from designer.verdicts.fidelity_gate import gated
from designer.verdicts.verdict import Answer, Verdict
from designer.yields.layers import LocalRunner
from designer.yields.tolerance_study import check

if TYPE_CHECKING:
    from designer.answers.search_answer import (
        ConfirmationFile,
        ConfirmationRow,
        ConfirmedRow,
        SearchKeys,
    )

CONFIRMATION = "confirmation.json"
DIFFERING = 0.05
"""Share of the confirming boards that may differ, or have no answer."""


def search_into(
    modelfile: ModelFile,
    out: Path,
    options: Options,
    command: Callable[[Options], str],
) -> JobOutcome:
    """Search, study and confirm in the folder ``out``. command : as of ``study_job.run_into``.

    Raises
    ------
    EnvironmentMissing : there is something to confirm and no ngspice; raised before any work.
    """
    need_ngspice(Folder(out), options)
    final = searched_into(modelfile, out, options)
    fidelity = fidelity_choice.for_search(Folder(out), options)
    study = run_into(final, out, replace(options, rung=fidelity), lambda _: command(options))
    confirmed, stood = _confirmed(final, out, options)
    folder = Folder(out)
    search = folder.json(SEARCH)
    for key in ("format", "provenance", "cost"):
        search.pop(key, None)
    answer: SearchKeys = {
        **RANDOM.answer(folder),
        "search": search,
        "confirmation": confirmed,
    }
    for row, other in zip(answer["responses"], confirmed["responses"], strict=True):
        row["limited_by"] = other["limited_by"]
    satisfied = study.satisfied and all_confirmed(confirmed)
    reused = study.reused and stood
    return replace(study, answer=answer, satisfied=satisfied, reused=reused, shown=False)


def need_ngspice(folder: Folder, options: Options) -> None:
    """Refuse a folder whose design is still to be confirmed, or may be made again, without ngspice.

    Raises
    ------
    EnvironmentMissing : it is missing or too old.
    """
    manifest = folder.manifest
    stage = None if manifest is None else manifest.stages.get("confirmation")
    if stage is None or not stage.complete or options.overwrite:
        program_version()


def confirmed_repair(out: Path, options: Options) -> tuple[ConfirmationRow, bool]:
    """How ngspice judges boards of the repaired design in the folder ``out``, as drawn, and what
    limits each response; whether the folder held that already. The boards are of no study of the
    folder, which has none yet."""
    modelfile, _ = source(out, None)
    return _confirmed(modelfile, out, replace(options, samples=SAMPLES), studied=False)


def all_confirmed(confirmation: ConfirmationRow) -> bool:
    """Whether ngspice confirms every response."""
    return all(confirms(row) for row in confirmation["responses"])


def confirms(row: ConfirmedRow) -> bool:
    """Whether ngspice confirms a response: its gate passed, and of the boards that it simulated
    at most the share ``DIFFERING`` differ, are undecided or failed."""
    passed = row["gate"] is not None and row["gate"]["passed"]
    boards, agreed = int(row["asked"]), int(row["agreed"])
    return bool(passed and boards and boards - agreed <= DIFFERING * boards)


def _confirmed(
    modelfile: ModelFile,
    out: Path,
    options: Options,
    *,
    studied: bool = True,
) -> tuple[ConfirmationRow, bool]:
    """How ngspice judges boards of the study, and what limits each response; whether the folder
    held that already. studied : whether the folder has that study; its boards are asked here
    otherwise."""
    folder, catalog = Folder(out), load_catalog()
    inputs = {
        **design_inputs_of(folder),
        "seed": options.seed,
        "samples": options.samples,
        "rung": FIDELITY,
        "boards": LEAST,
        **grade_inputs(modelfile, catalog),
    }
    stages: Stages = {"confirmation": (inputs, [CONFIRMATION])}
    todo = folder.decide(stages, overwrite=options.overwrite, resume=options.resume)
    if todo:
        began = time.perf_counter()
        synthesis, stores = design_files.load(folder, modelfile, catalog), None
        if studied:
            stores = FolderStores(out, folder.watch(), progress.note, vouch=folder.vouches)
        judged = _confirm(synthesis, options, stores)
        with folder.working(stages, provenance(modelfile, catalog.hash, seed=options.seed)):
            document: ConfirmationFile = {
                "format": FORMAT,
                **judged,
                "cost": {"seconds": time.perf_counter() - began},
            }
            folder.write(CONFIRMATION, dumps(document))
    answer: ConfirmationFile = folder.json(CONFIRMATION)
    return {"rung": answer["rung"], "responses": answer["responses"]}, not todo


def _confirm(
    synthesis: Synthesis, options: Options, stores: FolderStores | None
) -> ConfirmationRow:
    jobs = options.workers
    decides: StudyEngine = "bandwidth" if options.rung == "bandwidth" else "exact"
    study = study_of(
        synthesis,
        replace(options, rung=decides, blame=False, blame_budget=None),
        StudyHelp(jobs, None, LocalRunner(jobs)),
        check(synthesis, None),
        stores,
    )
    step = progress.stage("what limits each response")
    limits = limitings(study.plan, study.answers, jobs=jobs, progress=step)
    with SpicePool(jobs, timeout=SPICE_TIMEOUT) as pool:
        require_ngspice(pool)
        progress.stage(f"ngspice, rung {FIDELITY}, numerics gate")
        plan, gates = gated(study.plan, pool, FIDELITY, LEVELS)
        asks = to_confirm(study.answers)
        asks = [a for a in asks if plan.questions[a.question].settings is not None]
        step = progress.stage(f"ngspice, rung {FIDELITY}, {len(asks)} boards", len(asks))
        cross_checks = ngspice_runs.cross_checks(plan, asks, pool, jobs, step, fidelity=FIDELITY)
    answers = {(a.sample, a.question): a for a in study.answers}
    rows = confirmation_json(cross_checks, answers, study.response_indices, len(study.checked))
    for index, limit, gate in zip(study.response_indices, limits, gates, strict=True):
        rows[index]["limited_by"] = plain(limit)
        rows[index]["gate"] = gate.as_dict()
    return {"rung": FIDELITY, "responses": rows}


def to_confirm(answers: Iterable[Answer]) -> list[Ask]:
    """The first `LEAST` boards of each response that the exact circuit has an answer to, from
    their own orbit: one without is replaced by the next."""
    count: Counter[int] = Counter()
    asks = []
    for a in sorted(answers, key=lambda a: (a.question, a.sample)):
        if a.verdict is not Verdict.FAILED and count[a.question] < LEAST:
            count[a.question] += 1
            asks.append(Ask(a.sample, a.question, StartKind.OWN, Why.RANDOM))
    return asks
