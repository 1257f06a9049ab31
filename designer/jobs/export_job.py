"""The verb ``export``: the KiCad project of a design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from designer.base.design_folder import DESIGN, Folder
from designer.base.frames import table_html
from designer.base.progress import Progress
from designer.base.version import __version__
from designer.catalog.catalog import load_catalog
from designer.jobs import kicad_files, synthesise_job
from designer.jobs.deck_job import export_decks
from designer.jobs.design_files import load
from designer.jobs.options import Options
from designer.model.model_file import ModelFile
from designer.spice.simulator_decks import Dialect


@dataclass(frozen=True)
class ExportResult:
    """What the verb ``export`` answers."""

    answer: dict[str, Any]
    """The JSON object (docs/contract.md)."""
    folder: Path
    """The design folder."""
    reused: bool
    """Whether every file was there already."""

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that were asked for."""
        return tuple(self.folder / name for name in self.answer["files"])

    def _repr_html_(self) -> str:
        return table_html(str(self.folder), [{"file": name} for name in self.answer["files"]])


def export(
    model: Path | str,
    out: Path | str | None = None,
    *,
    deck: Sequence[Dialect] = (),
    overwrite: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
) -> ExportResult:
    """The verb ``export``: the KiCad project of a design, or decks for other simulators.

    model : a design folder, or a model file with ``out``. deck : "ltspice", "portable" or both;
    the KiCad project if empty.

    Raises
    ------
    InputError : as ``export_into`` and ``export_decks``.
    """
    options = Options(overwrite=overwrite, resume=resume)
    said = Progress() if progress is None else progress
    place = None if out is None else Path(out)
    modelfile, folder = synthesise_job.source(Path(model), place)
    if deck:
        answer, reused = export_decks(modelfile, folder, deck, options, said)
    else:
        answer, reused = export_into(modelfile, folder, options, said)
    return ExportResult(answer, folder, reused)


def export_into(
    modelfile: ModelFile, out: Path, options: Options, progress: Progress
) -> tuple[dict[str, Any], bool]:
    """Write the project into a design folder, which is made where there is none.

    Returns the JSON object, with ``files`` inside the folder, and whether all was there already.

    Raises
    ------
    InputError : a footprint that is not known here, or files that somebody has changed.
    """
    options.check()
    catalog, folder = load_catalog(), Folder(out)
    design = synthesise_job.standing_inputs(folder, modelfile, catalog, progress)
    reused = not folder.decide(design, overwrite=options.overwrite, resume=options.resume)
    if not reused:
        synthesise_job.synthesise_into(modelfile, out, options, progress)
        folder = Folder(out)
    made = load(folder, modelfile, catalog)
    files = kicad_files.texts(made)
    inputs = {**synthesise_job.made_from(folder), "catalogue": catalog.hash, "version": __version__}
    if folder.state(kicad_files.STAGE, inputs) == "other" and not options.overwrite:
        # The project is of its time, as the design is: it may hold a board that somebody routed.
        assert folder.manifest is not None
        inputs = folder.manifest.stages[kicad_files.STAGE].inputs
        listed = folder.manifest.files.items()
        files = {name: "" for name, (stage, _) in listed if stage == kicad_files.STAGE}
        progress.note("so does its KiCad project: --overwrite makes it anew, with what is here")
    stage = kicad_files.wanted(inputs, files)
    todo = folder.decide(stage, overwrite=options.overwrite, resume=options.resume)
    if todo:
        progress.stage("KiCad project")
        kicad_files.write(folder, made, inputs, files)
    said = folder.json(DESIGN)["provenance"]
    return {"format": 1, "files": sorted(files), "provenance": said}, reused and not todo
