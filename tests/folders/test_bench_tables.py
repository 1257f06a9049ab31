"""``setup.csv`` says how to start each response, or why it cannot be started."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from designer.check.synthesis_result import synthesise
from designer.circuit.design import settings
from designer.folders.bench_tables import COLUMNS, NO_RECIPE, setup_csv, start_recipes
from designer.model.model_file import parse_model_file

TEXT = (Path(__file__).resolve().parents[2] / "examples" / "rectifier.toml").read_text("utf-8")


def test_every_response_has_a_start() -> None:
    head, rest = TEXT.split("[[response]]", 1)
    circuit = rest[rest.index("[circuit]") :]
    wanted = "".join(
        f'[[response]]\nomega = {omega}\nexpect = "{expect}"\n'
        for omega, expect in ((1.55, "1-1-1"), (0.54, "1-3-3"), (0.54, "1-9-9"))
    )
    made = synthesise(parse_model_file(head + wanted + circuit))
    recipes = start_recipes(made, 2)
    rows = list(csv.DictReader(io.StringIO(setup_csv(made.design, made.model_responses, recipes))))
    assert tuple(rows[0]) == COLUMNS
    first, second, third = (row["start"] for row in rows)
    # 1-1-1 coexists with 3-3-3, so it is not left to chance; 1-3-3 is alone.
    assert first.startswith("set ")
    assert "sweep logarithmically to " in first
    assert "3-3-3" in first
    assert second.startswith("switch on at this setting; wait ")
    assert third.startswith(NO_RECIPE)
    assert recipes[2] is None
    for recipe, setting in zip(
        recipes[:2], settings(made.design, made.model_responses), strict=False
    ):
        assert recipe is not None
        assert recipe.target.frequency == setting.frequency_hz
        assert recipe.target.amplitude == setting.amplitude_v_peak
    for row, setting in zip(rows, settings(made.design, made.model_responses), strict=True):
        for name, value in (
            ("frequency_hz", setting.frequency_hz),
            ("amplitude_v_peak", setting.amplitude_v_peak),
        ):
            assert float(row[name]) == pytest.approx(value, rel=5e-5)
            assert len(row[name]) <= 8
        assert float(row["amplitude_vpp"]) == 2.0 * float(row["amplitude_v_peak"])
