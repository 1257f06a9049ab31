"""The verb ``export``: the KiCad project of a design, or decks for other simulators.

Both are stages of the design folder: a stage for each deck, so that one may come later.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from designer.base.design_folder import DESIGN
from designer.base.frames import table_html
from designer.base.manifest import StageName, Stages
from designer.base.progress import Progress
from designer.base.version import __version__
from designer.check.deck_runs import response_runs, simulator_notes
from designer.check.synthesis_result import Synthesis
from designer.jobs import kicad_files
from designer.jobs.design_files import design_provenance
from designer.jobs.design_source import design_inputs_of, source
from designer.jobs.options import Options
from designer.jobs.stage_runner import StageRunner
from designer.model.model_file import ModelFile
from designer.spice import simulator_decks
from designer.spice.simulator_decks import Dialect, file_name

DECK_STAGES: Mapping[Dialect, StageName] = {
    "ltspice": "deck-ltspice",
    "portable": "deck-portable",
}


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
    model: Path | str | ModelFile,
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
    InputError : a footprint that is not known here, files that somebody has changed, or decks of
        another design or version.
    """
    options = Options(overwrite=overwrite, resume=resume)
    progress = Progress() if progress is None else progress
    modelfile, folder = source(model, out)
    if deck:
        return export_decks(modelfile, folder, deck, options, progress)
    return export_into(modelfile, folder, options, progress)


def export_into(
    modelfile: ModelFile, out: Path, options: Options, progress: Progress
) -> ExportResult:
    """Write the project into a design folder, which is made where there is none."""
    runner, synthesis, reused = _design(modelfile, out, options, progress)
    folder, files, inputs = runner.folder, kicad_files.texts(synthesis), _inputs(runner)
    if folder.state(kicad_files.STAGE, inputs) == "other" and not options.overwrite:
        # The project is of its time, as the design is: it may hold a board that somebody routed.
        assert folder.manifest is not None
        inputs = folder.manifest.stages[kicad_files.STAGE].inputs
        listed = folder.manifest.files.items()
        files = {name: "" for name, (stage, _) in listed if stage == kicad_files.STAGE}
        progress.note("so does its KiCad project: --overwrite makes it anew, with what is here")
    stages = kicad_files.stages(inputs, files)
    todo = folder.decide(stages, overwrite=options.overwrite, resume=options.resume)
    if todo:
        progress.stage("KiCad project")
        kicad_files.write(folder, synthesis, inputs, files)
    return _result(runner, list(files), reused and not todo)


def export_decks(
    modelfile: ModelFile,
    out: Path,
    dialects: Sequence[Dialect],
    options: Options,
    progress: Progress,
) -> ExportResult:
    """Write decks into a design folder, which is made where there is none."""
    runner, synthesis, reused = _design(modelfile, out, options, progress)
    folder, inputs = runner.folder, _inputs(runner)
    names = {DECK_STAGES[dialect]: (dialect, file_name(dialect)) for dialect in dialects}
    stages: Stages = {stage: (dict(inputs), [name]) for stage, (_, name) in names.items()}
    todo = folder.decide(stages, overwrite=options.overwrite, resume=options.resume)
    if todo:
        progress.stage("decks")
        texts = {name: deck_text(synthesis, dialect) for dialect, name in names.values()}
        with folder.working({stage: stages[stage] for stage in todo}, design_provenance(synthesis)):
            for stage in todo:
                _, name = names[stage]
                folder.write(name, texts[name])
    return _result(runner, [name for _, name in names.values()], reused and not todo)


def deck_text(synthesis: Synthesis, dialect: Dialect) -> str:
    """A deck of a design, with every response that is wanted of it."""
    runs = response_runs(synthesis)
    return simulator_decks.write(
        dialect,
        synthesis.design.circuit,
        runs,
        title=synthesis.modelfile.title,
        notes=simulator_notes(synthesis, dialect, runs),
    )


def _design(
    modelfile: ModelFile, out: Path, options: Options, progress: Progress
) -> tuple[StageRunner, Synthesis, bool]:
    """The folder with its design, and whether the design was there already."""
    runner = StageRunner(modelfile, out, options, progress)
    reused = not runner.decide()
    return runner, runner.design(), reused


def _inputs(runner: StageRunner) -> dict[str, Any]:
    """What decides the files that are exported now."""
    current = {"catalogue": runner.catalog.hash, "version": __version__}
    return {**design_inputs_of(runner.folder), **current}


def _result(runner: StageRunner, files: Sequence[str], reused: bool) -> ExportResult:
    origin = runner.folder.json(DESIGN)["provenance"]
    answer = {"format": 1, "files": sorted(files), "provenance": origin}
    return ExportResult(answer, runner.folder.path, reused)
