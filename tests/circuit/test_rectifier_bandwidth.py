"""A rectifier whose op-amp has a bandwidth, against the stiff equations of every node."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer.catalog.diode_curve import DiodeModel, diode_model
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Capacitor, Circuit, Diode, Excitation, Part, Resistor, Section
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.worker import open_simulator
from designer.spread.spread import draw_many
from tests.circuit.test_reduction import OPAMP, small
from tests.shared.stages import stage
from tests.spice.test_rectifier_ngspice import BENCH, SCALED, subject

POLE = 2.0 * np.pi * OPAMP.gbw.nominal
PERIOD, POINTS = 4e-3, 2**15
DIODE = diode_model(load_catalog().diode("1N4148"))


def half(model: DiodeModel) -> Circuit:
    """One half of a rectifier behind an RC low-pass, its contact where x falls below 0 V."""
    parts: list[Part] = [
        Resistor("R1", "in", "x", 1e3, "drive"),
        Capacitor("C1", "x", "0", 100e-9, "drive"),
        Section("U1A", "d", "0", "w", "half"),
        Resistor("R200", "x", "d", 50e3, "half"),
        Resistor("R202", "d", "fv", 100e3, "half"),
        Resistor("R50", "fv", "0", 10e3, "load"),
        Diode("D200", "w", "fv", model, False, "half"),
        Diode("D201", "d", "w", model, True, "half"),
    ]
    return replace(small(parts, ("C1",)), figures=OPAMP)


def stiff(model: DiodeModel, drop: float, amplitude: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and w, the output of a one-pole op-amp behind its output resistance, over the first
    half period: states x, w and both diodes' voltages, each diode C beside a drop and 1 ohm."""
    rout, C = OPAMP.output_resistance.nominal, model.capacitance

    def rates(t: float, s: np.ndarray) -> list[float]:
        x, w, a, b = s

        # KCL at d and fv gives both diodes' currents by the output's voltage v, which KCL at v has.
        def residue(v: float) -> tuple[float, float, float]:
            d, fv = v + b, v - a
            through = (x - d) / 50e3 + (fv - d) / 100e3
            out = fv / 10e3 + (fv - d) / 100e3
            return (w - v) / rout + through - out, out, through

        low, high = residue(0.0)[0], residue(1.0)[0]
        v = low / (low - high)
        _, ia, ib = residue(v)
        conducts = [max((u - drop) / model.resistance, 0.0) for u in (a, b)]
        u = amplitude * np.sin(2.0 * np.pi * t / PERIOD)
        return [
            ((u - x) / 1e3 - (x - v - b) / 50e3) / 100e-9,
            -POLE * (v + b),
            (ia - conducts[0]) / C,
            (ib - conducts[1]) / C,
        ]

    begin = [0.5, -drop, -drop, drop]
    run = solve_ivp(rates, (0.0, 4e-4), begin, method="Radau", rtol=1e-7, atol=1e-8, max_step=2e-7)
    return run.t, run.y[1]


