"""One exact circuit for each kind of element: model, reduction and ngspice show one response."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from designer.check import checked_design
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.design import Certificate, Design
from designer.model.find_responses import ModelResponse, find
from designer.model.model_file import parse_model_file
from designer.spice import equation_check
from designer.spice.numerics_gate import WAVE_BOUND
from designer.spice.pool import SpicePool
from tests.shared.chains import chain_text
from tests.shared.exact_circuits import Scale, exact_circuit
from tests.shared.system_text import clearance, system_text, table

PEAK = 4.0
"""Volts of every state's peak."""
GROUND = ("m1", "ground")


def force(**keys: float) -> str:
    return table("force", on="m1", **{"amplitude": 1.0, **keys})


BASE = "[base]\namplitude = 0.7\n"
CASES = {
    "a base that moves": (
        1,
        1.2,
        "1-1-0",
        (clearance("A", *GROUND, upper=0.6, stiffness=8.0), BASE),
    ),
    "preloaded": (
        1,
        1.5,
        "1-1-1",
        (
            clearance(
                "A", *GROUND, upper=0.4, lower=-0.1, upper_stiffness=6.0, lower_stiffness=3.0
            ),
            force(),
        ),
    ),
    "unequal sides": (
        1,
        1.2,
        "1-1-1",
        (
            clearance("A", *GROUND, upper=0.4, lower=0.6, upper_stiffness=8.0, lower_stiffness=5.0),
            force(),
        ),
    ),
    "a constant force": (
        1,
        1.2,
        "1-0-1",
        (clearance("A", *GROUND, lower=0.5, stiffness=8.0), force(constant=-0.3)),
    ),
    "between masses": (
        2,
        1.2,
        "1-1-1",
        (clearance("A", "m1", "m2", upper=0.3, lower=0.3, stiffness=5.0), force()),
    ),
    "with dampers in the stops": (
        2,
        1.2,
        "1-1-1",
        (clearance("A", "m1", "m2", upper=0.3, lower=0.3, stiffness=5.0, damping=0.5), force()),
    ),
    "stiffening in steps": (
        1,
        1.2,
        "1-1-0;1-0;1-0",
        (
            clearance("A", *GROUND, upper=0.3, stiffness=1.0),
            clearance("B", *GROUND, upper=0.5, stiffness=2.0),
            clearance("C", *GROUND, upper=0.6, stiffness=3.0),
            force(),
        ),
    ),
    "on both masses": (
        2,
        1.2,
        "1-1-1;1-0",
        (
            clearance("A", *GROUND, upper=0.3, lower=0.3, stiffness=5.0),
            clearance("B", "m2", "ground", upper=0.2, stiffness=8.0),
            force(),
        ),
    ),
}


@pytest.fixture(scope="module")
def pool() -> Iterator[SpicePool]:
    with SpicePool(1) as pool:
        yield pool


def design_of(text: str) -> tuple[Design, tuple[ModelResponse, ...]]:
    """A design whose values are exact, each state's peak at `PEAK`."""
    file = parse_model_file(text)
    found = find(file.model, file.responses)
    system = file.model.second_order()
    peaks = np.abs(found[0].orbit.extremes).max(axis=1)
    circuit = exact_circuit(system, Scale(1e-3, PEAK / peaks, 1.0))
    circuit = replace(circuit, saturation=13.0)
    errors = coefficient_errors(circuit, system)
    return Design(file.model, circuit, errors, Certificate("bound", 0.0, ""), {}, {}, 0.0), found


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_ngspice_shows_the_model_s_response(case: str, pool: SpicePool) -> None:
    """The same n-p-q from all, ngspice's wave that of the exact circuit, and ngspice's own transfer
    functions, slopes and thresholds those of the model."""
    masses, omega, response, more = CASES[case]
    design, found = design_of(chain_text(masses, *more, table("response", omega=omega)))
    assert found[0].orbit.response == response
    (checked,) = checked_design.check(design, found, pool)
    assert checked.agrees, (checked.circuit.response, checked.ngspice)
    assert checked.gate is not None
    assert checked.gate.wave < WAVE_BOUND
    shown = design.in_model_units(checked.circuit, design.volts())
    assert shown.graze == pytest.approx(found[0].orbit.graze, rel=1e-2)
    assert shown.impact_velocities == pytest.approx(found[0].orbit.impact_velocities, rel=1e-2)
    traces = checked_design.traces(design, checked)
    grid = traces["model"].time
    peaks = np.abs(found[0].orbit.extremes).max(axis=1)
    for i, peak in enumerate(peaks):
        spice = np.interp(grid, traces["ngspice"].time, traces["ngspice"].states[:, i])
        assert np.abs(spice - traces["model"].states[:, i]).max() < 2e-2 * peak
    check = equation_check.check(design, found, pool)
    assert check.passed, check.problem


def test_a_contact_in_which_ngspice_once_found_no_rest_is_answered(pool: SpicePool) -> None:
    """A beam's tip between two steep stops, in SI units: the integrators' loop as a whole left
    ngspice without an operating point in the upper contact."""
    between = {GROUND: "2.56e6 N/m"}, {GROUND: "929 N s/m"}
    stops = {"upper_stiffness": "7.2e7 N/m", "lower_stiffness": "3.99e7 N/m"}
    gaps = {"upper": "0.38 mm", "lower": "0.117 mm"}
    design, found = design_of(
        system_text(
            {"m1": "2.97 kg"},
            *between,
            clearance("A", *GROUND, **gaps, **stops),
            table("force", on="m1", amplitude="1920 N"),
            table("response", frequency="174.2 Hz"),
        )
    )
    check = equation_check.check(design, found, pool)
    assert check.passed, check.problem
    assert len(check.findings) == 8
