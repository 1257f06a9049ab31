"""What the terminal says of a study, on standard error."""

from __future__ import annotations

from typing import Any

import pytest

from designer.cli import tables


def answer(**more: Any) -> dict[str, Any]:
    return {"samples": 7, "responses": [], "provenance": {"spread": {"name": "bench-1"}}, **more}


def test_a_spread_of_the_model_file_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    tables.tolerance(answer())
    assert "spread" not in capsys.readouterr().err
    tables.tolerance(answer(provenance={"spread": {"name": "model file"}}))
    assert "7 samples, spread of the model file" in capsys.readouterr().err


@pytest.mark.parametrize(("narrow", "said"), [(True, "boards: reached"), (False, "NOT reached")])
def test_whether_the_width_was_reached(
    narrow: bool, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    tables.tolerance(answer())
    assert "reached" not in capsys.readouterr().err
    tables.tolerance(answer(until=0.05, narrow=narrow))
    err = capsys.readouterr().err
    assert "narrower than 5 %" in err
    assert said in err
