"""The modal fast path equals the general kernel, event for event."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.model import Dimensionless

PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)


@st.composite
def cases(draw: st.DrawFn) -> tuple[Dimensionless, float, int]:
    unit = st.floats(0.1, 0.9)
    model = Dimensionless(
        m=draw(unit),
        k=draw(unit),
        k0=draw(st.sampled_from([1e-4, 0.5, 0.9, 0.95, 0.99, 0.999])),
        c=draw(st.floats(0.0, 0.9)),
        zeta=10.0 ** draw(st.floats(-3.0, 0.0)),
        f20=draw(st.sampled_from([0.0, 0.3, 1.0])),
        b=10.0 ** draw(st.floats(-2.0, 0.5)),
        sides=draw(st.sampled_from(["both", "upper", "lower"])),
    )
    return model, 10.0 ** draw(st.floats(-1.0, 0.7)), draw(st.integers(0, 2**32 - 1))


@settings(max_examples=50, deadline=None)
@given(cases())
def test_equals_the_general_kernel(case: tuple[Dimensionless, float, int]) -> None:
    check_case(*case)


@pytest.mark.slow
@settings(max_examples=3000, deadline=None)
@given(cases())
def test_equals_the_general_kernel_on_thousands(case: tuple[Dimensionless, float, int]) -> None:
    check_case(*case)


def check_case(model: Dimensionless, omega: float, seed: int) -> None:
    """Strobes within rounding times what the flow magnifies; impacts the same in every period."""
    system = model.second_order().piecewise_linear()
    x = model.b * np.random.default_rng(seed).standard_normal(4)
    fast = Flow(system, Drive(omega)).run(x, 5, tangent=np.eye(4))
    slow = Flow(system, Drive(omega), fast=False).run(x, 5, tangent=np.eye(4))
    assert fast.status is slow.status
    assert slow.tangent is not None
    assert fast.tangent is not None
    # What the flow itself may magnify: the largest product of any run of periods.
    maps = []
    for strobe in slow.strobes[:-1]:
        step = Flow(system, Drive(omega), fast=False).run(strobe, 1, tangent=np.eye(4))
        assert step.tangent is not None
        maps.append(step.tangent)
    grown = 1.0
    for first in range(5):
        product = np.eye(4)
        for step_map in maps[first:]:
            product = step_map @ product
            grown = max(grown, float(np.linalg.norm(product, 2)))
    peak = max(1.0, float(np.abs(slow.strobes).max()))
    if grown > 1e6:
        return
    np.testing.assert_allclose(fast.strobes, slow.strobes, rtol=0.0, atol=1e-10 * grown * peak)
    np.testing.assert_array_equal(fast.counts, slow.counts)
    assert fast.mode == slow.mode


@pytest.mark.parametrize("omega", [1.55, 1.43, 0.85, 0.54, 0.41, 0.337, 0.284, 0.24, 0.215])
def test_tangent_of_the_paper_case(omega: float) -> None:
    system = PAPER.second_order().piecewise_linear()
    x = np.array([0.1, 0.2, -0.1, 0.3])
    fast = Flow(system, Drive(omega)).run(x, 3, tangent=np.eye(4))
    slow = Flow(system, Drive(omega), fast=False).run(x, 3, tangent=np.eye(4))
    assert fast.tangent is not None
    assert slow.tangent is not None
    scale = max(1.0, float(np.abs(slow.tangent).max()))
    np.testing.assert_allclose(fast.tangent, slow.tangent, rtol=0.0, atol=1e-10 * scale)


def test_does_not_fit_without_a_clearance() -> None:
    free = Dimensionless(m=0.5, k=0.5, k0=0.0, c=0.5, zeta=0.1, f20=0.0, b=0.25)
    flow = Flow(free.second_order().piecewise_linear(), Drive(1.0))
    assert flow._modal is None  # the general kernel serves
    assert flow.run(np.zeros(4), 2).counts.size == 0
