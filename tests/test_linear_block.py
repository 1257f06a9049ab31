"""The joins of the linear block against full enumeration, and the claims made of them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from designer import selection
from designer.completion import Bounds
from designer.linear_block import _ELEMENTARY, _SCALES, Targets, ratio_table, window
from designer.linear_search import LinearBlock, best
from designer.model import Dimensionless
from designer.selection import Selection, Shortfall, select
from designer.system import Array
from tests.oracles import best_linear, eight_term_error, elementary_vectors, minimax

OPEN = Bounds((0.0, np.inf), np.inf, np.inf, 0.0, np.ones(4))
NAMES = ("R2", "R3", "R4", "R5", "R8", "R9", "R10", "R11")


def random_model(rng: np.random.Generator) -> Dimensionless:
    return Dimensionless(
        m=rng.uniform(0.3, 0.7), k=rng.uniform(0.3, 0.7), k0=0.0, c=rng.uniform(0.3, 0.7),
        zeta=rng.uniform(0.05, 0.3), f20=0.0, b=0.25,
    )  # fmt: skip


def wanted_of(t: Targets) -> dict[str, float]:
    logs = {"R2": t.w2, "R3": t.w3, "R4": t.w4, "R5": t.w5, "R8": t.w8, "R9": t.w9}
    logs |= {"R10": t.w10, "R11": t.w11, "R1": 0.0, "R7": 0.0}
    return {name: float(np.exp(v)) for name, v in logs.items()}


@given(seed=st.integers(0, 10**6))
def test_elementary_vectors_give_the_minimax(seed: int) -> None:
    a = np.random.default_rng(seed).standard_normal(6)
    assert np.abs(_ELEMENTARY @ a).max() == pytest.approx(minimax(a, -_SCALES), abs=1e-9)


@given(seed=st.integers(0, 10**6))
def test_the_oracle_s_elementary_vectors_give_the_minimax(seed: int) -> None:
    rng = np.random.default_rng(seed)
    D, h = rng.integers(-1, 2, (7, 3)).astype(float), rng.standard_normal(7)
    assert np.abs(elementary_vectors(D) @ h).max() == pytest.approx(minimax(h, D), abs=1e-9)


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6))
def test_six_numbers_stand_for_eight_errors(seed: int) -> None:
    """The table's error of a row is the LP of the oracle over all four scales."""
    rng = np.random.default_rng(seed)
    t = Targets.from_state_matrix(random_model(rng).second_order().state_matrix())
    resistors = 1e4 * np.exp(rng.uniform(0, 3, 4))
    capacitors = 1e-9 * np.exp(rng.uniform(0, 3, 2))
    table = ratio_table(resistors, capacitors, t, 1.0)
    assume(len(table))
    i = int(rng.integers(len(table)))
    logs = {
        "R2": table.r2[i], "R3": table.r3[i], "R8": table.r8[i], "R9": table.r9[i],
        "R4": table.ratio4[i], "R10": 0.0, "R5": table.ratio5[i], "R11": 0.0,
        "delta": table.delta[i],
    }  # fmt: skip
    wanted = {name: float(np.log(v)) for name, v in wanted_of(t).items()}
    assert table.error[i] == pytest.approx(eight_term_error(logs, wanted), abs=1e-8)


def brute_table(resistors: Array, capacitors: Array, t: Targets) -> Array:
    """Errors of every (delta, R2, R3, R8, R9, R4/R10, R5/R11), ratios as they come."""
    r, c = np.log(resistors), np.log(capacitors)
    deltas = np.unique(np.round([b - a for a in c for b in c], 12))
    ratios = np.unique(np.round([a - b for a in r for b in r], 12))
    out = []
    for d in deltas:
        for r2, r3, r8, r9 in itertools.product(r, repeat=4):
            h4, h5 = np.meshgrid(ratios, ratios)
            one = np.ones(h4.size)
            a = np.stack(
                [
                    (r2 + t.w2) * one,
                    (r9 + d + t.w9) * one,
                    (r3 + t.w3) * one,
                    (r8 + d + t.w8) * one,
                    0.5 * (h4.ravel() - d + t.w4 - t.w10),
                    0.5 * (h5.ravel() - d + t.w5 - t.w11),
                ]
            )
            out.append(np.abs(_ELEMENTARY @ a).max(axis=0))
    return np.sort(np.concatenate(out))


@pytest.mark.parametrize("seed", range(4))
def test_the_table_is_complete_at_its_level(seed: int) -> None:
    rng = np.random.default_rng(seed)
    t = Targets.from_state_matrix(random_model(rng).second_order().state_matrix())
    resistors = 1e4 * np.exp(rng.uniform(0, 2.5, 5))
    capacitors = 1e-9 * np.exp(rng.uniform(0, 3, 2))
    truth = brute_table(resistors, capacitors, t)
    for rank in (0, 3, 100):
        level = float(truth[rank]) * (1 + 1e-9)
        table = ratio_table(resistors, capacitors, t, level)
        assert table.complete
        want = truth[truth <= level]
        assert table.error == pytest.approx(want, abs=1e-12)
    assert len(ratio_table(resistors, capacitors, t, float(truth[0]) * (1 - 1e-9))) == 0