@pytest.mark.parametrize("capacitance", [4e-14, 4e-12])
def test_the_output_crosses_between_its_diodes_as_the_nodes_say(capacitance: float) -> None:
    """From one diode's drop to the other's, 10 µs: within 3 % of the stiff equations, of which
    what the output resistance and the clamp's own bend leave is first order."""
    circuit = half(replace(DIODE, capacitance=capacitance))
    board = replace(nominal_board(circuit, ideal=True), drop={"D200": 0.6, "D201": 0.6})
    reduction = Reduction(circuit, board, bandwidth=True)
    system, drive = reduction.system(), Drive(2.0 * np.pi / PERIOD, -4.0)
    assert system.states == ("C1", "w")
    run = Flow(system, drive, fast=False).run(np.array([0.5, -0.6]), 1, points=POINTS)
    x, w = run.strobes[: POINTS // 10].T
    t = np.arange(len(w)) * PERIOD / POINTS
    times, output = stiff(replace(DIODE, capacitance=capacitance), 0.6, -4.0)
    begin = float(np.interp(0.0, -x, t))
    for level in (0.0, 0.5):
        mine = t[np.argmax(w > level)] - begin
        theirs = times[np.argmax(output > level)] - begin
        assert mine == pytest.approx(theirs, rel=0.03)
        assert mine > 3e-6


def test_a_diode_that_is_off_is_charged_through_the_resistors() -> None:
    """Kirchhoff's law at the summing node of a contact: what its resistors bring charges D201, over
    which w, which is -2 x but for D200's drop, moves twice as fast as x."""
    capacitance = DIODE.capacitance_at(2.0)
    circuit = half(DIODE)
    reduction = Reduction(circuit, nominal_board(circuit, ideal=True), bandwidth=True)
    volts = reduction.solution(tuple(int(s == "D200") for s in circuit.switches)).voltage
    brought = (volts["x"] - volts["d"]) / 50e3 + (volts["fv"] - volts["d"]) / 100e3
    rate = np.array([-(1.0 / 1e3 + 1.0 / 50e3), 0.0, 1.0 / 1e3, 0.0]) / 100e-9
    wanted = 2.0 * capacitance * rate  # over x, w, the generator and 1
    np.testing.assert_allclose(brought, wanted, rtol=0.02, atol=0.02 * np.abs(wanted).max())


def test_op_amps_of_finite_bandwidth_in_ngspice_show_the_waveform() -> None:
    """``dynamic`` at ω = 1.55 from the orbit with bandwidth: five times nearer than without."""
    circuit = replace(stage("rectifier", "both", SCALED), figures=OPAMP)
    asked = subject(circuit, nominal_board(circuit), "both", 1.55)
    lagging = Reduction(circuit, asked.board, bandwidth=True)
    flow = Flow(lagging.system(), asked.excitation.drive)
    orbit = settle(flow, lagging.state(asked.orbit.start))
    assert (orbit.response, orbit.symmetric) == ("1-1-1", True)
    slow = replace(asked, fidelity="dynamic", start=orbit.start[:4], discard=6)
    job = numerics_gate.job(slow, SolverSettings("trap", asked.period / 2000, 1e-6), keep=True)
    found = job.reduce(open_simulator("shared").run(job.netlist, job.signals, job.stop))
    assert found.trace is not None
    time, states = found.trace
    points = 200
    grid = time[-1] * np.arange(points) / points
    wave = np.interp(grid, time, states[:, 0])
    errors = [_error(wave, f, o, points) for f, o in ((flow, orbit), (_flow(asked), asked.orbit))]
    assert errors[0] < 1e-3
    assert errors[0] < 0.2 * errors[1]


def _flow(asked: GateSubject) -> Flow:
    return Flow(asked.system, asked.excitation.drive)


def _error(wave: np.ndarray, flow: Flow, orbit: object, points: int) -> float:
    run = flow.run(orbit.start, 1, points=points).strobes[:-1, 0]  # type: ignore[attr-defined]
    return float(np.sqrt(np.mean((wave - run) ** 2)) / np.abs(run).max())


def test_boards_of_a_rectifier_settle_one_by_one_from_capacitor_voltages() -> None:
    circuit = replace(stage("rectifier", "both", SCALED), figures=OPAMP)
    asked = subject(circuit, nominal_board(circuit), "both", 0.54)
    boards = Ensemble(replace(draw_many(circuit, BENCH, 1, range(2)), bandwidth=True))
    drive = asked.excitation.drive
    start = asked.orbit.start
    for k, orbit in enumerate(boards.settle([0, 1], [drive] * 2, np.array([start] * 2))):
        system = boards.reduction(k).system()
        assert (orbit.status, orbit.response) == (OrbitStatus.PERIODIC, "1-3-3")
        assert system.mirror is None
        run = Flow(system, drive, fast=False).run(orbit.start, 1, tangent=np.eye(6))
        np.testing.assert_allclose(run.strobes[-1], orbit.start, rtol=0.0, atol=1e-8)
        assert run.tangent is not None
        steps = [
            Flow(system, drive).run(orbit.start + 1e-6 * e, 1).strobes[-1] for e in np.eye(6)[:4]
        ]
        slopes = (np.array(steps) - run.strobes[-1]).T / 1e-6
        np.testing.assert_allclose(run.tangent[:, :4], slopes, rtol=0.0, atol=1e-3)


def test_two_alike_halves_are_each_other_s_mirror() -> None:
    circuit = replace(stage("rectifier", "both", SCALED), figures=OPAMP)
    system = Reduction(circuit, nominal_board(circuit, ideal=True), bandwidth=True).system()
    assert system.mirror is not None
    flow = Flow(system, Excitation(400.0, 2.0).drive)
    x = np.array([1.0, 0.5, -0.3, 0.2, -3.0, 2.0])
    there = flow.run(x, 1, points=2).strobes
    image = flow.run(system.mirror @ there[1], 1, points=2).strobes
    np.testing.assert_allclose(image[1], system.mirror @ there[2], rtol=0.0, atol=1e-9)
