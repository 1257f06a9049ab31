"""An ensemble gives for each board what that board alone gives."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.circuit import ensemble
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.ensemble import BRIEF, Ensemble, SettledBoard
from designer.circuit.netlist import Circuit
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.spread.spread import Spread, draw_many
from tests.circuit.test_coefficients import exact_for_paper
from tests.circuit.test_reduction import EXACT, circuit_of
from tests.shared.exploring import quick
from tests.shared.stages import PAPER, rectifier, stage

CIRCUIT = circuit_of(EXACT)
SPREAD = Spread(0.01, 0.05, 3e-3, 10e-3)
STAGES = {
    "saturation": circuit_of(exact_for_paper()),
    "rectifier": stage("rectifier", "both", rectifier()),
}
FEW = {"saturation": Spread(0.01, 0.01, 1e-3, 4e-3), "rectifier": Spread(0.02, 0.02, 3e-3, 10e-3)}
OMEGA = {1: 1.6, 2: 0.865, 3: 0.54, 8: 0.215}


@cache
def nominal(kind: str, p: int) -> tuple[Drive, Orbit]:
    """The drive of a stage's 1-p-p response, and the nominal board's orbit there from rest or from
    one of a few starts."""
    circuit = STAGES[kind]
    errors = coefficient_errors(circuit, PAPER.second_order())
    hertz = errors.scales.frequency(OMEGA[p])
    drive = Drive(2.0 * np.pi * hertz, -float(1.0 / errors.drive_gain[0]))
    flow = Flow(Reduction(circuit, nominal_board(circuit)).system(), drive)
    rng = np.random.default_rng(1)
    for _ in range(40):
        orbit = settle(flow, errors.scales.volts * rng.uniform(-0.7, 0.7, 4))
        if orbit.response == f"1-{p}-{p}":
            return drive, orbit
    raise AssertionError("the nominal board does not show it")


def respond(
    kind: str,
    p: int,
    indices: range,
    *,
    fast: bool = True,
    jobs: int = 1,
    within: int | None = None,
) -> list[SettledBoard]:
    drive, orbit = nominal(kind, p)
    boards = Ensemble(draw_many(STAGES[kind], FEW[kind], 7, indices), fast=fast)
    count = len(indices)
    starts = np.tile(orbit.start, (count, 1))
    return boards.respond(range(count), [drive] * count, starts, jobs=jobs, within=within)


def test_it_is_each_board_alone() -> None:
    boards = draw_many(CIRCUIT, SPREAD, 2, range(4))
    which = [2, 0, 2]
    drives = [Drive(2 * np.pi * f, -1.2) for f in (450.0, 500.0, 480.0)]
    starts = np.zeros((3, 4))
    called: list[int] = []
    found = Ensemble(boards).settle(
        which, drives, starts, jobs=2, progress=lambda: called.append(1)
    )
    assert len(called) == 3
    for k, orbit in enumerate(found):
        system = Reduction(CIRCUIT, boards.board(which[k])).system()
        alone = settle(Flow(system, drives[k]), starts[k])
        assert (orbit.status, orbit.n, orbit.p, orbit.q) == (
            alone.status,
            alone.n,
            alone.p,
            alone.q,
        )
        np.testing.assert_allclose(orbit.start, alone.start, rtol=1e-9)


@pytest.mark.parametrize("kind", sorted(STAGES))
@pytest.mark.parametrize("p", quick(sorted(OMEGA), 2))
def test_the_compiled_way_is_the_general_one(kind: str, p: int) -> None:
    """Every verdict and every margin, against the general kernel and ``attractors.settle``."""
    indices = range(12)
    compiled = undecided = 0
    for got, want in zip(
        respond(kind, p, indices), respond(kind, p, indices, fast=False), strict=True
    ):
        a, b = got.orbit, want.orbit
        if {a.status, b.status} == {OrbitStatus.APERIODIC, OrbitStatus.NOT_SETTLED}:
            # Of chaos that is watched until the steps are spent rounding decides what it is called.
            undecided += 1
            continue
        if b.status is OrbitStatus.APERIODIC or b.n > 4:
            # The way there is long or chaotic: rounding decides at which strobe it is met.
            assert (a.status, a.n, {a.p, a.q}) == (b.status, b.n, {b.p, b.q})
            continue
        assert (a.status, a.n, a.p, a.q, a.mode) == (b.status, b.n, b.p, b.q, b.mode)
        assert abs(a.periods - b.periods) <= 4  # rounding may count one turn more
        peak = np.abs(b.extremes).max(axis=1)
        assert np.abs((a.start - b.start) / peak).max() < 1e-9
        assert np.abs((a.extremes - b.extremes) / peak[:, None]).max() < 1e-9
        assert a.radius == pytest.approx(b.radius, rel=1e-6)
        assert a.lyapunov == pytest.approx(b.lyapunov, rel=1e-6)
        assert a.asymmetry == pytest.approx(b.asymmetry, abs=1e-8, nan_ok=True)
        assert a.penetration == pytest.approx(b.penetration, rel=1e-7)
        assert a.miss == pytest.approx(b.miss, rel=1e-7)
        np.testing.assert_array_equal(a.impact_sides, b.impact_sides)
        np.testing.assert_allclose(a.impact_times, b.impact_times, rtol=1e-7)
        speed = np.abs(b.impact_velocities).max()
        assert np.abs(a.impact_velocities - b.impact_velocities).max() < 1e-6 * speed
        assert np.abs(got.trace - want.trace).max() < 1e-9 * peak[0]
        compiled += 1
    assert compiled >= 4, "the test wants periodic answers"
    assert undecided <= 1


@pytest.mark.parametrize("kind", sorted(STAGES))
def test_usual_boards_need_no_reduction_of_their_own(kind: str) -> None:
    """That is: the compiled way served them, or the test above compared nothing."""
    drive, orbit = nominal(kind, 2)
    boards = Ensemble(draw_many(STAGES[kind], FEW[kind], 7, range(40)))
    boards.respond(range(40), [drive] * 40, np.tile(orbit.start, (40, 1)))
    assert len(boards._reductions) <= 4


@pytest.mark.slow
def test_where_chaos_is_not_plain_the_general_kernel_has_the_word(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With no chaos taken for plain, all of it is the general kernel's, bit for bit."""
    monkeypatch.setattr(ensemble, "FAINT", np.inf)
    indices = range(12)
    asked = [
        (got.orbit, want.orbit)
        for got, want in zip(
            respond("saturation", 8, indices),
            respond("saturation", 8, indices, fast=False),
            strict=True,
        )
        if want.orbit.status in (OrbitStatus.APERIODIC, OrbitStatus.NOT_SETTLED)
    ]
    assert asked, "the test wants chaos"
    for got, want in asked:
        assert got.status is want.status
        assert got.start.tobytes() == want.start.tobytes()
        assert (got.lyapunov, got.periods) == (want.lyapunov, want.periods)


