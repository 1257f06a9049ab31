"""What the study of a design folder says of rare losses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from designer.base.design_folder import MODEL, TOLERANCE, Folder, is_design_folder
from designer.base.guarded_reading import reading
from designer.base.rare_words import any_lost_words, boards_at, loss_words
from designer.base.si_unit import drive_text
from designer.explorer.wire import Message
from designer.folders.model_source import design_inputs_of
from designer.model.model_file import ModelFile


@dataclass(frozen=True)
class FolderLosses:
    """Boards of a million that lose the responses of a folder."""

    words: str
    """Which boards these are."""
    rows: tuple[tuple[float, str, str], ...]
    """Of each response its drive frequency in the model's units, itself and its losses in words."""

    def message(self) -> Message:
        """What the page writes of it."""
        keys = ("omega", "summary", "words")
        return {"rows": [dict(zip(keys, row, strict=True)) for row in self.rows]}


def folder_losses(modelfile: ModelFile) -> FolderLosses | None:
    """Of a design folder's model file; None where there is no folder, or no finished estimate.

    Raises
    ------
    InputError : its study cannot be read.
    """
    path = modelfile.source
    if path is None or path.name != MODEL or not is_design_folder(path.parent):
        return None
    folder = Folder(path.parent)
    stage = None if folder.manifest is None else folder.manifest.stages.get("study")
    if stage is None or not stage.complete:
        return None
    if design_inputs_of(folder).get("model") != modelfile.sha256:
        return None
    study = folder.json(TOLERANCE)
    with reading(folder / TOLERANCE, "a finished study"):
        return _read(study)


def _read(study: Mapping[str, Any]) -> FolderLosses | None:
    asked = [r for r in study["responses"] if r.get("rare")]
    if not asked:
        return None
    origin = study["provenance"]
    words = (
        "Estimated by tolerance --rare for the parts of this folder, boards "
        f"{boards_at(origin['spread']['temperature'])}, seed {origin['seed']}."
    )
    if any_lost := study.get("any_lost"):
        words += f" {any_lost_words(any_lost)}."
    return FolderLosses(words, tuple(map(_row, asked)))


def _row(response: Mapping[str, Any]) -> tuple[float, str, str]:
    omega = float(response["omega"])
    place = drive_text(omega, response.get("frequency_hz"), 6)
    wanted = response["expected"] or response["model"]
    return omega, f"{wanted} at {place}", loss_words(response["rare"])
