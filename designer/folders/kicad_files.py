"""The KiCad project of a design folder: a stage of its own, so that a board may be edited.

Other verbs do not look at its files; ``export`` and a design made anew write them, and what
somebody has changed is replaced only with ``--overwrite``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from designer.base import progress
from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.base.manifest import StageName, Stages, file_hash
from designer.board.board_parts import board_circuit
from designer.board.component import components
from designer.board.kicad_reader import BoardFile, read_board
from designer.board.kicad_rules import board_rules, project_rules, rules_text
from designer.catalog.fab import fab_limits
from designer.check.checked_design import CheckedResponse
from designer.check.deck_runs import first_run
from designer.check.synthesis_result import Synthesis
from designer.folders.design_files import design_provenance
from designer.model.model_file import errors_in
from designer.schematic.kicad_project import Project, files

STAGE: StageName = "kicad"
FOLDER = "kicad"


def texts(synthesis: Synthesis, checked: CheckedResponse | None = None) -> dict[str, str]:
    """Every file of the project by its name inside the design folder.

    checked : of the first response; the sheet then runs at its gate's settings.

    Raises
    ------
    InputError : a footprint that is not known here, or a part of the board that is not sold.
    """
    with errors_in(synthesis.modelfile):
        circuit, choice = board_circuit(synthesis)
        parts = components(circuit, synthesis.catalog, choice)
        rules = rules_text(board_rules(circuit, synthesis.modelfile.rules))
        limits = project_rules(fab_limits([], synthesis.catalog.folders))
        run = first_run(synthesis, checked)
        file = synthesis.modelfile
        project = Project(file.title, circuit, parts, run, rules, limits, file.board.date)
        return {f"{FOLDER}/{name}": text for name, text in files(project).items()}


def project_texts(
    folder: Folder,
    synthesis: Synthesis,
    inputs: Mapping[str, Any],
    overwrite: bool,
) -> dict[str, str]:
    """Every file of the project, for a verb that writes more beside it; none where there can be no
    project.

    Raises
    ------
    InputError : files that the manifest does not list are in the way.
    """
    progress.stage("KiCad project")
    try:
        project = texts(synthesis)
    except InputError as error:
        progress.note(f"no KiCad project: {error}")
        return {}
    folder.decide(stages(inputs, project), overwrite=overwrite, resume=True)
    return project


def stages(inputs: Mapping[str, Any], files: Mapping[str, str]) -> Stages:
    """The stage as the folder is asked for it. inputs : the design's."""
    return {STAGE: (dict(inputs), list(files))}


def write(
    folder: Folder, synthesis: Synthesis, inputs: Mapping[str, Any], files: Mapping[str, str]
) -> None:
    """Write the stage."""
    if not files:
        return
    with folder.working(stages(inputs, files), design_provenance(synthesis)):
        for name, text in files.items():
            folder.write(name, text)


def settle(folder: Folder, synthesis: Synthesis, checked: CheckedResponse) -> None:
    """Let the sheet run at the settings of the gate, if nobody has changed it."""
    sheet = _untouched(folder, ".kicad_sch")
    if sheet is not None:
        folder.rewrite(sheet, texts(synthesis, checked)[sheet])


def own_board(folder: Folder) -> BoardFile | None:
    """The project's board as the tool has written it; None where somebody has changed it."""
    board = _untouched(folder, ".kicad_pcb")
    return None if board is None else read_board(folder / board)


def _untouched(folder: Folder, ending: str) -> str | None:
    """Name of the project's file of this kind, if it is as the manifest says."""
    listed = {} if folder.manifest is None else folder.manifest.files
    name = next((n for n in listed if n.startswith(FOLDER) and n.endswith(ending)), None)
    if name is None:
        return None
    path, digest = folder / name, listed[name][1]
    if not path.is_file():
        return None
    # No digest: the tool was about to write it anew and was killed.
    return name if digest in (None, file_hash(name, path.read_bytes())) else None
