"""Whole circuits of other systems than the paper's: chosen, reduced and run."""

from __future__ import annotations

import pytest

from designer.base.errors import InputError
from designer.catalog.parts_catalog import load_catalog
from designer.check.synthesis_result import synthesise
from designer.circuit.nominal import nominal_reduction, on_circuit
from designer.model.model_file import parse_model_file
from designer.spice import equation_check
from designer.spice.pool import SpicePool
from designer.synthesis.attempt import largest_amplitudes
from designer.synthesis.part_checks import check_choices
from tests.shared.exploring import quick
from tests.shared.system_text import clearance, system_text, table

TWO = system_text(
    {"one": 1.0, "two": 1.0},
    {("one", "two"): 1.0, ("two", "ground"): 1.0},
    {("one", "two"): 0.3, ("two", "ground"): 0.4},
    clearance("A", "one", "ground", upper=0.5, lower=0.6, upper_stiffness=5.0, lower_stiffness=6.0),
    clearance("B", "one", "two", upper=0.3, stiffness=4.0),
    table("force", on="one", amplitude=1.0, constant=-0.1),
    table("response", omega=1.3),
    '[circuit]\ndead_zone = "rectifier"\n',
)


@pytest.mark.slow
def test_two_unequal_clearances_one_between_masses_and_a_weight() -> None:
    """The chosen parts follow the model: errors by the reduction, the orbit, and ngspice's own
    transfer functions, slopes and thresholds in each contact that a constant force reaches."""
    made = synthesise(parse_model_file(TWO))
    design = made.design
    assert design.errors.max_error < 5e-3
    assert all(check.holds for check in design.checks)
    assert {"gap A lower", "gap B upper", "constant x1", "stop slope B x2' x1"} <= set(
        design.errors.errors
    )
    (response,) = made.model_responses
    orbit = on_circuit(nominal_reduction(design).system(), design, response)
    assert orbit.counts == response.orbit.counts
    with SpicePool(2) as pool:
        check = equation_check.check(design, made.model_responses, pool)
    names = {finding.name for finding in check.findings}
    assert {"transfer, open", "slope, upper contact A", "threshold, upper contact B"} <= names
    assert check.passed, check.problem


def one_mass(*clearances: str) -> str:
    return system_text(
        {"one": 1.0},
        {("one", "ground"): 1.0},
        {("one", "ground"): 0.1},
        *clearances,
        table("force", on="one", amplitude=1.5),
        table("response", omega=0.8),
        '[circuit]\ndead_zone = "rectifier"\nresistors = "E24"\n',
    )


ONE = one_mass(
    clearance(
        "A", "one", "ground", upper=1.26, lower=1.26, upper_stiffness=20.0, lower_stiffness=2.0
    )
)
LINKED = system_text(
    {"one": 1.0, "two": 1.5},
    {("one", "two"): 1.0, ("two", "ground"): 1.0},
    {("one", "two"): 0.2, ("two", "ground"): 0.3},
    clearance("A", "one", "two", upper=0.3, lower=0.3, upper_stiffness=25.0, lower_stiffness=3.0),
    table("force", on="one", amplitude=1.0),
    table("response", omega=1.3),
    '[circuit]\ndead_zone = "rectifier"\n',
)
SHAKEN = (
    ONE.replace('[[force]]\non = "one"\namplitude = 1.5', "[base]\namplitude = 1.0")
    .replace("lower = 1.26\n", "")
    .replace("upper_stiffness = 20.0\nlower_stiffness = 2.0", "stiffness = 29.0")
    .replace("omega = 0.8", "omega = 1.4\nb = 0.8")
)


@pytest.mark.parametrize(
    ("text", "objective"), quick([(ONE, "margin"), (ONE, "match"), (LINKED, "margin")])
)
def test_stops_too_unequal_for_one_output_get_one_each(text: str, objective: str) -> None:
    """Ten times as steep as the other one: what the circuit does is what the model does, in the
    file's own clearance."""
    file = parse_model_file(text.replace("[circuit]", f'[circuit]\nobjective = "{objective}"'))
    made = synthesise(file)
    assert all(check.holds for check in made.design.checks)
    assert made.design.errors.max_error < 0.01
    circuit = made.design.circuit
    assert {"R210", "R211", "R212"} <= set(circuit.values)
    assert not {"R208", "R209"} & set(circuit.values)
    assert [stop.output for stop in circuit.stops] == ["fv"]
    (response,) = made.model_responses
    orbit = on_circuit(nominal_reduction(made.design).system(), made.design, response)
    assert orbit.counts == response.orbit.counts
    assert orbit.counts is not None
    assert all(orbit.counts.impacts[0])


def test_the_generator_is_within_its_range_where_the_base_force_grows_with_frequency() -> None:
    """The force of a moving base follows the square of the drive frequency."""
    file = parse_model_file(SHAKEN)
    made = synthesise(file)
    (response,) = made.model_responses
    assert largest_amplitudes(file.model, [response]) == pytest.approx((1.4**2 / 0.8,))
    design = made.design
    ratio = design.amplitude(response.b, response.omega) / design.amplitude()
    assert ratio == pytest.approx(1.4**2 / 0.8)
    assert {c.name for c in design.checks if c.holds} == set(file.circuit.active_conditions)


@pytest.mark.parametrize(
    ("change", "field", "text"),
    [
        (("upper_stiffness = 5.0", "damping = 0.1\nupper_stiffness = 5.0"), "clearance A.damping",
         "for each"),
        (("stiffness = 4.0", "stiffness = 4.0\npreload = 0.1"), "clearance B.preload", "jumps"),
        (("[[response]]", '[base]\namplitude = 0.1\nstops = "fixed"\n[[friction]]\nforce = 0.1\n'
          'between = ["one", "ground"]\nvelocity = 0.1\n[[response]]'), "base.stops",
         "the displacement of the ground is no voltage"),
        (('"rectifier"', '"saturation"'), "circuit.dead_zone", "unequal stops in clearance A"),
        (("[[response]]", '[[cubic_spring]]\nbetween = ["one", "ground"]\nk1 = 0.1\nk3 = 1.0\n'
          "range = 1.0\n[[response]]"), "circuit", "12 for one-ground.cubic"),
    ],
)  # fmt: skip
def test_what_no_circuit_can_do_is_refused(change: tuple[str, str], field: str, text: str) -> None:
    file = parse_model_file(TWO.replace(*change))
    with pytest.raises(InputError) as caught:
        check_choices(file.model, file.circuit, load_catalog())
    assert caught.value.field == field
    assert text in str(caught.value)
