"""Design folders for tests that ask nothing of the ways to start a response, nor of the design
rules, nor of pictures, which take longer than everything else that such a folder holds. Each is
made once for all processes of a run."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from designer.check.synthesis_result import Synthesis
from designer.cli import entry
from designer.folders import design_files
from designer.jobs.options import Options
from designer.jobs.synthesise_job import synthesise_into
from designer.model.model_file import parse_model_file
from designer.yields.start_recipe import Recipe
from tests.shared.answer_store import stored
from tests.shared.blank_figures import blank_figures
from tests.shared.model_text import SMALL

STUDY = ("--samples", "6", "--jobs", "1")
EXACT = (*STUDY, "--rung", "exact")
"""The study of a studied folder."""


def without_starts(patched: pytest.MonkeyPatch) -> None:
    """No way to start any response is sought; ``setup.csv`` says so. No rule is looked at."""

    def none(made: Synthesis, jobs: int, other: object) -> list[Recipe | None]:
        return [None] * len(made.model_responses)

    patched.setattr(design_files, "start_recipes", none)
    nothing: dict[str, list[str]] = {"warnings": [], "failed_rules": []}
    patched.setattr(design_files, "findings", lambda *_: nothing)


def quick_folder(text: str, out: Path) -> Path:
    """The design folder of this model file."""
    return _written(_made(text, out.name), out)


def studied_folder(out: Path) -> Path:
    """The design folder of the paper's small file, with a study."""
    return _written(_studied(out.name), out)


@stored
def _made(text: str, name: str) -> dict[str, bytes]:
    """Files by their places. name : the folder's, which commands in them have."""
    with TemporaryDirectory() as place, pytest.MonkeyPatch.context() as patched, blank_figures():
        without_starts(patched)
        out = Path(place) / name
        synthesise_into(parse_model_file(text), out, Options())
        return _files(out)


@stored
def _studied(name: str) -> dict[str, bytes]:
    with TemporaryDirectory() as place, blank_figures():
        out = quick_folder(SMALL, Path(place) / name)
        assert entry.status(["tolerance", str(out), *EXACT, "-q"]) in (0, 1)
        return _files(out)


def _files(folder: Path) -> dict[str, bytes]:
    found = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


def _written(files: dict[str, bytes], out: Path) -> Path:
    for name, content in files.items():
        path = out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return out
