"""The exact flow towards the ends of its domain, against 40-digit arithmetic."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.references import Problem, truth
from designer.base.arrays import Array
from designer.check import trust
from designer.dynamics.attractors import peaks_near, settle
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.model import Dimensionless

BASE = Problem(0.85)
"""The paper's case where it shows 1-2-2."""
START = np.array([0.1, -0.2, 0.05, 0.3])
PERIODS = 3
MOST = 10_000
"""Mode changes that the reference follows."""
ROUNDING = 2.0**-53
SHOWN = {
    "zeta": "ζ",
    "omega": "ω",
    "omega, high": "ω, high",
    "off critical": "off critical damping",
    "impacts": "slow and stiff, 1/(ω (1 − k0))",
    "ringing": "slow, hardly damped (k0 0.5, ζ 1e-5), 1/ω",
}
"""Axes by the names that are printed, where those differ."""
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Scene:
    """A model and a start; ``value`` says how far along ``axis`` it stands. settled : also ask
    what is reached from rest, which takes thousands of periods where it is slow."""

    axis: str
    value: float
    problem: Problem
    periods: int = PERIODS
    scale: float = 1.0
    settled: bool = True

    @property
    def name(self) -> str:
        return f"flow {self.axis} {self.value:.1e}".replace(" ", "-").replace("/", "-over-")


def scenes() -> Iterator[Scene]:
    """All that is measured, axis by axis, from the paper's case outwards."""
    for e in (1, 2, 3, 4, 6, 8, 10, 12, 14):
        yield Scene("1 - k0", 10.0**-e, replace(BASE, k0=1.0 - 10.0**-e))
    for e in (1, 2, 3, 4, 6, 8):
        yield Scene("zeta", 10.0**-e, replace(BASE, zeta=10.0**-e), settled=e < 5)
    for e in (1, 2, 3, 4, 6, 8):
        yield Scene("b", 10.0**-e, replace(BASE, b=10.0**-e), scale=10.0**-e)
    for omega in (0.1, 0.03, 0.01, 0.003, 0.001):
        yield Scene("omega", omega, replace(BASE, omega=omega), periods=1)
    for omega in (10.0, 100.0, 1000.0):
        yield Scene("omega, high", omega, replace(BASE, omega=omega), periods=20)
    for f20 in (0.0, 0.5, 1.0):
        yield Scene("f20", f20, replace(BASE, f20=f20))
    for e in (1, 2, 3):
        yield Scene("m", 10.0**-e, replace(BASE, m=10.0**-e), settled=e < 3)
    for e in (1, 3, 6):
        yield Scene("1 - m", 10.0**-e, replace(BASE, m=1.0 - 10.0**-e), settled=False)
    for e in (1, 3):
        yield Scene("1 - k", 10.0**-e, replace(BASE, k=1.0 - 10.0**-e), settled=False)
    for e in (1, 3):
        yield Scene("1 - c", 10.0**-e, replace(BASE, c=1.0 - 10.0**-e), settled=False)
    critical = critical_damping()
    for off in (1e-2, 1e-4, 1e-8, 0.0):
        yield Scene("off critical", off, replace(BASE, zeta=critical * (1.0 + off)))
    # Slow drives, hard stops and little damping: contacts follow one another.
    for k0, omega in ((0.99, 0.05), (0.999, 0.05), (0.9999, 0.05), (0.9999, 0.02)):
        slow = Problem(omega, k0=k0, zeta=0.01, b=0.05)
        yield Scene("impacts", 1.0 / (omega * (1.0 - k0)), slow, 1, 0.2, settled=False)
    # Free oscillations that strike all through a slow period: thousands of impacts.
    for omega in (0.01, 0.005, 0.002, 0.001, 0.0005):
        slow = Problem(omega, k0=0.5, zeta=1e-5, b=0.05)
        yield Scene("ringing", 1.0 / omega, slow, 1, 3.0, settled=False)


