"""The page of one design as one file that needs no server and no network."""

from __future__ import annotations

from pathlib import Path

from designer.base.atomic_write import appearing
from designer.base.errors import InputError
from designer.base.progress import Progress
from designer.explorer.branch_recording import BranchRecording, places, record
from designer.explorer.explorer_page import recorded_page
from designer.explorer.recorded_yields import RecordedYields, yields
from designer.explorer.wire import Message
from designer.jobs.options import Options
from designer.model.model_file import ModelFile

FIELD = "--save"


def save_page(
    modelfile: ModelFile,
    path: Path,
    options: Options,
    progress: Progress,
) -> None:
    """Write the page of a model with the views along ω, the windows and the yields in it: as many
    views along the slider as 3 MB have room for.

    Raises
    ------
    InputError : the file is there and is not to be replaced, or cannot be written; an option that
    cannot be.
    """
    options.check()
    _check_place(path, options.overwrite)
    branch = record(modelfile, places(modelfile), options.workers, progress)
    counted = yields(modelfile, options, progress)
    page = recorded_page(modelfile, message_of(branch, counted))
    with appearing(path, FIELD) as partial:
        partial.write_text(page, encoding="utf-8")
    progress.note(f"{path} shows {modelfile.title} at {len(branch.omegas)} drive frequencies")


def message_of(branch: BranchRecording, counted: RecordedYields) -> Message:
    """What a saved page has in place of a server's answers."""
    return {
        "omegas": branch.omegas,
        "views": branch.views,
        "strip": branch.strip,
        "windows": [each.message() for each in branch.windows],
        "yields": {
            "words": counted.words,
            "rows": [each.message() for each in counted.rows],
        },
    }


def _check_place(path: Path, overwrite: bool) -> None:
    """Refuse before minutes of work what could not be written after them."""
    if path.is_dir() or not path.parent.is_dir():
        raise InputError(path, FIELD, "no place for a file", "a file in a folder that is there")
    if path.exists() and not overwrite:
        raise InputError(path, FIELD, "a file", "a name that is free, or --overwrite")
