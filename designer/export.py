"""The verb ``export``: the KiCad project of a design."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from designer import job, kicad_files
from designer.catalog import load_catalog
from designer.design_files import load
from designer.folder import Folder
from designer.modelfile import ModelFile
from designer.options import Options
from designer.progress import Progress


def export_into(
    modelfile: ModelFile, out: Path, options: Options, progress: Progress
) -> tuple[dict[str, Any], bool]:
    """Write the project into a design folder, which is made where there is none.

    Returns the JSON object, with ``files`` inside the folder, and whether all was there already.

    Raises
    ------
    InputError : a footprint that is not known here, or files that somebody has changed.
    """
    outcome = job.synthesise_into(modelfile, out, options, progress)
    folder, catalog = Folder(out), load_catalog()
    made = load(folder, modelfile, catalog)
    files = kicad_files.texts(made)
    inputs = job.made_from(folder)
    stage = kicad_files.wanted(inputs, files)
    todo = folder.decide(stage, overwrite=options.overwrite, resume=options.resume)
    if todo:
        progress.stage("KiCad project")
        kicad_files.write(folder, made, inputs, files)
    answer = {"format": 1, "files": sorted(files), "provenance": outcome.answer["provenance"]}
    return answer, outcome.reused and not todo
