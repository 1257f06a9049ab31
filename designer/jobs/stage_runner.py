"""The one way in which a verb works on the stages of a design folder.

What is to be done is decided, and refused, before any work. The design is made, or read where it
stands. Every stage is marked as begun before its first file is written, and as finished after its
last; what is interrupted in between can be resumed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from designer.base import progress
from designer.base.defaults import cores
from designer.base.design_folder import Folder
from designer.base.manifest import StageName, Stages
from designer.base.plain_json import plain
from designer.base.progress import Show, quiet
from designer.base.second_process import Ask
from designer.catalog.parts_catalog import load_catalog
from designer.centering import stage_choice
from designer.check.synthesis_result import Ahead, Synthesis
from designer.folders import board_files, design_files
from designer.folders.design_source import (
    design_answer,
    design_inputs,
    design_stage,
    standing_design,
)
from designer.jobs.compile_ahead import compiling_ahead
from designer.jobs.options import Options
from designer.jobs.writing_process import writing_process
from designer.model.model_file import ModelFile, errors_in


class StageRunner:
    """The design of a folder, and the stages that a verb makes of it.

    Parameters
    ----------
    out : the folder, which need not exist. anew : whether a design that was made with another
    catalogue or version is to be chosen anew; it stands otherwise. shown : is given what is known
    of the design as soon as its parts stand. ahead : as of ``synthesis_result.responses_of``.

    Raises
    ------
    InputError : an option that cannot be, or something else at the folder's place.
    """

    def __init__(
        self,
        modelfile: ModelFile,
        out: Path,
        options: Options,
        *,
        anew: bool = False,
        shown: Show = quiet,
        ahead: Ahead | None = None,
    ) -> None:
        options.check()
        self.modelfile, self.options = modelfile, options
        self.catalog, self.folder, self.shown = load_catalog(), Folder(out), shown
        self.ahead = ahead
        self.stages = (
            design_stage(modelfile, design_inputs(modelfile, self.catalog))
            if anew
            else standing_design(self.folder, modelfile, self.catalog)
        )
        self.todo: list[StageName] = []

    @property
    def design_inputs(self) -> dict[str, Any]:
        """What decides the design, as it is to stand in the folder."""
        return self.stages["design"][0]

    def decide(self, stages: Stages | None = None) -> bool:
        """Whether the design, or one of these stages beside it, is to be done.

        Raises
        ------
        InputError : as ``Folder.decide``, or a design that could not be built.
        """
        self.stages |= stages or {}
        overwrite, resume = self.options.overwrite, self.options.resume
        asked = {"model": self.modelfile.text}
        self.todo = self.folder.decide(self.stages, overwrite=overwrite, resume=resume, asked=asked)
        if "design" in self.todo:
            design_files.check(self.modelfile, self.catalog)
        return bool(self.todo)

    def design(self) -> Synthesis:
        """The design, made and written if that is to be done, else read. All stages are begun."""
        stages = {stage: self.stages[stage] for stage in self.todo}
        if "design" in stages:
            progress.stage("responses of the model, parts")
            jobs = self.options.workers
            with (
                compiling_ahead(
                    self.options.jobs or cores(), self.modelfile.model.second_order()
                ) as compiled,
                writing_process(jobs) as other,
            ):
                synthesis = stage_choice.synthesise(
                    self.modelfile,
                    self.catalog,
                    jobs=jobs,
                    other=other if jobs > 1 else None,
                    ahead=self.ahead,
                )
                self.shown(plain(design_files.chosen(synthesis)))
                compiled()
                synthesis = write_design(
                    self.folder,
                    synthesis,
                    stages,
                    self.options,
                    other,
                    self._other_stage,
                )
        else:
            synthesis = design_files.load(self.folder, self.modelfile, self.catalog)
            self.shown(design_answer(self.folder))
            if stages:
                self.folder.begin(stages, design_files.design_provenance(synthesis))
        return synthesis

    def _other_stage(self, synthesis: Synthesis, other: Ask) -> Callable[[], str] | None:
        """Waits for what is said of the stage that the model file does not state; None where
        nothing has to be looked at. It is looked at in the other process."""
        if self.modelfile.circuit.dead_zone is None:
            return None
        progress.stage("the other stage of the clearance")
        jobs = self.options.workers
        kept = stage_choice.kept_of_doubtful(self.modelfile, synthesis, jobs)
        if kept is None:
            return None
        return other(stage_choice.other_stage, self.modelfile, synthesis, kept, jobs)


def write_design(
    folder: Folder,
    synthesis: Synthesis,
    stages: Stages,
    options: Options,
    other: Ask,
    other_stage: Callable[[Synthesis, Ask], Callable[[], str] | None] = lambda *_: None,
) -> Synthesis:
    """Write a design and its KiCad project, what takes longest at the end: parts can be looked at
    while the rest is sought. The design is returned with what was said of the other stage.

    stages : that begin now, the design among them. other : draws beside this process, which holds
    the interpreter, and takes half of what follows. other_stage : as of ``StageRunner``; asked once
    the project is written.
    """
    from designer.folders import kicad_files  # parts stand before it is needed

    progress.stage("files of the design")
    with errors_in(synthesis.modelfile):
        files = design_files.texts(synthesis)
        drawing = other(board_files.drawing, synthesis)
    inputs = stages["design"][0]
    project = kicad_files.project_texts(folder, synthesis, inputs, options.overwrite)
    folder.begin(stages, design_files.design_provenance(synthesis))
    design_files.write(folder, synthesis, files)
    # The project belongs to a finished design: whoever goes on after an interruption makes both.
    kicad_files.write(folder, synthesis, inputs, project)
    better = other_stage(synthesis, other)
    progress.stage("start recipes, design rules of the circuit")
    synthesis = design_files.write_last(folder, synthesis, options.workers, other, drawing, better)
    folder.finish("design")
    return synthesis
