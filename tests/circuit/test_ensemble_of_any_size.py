"""Boards of any number of masses, with two clearances: the compiled way is the general one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.check import checked_design
from designer.check.synthesis_result import synthesise
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import Ensemble
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.clearance import Clearance, Side
from designer.model.mechanics import SecondOrderSystem
from designer.model.model_file import parse_model_file
from designer.spread.spread import Spread, draw_many
from designer.yields.study_plan import plan_study
from tests.shared.exact_circuits import Scale, exact_circuit
from tests.shared.exploring import quick
from tests.shared.system_text import clearance, system_text, table


def chain_of(masses: int) -> SecondOrderSystem:
    """Equal masses between two walls; a clearance at the first and one at the last."""
    stiffness = 2.0 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)
    return SecondOrderSystem(
        mass=np.ones(masses),
        damping=0.2 * stiffness,
        stiffness=stiffness,
        force=np.array([1.5, *(masses - 1) * [0.0]]),
        clearances=(
            Clearance.even(0, 9.0, 0.3),
            Clearance("B", masses - 1, None, Side(0.15, 5.0), Side(0.2, 7.0)),
        ),
    )


SECONDS, GENERATOR = 1e-3, 1.3
COUNT = 6
TOGETHER = system_text(
    {"m1": "2.14 kg", "m2": "1.32 kg"},
    {
        ("m1", "ground"): "2.84e+04 N/m",
        ("m2", "m1"): "3.34e+04 N/m",
        ("m2", "ground"): "4.09e+04 N/m",
    },
    {
        ("m1", "ground"): "119 N s/m",
        ("m2", "m1"): "89.5 N s/m",
        ("m2", "ground"): "39.8 N s/m",
    },
    clearance("A", "m1", "m2", lower="-0.000488 m", stiffness="1.14e+06 N/m"),
    table("force", on="m1", amplitude="78.7 N"),
    table("force", on="m2", constant="9.73 N"),
    table("response", frequency="64 Hz", expect="1-0-1"),
    '[circuit]\ndead_zone = "rectifier"\n',
)
"""Two masses that rest against each other by a stiff stop: the box of their states is mostly empty,
and proves nothing of the diodes."""


# The code for two masses is compiled for many other tests.
@pytest.mark.parametrize("masses", quick([2, 3]))
def test_every_clearance_is_counted_as_by_the_general_kernel(masses: int) -> None:
    circuit = exact_circuit(chain_of(masses), Scale(SECONDS, np.full(2 * masses, 6.0), GENERATOR))
    drive = Drive(1.1 / SECONDS, -GENERATOR)
    nominal = Flow(Reduction(circuit, nominal_board(circuit)).system(), drive)
    start = settle(nominal, np.zeros(2 * masses)).start
    boards = draw_many(circuit, Spread(0.01, 0.01, 1e-3, 4e-3), 7, range(COUNT))
    starts = np.tile(start, (COUNT, 1))
    fast, slow = Ensemble(boards), Ensemble(boards, fast=False)
    asked = range(COUNT), [drive] * COUNT, starts
    for a, b in zip(fast.settle(*asked), slow.settle(*asked), strict=True):
        assert a.status is b.status is OrbitStatus.PERIODIC
        assert a.counts == b.counts
        assert len(a.more) == 1
        assert a.counts.total > 0
        peak = np.abs(b.extremes).max(axis=1)
        assert np.abs((a.start - b.start) / peak).max() < 1e-10
        assert np.abs((a.extremes - b.extremes) / peak[:, None]).max() < 1e-10
        assert a.radius == pytest.approx(b.radius, rel=1e-6)
        assert a.penetration == pytest.approx(b.penetration, rel=1e-8)
        assert a.miss == pytest.approx(b.miss, rel=1e-8)
        np.testing.assert_array_equal(a.impact_clearances, b.impact_clearances)
        np.testing.assert_array_equal(a.impact_sides, b.impact_sides)
        speed = np.abs(b.impact_velocities).max()
        assert np.abs(a.impact_velocities - b.impact_velocities).max() < 1e-8 * speed
    assert len(fast._reductions) <= 1, "the compiled way serves all but what settles slowly"


def test_boards_with_a_mass_that_nothing_moves_are_served() -> None:
    """Its peaks are rounding, which is no measure: both ways say the same of it."""
    system = SecondOrderSystem(
        mass=np.ones(2),
        damping=np.diag([0.2, 0.15]),
        stiffness=np.diag([1.0, 1.3]),
        force=np.array([0.5, 0.0]),
        clearances=(Clearance.even(0, 9.0, 5.0),),
    )
    circuit = exact_circuit(system, Scale(SECONDS, np.full(4, 2.0), GENERATOR))
    drive = Drive(0.8 / SECONDS, -GENERATOR)
    boards = draw_many(circuit, Spread(0.01, 0.01, 0.0, 0.0), 7, range(2))
    boards = replace(boards, bias={name: np.zeros(2) for name in boards.bias})
    fast, slow = Ensemble(boards), Ensemble(boards, fast=False)
    asked = range(2), [drive] * 2, np.full((2, 4), 0.1)
    for a, b in zip(fast.settle(*asked), slow.settle(*asked), strict=True):
        assert np.abs(b.extremes[3]).max() < 1e-9 * np.abs(b.extremes[1]).max()
        assert a.status is b.status is OrbitStatus.PERIODIC
        assert a.counts == b.counts
        assert a.asymmetry == pytest.approx(b.asymmetry, rel=1e-3)
    assert not fast._reductions


@pytest.mark.slow
def test_boards_whose_states_move_together_are_served() -> None:
    made = synthesise(parse_model_file(TOGETHER))
    (first,) = checked_design.check(made.design, made.model_responses, None)
    assert first.circuit.response == "1-0-1"
    plan = plan_study(made.modelfile, made.design, [first], made.catalog, samples=COUNT, seed=1)
    boards, drive = plan.boards(range(COUNT)), plan.questions[0].excitation.drive
    starts = np.tile(first.circuit.start, (COUNT, 1))
    fast, slow = Ensemble(boards), Ensemble(boards, fast=False)
    asked = range(COUNT), [drive] * COUNT, starts
    for a, b in zip(fast.settle(*asked), slow.settle(*asked), strict=True):
        assert a.counts == b.counts
        peak = np.abs(b.extremes).max(axis=1)
        assert np.abs((a.start - b.start) / peak).max() < 1e-9
    assert not fast._reductions
    stages = [(drive, 5), (replace(drive, omega=1.01 * drive.omega), 5)]
    for board in range(COUNT):
        rest = np.zeros((1, starts.shape[1]))
        ends, known = fast.swept(board, stages, rest)
        assert known.all()
        system, x = slow.reduction(board).system(), rest[0]
        for k, (each, periods) in enumerate(stages):
            x = Flow(system, each, fast=False).run(x, periods).strobes[-1]
            so_far, _ = fast.swept(board, stages[: k + 1], rest)
            assert np.abs((so_far[0] - x) / np.abs(x).max()).max() < 1e-8
        np.testing.assert_array_equal(so_far, ends)
        again, _ = fast.swept(board, stages, rest)
        np.testing.assert_array_equal(again, ends)
    # Modes that are solved for several boards at once are those of each.
    both = Ensemble(boards)
    for board in range(COUNT):
        beside = both.swept(board, stages, rest, range(COUNT))
        np.testing.assert_array_equal(beside[0], fast.swept(board, stages, rest)[0])
