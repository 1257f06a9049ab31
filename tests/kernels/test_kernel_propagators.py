"""The fast path of circuits equals the general kernel on both stages, event for event."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from designer.circuit import board_modes as working
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.kernel_nodal import solve_all
from designer.circuit.netlist import Circuit
from designer.circuit.reduction import Reduction
from designer.dynamics import working_modes
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.piecewise_linear import Drive
from designer.kernels import kernel_propagators as kernel
from designer.kernels.kernel_orbit import DONE
from designer.spread.spread import Spread, draw, draw_many
from tests.circuit.test_coefficients import exact_for_paper
from tests.circuit.test_reduction import circuit_of
from tests.shared.stages import rectifier, stage

SATURATION = circuit_of(exact_for_paper())
RECTIFIER = stage("rectifier", "both", rectifier())
UPPER = stage("rectifier", "upper", rectifier(sides="upper"))
CIRCUITS = {"saturation": SATURATION, "rectifier": RECTIFIER, "upper": UPPER}
SPREAD = Spread(0.05, 0.05, 3e-3, 10e-3)
NO_TRAIL = kernel.RunTrail(
    np.zeros((4, 2)),
    np.zeros((1, 2)),
    np.zeros(1),
    np.zeros(0),
    np.zeros((0, 4)),
    np.zeros((0, 2), dtype=np.int64),
    np.zeros(1, dtype=np.int64),
)
VOLTS = {"saturation": 0.1, "rectifier": 6.0, "upper": 1.6}
"""Size of a start and of the drive that leads into contact without clipping."""


def flows(circuit: Circuit, board: Board, drive: Drive) -> tuple[Flow, Flow]:
    """By the fast path and by the general kernel."""
    system = Reduction(circuit, board).system()
    return Flow(system, drive), Flow(system, drive, fast=False)


@st.composite
def cases(draw_: st.DrawFn) -> tuple[str, int, Drive, list[float]]:
    kind = draw_(st.sampled_from(sorted(CIRCUITS)))
    hertz = 10.0 ** draw_(st.floats(1.7, 3.0))
    size = VOLTS[kind]
    drive = Drive(
        2.0 * np.pi * hertz,
        size * draw_(st.floats(0.1, 1.0)),
        size * draw_(st.floats(-0.2, 0.2)),
    )
    start = [size * draw_(st.floats(-0.7, 0.7)) for _ in range(4)]
    return kind, draw_(st.integers(0, 10**6)), drive, start


@settings(max_examples=60, deadline=None)
@given(cases(), st.booleans())
def test_equals_the_general_kernel(
    case: tuple[str, int, Drive, list[float]], closely: bool
) -> None:
    kind, seed, drive, start = case
    board = draw(CIRCUITS[kind], SPREAD, 1, seed)
    fast, slow = flows(CIRCUITS[kind], board, drive)
    if closely:
        assert fast._tabulated is not None
        assert fast._tabulated.look_closely()
    x = np.array(start)
    begin = fast.system.mode_at(x, drive.offset)
    assume(begin in fast.system.working)
    got, want = (f.run(x, 3, tangent=np.eye(4), measure=True) for f in (fast, slow))
    assert got.status is want.status is FlowStatus.DONE
    assert got.tangent is not None
    assert want.tangent is not None
    grown = max(1.0, float(np.abs(want.tangent).max()))
    assume(grown < 1e4)
    peak = float(np.abs(want.extremes).max())
    close = 1e-9 * grown
    np.testing.assert_allclose(got.strobes, want.strobes, rtol=0.0, atol=close * peak)
    np.testing.assert_allclose(got.tangent, want.tangent, rtol=0.0, atol=1e-8 * grown)
    np.testing.assert_array_equal(got.counts, want.counts)
    assert got.mode == want.mode
    np.testing.assert_allclose(got.extremes, want.extremes, rtol=0.0, atol=close * peak)
    np.testing.assert_allclose(got.impacts.time, want.impacts.time, rtol=0.0, atol=1e-7)
    np.testing.assert_array_equal(got.impacts.side, want.impacts.side)
    np.testing.assert_allclose(got.impacts.state, want.impacts.state, rtol=0.0, atol=1e-6 * peak)
    for name in ("penetration", "miss"):
        here, there = getattr(got, name), getattr(want, name)
        assert here == pytest.approx(there, rel=1e-6, abs=1e-6 * peak)
    dense, other = (f.run(x, 1, points=16) for f in (fast, slow))
    np.testing.assert_allclose(dense.strobes, other.strobes, rtol=0.0, atol=close * peak)


@pytest.mark.parametrize("kind", sorted(CIRCUITS))
def test_the_fast_path_serves_good_boards(kind: str) -> None:
    """Otherwise the tests above would compare the general kernel with itself."""
    circuit = CIRCUITS[kind]
    drive = Drive(2.0 * np.pi * 300.0, 0.5 * VOLTS[kind])
    boards = [draw(circuit, SPREAD, 2, index) for index in range(20)]
    assert all(code(circuit, board, drive, closely=False) == DONE for board in boards)


def code(circuit: Circuit, board: Board, drive: Drive, *, closely: bool) -> int:
    """What the fast path says of five periods from rest."""
    system = Reduction(circuit, board).system()
    modes = working_modes.TabulatedModes(system, drive)
    for key in system.working:
        modes.number(key)
    if closely:
        modes.look_closely()
    return kernel.advance(
        modes.limited(1000),
        np.zeros(4),
        np.array([0, 0, 0, 0]),
        drive.period,
        working_modes.anchors(1),
        np.zeros((0, 0)),
        np.zeros((6, 4)),
        np.zeros((5, 2), dtype=np.int64),
        NO_TRAIL,
    )


@pytest.mark.slow
def test_step_by_step_no_run_that_clips_is_served_and_more_of_the_others_are() -> None:
    board, served = nominal_board(RECTIFIER), {False: 0, True: 0}
    clips = 0
    for amplitude in np.geomspace(3.0, 40.0, 60):
        for hertz in (60.0, 150.0, 300.0):
            drive = Drive(2.0 * np.pi * hertz, float(amplitude))
            slow = Flow(Reduction(RECTIFIER, board).system(), drive, fast=False)
            clipped = slow.run(np.zeros(4), 5, measure=True).clipped_time > 0.0
            clips += clipped
            for closely in served:
                done = code(RECTIFIER, board, drive, closely=closely) == DONE
                assert not (done and clipped)
                served[closely] += done
    assert 0 < served[False] < served[True] < 180 - clips // 2
    assert clips > 20


def test_a_run_that_clips_is_left_to_the_general_kernel() -> None:
    board = nominal_board(RECTIFIER)
    fast, slow = flows(RECTIFIER, board, Drive(2.0 * np.pi * 300.0, 40.0))
    got, want = (f.run(np.zeros(4), 5, measure=True) for f in (fast, slow))
    assert want.clipped_time > 0.0, "the test wants clipping"
    assert got.clipped_time == want.clipped_time
    np.testing.assert_array_equal(got.strobes, want.strobes)


@pytest.mark.parametrize("kind", sorted(CIRCUITS))
def test_boards_reduced_together_are_the_single_reductions(kind: str) -> None:
    circuit = CIRCUITS[kind]
    boards = draw_many(circuit, SPREAD, 5, range(6))
    found = working.BoardModes(boards)
    assert found.good.all()
    keys, modes = circuit.working, found.modes
    assert found.targets.keys == list(keys)
    for index in range(len(boards)):
        system = Reduction(circuit, boards.board(index)).system()
        for k, key in enumerate(keys):
            mode = system.mode(key)
            scale = float(np.abs(mode.A).max())
            np.testing.assert_allclose(modes.A[index, k], mode.A, rtol=0.0, atol=1e-12 * scale)
            for got, want in ((modes.B[index, k], mode.B), (modes.d[index, k], mode.d)):
                np.testing.assert_allclose(got, want, rtol=1e-9, atol=1e-12 * scale)
            assert int(modes.guards[k]) == len(mode.guards)
            assert tuple(modes.side[k]) == mode.sides
            for g, guard in enumerate(mode.guards):
                row = np.concatenate([guard.C, [guard.D, guard.e]])
                size = float(np.abs(row).max())
                np.testing.assert_allclose(
                    modes.guard[index, k, g], row, rtol=0.0, atol=1e-9 * size
                )
                number = int(modes.target[k, g])
                assert (keys[number] if number >= 0 else None) == (
                    guard.target if guard.target in keys else None
                )


def test_elimination_is_numpy_s() -> None:
    rng = np.random.default_rng(3)
    G = rng.standard_normal((5, 20, 20)) * 10.0 ** rng.uniform(-6, 6, (5, 20, 1))
    G *= 10.0 ** rng.uniform(-6, 6, (5, 1, 20))
    right = rng.standard_normal((5, 20, 3))
    G[3, 4] = G[3, 7]  # singular
    y, bad = np.zeros_like(right), np.zeros(5, dtype=np.int64)
    solve_all(G, right, y, bad)
    assert bad.tolist() == [0, 0, 0, 1, 0]
    for i in (0, 1, 2, 4):
        rows = np.abs(G[i]).max(axis=1, keepdims=True)
        columns = np.abs(G[i] / rows).max(axis=0)
        want = np.linalg.solve(G[i] / rows / columns, right[i] / rows) / columns[:, None]
        np.testing.assert_allclose(y[i], want, rtol=1e-9, atol=0.0)


def test_ideal_op_amps_do_without_the_fast_path() -> None:
    """Between two diodes nothing closes the loop then: that mode cannot be built."""
    system = Reduction(RECTIFIER, nominal_board(RECTIFIER, ideal=True)).system()
    modes = working_modes.TabulatedModes(system, Drive(1e3))
    with pytest.raises(ArithmeticError):
        _ = [modes.number(key) for key in system.working]
    one = replace(nominal_board(RECTIFIER), inverse_gain=0.0)
    together = working.BoardModes(Boards.of(RECTIFIER, [nominal_board(RECTIFIER), one]))
    assert together.good.tolist() == [True, False]


def test_an_ideal_board_that_clips_comes_back() -> None:
    """At a limit an ideal op-amp's way out is nothing but rounding: it is not cut for ever."""
    flow = Flow(
        Reduction(SATURATION, nominal_board(SATURATION, ideal=True)).system(),
        Drive(2.0 * np.pi * 300.0, 40.0),
    )
    run = flow.run(np.zeros(4), 2, measure=True)
    assert run.clipped_time > 0.0
    assert run.status in (FlowStatus.DONE, FlowStatus.CHATTER)
    assert flow.run(np.zeros(4), 2, max_events=10).status is FlowStatus.CHATTER
