"""The saturating stage with one stop: shifted to it, and the shift taken out again."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.clearance import Sides
from tests.circuit.test_reduction import EXACT, circuit_of
from tests.shared.oracles import dead_zone_gains
from tests.shared.stages import SATURATION, model, one_sided, stage

ONE_SIDED: tuple[Sides, ...] = ("upper", "lower")


@pytest.mark.parametrize("sides", ONE_SIDED)
def test_exact_values_have_no_error(sides: Sides) -> None:
    circuit = stage("saturation", sides, one_sided())
    found = coefficient_errors(circuit, model(sides).second_order())
    assert found.max_error < 1e-9
    assert len(found.errors) == 13
    assert found.errors["dead-zone bias"] == pytest.approx(0.0, abs=1e-9)
    assert found.scales.threshold == pytest.approx(0.6)
    assert math.isnan(found.scales.threshold_lower) is (sides == "upper")
    assert found.scales.offcentre == 0.0


@pytest.mark.parametrize("sides", ONE_SIDED)
def test_output_along_v1(sides: Sides) -> None:
    """Zero from the stop to the far end, slope 1 past either: by hand."""
    circuit = stage("saturation", sides, one_sided(0.6, 8.0))
    reduction = Reduction(circuit, nominal_board(circuit, ideal=True))
    system = reduction.system()
    sign = 1.0 if sides == "upper" else -1.0
    for v, want in ((0.0, 0.0), (0.59, 0.0), (-7.9, 0.0), (1.6, 1.0), (5.0, 4.4), (-9.0, -1.0)):
        x = np.array([sign * v, 0.0, 0.0, 0.0])
        key = system.mode_at(x, 0.0)
        got = reduction.output(key, "fv", x[None, :], np.zeros(1))[0]
        assert got == pytest.approx(sign * want, abs=1e-9)
        # Past the far end there is no stop, whatever the circuit does there.
        assert system.mode(key).sides == (int(sign) if v > 0.6 else 0,)
    assert set(system.contact_rows(0)) == {int(sign)}
    assert system.mirror is None


@pytest.mark.parametrize("sides", ONE_SIDED)
def test_what_the_shift_leaves_counts_in_units_of_the_threshold(sides: Sides) -> None:
    """R212 too large by 1 %: 1 % of the constant stays, through R50 against R4 · threshold."""
    values = one_sided()
    values["R212"] *= 1.01
    found = coefficient_errors(stage("saturation", sides, values), model(sides).second_order())
    shift = (11.0 - 0.6) / 2.0
    left = shift * (1.0 - 1.0 / 1.01) * values["R4"] / (values["R50"] * 0.6)
    sign = -1.0 if sides == "upper" else 1.0
    # fv is below zero inside the clearance, so the force is along the axis: upwards.
    assert found.errors["dead-zone bias"] == pytest.approx(-sign * left, rel=1e-6)
    assert found.max_error == pytest.approx(left, rel=1e-6)


@pytest.mark.parametrize("sides", ONE_SIDED)
@pytest.mark.parametrize("omega", [1.55, 0.54, 0.3])
def test_one_stop_follows_the_model(sides: Sides, omega: float) -> None:
    circuit, wanted = stage("saturation", sides, one_sided()), model(sides)
    found = coefficient_errors(circuit, wanted.second_order())
    on_model = settle(Flow(wanted.second_order().piecewise_linear(), Drive(omega)), np.zeros(4))
    drive = Drive(2 * np.pi * found.scales.frequency(omega), -1.0 / found.drive_gain[0])
    board = replace(nominal_board(circuit), inverse_gain=1e-9, bias={})
    orbit = settle(
        Flow(Reduction(circuit, board).system(), drive), on_model.start * found.scales.volts
    )
    assert on_model.status is OrbitStatus.PERIODIC
    assert orbit.response == on_model.response
    assert (orbit.p == 0) is (sides == "lower")
    peak = np.abs(on_model.extremes).max(axis=1)
    assert (np.abs(orbit.start / found.scales.volts - on_model.start) < 1e-5 * peak).all()
    assert orbit.penetration / found.scales.volts[0] == pytest.approx(
        on_model.penetration, rel=1e-4
    )
    assert orbit.miss / found.scales.volts[0] == pytest.approx(on_model.miss, rel=1e-4)


@pytest.mark.parametrize("sides", ["both", *ONE_SIDED])
def test_the_free_end_of_a_one_sided_stage_is_clipping(sides: Sides) -> None:
    """U3C's limits are 0.6 V and 11 V from v1 = 0 here: contact, or clipping where no stop is."""
    if sides == "both":
        circuit, ends = circuit_of(EXACT), {1: SATURATION / dead_zone_gains(EXACT)[0]}
        ends[-1] = ends[1]
    else:
        circuit = stage("saturation", sides, one_sided())
        ends = {1: 0.6, -1: 11.0} if sides == "upper" else {1: 11.0, -1: 0.6}
    system = Reduction(circuit, replace(nominal_board(circuit), bias={})).system()
    for side, end in ends.items():
        for part, there in ((0.99, False), (1.01, True)):
            x = np.array([side * part * end, 0.0, 0.0, 0.0])
            mode = system.mode(system.mode_at(x, 0.0))
            stop = sides == "both" or (side > 0) is (sides == "upper")
            assert mode.sides == ((side if there and stop else 0),)
            assert mode.clipped is (there and not stop)
        flow = Flow(system, Drive(2 * np.pi * 400.0, 0.0))
        run = flow.run(np.array([1.01 * side * end, 0.0, 0.0, 0.0]), 1, measure=True)
        assert (run.clipped_time > 0.0) is (not stop)


def test_penetration_of_contacts_so_deep_that_the_path_before_saturates_too() -> None:
    """Peak less threshold, at any depth: U3C's own overdrive stops growing with U3B's output."""
    circuit = circuit_of(EXACT)
    system = Reduction(circuit, replace(nominal_board(circuit), bias={})).system()
    threshold = SATURATION / dead_zone_gains(EXACT)[0]
    seen = []
    for amplitude in (1.0, 8.0):
        flow = Flow(system, Drive(2 * np.pi * 400.0, -amplitude))
        start = flow.run(np.zeros(4), 60)
        run = flow.run(start.strobes[-1], 8, mode=start.mode, measure=True)
        # As many contacts as there are, the shallowest decides; compare with a dense trace.
        points = 4000
        trace = flow.run(start.strobes[-1], 8, mode=start.mode, points=points).strobes[:, 0]
        inside = np.abs(trace) > threshold
        edges = np.flatnonzero(np.diff(inside.astype(int)))
        depths = [
            np.abs(trace[a : b + 1]).max() - threshold
            for a, b in itertools.pairwise(edges)
            if inside[a + 1]
        ]
        assert run.penetration == pytest.approx(min(depths), rel=1e-3)
        seen.append(run.penetration)
    # U3B saturates from 13 V/3.6 on; the deeper orbit is well past that.
    assert max(seen) > 13.0 * EXACT["R200"] / EXACT["R201"]
