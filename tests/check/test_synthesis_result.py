"""What is said while parts are chosen."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from designer.base.errors import InputError
from designer.base.progress import MINUTE, ProgressLines
from designer.check import synthesis_result
from designer.circuit.design import Design
from designer.model.model_file import parse_model_file
from designer.synthesis import parts_choice
from tests.shared.system_text import system_text, table

ONE = system_text(
    {"m": 1.0},
    {("m", "ground"): 1.0},
    {("m", "ground"): 0.1},
    table("force", on="m", amplitude=1.0),
    table("response", omega=0.8),
)


def test_no_parts_are_sought_once_they_stand(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the side conditions cost may take minutes more."""
    now, chosen = [0.0], parts_choice.synthesise

    def slowly(*asked: Any, stand: Callable[[Design], None], **words: Any) -> Design:
        def late(design: Design) -> None:
            stand(design)
            now[0] += MINUTE
            lines.beat()

        return chosen(*asked, stand=late, **words)

    monkeypatch.setattr(parts_choice, "synthesise", slowly)
    with ProgressLines(lambda: now[0]) as lines:
        synthesis_result.synthesise(parse_model_file(ONE))
    said = capsys.readouterr().err
    assert said.count("parts stand after") == 1
    assert "best so far" not in said


def test_parts_of_which_no_board_can_be_do_not_stand(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object) -> None:
        raise InputError(None, "spread", "a network", "another one")

    monkeypatch.setattr(synthesis_result, "spread_of", refuse)
    with ProgressLines(), pytest.raises(InputError, match="another one"):
        synthesis_result.synthesise(parse_model_file(ONE))
    assert "parts stand" not in capsys.readouterr().err
