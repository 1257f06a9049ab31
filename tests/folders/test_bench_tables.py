"""``setup.csv`` says how to start each response, or why it cannot be started; ``scales.csv`` where
contact begins."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from designer.check.synthesis_result import synthesise
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.design import Certificate, Design, settings
from designer.circuit.netlist import Resistor
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.folders.bench_tables import (
    COLUMNS,
    NO_RECIPE,
    scales_csv,
    setup_csv,
    start_recipes,
)
from designer.model.find_responses import ModelResponse
from designer.model.model_file import parse_model_file
from designer.report.design_tables import scale_table
from tests.shared.chains import chain_text
from tests.shared.exact_circuits import Scale, exact_circuit
from tests.shared.system_text import clearance, system_text, table

pytestmark = pytest.mark.usefixtures("designs_are_made_once")

TEXT = (Path(__file__).resolve().parents[2] / "examples" / "rectifier.toml").read_text("utf-8")


@pytest.mark.slow
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


def test_each_stop_of_several_clearances_has_its_threshold() -> None:
    """Exact values, 3 V and 5 V per unit of x1 and x2; one threshold's resistor 5 % too large."""
    uneven = {"upper": 0.3, "lower": 0.5, "stiffness": 5.0}
    text = chain_text(
        2,
        clearance("A", "m1", "ground", **uneven),
        clearance("B", "m2", "ground", upper=0.2, stiffness=8.0),
    )
    file = parse_model_file(text)
    system = file.model.second_order()
    circuit = exact_circuit(system, Scale(1e-3, np.array([3.0, 3.0, 5.0, 5.0]), 1.0))
    parts = tuple(
        replace(part, value=1.05 * part.value)
        if isinstance(part, Resistor) and part.name == "R301"
        else part
        for part in circuit.parts
    )
    circuit = replace(circuit, parts=parts)
    errors = coefficient_errors(circuit, system)
    design = Design(file.model, circuit, errors, Certificate("bound", 0.0, ""), {}, {}, 0.0)
    rows = list(csv.DictReader(io.StringIO(scales_csv(file, design, ()))))
    thresholds = {r["quantity"]: r["value"] for r in rows if "threshold" in r["quantity"]}
    assert thresholds == {
        "threshold of contact, A, upper stop, of v1": "0.9",
        "threshold of contact, A, lower stop, of v1": "1.5",
        "threshold of contact, B, upper stop, of v3": "0.952381",
    }


@pytest.mark.parametrize("amplitude", ["0.8 g", "0.6 mm"])
def test_a_volt_stands_for_an_acceleration_of_the_base(amplitude: str) -> None:
    """The generator's amplitude times that is the stated motion: Y ω² of a displacement Y."""
    text = system_text(
        {"hammer": "0.5 kg", "table": "1.5 kg"},
        {("hammer", "table"): "2 kN/m", ("table", "ground"): "9 kN/m"},
        {("hammer", "table"): "6 N s/m", ("table", "ground"): "9 N s/m"},
        clearance("A", "hammer", "table", upper="1 mm", stiffness="38 kN/m"),
        f'[base]\namplitude = "{amplitude}"\n',
        *(table("response", frequency=f"{hertz} Hz") for hertz in (15, 8)),
    )
    file = parse_model_file(text)
    system = file.model.second_order()
    circuit = exact_circuit(system, Scale(1e-2, np.full(4, 3000.0), 1.0))
    errors = coefficient_errors(circuit, system)
    design = Design(file.model, circuit, errors, Certificate("bound", 0.0, ""), {}, {}, 0.0)
    responses = tuple(
        ModelResponse(spec, 1.0, Orbit(OrbitStatus.PERIODIC), (), True) for spec in file.responses
    )
    rows = list(csv.DictReader(io.StringIO(setup_csv(design, responses, [None, None], file.si))))
    scale = float(rows[0]["base_m_s2_per_v"])
    assert float(rows[1]["base_m_s2_per_v"]) == pytest.approx(scale, rel=1e-5)
    for row, hertz in zip(rows, (15.0, 8.0), strict=True):
        moved = 0.6e-3 * (2.0 * math.pi * hertz) ** 2 if "mm" in amplitude else 0.8 * 9.80665
        assert float(row["amplitude_v_peak"]) * scale == pytest.approx(moved, rel=1e-4)
    card = {r["quantity"]: r for r in csv.DictReader(io.StringIO(scales_csv(file, design, ())))}
    own = card["acceleration of the base per generator volt"]
    assert own["unit"] == "m/s²/V"
    assert float(own["value"]) == pytest.approx(scale, rel=1e-5)
    shown = scale_table(design, file.si)
    assert shown is not None
    texts = {row[0]: row[1] for row in shown.rows}
    text = texts["one generator volt, of the base's acceleration"]
    assert text == f"{scale:.4g} m/s² ({scale / 9.80665:.4g} g)"
