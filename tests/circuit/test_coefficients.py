"""The coefficient error against the formulas, and against the values printed in the paper."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import _best_scales, coefficient_errors
from designer.model.model import Dimensionless
from tests.circuit.test_reduction import EXACT, circuit_of
from tests.shared.oracles import Plain, coefficient_error, dead_zone_gains, minimax

PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
PLAIN = Plain(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)


def relative_to_k1(values: dict[str, float]) -> float:
    """Leftover stiffness of the dead zone over K1 = 1/(R4 C2)."""
    steep, linear, through = dead_zone_gains(values)
    return abs(linear - steep * through) / values["R50"] * values["R4"]


def exact_for_paper() -> dict[str, float]:
    """EXACT with the stop's slope exact: A_ R210/R209 · R4/R50 = mu."""
    values = dict(EXACT)
    values["R50"] = 20.0 * values["R4"] / PAPER.mu
    steep, linear, _through = dead_zone_gains(values)
    # A flat dead zone: R205 such that the loaded divider's gain is A_/A+.
    beta = linear / steep * values["R208"] / values["R210"]
    parallel = beta * values["R204"] / (1.0 - beta)
    values["R205"] = 1.0 / (1.0 / parallel - 1.0 / values["R208"])
    return values


def test_exact_e24_network_has_no_error_in_its_linear_part() -> None:
    values = {**EXACT}
    circuit = circuit_of(values, stops=False)
    linear = replace(PAPER, k0=0.0)
    found = coefficient_errors(circuit, linear.second_order(), swing=(10.0, np.ones(4)))
    assert found.max_error < 1e-12
    # The time scale is sqrt(R1 C1 R4 C2).
    assert found.scales.seconds == pytest.approx(math.sqrt(1e-4 * 36e3 * 100e-9), rel=1e-9)


def test_exact_values_have_no_error_and_the_scales_of_eq_16() -> None:
    values = exact_for_paper()
    found = coefficient_errors(circuit_of(values), PAPER.second_order())
    assert found.max_error < 1e-9
    seconds = math.sqrt(values["R1"] * values["C1"] * values["R4"] * values["C2"])
    assert found.scales.seconds == pytest.approx(seconds, rel=1e-9)
    # ω = 2π f sqrt(R1 C1 R4 C2), Eq. (16) as corrected.
    assert found.scales.frequency(1.3) == pytest.approx(1.3 / (2 * np.pi * seconds), rel=1e-9)
    steep, _, _ = dead_zone_gains(values)
    assert found.scales.threshold == pytest.approx(13.0 / steep, rel=1e-9)
    assert found.scales.volts[0] == pytest.approx(13.0 / steep / 0.25, rel=1e-9)
    # x1' = dx1/dt: v2 = R1 C1 dv1/dT.
    ratio = values["R1"] * values["C1"] / seconds
    assert found.scales.volts[1] == pytest.approx(found.scales.volts[0] * ratio, rel=1e-9)
    # Eq. (15) as corrected: V_M1 = B R6/(b R4).
    vm = 1.0 / found.drive_gain[0]
    want = found.scales.threshold * values["R6"] / (0.25 * values["R4"])
    assert vm == pytest.approx(want, rel=1e-9)
    assert found.drive_gain[1] == 0.0


def test_the_paper_s_time_scale_and_misprinted_frequency() -> None:
    """τ = 1/(2π · 355.88 Hz): what Eq. (16) gives from R1 C1 = 1e-4 s, R4 C2 = 2e-3 s."""
    values = exact_for_paper() | {"C1": 1e-9, "C3": 1e-9, "C2": 100e-9, "C4": 100e-9}
    values |= {"R1": 100e3, "R7": 100e3, "R4": 20e3, "R5": 20e3, "R10": 20e3, "R11": 10e3}
    root = math.sqrt(1e-4 * 20e3 * 1e-7)
    # 2ζ = τ/(R2 C2).
    values |= {"R2": root / (0.2 * 1e-7), "R3": root / (0.2 * 1e-7), "R8": root / (0.2 * 1e-7)}
    values |= {"R9": root / (0.4 * 1e-7)}
    # The figure's R2, R3, R8 and R9: 22.37 k and 11.19 k.
    assert values["R2"] == pytest.approx(22.37e3, rel=1e-3)
    assert values["R9"] == pytest.approx(11.19e3, rel=1e-3)
    values["R50"] = 20.0 * values["R4"] / PAPER.mu
    found = coefficient_errors(circuit_of(values), PAPER.second_order())
    assert found.max_error < 1e-9
    assert found.scales.frequency(1.0) == pytest.approx(355.88, abs=0.01)
    assert found.scales.frequency(1.0) != pytest.approx(357.419, abs=1.0)


