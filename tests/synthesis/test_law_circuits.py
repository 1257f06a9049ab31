"""Circuits of systems with laws, from drawn model files to what the nominal board does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.exact_records import drawn_records
from benchmarks.stranger_systems import Family, draw
from designer.base.errors import InputError
from designer.catalog.parts_catalog import load_catalog
from designer.check.coexistence import of_flow
from designer.check.synthesis_result import Synthesis, synthesise
from designer.circuit.law_curves import law_curves
from designer.circuit.netlist import Resistor
from designer.circuit.nominal import circuit_flow, nominal_reduction, on_circuit
from designer.design_rules import run_rules
from designer.jobs.bench_job import check_fits
from designer.model.find_responses import matches
from designer.model.model_file import parse_model_file
from designer.synthesis.limits import limits
from designer.synthesis.part_checks import check_choices
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.prediction import POINTS, BoardPrediction
from tests.shared.rule_cases import bent
from tests.shared.system_text import system_text, table

ONE = system_text({"a": 1.0}, {("a", "ground"): 1.0}, {("a", "ground"): 0.05})
FORCE = table("force", on="a", amplitude=1.0) + table("response", omega=1.2)
FRICTION = table("friction", between=["a", "ground"], force=0.2, velocity=0.05)


def shows_what_the_model_does(made: Synthesis) -> None:
    """Within a hundredth of the peaks, for an error of the coefficients that is smaller."""
    design = made.design
    assert design.errors.max_error < 0.01
    assert all(check.holds for check in design.checks)
    (response,) = made.model_responses
    orbit = on_circuit(nominal_reduction(design).system(), design, response)
    assert matches(orbit, response.spec)
    wanted = response.orbit.extremes
    found = orbit.extremes / design.volts(response.b)[:, None]
    assert found == pytest.approx(wanted, abs=0.02 * np.abs(wanted).max())


@pytest.mark.slow
def test_friction_is_made_by_a_limiter() -> None:
    made = synthesise(parse_model_file(ONE + FRICTION + FORCE))
    shows_what_the_model_does(made)
    (zone,) = made.design.circuit.dead_zones
    assert zone.limits
    # Past both ends the stage gives the same whatever its parts are.
    board = nominal_reduction(made.design)
    for _, contact in zone.contacts:
        row = board.solution(board.circuit.carrying(contact)).voltage[zone.output]
        assert np.abs(row[:-1]).max() < 1e-4


def test_the_curve_of_a_law_is_that_of_the_board() -> None:
    """As wanted on the chosen parts; with R50 a tenth larger the friction is a tenth smaller."""
    design = synthesise(parse_model_file(ONE + FRICTION + FORCE)).design
    curve = law_curves(design, [np.array([[-1.0, 1.0], [-2.0, 1.5]])], si=False)[0]
    assert (curve.symbol, curve.unit, curve.reached) == ("x₁′", "", (-2.0, 1.5))
    assert curve.corners == (-0.05, 0.05)
    assert curve.wanted == pytest.approx(np.clip(4.0 * curve.x, -0.2, 0.2))
    assert curve.made == pytest.approx(curve.wanted, abs=0.001)
    parts = tuple(
        replace(p, value=1.1 * p.value) if isinstance(p, Resistor) and p.name == "R50" else p
        for p in design.circuit.parts
    )
    weaker = replace(design, circuit=replace(design.circuit, parts=parts))
    off = law_curves(weaker, [np.array([[-1.0, 1.0], [-2.0, 1.5]])], si=False)[0]
    beyond = off.x > 0.06
    change = (off.made[beyond] - 4.0 * off.x[beyond]) / (curve.made[beyond] - 4.0 * off.x[beyond])
    assert change == pytest.approx(1.0 / 1.1, rel=0.01)
    (in_si,) = law_curves(design, [], si=True)  # 0.2 N beyond 0.05 m/s
    assert (in_si.symbol, in_si.unit) == ("x₁′ [mm/s]", "mN")
    assert in_si.wanted == pytest.approx(1e3 * np.clip(4e-3 * in_si.x, -0.2, 0.2))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("family", "number"), [*(("laws", k) for k in (11, 12, 16, 17, 19, 26)), ("plain", 22)]
)
def test_drawn_systems_that_a_search_gave_up_on_have_circuits(family: Family, number: int) -> None:
    """Bends that no response reaches, bends between masses, a swing that was lowered in steps too
    small: each of these was refused once. Of the last the first circuits show another response."""
    shows_what_the_model_does(synthesise(parse_model_file(draw(1, number, family).text), jobs=2))


@pytest.mark.slow
def test_a_swing_is_lowered_from_where_the_design_is() -> None:
    """Not from a limit that it is well inside."""
    made = synthesise(parse_model_file(ONE + FRICTION + FORCE)).design
    spec = parse_model_file(ONE + FRICTION + FORCE).circuit
    assert made.circuit.figures is not None
    within = limits(spec, frozenset({"swing"}), made.circuit.figures, 13.5, 100.0)
    top = next(check for check in made.checks if check.quantity == "swing_v")
    lower = [replace(c, found=0.8 * within.swing) if c == top else c for c in made.checks]
    broken = replace(top, quantity="guaranteed_swing_v", limit=8.0, found=8.2)
    tighter = within.tightened([broken], replace(made, checks=tuple(lower)), slower=False)
    assert tighter.swing == pytest.approx(0.8 * within.swing * 8.0 / 8.2, rel=2e-3)


def test_what_a_scope_shows_of_a_bend_is_what_the_nodes_say() -> None:
    made = bent(0.01).synthesis
    prediction = BoardPrediction(made)
    (shown,) = prediction.responses
    setting = shown.setting
    flow = circuit_flow(prediction.reduction.system(), made.design, made.model_responses[0])
    run = flow.run(shown.orbit.start, shown.orbit.n, mode=shown.orbit.mode or None, points=POINTS)
    (zone,) = prediction.circuit.bends
    contact = dict(zone.contacts)[1]
    (place,) = (end for stop in prediction.zones for end in stop.ends.values())
    keys = [prediction.circuit.open, prediction.circuit.carrying(contact)]
    angle = 2.0 * np.pi * np.arange(len(run.strobes) - 1) / POINTS
    generator = -setting.amplitude_v_peak * np.sin(angle)
    for k in range(0, len(generator), 7):
        x = run.strobes[k]
        volts = prediction.reduction.output(
            keys[int(x[0] > place)], zone.output, x[None], generator[k : k + 1]
        )
        assert shown.waves[zone.output][k] == pytest.approx(volts[0], abs=2e-3)
    assert np.ptp(shown.waves[zone.output]) > 0.5
    with pytest.raises(InputError, match="bends of K") as refused:
        check_fits(prediction, fit=True, boards=False, decays=[])
    assert refused.value.field == "--fit"


def test_a_law_keeps_every_rule_that_a_clearance_keeps() -> None:
    subject = bent(0.01)
    found = {o.rule.id: o for o in run_rules.on_circuit(subject, {})}
    assert found["far-slope"].status == "pass"
    assert found["dead-zone-stiffness"].value < 1e-3


def test_a_circuit_of_an_uneven_model_has_no_twins() -> None:
    made = bent(0.01).synthesis
    system = nominal_reduction(made.design).system()
    flow = circuit_flow(system, made.design, made.model_responses[0])
    found = of_flow(flow, np.ones(2), 8, 1, (), made.design.volts(), even=False)
    assert [basin.twins for basin in found.basins] == [None] * len(found.basins)
    assert found.basins[0].orbit.symmetric is False


@pytest.mark.parametrize("key", ["most_values = 8", 'matched = [["R50", "R1"]]'])
def test_what_scales_do_not_know_is_refused_beside_a_limiter(key: str) -> None:
    """Both would be left out in silence: what limits is always chosen by scales."""
    file = parse_model_file(f"{ONE}{FRICTION}{FORCE}[circuit]\n{key}\n")
    with pytest.raises(InputError, match="that limits") as refused:
        check_choices(file.model, file.circuit, load_catalog())
    assert refused.value.field == f"circuit.{key.split()[0]}"


def test_channels_of_a_board_with_a_law_are_told_with_a_doubt() -> None:
    made = bent(0.01).synthesis
    prediction, named = BoardPrediction(made), 0
    for drawn in drawn_records(made, range(8), 3):
        try:
            motion = recorded_motion(drawn.record, prediction, stated=drawn.channels)
        except InputError:
            continue
        named += 1
        assert drawn.channels or motion.doubt
    assert named
