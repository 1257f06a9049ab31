"""A trimmed board in ngspice, with the trimmer as two resistors between the rails: what the setting
was found for is what is simulated."""

from __future__ import annotations

import numpy as np

from designer.circuit.board_modes import at_rest
from designer.circuit.reduction import Reduction
from designer.dynamics import attractors
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.worker import open_simulator
from designer.yields.trimmed_yield import HIGH, LOW, trimmed_boards
from tests.shared.bench_plans import plan
from tests.yields.test_trimmed_yield import ROUGH, TRACK, trim


def test_ngspice_runs_the_trimmed_board() -> None:
    """Four periods within 2e-3 of each state's peak, of the board that was turned farthest."""
    of = plan(2, spread=ROUGH)
    boards, position = trimmed_boards(trim(), of, range(3))
    which = int(np.argmax(np.abs(position - 0.5)))
    board, question = boards.board(which), of.questions[0]
    reduction = Reduction(trim().circuit, board)
    flow = Flow(reduction.system(), question.excitation.drive)
    orbit = attractors.settle(flow, question.start.start)
    assert orbit.status is OrbitStatus.PERIODIC
    asked = GateSubject(reduction, question.excitation, orbit)
    steps, points = 1000, 100
    job = numerics_gate.job(asked, SolverSettings("trap", asked.period / steps), whole=True)
    assert board.values[HIGH] + board.values[LOW] == TRACK
    for name, nets in ((HIGH, "vcc trim"), (LOW, "vee trim")):
        assert f"\n{name} {nets} {board.values[name]!r}\n" in job.netlist
    waves = open_simulator("shared").run(job.netlist, job.signals, job.stop)
    exact = flow.run(orbit.start, 4, mode=orbit.mode, points=points).strobes
    grid = np.arange(len(exact)) * asked.period / points
    u = -asked.excitation.amplitude * np.sin(2.0 * np.pi * grid / asked.period)
    for net in reduction.circuit.state_nets:
        want = reduction.output(reduction.circuit.rest, net, exact, u)
        got = np.interp(grid, waves.axis, waves.signals[net])
        assert np.abs(got - want)[1:].max() < 2e-3 * np.abs(want).max(), net
    rest, stops = at_rest(boards)
    middle = 0.5 * (stops[1][which] + stops[-1][which])
    assert abs(float(rest[which]) - middle) < 0.02 * abs(stops[1][which])
