"""What the exact circuit with bandwidth is asked about a candidate of a search."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from designer.centering.answer_cache import AnswerCache
from designer.centering.bandwidth_check import LaggingBoards
from designer.centering.ngspice_check import BOARDS_ASKED, STRETCH, Agreement
from designer.centering.scaled_sigma import STREAM
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.spread.board_quantities import between
from designer.spread.spread import draw_many
from tests.centering.test_ngspice_check import bench
from tests.shared.search_cases import made, spread


def test_boards_settle_from_their_own_orbit_each_as_its_reduction_does() -> None:
    boards, operating_orbit = bench()
    drawn = draw_many(made().design.circuit, spread(), 1, range(2), STREAM)
    wider = between(drawn, np.full(2, STRETCH))
    lagging = boards.lagging(operating_orbit, range(2), STRETCH)
    own = boards.subjects(operating_orbit, range(2), STRETCH)
    for i, (orbit, subject) in enumerate(zip(lagging, own, strict=True)):
        alone = Reduction(made().design.circuit, wider.board(i), bandwidth=True)
        flow = Flow(alone.system(), operating_orbit.drive)
        want = settle(flow, alone.state(subject.orbit.start))
        assert orbit.response == want.response == "1-2-2"
        np.testing.assert_allclose(orbit.start, want.start, rtol=0.0, atol=1e-9)
        assert np.abs(orbit.start[:4] - subject.orbit.start).max() > 1e-4


def test_answers_are_counted_and_remembered() -> None:
    """Lost and open boards are told apart; what is known is not asked again."""
    boards, operating_orbit = bench()
    good = operating_orbit.orbit
    shown = [good] * 12 + [
        Orbit(OrbitStatus.APERIODIC),
        Orbit(OrbitStatus.GRAZING),
        Orbit(OrbitStatus.FAILED),
        Orbit(OrbitStatus.NOT_SETTLED),
    ]
    calls: list[Any] = []

    def lagging(*extent: Any) -> list[Orbit]:
        calls.append(extent)
        return shown

    played = SimpleNamespace(lagging=lagging, query=boards.query)
    asks = LaggingBoards(AnswerCache())
    for _ in range(2):
        assert asks(played, [operating_orbit, None]) == (Agreement(16, 12, 3), Agreement(0, 0))  # type: ignore[arg-type]
    assert calls == [(operating_orbit, range(BOARDS_ASKED), STRETCH)]


@pytest.mark.slow
def test_every_board_of_a_good_design_keeps_its_response() -> None:
    boards, operating_orbit = bench()
    assert LaggingBoards(AnswerCache())(boards, [operating_orbit]) == (
        Agreement(BOARDS_ASKED, BOARDS_ASKED),
    )
