"""Boards at a temperature: op-amps against their data sheets, draws against one board at a time,
ngspice's finest op-amps against the exact circuit."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, strategies as st

from designer.catalog.entries import LEAST_LEFT, ROOM
from designer.catalog.fields import Figure
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.report.spread_words import words_of
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.worker import open_simulator
from designer.spread import random_streams
from designer.spread.board_quantities import quantities
from designer.spread.part_rules import spread_of, warmed
from designer.spread.spread import OpAmpDrift, Spread, draw, draw_many, part_of
from tests.shared.exploring import quick
from tests.shared.stages import bought, rectifier, stage
from tests.spice.test_fidelities import paper, run
from tests.spice.test_rectifier_ngspice import SCALED, subject
from tests.spread.test_spread_model import CATALOG, modelfile

SOLD = stage("rectifier", "both", bought(rectifier()))
NAMES = [opamp.name for opamp in CATALOG.opamps]


@cache
def at(celsius: float) -> Spread:
    """The spread of boards that all have this temperature."""
    return spread_of(modelfile(f"temperature = [{celsius}, {celsius}]"), SOLD, CATALOG)


def test_the_sheets_figures_at_high_temperature_come_out() -> None:
    """DS21733J gives the MCP6004 19 pA at 85 °C; SLOS080 the TL074C 13 mV from 0 to 70 °C. The
    catalogue has neither figure but those at 25 °C and their changes."""
    mcp = CATALOG.opamp("MCP6004").over((85.0, 85.0))
    assert mcp.bias.max == pytest.approx(19e-12, rel=0.05)
    tl = CATALOG.opamp("TL074C").over((0.0, 70.0))
    assert tl.offset.max == pytest.approx(13e-3, abs=1e-3)


def test_bias_currents_that_all_boards_share_when_warm_are_a_quantity() -> None:
    """They differ from the nominal board's alone: 2 to the 6 times 65 pA at 85 °C."""
    boards = draw_many(SOLD, at(85.0), 1, range(50))
    found = {q.name: q for q in quantities(SOLD, boards)}
    assert found["U1A.bias"].sigma == pytest.approx(63.0 * SOLD.bias)
    assert found["U1A.bias"].nominal == SOLD.bias
    new = draw_many(SOLD, spread_of(modelfile(""), SOLD, CATALOG), 1, range(50))
    assert "U1A.bias" not in {q.name for q in quantities(SOLD, new)}


def test_of_a_change_with_bounds_the_worst_holds_and_the_middle_is_drawn() -> None:
    """Worked out by hand from 200 pA and 2.5 MHz at 25 °C."""
    plain = CATALOG.opamp("TL074C")
    doubling = Figure(8.0, None, 12.0, "a sheet")
    slope = Figure(-4e-3, None, -1e-3, "a sheet")
    opamp = replace(plain, bias_doubling=doubling, gbw_drift=slope)
    warm = opamp.over((-20.0, 85.0))
    assert warm.bias.max == pytest.approx(200e-12 * 2.0**7.5)
    assert warm.gbw.min == pytest.approx(2.5e6 * (1.0 - 60.0 * 4e-3))
    catalog = replace(CATALOG, opamps=(opamp,))
    drift = spread_of(modelfile("temperature = [-20, 85]"), SOLD, catalog).opamps
    assert drift.bias_doubling == 10.0
    assert drift.gain_bandwidth == pytest.approx(-2.5e-3)


@pytest.mark.parametrize("name", NAMES)
def test_every_shipped_op_amp_has_what_temperature_and_age_do(name: str) -> None:
    opamp = CATALOG.opamp(name)
    assert opamp.temperature is not None
    assert opamp.temperature.min is not None
    assert opamp.over(None) is opamp
    assert opamp.over((ROOM, ROOM)) == opamp
    for key in ("offset_drift", "bias_doubling", "gbw_drift", "slew_drift", "saturation_drift",
                "offset_ageing"):  # fmt: skip
        figure = getattr(opamp, key)
        assert isinstance(figure, Figure)
        assert figure.source


@given(
    st.sampled_from(NAMES),
    st.tuples(st.floats(-60, 150), st.floats(-60, 150)).map(sorted),
    st.floats(0, 1),
)
def test_bounds_over_a_range_hold_at_each_temperature_of_it(
    name: str, ends: list[float], share: float
) -> None:
    opamp, (low, high) = CATALOG.opamp(name), ends
    whole = opamp.over((low, high))
    here = opamp.over((low + share * (high - low),) * 2)

    def least(figure: Figure | None) -> float:
        assert figure is not None
        return figure.nominal if figure.min is None else figure.min

    def most(figure: Figure) -> float:
        return figure.nominal if figure.max is None else figure.max

    for key in ("gbw", "slew", "swing"):
        assert least(getattr(whole, key)) <= least(getattr(here, key)) * (1 + 1e-12)
    for key in ("offset", "bias"):
        assert most(getattr(whole, key)) >= most(getattr(here, key)) * (1 - 1e-12)
    assert whole.offset_limit >= here.offset_limit * (1 - 1e-12)


