"""Scales first: what follows from them is the wanted equation, an empty box is a proof, and the
choice keeps every condition on its finished circuit."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.base.errors import Unreachable
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.design import Design
from designer.circuit.noise_gains import stages
from designer.circuit.static_shifts import forces, least_drive
from designer.linear_network.linear_search import lower_bound
from designer.linear_network.linear_terms import Bounds, LinearQuestion, Targets
from designer.model.circuit_table import CircuitSpec
from designer.model.find_responses import Peaks, Reach, find, peaks
from designer.model.model_file import parse_model_file
from designer.synthesis import parts_choice
from designer.synthesis.attempt import Order, largest_amplitudes
from designer.synthesis.further_stages import idle_shares
from designer.synthesis.limits import ConditionLimits, limits
from designer.synthesis.scale_box import ScaleBox
from designer.synthesis.scale_choice import ScaleAttempt, ScaleChoice
from designer.synthesis.scale_program import (
    Affine,
    ExponentialSum,
    LinearBound,
    ScaleProgram,
    StatedLimit,
)
from tests.shared.exploring import quick, seeds
from tests.shared.system_text import clearance, system_text, table
from tests.shared.term_enumeration import everything

CATALOG = load_catalog()
FORCE = table("force", on="a", amplitude=1.0)
ONE = system_text(
    {"a": 1.0},
    {("a", "ground"): 1.0},
    {("a", "ground"): 0.1},
    FORCE,
    clearance("A", "a", "ground", upper=0.5, lower=0.3, upper_stiffness=9.0, lower_stiffness=6.0),
    table("response", omega=1.3),
)
"""One mass between unequal stops, which was refused while values were searched before scales."""
TWO = (
    {"a": 1.0, "b": 0.7},
    {("a", "ground"): 1.0, ("a", "b"): 0.8},
    {("a", "ground"): 0.2, ("a", "b"): 0.1},
)
SYSTEMS = {
    "unequal": ONE,
    "between masses": system_text(
        *TWO, FORCE, clearance("A", "a", "b", upper=0.3, lower=0.2, stiffness=7.0)
    ),
    "preloaded, constant": system_text(
        *TWO,
        table("force", on="b", amplitude=1.0, constant=-0.2),
        clearance("A", "b", "ground", lower=-0.1, stiffness=5.0),
        clearance("B", "b", "a", upper=0.25, stiffness=9.0),
    ),
    "three clearances": system_text(
        *TWO,
        FORCE,
        clearance("A", "a", "ground", upper=0.3, lower=0.3, stiffness=4.0),
        clearance("B", "b", "ground", upper=0.4, stiffness=6.0),
        clearance("C", "a", "b", lower=0.2, stiffness=8.0),
    ),
}


@cache
def program(name: str) -> tuple[Order, ConditionLimits, ScaleProgram]:
    model = parse_model_file(SYSTEMS[name]).model
    system = model.second_order()
    reach = Reach(0.3, 0.5, 0.8, (0.3, 0.2))
    held = Peaks(np.linspace(0.8, 1.2, 2 * system.size), (reach,) * len(system.clearances), 5.0)
    spec = CircuitSpec(dead_zone="rectifier")
    order = Order.of(model, spec, CATALOG, held)
    conditions = spec.active_conditions
    unit = system.own_frequency
    within = limits(spec, conditions, order.opamp, order.output.limit, held.fastest, unit=unit)
    return order, within, ScaleProgram.of(order, within)


class Rest(dict[str, float]):
    """Parts without a value: 10 kΩ for inverters, nothing to speak of for the drive and feeds."""

    def __missing__(self, name: str) -> float:
        number = int(name[1:])
        return 1e4 if number % 100 in (24, 25) or 100 <= number < 150 else 1e13


def unrounded(made: ScaleProgram, z: Array) -> Rest:
    values = made.values(z, np.array([row.log.at(z) for row in made.rows]))
    clamps = {f"R{number + 100 * k}": 100.0 for k in range(3) for number in (208, 209)}
    return Rest(clamps | values)


@pytest.mark.parametrize("name", SYSTEMS)
def test_resistors_that_follow_make_the_wanted_equation(name: str) -> None:
    # By nodal analysis of the circuit with the values as they follow, before they are rounded.
    order, _, made = program(name)
    z = ScaleBox(made).best()
    assert z is not None
    errors = coefficient_errors(order.build(unrounded(made, z)), order.model.second_order())
    assert errors.max_error < 1e-6
    assert errors.scales.seconds == pytest.approx(np.exp(z[0]), rel=1e-6)
    volts = np.exp(z[1 : 1 + len(errors.scales.volts)])
    assert errors.scales.volts == pytest.approx(volts, rel=1e-6)


@pytest.mark.parametrize("name", SYSTEMS)
def test_loads_gains_and_bandwidths_are_those_of_the_nets(name: str) -> None:
    order, within, made = program(name)
    z = ScaleBox(made).best()
    assert z is not None
    circuit = order.build(unrounded(made, z))
    there = {stage.section.name: stage for stage in stages(circuit)}
    frequency = order.peaks.fastest / (2.0 * np.pi * np.exp(z[0]))
    checked = 0
    for each in made.sums:
        kind, _, where = each.limit.what.rpartition(" of ")
        stage, limit = there[where], each.limit.value
        wanted = {
            "load": limit / stage.load,
            "noise gain": stage.gain / limit,
            "noise gain times frequency": stage.bandwidth(frequency) / limit,
        }[kind]
        # What is sized afterwards, such as a clamp's resistor, can only load an output further.
        assert np.exp(each.at(z)) <= wanted * (1.0 + 1e-6)
        if kind != "load":
            assert np.exp(each.at(z)) == pytest.approx(wanted, rel=1e-6)
            checked += 1
    assert checked > 0
    assert within.noise_gain == 30.0


def flat(cases: Array) -> ScaleProgram:
    """Half planes and convex sums of two numbers, each with a limit of its own."""
    bounds = tuple(
        LinearBound(Affine(row[:2], row[2]), StatedLimit("level", f"bound {k}", 1.0))
        for k, row in enumerate(cases)
    )
    round_ = StatedLimit("load", "sum", 1.0)
    logs = tuple(
        Affine(np.array(w), -1.5) for w in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
    )
    return ScaleProgram(
        lists=(np.zeros(0), np.zeros(0)),
        shared={},
        rows=(),
        bounds=bounds,
        sums=(ExponentialSum(logs, round_),),
        thresholds=(),
        levels=(Affine(np.array([1.0, 0.0])),),
        outputs=(),
    )


GRID = np.stack(np.meshgrid(*[np.linspace(-8.0, 8.0, 401)] * 2), axis=-1).reshape(-1, 2)


def room(
    made: ScaleProgram, without: frozenset[StatedLimit], wider: dict[StatedLimit, float]
) -> float:
    """By brute force: the least, over a grid, by which the worst limit is missed."""
    worst = np.full(len(GRID), -np.inf)
    for bound in made.bounds:
        if bound.limit not in without:
            value = GRID @ bound.log.weights + bound.log.constant - wider.get(bound.limit, 0.0)
            worst = np.maximum(worst, value)
    for each in made.sums:
        if each.limit not in without:
            value = np.logaddexp.reduce([GRID @ g.weights + g.constant for g in each.logs])
            worst = np.maximum(worst, value - wider.get(each.limit, 0.0))
    return float(worst.min())


@pytest.mark.parametrize("seed", quick(seeds(6), 2))
def test_conflicts_are_irreducible_and_say_how_far_each_has_to_give(seed: int) -> None:
    random = np.random.default_rng(seed)
    angles = random.uniform(0.0, 2.0 * np.pi, 5)
    shifts = random.uniform(-0.6, 0.4, 5)
    made = flat(np.column_stack([np.cos(angles), np.sin(angles), -shifts]))
    near = 0.06  # of the grid
    missed = room(made, frozenset(), {})
    found = ScaleBox(made).conflicts()
    if abs(missed) < near:
        return
    assert bool(found) == (missed > 0.0)
    own = [conflict.limit for conflict in found]
    every = {b.limit for b in made.bounds} | {s.limit for s in made.sums}
    if not found:
        return
    assert room(made, frozenset(every - set(own)), {}) > 0.0
    for conflict in found:
        same = {limit for limit in every if limit.condition == conflict.limit.condition}
        left = room(made, frozenset(same), {})
        assert conflict.frees is (left <= 0.0) or abs(left) < near
        assert room(made, frozenset(every - set(own) | {conflict.limit}), {}) < near
        if np.isfinite(conflict.needed):
            given = np.log(conflict.needed)
            assert room(made, frozenset(), {conflict.limit: given + near}) < near
            assert room(made, frozenset(), {conflict.limit: given - near}) > -near


@pytest.mark.parametrize(("least", "needed"), [(False, np.inf), (True, 0.0)])
def test_a_limit_that_no_number_helps_says_so(least: bool, needed: float) -> None:
    """It is missed by e^100, further than any scale goes."""
    made = flat(np.array([[0.0, 0.0, 100.0], [1.0, 0.0, -50.0]]))
    limit = StatedLimit("level", "bound", 1.0, least=least)
    made = replace(made, bounds=(replace(made.bounds[0], limit=limit), made.bounds[1]))
    (conflict,) = ScaleBox(made).conflicts()
    assert (conflict.limit, conflict.needed, conflict.frees) == (limit, needed, True)


def test_points_are_corners_as_many_as_asked_for_and_the_best() -> None:
    """Of a pentagon, whose corners are where neighbouring sides meet."""
    angles = 2.0 * np.pi * np.arange(5) / 5.0
    sides = np.column_stack([np.cos(angles), np.sin(angles)])
    made = replace(flat(np.column_stack([sides, -np.ones(5)])), sums=())
    corners = np.array([np.linalg.solve(sides[[k, k - 1]], np.ones(2)) for k in range(5)])
    box = ScaleBox(made)
    points = np.array(box.points(8, 10.0, seed=3))
    apart = np.linalg.norm(points[:, None] - corners, axis=2)
    assert len(points) == 1 + 8
    assert apart.min(axis=1) == pytest.approx(np.zeros(9), abs=1e-9)
    assert len(set(apart.argmin(axis=1).tolist())) > 2
    assert points[0, 0] == pytest.approx(corners[:, 0].max())  # the level is the first number
    near = box.points(8, 0.02, seed=3)
    assert len(near) == 1 + 8
    assert min(box.worth(z) for z in near) >= box.worth(near[0]) - 0.02 - 1e-9


def test_scales_that_were_good_are_good_again_without_another_start() -> None:
    order, within, _ = program("unequal")
    first = next(ScaleChoice(order, within).circuits())
    assert isinstance(first, ScaleAttempt)
    choice = ScaleChoice(order, within)
    again = next(choice.circuits(first.z))
    assert isinstance(again, ScaleAttempt)
    assert again.made.errors.max_error <= choice.goal
    assert len(choice.candidates) <= 4
    assert min(np.abs(own.z - first.z).max() for own in choice.candidates) < 0.1


def test_where_no_scales_keep_the_offsets_small_the_choice_is_that_without_the_rule() -> None:
    order, within, _ = program("unequal")
    weak, strong = (ScaleChoice(replace(order, drive_force=force), within) for force in (1e-6, 1e6))
    for choice in (weak, strong):
        assert isinstance(next(choice.circuits()), ScaleAttempt)
    assert [c.error for c in weak.candidates] == [c.error for c in strong.candidates]


def design(text: str, jobs: int = 1, **changes: object) -> Design:
    file = parse_model_file(text)
    responses = find(file.model, file.responses)
    spec = replace(CircuitSpec(dead_zone="rectifier"), **changes)  # type: ignore[arg-type]
    held = peaks(file.model, responses)
    return parts_choice.synthesise(file.model, spec, CATALOG, held, responses, jobs=jobs)


def test_unequal_stops_get_parts_and_the_thresholds_their_swing() -> None:
    made = design(ONE)
    assert made.errors.max_error <= 0.001  # a tenth of the parts' grade
    assert all(check.holds for check in made.checks)
    # 0.5 and 0.3 of a peak of 0.88, which may have 11.05 V.
    assert made.errors.scales.threshold > 6.0
    assert made.errors.scales.threshold_lower > 3.5
    allowed = re.search(r"the lowest is (\S+) V; .* allows (\S+) V", made.certificate.proof)
    assert allowed is not None
    assert 3.5 < float(allowed[1]) <= float(allowed[2])
    assert made.certificate.lower_bound <= made.errors.max_error
    assert design(ONE, jobs=2).circuit.values == made.circuit.values


@pytest.mark.parametrize(
    "stops",
    [
        clearance("A", "a", "ground", upper=-0.28, lower=2.05, stiffness=14.0),
        clearance("A", "a", "ground", upper=0.4, stiffness=9.0)
        + clearance("B", "a", "ground", lower=2.5, stiffness=9.0),
    ],
)
def test_a_stop_that_is_never_met_is_within_reach(stops: str) -> None:
    """At the scales that suit the motion no op-amp reached it, and nothing was found."""
    one = {"a": 1.0}, {("a", "ground"): 1.0}, {("a", "ground"): 0.3}
    made = design(system_text(*one, FORCE, stops, table("response", omega=1.0)))
    assert made.errors.max_error <= 0.005
    assert all(check.holds for check in made.checks)


def test_a_mass_that_nothing_moves_has_the_voltages_of_one_that_moves() -> None:
    """No level of its own is to be had: a circuit was refused for want of it."""
    joints = {("a", "ground"): 1.0, ("b", "ground"): 1.3}
    dampers = {("a", "ground"): 0.2, ("b", "ground"): 0.15}
    stops = clearance("A", "a", "b", upper=5.0, stiffness=12.0)
    two = system_text({"a": 1.0, "b": 0.7}, joints, dampers, stops, FORCE)
    made = design(two + table("response", omega=0.8))
    assert made.errors.max_error <= 0.005
    assert "level" in {check.name for check in made.checks}
    assert all(check.holds for check in made.checks)


def test_an_idle_clamp_carries_what_the_other_half_does_at_the_deepest() -> None:
    # (t + t') / R' + d (1 / R' - s / F') of circuit.dead_zone_parts.idle_limits, over its first
    # term; s / (F' / R') is the ratio of the stiffnesses.
    stops = parse_model_file(ONE).model.second_order().clearances[0]
    shares = idle_shares(stops, Reach(0.6, 0.0, 0.9, (0.4, 0.6)))
    assert shares[1] == pytest.approx(1.0 + 0.4 * (1.0 - 9.0 / 6.0) / 0.8)
    assert shares[-1] == pytest.approx(1.0 + 0.6 * (1.0 - 6.0 / 9.0) / 0.8)
    held = Reach(2.0, 0.0, 2.5, (2.0, 2.0))
    assert min(idle_shares(stops, held).values()) < 0.0


@pytest.mark.slow
def test_an_error_above_the_largest_accepted_one_is_refused() -> None:
    with pytest.raises(Unreachable, match="max_error") as refused:
        design(ONE, max_error=1e-7, resistors=("E12",))
    assert "circuit.resistors" in str(refused.value)
    assert design(ONE, max_error=0.01).errors.max_error <= 0.01


def test_a_refusal_says_what_conflicts_and_how_far_it_has_to_give() -> None:
    with pytest.raises(Unreachable) as refused:
        design(ONE, frequency=(6e4, 7e4))
    text = str(refused.value)
    assert "60kHz (circuit.frequency)" in text
    assert "(side condition bandwidth)" in text
    needed = design(ONE, frequency=(3.4e3, 7e4))  # what it says would do
    assert all(check.holds for check in needed.checks)


def test_a_refusal_says_what_the_catalogue_lacks() -> None:
    """Far slower than any capacitor that is sold allows: its largest, not the range, is in the way,
    and the band alone says how slow the circuit has to be."""
    spec = CircuitSpec()
    sold = CATALOG.values("capacitor", spec.capacitors, 1e-14, 1.0, spec.capacitor_grade)
    top = f"{sold.max() * 1e6:.3g}µF"
    with pytest.raises(Unreachable) as refused:
        design(ONE, frequency=(1e-3, 2e-3), capacitor_range=(1e-9, 1e-1))
    text = str(refused.value)
    assert f"the largest capacitor <= {top} (no other can be bought)" in text
    assert "side condition bandwidth" not in text
    assert "circuit.capacitor_range" not in text
    with pytest.raises(Unreachable) as refused:
        design(ONE, frequency=(1e-3, 2e-3))
    text = str(refused.value)
    assert "the largest capacitor <= 1µF (circuit.capacitor_range)" in text
    assert f"but the catalogue has no capacitor above {top}" in text


@pytest.mark.parametrize("seed", quick(seeds(3)))
def test_a_lower_bound_is_never_above_the_optimum(seed: int) -> None:
    random = np.random.default_rng(seed)
    A = np.array([[0.0, 1.0], [-random.uniform(0.5, 2.0), -random.uniform(0.05, 0.3)]])
    resistors = np.sort(10.0 ** random.uniform(3.5, 5.5, 12))
    capacitors = np.sort(10.0 ** random.uniform(-8.5, -7.0, 4))
    bounds = Bounds((0.0, np.inf), np.inf, np.inf, 0.0, np.ones(2))
    targets = Targets.from_state_matrix(A)
    question = LinearQuestion(targets, resistors, capacitors, np.ones(4), bounds, CircuitSpec())
    optimum = float(everything(A, resistors, capacitors).errors.min())
    for found in (2.0 * optimum, 10.0 * optimum, 0.05 + optimum):
        for patience in (2_000, 50_000_000):
            bound, proof = lower_bound(question, found, patience)
            assert bound <= optimum + 1e-6
            assert "12 resistor and 4 capacitor values" in proof


SLOW_BASE = system_text(
    {"a": 0.41, "b": 1.0},
    {("a", "ground"): 0.81, ("a", "b"): 1.0},
    {("a", "ground"): 0.11},
    "[base]\namplitude = 1.33\n",
    table("force", on="b", constant=-0.81),
    clearance("A", "b", "a", upper=1.0, lower=4.0, upper_stiffness=8.0, lower_stiffness=14.7),
    table("response", omega=0.55),
)
"""Two masses on a base that moves slowly, a clearance between them: where thresholds are highest,
offsets are 0.12 of the drive."""


@cache
def slow_base() -> tuple[Order, ConditionLimits]:
    file = parse_model_file(SLOW_BASE)
    found = find(file.model, file.responses)
    spec = replace(file.circuit, dead_zone="rectifier")
    drive, held = least_drive(file.model, found), peaks(file.model, found)
    largest = largest_amplitudes(file.model, found[:1])
    order = Order.of(file.model, spec, CATALOG, held, largest=largest, drive_force=drive)
    unit = file.model.second_order().own_frequency
    conditions = spec.active_conditions
    return order, limits(spec, conditions, order.opamp, order.output.limit, held.fastest, unit=unit)


def test_a_cut_touches_the_offsets_where_it_is_made() -> None:
    """A thousandth beside it they differ by the square of that: its slope is theirs."""
    choice = ScaleChoice(*slow_base())
    z = choice.box.points(1, 1.0, seed=0)[0]
    line = choice._offset_cut(z).log
    around = z + 1e-3 * np.vstack([np.zeros(len(z)), np.eye(len(z)), -np.eye(len(z))])
    lines = [line.constant + line.weights @ each for each in around]
    offsets = choice._over(around)
    assert lines[0] == pytest.approx(offsets[0], abs=1e-9)
    assert lines == pytest.approx(offsets, abs=2e-5)
    assert np.ptp(offsets) > 2e-4, "they do depend on the scales"


@pytest.mark.slow
def test_scales_keep_offsets_small_beside_the_drive() -> None:
    order, within = slow_base()
    model = parse_model_file(SLOW_BASE).model

    def offsets(choice: ScaleChoice) -> float:
        first = next(choice.circuits())
        assert isinstance(first, ScaleAttempt)
        made = first.made
        volts = made.errors.scales.volts
        (at,) = forces(made.circuit, model.second_order(), volts, order.drive_force)
        return float(np.linalg.norm([10e-3 * share for share in at.offset.values()]))

    assert offsets(ScaleChoice(order, within)) <= 0.05
    free = replace(order, drive_force=1e6)  # so strong a drive hides the rule from the choice
    assert offsets(ScaleChoice(free, within)) > 0.05
