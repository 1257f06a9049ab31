"""The second process of a verb that makes a design. A verb may start it before it imports what it
needs itself: then both import at once, and the model's responses are found meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from importlib import import_module
from typing import TYPE_CHECKING

from designer.base.second_process import Ask, other_process

if TYPE_CHECKING:
    from designer.model.find_responses import ModelResponse
    from designer.model.model_file import ModelFile

FINDING = ("designer.model.find_responses",)
"""Modules that find responses."""
WRITING = "designer.schematic.schematic_drawing", "designer.folders.board_files"
"""Modules that are imported while the parts are chosen, and needed once they stand."""


def writing_process(jobs: int) -> AbstractContextManager[Ask]:
    """The one that is there, or a new one, as of ``other_process``."""
    return other_process(jobs, *WRITING)


def finding_process(jobs: int) -> AbstractContextManager[Ask]:
    """A ``writing_process`` that is to be asked for responses first (``ask_responses``)."""
    return other_process(jobs, *FINDING)


def ask_responses(
    other: Ask, modelfile: ModelFile
) -> Callable[[], tuple[ModelResponse, ...] | None]:
    """Waits for the model's responses, as of ``find_responses.find``; what writes is imported once
    they are found. None where kernels would have to be compiled first, which this process does at
    the same time. Where there is no other process they are found here, when they are asked for."""
    answer = other(_responses, modelfile)
    other(_import, WRITING)
    return answer


def _responses(modelfile: ModelFile) -> tuple[ModelResponse, ...] | None:
    from designer.base import jit
    from designer.model.find_responses import find

    system = modelfile.model.second_order()
    if not jit.stored_whole(jit.CIRCUITS.format(masses=system.size)):
        return None
    return find(modelfile.model, modelfile.responses)


def _import(modules: tuple[str, ...]) -> None:
    for name in modules:
        import_module(name)
