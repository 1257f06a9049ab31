"""Parts, responses, starts, KiCad project and tracks of the same design, computed once for all
processes of a run: for tests that ask what becomes of a design, and nothing of how it is found. A
report's attractors that coexist with a response are sought from few starts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from designer.base.progress import quiet
from designer.check import coexistence, synthesis_result
from designer.folders import bench_tables, kicad_files
from designer.jobs import board_routing
from designer.schematic import schematic_drawing
from designer.synthesis import parts_choice
from tests.shared.answer_store import stored

FEW = 8
"""Starts whose attractors a report lists; ``tests/report/test_write.py`` has all of them."""


@contextmanager
def made_once() -> Iterator[None]:
    """Inside, equal arguments have the answer that they had before; errors are raised anew."""
    attractors = coexistence.of_model

    def few(model: Any, omega: float, lives: tuple[int, ...] = ()) -> Any:
        return attractors(model, omega, FEW, lives=lives)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(coexistence, "of_model", stored(few))
        choose = stored(parts_choice.synthesise)

        def synthesise(*order: Any, stand: Callable[[Any], None] = quiet, **named: Any) -> Any:
            design = choose(*order, **named)
            stand(design)
            return design

        patched.setattr(parts_choice, "synthesise", synthesise)
        for module, name, of in (
            (synthesis_result, "find", None),
            (bench_tables, "find_recipes", 1),  # the plan; not who computes
            (kicad_files, "files", 1),
            (schematic_drawing, "svg", None),
            (board_routing, "route_board", 3),  # not where the board was read
        ):
            patched.setattr(module, name, stored(getattr(module, name), of))
        yield
