"""The stage ``comparison`` of a design folder: what is computed, and the files that hold it."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from designer.base.design_folder import COMPARISON, COMPARISON_PICTURES, Folder
from designer.base.plain_json import dumps
from designer.base.progress import Progress
from designer.check.synthesis_result import Synthesis
from designer.jobs.design_files import design_provenance
from designer.jobs.json_answers import cost_of
from designer.report.comparison import compare, comparison_json, file_json, in_answer

NAMES = (COMPARISON, *COMPARISON_PICTURES)


@dataclass(frozen=True)
class ComparisonFiles:
    """What a comparison wrote."""

    file: dict[str, Any]
    """The JSON object of ``compare.json``."""


def make(made: Synthesis, progress: Progress) -> ComparisonFiles:
    """Compare; writes nothing."""
    began = time.perf_counter()
    answer = comparison_json(compare(made, lambda name: _said(progress, name)))
    seconds = time.perf_counter() - began
    return ComparisonFiles(
        file_json(answer, made.modelfile.title, design_provenance(made), seconds)
    )


def write(folder: Folder, compared: ComparisonFiles) -> None:
    """The stage's files; the folder lists them already."""
    from designer.base import figure_style  # matplotlib is not needed before this
    from designer.report import compare_plots

    folder.write(COMPARISON, dumps(compared.file))
    figure = compare_plots.comparison(compared.file["columns"])
    svg, png = COMPARISON_PICTURES
    folder.write(svg, figure_style.to_svg(figure))
    folder.write(png, figure_style.to_png(figure))


def beside(design: Mapping[str, Any], file: Mapping[str, Any]) -> dict[str, Any]:
    """What ``synthesise --compare`` prints: the design's object, and the comparison in it.

    The time is None where the file has none: no hash guards the object ``cost``.
    """
    cost = {**cost_of(design), "comparison_seconds": cost_of(file).get("seconds")}
    return {**design, "comparison": in_answer(file), "cost": cost}


def _said(progress: Progress, name: str) -> None:
    progress.stage(f"comparison: {name}")
