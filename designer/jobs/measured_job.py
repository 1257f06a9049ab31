"""``tolerance DIR --measured FILE``: the boards that are built, studied beside the random ones.

The parts are those of the design folder, the boards those of the list. Their study is a stage of
its own, with its files in the folder ``measured/``; that of the random boards stays as it is.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from designer.base.design_folder import Folder, is_design_folder
from designer.base.errors import InputError
from designer.base.manifest import StageName
from designer.base.progress import Progress
from designer.catalog.catalog import load_catalog
from designer.jobs import design_files, rung_choice
from designer.jobs.options import Options
from designer.jobs.study_folder import layers_of, merged, study_files
from designer.jobs.study_stage import Help, Place, StudyStage, checks, satisfied
from designer.jobs.synthesise_job import JobOutcome, source, standing_inputs
from designer.model.measured_values import MEASURED, MeasuredBoards, read_measured
from designer.model.model_file import naming, need_responses
from designer.spread.part_rules import spread_of

PLACE = Place("measured", "measured/")
"""Of the study of built boards."""
THE_BOARD = "board"
"""Name of the only board of a list that names none."""


def measured_into(
    path: Path,
    file: Path,
    options: Options,
    progress: Progress,
    command: Callable[[Options], str],
    shown: Callable[[Mapping[str, Any]], None] = lambda _: None,
) -> JobOutcome:
    """The verb ``tolerance`` on a design folder, with a list of measured boards.

    file : the list, as [spread] names one; its boards are the samples, once each. What it does not
    measure is drawn. command, shown : as of ``study_job.run_into``.

    Raises
    ------
    InputError : no design folder, or a list that is none of its boards; nothing is written then.
    EnvironmentMissing : there is work to do and no ngspice, or no cluster, that it needs.
    """
    if not is_design_folder(path):
        found = "no manifest.json" if path.is_dir() else "no folder"
        raise InputError(path, "DIR", found, "a design folder, whose boards were measured")
    catalog, folder, boards = load_catalog(), Folder(path), listed(file)
    modelfile, _ = source(path, path)
    need_responses(modelfile)
    wanted = standing_inputs(folder, modelfile, catalog, progress)
    if folder.decide(wanted, overwrite=False, resume=False):
        raise InputError(path, "the design", "unfinished", "a finished one (designer synthesise)")
    made = design_files.load(folder, modelfile, catalog)
    made = replace(made, modelfile=replace(modelfile, measured=boards))
    with naming(modelfile):
        spread_of(made.modelfile, made.design.circuit, catalog)  # refuses what is not of these
    options = replace(options, samples=len(boards.boards), measured=file)
    options = rung_choice.chosen(folder, options, progress)
    options = replace(options, trimmed=modelfile.board.dc_trim == "fitted")
    inputs = {
        **wanted["design"][0],
        "list": boards.sha256,
        "seed": options.seed,
        "samples": options.samples,
    }
    options = merged(folder, inputs, options, PLACE.stage)
    files = [*study_files(options, len(modelfile.responses), census=True), MEASURED]
    stage: dict[StageName, tuple[dict[str, Any], list[str]]] = {
        PLACE.stage: ({**inputs, "layers": layers_of(options)}, PLACE.names(files))
    }
    if not folder.decide(stage, overwrite=options.overwrite, resume=options.resume):
        answer = PLACE.answer(folder)
        return JobOutcome(answer, satisfied(answer), path, True)
    began = time.perf_counter()
    with Help.of(options, progress) as help_:
        provenance = {} if folder.manifest is None else folder.manifest.provenance
        folder.begin(stage, provenance)
        folder.write(PLACE.prefix + MEASURED, boards.content)
        kept = PLACE.kept(folder, progress.note)
        checked = checks(folder, made, help_.pool, kept, progress)
        work = StudyStage(folder, PLACE, made, options, command(options), progress, shown, 0.0)
        result = work.done(checked, kept, help_, time.perf_counter() - began)
    answer = PLACE.answer(folder)
    return JobOutcome(answer, satisfied(answer), path, False, result, shown=work.early)


def listed(file: Path) -> MeasuredBoards:
    """The list in a file, whose boards all have a name.

    Raises
    ------
    InputError : see ``measured_values.read_measured``.
    """
    boards = read_measured(file)
    return boards if boards.labels else replace(boards, boards=(THE_BOARD,))
