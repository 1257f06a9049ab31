"""Accuracy of both engines against 40-digit arithmetic, and of settling against long settling.

The bound on the last state: 1e-11 · max(1, largest ‖Φ(t, s)‖) · max(1, peak), where Φ
is the linearised flow between any two moments of the run: what rounding in one place may grow to.
"""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest

from benchmarks.references import Problem, Truth, truth
from designer.base.arrays import Array
from designer.dynamics.attractors import settle
from designer.dynamics.counts import MAX_PERIOD
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.model import Dimensionless
from tests.shared.exploring import quick
from tests.shared.oracles import Plain, integrate

PERIODS = 10
"""The paper's high responses have sixteen impacts in each; over more periods chaotic cases grow too
sensitive to compare."""
START = np.array([0.1, -0.2, 0.05, 0.3])
PAPER = quick((1.55, 1.43, 0.85, 0.41, 0.215, 0.54, 0.337, 0.284, 0.24), 3)
ONE_P_P = (1.55, 0.85, 0.54, 0.41, 0.337, 0.284, 0.24, 0.215)
"""Frequencies of the 1-p-p responses, p = 1 … 8."""


def flow_of(problem: Problem, *, fast: bool = True) -> Flow:
    sides = {(True, True): "both", (True, False): "upper", (False, True): "lower"}
    model = Dimensionless(
        problem.m, problem.k, problem.k0, problem.c, problem.zeta, problem.f20, problem.b,
        sides=sides[problem.upper, problem.lower],  # type: ignore[arg-type]
    )  # fmt: skip
    return Flow(model.second_order().piecewise_linear(), Drive(problem.omega), fast=fast)


def excess(problem: Problem, exact: Truth, start: Array, *, fast: bool) -> float:
    """Error of the last state over the bound: at most 1 is right."""
    run = flow_of(problem, fast=fast).run(start, len(exact.strobes) - 1)
    assert run.status is FlowStatus.DONE
    error = float(np.abs(run.strobes[-1] - exact.strobes[-1]).max())
    return error / (1e-11 * max(1.0, exact.magnification()) * max(1.0, float(exact.peak.max())))


@pytest.mark.parametrize("omega", PAPER)
def test_paper(omega: float) -> None:
    problem = Problem(omega)
    exact = truth(problem, START, PERIODS)
    assert exact is not None
    assert exact.magnification() < 1e8
    for fast in (True, False):
        assert excess(problem, exact, START, fast=fast) <= 1.0
        counts = flow_of(problem, fast=fast).run(START, PERIODS).counts[:, 0]
        np.testing.assert_array_equal(counts, exact.impacts)


@pytest.mark.slow
def test_references_agree() -> None:
    """The 40-digit flow against DOP853 restarted at every event, which shares no code with it."""
    for problem in (Problem(0.85), Problem(1.2, lower=False), Problem(0.9, k0=0.0, f20=0.4)):
        exact = truth(problem, START, 5)
        assert exact is not None
        values = asdict(problem)
        omega = values.pop("omega")
        other = integrate(Plain(**values), omega, list(START), 5)
        np.testing.assert_allclose(other.strobes, exact.strobes, rtol=0.0, atol=1e-10)


def edges() -> list[Problem]:
    """Edges of the domain one at a time, and the hardest stops where damping keeps them from
    chaos, which is too sensitive to compare."""
    base = Problem(0.85)
    alone = [
        replace(base, **{name: value})  # type: ignore[arg-type]
        for name, values in {
            "k0": (0.0, 0.3, 0.99, 0.999),
            "zeta": (1e-3, 1e-2, 0.5, 0.9),
            "b": (1e-3, 1e-2, 1.0, 10.0),
            "omega": (0.02, 0.1, 5.0, 20.0),
            "upper": (False,),
            "lower": (False,),
        }.items()
        for value in values
    ]
    hard = [replace(base, k0=k0, zeta=0.5) for k0 in (0.99, 0.999, 0.9999)]
    hard += [replace(base, k0=0.9999, zeta=0.9, omega=omega) for omega in (1.55, 5.0)]
    return alone + hard + [replace(base, k0=0.3, zeta=zeta) for zeta in (1e-3, 1e-2)]


@pytest.mark.slow
def test_edges_of_the_domain() -> None:
    for problem in edges():
        scale = min(1.0, problem.b / 0.25)
        exact = truth(problem, scale * START, PERIODS)
        assert exact is not None
        assert exact.magnification() < 1e8
        for fast in (True, False):
            over = excess(problem, exact, scale * START, fast=fast)
            assert over <= 1.0, f"{problem}, fast={fast}"


# ---------------------------------------------------------------------------------------------
# Settling and shooting against settling alone


def response(flow: Flow, x: Array, periods: int = 20_000) -> tuple[int, int, int]:
    """n-p-q from the strobes and counts of a long run; zeros where nothing repeats."""
    run = flow.run(x, periods)
    s = run.strobes
    peak = np.maximum(np.abs(s[-64:]).max(axis=0), 1e-9)
    for n in range(1, MAX_PERIOD + 1):
        if (np.abs(s[-3 * n :] - s[-4 * n : -n]) <= 1e-7 * peak).all():
            lower, upper = run.counts[-n:].sum(axis=(0, 1))
            return n, int(upper), int(lower)
    return 0, 0, 0


@pytest.mark.slow
@pytest.mark.parametrize("p", range(1, 9))
def test_settling_agrees_with_20_000_periods(p: int) -> None:
    """Sets perturbed as parts of 1 to 5 % perturb them, each from a start of its own."""
    rng = np.random.default_rng(100 + p)
    agree, undecided, wrong, sets = 0, 0, [], 20
    for _ in range(sets):
        near = {
            name: float(value * rng.uniform(0.97, 1.03))
            for name, value in {"m": 0.5, "k": 0.5, "c": 0.5, "zeta": 0.1, "b": 0.25}.items()
        }
        k0 = float(0.95 * rng.uniform(0.99, 1.01))
        problem = replace(Problem(ONE_P_P[p - 1], k0=k0), **near)  # type: ignore[arg-type]
        flow = flow_of(problem)
        x = START * rng.uniform(-1.0, 1.0, 4)
        orbit = settle(flow, x)
        got = (orbit.n, orbit.p, orbit.q)
        if orbit.status not in (OrbitStatus.PERIODIC, OrbitStatus.APERIODIC):
            undecided += 1
        want = response(flow, x)
        if got == want:
            agree += 1
        else:
            wrong.append(f"{problem} from {x.tolist()}: {orbit.response}, truth {want}")
    print(f"p = {p}: {agree} of {sets} agree, {undecided} undecided")
    assert agree >= 0.98 * sets, "\n".join(wrong)
