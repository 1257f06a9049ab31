"""Decks for other simulators in a design folder: a stage for each, so that one may come later."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from designer.base.design_folder import DESIGN, Folder
from designer.base.manifest import StageName
from designer.base.progress import Progress
from designer.base.version import __version__
from designer.catalog.catalog import load_catalog
from designer.check.deck_notes import simulator_notes
from designer.check.deck_runs import response_runs
from designer.check.synthesis_result import Synthesis
from designer.jobs import synthesise_job
from designer.jobs.design_files import design_provenance, load
from designer.jobs.options import Options
from designer.model.model_file import ModelFile
from designer.spice import simulator_decks
from designer.spice.simulator_decks import Dialect, file_name

STAGES: Mapping[Dialect, StageName] = {"ltspice": "deck-ltspice", "portable": "deck-portable"}


def export_decks(
    modelfile: ModelFile,
    out: Path,
    dialects: Sequence[Dialect],
    options: Options,
    progress: Progress,
) -> tuple[dict[str, Any], bool]:
    """Write decks into a design folder, which is made where there is none.

    Returns the JSON object, with ``files`` inside the folder, and whether all was there already.

    Raises
    ------
    InputError : files that somebody has changed, or decks of another design or version.
    """
    options.check()
    catalog, folder = load_catalog(), Folder(out)
    design = synthesise_job.standing_inputs(folder, modelfile, catalog, progress)
    reused = not folder.decide(design, overwrite=options.overwrite, resume=options.resume)
    if not reused:
        synthesise_job.synthesise_into(modelfile, out, options, progress)
        folder = Folder(out)
    inputs = {**synthesise_job.made_from(folder), "catalogue": catalog.hash, "version": __version__}
    names = {dialect: file_name(dialect) for dialect in dict.fromkeys(dialects)}
    wanted = {STAGES[dialect]: (dict(inputs), [name]) for dialect, name in names.items()}
    todo = folder.decide(wanted, overwrite=options.overwrite, resume=options.resume)
    if todo:
        progress.stage("decks")
        made = load(folder, modelfile, catalog)
        texts = {name: text(made, dialect) for dialect, name in names.items()}
        folder.begin({stage: wanted[stage] for stage in todo}, design_provenance(made))
        for stage in todo:
            (name,) = wanted[stage][1]
            folder.write(name, texts[name])
            folder.finish(stage)
    provenance = folder.json(DESIGN)["provenance"]
    files = sorted(names.values())
    return {"format": 1, "files": files, "provenance": provenance}, reused and not todo


def text(made: Synthesis, dialect: Dialect) -> str:
    """A deck of a design, with every response that is wanted of it."""
    runs = response_runs(made)
    return simulator_decks.write(
        dialect,
        made.design.circuit,
        runs,
        title=made.modelfile.title,
        notes=simulator_notes(made, dialect, runs),
    )
