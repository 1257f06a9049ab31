"""A loop of orbits is followed once round, and a branch once, wherever it is begun."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from designer.bifurcations.branch_survey import Survey, survey
from designer.bifurcations.continuation import Branch, End, start, trace
from designer.bifurcations.loop_check import images, place
from designer.bifurcations.points import Bifurcation, PointKind, locate
from designer.bifurcations.windows import NOT_LOCATED, all_windows
from designer.dynamics.attractors import settle, twin
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model import swept_model
from tests.bifurcations.test_continuation import PAPER


def flow_at(omega: float) -> Flow:
    return Flow(PAPER.second_order().piecewise_linear(), Drive(omega))


@cache
def loop(omega: float) -> Branch:
    """The symmetric orbits of period 3 that coexist with 1-1-1, from one of them on."""
    over = swept_model.of_model(PAPER, omega, "omega")
    rng = np.random.default_rng(8)
    for _ in range(200):
        orbit = settle(over.flow(omega), rng.uniform(-1.0, 1.0, 4))
        if orbit.n == 3:
            return trace(start(over, orbit, omega), 1.3, 1.8)
    raise AssertionError("no orbit of period 3")


def facts(points: list[Bifurcation]) -> list[tuple[str, float]]:
    return sorted((str(p.kind), round(p.value, 8)) for p in points)


@pytest.mark.slow
def test_a_loop_is_followed_once_round() -> None:
    """It turns back an even number of times, and its last orbit is its first, some periods on."""
    branch = loop(1.55)
    assert branch.ends == (End.CLOSED, End.CLOSED)
    first, last = branch.points[0], branch.points[-1]
    assert last.value == pytest.approx(first.value, abs=1e-12)
    laps = flow_at(first.value).run(first.solved.x, 3).strobes[:-1]
    assert np.abs(laps - last.solved.x).max(axis=1).min() < 1e-9
    found = facts(locate(branch))
    assert sum(kind == "fold" for kind, _ in found) == 4
    assert len(set(found)) == len(found)
    steps = [
        branch.curve.distance(a.solved, b.solved)
        for a, b in zip(branch.points, branch.points[1:], strict=False)
    ]
    assert max(steps) < 0.1


@pytest.mark.slow
def test_a_loop_is_the_same_from_another_of_its_orbits() -> None:
    assert facts(locate(loop(1.55))) == facts(locate(loop(1.505)))


def test_orbits_are_met_again_at_other_strobes_and_mirrored() -> None:
    over = swept_model.of_model(PAPER, 1.335, "omega")
    orbit = settle(flow_at(1.345), np.zeros(4))
    assert orbit.n == 2
    branch = trace(start(over, orbit, 1.345), 1.342, 1.348)
    curve, points = branch.curve, [p.solved for p in branch.points]
    middle = settle(flow_at(1.3451), orbit.start)
    flow = flow_at(1.3451)
    other = twin(flow, middle)
    assert other is not None
    for x in (middle.start, flow.run(middle.start, 1).strobes[-1], other.start):
        solved = curve.near(x, 1.3451)
        assert solved is not None
        at = place(curve, points, images(curve, solved))
        assert at is not None
        ends = sorted(points[k].value for k in (at, at + 1))
        assert ends[0] <= 1.3451 <= ends[1]
    aside = curve.near(middle.start, 1.3451)
    assert aside is not None
    moved = replace(aside, y=aside.y + np.append(1e-3 * curve.scale[:-1], 0.0))
    assert place(curve, points, images(curve, moved)) is None


@cache
def doubled(begun: float) -> Survey:
    """1-5-5 or 1-6-6, the twins between them and the orbits that double the twins' period."""
    over = swept_model.of_model(PAPER, begun, "omega")
    return survey(over, [(begun, settle(over.flow(begun), np.zeros(4)))], 0.27, 0.33)


