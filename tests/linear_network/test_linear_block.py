"""The ten numbers of the linear block and their joins, against linear programs and brute force."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.arrays import Array
from designer.circuit.scale_fit import minimax
from designer.linear_network import linear_block
from designer.linear_network.kernel_linear import Rules, Values
from designer.linear_network.linear_block import (
    PARTS,
    SCALES,
    catalogue,
    elementary,
    rules_of,
    slice_from,
)
from designer.linear_network.linear_terms import ANY, Bounds, Targets
from designer.linear_network.pair_search import error_of, residuals
from designer.model.model import Dimensionless
from tests.shared import oracles
from tests.shared.linear_enumeration import CAPACITOR

OPEN = Bounds((0.0, np.inf), np.inf, np.inf, 0.0, np.ones(4))
VECTORS = elementary(SCALES)


def random_model(rng: np.random.Generator) -> Dimensionless:
    return Dimensionless(
        m=rng.uniform(0.3, 0.7), k=rng.uniform(0.3, 0.7), k0=0.0, c=rng.uniform(0.3, 0.7),
        zeta=rng.uniform(0.05, 0.3), f20=0.0, b=0.25,
    )  # fmt: skip


def targets_of(model: Dimensionless) -> Targets:
    return Targets.from_state_matrix(model.second_order().state_matrix())


def wanted_of(t: Targets) -> dict[str, float]:
    names = ("R2", "R3", "R4", "R5", "R8", "R9", "R10", "R11")
    logs = dict(zip(names, t.logs, strict=True)) | {"R1": 0.0, "R7": 0.0}
    return {name: float(np.exp(v)) for name, v in logs.items()}


def random_catalogue(rng: np.random.Generator, n: int, m: int) -> Values:
    return catalogue(1e4 * np.exp(rng.uniform(0, 3, n)), 1e-9 * np.exp(rng.uniform(0, 3, m)))


def numbers_of(values: Values, t: Targets, parts: Array) -> Array:
    """The ten numbers of one choice, written out from the module's table."""
    w2, w3, w4, w5, w8, w9, w10, w11 = t.logs
    r1, r2, r3, r4, r5, r7, r8, r9, r10, r11 = values.r[parts[:10]]
    c1, c2, c3, c4 = values.c[parts[10:]]
    d, s1, s3 = c4 - c2, r1 + c1, r7 + c3
    return np.array(
        [
            r2 + w2, r9 + d + w9, r3 + w3, r8 + d + w8,
            (r4 - r10 - d + w4 - w10) / 2, (r5 - r11 - d + w5 - w11) / 2,
            (r4 + w4 + s1 - c2) / 2, (r10 + w10 + d + s1 - c2) / 2,
            (r5 + w5 + s3 - c2) / 2, (r11 + w11 + d + s3 - c2) / 2,
        ]
    )  # fmt: skip


def largest(v: Array) -> float:
    places, entries = VECTORS
    return float(np.abs((entries * v[places]).sum(axis=1)).max())


@given(seed=st.integers(0, 10**6))
def test_elementary_vectors_give_the_minimax(seed: int) -> None:
    v = np.random.default_rng(seed).standard_normal(10)
    assert largest(v) == pytest.approx(oracles.minimax(v, -SCALES), abs=1e-9)


@given(seed=st.integers(0, 10**6))
def test_the_oracle_s_elementary_vectors_give_the_minimax(seed: int) -> None:
    rng = np.random.default_rng(seed)
    D, h = rng.integers(-1, 2, (7, 3)).astype(float), rng.standard_normal(7)
    truth = oracles.minimax(h, D)
    assert np.abs(oracles.elementary_vectors(D) @ h).max() == pytest.approx(truth, abs=1e-9)


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6))
def test_ten_numbers_stand_for_ten_errors_and_four_scales(seed: int) -> None:
    rng = np.random.default_rng(seed)
    t = targets_of(random_model(rng))
    values = random_catalogue(rng, 5, 3)
    rules = rules_of(values, t, OPEN, ANY)
    parts = np.concatenate([rng.integers(0, 5, 10), rng.integers(0, 3, 4)])
    ohms = dict(zip(PARTS, np.exp([*values.r[parts[:10]], *values.c[parts[10:]]]), strict=True))
    wanted = wanted_of(t)
    h = np.array([-np.log(ohms[n] * ohms[CAPACITOR[n]] * wanted[n]) for n in oracles.LINEAR_NAMES])
    truth = oracles.minimax(h, oracles._SCALES)
    assert largest(numbers_of(values, t, parts)) == pytest.approx(truth, abs=1e-8)
    assert error_of(values, rules, parts) == pytest.approx(truth, abs=1e-8)


