"""What the terminal says of a study, on standard error."""

from __future__ import annotations

from typing import Any, cast

import pytest

from designer.jobs.bifurcation_job import BifurcationResult
from designer.verbs import bifurcation, rules, simulate, tables


def answer(**more: Any) -> Any:
    return {"samples": 7, "responses": [], "provenance": {"spread": {"name": "bench-1"}}, **more}


def test_a_spread_of_the_model_file_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    tables.tolerance(answer())
    assert "spread" not in capsys.readouterr().err
    tables.tolerance(answer(provenance={"spread": {"name": "model file"}}))
    assert "7 samples, spread of the model file" in capsys.readouterr().err


@pytest.mark.parametrize(("noise", "said"), [({"total_error": 0.01}, 0), ({}, 1)])
def test_noise_that_an_earlier_version_did_not_store_is_said_once(
    noise: dict[str, float], said: int, capsys: pytest.CaptureFixture[str]
) -> None:
    indices = [{"first": 0.1, "total": 0.2, **noise}, {"first": None, "total": None}]
    response = {"blame": {"indices": indices}}
    study: Any = {"blame": {"reason": ""}, "responses": [response, response]}
    tables.attribution_status(study)
    assert capsys.readouterr().err.count("--blame --resume") == said


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

    starts: Any = {
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
    text = simulate.coexisting(starts)
    ends = "% (0 to 100)"
    first, second = f"1-1-0 (x1 -1.2 to 0.9) 50 {ends}", f"1-1-0 (x1 -0.31 to 0.52) 25 {ends}"
    assert f"{first}; {second}; 2-2-1 12.5 {ends}" in text
    assert text.count("aperiodic 6.25 %") == 2
    assert "in the box x1 ± 2:" in text
    starts["box"] = {"x1": 0.0045, "x1'": 0.26}
    in_si = simulate.coexisting(starts, ["hammer"], in_si=True)
    assert "in the box x1 (hammer) ± 4.5 mm, x1' ± 260 mm/s:" in in_si
    assert "1-1-0 (x1 -310 mm to 520 mm) 25 %" in in_si


@pytest.mark.parametrize(
    ("ends", "heads", "place"),
    [
        (
            ("4 Hz", "6 Hz"),
            "from [Hz] to [Hz] from [rad/s] to [rad/s]",
            "at 4.90881 Hz (ω = 30.84298 rad/s): stable",
        ),
        (
            ("25", "38 rad/s"),
            "from [rad/s] to [rad/s] from [Hz] to [Hz]",
            "at ω = 30.84298 rad/s (4.90881 Hz): stable",
        ),
    ],
)
def test_the_unit_that_was_asked_for_comes_first(
    ends: tuple[str, str], heads: str, place: str, capsys: pytest.CaptureFixture[str]
) -> None:
    window = {"track": "up", "from": 25.0, "to": 38.0, "from_hz": 3.9789, "to_hz": 6.0479}
    chaos = {"response": "aperiodic", "symmetric": None, "steps": 9}
    caption = "pitchfork of 1-1-1 symmetric at ω = 30.84298 rad/s: stable above"
    sweep: Any = {
        "kind": "sweep",
        "unit": "rad/s",
        "si_unit": "Hz",
        "windows": [{**window, **chaos, "lyapunov": (1.0, 2.0), "lyapunov_error": 0.1}],
        "points": [
            {
                "kind": "pitchfork",
                "before": "1-1-1",
                "after": "1-1-1",
                "caption": caption,
                "value": 30.84298,
                "value_hz": 4.90881,
            }
        ],
    }
    bifurcation.show(BifurcationResult(sweep, False, None, ends, cast(Any, None)))
    text = " ".join(capsys.readouterr().err.split())
    assert f"track {heads} response" in text
    assert "λ [1/s]" in text
    assert place in text


def test_families_and_narrow_windows_of_a_sweep_are_said_once(
    capsys: pytest.CaptureFixture[str],
) -> None:
    known = {"kind": "limit of the parameter", "value": 0.0, "error": 0.0}
    few = {"kind": "not looked for", "value": 0.0, "error": None, "reason": "fewer than 4 steps"}
    long = {**few, "reason": "its period is longer than 4"}

    def window(response: str, steps: int, family: int | None, end: Any) -> dict[str, Any]:
        place = {"track": "up", "from": 0.1, "to": 0.2, "symmetric": False, "steps": steps}
        ends = {} if family is None else {"from_end": end, "to_end": end}
        return {**place, "response": response, "family": family, **ends}

    def said(*windows: Any) -> list[str]:
        sweep: Any = {"kind": "sweep", "unit": "", "windows": windows, "points": []}
        result = BifurcationResult(sweep, False, None, ("", ""), cast(Any, None))
        bifurcation.show(result)
        return capsys.readouterr().err.splitlines()

    joined = window("1-1-1", 9, 1, known), window("1-1-2", 8, 1, known)
    text = said(*joined, window("aperiodic", 3, None, None), window("2-1-1", 2, 2, few))
    (head,) = (line for line in text if line.startswith("track"))
    place = head.index("family")
    assert [line[place] for line in text if line.startswith("up")] == ["1", "1", "-", "2"]
    assert sum("windows of one family" in line for line in text) == 1
    assert sum("--steps" in line for line in text) == 1
    # One window a family, and an end that no finer sweep finds: neither is said.
    plain = said(window("1-1-1", 9, 1, known), window("5-1-1", 6, 2, long))
    assert not any("family" in line or "--steps" in line for line in plain)
    assert any("longer than 4" in line for line in plain)


def test_the_figure_of_a_design_rule_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    row = {
        "id": "common-mode",
        "status": "pass",
        "title": "Room to the range's end",
        "found": "11 V at U1B",
        "limit": "at least 0 V",
        "reason": None,
    }
    judged: Any = {"rules": [row], "counts": {"pass": 1, "fail": 0, "not run": 0}}
    rules.tables(judged)
    assert "Room to the range's end 11 V at U1B" in " ".join(capsys.readouterr().err.split())


def test_what_is_not_good_enough_is_the_first_line(capsys: pytest.CaptureFixture[str]) -> None:
    design: Any = {
        "parts": {"R1": 1e3},
        "max_error": 0.19,
        "certificate": {"status": "bound", "lower_bound": 0.0},
        "distinct_values": 1,
        "knobs": [],
        "dead_zone": None,
    }
    tables.synthesised(design)
    assert capsys.readouterr().err.startswith("\nParts")
    rule = {"id": "swing", "found": "11.3 V", "limit": "at most 11 V", "do": "scale down"}
    found = {"warnings": ["The error is 19 %."], "failed_rules": [rule]}
    tables.whole_job(answer(**design, **found))
    first, _, title, heads, row, *_ = capsys.readouterr().err.splitlines()
    assert first == "Not good enough: The error is 19 %."
    assert title == "Design rules that fail"
    assert heads.split() == ["rule", "found", "limit", "what", "to", "do"]
    assert row.split("  ")[0] == "swing"
    assert [part in row for part in ("11.3 V", "at most 11 V", "scale down")] == [True] * 3
