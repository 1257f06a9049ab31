"""The parts of a model, in memory or in a design folder.

Nothing in this package prints; the command line does.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from designer.base import progress
from designer.base.design_folder import COMPARISON, COMPARISON_PICTURES, Folder
from designer.base.manifest import Stages
from designer.base.plain_json import dumps, plain
from designer.base.progress import Show, quiet
from designer.catalog.parts_catalog import Catalog
from designer.centering import stage_choice
from designer.check.synthesis_result import Ahead, Synthesis
from designer.folders import design_files
from designer.folders.design_source import design_answer
from designer.folders.json_answers import cost_of
from designer.jobs.job_outcome import JobOutcome
from designer.jobs.options import Options
from designer.jobs.stage_runner import StageRunner
from designer.model.model_file import ModelFile
from designer.report.comparison import (
    compare as compare_designs,
    comparison_json,
    file_json,
    in_answer,
)

if TYPE_CHECKING:
    from designer.answers.design_answer import ComparisonFile, DesignAnswer, DesignCost


def synthesise_into(
    modelfile: ModelFile,
    out: Path,
    options: Options,
    shown: Show = quiet,
    *,
    compare: bool = False,
    ahead: Ahead | None = None,
) -> JobOutcome:
    """The design in the folder ``out``; with ``compare`` the comparison is a stage of its own.
    shown, ahead : as of ``StageRunner``."""
    runner = StageRunner(modelfile, out, options, anew=True, shown=shown, ahead=ahead)
    names = [COMPARISON, *COMPARISON_PICTURES]
    stages: Stages = {"comparison": (runner.design_inputs, names)} if compare else {}
    synthesis = runner.design() if runner.decide(stages) else None
    folder = runner.folder
    if synthesis is not None and "comparison" in runner.todo:
        document = _comparison(synthesis)
        folder.write(COMPARISON, dumps(document))
        _draw(folder, document)
        folder.finish("comparison")
    answer = design_answer(folder)
    if compare:
        answer = _with_comparison(answer, folder.json(COMPARISON))
    return JobOutcome(answer, _all_shown(answer), out, synthesis is None, synthesis)


def synthesise_in_memory(
    modelfile: ModelFile, catalog: Catalog | None, compare: bool, jobs: int
) -> JobOutcome:
    progress.stage("responses of the model, parts")
    synthesis = stage_choice.synthesise(modelfile, catalog, jobs=jobs)
    better = stage_choice.better_stage(modelfile, synthesis, jobs)
    synthesis = replace(synthesis, better_stage=better)
    answer: DesignAnswer = plain(design_files.answer(synthesis))
    if compare:
        answer = _with_comparison(answer, plain(_comparison(synthesis)))
    return JobOutcome(answer, _all_shown(answer), made=synthesis)


def _comparison(synthesis: Synthesis) -> ComparisonFile:
    """The JSON object of ``compare.json``."""
    began = time.perf_counter()
    columns = compare_designs(synthesis, _stage)
    seconds = time.perf_counter() - began
    provenance = design_files.design_provenance(synthesis)
    return file_json(comparison_json(columns), synthesis.modelfile.title, provenance, seconds)


def _draw(folder: Folder, document: ComparisonFile) -> None:
    """The pictures of a comparison."""
    from designer.base import figure_style  # matplotlib is not needed before this
    from designer.report import compare_plots

    svg, png = COMPARISON_PICTURES
    figure = compare_plots.comparison(document["columns"])
    folder.write(svg, figure_style.to_svg(figure))
    folder.write(png, figure_style.to_png(figure))


def _with_comparison(design: DesignAnswer, file: ComparisonFile) -> DesignAnswer:
    """What ``synthesise --compare`` prints: the design's object, and the comparison in it.

    The time is None where the file has none: no hash guards the object ``cost``.
    """
    cost: DesignCost = cost_of(design)
    cost["comparison_seconds"] = cost_of(file).get("seconds")
    return {**design, "comparison": in_answer(file), "cost": cost}


def _all_shown(answer: DesignAnswer) -> bool:
    return all(knob["found"] for knob in answer["knobs"])


def _stage(name: str) -> None:
    progress.stage(f"comparison: {name}")
