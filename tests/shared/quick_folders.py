"""Design folders for tests that ask nothing of the ways to start a response, nor of the design
rules, which take longer than everything else that such a folder holds."""

from __future__ import annotations

from pathlib import Path

import pytest

from designer.base.progress import Progress
from designer.check.synthesis_result import Synthesis
from designer.folders import design_files
from designer.jobs.options import Options
from designer.jobs.synthesise_job import synthesise_into
from designer.model.model_file import parse_model_file
from designer.yields.start_recipe import Recipe


def without_starts(patched: pytest.MonkeyPatch) -> None:
    """No way to start any response is sought; ``setup.csv`` says so. No rule is looked at."""

    def none(made: Synthesis, jobs: int, other: object) -> list[Recipe | None]:
        return [None] * len(made.model_responses)

    patched.setattr(design_files, "start_recipes", none)
    nothing: dict[str, list[str]] = {"warnings": [], "failed_rules": []}
    patched.setattr(design_files, "findings", lambda *_: nothing)


def quick_folder(text: str, out: Path) -> Path:
    """The design folder of this model file."""
    with pytest.MonkeyPatch.context() as patched:
        without_starts(patched)
        synthesise_into(parse_model_file(text), out, Options(), Progress())
    return out
