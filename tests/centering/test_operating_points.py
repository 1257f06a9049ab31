"""The place that is found, against every place of a dense grid on the same boards."""

from __future__ import annotations

import numpy as np
import pytest

from designer.centering.operating_points import MANY, best_points, room_of, score
from designer.centering.response_windows import OperatingPoint, stretches
from designer.centering.scaled_sigma import LADDER, ScaledBoards
from designer.dynamics.counts import Counts
from designer.model.response_table import Response
from designer.model.search_table import SearchSpec
from tests.shared.search_cases import made, spread

SPEC = Response(None, Counts(1, ((3, 3),)), b=(0.25, 0.265))
BAND = SearchSpec(omega=(0.49, 0.58))


@pytest.mark.slow
def test_the_place_is_as_good_as_a_dense_grid_s_best() -> None:
    model = made().modelfile.model
    bench = ScaledBoards(made().design, spread(), 3, MANY)
    (seen,) = stretches(model, [SPEC], BAND)
    ranked, tried = best_points(bench, SPEC, seen, room_of(SPEC, model.b, (0.49, 0.58)))
    best = ranked[0]
    assert 0.25 <= best.place.b <= 0.265
    assert tried > 20

    near = {s.b: s for s in seen}
    grid = [
        OperatingPoint(float(omega), float(b), start.start)
        for b in np.linspace(0.25, 0.265, 4)
        for stretch in [near[min(near, key=lambda v: abs(v - b))]]
        for omega in np.geomspace(0.49, 0.58, 12)
        for start in [min(stretch.places, key=lambda p: abs(p.omega - omega))]
    ]
    dense = score(bench, SPEC, grid, MANY, LADDER[1:])
    top = max(s.reliability_index for s in dense)
    # The grid has 48 places; a pattern of finite steps may stay a little below its best one.
    assert best.reliability_index >= 0.95 * top
    assert sum(s.operating_orbit is not None for s in dense) > 20


def test_what_is_fixed_stays_fixed() -> None:
    model = made().modelfile.model
    spec = Response(0.85, Counts(1, ((2, 2),)), b=(0.25, 0.27))
    bench = ScaledBoards(made().design, spread(), 3, MANY)
    (seen,) = stretches(model, [spec], SearchSpec(omega=(0.7, 1.0)))
    ranked, _ = best_points(bench, spec, seen, room_of(spec, model.b, (0.7, 1.0)))
    assert {s.place.omega for s in ranked} == {0.85}
    assert all(0.25 <= s.place.b <= 0.27 for s in ranked)