def test_a_brief_answer_is_the_same_but_for_chaos_that_is_not_watched() -> None:
    indices = range(12)
    pairs = zip(
        respond("saturation", 8, indices, within=BRIEF),
        respond("saturation", 8, indices),
        strict=True,
    )
    chaotic = 0
    for brief, whole in pairs:
        if whole.orbit.status is OrbitStatus.PERIODIC and whole.orbit.periods < 800:
            assert raw(brief) == raw(whole)
        elif whole.orbit.status is OrbitStatus.APERIODIC:
            chaotic += 1
            assert brief.orbit.status is not OrbitStatus.PERIODIC
            assert brief.orbit.periods < whole.orbit.periods
    assert chaotic


def raw(response: SettledBoard) -> tuple[bytes, ...]:
    o = response.orbit
    arrays: list[Array] = [o.start, o.extremes, o.impact_times, o.impact_velocities]
    numbers = np.array([o.asymmetry, o.lyapunov, o.penetration, o.miss, o.periods])
    return (*(a.tobytes() for a in (*arrays, numbers, response.trace)), o.multipliers.tobytes())


@pytest.mark.slow
@pytest.mark.parametrize("kind", sorted(STAGES))
def test_a_board_s_bytes_do_not_depend_on_its_company(kind: str) -> None:
    """Alone, among others, in another order, by one thread or two: bit for bit the same."""
    together = [raw(r) for r in respond(kind, 3, range(40), jobs=2)]
    for first, last in ((0, 1), (7, 8), (3, 36), (39, 40)):
        part = [raw(r) for r in respond(kind, 3, range(first, last))]
        assert part == together[first:last]
    drive, orbit = nominal(kind, 3)
    boards = Ensemble(draw_many(STAGES[kind], FEW[kind], 7, range(40)))
    order = [5, 39, 5, 0]
    again = boards.respond(order, [drive] * 4, np.tile(orbit.start, (4, 1)))
    assert [raw(r) for r in again] == [together[k] for k in order]


