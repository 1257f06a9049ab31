"""Each op-amp model in ngspice, held against the catalogue's figures, one measurement at a time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer import deck
from designer.catalog import load_catalog
from designer.circuit import nominal_board
from designer.deck import Excitation, SolverSettings
from designer.flow import Flow
from designer.ngspice import check_netlist, open_simulator
from designer.opamp_bench import Bench
from designer.opamp_model import RUNGS, Rung
from designer.reduction import Reduction
from designer.system import Drive
from tests.test_reduction import EXACT, circuit_of

CATALOG = load_catalog()
NAMES = [o.name for o in CATALOG.opamps]
CIRCUIT = circuit_of(EXACT)
WITH_MEMORY = [r for r in RUNGS if r != "ideal"]

each = pytest.mark.parametrize("name", NAMES)
every_rung = pytest.mark.parametrize("rung", RUNGS)
every_rung_with_memory = pytest.mark.parametrize("rung", WITH_MEMORY)


@each
@every_rung
def test_static_figures(name: str, rung: Rung) -> None:
    """Open-loop gain within 0.1 %, offset within 1 ppm plus 1/gain, bias within 1 fA."""
    opamp = CATALOG.opamp(name)
    bench = Bench.of(opamp, rung)
    assert bench.open_loop_gain() == pytest.approx(opamp.gain.nominal, rel=1e-3)
    offset = opamp.offset.nominal
    assert bench.offset() == pytest.approx(offset, rel=1e-6 + 2.0 / opamp.gain.nominal, abs=1e-11)
    assert replace(bench, vos=-offset).offset() == pytest.approx(-offset, rel=1e-4)
    for current in bench.bias():
        assert current == pytest.approx(opamp.bias.nominal, abs=1e-15)


@each
@every_rung
def test_swing(name: str, rung: Rung) -> None:
    """Below ``full`` the limits are those of the pin, whatever the load; each rail its own."""
    bench = Bench.of(CATALOG.opamp(name), rung)
    low, high = 0.9 * bench.rails[0], 0.97 * bench.rails[1]
    bench = replace(bench, rails=(low, high))
    for load in (2e3, 10e3):
        assert bench.swing(load) == pytest.approx((low, high), abs=1e-3)


@each
@every_rung_with_memory
def test_frequency_response(name: str, rung: Rung) -> None:
    """Gain-bandwidth within 1 % a decade below unity gain."""
    opamp = CATALOG.opamp(name)
    at = opamp.gbw.nominal / 10.0
    frequency, gain = Bench.of(opamp, rung).response(at, 2.0 * at)
    assert abs(gain[0]) * frequency[0] == pytest.approx(opamp.gbw.nominal, rel=0.01)


@each
def test_one_pole(name: str) -> None:
    frequency, phase = Bench.of(CATALOG.opamp(name), "dynamic").unity_gain()
    assert frequency == pytest.approx(CATALOG.opamp(name).gbw.nominal, rel=1e-3)
    assert phase == pytest.approx(90.0, abs=0.1)


@each
@every_rung_with_memory
def test_slew(name: str, rung: Rung) -> None:
    """Both edges within 1 % of the figure."""
    opamp = CATALOG.opamp(name)
    for edge in Bench.of(opamp, rung).slew():
        assert edge == pytest.approx(opamp.slew.nominal, rel=0.01)


@each
@every_rung_with_memory
def test_recovery_is_the_parameter(name: str, rung: Rung) -> None:
    """No data sheet fixes it for every circuit: swept over two decades, it follows within 3 %."""
    bench = Bench.of(CATALOG.opamp(name), rung)
    for factor in (0.1, 1.0, 10.0):
        wanted = factor * bench.parameters.recovery
        swept = replace(bench, parameters=replace(bench.parameters, recovery=wanted))
        assert swept.recovery() == pytest.approx(wanted, rel=0.03)


@every_rung
def test_a_deck_of_every_rung(rung: Rung) -> None:
    """It passes the filter, and four periods from a point of the orbit end near that point."""
    board = nominal_board(CIRCUIT)
    excitation = Excitation(400.0, 0.6)
    reduction = Reduction(CIRCUIT, board)
    flow = Flow(reduction.system(), Drive(2 * np.pi * 400.0, -excitation.amplitude))
    start = flow.run(np.zeros(4), 60).strobes[-1]
    text = deck.write(
        CIRCUIT, board, excitation, SolverSettings("trap", 1 / 400.0 / 400),
        title="test", stop_time=4 / 400.0, initial=start, rung=rung,
    )  # fmt: skip
    check_netlist(text)
    assert not any(line.startswith("+") for line in text.splitlines())
    waves = open_simulator("shared").run(text, CIRCUIT.state_nets, 4 / 400.0)
    for k, net in enumerate(CIRCUIT.state_nets):
        peak = np.abs(waves.signals[net]).max()
        # 60 mV at the threshold against 13 V at the limit: what the load takes of that shows here.
        assert waves.signals[net][-1] == pytest.approx(start[k], abs=0.05 * peak), net
        first = np.interp(1e-8, waves.time, waves.signals[net])
        assert first == pytest.approx(start[k], abs=0.03 * peak), f"{net} does not start there"


def test_a_rung_without_figures() -> None:
    bare = replace(CIRCUIT, figures=None)
    with pytest.raises(ValueError, match="figures"):
        deck.write(
            bare, nominal_board(bare), Excitation(400.0, 1.0), SolverSettings("trap", 1e-6),
            title="t", stop_time=1e-3, rung="dynamic",
        )  # fmt: skip
