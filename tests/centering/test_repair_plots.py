"""The picture of a repair: what is drawn where prices differ, and where nothing costs anything."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from designer.centering.repair_measure import MeasuredYield
from designer.centering.repair_plots import front_chart
from designer.centering.repair_trial import Repair, Trial
from designer.centering.repair_upgrade import Upgrades, WindowPlace
from designer.yields.yield_count import Yield
from tests.shared import paper_cases


def trial(price: float, ok: int, upgrades: Upgrades | None = None) -> Trial:
    measured = MeasuredYield(Yield(ok, 500 - ok, 0, 0), 0.99)
    return Trial("as it is", upgrades or Upgrades(), price, (0.995,), (measured,), 0.99)


def repaired(before: Trial, rounds: Sequence[Trial], front: Sequence[Trial]) -> Repair:
    base = paper_cases.synthesised()
    return Repair(base, 0.99, None, before, tuple(rounds), True, "", ("",), tuple(front))


def points(found: Repair) -> np.ndarray:
    """(k, 2) of what was measured, as it is drawn."""
    axes = front_chart(found).axes[0]
    (drawn,) = [np.array(line.get_xydata()) for line in axes.lines if line.get_marker() == "o"]
    low, high = axes.get_xlim()
    assert ((drawn[:, 0] > low) & (drawn[:, 0] < high)).all()
    return np.asarray(drawn)


def test_prices_are_along_the_axis() -> None:
    before, first = trial(0.0, 100), trial(0.4, 499, Upgrades(grades={"R4": 0.001}))
    found = repaired(before, [first], [before, first])
    assert points(found) == pytest.approx(np.array([[0.0, 20.0], [0.4, 99.8]]))


def test_what_is_cheaper_than_the_design_as_it_is_is_drawn_too() -> None:
    """Limits of the axis that are one and the same were a warning."""
    before, first = trial(0.0, 100), trial(-0.3, 499, Upgrades(opamp="TL074H"))
    found = repaired(before, [first], [first, before])
    assert points(found)[0] == pytest.approx(np.array([-0.3, 99.8]))


def test_where_nothing_costs_anything_rounds_are_along_the_axis() -> None:
    """Each point has a place of its own, also one that the front leaves out."""
    places = [Upgrades(places={0: WindowPlace(w, 0.25)}) for w in (0.84, 0.86)]
    before = trial(0.0, 100)
    rounds = [trial(0.0, 400, places[0]), trial(0.0, 499, places[1])]
    found = repaired(before, rounds, [before, rounds[1]])
    assert points(found) == pytest.approx(np.array([[0.0, 20.0], [1.0, 80.0], [2.0, 99.8]]))
    axes = front_chart(found).axes[0]
    assert [t.get_text() for t in axes.get_xticklabels()] == ["as it is", "round 1", "round 2"]
    assert points(repaired(before, [], [before])) == pytest.approx(np.array([[0.0, 20.0]]))