def test_one_board_under_many_drives() -> None:
    drive, orbit = nominal("rectifier", 2)
    boards = Ensemble(draw_many(STAGES["rectifier"], FEW["rectifier"], 7, range(2)))
    drives = [
        Drive(drive.omega * f, drive.amplitude * g, o)
        for f, g, o in ((1.0, 1.0, 0.0), (1.01, 1.0, 0.0), (1.0, 0.95, 0.0), (1.0, 1.0, 0.02))
    ]
    starts = np.tile(orbit.start, (4, 1))
    found = boards.settle([1] * 4, drives, starts)
    for one, each in zip(found, drives, strict=True):
        alone = settle(Flow(boards.reduction(1).system(), each, fast=False), orbit.start)
        assert (one.status, one.n, one.p, one.q) == (alone.status, alone.n, alone.p, alone.q)
        np.testing.assert_allclose(one.start, alone.start, rtol=0.0, atol=1e-8)
    assert len({one.start.tobytes() for one in found}) == 4


def test_running_without_settling_is_the_flow() -> None:
    drive, orbit = nominal("rectifier", 1)
    boards = Ensemble(draw_many(STAGES["rectifier"], FEW["rectifier"], 7, range(3)))
    starts = np.stack([orbit.start, np.zeros(4), 3.0 * orbit.start])
    found = boards.run([0, 1, 2], [drive] * 3, starts, 4, jobs=2)
    for k, run in enumerate(found):
        assert run is not None
        alone = Flow(boards.reduction(k).system(), drive, fast=False).run(starts[k], 4)
        scale = float(np.abs(alone.strobes).max())
        np.testing.assert_allclose(run.strobes, alone.strobes, rtol=0.0, atol=1e-9 * scale)
        assert run.mode == alone.mode


def test_a_floating_board_fails_alone() -> None:
    good = nominal_board(CIRCUIT)
    cut = {name: np.inf if name.startswith("R") else v for name, v in good.values.items()}
    boards = Boards.of(CIRCUIT, [good, replace(good, values=cut)])
    drive = Drive(2 * np.pi * 450.0, -1.2)
    first, second = Ensemble(boards).settle([0, 1], [drive] * 2, np.zeros((2, 4)))
    assert first.status is not OrbitStatus.FAILED
    assert second.status is OrbitStatus.FAILED
    assert second.reason
    assert Ensemble(boards).run([1], [drive], np.zeros((1, 4)), 1) == [None]


def test_a_circuit_without_working_modes_is_settled_all_the_same() -> None:
    """Without a stop there is nothing to tabulate."""
    circuit: Circuit = circuit_of(EXACT, stops=False)
    drive = Drive(2 * np.pi * 450.0, -0.2)
    (orbit,) = Ensemble(Boards.of(circuit, [nominal_board(circuit)])).settle(
        [0], [drive], np.zeros((1, 4))
    )
    assert orbit.response == "1-0-0"
