"""Sobol points against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from designer.base.sobol import DIRECTIONS, sobol


@pytest.mark.parametrize("dimensions", range(1, len(DIRECTIONS) + 2))
def test_points_are_those_of_scipy(dimensions: int) -> None:
    for seed, count in ((0, 16), (3, 1), (7, 1024)):
        theirs = qmc.Sobol(dimensions, seed=seed).random(count)
        np.testing.assert_array_equal(sobol(dimensions, count, seed), theirs)
