"""The second process of a verb that makes a design. A verb may start it before it imports what it
needs itself: then both import at once."""

from __future__ import annotations

from contextlib import AbstractContextManager

from designer.base.second_process import Ask, other_process

WRITING = "designer.schematic.schematic_drawing", "designer.folders.board_files"
"""Modules that are imported while the parts are chosen, and needed once they stand."""


def writing_process(jobs: int) -> AbstractContextManager[Ask]:
    """The one that is there, or a new one, as of ``other_process``."""
    return other_process(jobs, *WRITING)