@pytest.mark.parametrize("seed", range(6))
def test_full_choice_is_the_optimum_of_full_enumeration(seed: int) -> None:
    """Ten errors, side conditions off, every choice of ten resistors and four capacitors."""
    rng = np.random.default_rng(100 + seed)
    model = random_model(rng)
    resistors = np.sort(1e4 * np.exp(rng.uniform(0, 2.0, 3)))
    capacitors = np.sort(1e-9 * np.exp(rng.uniform(0, 4, 3)))
    t = Targets.from_state_matrix(model.second_order().state_matrix())
    truth = best_linear(resistors.tolist(), capacitors.tolist(), wanted_of(t))
    level = truth * (1 + 1e-6)
    table = ratio_table(resistors, capacitors, t, level)
    answer = select(table, resistors, capacitors, np.ones(3), t, OPEN, level)
    assert isinstance(answer, Selection), (answer, truth)
    assert answer.error == pytest.approx(truth, abs=2e-6)
    below = truth - 1e-4
    table = ratio_table(resistors, capacitors, t, below)
    nothing = len(table) == 0 or isinstance(
        select(table, resistors, capacitors, np.ones(3), t, OPEN, below), Shortfall
    )
    assert nothing, "something below the optimum"


def near_exact(rng: np.random.Generator) -> tuple[Dimensionless, Array, Array]:
    """A model that a three-by-three catalogue meets within a few per cent."""
    resistors = np.array([10e3, 20e3, 40e3]) * np.exp(rng.normal(0.0, 0.01, 3))
    capacitors = np.array([1e-9, 10e-9, 100e-9]) * np.exp(rng.normal(0.0, 0.01, 3))
    model = Dimensionless(
        m=0.5 + rng.normal(0, 0.01), k=0.5 + rng.normal(0, 0.01), k0=0.0,
        c=0.5 + rng.normal(0, 0.01), zeta=0.25 * np.exp(rng.normal(0, 0.02)), f20=0.0, b=0.25,
    )  # fmt: skip
    return model, resistors, capacitors


@pytest.mark.parametrize("seed", range(4))
def test_levels_lead_to_the_optimum_and_its_proof(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, resistors, capacitors = near_exact(rng)
    t = Targets.from_state_matrix(model.second_order().state_matrix())
    truth = best_linear(resistors.tolist(), capacitors.tolist(), wanted_of(t))
    assert truth < 0.1
    answer = best(t, resistors, capacitors, np.ones(3), OPEN)
    assert isinstance(answer, LinearBlock)
    assert answer.error == pytest.approx(truth, abs=2e-6)
    assert answer.proved
    assert answer.bound <= truth + 2e-6


@pytest.mark.parametrize("seed", range(12))
def test_a_lower_bound_is_one_where_rows_are_left_out(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the program's room cut to almost nothing the bound must still be below the optimum."""
    monkeypatch.setattr(selection, "LARGEST", 1)
    monkeypatch.setattr(selection, "KEEP_GROUPS", 1)
    monkeypatch.setattr(selection, "KEEP_ROWS", 1)
    rng = np.random.default_rng(seed)
    model, resistors, capacitors = near_exact(rng)
    t = Targets.from_state_matrix(model.second_order().state_matrix())
    truth = best_linear(resistors.tolist(), capacitors.tolist(), wanted_of(t))
    answer = best(t, resistors, capacitors, np.ones(3), OPEN)
    assert isinstance(answer, LinearBlock)
    assert answer.error >= truth - 2e-6
    assert answer.bound <= truth + 2e-6


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6), half=st.floats(0.0, 0.5))
def test_window_is_a_join(seed: int, half: float) -> None:
    rng = np.random.default_rng(seed)
    table, centre = np.sort(rng.uniform(0, 1, 20)), rng.uniform(-0.2, 1.2, 15)
    i, j, complete = window(table, centre, half)
    assert complete
    want = {(a, b) for a in range(15) for b in range(20) if abs(table[b] - centre[a]) <= half}
    got = set(zip(i.tolist(), j.tolist(), strict=True))
    assert want <= got
    assert all(abs(table[b] - centre[a]) <= half + 2e-12 for a, b in got)


def test_a_cut_join_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("designer.linear_block.MAX_ROWS", 10)
    i, _, complete = window(np.zeros(4), np.zeros(5), 0.1)
    assert not complete
    assert len(i) <= 10


def test_no_value_fits_no_row() -> None:
    t = Targets.from_state_matrix(
        random_model(np.random.default_rng(0)).second_order().state_matrix()
    )
    assert len(ratio_table(np.array([1e3]), np.array([1e-9]), t, 1e-3)) == 0


def test_exact_e24_parts_for_the_paper_are_found() -> None:
    from designer.eseries import series_values

    model = Dimensionless(0.5, 0.5, 0.0, 0.5, 0.1, 0.0, 0.25)
    t = Targets.from_state_matrix(model.second_order().state_matrix())
    table = ratio_table(
        series_values(["E24"], 1e4, 1e5), series_values(["E12"], 1e-9, 1e-7), t, 1e-9
    )
    assert len(table)
    assert table.error[0] < 1e-12
    assert (table.error <= 1e-9).all()
    rows = np.exp(np.stack([table.r2, table.r9], axis=1))
    assert (np.abs(rows[:, 0] / rows[:, 1] - 2.0) < 1e-9).any()