def test_each_board_is_moved_by_its_own_temperature() -> None:
    """One board at a time, by the formulas of docs/spread.md, from the same board at 25 °C."""
    spread = spread_of(modelfile("temperature = [-20, 85]"), SOLD, CATALOG)
    opamp, count = CATALOG.opamp("TL074C"), 40
    warm = draw_many(SOLD, spread, 3, range(count))
    cold = draw_many(SOLD, at(ROOM), 3, range(count))
    names = spread.coordinates(SOLD)
    law = spread.opamps.offset
    assert law is not None
    assert opamp.offset_drift is not None
    assert opamp.bias_doubling is not None
    assert opamp.gbw_drift is not None
    assert opamp.slew_drift is not None
    assert opamp.saturation_drift is not None
    cube = random_streams.cube(3, list(names), range(count))
    for k in range(count):
        u = dict(zip(names, cube[k], strict=True))
        more = -20.0 + 105.0 * u["temperature"] - ROOM
        for s in (section.name for section in SOLD.sections):
            slope = float(law.ppf(np.array([u[f"{s}.tempco"]]))[0])
            assert abs(slope) <= 3.0 * 18e-6
            expected = cold.offset[s][k] + slope * more
            assert warm.offset[s][k] == pytest.approx(expected, abs=1e-12)
            assert warm.bias[s][k] == pytest.approx(65e-12 * 2.0 ** (more / 10.0))
            assert warm.gain_bandwidth[s][k] == pytest.approx(3e6 * (1.0 - 2e-3 * more))
            assert warm.slew[s][k] == pytest.approx(13e6 * (1.0 - 1e-3 * more))
            high = min(cold.high[s][k] + 4e-3 * more, 15.0)
            assert warm.high[s][k] == pytest.approx(high)
            assert warm.low[s][k] == pytest.approx(max(cold.low[s][k] - 4e-3 * more, -15.0))


def test_at_room_temperature_nothing_moves_but_what_is_drawn() -> None:
    plain = spread_of(modelfile(""), SOLD, CATALOG)
    boards, warm = (draw_many(SOLD, s, 5, range(20)) for s in (plain, at(ROOM)))
    for group in ("offset", "low", "high", "bias", "values"):
        for name, column in getattr(boards, group).items():
            assert (getattr(warm, group)[name] == column).all()
    assert not boards.slew
    assert not boards.gain_bandwidth
    assert plain.opamps == OpAmpDrift()
    assert "opamps" not in plain.as_dict()


def test_a_spread_that_the_file_does_not_warm_is_the_one_that_it_would() -> None:
    file = modelfile("")
    assert warmed(file, SOLD, CATALOG).at_temperature(60.0) == at(60.0)


def test_offsets_and_references_age_by_the_catalogue() -> None:
    more = 'ageing = "catalogue"\n[[spread.part]]\nnames = "capacitors"\nageing = 0.003'
    aged = spread_of(modelfile(more), SOLD, CATALOG)
    plain = spread_of(modelfile(""), SOLD, CATALOG)
    names = set(aged.coordinates(SOLD)) - set(plain.coordinates(SOLD))
    assert {"U1A.ageing", "VR1.ageing"} <= names
    assert part_of("U1A.ageing") == "U1A"
    boards, new = (draw_many(SOLD, s, 2, range(4000)) for s in (aged, plain))
    change = boards.offset["U1A"] - new.offset["U1A"]
    assert np.abs(change).max() <= 10e-3
    assert np.std(change) == pytest.approx(3e-3, rel=0.05)
    relative = boards.reference["VR1"] / new.reference["VR1"] - 1.0
    assert np.std(relative) == pytest.approx(120e-6, rel=0.05)
    assert np.abs(relative).max() <= 360e-6
    words = words_of(aged, SOLD).replace("\N{NO-BREAK SPACE}", " ")
    assert "ageing of op-amp offsets normal with σ = 3 mV, cut at 10 mV" in words


def test_a_steep_figure_leaves_something_at_every_temperature() -> None:
    """A catalogue of one's own may say anything."""

    def typ(value: float) -> Figure:
        return Figure(None, value, None, "a drawer")

    wild = replace(
        CATALOG.opamp("TL074C"), gbw_drift=typ(-1.0), saturation_drift=typ(-5.0),
        bias_doubling=typ(1e-3),
    )  # fmt: skip
    hot = wild.over((-50.0, 150.0))
    assert hot.gbw.min == pytest.approx(LEAST_LEFT * 2.5e6)
    assert hot.swing.min == pytest.approx(LEAST_LEFT * 12.0)
    catalog = replace(CATALOG, opamps=(wild,))
    spread = spread_of(modelfile("temperature = [-50, 150]"), SOLD, catalog)
    boards = draw_many(SOLD, spread, 1, range(200))
    for s in (section.name for section in SOLD.sections):
        assert (boards.high[s] > 0.0).all()
        assert (boards.high[s] <= 15.0).all()
        assert (boards.gain_bandwidth[s] > 0.0).all()
        assert np.isfinite(boards.bias[s]).all()


