"""The reference spread: analytic moments, independence, (seed, index) → board."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from zlib import crc32

import numpy as np
import pytest
from scipy.stats import kstest, truncnorm

from designer.catalog.parts_catalog import load_catalog
from designer.circuit.board_values import Board
from designer.spread.spread import Spread, draw, draw_many
from tests.circuit.test_reduction import EXACT, circuit_of

CIRCUIT = circuit_of(EXACT)
SPREAD = Spread(0.01, 0.05, 3e-3, 10e-3)
N = 4000


@cache
def boards() -> tuple[Board, ...]:
    many = draw_many(CIRCUIT, SPREAD, 17, range(N))
    return tuple(many.board(i) for i in range(N))


def test_bench_1_is_the_definition() -> None:
    spread = Spread.bench_1(load_catalog().opamp("TL074C"), 0.01, 0.02)
    assert (spread.resistor, spread.capacitor) == (0.01, 0.02)
    assert (spread.offset_sigma, spread.offset_limit) == (3e-3, 10e-3)
    assert spread.saturation == 0.05
    better = Spread.bench_1(load_catalog().opamp("TL074H"), 0.01, 0.02)
    assert (better.offset_sigma, better.offset_limit) == (1e-3, 4e-3)
    assert spread.as_dict()["name"] == "bench-1"


@pytest.mark.parametrize("part", ["R1", "R50", "R210", "C1", "C4"])
def test_parts_are_uniform_over_their_grade(part: str) -> None:
    grade = SPREAD.resistor if part[0] == "R" else SPREAD.capacitor
    off = np.array([b.values[part] / EXACT[part] - 1.0 for b in boards()]) / grade
    assert np.abs(off).max() <= 1.0
    assert off.mean() == pytest.approx(0.0, abs=4 / math.sqrt(3 * N))
    assert off.std() == pytest.approx(1 / math.sqrt(3), rel=0.03)
    assert kstest(off, "uniform", args=(-1.0, 2.0)).pvalue > 1e-3


def test_offsets_are_normal_and_cut() -> None:
    cut = SPREAD.offset_limit / SPREAD.offset_sigma
    truth = truncnorm(-cut, cut)
    for section in CIRCUIT.sections:
        z = np.array([b.offset[section.name] for b in boards()]) / SPREAD.offset_sigma
        assert np.abs(z).max() <= cut
        assert z.mean() == pytest.approx(0.0, abs=4 / math.sqrt(N))
        assert z.std() == pytest.approx(truth.std(), rel=0.05)
        assert kstest(z, truth.cdf).pvalue > 1e-4


def test_rails_are_uniform_and_each_its_own() -> None:
    low = np.array([[b.rails[s.name][0] for s in CIRCUIT.sections] for b in boards()])
    high = np.array([[b.rails[s.name][1] for s in CIRCUIT.sections] for b in boards()])
    for rail in (-low, high):
        assert rail.min() >= 13.0 * 0.95
        assert rail.max() <= 13.0 * 1.05
        assert rail.mean(axis=0) == pytest.approx(np.full(rail.shape[1], 13.0), rel=2e-3)
        assert rail.std(axis=0) == pytest.approx(13.0 * 0.05 / math.sqrt(3), rel=0.05)


def test_everything_is_independent() -> None:
    columns = [[b.values[n] for b in boards()] for n in EXACT if n in boards()[0].values]
    columns += [[b.offset[s.name] for b in boards()] for s in CIRCUIT.sections]
    for side in (0, 1):
        columns += [[b.rails[s.name][side] for b in boards()] for s in CIRCUIT.sections]
    corr = np.corrcoef(np.array(columns))
    off = corr[~np.eye(len(corr), dtype=bool)]
    # About 2000 pairs: five standard errors.
    assert np.abs(off).max() < 5.0 / math.sqrt(N)


def test_neighbouring_samples_and_seeds_are_unrelated() -> None:
    one = draw_many(CIRCUIT, SPREAD, 1, range(1000)).values["R1"]
    two = draw_many(CIRCUIT, SPREAD, 2, range(1000)).values["R1"]
    assert abs(np.corrcoef(one, two)[0, 1]) < 0.15
    assert abs(np.corrcoef(one[:-1], one[1:])[0, 1]) < 0.15
    # (1, 2) is not (2, 1), nor (12,).
    assert draw(CIRCUIT, SPREAD, 1, 2) != draw(CIRCUIT, SPREAD, 2, 1)


def test_same_seed_and_index_same_board_on_any_worker() -> None:
    alone = [draw(CIRCUIT, SPREAD, 5, i) for i in range(40)]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda i: draw(CIRCUIT, SPREAD, 5, i), reversed(range(40))))
    assert together[::-1] == alone


def test_what_does_not_spread() -> None:
    board = draw(CIRCUIT, SPREAD, 3, 3)
    assert board.inverse_gain == 1.0 / CIRCUIT.gain
    assert set(board.bias.values()) == {CIRCUIT.bias}
    exact = draw(CIRCUIT, Spread(0.0, 0.0, 0.0, 0.0, 0.0), 3, 3)
    assert dict(exact.values) == CIRCUIT.values
    assert set(exact.offset.values()) == {0.0}
    assert set(exact.rails.values()) == {(-13.0, 13.0)}


def test_the_leftover_stiffness_has_the_spread_that_theory_says() -> None:
    """1 % resistors: a standard deviation of about a third of K1 (linearised by hand)."""
    from tests.shared.oracles import dead_zone_gains

    left = []
    for b in boards():
        steep, slope, through = dead_zone_gains(b.values)
        left.append((slope - steep * through) / b.values["R50"] * b.values["R4"])
    steep, slope, through = dead_zone_gains(EXACT)
    scale = slope / EXACT["R50"] * EXACT["R4"]
    variance = 0.0
    one_percent = 0.01 / math.sqrt(3)
    for part in (f"R{i}" for i in range(200, 210)):
        steep2, slope2, through2 = dead_zone_gains({**EXACT, part: EXACT[part] * 1.0001})
        ratio = math.log(steep2 * through2 / slope2) - math.log(steep * through / slope)
        variance += (ratio / math.log(1.0001) * one_percent) ** 2
    assert np.std(left) == pytest.approx(scale * math.sqrt(variance), rel=0.05)


def test_the_number_of_a_part_is_that_of_its_name_alone() -> None:
    """PCG64 from NumPy, seeded with (seed, CRC-32 of the name), read one number after the other."""
    drawn = draw_many(CIRCUIT, SPREAD, 17, range(5)).values["R50"]
    stream = np.random.Generator(np.random.PCG64(np.random.SeedSequence([17, crc32(b"R50")])))
    deviation = [2.0 * stream.random() - 1.0 for _ in range(5)]
    assert drawn / EXACT["R50"] == pytest.approx([1.0 + 0.01 * d for d in deviation], rel=1e-15)


def test_references_are_uniform_over_their_grade() -> None:
    from tests.shared.stages import rectifier, stage

    circuit = stage("rectifier", "both", rectifier())
    many = draw_many(circuit, SPREAD, 17, range(1500))
    drawn = [many.board(i) for i in range(1500)]
    for reference in circuit.references:
        assert (reference.volts, reference.grade) == (5.0, 0.005)
        off = np.array([b.reference[reference.name] / 5.0 - 1.0 for b in drawn]) / 0.005
        assert np.abs(off).max() <= 1.0
        assert kstest(off, "uniform", args=(-1.0, 2.0)).pvalue > 1e-3
    both = np.array([[b.reference["VR1"], b.reference["VR2"]] for b in drawn])
    assert abs(np.corrcoef(both.T)[0, 1]) < 0.15
    drop = {d.name: d.model.drop for d in circuit.diodes}
    assert all(b.drop == drop for b in drawn)
    exact = draw(circuit, Spread(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 3, 3)
    assert dict(exact.reference) == {"VR1": 5.0, "VR2": 5.0}
