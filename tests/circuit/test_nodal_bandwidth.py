"""Op-amps that lag by their bandwidth, in the exact circuit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Capacitor, Circuit, Part, Resistor, Section
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.spread.spread import Spread, draw_many
from tests.circuit.test_reduction import EXACT, OPAMP, circuit_of, small

GBW = 2.0 * np.pi * OPAMP.gbw.nominal


BESIDE = 0.4e-9
"""Farad from y to the summing node, where there is one: x' = -ratio x/((1 + 0.4 ratio) RC)."""


def amplifiers(ratio: float, beside: float = 0.0) -> Circuit:
    """An integrator (1 MΩ, 1 nF) of an inverter of its own output: x' = -ratio x/RC. beside : a
    capacitor [F] beside its input resistor."""
    parts: list[Part] = [
        Section("U1A", "s", "0", "x", "integrator"),
        Capacitor("C1", "x", "s", 1e-9, "integrator"),
        Resistor("R1", "y", "s", 1e6, "input"),
        Section("U1B", "i", "0", "z", "inverter"),
        Resistor("R2", "x", "i", 10e3, "inverter"),
        Resistor("R3", "i", "z", 10e3 * ratio, "inverter"),
        Section("U1C", "j", "0", "y", "inverter"),
        Resistor("R4", "z", "j", 10e3, "inverter"),
        Resistor("R5", "j", "y", 10e3, "inverter"),
        Resistor("R6", "in", "s", 1e9, "drive"),
        *([Capacitor("C50", "y", "s", beside, "damper")] if beside else []),
    ]
    return replace(small(parts, ("C1",)), figures=OPAMP)


@pytest.mark.parametrize("beside", [0.0, BESIDE])
@pytest.mark.parametrize("ratio", [0.5, 5.0])
def test_the_rate_is_the_slow_pole_of_one_pole_op_amps(ratio: float, beside: float) -> None:
    """Against the full order: each op-amp w' = 2 pi GBW (v+ - v-), an output resistance behind w.

    The error is of second order: with a tenth of the bandwidth it is a hundred times as large."""
    errors = []
    for slower in (1.0, 10.0):
        circuit = amplifiers(ratio, beside)
        names = [s.name for s in circuit.sections]
        board = replace(
            nominal_board(circuit, ideal=True),
            gain_bandwidth=dict.fromkeys(names, OPAMP.gbw.nominal / slower),
        )
        system = Reduction(circuit, board, bandwidth=True).system()
        rate = float(system.mode(system.start).A[0, 0])
        poles = np.linalg.eigvals(full_order(ratio, GBW / slower, beside))
        exact = float(poles[np.abs(poles).argmin()].real)
        static = -ratio / (1.0 + ratio * beside / 1e-9) / 1e-3
        assert abs(rate - exact) < 0.1 * abs(static - exact)
        errors.append(abs(rate / exact - 1.0))
    assert errors[1] == pytest.approx(100.0 * errors[0], rel=0.3)


def full_order(ratio: float, gbw: float, beside: float = 0.0) -> np.ndarray:
    """(4, 4) of (vC, wA, wB, wC): node voltages by Kirchhoff, then each op-amp's own equation. With
    the capacitor beside the input resistor, whose voltage is a state here, (5, 5)."""
    nets = {name: i for i, name in enumerate("xsyziJ")}
    rout = OPAMP.output_resistance.nominal
    size = 7 + bool(beside)
    G, right = np.zeros((size, size)), np.zeros((size, size - 3))

    def wire(a: str, b: str | None, ohms: float) -> None:
        for here, there in ((a, b), (b, a)):
            if here is not None:
                G[nets[here], nets[here]] += 1.0 / ohms
                if there is not None:
                    G[nets[here], nets[there]] -= 1.0 / ohms

    wire("y", "s", 1e6)
    wire("x", "i", 10e3)
    wire("i", "z", 10e3 * ratio)
    wire("z", "J", 10e3)
    wire("J", "y", 10e3)
    wire("s", None, 1e9)
    for net, state in (("x", 1), ("z", 2), ("y", 3)):
        G[nets[net], nets[net]] += 1.0 / rout
        right[nets[net], state] += 1.0 / rout
    # The capacitor's voltage x - s is a state; its current is the seventh unknown.
    G[nets["x"], 6] += 1.0
    G[nets["s"], 6] -= 1.0
    G[6, nets["x"]], G[6, nets["s"]], right[6, 0] = 1.0, -1.0, 1.0
    if beside:
        G[nets["y"], 7] += 1.0
        G[nets["s"], 7] -= 1.0
        G[7, nets["y"]], G[7, nets["s"]], right[7, 4] = 1.0, -1.0, 1.0
    y = np.linalg.solve(G, right)
    rates = [y[6] / 1e-9, *(-gbw * y[nets[node]] for node in "siJ")]
    return np.array([*rates, y[7] / beside] if beside else rates)


def test_boards_together_are_each_alone_and_share_their_modes_ends() -> None:
    """The batch of drawn boards against the reduction of each; and a limit is left where it is
    reached, to second order of a lag of 4 % here, so that every state has a mode."""
    circuit = circuit_of(EXACT | {"R203": 62e3, "R202": 1e3})
    drawn = draw_many(circuit, Spread(0.01, 0.01, 3e-3, 1e-2), 1, range(4))
    drawn = replace(drawn, bandwidth=True)
    drive = Drive(2.0 * np.pi * 250.0, 0.5)
    start = np.zeros(4)
    many = Ensemble(drawn).settle(range(4), [drive] * 4, np.array([start] * 4))
    for k, orbit in enumerate(many):
        system = Reduction(circuit, drawn.board(k), bandwidth=True).system()
        alone = settle(Flow(system, drive, fast=False), start)
        assert orbit.response == alone.response
        np.testing.assert_allclose(orbit.start, alone.start, rtol=0.0, atol=1e-9)
        rest = system.mode(system.start)
        for way in rest.guards:
            if way.clearance < 0:
                continue
            back = next(g for g in system.mode(way.target).guards if g.target == system.start)
            there = np.array([*way.C, way.D, way.e]), -np.array([*back.C, back.D, back.e])
            np.testing.assert_allclose(*there, rtol=0.0, atol=1e-3)


def test_a_circuit_without_figures_has_no_bandwidth() -> None:
    circuit = replace(circuit_of(EXACT), figures=None)
    with pytest.raises(ValueError, match="figures"):
        Reduction(circuit, nominal_board(circuit), bandwidth=True).system().mode((0,) * 12)
