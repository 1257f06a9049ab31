"""The spread that many fits tell, against boards that were drawn with another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from designer.base.errors import InputError
from designer.model.measured_values import read_measured
from designer.spread.board_quantities import column
from designer.spread.spread import draw_many
from designer.workbench.board_fit import BoardFit
from designer.workbench.board_prior import Prior
from designer.workbench.spread_estimate import estimated_spread, measured_list
from tests.shared.bench_plans import SPREAD
from tests.shared.paper_cases import subject

FACTORS = {"R": 0.5, "C": 2.0, "U": 1.5}
"""Of the standard deviation that the boards are drawn with, by the first letter of a name."""


@pytest.fixture(scope="module")
def fits() -> list[BoardFit]:
    """Of 60 boards, each told 12 random sums of its coordinates with noise: the posterior of linear
    normal theory, in closed form."""
    prior, rng = Prior(subject(1).circuit, SPREAD), np.random.default_rng(4)
    scale = np.empty(prior.size)
    for k in range(prior.size):
        sigma = np.array([q.sigma for q in prior.quantities])
        quantity = prior.quantities[int(np.argmax(np.abs(prior.slopes[:, k]) / sigma))]
        scale[k] = FACTORS[quantity.name[0]]
    out = []
    for _ in range(60):
        truth, rows = scale * rng.standard_normal(prior.size), rng.standard_normal((12, prior.size))
        heard, noise = rows @ truth, 0.1
        heard = heard + noise * rng.standard_normal(12)
        precision = rows.T @ rows / noise**2 + np.eye(prior.size)
        covariance = np.asarray(np.linalg.inv(precision), dtype=float)
        centre = covariance @ rows.T @ heard / noise**2
        out.append(BoardFit(prior, (), centre, covariance, (), (), (), (), (), 0))
    return out


@pytest.mark.slow
def test_each_kind_has_the_spread_that_the_boards_were_drawn_with(fits: list[BoardFit]) -> None:
    wide = {s.kind: s for s in estimated_spread(fits)}
    for kind, letter in (("resistors", "R"), ("capacitors", "C"), ("offsets", "U")):
        assert wide[kind].low < FACTORS[letter] < wide[kind].high
        assert wide[kind].high < 2.0 * wide[kind].low


def test_one_board_tells_nothing_of_rare_kinds(fits: list[BoardFit]) -> None:
    silent = replace(fits[0], covariance=np.eye(fits[0].prior.size), centre=0.0 * fits[0].centre)
    assert estimated_spread([silent]) == ()
    with pytest.raises(InputError, match="one board at least"):
        estimated_spread([])


def test_the_list_is_drawn_as_it_was_fitted(fits: list[BoardFit], tmp_path: Path) -> None:
    """``tolerance --measured`` draws the very boards."""
    path = tmp_path / "boards.csv"
    path.write_text(measured_list({"A": fits[0], "B": fits[1]}), "utf-8")
    listed = read_measured(path)
    assert listed.boards == ("A", "B")
    prior = fits[0].prior
    drawn = draw_many(prior.circuit, replace(SPREAD, measured=listed), 5, range(2))
    wanted = prior.boards(np.stack([fits[0].centre, fits[1].centre]))
    for quantity in prior.quantities:
        np.testing.assert_allclose(column(drawn, quantity), column(wanted, quantity), rtol=1e-9)
    path.write_text(measured_list({"A": fits[0]}, draws=3), "utf-8")
    assert read_measured(path).boards == ("A 1", "A 2", "A 3")