@given(seed=st.integers(0, 10**6))
def test_minimax_leaves_no_larger_error_than_linear_programming(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = random_catalogue(rng, 4, 2)
    rules = rules_of(values, targets_of(random_model(rng)), OPEN, ANY)
    parts = np.concatenate([rng.integers(0, 4, 10), rng.integers(0, 2, 4)])
    h, D = residuals(values, rules, parts[None, :])
    reached = np.abs(h[0] + D @ minimax(h[0], D)).max()
    assert reached == pytest.approx(oracles.minimax(h[0], D), abs=1e-8)


def test_catalogue_tables_say_what_they_are() -> None:
    values = random_catalogue(np.random.default_rng(1), 6, 4)
    assert len(values.sums) == 24
    assert values.sums == pytest.approx(values.r[values.sum_r] + values.c[values.sum_c])
    assert (np.diff(values.sums) >= 0.0).all()
    ratio = np.repeat(values.ratios, np.diff(values.first))
    assert ratio == pytest.approx(values.r[values.upper] - values.r[values.lower], abs=1e-11)
    assert len(set(zip(values.upper.tolist(), values.lower.tolist(), strict=True))) == 36
    delta = np.repeat(values.deltas, np.diff(values.delta_first))
    assert delta == pytest.approx(values.c[values.delta_c4] - values.c[values.delta_c2], abs=1e-11)
    assert (np.diff(np.abs(values.deltas)) >= -1e-11).all()


def brute_errors(values: Values, t: Targets) -> Array:
    """Eight-term errors of every (delta, R2, R3, R8, R9, R4/R10, R5/R11)."""
    w2, w3, w4, w5, w8, w9, w10, w11 = t.logs
    six = oracles.elementary_vectors(-SCALES[:6])
    h4, h5 = (a.ravel() for a in np.meshgrid(values.ratios, values.ratios))
    one, out = np.ones(len(h4)), []
    for d in values.deltas:
        for r2, r3, r8, r9 in itertools.product(values.r, repeat=4):
            v = np.stack(
                [
                    (r2 + w2) * one, (r9 + d + w9) * one, (r3 + w3) * one,
                    (r8 + d + w8) * one, (h4 - d + w4 - w10) / 2, (h5 - d + w5 - w11) / 2,
                ]
            )  # fmt: skip
            out.append(np.abs(six @ v).max(axis=0))
    return np.sort(np.concatenate(out))


def joined(values: Values, rules: Rules, level: float) -> Array:
    """Errors of all rows of a level, however many slices they come in."""
    errors, start = [], 0
    while start < len(values.deltas) * len(values.r):
        piece = slice_from(values, rules, level, start, 10**9)
        assert not piece.cut
        errors.append(piece.errors)
        start = piece.following
    return np.sort(np.concatenate(errors))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("room", [50_000, 3])
def test_the_join_is_complete_at_its_level(
    seed: int, room: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also in slices that are smaller than what one pair of the outermost tables brings."""
    monkeypatch.setattr(linear_block, "SLICE", room)
    rng = np.random.default_rng(seed)
    t = targets_of(random_model(rng))
    # Displacement integrators of any time constant: the join leaves out rows that have none.
    values = random_catalogue(rng, 5, 2)._replace(sums=np.array([-1e3, 1e3]))
    rules = rules_of(values, t, OPEN, ANY)
    truth = brute_errors(values, t)
    for rank in (0, 3, 100):
        level = float(truth[rank]) * (1 + 1e-9)
        want = truth[truth <= level]
        assert joined(values, rules, level) == pytest.approx(want, abs=1e-12)
    assert len(joined(values, rules, float(truth[0]) * (1 - 1e-9))) == 0


def test_a_join_without_patience_says_that_rows_are_missing() -> None:
    rng = np.random.default_rng(0)
    values = random_catalogue(rng, 5, 2)
    rules = rules_of(values, targets_of(random_model(rng)), OPEN, ANY)
    piece = slice_from(values, rules, 0.5, 0, 10)
    assert piece.following < len(values.deltas) * len(values.r)
