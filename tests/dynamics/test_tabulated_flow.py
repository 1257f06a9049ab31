"""The tabulated fast path equals the general kernel on any system, event for event."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from designer.base.arrays import Array
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowResult, FlowStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.clearance import Clearance, Side
from designer.model.mechanics import SecondOrderSystem

PERIODS = 4


@dataclass(frozen=True)
class Case:
    """A system under a drive, and where it starts."""

    system: SecondOrderSystem
    omega: float
    offset: float
    start: Array


@st.composite
def sides(draw: st.DrawFn) -> tuple[Side | None, Side | None]:
    """Both, either, equal or unequal, one of them preloaded."""

    def side(least: float) -> Side:
        return Side(draw(st.floats(least, 0.5)), 10.0 ** draw(st.floats(0.0, 2.0)))

    first = side(-0.1)
    which = draw(st.sampled_from(("even", "uneven", "upper", "lower")))
    if which == "even":
        first = Side(abs(first.gap), first.stiffness)
    second = side(0.1) if which == "uneven" else first
    return None if which == "lower" else first, None if which == "upper" else second


@st.composite
def cases(draw: st.DrawFn, masses: int) -> Case:
    """A chain with clearances to ground and between masses."""
    n = masses
    number = st.floats(0.3, 3.0)
    stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
    for i in range(n):
        ends = np.zeros(n)
        ends[i : i + 2] = (1.0, -1.0)[: n - i]
        stiffness += draw(number) * np.outer(ends, ends)
        damping += 0.2 * draw(number) * np.outer(ends, ends)
    clearances = []
    for k in range(draw(st.integers(1, 3))):
        mass = draw(st.integers(0, n - 1))
        others = [None, *(j for j in range(n) if j != mass)]
        upper, lower = draw(sides())
        clearances.append(Clearance(f"{k}", mass, draw(st.sampled_from(others)), upper, lower))
    system = SecondOrderSystem(
        mass=np.array([draw(number) for _ in range(n)]),
        damping=damping,
        stiffness=stiffness,
        force=np.array([draw(st.floats(-1.0, 1.0)) for _ in range(n)]),
        clearances=tuple(clearances),
        constant=np.array([draw(st.floats(-0.2, 0.2)) for _ in range(n)]),
        base=draw(st.sampled_from((0.0, 0.3))),
        fixed_stops=draw(st.booleans()),
    )
    moving = st.floats(-0.5, 0.5).filter(lambda value: abs(value) > 1e-3)
    start = np.array([draw(moving) for _ in range(2 * n)])
    return Case(system, draw(st.floats(0.2, 2.0)), draw(st.floats(-0.1, 0.1)), start)


def runs(case: Case) -> tuple[FlowResult, FlowResult]:
    """By the fast path and by the general kernel, measured, with the monodromy matrix."""
    drive = Drive(case.omega, 1.0, case.offset)
    system = case.system.piecewise_linear(case.omega)
    fast, slow = Flow(system, drive), Flow(system, drive, fast=False)
    assert fast._tabulated is not None or system.size == 4
    size = len(case.start)
    got, want = (
        flow.run(case.start, PERIODS, tangent=np.eye(size), measure=True) for flow in (fast, slow)
    )
    return got, want


def at_rest_in_a_clearance(case: Case) -> bool:
    """Whether a clearance's displacement turns at the very start, so that a tie decides."""
    v = case.start[1::2]
    return any(
        abs(v[c.mass] - (0.0 if c.other is None else v[c.other])) < 1e-9
        for c in case.system.clearances
    )


def compare(case: Case) -> None:
    assume(not at_rest_in_a_clearance(case))
    got, want = runs(case)
    assert got.status is want.status is FlowStatus.DONE
    assume(want.tangencies == got.tangencies == 0)
    assume(np.diff(want.impacts.time).min(initial=1.0) > 1e-9)  # ties have no order
    assume(np.ptp(want.extremes, axis=1).min() > 1e-3)  # what rests has no nearest approach
    assert got.tangent is not None
    assert want.tangent is not None
    grown = max(1.0, float(np.abs(want.tangent).max()))
    assume(grown < 1e3)
    # A miss or a contact as slight as that is decided by rounding.
    assume(min(want.miss, want.penetration) > 1e-9)
    peak = float(np.abs(want.extremes).max())
    close = 1e-11 * max(1.0, grown / 10.0)
    np.testing.assert_array_equal(got.counts, want.counts)
    assert got.mode == want.mode
    np.testing.assert_allclose(got.strobes, want.strobes, rtol=0.0, atol=close * peak)
    np.testing.assert_allclose(got.extremes, want.extremes, rtol=0.0, atol=close * peak)
    np.testing.assert_array_equal(got.impacts.clearance, want.impacts.clearance)
    np.testing.assert_array_equal(got.impacts.side, want.impacts.side)
    np.testing.assert_allclose(got.impacts.time, want.impacts.time, rtol=0.0, atol=1e-7)
    for name in ("penetration", "miss"):
        here, there = getattr(got, name), getattr(want, name)
        assert here == pytest.approx(there, rel=1e-5, abs=1e-8 * peak)


@pytest.mark.parametrize("masses", [1, 3])
def test_equals_the_general_kernel(masses: int) -> None:
    settings(max_examples=60, deadline=None)(given(cases(masses))(compare))()


@pytest.mark.slow
@pytest.mark.parametrize("masses", [2, 4])
def test_equals_the_general_kernel_for_other_sizes(masses: int) -> None:
    settings(max_examples=100, deadline=None)(given(cases(masses))(compare))()
