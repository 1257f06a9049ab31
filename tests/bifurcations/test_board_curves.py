"""Bifurcation curves of a board over its generator, in hertz and volts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.bifurcations.continuation import start, trace
from designer.bifurcations.plane_curves import PlaneCurve, PlaneWindow, continued
from designer.bifurcations.points import PointKind, locate
from designer.circuit.board_values import nominal_board
from designer.circuit.swept_board import BoardSubject
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import Orbit, OrbitStatus
from tests.shared.paper_cases import synthesised

PLACES = 3
"""Of the curve, at which the point is located on its own."""


def _located(followed: PlaneCurve, place: int) -> list[float]:
    """Frequencies of the points of the curve's kind at the amplitude of one of its points, by the
    continuation over the frequency alone."""
    point = followed.points[place]
    hertz, volts = point.values
    over = followed.system.plane.along_first(volts)
    orbit = Orbit(
        OrbitStatus.PERIODIC, n=followed.system.n, start=point.z[: followed.system.states]
    )
    for off in (-2e-3, 2e-3):
        try:
            origin = start(over, orbit, hertz * (1.0 + off))
        except ArithmeticError:
            continue
        branch = trace(origin, hertz * 0.996, hertz * 1.004)
        values = [p.value for p in locate(branch) if p.kind is followed.kind]
        if values:
            return values
    return []


@pytest.mark.slow
def test_a_grazing_of_a_board_in_hertz_and_volts() -> None:
    """The touch at ω = 0.7664 by the design's time scale, on the branch through 1-2-2, followed
    over frequency and amplitude, passes points that are located one by one."""
    design = synthesised().design
    board = BoardSubject(design)
    frequency = design.errors.scales.frequency
    over = board.family("frequency")
    orbit = settle(over.flow(frequency(0.85)), np.zeros(4))
    branch = trace(start(over, orbit, frequency(0.85)), frequency(0.6), frequency(1.3))
    grazing = min(
        (p for p in locate(branch) if p.kind is PointKind.GRAZING and any(p.stable)),
        key=lambda p: p.value,
    )
    assert grazing.value == pytest.approx(frequency(0.76644), rel=1e-4)
    window = PlaneWindow(
        (frequency(0.6), frequency(1.0)), (0.9 * board.amplitude, 1.1 * board.amplitude)
    )
    followed = continued(board.plane("frequency", "amplitude"), grazing, board.amplitude, window)
    assert followed is not None
    assert set(followed.ends) == {"edge of amplitude"}
    for place in np.linspace(1, len(followed.points) - 2, PLACES).astype(int):
        hertz = followed.points[place].values[0]
        values = _located(followed, int(place))
        assert min(abs(value - hertz) for value in values) < 1e-8 * hertz


def test_settings_at_which_a_board_moves_like_the_nominal_one() -> None:
    """Capacitors that are all 1 % larger slow the board by 1 %; a generator's resistor that is 2 %
    larger lets 2 % less of its voltage in."""
    board = BoardSubject(synthesised().design)
    circuit = board.design.circuit
    capacitors = {part.name for part in circuit.capacitors}
    slower = {n: v * (1.01 if n in capacitors else 1.0) for n, v in circuit.values.items()}
    weaker = {n: v * (1.02 if n in ("R6", "R12") else 1.0) for n, v in circuit.values.items()}
    nominal = nominal_board(circuit, ideal=True)
    found = board.setting_ratios(replace(nominal, values=v) for v in (slower, weaker))
    assert found["frequency"] == pytest.approx([1.01, 1.0], rel=1e-9)
    assert found["amplitude"] == pytest.approx([1.0, 1.0 / 1.02], rel=1e-9)
    assert found["omega"] == pytest.approx(found["frequency"])
