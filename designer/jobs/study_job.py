"""How many boards keep the response."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from designer.base import progress
from designer.base.design_folder import MEASURED, Folder, is_design_folder
from designer.base.errors import InputError
from designer.base.plain_json import plain
from designer.base.progress import Show, quiet
from designer.catalog.parts_catalog import Catalog
from designer.centering import stage_choice
from designer.check.checked_design import CheckedResponse
from designer.check.synthesis_result import Synthesis
from designer.folders import design_files, kicad_files
from designer.folders.design_source import bills_are_of_old, design_inputs
from designer.folders.json_answers import run_json
from designer.folders.model_source import source
from designer.jobs import fidelity_choice, folder_numbers, usual_times
from designer.jobs.board_routing import route_own_board
from designer.jobs.job_outcome import JobOutcome
from designer.jobs.open_design import design_file
from designer.jobs.options import Options
from designer.jobs.stage_runner import StageRunner
from designer.jobs.study_layers import merged
from designer.jobs.study_stage import (
    BUILT,
    RANDOM,
    Place,
    StudyHelp,
    StudyStage,
    checks_in_memory,
    result_json,
    run_result,
    satisfied,
    study_of,
)
from designer.model.measured_values import read_measured
from designer.model.model_file import ModelFile, errors_in, need_responses
from designer.spread.part_rules import spread_of
from designer.yields.tolerance_study import need_drawn_boards

THE_BOARD = "board"
"""Name of the only board of a list that names none."""


def design_and_study(
    model: Path | str | ModelFile | Synthesis | JobOutcome,
    out: Path | str | None,
    options: Options,
    words: Mapping[str, Any],
    command: Callable[[Options, Path, Path | None], str],
    shown: Show,
    catalog: Catalog | None = None,
    *,
    whole_job: bool = False,
) -> JobOutcome:
    """Design, check, study and report, in a folder or in memory.

    words : what is given, by the names of ``Options``. command : the command line that makes the
    same results of a model or folder, and of ``out``, again. whole_job : with tracks on the board.

    Raises
    ------
    InputError, Unreachable, ResponseNotFound, EnvironmentMissing : as the verb ``run``.
    """
    options.check()
    if isinstance(model, JobOutcome):
        model = model.synthesis if model.folder is None else model.folder
    if out is None and isinstance(model, ModelFile | Synthesis):
        return _in_memory(model, options, words, catalog)
    argument = model.modelfile if isinstance(model, Synthesis) else model
    argument = argument if isinstance(argument, ModelFile) else Path(argument)
    modelfile, folder = source(argument, out)
    if options.rare:
        need_drawn_boards(modelfile)
    options = folder_numbers.of_study(argument, folder, modelfile, options, words)
    place = None if out is None else Path(out)
    usual = usual_times.RUN if whole_job else usual_times.STUDIED
    with progress.whole({**usual_times.of_design(modelfile), **usual}):
        modelfile = design_file(modelfile, folder, options)
        path = argument if isinstance(argument, Path) else modelfile.source or folder / "model.toml"
        return run_into(
            modelfile,
            folder,
            options,
            lambda made_with: command(made_with, path, place),
            shown,
            routed=whole_job,
        )


def _in_memory(
    model: ModelFile | Synthesis,
    options: Options,
    words: Mapping[str, Any],
    catalog: Catalog | None,
) -> JobOutcome:
    modelfile = model if isinstance(model, ModelFile) else model.modelfile
    need_responses(modelfile)
    options = folder_numbers.of_list(modelfile, options, words)
    with StudyHelp.of(options) as help_:
        progress.stage("responses of the model, parts")
        synthesis = model
        if isinstance(synthesis, ModelFile):
            synthesis = stage_choice.synthesise(synthesis, catalog, jobs=options.workers)
        began = time.perf_counter()
        equations, checked = checks_in_memory(synthesis, help_.pool)
        study = study_of(synthesis, options, help_, checked)
    cost = {"study_seconds": time.perf_counter() - began, "design_seconds": synthesis.seconds}
    result = run_result(synthesis, study, options, cost, equations)
    answer = run_json(plain(design_files.answer(synthesis)), plain(result_json(result)))
    return JobOutcome(answer, satisfied(answer), made=synthesis, result=result)


def run_into(
    modelfile: ModelFile,
    out: Path,
    options: Options,
    command: Callable[[Options], str],
    shown: Show = quiet,
    *,
    routed: bool = False,
) -> JobOutcome:
    """Design, check, study and report in the folder ``out``.

    command : the command line as the report states it (``Verb.command``). routed : with tracks
    on the board, where there are none.

    Raises
    ------
    EnvironmentMissing : there is work to do and no ngspice, or no cluster, that it needs.
    """
    options.check()
    need_responses(modelfile)
    options = fidelity_choice.with_fidelity(Folder(out), options)
    runner = StageRunner(modelfile, out, options, shown=shown)
    folder = runner.folder
    # A study is of the boards as they are bought now, whatever the design's own inputs say.
    design_now = design_inputs(modelfile, runner.catalog)
    numbers = {"seed": options.seed, "samples": options.samples, "until": options.until}
    inputs = {**design_now, **numbers, **folder_numbers.fidelity_input(options)}
    options = replace(options, trimmed=modelfile.board.dc_trim == "fitted")
    options = merged(folder, inputs, options)
    labels = () if modelfile.measured is None else modelfile.measured.labels
    census = len(labels) == options.samples
    stages = RANDOM.stages(inputs, options, len(modelfile.responses), census=census)
    if not runner.decide(stages):
        return _outcome(folder, RANDOM, reused=True)
    began = time.perf_counter()
    with StudyHelp.of(options) as help_:
        synthesis = runner.design()
        if bills_are_of_old(runner.design_inputs, design_now):
            design_files.renew_bills(folder, synthesis)
        if routed:
            route_own_board(folder, synthesis)
        stage = StudyStage(folder, RANDOM, synthesis, options, command(options), shown)

        def checked(first: CheckedResponse) -> None:
            if first.gate is not None and first.gate.passed:
                folder.rewrite("circuit.cir", design_files.circuit_deck(synthesis, first))
                kicad_files.settle(folder, synthesis, first)

        result = stage.work(help_, time.perf_counter() - began, checked)
    return _outcome(folder, RANDOM, made=synthesis, result=result, shown=stage.early)


def measured_into(
    path: Path,
    file: Path,
    options: Options,
    command: Callable[[Options], str],
    shown: Show = quiet,
) -> JobOutcome:
    """Study the boards of a list, once each, in the design folder whose parts they have.

    The study is a stage of its own, in the folder ``measured/``; that of the random boards stays as
    it is. file : the list, as [spread] names one; what it does not measure is drawn. command : as
    of ``run_into``.

    Raises
    ------
    InputError : no design folder, or a list that is none of its boards; nothing is written then.
    EnvironmentMissing : there is work to do and no ngspice, or no cluster, that it needs.
    """
    if not is_design_folder(path):
        there = "no manifest.json" if path.is_dir() else "no folder"
        raise InputError(path, "DIR", there, "a design folder, whose boards were measured")
    boards = read_measured(file)
    if not boards.labels:
        boards = replace(boards, boards=(THE_BOARD,))
    modelfile, _ = source(path, path)
    need_responses(modelfile)
    options = replace(options, samples=len(boards.boards), measured=file)
    runner = StageRunner(modelfile, path, options)
    folder = runner.folder
    if folder.decide(runner.stages, overwrite=False, resume=False):
        raise InputError(path, "the design", "unfinished", "a finished one (designer synthesise)")
    synthesis = design_files.load(folder, modelfile, runner.catalog)
    synthesis = replace(synthesis, modelfile=replace(modelfile, measured=boards))
    with errors_in(modelfile):
        spread_of(
            synthesis.modelfile, synthesis.design.circuit, runner.catalog
        )  # refuses what is not theirs
    options = fidelity_choice.with_fidelity(folder, options)
    options = replace(options, trimmed=modelfile.board.dc_trim == "fitted")
    numbers = {"list": boards.sha256, "seed": options.seed, "samples": options.samples}
    inputs = {**runner.design_inputs, **numbers, **folder_numbers.fidelity_input(options)}
    options = merged(folder, inputs, options, BUILT.stage, BUILT.prefix)
    stages = BUILT.stages(inputs, options, len(modelfile.responses), census=True)
    list_file = BUILT.prefix + MEASURED
    stages[BUILT.stage][1].append(list_file)
    if not folder.decide(stages, overwrite=options.overwrite, resume=options.resume):
        return _outcome(folder, BUILT, made=synthesis, reused=True)
    with StudyHelp.of(options) as help_:
        folder.begin(stages)
        folder.write(list_file, boards.content)
        stage = StudyStage(folder, BUILT, synthesis, options, command(options), shown)
        result = stage.work(help_)
    return _outcome(folder, BUILT, made=synthesis, result=result, shown=stage.early)


def _outcome(folder: Folder, place: Place, **more: Any) -> JobOutcome:
    """What stands in the folder."""
    answer = place.answer(folder)
    return JobOutcome(answer, satisfied(answer), folder.path, place=place, **more)
