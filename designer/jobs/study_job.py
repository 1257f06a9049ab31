"""The verbs ``run`` and ``tolerance``: how many boards keep the response."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from designer.base.defaults import Over, StudyEngine
from designer.base.design_folder import Folder, is_design_folder
from designer.base.errors import InputError
from designer.base.plain_json import plain
from designer.base.progress import Progress
from designer.catalog.catalog import Catalog
from designer.centering import stage_choice
from designer.check.checked_design import CheckedResponse
from designer.check.synthesis_result import Synthesis
from designer.folders import design_files, kicad_files
from designer.folders.design_source import bills_are_of_old, design_inputs
from designer.folders.json_answers import run_json
from designer.folders.model_source import source
from designer.jobs import folder_numbers, rung_choice, search_stage, usual_times
from designer.jobs.board_routing import route_own_board
from designer.jobs.job_outcome import JobOutcome
from designer.jobs.options import Options, stated_options
from designer.jobs.stage_runner import StageRunner
from designer.jobs.study_layers import merged
from designer.jobs.study_stage import (
    BUILT,
    RANDOM,
    Place,
    Shown,
    StudyHelp,
    StudyStage,
    checks_in_memory,
    result_json,
    run_result,
    satisfied,
    study_of,
)
from designer.model.measured_values import MEASURED, read_measured
from designer.model.model_file import ModelFile, naming, need_responses
from designer.spread.part_rules import spread_of

THE_BOARD = "board"
"""Name of the only board of a list that names none."""


def run(
    model: Path | str | ModelFile,
    out: Path | str | None = None,
    *,
    samples: int | None = None,
    blame: bool | None = None,
    blame_budget: int | None = None,
    catalog: Catalog | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
    shown: Shown = lambda _: None,
) -> JobOutcome:
    """The verb ``run``: synthesis, check in ngspice, tolerance study, report.

    model : a model file that was read, the path of one, or a design folder. out : the folder to
    write; a ``ModelFile`` without one is worked on in memory. samples, blame, blame_budget, seed :
    None for the usual ones, or for the folder's own. catalog : in memory, instead of the one that
    is found. shown : is given the answer while the work goes on (``study_stage.Shown``).

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built, or the folder holds
        something else.
    ResponseNotFound : the model does not show a wanted response; no parts are chosen.
    EnvironmentMissing : there is work to do and no ngspice.
    """
    words = {"samples": samples, "seed": seed, "until": None, "blamed": blame}
    words |= {"blame_budget": blame_budget}
    options = Options(jobs=jobs, overwrite=overwrite, resume=resume, **stated_options(words))
    return _study("run", model, out, options, words, progress, shown, catalog)


def tolerance(
    model: Path | str | ModelFile | Synthesis | JobOutcome,
    out: Path | str | None = None,
    *,
    samples: int | None = None,
    until: float | None = None,
    rung: StudyEngine | None = None,
    tuned: bool = False,
    reached: bool = False,
    map_: Sequence[Over] = (),
    measured: Path | str | None = None,
    cluster: str | None = None,
    blame: bool | None = None,
    blame_budget: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
    shown: Shown = lambda _: None,
) -> JobOutcome:
    """The verb ``tolerance``: how many boards show each response, under the model file's spread.

    model : as of ``run``, or a design, which is studied in its folder or, without one, in memory.
    samples : at least. until : width of the 95 % intervals at which the study stops growing. rung :
    "exact" asks no ngspice, "auto" about some boards, "ngspice" about every board, "bandwidth" is
    "auto" with op-amps that lag by their gain-bandwidth. tuned, reached :
    also with the generator free within its bands, and from power-up. ``map_`` : settings over which
    the yield is wanted too. measured : a list of built boards, which are studied instead, in a
    design folder. cluster : address of a Dask scheduler. The others are as of ``run``.

    Raises
    ------
    InputError, Unreachable, EnvironmentMissing : as ``run``.
    """
    words = {"samples": samples, "seed": seed, "until": until, "rung": rung, "blamed": blame}
    words |= {"blame_budget": blame_budget}
    options = Options(
        jobs=jobs,
        overwrite=overwrite,
        resume=resume,
        tuned=tuned,
        reached=reached,
        maps=tuple(dict.fromkeys(map_)),
        cluster=cluster,
        **stated_options(words),
    )
    if measured is None:
        return _study("tolerance", model, out, options, words, progress, shown)
    options.check()
    for name, value in (
        ("--out", out), ("--samples", samples), ("--until", until), ("--map", ", ".join(map_))
    ):  # fmt: skip
        if value not in (None, ""):
            expected = "no such option with --measured, whose boards are the samples"
            raise InputError(None, name, str(value), expected)
    folder = model.folder if isinstance(model, JobOutcome) else model
    if not isinstance(folder, Path | str):
        raise InputError(None, "DIR", "no folder", "a design folder, whose boards were measured")
    path = Path(folder)
    options = folder_numbers.of_measured(path, options, words)
    command = partial(Options.command, verb="tolerance", model=path, out=None)
    progress = Progress() if progress is None else progress
    return measured_into(path, Path(measured), options, progress, command, shown)


def _study(
    verb: str,
    model: Path | str | ModelFile | Synthesis | JobOutcome,
    out: Path | str | None,
    options: Options,
    words: Mapping[str, Any],
    progress: Progress | None,
    shown: Shown,
    catalog: Catalog | None = None,
) -> JobOutcome:
    """words : what is given, by the names of ``Options``."""
    options.check()
    progress = Progress() if progress is None else progress
    if isinstance(model, JobOutcome):
        model = model.synthesis if model.folder is None else model.folder
    if out is None and isinstance(model, ModelFile | Synthesis):
        return _in_memory(model, options, words, progress, catalog)
    argument = model.modelfile if isinstance(model, Synthesis) else model
    argument = argument if isinstance(argument, ModelFile) else Path(argument)
    modelfile, folder = source(argument, out)
    options = folder_numbers.of_study(argument, folder, modelfile, options, words)
    place = None if out is None else Path(out)
    usual = usual_times.RUN if verb == "run" else usual_times.STUDIED
    with progress.whole({**usual_times.of_design(modelfile), **usual}):
        modelfile = search_stage.design_file(modelfile, folder, options, progress)
        path = argument if isinstance(argument, Path) else modelfile.source or folder / "model.toml"
        command = partial(Options.command, verb=verb, model=path, out=place)
        return run_into(modelfile, folder, options, progress, command, shown, routed=verb == "run")


def _in_memory(
    model: ModelFile | Synthesis,
    options: Options,
    words: Mapping[str, Any],
    progress: Progress,
    catalog: Catalog | None,
) -> JobOutcome:
    modelfile = model if isinstance(model, ModelFile) else model.modelfile
    need_responses(modelfile)
    options = folder_numbers.of_list(modelfile, options, words)
    with StudyHelp.of(options, progress) as help_:
        progress.stage("responses of the model, parts")
        synthesis = model
        if isinstance(synthesis, ModelFile):
            synthesis = stage_choice.synthesise(synthesis, catalog, jobs=options.workers)
        began = time.perf_counter()
        equations, checked = checks_in_memory(synthesis, help_.pool, progress)
        study = study_of(synthesis, options, help_, checked, progress=progress)
    cost = {"study_seconds": time.perf_counter() - began, "design_seconds": synthesis.seconds}
    result = run_result(synthesis, study, options, cost, equations)
    answer = run_json(plain(design_files.answer(synthesis)), plain(result_json(result)))
    return JobOutcome(answer, satisfied(answer), made=synthesis, result=result)


def run_into(
    modelfile: ModelFile,
    out: Path,
    options: Options,
    progress: Progress,
    command: Callable[[Options], str],
    shown: Shown = lambda _: None,
    *,
    routed: bool = False,
) -> JobOutcome:
    """Design, check, study and report in the folder ``out``.

    command : the command line as the report states it (``Options.command``). routed : with tracks
    on the board, where there are none.

    Raises
    ------
    EnvironmentMissing : there is work to do and no ngspice, or no cluster, that it needs.
    """
    options.check()
    need_responses(modelfile)
    options = rung_choice.with_rung(Folder(out), options, progress)
    runner = StageRunner(modelfile, out, options, progress)
    folder = runner.folder
    # A study is of the boards as they are bought now, whatever the design's own inputs say.
    design_now = design_inputs(modelfile, runner.catalog)
    numbers = {"seed": options.seed, "samples": options.samples, "until": options.until}
    inputs = {**design_now, **numbers, **folder_numbers.rung_input(options)}
    options = replace(options, trimmed=modelfile.board.dc_trim == "fitted")
    options = merged(folder, inputs, options)
    labels = () if modelfile.measured is None else modelfile.measured.labels
    census = len(labels) == options.samples
    stages = RANDOM.stages(inputs, options, len(modelfile.responses), census=census)
    if not runner.decide(stages):
        return _outcome(folder, RANDOM, reused=True)
    began = time.perf_counter()
    with StudyHelp.of(options, progress) as help_:
        synthesis = runner.design()
        if bills_are_of_old(runner.design_inputs, design_now):
            design_files.renew_bills(folder, synthesis)
        if routed:
            route_own_board(folder, synthesis, progress)
        stage = StudyStage(folder, RANDOM, synthesis, options, command(options), progress, shown)

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
    progress: Progress,
    command: Callable[[Options], str],
    shown: Shown = lambda _: None,
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
    runner = StageRunner(modelfile, path, options, progress)
    folder = runner.folder
    if folder.decide(runner.stages, overwrite=False, resume=False):
        raise InputError(path, "the design", "unfinished", "a finished one (designer synthesise)")
    synthesis = design_files.load(folder, modelfile, runner.catalog)
    synthesis = replace(synthesis, modelfile=replace(modelfile, measured=boards))
    with naming(modelfile):
        spread_of(
            synthesis.modelfile, synthesis.design.circuit, runner.catalog
        )  # refuses what is not theirs
    options = rung_choice.with_rung(folder, options, progress)
    options = replace(options, trimmed=modelfile.board.dc_trim == "fitted")
    numbers = {"list": boards.sha256, "seed": options.seed, "samples": options.samples}
    inputs = {**runner.design_inputs, **numbers, **folder_numbers.rung_input(options)}
    options = merged(folder, inputs, options, BUILT.stage)
    stages = BUILT.stages(inputs, options, len(modelfile.responses), census=True)
    list_file = BUILT.prefix + MEASURED
    stages[BUILT.stage][1].append(list_file)
    if not folder.decide(stages, overwrite=options.overwrite, resume=options.resume):
        return _outcome(folder, BUILT, made=synthesis, reused=True)
    with StudyHelp.of(options, progress) as help_:
        folder.begin(stages)
        folder.write(list_file, boards.content)
        stage = StudyStage(folder, BUILT, synthesis, options, command(options), progress, shown)
        result = stage.work(help_)
    return _outcome(folder, BUILT, made=synthesis, result=result, shown=stage.early)


def _outcome(folder: Folder, place: Place, **more: Any) -> JobOutcome:
    """What stands in the folder."""
    answer = place.answer(folder)
    return JobOutcome(answer, satisfied(answer), folder.path, place=place, **more)
