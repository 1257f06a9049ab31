"""The study stage of a design folder: the verbs ``run`` and ``tolerance``.

Nothing here prints; ``cli.verbs`` does.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from designer.base.defaults import SAMPLES, SEED, at_least, cores
from designer.base.design_folder import Folder
from designer.base.manifest import StageName
from designer.base.progress import Progress
from designer.catalog.catalog import Catalog, load_catalog
from designer.check import synthesis_result
from designer.check.synthesis_result import synthesise
from designer.jobs import design_files, kicad_files, rung_choice
from designer.jobs.design_files import load
from designer.jobs.options import Options
from designer.jobs.study_folder import layers_of, merged, study_files
from designer.jobs.study_stage import (
    SPICE_TIMEOUT as SPICE_TIMEOUT,
    Help,
    Place,
    StudyStage,
    checks,
    satisfied,
)
from designer.jobs.synthesise_job import (
    JobOutcome,
    bills_are_of_old,
    design_inputs,
    standing_inputs,
)
from designer.model.model_file import ModelFile, naming, need_responses
from designer.spice import equation_check
from designer.spice.pool import SpicePool, require_ngspice
from designer.yields.run_result import RunResult
from designer.yields.tolerance_study import tolerance

PLACE = Place()
"""Of the study of random boards."""


def run_into(
    modelfile: ModelFile,
    out: Path,
    options: Options,
    progress: Progress,
    command: Callable[[Options], str],
    shown: Callable[[Mapping[str, Any]], None] = lambda _: None,
) -> JobOutcome:
    """The verbs ``run`` and ``tolerance``: design, check, study, report.

    command : the command line as the report states it (``Options.command``). shown : is given the
    answer while work goes on: see `StudyStage`.

    Raises
    ------
    EnvironmentMissing : there is work to do and no ngspice, or no cluster, that it needs.
    """
    options.check()
    need_responses(modelfile)
    catalog = load_catalog()
    folder = Folder(out)
    options = rung_choice.chosen(folder, options, progress)
    wanted, options = _study_wanted(folder, modelfile, catalog, options)
    wanted |= standing_inputs(folder, modelfile, catalog, progress)
    todo = folder.decide(wanted, overwrite=options.overwrite, resume=options.resume)
    if not todo:
        answer = PLACE.answer(folder)
        return JobOutcome(answer, satisfied(answer), out, True)
    if "design" in todo:
        design_files.check(modelfile, catalog)
    began = time.perf_counter()
    with Help.of(options, progress) as help_:
        progress.stage("responses of the model, parts")
        if "design" in todo:
            made = synthesis_result.synthesise(modelfile, catalog)
            progress.stage("start recipes, files of the design")
            with naming(modelfile):
                files = design_files.texts(made)
            inputs = wanted["design"][0]
            project = kicad_files.beside(folder, made, inputs, options.overwrite, progress)
            folder.begin({s: wanted[s] for s in todo}, design_files.design_provenance(made))
            design_files.write(folder, made, files)
            folder.finish("design")
            kicad_files.write(folder, made, inputs, project)
        else:
            made = load(folder, modelfile, catalog)
            folder.begin({s: wanted[s] for s in todo}, design_files.design_provenance(made))
            if bills_are_of_old(
                wanted["design"][0], design_inputs(modelfile, catalog)["design"][0]
            ):
                design_files.renew_bills(folder, made)
        design_seconds = time.perf_counter() - began
        ready = time.perf_counter()
        kept = PLACE.kept(folder, progress.note)
        checked = checks(folder, made, help_.pool, kept, progress)
        first = checked[1][0]
        if first.gate is not None and first.gate.passed:
            folder.rewrite("circuit.cir", design_files.circuit_deck(made, first))
            kicad_files.settle(folder, made, first)
        seconds = time.perf_counter() - ready
        stage = StudyStage(
            folder, PLACE, made, options, command(options), progress, shown, design_seconds
        )
        result = stage.done(checked, kept, help_, seconds)
    answer = PLACE.answer(folder)
    return JobOutcome(answer, satisfied(answer), out, False, result, shown=stage.early)


def _study_wanted(
    folder: Folder, modelfile: ModelFile, catalog: Catalog, options: Options
) -> tuple[dict[StageName, tuple[dict[str, Any], list[str]]], Options]:
    """The stages, and the options with the layers that the folder's study has already."""
    wanted = design_inputs(modelfile, catalog)
    inputs = {
        **wanted["design"][0],
        "seed": options.seed,
        "samples": options.samples,
        "until": options.until,
    }
    options = replace(options, trimmed=modelfile.board.dc_trim == "fitted")
    options = merged(folder, inputs, options)
    labels = () if modelfile.measured is None else modelfile.measured.labels
    files = study_files(options, len(modelfile.responses), len(labels) == options.samples)
    wanted["study"] = ({**inputs, "layers": layers_of(options)}, files)
    return wanted, options


def run(
    modelfile: ModelFile,
    catalog: Catalog | None = None,
    *,
    samples: int = SAMPLES,
    seed: int = SEED,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """The whole job in memory: synthesis, check in ngspice, tolerance study.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built.
    EnvironmentMissing : ngspice is missing.
    """
    need_responses(modelfile)
    jobs = cores() if jobs is None else jobs
    at_least("--jobs", jobs, 1)
    with SpicePool(jobs) as pool:
        require_ngspice(pool)
        made = synthesise(modelfile, catalog)
        equations = equation_check.check(made.design, made.found, pool)
        study = tolerance(made, samples=samples, seed=seed, jobs=jobs, pool=pool, progress=progress)
    return RunResult(
        made.modelfile,
        made.catalog,
        made.found,
        made.design,
        study.checked,
        study,
        equations=equations,
    )
