"""What leaves a pitchfork or a doubling is the same however the parent branch was come by."""

from __future__ import annotations

import numpy as np
import pytest

from designer.bifurcations.branch_switch import _leaving, switch
from designer.bifurcations.continuation import Branch, start, trace
from designer.bifurcations.points import Bifurcation, PointKind, locate
from designer.dynamics.attractors import settle
from designer.model import swept_model
from tests.bifurcations.test_continuation import PAPER

FORK = 0.27477536
"""ω of a pitchfork of 1-6-6."""


def fork_from(begun: float, high: float) -> tuple[Branch, Bifurcation]:
    """The symmetric branch begun at a frequency, and its pitchfork at ``FORK``."""
    over = swept_model.of_model(PAPER, begun, "omega")
    origin = start(over, settle(over.flow(begun), np.zeros(4)), begun)
    branch = trace(origin, 0.27, high)
    found = [p for p in locate(branch) if p.kind is PointKind.PITCHFORK]
    return branch, min(found, key=lambda p: abs(p.value - FORK))


@pytest.mark.slow
def test_children_of_a_pitchfork_are_the_same_from_two_starting_points() -> None:
    children = []
    for begun, high in ((0.28, 0.3), (1.55, 1.6)):
        parent, fork = fork_from(begun, high)
        assert abs(fork.value - FORK) < 1e-7
        child = switch(parent, fork, 0.273, 0.279)
        assert child is not None
        assert abs(child.points[0].value - FORK) < 1e-4
        children.append(child)
    one, other = children
    assert one.curve.scale == pytest.approx(other.curve.scale, rel=1e-6)
    assert [p.response for p in one.points[:20]] == [p.response for p in other.points[:20]]
    for a, b in zip(one.points[:20], other.points[:20], strict=True):
        assert one.curve.distance(a.solved, b.solved) < 1e-6


@pytest.mark.parametrize("seed", range(8))
def test_direction_left_in_does_not_depend_on_the_sign_of_an_eigenvector(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(4, 4))
    vectors[:, 0] /= np.linalg.norm(vectors[:, 0])
    map_ = vectors @ np.diag([-1.0, 0.5, 0.2, -0.3]) @ np.linalg.inv(vectors)
    wanted = vectors[:, 0] * np.sign(vectors[np.argmax(np.abs(vectors[:, 0])), 0])
    assert _leaving(map_, np.ones(4)) == pytest.approx(wanted, abs=1e-9)
