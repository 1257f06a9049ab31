"""Parts, responses, starts, KiCad project and tracks of the same design, computed once for all
processes of a run: for tests that ask what becomes of a design, and nothing of how it is found."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from designer.check import synthesis_result
from designer.folders import bench_tables, kicad_files
from designer.jobs import board_routing
from designer.schematic import schematic_drawing
from designer.synthesis import parts_choice
from tests.shared.answer_store import stored


@contextmanager
def made_once() -> Iterator[None]:
    """Inside, equal arguments have the answer that they had before; errors are raised anew."""
    with pytest.MonkeyPatch.context() as patched:
        for module, name, of in (
            (parts_choice, "synthesise", None),
            (synthesis_result, "find", None),
            (bench_tables, "find_recipes", 1),  # the plan; not who computes
            (kicad_files, "files", 1),
            (schematic_drawing, "svg", None),
            (board_routing, "route_board", 3),  # not where the board was read
        ):
            patched.setattr(module, name, stored(getattr(module, name), of))
        yield
