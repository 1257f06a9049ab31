"""Impacts counted on curves whose contacts are known."""

from __future__ import annotations

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.workbench.contact_count import SURE, ContactEvidence, count, extremes
from designer.workbench.dead_zone_curve import fitted
from designer.workbench.prediction import PredictedStop

ERROR = 0.01
STOP = PredictedStop("A", "fv", {"v1": 1.0}, {1: 5.0, -1: -5.0}, (0.0, 0.03), {1: 2.0, -1: 2.0})


def bumps(heights: list[float], valleys: list[float], points: int = 2000) -> Array:
    """A closed lap through these maxima and minima, smooth in between, beyond the stop above 0."""
    knots = np.array([x for pair in zip(heights, valleys, strict=True) for x in pair])
    place = np.arange(points) * len(knots) / points
    cell = place.astype(int)
    share = 0.5 - 0.5 * np.cos(np.pi * (place - cell))
    return np.asarray(knots[cell] + share * (knots[(cell + 1) % len(knots)] - knots[cell]))


def evidence(trace: Array, seed: int = 0, *, output: bool = True) -> ContactEvidence:
    rng = np.random.default_rng(seed)
    smooth = np.convolve(rng.normal(size=len(trace) + 8), np.ones(9) / 3.0, "valid") * ERROR
    depth = np.maximum(trace, 0.0) + smooth[::-1] if output else None
    return ContactEvidence(trace + smooth, ERROR, depth, ERROR, ERROR)


def entries(trace: Array) -> int:
    """How often a closed trace rises through 0: the slow obvious way."""
    beyond = trace > 0.0
    return int((beyond & ~np.roll(beyond, 1)).sum())


@pytest.mark.parametrize("output", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_clear_contacts_are_counted_and_sure(seed: int, output: bool) -> None:
    rng = np.random.default_rng([3, seed])
    heights = list(rng.choice([-0.8, 0.3, 0.9, 1.4], size=9))
    valleys = list(rng.choice([-3.0, -0.9, -0.2], size=9))
    trace = bumps(heights, [min(v, h - 0.3) for v, h in zip(valleys, heights, strict=True)])
    counted = count(evidence(trace, seed, output=output))
    assert counted.impacts == entries(trace)
    assert counted.others == ()
    assert len(counted.entries) == counted.impacts


@pytest.mark.parametrize(
    ("heights", "valleys", "numbers"),
    [
        ([1.0, 0.005, 1.0], [-1.0, -1.0, -1.0], {2, 3}),  # a contact as deep as half the error
        ([1.0, -0.005, 1.0], [-1.0, -1.0, -1.0], {2, 3}),  # a miss as near
        ([1.0, 1.0, 1.0], [-1.0, 0.004, -1.0], {2, 3}),  # a valley between two contacts
    ],
)
def test_what_is_within_the_noise_is_left_open(
    heights: list[float], valleys: list[float], numbers: set[int]
) -> None:
    for seed in range(6):
        counted = count(evidence(bumps(heights, valleys), seed))
        assert numbers <= {counted.impacts, *(number for number, _ in counted.others)}
        assert all(0.0 <= cost < SURE for _, cost in counted.others)


def test_how_sure_is_sure_enough_can_be_said() -> None:
    """A contact 3.5 errors deep is open at four standard errors and decided at three."""
    trace = bumps([1.0, 3.5 * ERROR, 1.0], [-1.0, -1.0, -1.0])
    seen = ContactEvidence(trace, ERROR, None, np.inf, ERROR)
    ((number, cost),) = count(seen).others
    assert number == 2
    assert cost == pytest.approx(0.5 * 3.5**2, rel=1e-3)
    assert count(seen, 4.5).others == ()


def test_no_contact_and_no_end_of_contact_are_no_impacts() -> None:
    assert count(evidence(bumps([-1.0], [-2.0]))).impacts == 0
    assert count(evidence(bumps([3.0], [2.0]))).impacts == 0


def test_extremes_are_those_that_stand_out() -> None:
    angle = 2.0 * np.pi * np.arange(1000) / 1000.0
    trace = np.sin(angle) + 0.02 * np.sin(40.0 * angle)
    assert len(extremes(trace, 0.3)) == 2
    assert len(extremes(np.sin(3.0 * angle), 0.3)) == 6


def test_the_stops_are_where_the_output_turns() -> None:
    """Of a stage that is off: other ends, other slopes, an offset; known to a fraction of the
    noise of one point."""
    rng = np.random.default_rng(5)
    phase = 2.0 * np.pi * np.arange(2048) / 2048.0
    moved = 6.8 * np.sin(phase) + 0.3 * np.sin(5.0 * phase)
    off = PredictedStop("A", "fv", {"v1": 1.0}, {1: 4.7, -1: -5.2}, (0.1, 0.05), {1: 1.9, -1: 2.1})
    output = off.output_of(moved) + ERROR * rng.normal(size=len(moved))
    curve = fitted(moved + ERROR * rng.normal(size=len(moved)), output, (ERROR, ERROR), STOP, 2048)
    for side in (1, -1):
        assert abs(curve.ends[side] - off.ends[side]) < 5.0 * curve.end_errors[side] + 1e-3
        assert curve.end_errors[side] < 0.2 * ERROR
        assert curve.gains[side] == pytest.approx(off.gains[side], rel=0.01)
    inside = np.abs(moved) < 4.0
    assert np.abs(curve.excess(moved, output)[inside]).max() < 6.0 * ERROR


def test_a_stop_that_a_shallow_contact_hardly_reaches_is_found() -> None:
    """Where a scope's zero has moved it: the search went past the motion's reach and stayed there,
    with a slope of the wrong sign."""
    nominal = PredictedStop("A", "fv", {"v1": 1.0}, {1: 9.54}, (0.0, 0.0), {1: 6.07})
    real = PredictedStop("A", "fv", {"v1": 1.0}, {1: 9.98}, (0.0, 0.0), {1: 5.83})
    phase = 2.0 * np.pi * np.arange(1024) / 1024.0
    moved = 2.4 + 8.0 * np.sin(phase) - 0.02 * np.sin(2.0 * phase)
    curve = fitted(moved, real.output_of(moved), (1e-2, 1e-3), nominal, 64.0)
    assert curve.ends[1] == pytest.approx(9.98, abs=1e-4)
    assert curve.gains[1] == pytest.approx(5.83, rel=1e-3)
    assert curve.misfit < 1e-3