def test_printed_r50_gives_the_slope_of_another_k0() -> None:
    """20.88 k where 22.17 k is meant, with A_ = 21.06: μ = 20.17, an error of ln(20.17/19)."""
    values = exact_for_paper()
    values |= {"R4": 20e3, "R5": 20e3, "R10": 20e3, "R11": 10e3}
    root = math.sqrt(1e-4 * 20e3 * 1e-7)
    values |= {"R2": root / 0.2e-7, "R3": root / 0.2e-7, "R8": root / 0.2e-7, "R9": root / 0.4e-7}
    values |= {"R206": 10e3, "R207": 210.6e3, "R203": 105.3e3, "R201": 200e3, "R50": 20.88e3}
    steep, linear, _through = dead_zone_gains(values)
    assert steep == pytest.approx(210.6)
    beta = linear / steep * values["R208"] / values["R210"]
    parallel = beta * values["R204"] / (1.0 - beta)
    values["R205"] = 1.0 / (1.0 / parallel - 1.0 / values["R208"])
    found = coefficient_errors(circuit_of(values), PAPER.second_order())
    # One coefficient is off by ln(20.17/19). The stop's slope and K1's row share every scale with
    # terms that are exact, so the least worst error is half of it.
    off = math.log(21.06 * 20e3 / 20.88e3 / 19.0)
    assert off == pytest.approx(math.log(20.17 / 19.0), abs=2e-4)
    spread = found.errors["stop slope"] - found.errors["x1'' x1"]
    assert spread == pytest.approx(off, rel=1e-6)
    assert found.max_error == pytest.approx(off / 2.0, rel=1e-6)
    assert found.scales.threshold == pytest.approx(13.0 / 210.6, rel=1e-9)
    right = coefficient_errors(
        circuit_of(values | {"R50": 21.06 * 20e3 / 19.0}), PAPER.second_order()
    )
    assert right.max_error < 1e-9
    assert pytest.approx(22.17e3, rel=1e-3) == 21.06 * 20e3 / 19.0


@pytest.mark.parametrize(("load", "leftover"), [(10e3, 1.7), (100e3, 0.18)])
def test_the_divider_s_load_leaves_stiffness_inside_the_clearance(
    load: float, leftover: float
) -> None:
    """The paper's 9 k and 1 k divider, R208 = R209 = R210 = 10 k or 100 k."""
    values = exact_for_paper()
    values |= {"R4": 20e3, "R5": 20e3, "R10": 20e3, "R11": 10e3}
    values |= {"R206": 10e3, "R207": 210.6e3, "R203": 105.3e3, "R201": 200e3}
    values |= {"R204": 9e3, "R205": 1e3, "R50": 22.17e3}
    values |= {"R208": load, "R209": load, "R210": load}
    assert relative_to_k1(values) == pytest.approx(leftover, rel=0.1)
    found = coefficient_errors(circuit_of(values), PAPER.second_order())
    # μ |ln(1 - leftover/slope)|, with leftover/slope = (leftover/K1)/μ to first order.
    assert found.errors["dead-zone null"] == pytest.approx(-leftover, rel=0.15)


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6))
def test_error_is_that_of_the_formulas(seed: int) -> None:
    """Random values near a random target: nodal analysis against Eq. (12), (20) and an LP."""
    rng = np.random.default_rng(seed)
    model = Dimensionless(
        m=rng.uniform(0.2, 0.8), k=rng.uniform(0.2, 0.8), k0=rng.uniform(0.5, 0.98),
        c=rng.uniform(0.2, 0.8), zeta=rng.uniform(0.02, 0.3), f20=0.0, b=rng.uniform(0.05, 1.0),
    )  # fmt: skip
    plain = Plain(model.m, model.k, model.k0, model.c, model.zeta, 0.0, model.b)
    values = {n: v * math.exp(rng.normal(0.0, 0.1)) for n, v in EXACT.items()}
    circuit = circuit_of(values)
    found = coefficient_errors(circuit, model.second_order())
    assert found.max_error == pytest.approx(coefficient_error(values, plain), rel=1e-5, abs=1e-9)
    assert found.max_error == max(abs(e) for e in found.errors.values())
    assert len(found.errors) == 12
    assert set(found.errors) >= {"stop slope", "dead-zone null", "x1' x1'", "x2'' x2'"}
    # The stated errors really are those at the stated scales.
    reduced = np.log(found.scales.volts[1] / found.scales.volts[0])
    realised = 1.0 / (values["R1"] * values["C1"]) * values["R103"] / values["R102"]
    want = math.log(realised) + math.log(found.scales.seconds) + reduced
    assert found.errors["x1' x1'"] == pytest.approx(want, abs=1e-6)


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), r=st.floats(0.2, 5.0), c=st.floats(0.2, 5.0))
def test_scaling_all_resistors_and_capacitors_changes_only_the_time_scale(
    seed: int, r: float, c: float
) -> None:
    rng = np.random.default_rng(seed)
    values = {n: v * math.exp(rng.normal(0.0, 0.05)) for n, v in EXACT.items()}
    scaled = {n: v * (r if n[0] == "R" else c) for n, v in values.items()}
    one = coefficient_errors(circuit_of(values), PAPER.second_order())
    two = coefficient_errors(circuit_of(scaled), PAPER.second_order())
    assert two.max_error == pytest.approx(one.max_error, abs=1e-7)
    # The minimax need not be unique in the scales; the clearance's voltage is.
    assert two.scales.threshold == pytest.approx(one.scales.threshold, rel=1e-9)
    assert two.scales.seconds == pytest.approx(one.scales.seconds * r * c, rel=0.2)


