"""A verb's argument: the model file in it, and the folder to write into."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from designer.base.design_folder import DESIGN, MEASURED, MODEL, Folder, is_design_folder
from designer.base.errors import MISSING, InputError
from designer.model.model_file import ModelFile, read_model_file


def model_file(path: Path) -> ModelFile:
    """Read a model file; a design folder's has its measured values from the folder's own copy, and
    where it states no title that of the file it was copied from."""
    if path.name != MODEL or not is_design_folder(path.parent):
        return read_model_file(path)
    modelfile = read_model_file(path, measured=path.parent / MEASURED)
    if modelfile.title != path.stem or not (path.parent / DESIGN).is_file():
        return modelfile
    title = Folder(path.parent).json(DESIGN).get("title")
    if not isinstance(title, str) or len(title.splitlines()) != 1:
        return modelfile
    return replace(modelfile, title=title)


def model_of(model: Path | str | ModelFile) -> ModelFile:
    """The model file of a verb that writes nothing into a folder: one that was read, its path, or a
    design folder.

    Raises
    ------
    InputError : none of these.
    """
    if isinstance(model, ModelFile):
        return model
    return source(model, model)[0] if Path(model).is_dir() else model_file(Path(model))


def source(model: Path | str | ModelFile, out: Path | str | None) -> tuple[ModelFile, Path]:
    """The model file of a verb's argument (one that was read, its path, or a design folder), and
    the folder to write into.

    Raises
    ------
    InputError : none of these, or a model file without ``out``.
    """
    place = None if out is None else Path(out)
    if isinstance(model, ModelFile) or not Path(model).is_dir():
        modelfile = model if isinstance(model, ModelFile) else model_file(Path(model))
        if place is None:
            stem = "model" if isinstance(model, ModelFile) else Path(model).stem
            expected = f"a folder to write the design into, such as --out out/{stem}"
            raise InputError(None, "--out", MISSING, expected)
        return modelfile, place
    path = Path(model)
    if not is_design_folder(path):
        expected = "a model file (TOML) or a design folder"
        raise InputError(path, "the folder", "no manifest.json", expected)
    modelfile = model_file(path / MODEL)
    if design_inputs_of(Folder(path)).get("model") != modelfile.sha256:
        raise InputError(
            path / MODEL,
            "its sha256",
            modelfile.sha256[:12] + "…",
            "the model that this folder was made from; a changed model needs a folder of its own "
            "(give the file and --out)",
        )
    return modelfile, place or path


def design_inputs_of(folder: Folder) -> dict[str, Any]:
    """Inputs of the folder's design; empty where there is none."""
    design = folder.manifest.stages.get("design") if folder.manifest else None
    return {} if design is None else design.inputs
