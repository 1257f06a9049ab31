"""One DC offset of the generator takes every constant force away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.errors import InputError
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.model.model_file import parse_model_file
from designer.model.tuning_bands import Bands
from designer.yields.adjustment import Adjustment, centring_offset, rest_distances
from tests.circuit.test_reduction import EXACT, circuit_of
from tests.shared.bench_plans import question
from tests.shared.paper_cases import subject
from tests.shared.stages import one_sided, stage

CIRCUIT = subject(1).circuit
IDEAL = nominal_board(CIRCUIT, ideal=True)
NOMINAL = Reduction(CIRCUIT, IDEAL).system()


def at_node(net: str) -> float:
    """Sum of the conductances at a summing node [S]."""
    return sum(1.0 / r.value for r in CIRCUIT.resistors if net in r.nets)


def test_an_offset_of_the_velocity_integrator_is_cured_by_its_noise_gain() -> None:
    """At rest every voltage but the generator's is zero, so R6 alone feeds the shifted node."""
    board = replace(IDEAL, offset={**IDEAL.offset, "U2C": 1e-3})
    wanted = 1e-3 * CIRCUIT.values["R6"] * at_node("s2")
    found = centring_offset(Reduction(CIRCUIT, board).system(), NOMINAL)
    assert found == pytest.approx(wanted, rel=1e-9)


@settings(max_examples=25)
@given(st.lists(st.floats(-2e-3, 2e-3), min_size=8, max_size=8))
def test_a_board_with_offsets_outside_the_dead_zone_is_the_nominal_one_again(
    volts: list[float],
) -> None:
    """The offsets of the linear sections move the rest point and nothing else: after centring the
    orbit is the nominal one, moved by a constant."""
    p = 3
    linear = [s.name for s in CIRCUIT.sections if not s.limits]
    board = replace(IDEAL, offset={**IDEAL.offset, **dict(zip(linear, volts, strict=True))})
    system = Reduction(CIRCUIT, board).system()
    asked = question(p)
    volt = centring_offset(system, NOMINAL)
    exc = asked.excitation
    cured = Excitation(exc.frequency, exc.amplitude, volt).drive
    found = settle(Flow(system, cured), asked.start.start)
    known = settle(Flow(NOMINAL, exc.drive), asked.start.start)
    assert found.response == known.response == "1-3-3"
    swing, wanted = np.ptp(found.extremes, axis=1), np.ptp(known.extremes, axis=1)
    np.testing.assert_allclose(swing, wanted, rtol=1e-6)
    assert found.penetration == pytest.approx(known.penetration, rel=1e-6)
    assert found.radius == pytest.approx(known.radius, rel=1e-6)


def test_unequal_limits_are_centred_too() -> None:
    """Both thresholds move up by a twentieth: the rest point goes halfway between them."""
    rails = {**IDEAL.rails, "U3C": (-12.0, 13.5)}
    system = Reduction(CIRCUIT, replace(IDEAL, rails=rails)).system()
    distances, slopes = rest_distances(system)
    assert distances[0] != pytest.approx(distances[1], rel=1e-2)
    after = distances + centring_offset(system, NOMINAL) * slopes
    assert after[0] == pytest.approx(after[1], rel=1e-9)


def test_with_one_stop_the_distance_to_it_is_restored() -> None:
    circuit = stage("saturation", "upper", one_sided())
    board = nominal_board(circuit)
    nominal = Reduction(circuit, board).system()
    off = replace(board, offset={**board.offset, "U2C": 2e-3})
    system = Reduction(circuit, off).system()
    wanted, _ = rest_distances(nominal)
    distances, slopes = rest_distances(system)
    assert distances.shape == (1,)
    assert distances[0] != pytest.approx(wanted[0], rel=1e-3)
    after = distances + centring_offset(system, nominal) * slopes
    assert after[0] == pytest.approx(wanted[0], rel=1e-9)


def test_without_a_stop_there_is_nothing_to_centre() -> None:
    circuit = circuit_of(EXACT, stops=False)
    board = nominal_board(circuit)
    off = replace(board, offset={**board.offset, "U2C": 2e-3})
    nominal, system = (Reduction(circuit, b).system() for b in (board, off))
    assert centring_offset(system, nominal) == 0.0


# Bands and adjustments.


def test_adjustments_change_what_they_say() -> None:
    turned = Adjustment(0.02, -0.1, 0.03).of(Excitation(100.0, 5.0, 0.5))
    assert (turned.frequency, turned.amplitude) == (102.0, 4.5)
    assert turned.offset == pytest.approx(0.65)
    assert Adjustment.at(np.array([0.2, -0.2, 0.0]), Bands()) == Adjustment(0.05, -0.10, 0.0)


@pytest.mark.parametrize(
    ("line", "field"),
    [
        ("frequency = -0.01", "tuning.frequency"),
        ("amplitude = 1.0", "tuning.amplitude"),
        ("offset = -1e-9", "tuning.offset"),
        ('offset = "5 %"', "tuning.offset"),
        ("ofset = 0.1", "tuning.ofset"),
    ],
)
def test_bad_bands_are_refused(line: str, field: str) -> None:
    model = "m = 0.5\nk = 0.5\nk0 = 0.95\nc = 0.5\nzeta = 0.1\nf20 = 0.0\nb = 0.25"
    with pytest.raises(InputError) as caught:
        parse_model_file(f"format = 1\n[model]\n{model}\n[tuning]\n{line}\n")
    assert caught.value.field == field


def test_bands_of_a_model_file() -> None:
    model = "m = 0.5\nk = 0.5\nk0 = 0.95\nc = 0.5\nzeta = 0.1\nf20 = 0.0\nb = 0.25"
    text = f"format = 1\n[model]\n{model}\n"
    assert parse_model_file(text).tuning == Bands(0.05, 0.10, 0.05)
    changed = parse_model_file(text + "[tuning]\namplitude = 0\noffset = 0.2\n").tuning
    assert changed == Bands(0.05, 0.0, 0.2)


@pytest.mark.parametrize("bands", [{"frequency": 1.0}, {"amplitude": -0.1}, {"offset": np.inf}])
def test_bands_check_themselves(bands: dict[str, float]) -> None:
    with pytest.raises(InputError):
        Bands(**bands)
