"""What the study of a design folder says of rare losses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from designer.answers.rare_words import any_lost_words, boards_at, loss_words
from designer.base.design_folder import MODEL, TOLERANCE, Folder, is_design_folder
from designer.base.errors import InputError
from designer.base.guarded_reading import reading
from designer.base.si_unit import drive_text
from designer.explorer.place import first_place
from designer.explorer.wire import Message
from designer.folders.model_source import design_inputs_of
from designer.model.model_file import ModelFile
from designer.model.response_table import Response

if TYPE_CHECKING:
    from designer.answers.study_answer import RareLossKeys, StudyAnswer, StudyResponse


@dataclass(frozen=True)
class ResponseLosses:
    """Boards of a million that lose one response."""

    omega: float
    """Its drive frequency in the model's units."""
    b: float
    """The clearance it is wanted at."""
    summary: str
    """The response in words."""
    words: str


@dataclass(frozen=True)
class FolderLosses:
    """Boards of a million that lose the responses of a folder."""

    words: str
    """Which boards these are."""
    b: float
    """The clearance, or factor on gaps, that the page starts at."""
    rows: tuple[ResponseLosses, ...]
    """One for each response with an estimate."""

    def message(self) -> Message:
        """What the page writes of it."""
        return {"b": self.b, "rows": [asdict(row) for row in self.rows]}


def folder_losses(modelfile: ModelFile, note: Callable[[str], None]) -> FolderLosses | None:
    """Of a design folder's model file; None where there is no folder, or no finished estimate.

    note : is told of a study that cannot be read, which the page does without.
    """
    path = modelfile.source
    if path is None or path.name != MODEL or not is_design_folder(path.parent):
        return None
    try:
        return _found(modelfile, Folder(path.parent))
    except InputError as error:
        note(f"no boards of a million are shown: {error}")
        return None


def _found(modelfile: ModelFile, folder: Folder) -> FolderLosses | None:
    stage = None if folder.manifest is None else folder.manifest.stages.get("study")
    if stage is None or not stage.complete:
        return None
    if design_inputs_of(folder).get("model") != modelfile.sha256:
        return None
    study = folder.json(TOLERANCE)
    with reading(folder / TOLERANCE, "a finished study"):
        return _read(study, modelfile)


def _read(study: StudyAnswer, modelfile: ModelFile) -> FolderLosses | None:
    each = zip(modelfile.responses, study["responses"], strict=True)
    asked = [(spec, row, found) for spec, row in each if (found := row.get("rare"))]
    if not asked:
        return None
    origin, own = study["provenance"], modelfile.model.b
    if origin["spread"] is None:
        raise ValueError("a study without the spread of its boards")
    words = (
        "Estimated by tolerance --rare for the parts of this folder, boards "
        f"{boards_at(origin['spread']['temperature'])}, seed {origin['seed']}."
    )
    if any_lost := study.get("any_lost"):
        words += f" {any_lost_words(any_lost)}."
    shown = first_place(modelfile).model.b
    return FolderLosses(words, shown, tuple(_row(*one, own) for one in asked))


def _row(spec: Response, response: StudyResponse, rare: RareLossKeys, own: float) -> ResponseLosses:
    omega, b = float(response["omega"]), own if spec.b is None else spec.b
    if isinstance(b, tuple):
        raise ValueError("a response of the model file that leaves b open")
    place = drive_text(omega, response.get("frequency_hz"), 6)
    if b != own:
        place += f", b = {b:.6g}"
    wanted = response["expected"] or response["model"]
    return ResponseLosses(omega, b, f"{wanted} at {place}", loss_words(rare))
