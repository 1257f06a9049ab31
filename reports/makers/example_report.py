"""The report on one model file of ``examples/``: what it shows, and what becomes of it on a board.

    python -m reports.makers.example_report examples/aberdeen.toml reports/examples/aberdeen

The first part holds what the tool computes against closed forms. The second shows the design that
the verbs ``run``, ``export`` and ``rules`` make in the folder ``design`` beside the page. A file
that this module does not know by its name gets the parts that every system has.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from markupsafe import Markup

from designer.base.defaults import cores
from designer.base.page import Block, Page, PageSection, Verbatim
from designer.base.progress import stage
from designer.catalog.parts_catalog import load_catalog
from designer.folders.origin import provenance
from designer.model.lumped_system import LumpedSystem
from designer.model.model_file import ModelFile, read_model_file
from designer.paper.report_files import write_files
from designer.plots import system_drawing
from designer.plots.system_equations import equations_of, number_of
from reports.makers import (
    backbone,
    bilinear,
    chain_modes,
    den_hartog,
    double_well,
    grazing_map,
    instant_impact,
    persistence,
    prestress,
    rattle,
    standing_post,
    weight,
)
from reports.makers.board_part import board_part
from reports.makers.evidence import Evidence, Example, figure_block
from reports.makers.frequency_sweep import frequency_sweep
from reports.makers.make_report import make_report

FORMAT = 1
SAMPLES, SEED = 100, 71
DATA = "example.json"
DPI = 125.0
"""Of the pictures: no file of a report is larger than 150 kB."""
EXAMPLES: Mapping[str, Example] = {
    "aberdeen": persistence.EXAMPLE,
    "preloaded": grazing_map.EXAMPLE,
    "shaw-holmes": bilinear.EXAMPLE,
    "duffing-gap": backbone.EXAMPLE,
    "backlash": rattle.EXAMPLE,
    "three-masses": chain_modes.EXAMPLE,
    "hammer-base": weight.EXAMPLE,
    "dry-friction": den_hartog.EXAMPLE,
    "double-well": double_well.EXAMPLE,
    "restitution": instant_impact.EXAMPLE,
    "fixed-stop": standing_post.EXAMPLE,
    "prestressed": prestress.EXAMPLE,
}
"""What is shown of each model file, by its name."""
OTHER = Example(lambda _: [], "", "")
"""The same of a file with another name."""


def report(
    model: Path,
    out: Path,
    *,
    samples: int = SAMPLES,
    seed: int = SEED,
    jobs: int | None = None,
    circuit: bool = True,
) -> None:
    """Make the report in the folder ``out``.

    samples : boards of the tolerance study. circuit : whether there is a part about a board.

    Raises
    ------
    InputError, Unreachable, EnvironmentMissing : as the verbs ``run``, ``export`` and ``rules``.
    """
    jobs = cores() if jobs is None else jobs
    file = read_model_file(model)
    example = EXAMPLES.get(model.stem, OTHER)
    stage("what the system shows", None)
    parts = [_system(file), *example.show(file), frequency_sweep(file, jobs)]
    parts[0] = replace(parts[0], blocks=[*parts[0].blocks, example.see])
    numbers = {"samples": samples, "seed": seed, "circuit": circuit}
    if circuit:
        parts.append(board_part(model, out, example.board, samples, seed, jobs))
    out.mkdir(parents=True, exist_ok=True)
    document = {
        "format": FORMAT,
        "title": file.title,
        "parts": [part.as_dict() for part in parts],
        "provenance": provenance(file, load_catalog().hash, seed=seed, settings=numbers),
    }
    figures = {name: figure for part in parts for name, figure in part.figures.items()}
    page = _page(file, model, out, numbers, parts)
    write_files(out, (DATA, document), page, figures, dpi=DPI)


def _system(file: ModelFile) -> Evidence:
    """The part about what the system is."""
    assert isinstance(file.model, LumpedSystem)
    figure = system_drawing.system_drawing(file.model, si=file.si is not None)
    blocks: list[Block] = [
        _opening(file),
        figure_block("system", "The system with its values."),
        Verbatim(equations_of(file.model, number_of)),
    ]
    return Evidence("The system", blocks, {"system": figure})


def _page(
    file: ModelFile,
    model: Path,
    out: Path,
    numbers: Mapping[str, object],
    parts: Sequence[Evidence],
) -> Page:
    command = f"python -m reports.makers.example_report {model} {out}"
    command += f" --samples {numbers['samples']} --seed {numbers['seed']}"
    command += "" if numbers["circuit"] else " --no-circuit"
    head = [Markup(f"Made by `{command}` from `{model}`; the numbers are in `{DATA}`.")]
    return Page(file.title, head, [PageSection(part.title, part.blocks) for part in parts])


def _opening(file: ModelFile) -> str:
    """The comment at the top of the model file."""
    lines = []
    for line in file.text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.removeprefix("#").strip())
    return " ".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the report that the command line asks for; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m reports.makers.example_report")
    parser.add_argument("model", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--jobs", type=int)
    parser.add_argument("--no-circuit", action="store_false", dest="circuit")
    return make_report(report, parser, arguments)


if __name__ == "__main__":
    sys.exit(main())