@pytest.mark.slow
def test_doubled_branches_appear_once_each() -> None:
    """The twins double their period at four points, two and two joined by one branch each."""
    found = doubled(0.28)
    twins = next(
        n for n, b in enumerate(found.branches) if b.ends == (End.JOINED, End.JOINED)
    )  # fmt: skip
    leaving = [p for p in found.on(twins) if p.kind is PointKind.DOUBLING]
    assert len(leaving) == 4
    children = [b for b, q in zip(found.branches, found.parents, strict=True) if q == twins]
    assert [b.ends for b in children] == [(End.JOINED, End.JOINED)] * 2
    met = sorted(b.points[k].value for b in children for k in (0, -1))
    assert met == pytest.approx(sorted(p.value for p in leaving), abs=1e-9)
    assert all(0.27 <= p.value <= 0.33 for b in found.branches for p in b.points)
    names = facts(list(found.points))
    assert len(set(names)) == len(names)
    assert not any(NOT_LOCATED in (w.low.why, w.high.why) for w in all_windows(found))


@pytest.mark.slow
def test_no_fold_stands_where_branches_meet() -> None:
    found = doubled(0.28)
    meetings = [
        p.value for p in found.points if p.kind in (PointKind.PITCHFORK, PointKind.DOUBLING)
    ]
    for p in found.points:
        if p.kind is PointKind.FOLD:
            assert min(abs(p.value - m) for m in meetings) > 1e-9
    # The doubled orbits leave 0.3121564 towards lower ω and turn back, once, before they are seen
    # above it: each fold is the end of one stretch in that direction.
    number = next(
        n for n, b in enumerate(found.branches) if abs(b.points[0].value - 0.3121564) < 1e-7
    )
    rises = np.diff(found.branches[number].values) > 0.0
    turns = int(np.sum(rises[1:] != rises[:-1]))
    assert sum(p.kind is PointKind.FOLD for p in found.on(number)) == turns


@pytest.mark.slow
def test_a_branch_goes_on_where_it_turns_sharply_beside_a_grazing() -> None:
    """1-8-7 begins in a fold 1e-9 from a first touch. Further on it is what the flow settles to."""
    over = swept_model.of_model(PAPER, 0.25, "omega")
    found = survey(over, [(0.25, settle(over.flow(0.25), np.zeros(4)))], 0.2285, 0.2527, depth=1)
    assert all(End.LOST not in b.ends for b in found.branches)
    one = next(w for w in all_windows(found) if w.response == "1-8-7")
    assert (one.low.why, one.high.why) == (PointKind.DOUBLING, PointKind.FOLD)
    orbit = settle(flow_at(0.22992), one.high.orbit.start)
    assert orbit.response == "1-8-7"
    branch = found.branches[one.branch]
    solved = branch.curve.near(orbit.start, 0.22992)
    assert solved is not None
    points = [p.solved for p in branch.points]
    assert place(branch.curve, points, images(branch.curve, solved)) is not None


@pytest.mark.slow
def test_a_branch_that_is_lost_from_one_end_is_followed_from_the_other() -> None:
    """From 1-8-8 up to a sharp turn, and from 1-7-7 all the way: one branch, not one and a half."""
    over = swept_model.of_model(PAPER, 0.22, "omega")
    found = survey(over, [(0.22, settle(over.flow(0.22), np.zeros(4)))], 0.219, 0.2527, depth=1)
    twins = [b for b in found.branches if b.values.min() < 0.2225 and not b.curve.symmetric]
    assert len(twins) == 1
    assert twins[0].ends == (End.JOINED, End.JOINED)
    ends = sorted(twins[0].points[k].value for k in (0, -1))
    forks = [p.value for p in found.on(0) if p.kind is PointKind.PITCHFORK]
    assert all(min(abs(e - f) for f in forks) < 1e-9 for e in ends)
    names = facts(list(found.points))
    assert len(set(names)) == len(names)
