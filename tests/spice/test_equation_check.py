"""The equation check: right circuits pass, wrong ones do not, and the bounds are what they say."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer.base.plain_json import dumps
from designer.check.synthesis_result import Synthesis, synthesise
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.design import Certificate, Design
from designer.circuit.netlist import Circuit, Resistor
from designer.jobs.study_stage import satisfied
from designer.model.clearance import Sides
from designer.model.mechanics import MechanicalModel, SecondOrderSystem
from designer.model.model import Dimensionless
from designer.model.model_file import parse_model_file, read_model_file
from designer.spice.equation_check import (
    FLOOR,
    EquationCheck,
    EquationFinding,
    check,
    explained,
    transfer,
)
from designer.spice.pool import SpicePool
from designer.verbs import tables
from tests.shared.exact_circuits import Scale, exact_circuit
from tests.shared.exploring import quick
from tests.shared.model_text import COARSE_CIRCUIT, PAPER_TABLE
from tests.shared.paper_cases import synthesised
from tests.shared.stages import bought, model as stage_model, one_sided, rectifier, stage
from tests.shared.system_text import clearance, system_text, table

COARSE = (
    "format = 1\n"
    + PAPER_TABLE.replace("f20 = 0.0", "f20 = 0.3")
    + "[[response]]\nomega = 0.85\n"
    + COARSE_CIRCUIT
)
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
OPEN = ("transfer, open",)
ALL = {
    "transfer, open", "transfer, upper contact", "transfer, lower contact",
    "slope, upper contact", "slope, lower contact",
    "threshold, upper contact", "threshold, lower contact", "leftover slope",
}  # fmt: skip


@cache
def made(name: str) -> Synthesis:
    if name == "paper":
        return synthesised()
    text = COARSE.replace("k0 = 0.95", "k0 = 0.0") if name == "no stops" else COARSE
    return synthesise(parse_model_file(text))


@pytest.fixture(scope="module")
def pool() -> Iterator[SpicePool]:
    with SpicePool(2) as pool:
        yield pool


def by_name(result: EquationCheck) -> dict[str, EquationFinding]:
    return {f.name: f for f in result.findings}


def with_value(design: Design, name: str, factor: float) -> Design:
    """The design with one resistor that is not what the errors were computed from."""
    parts = tuple(
        replace(p, value=p.value * factor) if isinstance(p, Resistor) and p.name == name else p
        for p in design.circuit.parts
    )
    return replace(design, circuit=replace(design.circuit, parts=parts))


# ---------------------------------------------------------------------------------------------
# Formulas


@pytest.mark.parametrize("contact", [0, 1])
def test_transfer_function_of_two_masses(contact: int) -> None:
    """Against the determinant written out."""
    d = Dimensionless(m=0.3, k=0.4, k0=0.9, c=0.2, zeta=0.07, f20=0.25, b=0.2)
    omega = np.array([0.1, 0.7, 1.3, 4.0])
    s = 1j * omega
    m2 = d.m / (1 - d.m)
    z11 = s**2 + 2 * d.zeta * s + 1 + (d.mu if contact else 0.0)
    z12 = -(2 * d.zeta * s + 1)
    z22 = m2 * s**2 + 2 * d.zeta / (1 - d.c) * s + 1 / (1 - d.k)
    exact = (z22 * (1 - d.f20) - z12 * d.f20) / (z11 * z22 - z12**2)
    np.testing.assert_allclose(transfer(d.second_order(), omega, (contact,)), exact, rtol=1e-12)


def test_explained_is_the_sum_of_all_sensitivities() -> None:
    """Each coefficient changed by a millionth in turn, by differences; what a damper feels comes
    through an integrator whose error changes it once more."""
    model = Dimensionless(0.3, 0.4, 0.9, 0.2, 0.07, 0.25, 0.2).second_order()
    omega, step = np.array([0.3, 0.9, 2.0]), 1e-6
    base = transfer(model, omega, (1,))
    total = np.zeros(3)

    def add(changed: SecondOrderSystem) -> None:
        nonlocal total
        total = total + np.abs(transfer(changed, omega, (1,)) / base - 1.0) / step

    for i in range(2):
        mass = model.mass.copy()
        mass[i] *= 1.0 + step
        add(replace(model, mass=mass))
        for j in range(2):
            for name in ("damping", "stiffness"):
                matrix = getattr(model, name).copy()
                matrix[i, j] *= 1.0 + step
                for _ in range(2 if name == "damping" else 1):
                    add(replace(model, **{name: matrix}))
    side = replace(
        model.clearances[0].first, stiffness=model.clearances[0].first.stiffness * (1.0 + step)
    )
    stop = replace(model.clearances[0], upper=side, lower=side)
    add(replace(model, clearances=(stop,)))
    leftover = model.stiffness.copy()
    leftover[0, 0] += step
    add(replace(model, stiffness=leftover))
    np.testing.assert_allclose(explained(model, omega, (1,)), total, rtol=1e-4)


# ---------------------------------------------------------------------------------------------
# Circuits


@pytest.mark.parametrize(
    ("name", "findings"), [("paper", ALL), ("coarse", ALL), ("no stops", set(OPEN))]
)
def test_right_circuits_pass(pool: SpicePool, name: str, findings: set[str]) -> None:
    design = made(name).design
    result = check(design, made(name).model_responses, pool)
    assert set(by_name(result)) == findings
    assert result.passed, result.worst
    assert all(f.reason == "" for f in result.findings)
    if design.errors.max_error < 1e-12:
        assert all(f.deviation < FLOOR / 10.0 for f in result.findings)
    elif design.circuit.stops:
        # What ngspice measures is what the reduction of the parts says.
        slope = abs(design.errors.errors["stop slope"])
        assert by_name(result)["slope, upper contact"].deviation == pytest.approx(slope, abs=1e-5)
        assert by_name(result)["transfer, open"].deviation > FLOOR
    assert result.high == pytest.approx(10.0 * result.low)
    said = result.as_dict()
    assert said["passed"] is True
    assert len(said["findings"]) == len(findings)


def around(circuit: Circuit, model: MechanicalModel) -> Design:
    """A design of a circuit that is there already."""
    errors = coefficient_errors(circuit, model.second_order())
    return Design(model, circuit, errors, Certificate("bound", 0.0, "none"), {}, {}, 0.0)


STAGES: dict[str, tuple[Circuit, Sides]] = {
    "rectifier": (stage("rectifier", "both", rectifier()), "both"),
    "rectifier, bought": (stage("rectifier", "both", bought(rectifier(2.1))), "both"),
    "rectifier, upper": (stage("rectifier", "upper", rectifier(sides="upper")), "upper"),
    "rectifier, lower": (stage("rectifier", "lower", rectifier(sides="lower")), "lower"),
    "saturation, upper": (stage("saturation", "upper", one_sided()), "upper"),
    "saturation, lower": (stage("saturation", "lower", one_sided()), "lower"),
}


@pytest.mark.parametrize("name", quick(STAGES))
def test_every_stage_passes(pool: SpicePool, name: str) -> None:
    circuit, sides = STAGES[name]
    design = around(circuit, stage_model(sides))
    result = check(design, (), pool)
    contacts = {"both": ("upper", "lower"), "upper": ("upper",), "lower": ("lower",)}[sides]
    kinds = ("transfer", "slope", "threshold")
    expected = {f"{kind}, {c} contact" for c in contacts for kind in kinds}
    assert set(by_name(result)) == {"transfer, open", "leftover slope", *expected}
    assert result.passed, [str(f) for f in result.findings]
    feedback = "R202" if sides != "lower" else "R205"
    if name.startswith("rectifier"):
        wrong = around(circuit, stage_model(sides))
        spoilt = check(with_value(wrong, feedback, 1.05), (), pool)
        assert not by_name(spoilt)[f"slope, {contacts[0]} contact"].passed


def test_a_stage_between_two_masses_is_read_by_what_moves_in_it(pool: SpicePool) -> None:
    """Its displacement is on a net of its own, whose volts are not those of the first mass."""
    model = read_model_file(EXAMPLES / "backlash.toml").model
    system = model.second_order()
    scale = Scale(1e-3, np.array([8.0, 8.0, 5.0, 6.0]), 1.0)
    result = check(around(exact_circuit(system, scale), model), (), pool)
    assert set(by_name(result)) == ALL
    assert all(f.deviation < FLOOR / 10.0 for f in result.findings)


def test_a_clearance_that_no_constant_force_moves_has_no_curve(pool: SpicePool) -> None:
    """m2 hangs on m1 alone: what pushes m1 moves both as far, and the clearance between them not at
    all, so no slope can be read in it."""
    hanging = clearance("B", "m1", "m2", upper=0.5, lower=0.5, stiffness=5.0)
    force = table("force", on="m1", amplitude=1.0)
    links = {("m1", "ground"): 1.0, ("m2", "m1"): 1.0}
    wall = clearance("A", "m1", "ground", upper=0.5, stiffness=5.0)
    text = system_text(
        {"m1": 1.0, "m2": 1.0}, links, dict.fromkeys(links, 0.1), force, hanging, wall
    )
    model = parse_model_file(text).model
    circuit = exact_circuit(model.second_order(), Scale(1e-3, np.full(4, 4.0), 1.0))
    result = check(around(circuit, model), (), pool)
    assert result.passed, [str(f) for f in result.findings]
    assert {name for name in by_name(result) if "slope" in name} == {
        "slope, upper contact A", "leftover slope A",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("part", "factor", "wrong"),
    [
        ("R4", 1.02, OPEN),
        ("R2", 1.1, OPEN),
        ("R50", 1.02, ("slope, upper contact", "transfer, lower contact")),
        ("R201", 1.02, ("threshold, upper contact", "threshold, lower contact", "leftover slope")),
        ("R204", 1.02, ("leftover slope",)),
        ("R6", 1.02, OPEN),
    ],
)
def test_wrong_parts_are_found(
    pool: SpicePool, part: str, factor: float, wrong: tuple[str, ...]
) -> None:
    synthesis = made("paper")
    result = check(with_value(synthesis.design, part, factor), synthesis.model_responses, pool)
    assert not result.passed
    found = by_name(result)
    for name in wrong:
        assert not found[name].passed, found[name]
    assert not result.worst.passed


def test_a_sign_that_is_wrong_is_found(pool: SpicePool) -> None:
    synthesis = made("paper")
    parts = tuple(
        replace(p, a={"v1": "v1n", "v1n": "v1"}[p.a])
        if isinstance(p, Resistor) and p.name == "R4"
        else p
        for p in synthesis.design.circuit.parts
    )
    design = replace(synthesis.design, circuit=replace(synthesis.design.circuit, parts=parts))
    assert not check(design, synthesis.model_responses, pool).passed


@pytest.mark.parametrize("values", quick([rectifier(5.0), bought(rectifier(5.0))]))
def test_a_diode_that_ngspice_finds_better_alone(pool: SpicePool, values: dict[str, float]) -> None:
    """Told where the op-amps rest, ngspice ends here with "source stepping failed"."""
    result = check(around(stage("rectifier", "both", values), stage_model("both")), (), pool)
    assert set(by_name(result)) == ALL
    assert result.passed, [str(f) for f in result.findings]


def test_a_contact_is_looked_at_as_far_as_the_other_half_stays_blocked(pool: SpicePool) -> None:
    """The idle half holds its output at 10 V and a diode; past that the two halves work against
    each other, at currents that no op-amp gives. Half a clearance deep fv would be 11.8 V."""
    steep = {name: 4.75 * rectifier()[name] for name in ("R202", "R205", "R50")}
    circuit = stage("rectifier", "both", rectifier() | steep)
    result = check(around(circuit, stage_model("both")), (), pool)
    assert set(by_name(result)) == ALL
    assert result.passed, [str(f) for f in result.findings]


def test_a_check_without_an_answer_is_open_and_a_wrong_one_is_not() -> None:
    right, wrong = EquationFinding("slope", 0.1, 0.2), EquationFinding("slope", 0.3, 0.2)
    silent = EquationFinding("slope", float("nan"), 0.2, "no answer")
    assert EquationCheck((right, silent)).open
    assert not EquationCheck((right, silent)).passed
    assert not EquationCheck((wrong, silent)).open
    assert not EquationCheck((right,)).open


@pytest.mark.parametrize(
    ("deviation", "reason", "words"),
    [
        (math.nan, "singular matrix", "is not to be trusted here: second: singular matrix"),
        (0.5, "", "does not compute the model's equation: second: 0.5, bound 0.1"),
        (0.01, "", ""),
    ],
)
def test_what_did_not_pass_is_said_again_from_the_file(
    deviation: float, reason: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """The exit status is 1 then, also where a finished folder is shown again."""
    found = EquationCheck(
        (EquationFinding("first", 0.01, 0.1), EquationFinding("second", deviation, 0.1, reason))
    )
    assert found.problem.endswith(words)
    assert bool(found.problem) is bool(words)
    written = json.loads(dumps(found.as_dict()))
    origin = {"spread": None}
    answer: Any = {
        "samples": 1, "responses": [], "equation_check": written, "provenance": origin
    }  # fmt: skip
    tables.tolerance(answer)
    assert ("equation" in capsys.readouterr().err) is bool(words)
    assert EquationCheck.read(written).problem == found.problem
    assert satisfied(answer) is not bool(words)


def test_a_deck_that_ngspice_cannot_solve_says_why(pool: SpicePool) -> None:
    synthesis = made("paper")
    circuit = synthesis.design.circuit
    loose = replace(circuit, parts=(*circuit.parts, Resistor("R999", "e1", "e2", 1e3, "")))
    result = check(replace(synthesis.design, circuit=loose), synthesis.model_responses, pool)
    assert not result.passed
    assert result.worst.reason
