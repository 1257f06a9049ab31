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


def test_attractors_of_one_name_are_told_apart_by_how_far_they_go() -> None:
    def attractor(response: str, ends: tuple[float | None, float | None], share: float) -> Any:
        reach = dict(zip(("x1_min", "x1_max"), ends, strict=True))
        return {
            "response": response,
            "on_twin": None,
            "share": share,
            "low": 0.0,
            "high": 1.0,
            **reach,
        }

    starts = {
        "attractors": [
            attractor("1-1-0", (-0.31, 0.52), 0.25),
            attractor("1-1-0", (-1.2, 0.9), 0.5),
            attractor("2-2-1", (-1.0, 1.0), 0.125),
            attractor("aperiodic", (None, None), 0.0625),
            attractor("aperiodic", (None, None), 0.0625),
        ],
        "not_settled": {"count": 0, "share": 0.0},
        "box": {"x1": 2.0},
        "count": 16,
        "asked": 16,
    }
    text = tables.coexisting(starts)
    ends = "% (0 to 100)"
    first, second = f"1-1-0 (x1 -1.2 to 0.9) 50 {ends}", f"1-1-0 (x1 -0.31 to 0.52) 25 {ends}"
    assert f"{first}; {second}; 2-2-1 12.5 {ends}" in text
    assert text.count("aperiodic 6.25 %") == 2
    assert "in the box x1 ± 2:" in text
    starts["box"] = {"x1": 0.0045, "x1'": 0.26}
    in_si = tables.coexisting(starts, ["hammer"], in_si=True)
    assert "in the box x1 (hammer) ± 4.5 mm, x1' ± 260 mm/s:" in in_si
    assert "1-1-0 (x1 -310 mm to 520 mm) 25 %" in in_si
