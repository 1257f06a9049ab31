"""Remedies: tried in the stated order, only where ngspice did not converge, and reported."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from designer.spice import convergence_aids
from designer.spice.convergence_aids import NUDGE, REMEDIES, Task, did_not_converge
from designer.spice.deck import SolverSettings
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed, SpiceJob, Waveforms, accept

FIRST = SolverSettings("trap", 1e-5)
RC = """RC from a charged capacitor
R1 a 0 1k
C1 a 0 1u IC={ic!r}
.options method={method} reltol={reltol!r}
.tran {step!r} 1m 0 {step!r} uic
.end
"""
STUCK = """No step small enough
V1 a 0 SIN(0 1 1k)
R1 a b 1k
B1 b 0 I=V(b)>0.5 ? -1e6*V(b) : 1e6*(1-V(b))
C1 b 0 1p
.tran {step!r} 1m 0 {step!r}
.end
"""


def value(waves: Waveforms) -> tuple[float, float]:
    """Voltage at the first point, with its time."""
    name = next(iter(waves.signals))
    return float(waves.axis[0]), float(waves.signals[name][0])


def broken(waves: Waveforms) -> float:
    raise ArithmeticError("timestep too small, says the analysis")


def task(converges: Callable[[SolverSettings, float], bool]) -> Task[tuple[float, float]]:
    """Converges only under some settings: a stiff deck stands for the others."""

    def make(settings: SolverSettings, nudge: float) -> SpiceJob[tuple[float, float]]:
        if not converges(settings, nudge):
            return SpiceJob(STUCK.format(step=settings.max_step), ("b",), 1e-3, value)
        text = RC.format(
            ic=1.0 + nudge, method=settings.method, reltol=settings.reltol, step=settings.max_step
        )
        return SpiceJob(text, ("a",), 1e-3, value)

    return Task(make, FIRST)


@pytest.fixture(scope="module")
def pool() -> Iterator[SpicePool]:
    with SpicePool(2) as pool:
        yield pool


CASES: dict[str, Callable[[SolverSettings, float], bool]] = {
    "": lambda s, nudge: True,
    "step": lambda s, nudge: s.max_step < FIRST.max_step,
    "method": lambda s, nudge: s.method == "gear",
    "tolerance": lambda s, nudge: s.reltol > FIRST.reltol,
    "start": lambda s, nudge: nudge > 0.0,
}


def test_each_remedy_in_its_turn(pool: SpicePool) -> None:
    found = dict(convergence_aids.run(pool, [task(c) for c in CASES.values()]))
    assert sorted(found) == list(range(5))
    for i in range(5):
        outcome = found[i]
        assert outcome.tried == REMEDIES[:i]
        assert not isinstance(outcome.result, SimulationFailed)
        assert outcome.settings.max_step == FIRST.max_step * (0.25 if i >= 1 else 1.0)
        assert outcome.settings.method == ("gear" if i >= 2 else "trap")
        assert outcome.settings.reltol == pytest.approx(FIRST.reltol * (10.0 if i >= 3 else 1.0))
        time, volts = outcome.result
        start = 1.0 + (NUDGE if i == 4 else 0.0)
        assert volts == pytest.approx(start * np.exp(-time / 1e-3), rel=1e-4)


def test_what_does_not_converge_at_all_says_what_was_tried(pool: SpicePool) -> None:
    ((_, outcome),) = convergence_aids.run(pool, [task(lambda s, nudge: False)])
    assert isinstance(outcome.result, SimulationFailed)
    assert outcome.tried == REMEDIES


def test_a_shorter_sequence(pool: SpicePool) -> None:
    tasks = [task(CASES["method"]), task(CASES["start"])]
    found = dict(convergence_aids.run(pool, tasks, allowed=("tolerance", "start")))
    assert isinstance(found[0].result, SimulationFailed)
    assert found[0].settings.method == "trap"
    assert found[1].tried == ("tolerance", "start")
    assert not isinstance(found[1].result, SimulationFailed)
    ((_, none),) = convergence_aids.run(pool, tasks[:1], allowed=())
    assert isinstance(none.result, SimulationFailed)
    assert none.tried == ()


@pytest.mark.parametrize(
    ("netlist", "reduce"),
    [
        (
            RC.format(ic=1.0, method="trap", reltol=1e-4, step=1e-5).replace("R1 a", "R1 {x} a"),
            value,
        ),
        (STUCK.format(step=1e-5).replace("R1", ".control\nR1"), value),
        (RC.format(ic=1.0, method="trap", reltol=1e-4, step=1e-5), broken),
    ],
    ids=["wrong deck", "refused deck", "failing analysis"],
)
def test_what_no_setting_can_cure_is_not_treated(
    pool: SpicePool, netlist: str, reduce: Callable[[Waveforms], tuple[float, float]]
) -> None:
    calls = []

    def make(settings: SolverSettings, nudge: float) -> SpiceJob[tuple[float, float]]:
        calls.append(settings)
        return SpiceJob(netlist, ("a",), 1e-3, reduce)

    ((_, outcome),) = convergence_aids.run(pool, [Task(make, FIRST)])
    assert isinstance(outcome.result, SimulationFailed)
    assert outcome.tried == ()
    assert len(calls) == 1


def test_a_run_that_ends_early_did_not_converge() -> None:
    with pytest.raises(SimulationFailed) as caught:
        accept({"time": np.array([1.0, 2.0])}, [], 3.0, "", 0.0)
    assert did_not_converge(caught.value)
    assert not did_not_converge(SimulationFailed("worker gave no answer within 120 s twice"))
    assert not did_not_converge(SimulationFailed("the circuit has no node 'v1'"))
    assert not did_not_converge(SimulationFailed("ngspice said: singular matrix: check node b"))