def critical_damping() -> float:
    """Least ζ at which two eigenvalues of the open model meet on the real axis, to the last
    digit: its modes are there as ill-conditioned as they can be."""

    def complex_roots(zeta: float) -> int:
        A = np.array(replace(BASE, zeta=zeta).matrices(float, 0)[0])
        return int((np.abs(np.linalg.eigvals(A).imag) > 0.0).sum())

    low, high = 0.1, 5.0
    least = complex_roots(low)
    while high - low > 4.0 * ROUNDING * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if complex_roots(middle) < least else (middle, high)
    return high


def flow_of(problem: Problem, *, fast: bool = True) -> Flow:
    """Both stops."""
    p = problem
    model = Dimensionless(p.m, p.k, p.k0, p.c, p.zeta, p.f20, p.b)
    return Flow(model.second_order().piecewise_linear(), Drive(p.omega), fast=fast)


def measure(scene: Scene) -> dict[str, Any]:
    """Error of both kernels, what the flow makes of rounding, and what the tool says.

    error : of the last state, in units of each state's peak. magnification : the largest ‖Φ(t, s)‖
    between two events, times what a contact makes of a rounding error of the displacement. bound,
    first_error : what ``check.trust`` states of the first period, and its true error.
    """
    start = scene.scale * START
    flow = flow_of(scene.problem)
    row: dict[str, Any] = {"axis": scene.axis, "value": scene.value, "kernel": flow.kernel}
    row |= {"model": dict(scene.problem.__dict__), "periods": scene.periods}
    exact = truth(scene.problem, start, scene.periods, max_events=MOST)
    first = trust.of_orbit(flow, Orbit(OrbitStatus.APERIODIC, start=start))
    row |= {"bound": _number(first.error), "said": str(first)}
    if scene.settled:
        row |= _settled(flow)
    if exact is None:
        return {**row, "reference": f"more than {MOST} mode changes"}
    peak = np.maximum(exact.peak, 1e-9 * exact.peak.max())
    mu = scene.problem.k0 / (1.0 - scene.problem.k0)
    kick = max(1.0, np.sqrt(mu) * peak[0] / peak[1]) if exact.impacts.any() else 1.0
    magnification = exact.magnification(peak) * float(kick)
    row |= {"impacts": int(exact.impacts.sum()), "magnification": magnification}
    for name, fast in (("error", True), ("general_error", False)):
        run = flow_of(scene.problem, fast=fast).run(start, scene.periods)
        fine = run.status is FlowStatus.DONE
        row[name] = _error(run.strobes[-1], exact.strobes[-1], peak) if fine else None
        if fast:
            row["counts_agree"] = bool(fine and (run.counts.sum(axis=1) == exact.impacts).all())
            row["first_error"] = (
                _error(run.strobes[1], exact.strobes[1], peaks_near(flow, start)) if fine else None
            )
    return row


def _settled(flow: Flow) -> dict[str, Any]:
    orbit = settle(flow, np.zeros(flow.system.size))
    known = trust.of_orbit(flow, orbit)
    return {
        "response": orbit.response,
        "reason": orbit.reason,
        "orbit_bound": _number(known.error),
        "multiplier_bound": _number(known.multiplier_error),
        "trust": str(known),
    }


def _error(reached: Array, exact: Array, peak: Array) -> float:
    return float((np.abs(reached - exact) / peak).max())


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None


# ---------------------------------------------------------------------------------------------
# What is made of the rows


def ratio(row: Row, key: str = "error") -> float | None:
    """Error over magnification and rounding: near 1 is as good as double precision allows."""
    if row.get(key) is None or not row.get("magnification"):
        return None
    return float(row[key]) / (float(row["magnification"]) * ROUNDING)


def trusted(row: Row) -> bool:
    """Whether the tool says of one period, and of what is reached from rest, that it can be."""
    return not row["said"] and not row.get("trust")


def by_axis(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """In order of appearance, from the paper's case outwards."""
    out: dict[str, list[Row]] = {}
    for row in rows:
        out.setdefault(row["axis"], []).append(row)
    return out
