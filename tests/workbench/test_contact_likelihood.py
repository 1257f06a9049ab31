"""Likelihood of contact at an extreme, where it has a closed form."""

from __future__ import annotations

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.workbench.board_curve import ContactLikelihood

POINTS, ERROR, NOISE = 1000, 0.01, 0.05
PHASE = np.arange(POINTS) / POINTS


def of(height: float, place: Array, depth: Array) -> ContactLikelihood:
    """Two maxima round a lap, at 250 and 750: one ``height`` beyond the stop, one far before it."""
    angle = 2.0 * np.pi * (PHASE - 0.25)
    trace = height + np.cos(2.0 * angle) - 1.0 - 0.3 * (1.0 - np.cos(angle))
    return ContactLikelihood(trace, np.full(POINTS, ERROR), 0.1 * ERROR, place, depth, NOISE)


@pytest.mark.parametrize("sigmas", [-20.0, -3.0, 2.0, 30.0])
def test_without_samples_it_is_that_of_a_normal_distance(sigmas: float) -> None:
    nothing = np.zeros(0)
    ratio = of(sigmas * ERROR, nothing, nothing).ratio(250)
    assert ratio == pytest.approx(0.5 * sigmas * abs(sigmas), rel=1e-9)


def test_each_sample_in_contact_adds_the_square_of_its_depth() -> None:
    """Without contact the best distance is 0, where no sample has a depth."""
    height = 3.0 * ERROR
    place = np.arange(200.0, 300.0)
    depth = np.maximum(of(height, place, place).trace[200:300], 0.0)
    expected = 0.5 * (9.0 + (depth**2).sum() / NOISE**2)
    assert of(height, place, depth).ratio(250) == pytest.approx(expected, rel=1e-9)


def test_samples_about_another_extreme_say_nothing() -> None:
    place = np.array([240.0, 260.0, 740.0, 750.0])
    quiet, loud = np.zeros(4), np.array([0.0, 0.0, 5.0, -5.0])
    assert of(ERROR, place, loud).ratio(250) == of(ERROR, place, quiet).ratio(250)