def test_errors_by_first_order_sensitivities() -> None:
    """Changing one value by a little moves exactly the coefficients it stands in."""
    base = exact_for_paper()
    for part, touched in {"R3": {"x1'' x2'"}, "R11": {"x2'' x2"}, "R50": {"stop slope"}}.items():
        values = base | {part: base[part] * 1.02}
        errors = coefficient_errors(circuit_of(values), PAPER.second_order()).errors
        assert max(abs(e) for e in errors.values()) <= math.log(1.02) + 1e-9
        rest = [abs(e) for name, e in errors.items() if name not in touched | {"dead-zone null"}]
        assert max(abs(errors[name]) for name in touched) >= max(rest) - 1e-9


def test_wrong_signs_have_no_scale() -> None:
    values = exact_for_paper()
    model = PAPER.second_order()
    flipped = replace(model, damping=model.damping * np.array([[1.0, -1.0], [1.0, 1.0]]))
    with pytest.raises(ArithmeticError, match="wrong sign"):
        coefficient_errors(circuit_of(values), flipped)


def test_a_path_that_clips_before_the_stop_is_no_dead_zone() -> None:
    """U3B at its limit where U3C is not: the ends are then not where they seem to be."""
    values = exact_for_paper() | {"R201": 620e3, "R203": 9e3}
    with pytest.raises(ArithmeticError, match="U3B"):
        coefficient_errors(circuit_of(values), PAPER.second_order())


def test_a_board_s_own_values_count() -> None:
    values = exact_for_paper()
    circuit = circuit_of(values)
    board = replace(
        nominal_board(circuit, ideal=True), values=values | {"R50": values["R50"] * 1.1}
    )
    found = coefficient_errors(circuit, PAPER.second_order(), board)
    plain = coefficient_error(board.values, PLAIN)
    assert found.max_error == pytest.approx(plain, rel=1e-6)
    assert found.max_error > 0.04


def test_swing_sets_the_amplitude_where_nothing_clips() -> None:
    circuit = circuit_of(EXACT, stops=False)
    peaks = np.array([3.0, 2.0, 0.5, 0.7])
    found = coefficient_errors(circuit, replace(PAPER, k0=0.0).second_order(), swing=(9.0, peaks))
    assert (found.scales.volts * peaks).max() == pytest.approx(9.0)
    assert math.isnan(found.scales.threshold)


@given(seed=st.integers(0, 10**6))
def test_the_lp_of_the_oracle_is_a_minimax(seed: int) -> None:
    """The reference itself, against a crude search."""
    rng = np.random.default_rng(seed)
    D, h = rng.standard_normal((5, 1)), rng.standard_normal(5)
    grid = np.linspace(-50.0, 50.0, 20001)
    crude = np.abs(h[:, None] + D * grid).max(axis=0).min()
    best = minimax(h, D)
    assert best <= crude + 1e-9
    assert best >= crude - 0.01 * np.abs(D).max()


def test_scales_that_are_kept_cannot_be_changed() -> None:
    kept = _best_scales(np.array([0.1, -0.1]).tobytes(), np.eye(2, 3).tobytes(), 2)
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 1.0