def test_the_report_says_what_moves() -> None:
    words = words_of(spread_of(modelfile("temperature = [0, 70]"), SOLD, CATALOG), SOLD)
    words = words.replace("\N{NO-BREAK SPACE}", " ")
    for word in ("from 0 to 70 °C", "σ = 18 µV/K", "doubling every 10 K", "4 mV/K", "-0.2 %/K"):
        assert word in words


def parameters(netlist: str, name: str) -> dict[str, float]:
    line = next(line for line in netlist.splitlines() if line.startswith(f"X{name} "))
    return {k: float(v) for k, v in re.findall(r"(\w+)=(\S+)", line)}


@pytest.mark.parametrize("celsius", quick([-20.0, 25.0, 85.0]))
def test_ngspices_finest_op_amps_show_the_response_of_the_warm_board(celsius: float) -> None:
    """The exact circuit decides with offsets, bias currents and limits at their temperature alone;
    the deck has gain-bandwidth, slew rate and loaded limits there too. Strobes are within 3 % of
    the peak."""
    circuit, more = stage("rectifier", "both", SCALED), celsius - ROOM
    spread = replace(at(celsius), tempco={})
    board, cold = draw(circuit, spread, 4, 0), draw(circuit, replace(at(ROOM), tempco={}), 4, 0)
    asked = subject(circuit, board, "both", 0.54)
    assert asked.orbit.status is OrbitStatus.PERIODIC
    full = replace(asked, fidelity="full")
    job = numerics_gate.job(full, SolverSettings("trap", asked.period / 2000))
    names, slope = spread.coordinates(circuit), spread.opamps.offset
    assert slope is not None
    u = dict(zip(names, random_streams.cube(4, list(names), range(1))[0], strict=True))
    for section in (each.name for each in circuit.sections):
        found = parameters(job.netlist, section)
        drift = float(slope.ppf(np.array([u[f"{section}.tempco"]]))[0])
        assert found["vos"] == pytest.approx(cold.offset[section] + drift * more, abs=1e-12)
        low, high = cold.rails[section]
        assert found["high"] == pytest.approx(min(high + 4e-3 * more, 15.0))
        assert found["low"] == pytest.approx(max(low - 4e-3 * more, -15.0))
        assert found["gbw"] == pytest.approx(3e6 * (1.0 - 2e-3 * more))
        assert found["slew"] == pytest.approx(13e6 * (1.0 - 1e-3 * more))
        assert found["ib"] == pytest.approx(65e-12 * 2.0 ** (more / 10.0))
    waves = open_simulator("shared").run(job.netlist, job.signals, job.stop)
    read = job.reduce(waves)
    assert read.orbit.response == asked.orbit.response
    peak = np.abs(asked.orbit.extremes).max(axis=1)
    assert (np.abs(read.strobes[-1] - asked.orbit.start) < 0.03 * peak).all()


@pytest.mark.slow
def test_in_ngspice_an_orbit_moves_with_temperature_as_on_the_exact_circuit() -> None:
    """1-1-1 of the paper's board, whose stops are limits of an op-amp, on ngspice's finest op-amps:
    strobes within 10 % of the peak, as at 25 °C (``tests.spice.test_fidelities``), and what moves
    them from there, more than 1 % of the peak, within a tenth of that."""
    cool = paper()[1.55]
    circuit, drive = cool.circuit, cool.excitation.drive

    def strobes(celsius: float) -> tuple[np.ndarray, np.ndarray]:
        spread = spread_of(modelfile(f"temperature = [{celsius}, {celsius}]"), circuit, CATALOG)
        board = Reduction(circuit, draw(circuit, replace(spread, tempco={}), 4, 0))
        orbit = settle(Flow(board.system(), drive), cool.orbit.start)
        read = run(replace(cool, reduction=board, orbit=orbit), "full", 200, 12)
        assert read.orbit.response == orbit.response == "1-1-1"
        return orbit.start, read.strobes[-1]

    peak = np.abs(cool.orbit.extremes).max(axis=1)
    exact, ngspice = np.array([strobes(celsius) for celsius in (25.0, -20.0, 85.0)]).swapaxes(0, 1)
    assert (np.abs(ngspice - exact) < 0.10 * peak).all()
    moved = (exact[1:] - exact[0]) / peak
    assert (np.abs(moved).max(axis=1) > 0.01).all()
    assert (ngspice[1:] - ngspice[0]) / peak == pytest.approx(moved, abs=1e-3)
