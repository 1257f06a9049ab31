"""The exponent that ngspice finds by pairs of runs, against that of the exact tangent flow, and
against maps whose exponent is known in the place of ngspice."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.check import checked_design
from designer.check.synthesis_result import synthesise
from designer.circuit.nominal import nominal_reduction
from designer.dynamics.attractors import with_exponent
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.model.model_file import read_model_file
from designer.spice import twin_runs
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed

PERIOD = 0.02
CHAOS = Path(__file__).parents[2] / "examples" / "two-wells-chaos.toml"


@pytest.mark.slow
def test_ngspice_has_the_exponent_of_the_exact_circuit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two ways that share nothing: a tangent vector of the reduction, whose exponent is known to
    1 %, and runs that part, known to some 10 % with so few of them."""
    monkeypatch.setattr(twin_runs, "PAIRS", 12)
    synthesis = synthesise(read_model_file(CHAOS))
    with SpicePool(2) as pool:
        (checked,) = checked_design.check(synthesis.design, synthesis.model_responses, pool)
    reduction = nominal_reduction(synthesis.design)
    flow = Flow(reduction.system(), checked.excitation.drive)
    exact, ngspice = with_exponent(flow, checked.circuit), checked.ngspice
    assert ngspice is not None
    assert exact.status is ngspice.status is OrbitStatus.APERIODIC
    assert checked.agrees
    error = np.hypot(exact.lyapunov_error, ngspice.lyapunov_error)
    assert ngspice.lyapunov_error < 0.25 * ngspice.lyapunov
    assert abs(exact.lyapunov - ngspice.lyapunov) < 4.0 * error
    assert set(checked.exponents) == {"model", "circuit", "ngspice"}


class MapPool:
    """In the place of ngspice: a run is a map of the states (2,), once a drive period."""

    def __init__(self, one: Callable[[Array], Array], failing: int = -1) -> None:
        self.one, self.left = one, failing

    def map(self, jobs: Sequence[Any]) -> Iterator[tuple[int, Array | SimulationFailed]]:
        """Last first, as a run that ends early comes early."""
        for k, (x, periods, whole) in reversed(list(enumerate(jobs))):
            strobes = [np.asarray(x)]
            for _ in range(periods):
                strobes.append(self.one(strobes[-1]))
            self.left -= 1
            failed = SimulationFailed("told to") if self.left == 0 else None
            yield k, failed or np.array(strobes[1:] if whole else strobes[-1:])


def exponent_of(
    monkeypatch: pytest.MonkeyPatch, pool: MapPool, expected: float
) -> twin_runs.Growth | SimulationFailed:
    def job(_: object, __: object, x: Array, periods: int, *, whole: bool = False) -> object:
        return x, periods, whole

    monkeypatch.setattr(twin_runs, "_job", job)
    orbit = SimpleNamespace(lyapunov=expected / PERIOD, start=np.array([0.3, 0.6]))
    subject = cast(GateSubject, SimpleNamespace(orbit=orbit, period=PERIOD))
    return twin_runs.exponent(cast(SpicePool, pool), subject, cast(SolverSettings, None))


def test_the_exponent_of_a_chaotic_map_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """x → 4 x (1 - x): it is ln 2 a step, almost everywhere."""

    def logistic(x: Array) -> Array:
        return 4.0 * x * (1.0 - x)

    found = exponent_of(monkeypatch, MapPool(logistic), math.log(2.0))
    assert isinstance(found, twin_runs.Growth)
    assert found.error < 0.1 * found.value
    assert abs(found.value - math.log(2.0) / PERIOD) < 4.0 * found.error


@pytest.mark.parametrize("factor", [0.5, 1.0, -1.2])
def test_the_exponent_of_a_linear_map_is_exact(
    monkeypatch: pytest.MonkeyPatch, factor: float
) -> None:
    """Also where the motion that the exact circuit takes for chaos is none in ngspice."""
    pool = MapPool(lambda x: factor * x + 0.7)
    found = exponent_of(monkeypatch, pool, 1.0)
    assert isinstance(found, twin_runs.Growth)
    assert found.value == pytest.approx(math.log(abs(factor)) / PERIOD, abs=1e-6 / PERIOD)
    assert found.error < 1e-6 / PERIOD


def test_a_run_that_fails_is_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    for failing in (1, 2):  # the long run, one of a pair
        found = exponent_of(monkeypatch, MapPool(lambda x: 0.5 * x, failing), 1.0)
        assert isinstance(found, SimulationFailed)
