"""Clearances and laws of combinations of displacements, and mass matrices with couplings: from the
model file to parts that do what the model does."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.stranger_systems import draw
from designer.base.errors import InputError
from designer.check.synthesis_result import Synthesis, synthesise
from designer.circuit.law_curves import law_curves
from designer.circuit.nominal import nominal_reduction, on_circuit
from designer.folders import bench_tables
from designer.model.model_file import parse_model_file
from designer.report import words
from designer.spice import equation_check
from designer.spice.pool import SpicePool
from tests.shared.exploring import quick
from tests.shared.system_text import table
from tests.synthesis.test_law_circuits import shows_what_the_model_does

MATRICES = """\
format = 2
[matrices]
names = ["left", "right"]
mass = [[1.0, 0.2], [0.2, 0.6]]
stiffness = [[3.0, -1.0], [-1.0, 2.5]]
damping = [[0.3, -0.1], [-0.1, 0.25]]
"""
DRIVE = table("force", on="left", amplitude=0.8) + table("response", omega=1.3)
CORNER = (
    table("clearance", name="corner", upper=0.3, stiffness=6.0)
    + "of = { left = 0.8, right = -0.4 }\n"
)
SIDE = table("clearance", name="side", between=["right", "ground"], lower=0.25, stiffness=5.0)
GEARS = (Path(__file__).parents[2] / "examples" / "gears.toml").read_text("utf-8")
TEXTS = {
    "coupled": MATRICES + SIDE + DRIVE,
    "combined": MATRICES + CORNER + SIDE + DRIVE,
    "a law": MATRICES
    + SIDE
    + table("law", name="rock", points=[[-1, -0.4], [-0.2, 0], [0.2, 0], [1, 0.4]])
    + "of = { left = 0.5, right = 0.25 }\n"
    + DRIVE,
}


@pytest.fixture(scope="module")
def pool() -> Iterator[SpicePool]:
    """Workers that import the package once, for all tests of this file."""
    with SpicePool(2) as workers:
        yield workers


@cache
def made(text: str) -> Synthesis:
    return synthesise(parse_model_file(text), jobs=2)


@pytest.mark.parametrize(
    "name", quick([*TEXTS, "gears"])
)  # fmt: skip
def test_chosen_parts_do_what_the_model_does(name: str, pool: SpicePool) -> None:
    """By the reduction of the parts, and by ngspice's own transfer functions, which are of a mass
    that the drive moves: the first one stands still while the gears do not touch."""
    result = made(TEXTS.get(name, GEARS))
    shows_what_the_model_does(result)
    check = equation_check.check(result.design, result.model_responses, pool)
    assert check.passed, check.problem
    assert all(np.isfinite(finding.deviation) for finding in check.findings)


@pytest.mark.slow
def test_a_line_ends_before_an_amplifier_that_sums_clips(pool: SpicePool) -> None:
    """With one stop the sum of displacements goes far on the other side, while others are open."""
    result = synthesise(parse_model_file(draw(1, 12, "linked").text), jobs=2)
    check = equation_check.check(result.design, result.model_responses, pool)
    assert check.passed, check.problem


def test_impacts_and_misses_are_in_the_clearance_s_own_units() -> None:
    """The factors of a sum scale what a board shows of it."""
    result = made(TEXTS["combined"])
    design, (response,) = result.design, result.model_responses
    orbit = on_circuit(nominal_reduction(design).system(), design, response)
    shown = design.in_model_units(orbit, design.volts(response.b))
    wanted = response.orbit
    assert wanted.counts.total > 0
    assert shown.graze == pytest.approx(wanted.graze, abs=0.02)
    order = np.argsort(wanted.impact_times)
    speeds = shown.impact_velocities[np.argsort(shown.impact_times)]
    assert speeds == pytest.approx(wanted.impact_velocities[order], abs=0.02)
    for number, stop in enumerate(design.model.second_order().clearances):
        zone = design.model.second_order().dead_zones[number]
        factor = dict(stop.terms)[zone.mass]
        volts = float(design.errors.scales.volts[2 * zone.mass])
        for side, threshold in design.thresholds(number).items():
            assert threshold == pytest.approx(dict(stop.sides)[side].gap / factor * volts, rel=0.02)


def test_a_sum_without_a_factor_above_0_is_turned_by_the_user() -> None:
    text = MATRICES + CORNER.replace("0.8", "-0.8") + SIDE + DRIVE
    with pytest.raises(InputError) as caught:
        synthesise(parse_model_file(text))
    assert caught.value.field == "clearance corner.of"
    assert "upper and lower exchanged" in caught.value.expected


def test_a_mass_that_matrices_couple_is_reached() -> None:
    """The force is on the other one, and no element of the file joins them."""
    file = parse_model_file(MATRICES + SIDE + DRIVE)
    assert len(file.model.second_order().clearances) == 1


RELATIVE = """\
format = 2
[matrices]
names = ["first", "between"]
mass = [[1.0, 0.3], [0.3, 0.3]]
stiffness = [[2.0, 0.0], [0.0, 1.0]]
damping = [[0.2, 0.0], [0.0, 0.1]]
[[clearance]]
name = "A"
of = { first = 1.0, between = 1.0 }
upper = 0.3
stiffness = 6.0
[[force]]
on = "first"
amplitude = 0.4
[[force]]
on = "between"
amplitude = 0.4
[[response]]
omega = 1.2
"""
"""A mass of 0.7 and one of 0.3 on it, by the displacement between them: M is no diagonal, yet what
pushes both coordinates alike moves the second mass alone."""


def test_what_cancels_in_the_couplings_is_nothing() -> None:
    """No force, coefficient or push of the size of a rounding."""
    system = parse_model_file(RELATIVE).model.second_order()
    assert system.force[0] == 0.0
    assert system.force[1] == pytest.approx(0.4 * 0.3 / 0.3, rel=1e-12)
    (zone,) = system.dead_zones
    assert [mass for mass, _ in zone.pushed] == [1]
    result = made(RELATIVE)
    shows_what_the_model_does(result)
    assert result.design.amplitude() > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_the_picture_of_a_law_is_of_what_it_depends_on(turn: float) -> None:
    """As the board makes it, within its errors, whatever the factors and couplings."""
    text = TEXTS["a law"].replace("0.5, right = 0.25", f"{0.5 * turn}, right = {0.25 * turn}")
    design = made(text).design
    (curve,) = law_curves(design, [], si=False)
    assert curve.symbol == "0.5 x₁ + 0.25 x₂"
    wanted = np.sign(curve.x) * np.maximum(np.abs(curve.x) - 0.2, 0.0) * 0.5
    assert curve.wanted == pytest.approx(wanted, abs=1e-9)
    assert curve.made == pytest.approx(wanted, abs=0.02 * np.abs(wanted).max())


@pytest.mark.slow
def test_thresholds_are_told_on_the_scale_of_their_mass() -> None:
    file = parse_model_file(TEXTS["combined"].replace("0.8, right = -0.4", "0.4, right = -0.8"))
    design = synthesise(file, jobs=2).design
    table = bench_tables.scales_csv(file, design, ())
    rows = [line for line in table.splitlines() if "corner, upper" in line]
    assert design.model.second_order().dead_zones[0].mass == 0
    assert "of v1" in rows[0]


def test_errors_of_dampers_have_words() -> None:
    assert words.coefficient("stop damping B x2' x1'") != "stop damping B x2' x1'"
    assert "damping" in words.coefficient("upper stop damping A")
