"""Our Sobol points against those of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from designer.dynamics.sobol_points import DIRECTIONS, sobol


@pytest.mark.parametrize("dimension", range(1, 3 + len(DIRECTIONS)))
def test_points_are_those_of_scipy(dimension: int) -> None:
    for seed in (0, 7):
        expected = qmc.Sobol(dimension, seed=seed).random(64)
        assert np.array_equal(sobol(dimension, 64, seed), expected)
        assert np.array_equal(sobol(dimension, 1, seed), expected[:1])
