"""The path to a window: against plain runs of the boards that it is followed to."""

from __future__ import annotations

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.continued_orbit import ContinuedOrbit, follow, valleys
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.tuning_bands import Bands
from designer.spread.spread import Spread, draw_many
from designer.yields import window_path
from designer.yields.adjustment import Adjustment
from designer.yields.window_path import MOST_FOLLOWED, PathSetting, find_window
from tests.shared.bench_plans import period_counts, plan, question
from tests.shared.paper_cases import MODEL, subject
from tests.shared.symmetric_shooting import shoot_symmetric

LARGE = {4: 1e-3, 8: 3e-4}
"""Standard deviation of the input offset [V] that is large for the signals of 1-p-p."""


def board(p: int, sample: int) -> Boards:
    of = plan(p, spread=Spread(0.01, 0.01, LARGE[p], 4 * LARGE[p]), seed=5)
    return draw_many(of.circuit, of.spread, of.seed, range(sample, sample + 1))


def response(boards: Boards, p: int, spot: PathSetting) -> tuple[int, int, int] | None:
    """n-p-q after 900 drive periods from the nominal orbit, without the search's classifier."""
    asked = question(p)
    system = Reduction(boards.circuit, boards.board(0)).system()
    run = Flow(system, spot.setting.of(asked.excitation).drive).run(asked.start.start, 900)
    return period_counts(run.strobes, run.counts)


@pytest.mark.parametrize(("p", "sample"), [(4, 5), (8, 4)])
def test_a_path_leads_into_a_window_that_is_hard_to_meet(p: int, sample: int) -> None:
    """Of an 11 x 11 x 11 grid over the bands, 8 and 10 settings show the response."""
    bands = Bands()
    spots, followed = find_window(board(p, sample), question(p), bands)
    best = max(spots, key=lambda spot: spot.radius)
    assert best.radius > 0.0
    assert Adjustment.at(best.setting.vector, bands) == best.setting
    assert response(board(p, sample), p, best) == (1, p, p)
    assert followed <= MOST_FOLLOWED


def test_a_path_ends_when_it_has_followed_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = 0

    def counted(flow: Flow, start: Array, n: int) -> ContinuedOrbit | None:
        nonlocal calls
        calls += 1
        return follow(flow, start, n)

    monkeypatch.setattr(window_path, "follow", counted)
    monkeypatch.setattr(window_path, "MOST_FOLLOWED", 40)
    _, followed = find_window(board(4, 5), question(4), Bands())
    assert 40 - window_path.RESERVE < followed <= 40
    assert followed == calls


def test_a_path_climbs_from_the_best_that_it_has_met(monkeypatch: pytest.MonkeyPatch) -> None:
    """Over one knob x, an orbit whose one function falls with a slope of 1 from two tops: 0.6 at
    0.086, and 0.5 at 0.05, where x is below 0.071. Steps of 0.1 meet x = 0 and 0.1 alone, and a
    step back from the latter is on the lower hill, from which no way leads to the higher top."""
    nominal, bands = question(1).excitation.drive.amplitude, Bands(0.0, 0.1, 0.0)

    def two_tops(flow: Flow, start: Array, n: int) -> ContinuedOrbit:
        x = (flow.drive.amplitude / nominal - 1.0) / bands.amplitude
        value = 0.6 - abs(x - 0.086) if x > 0.071 else 0.5 - abs(x - 0.05)
        return ContinuedOrbit((), {"fold": value}, 1, start)

    circuit = subject(1).circuit
    monkeypatch.setattr(window_path, "follow", two_tops)
    monkeypatch.setattr(window_path, "PROBE", 1e-6)  # no difference quotient reaches over a top
    spots, _ = find_window(Boards.of(circuit, [nominal_board(circuit)]), question(1), bands)
    best = max(spots, key=lambda spot: spot.radius)
    assert 0.6 - window_path.FINEST < best.radius <= 0.6
    assert best.setting.amplitude == pytest.approx(0.0086, abs=0.1 * window_path.FINEST)


def test_the_radius_says_where_the_window_ends() -> None:
    """Half of it away from the spot, in every direction, the board still shows the response; twice
    of it away, in some direction it does not."""
    p, boards, bands = 4, board(4, 9), Bands()
    spots, _ = find_window(boards, question(p), bands)
    best = max(spots, key=lambda spot: spot.radius)
    widths = np.array([bands.frequency, bands.amplitude])
    here = np.array([best.setting.frequency, best.setting.amplitude])
    turns = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)

    def shown(radius: float) -> list[bool]:
        out = []
        for turn in turns:
            f, a = here + radius * widths * (np.cos(turn), np.sin(turn))
            moved = PathSetting(type(best.setting)(f, a, best.setting.offset), 0.0)
            out.append(response(boards, p, moved) == (1, p, p))
        return out

    assert all(shown(0.5 * best.radius))
    assert not all(shown(2.0 * best.radius))


def test_the_nominal_board_is_in_its_window() -> None:
    circuit = subject(2).circuit
    nominal = Boards.of(circuit, [nominal_board(circuit)])
    spots, _ = find_window(nominal, question(2), Bands())
    assert all(spot.radius > 0.0 for spot in spots)
    assert response(nominal, 2, spots[-1]) == (1, 2, 2)


def test_a_path_is_the_same_twice_and_stays_in_its_bands() -> None:
    bands = Bands(0.02, 0.0, 0.01)
    first = find_window(board(4, 1), question(4), bands, 0.5)
    assert first == find_window(board(4, 1), question(4), bands, 0.5)
    for spot in first[0]:
        assert Adjustment.at(spot.setting.vector, bands) == spot.setting


def test_bands_of_no_width_leave_the_setting() -> None:
    spots, _ = find_window(board(4, 3), question(4), Bands(0.0, 0.0, 0.0))
    assert {spot.setting.of(question(4).excitation) for spot in spots} == {question(4).excitation}


def test_valleys_are_the_displacement_between_contacts() -> None:
    """Of 1-8-8, seven on each side that are shallower than the contacts are deep."""
    known = subject(8)
    flow = Flow(known.system, known.excitation.drive)
    orbit = follow(flow, known.orbit.start, 1)
    assert orbit is not None
    upper = known.system.contact_rows(0)[1]
    fine = flow.run(known.orbit.start, 1, points=1 << 15).strobes[:-1, 0]
    past = fine * upper[0] + upper[-1]
    found = [v for v in valleys(orbit) if v.extreme is not None and v.extreme.stop == (0, 1)]
    shallow = sorted(v.value for v in found if v.value < 0.03)
    lowest = (past < np.roll(past, 1)) & (past <= np.roll(past, -1)) & (past > -0.03)
    assert len(shallow) == 7
    assert shallow == pytest.approx(sorted(-past[lowest]), abs=2e-7)


def test_the_fold_has_the_sign_of_stability() -> None:
    """The symmetric 1-1-1 of the model has a multiplier above 1 below the pitchfork at 1.47."""
    system = MODEL.second_order().piecewise_linear()
    for omega, stable in ((1.55, True), (1.44, False)):
        flow = Flow(system, Drive(omega))
        near = settle(flow, np.zeros(4))
        found = shoot_symmetric(flow, near.start, 1)
        assert found is not None
        largest = float(np.linalg.eigvals(found[1]).real.max())
        assert (largest < 1.0) is stable
        orbit = follow(flow, found[0], 1)
        assert orbit is not None
        assert (orbit.stability["fold"] > 0.0) is stable
