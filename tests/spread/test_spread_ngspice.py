"""Boards drawn with everything that can vary, in ngspice: what was drawn is what is simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.model.distributions import Uniform
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.worker import open_simulator
from designer.spread.spread import Group, Spread, draw
from tests.shared.stages import stage
from tests.spice.test_rectifier_ngspice import SCALED, subject

VARIED = replace(
    Spread(0.005, 0.005, 3e-3, 10e-3),
    supply=0.05,
    bias=Uniform(-2e-7, 2e-7),
    temperature=(0.0, 60.0),
    tempco={name: Uniform(-1e-4, 1e-4) for name in SCALED},
    ageing={"R50": Uniform(0.0, 0.01)},
    groups=(Group("network:1", ("R203", "R204"), 0.8),),
)


@pytest.mark.parametrize("index", [0, 3])
def test_ngspice_runs_the_board_that_the_reduction_solves(index: int) -> None:
    """Four periods within 2e-3 of each state's peak; the reference's feeds see their own rail."""
    circuit = stage("rectifier", "both", SCALED)
    board = draw(circuit, VARIED, 11, index)
    assert abs(board.supply["VCC"] + board.supply["VEE"]) > 0.02
    asked = subject(circuit, board, "both", 0.54)
    assert asked.orbit.status is OrbitStatus.PERIODIC
    steps, points = 2000, 100
    job = numerics_gate.job(asked, SolverSettings("trap", asked.period / steps), whole=True)
    for rail in ("VCC", "VEE"):
        assert f"\n{rail} {rail.lower()} 0 {board.supply[rail]!r}\n" in job.netlist
    waves = open_simulator("shared").run(job.netlist, job.signals, job.stop)
    exact = Flow(asked.system, asked.excitation.drive).run(
        asked.orbit.start, 4, mode=asked.orbit.mode, points=points
    ).strobes  # fmt: skip
    grid = np.arange(len(exact)) * asked.period / points
    u = -asked.excitation.amplitude * np.sin(2.0 * np.pi * grid / asked.period)
    for net in circuit.state_nets:
        want = asked.reduction.output(circuit.rest, net, exact, u)
        got = np.interp(grid, waves.axis, waves.signals[net])
        assert np.abs(got - want)[1:].max() < 2e-3 * np.abs(want).max(), net
