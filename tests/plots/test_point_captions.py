"""What a caption says of a point, against an integrator that shares nothing with the package.

DOP853, restarted at each impact, closes the orbits beside each point, says by their multipliers
whether they are stable, and runs to what is born there.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from designer.bifurcations.branch_switch import birth
from designer.bifurcations.continuation import Branch, start, trace
from designer.bifurcations.points import Bifurcation, PointKind, locate
from designer.bifurcations.sweep import Sweep, SweepPlan
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import SteadyMotion
from designer.model import swept_model
from designer.model.swept_model import ModelSubject
from designer.plots.captions import changes
from designer.plots.point_captions import caption
from tests.bifurcations.test_continuation import PAPER, PLAIN, monodromy
from tests.shared.oracles import Trajectory, integrate

STARTS = np.random.default_rng(5).uniform(-0.5, 0.5, (40, 4))
CASES = [
    # an attractor at ω and its branch's ends; the point, its kind and where what is born is looked
    # for; what the caption says
    (
        (0.75, 0.70, 0.77),
        (0.718977872, PointKind.DOUBLING, 0.712),
        "period doubling of 1-2-2 asymmetric at ω = 0.718977872: stable above, unstable below; "
        "2-4-4 is born below, stable",
    ),
    (
        (0.80, 0.77, 0.81),
        (0.78722435, PointKind.PITCHFORK, 0.783),
        "pitchfork of 1-2-2 symmetric at ω = 0.78722435: stable above, unstable below; "
        "its two asymmetric twins 1-2-2 are born below, stable",
    ),
]


@cache
def branch(omega: float, low: float, high: float) -> Branch:
    over = swept_model.of_model(PAPER, omega, "omega")
    return trace(start(over, settle(over.flow(omega), np.zeros(4)), omega), low, high)


def located(where: Branch, kind: PointKind, near: float) -> Bifurcation:
    (point,) = [p for p in locate(where) if p.kind is kind and abs(p.value - near) < 1e-8]
    return replace(point, born=birth(where, point))


def counts(run: Trajectory, omega: float, periods: int) -> str:
    """n-p-q of the last periods of a run."""
    since = 2.0 * np.pi / omega * (len(run.strobes) - 1 - periods)
    late = run.sides[run.times >= since]
    return f"{periods}-{(late > 0).sum()}-{(late < 0).sum()}"


@pytest.mark.slow
@pytest.mark.parametrize(("course", "point", "text"), CASES)
def test_a_caption_is_what_another_integrator_sees(
    course: tuple[float, float, float], point: tuple[float, PointKind, float], text: str
) -> None:
    where = branch(*course)
    p = located(where, point[1], point[0])
    assert caption(p, "ω") == text
    # The multipliers of the continued orbit, on both sides of the point.
    for shift, stable in ((2e-3, True), (-2e-3, False)):
        omega = p.value + shift
        beside = where.curve.near(p.point.solved.x, omega)
        assert beside is not None
        n = where.curve.n
        lap = integrate(PLAIN, omega, list(beside.x), n)
        assert np.abs(lap.strobes[-1] - beside.x).max() < 1e-9
        assert counts(lap, omega, n) == p.response
        multipliers = np.linalg.eigvals(monodromy(PLAIN, omega, beside.x, n))
        assert (np.abs(multipliers).max() < 1.0) == stable
    # What is born, run to from the orbit that lost its stability.
    omega = point[2]
    gone = where.curve.near(p.point.solved.x, omega)
    assert gone is not None
    assert p.born is not None
    n = int(p.born.response.split("-")[0])
    run = integrate(PLAIN, omega, list(gone.x * (1.0 + 1e-2)), 80)
    assert counts(run, omega, n) == p.born.response
    moved = np.abs(run.strobes[-1] - run.strobes[:-1][::-1]).max(axis=1)
    assert moved[n - 1] < 1e-4 < 1e-3 < (np.abs(run.strobes[-1] - gone.x)).max()
    if point[1] is PointKind.DOUBLING:
        assert moved[0] > 1e-3


@pytest.mark.slow
def test_a_fold_and_a_grazing_point_are_told_by_their_own_branch() -> None:
    """Both sides of the grazing are run by the other integrator; past the fold there is none."""
    touched = branch(0.70, 0.6855, 0.701)
    p = located(touched, PointKind.GRAZING, 0.6859225816)
    low = min({p.before, p.after} - {"2-4-4"})
    assert low in ("2-5-4", "2-4-5")  # either twin
    assert caption(p, "ω") == (
        f"grazing at ω = 0.685922582: {low} asymmetric below, 2-4-4 asymmetric above; the counts "
        "of impacts change; stable on both sides"
    )
    for shift, response in ((-1e-4, low), (1e-4, "2-4-4")):
        beside = touched.curve.near(p.point.solved.x, p.value + shift)
        assert beside is not None
        lap = integrate(PLAIN, p.value + shift, list(beside.x), 2)
        assert counts(lap, p.value + shift, 2) == response
    over = swept_model.of_model(PAPER, 1.342, "omega")
    met = next(o for o in (settle(over.flow(1.342), x) for x in STARTS) if o.response == "1-1-2")
    folded = trace(start(over, met, 1.342), 1.34, 1.40)
    q = located(folded, PointKind.FOLD, 1.3687522838)
    assert caption(q, "ω") == (
        "fold of 1-1-2 asymmetric at ω = 1.36875228: a stable and an unstable orbit meet, both "
        "below; above there is neither"
    )
    multipliers = np.linalg.eigvals(monodromy(PLAIN, q.value, q.point.orbit.start, 1))
    assert np.abs(multipliers - 1.0).min() < 1e-4
    assert folded.curve.near(q.point.solved.x, q.value + 1e-4) is None


@pytest.mark.parametrize(
    ("track", "below", "above", "told"),
    [
        ("down", "2-4-4", "1-2-2", True),
        ("up", "2-4-4", "1-2-2", True),
        ("down", "aperiodic", "1-2-2", True),  # the steps pass over the doubled orbits
        ("down", "1-2-2", "1-1-1", False),  # the track comes from elsewhere
        ("up", "1-1-1", "1-2-2", False),  # it falls onto the branch for another reason
        ("up", "1-2-2", "1-1-1", False),
    ],
)
def test_a_track_that_is_not_on_the_branch_says_nothing_of_its_point(
    track: str, below: str, above: str, told: bool
) -> None:
    p = located(branch(0.75, 0.70, 0.77), PointKind.DOUBLING, 0.718977872)
    steps = tuple(step_of(r) for r in (below, below, below, above, above, above))
    values = p.value + np.linspace(-5e-3, 5e-3, 6)
    plan = SweepPlan(ModelSubject(PAPER), "omega", values, (track,))
    (change,) = changes(Sweep(plan, {track: steps}), p)
    assert (change.track == track) is told
    if not told:
        assert change.text.startswith("period doubling of 1-2-2 asymmetric: stable above")


def step_of(response: str) -> SteadyMotion:
    n, p, q = map(int, response.split("-")) if "-" in response else (0, 0, 0)
    status = OrbitStatus.PERIODIC if n else OrbitStatus.APERIODIC
    none = np.zeros(0)
    symmetric = response == "1-1-1" if n else None
    return SteadyMotion(status, n, p, q, symmetric, 0.0, 0.5, none, none, none, none, 0)
