"""Chaos and its transients: what many starts of one system lead to, against plain long runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.dynamics import coexisting_attractors, step_budget
from designer.dynamics.attractors import followed, settle, starts, with_exponent
from designer.dynamics.coexisting_attractors import coexisting, outlived
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.steady_state import TransientSettings
from tests.dynamics.test_attractors import REST, SCALE, flow_at
from tests.dynamics.test_steady_state import setting

TRANSIENT = 1.22
"""Chaos lives here for some thousands of periods, and ends on 1-1-1."""
LASTING = 1.2


def plainly(flow: Flow, x: Array, periods: int) -> int:
    """The period on which a plain run of so many drive periods ends; 0 where it repeats none."""
    strobes = flow.run(x, periods).strobes
    gaps = [np.abs(strobes[-1] - strobes[-1 - n]).max() for n in range(1, 17)]
    return next((n for n, gap in enumerate(gaps, start=1) if gap < 1e-8), 0)


def chaotic_starts(flow: Flow, count: int) -> list[Orbit]:
    """Starts that are chaotic after a first look."""
    orbits = [settle(flow, x, watch=0) for x in starts(SCALE, 4 * count, 3)]
    return [o for o in orbits if o.status is OrbitStatus.APERIODIC][:count]


def test_chaos_that_ends_is_followed_to_its_end() -> None:
    flow = flow_at(TRANSIENT)
    chaotic = chaotic_starts(flow, 6)
    assert len(chaotic) == 6
    for orbit, after in zip(chaotic, outlived(flow, chaotic), strict=True):
        assert after.response == "1-1-1"
        assert after.periods > orbit.periods
        assert plainly(flow, orbit.start, 40_000) == 1


def test_chaos_that_lasts_is_chaos_after_a_longer_run_too() -> None:
    flow = flow_at(LASTING)
    chaotic = chaotic_starts(flow, 4)
    assert len(chaotic) == 4
    after = outlived(flow, chaotic, measure=True)
    assert {o.status for o in after} == {OrbitStatus.APERIODIC}
    assert after[0].lyapunov_error < 0.02 * after[0].lyapunov
    assert plainly(flow, after[1].start, 20_000) == 0


def test_chaos_that_ended_once_is_no_chaos_of_other_starts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Watched too shortly by themselves, they are outlived by what is known of another one."""
    flow = flow_at(TRANSIENT)
    (ended,) = coexisting(flow, starts(SCALE, 16))
    assert max(ended.transients) > 1000
    chaotic = chaotic_starts(flow, 3)[::2]
    monkeypatch.setattr(coexisting_attractors, "CALM", 60)
    assert {o.status for o in outlived(flow, chaotic)} == {OrbitStatus.APERIODIC}
    assert [o.response for o in outlived(flow, chaotic, known=ended.transients)] == ["1-1-1"] * 2


def test_chaos_has_to_outlive_the_average_of_all_lives_not_the_longest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    flow = flow_at(LASTING)
    orbit = settle(flow_at(0.85), REST)
    ended = [replace(orbit, transients=(life,)) for life in (50, 60, 2183)]
    chaos = replace(orbit, status=OrbitStatus.APERIODIC, n=0, periods=0)
    with monkeypatch.context() as patched:
        patched.setattr(coexisting_attractors, "outlived", lambda *_: ended)
        (met,) = coexisting(flow_at(0.85), [])
    assert met.transients == (50, 60, 2183)
    monkeypatch.setattr(coexisting_attractors, "CALM", 60)
    longer = "designer.dynamics.coexisting_attractors.followed"
    monkeypatch.setattr(longer, lambda _, o, more, _b: replace(o, periods=o.periods + more))
    (watched,) = outlived(flow, [chaos], known=met.transients)
    assert 10 * np.mean(met.transients) <= watched.periods < 10 * 2183


def test_the_attractors_of_many_starts_have_no_transient_among_them() -> None:
    flow = flow_at(TRANSIENT)
    assert [o.response for o in coexisting(flow, starts(SCALE, 16))] == ["1-1-1"]


@pytest.mark.slow
def test_an_exponent_measured_over_the_end_of_chaos_is_of_no_chaos() -> None:
    flow = flow_at(TRANSIENT)
    orbit = chaotic_starts(flow, 6)[0]
    after = with_exponent(flow, orbit)
    assert after.response == "1-1-1"
    (life,) = after.transients
    assert plainly(flow, orbit.start, life) == 1


def test_an_exponent_that_is_known_closely_is_not_measured_again() -> None:
    flow = flow_at(LASTING)
    (orbit,) = chaotic_starts(flow, 1)
    measured = with_exponent(flow, orbit)
    assert with_exponent(flow, measured) is measured


def test_what_is_chaotic_still_when_no_steps_are_left_is_open_where_others_ended(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Work is bounded: past that nobody knows, and it is not called chaos."""
    flow = flow_at(TRANSIENT)
    chaotic = chaotic_starts(flow, 8)
    monkeypatch.setattr(step_budget, "STARTS", 100_000)
    after = outlived(flow, chaotic)
    left = [o for o in after if o.status is not OrbitStatus.PERIODIC]
    assert 0 < len(left) < 8
    assert {o.status for o in left} == {OrbitStatus.NOT_SETTLED}
    assert all("may be a transient" in o.reason for o in left)


def test_what_no_chaos_is_stays_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    flow = flow_at(0.85)
    orbits = [settle(flow, x) for x in starts(SCALE, 4)]
    monkeypatch.delattr(coexisting_attractors, "followed")
    assert outlived(flow, orbits) == orbits


def test_a_motion_said_to_be_chaotic_without_growth_is_settled_anew() -> None:
    flow = flow_at(0.85)
    orbit = settle(flow, REST)
    claimed = replace(orbit, status=OrbitStatus.APERIODIC, n=0, lyapunov_error=np.nan)
    assert followed(flow, claimed, 300).response == orbit.response
    assert with_exponent(flow, claimed).response == orbit.response


def test_a_step_of_a_sweep_is_no_transient_of_some_hundred_periods() -> None:
    x = np.array([-1.2, 1.3, 0.7, -0.4])
    ends = [
        setting(TRANSIENT).steady(x * k, TransientSettings()) for k in np.linspace(0.2, 1.5, 12)
    ]
    assert all(end.status is OrbitStatus.PERIODIC for end in ends[:1])
    assert sum(end.status is OrbitStatus.PERIODIC for end in ends) >= 9
