"""An ensemble gives for each board what that board alone gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from designer.attractor import settle
from designer.boards import Boards
from designer.circuit import nominal_board
from designer.ensemble import Ensemble
from designer.flow import Flow
from designer.orbit import OrbitStatus
from designer.reduction import Reduction
from designer.spread import Spread, draw_many
from designer.system import Drive
from tests.test_reduction import EXACT, circuit_of

CIRCUIT = circuit_of(EXACT)
SPREAD = Spread(0.01, 0.05, 3e-3, 10e-3)


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


def test_a_floating_board_fails_alone() -> None:
    good = nominal_board(CIRCUIT)
    cut = {name: np.inf if name.startswith("R") else v for name, v in good.values.items()}
    boards = Boards.of(CIRCUIT, [good, replace(good, values=cut)])
    drive = Drive(2 * np.pi * 450.0, -1.2)
    first, second = Ensemble(boards).settle([0, 1], [drive] * 2, np.zeros((2, 4)))
    assert first.status is not OrbitStatus.FAILED
    assert second.status is OrbitStatus.FAILED
    assert second.reason
