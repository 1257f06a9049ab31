"""Nodal reduction against formulas done by hand: op-amp stages, Eq. (12), Eq. (20), ngspice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.errors import InputError
from designer.catalog.parts_catalog import load_catalog
from designer.circuit import build
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.netlist import (
    Capacitor,
    Circuit,
    Excitation,
    Generator,
    Part,
    Resistor,
    Section,
)
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.model import Dimensionless
from designer.spice import deck
from designer.spice.deck import SolverSettings
from designer.spice.worker import open_simulator
from tests.shared.oracles import dead_zone_curve, dead_zone_gains, linear_matrix

OPAMP = load_catalog().opamp("TL074C")

# The exact E24 network for the paper's case, and a flat dead zone with the divider's load counted.
EXACT: dict[str, float] = {
    "R1": 100e3, "R2": 30e3, "R3": 30e3, "R4": 36e3, "R5": 36e3, "R6": 9.1e3,
    "R7": 100e3, "R8": 30e3, "R9": 15e3, "R10": 36e3, "R11": 18e3, "R12": 20e3,
    "C1": 1e-9, "C2": 100e-9, "C3": 1e-9, "C4": 100e-9,
    **{f"R{i}": 10e3 for i in range(100, 108)},
    "R50": 22e3,
    "R200": 10e3, "R201": 36e3, "R202": 10e3, "R203": 620e3, "R204": 16e3, "R205": 1.6e3,
    "R206": 10e3, "R207": 200e3, "R208": 100e3, "R209": 100e3, "R210": 100e3,
}  # fmt: skip


def circuit_of(
    values: Mapping[str, float], *, stops: bool = True, f20: float = 0.0, saturation: float = 13.0
) -> Circuit:
    """The two-mass circuit with these values."""
    model = Dimensionless(0.5, 0.5, 0.95 if stops else 0.0, 0.5, 0.1, f20, 0.25)
    return build.circuit_of(model, values, OPAMP, supply=15.0, saturation=saturation)


def small(parts: list[Part], states: tuple[str, ...] = ()) -> Circuit:
    """A test circuit with the generator at "in"."""
    return Circuit(
        tuple(parts), Generator("VM1", "in"), states, tuple("x" for _ in states), (),
        "ideal", 1e5, 0.0, 15.0, 13.0,
    )  # fmt: skip


@st.composite
def random_values(draw: st.DrawFn) -> dict[str, float]:
    seed = draw(st.integers(0, 10**6))
    rng = np.random.default_rng(seed)
    low = {"R": 1e3, "C": 1e-9}
    return {
        name: float(low[name[0]] * 10.0 ** rng.uniform(0.0, 3.0 if name[0] == "R" else 2.0))
        for name in EXACT
    }


@settings(max_examples=40)
@given(values=random_values(), f20=st.sampled_from([0.0, 0.4, 1.0]))
def test_ideal_reduction_is_eq_12(values: dict[str, float], f20: float) -> None:
    circuit = circuit_of(values, stops=False, f20=f20)
    mode = Reduction(circuit, nominal_board(circuit, ideal=True)).system().mode((0,) * 8)
    want = linear_matrix(values)
    assert np.abs(mode.A - want).max() <= 1e-10 * np.abs(want).max()
    assert (mode.A == 0.0).sum() >= 0
    drive = np.zeros(4)
    if f20 < 1.0:
        drive[1] = -1.0 / (values["R6"] * values["C2"])
    if f20 > 0.0:
        drive[3] = -1.0 / (values["R12"] * values["C4"])
    assert pytest.approx(drive, rel=1e-10, abs=1e-9) == mode.B
    assert mode.d == pytest.approx(np.zeros(4), abs=1e-9)


@settings(max_examples=40)
@given(values=random_values())
def test_open_and_contact_modes_are_eq_12_with_eq_20(values: dict[str, float]) -> None:
    """v1's coefficient in each mode: R4's, and the dead zone's slope through R50."""
    circuit = circuit_of(values)
    system = Reduction(circuit, nominal_board(circuit, ideal=True)).system()
    steep, slope, through = dead_zone_gains(values)
    base = linear_matrix(values)
    per = 1.0 / (values["R50"] * values["C2"])
    start = system.start
    index = [s.name for s in circuit.sections].index("U3C")
    for position, fv in ((0, slope - steep * through), (1, slope), (-1, slope)):
        key = (*start[:index], position, *start[index + 1 :])
        mode, want = system.mode(key), base.copy()
        want[1, 0] -= fv * per
        assert np.abs(mode.A - want).max() <= 1e-9 * np.abs(want).max()
        force = position * through * 13.0 * per
        assert mode.d[1] == pytest.approx(force, rel=1e-9, abs=1e-6)
        assert mode.sides == (position,)
        assert not mode.clipped
    # The clearance as the circuit has it: Esat/A+.
    guards = [g for g in system.mode(start).guards if g.clearance == 0]
    assert {g.target[index] for g in guards} == {1, -1}
    assert [-g.e for g in guards] == pytest.approx([13.0 / steep] * 2, rel=1e-9)
    assert sorted(g.C[0] for g in guards) == pytest.approx([-1.0, 1.0])


@settings(max_examples=60)
@given(values=random_values(), v1=st.floats(-11.9, 11.9), seed=st.integers(0, 1000))
def test_dead_zone_s_dc_curve_with_every_limit(
    values: dict[str, float], v1: float, seed: int
) -> None:
    """fv at v1, each of the four op-amps free to clip at limits of its own."""
    circuit = circuit_of(values)
    rng = np.random.default_rng(seed)
    rails = {
        s.name: (-float(rng.uniform(12, 14)), float(rng.uniform(12, 14))) for s in circuit.sections
    }
    board = Board(values, rails=rails)
    reduction = Reduction(circuit, board)
    system = reduction.system()
    x = np.array([v1, 0.0, 0.0, 0.0])
    # The summing node of U3D leaves 0 V where U3D clips: only the unclipped curve is closed form.
    want = dead_zone_curve(v1, values, rails)
    key = system.mode_at(x, 0.0)
    got = reduction.output(key, "fv", x[None, :], np.zeros(1))[0]
    assert got == pytest.approx(want, rel=1e-8, abs=1e-8)
    names = [s.name for s in circuit.sections]
    linear_sections = {"U1A", "U2C", "U1C", "U2D", "U2A", "U1B", "U2B", "U1D"}
    clipped = any(key[names.index(n)] for n in linear_sections)
    assert system.mode(key).clipped is clipped


def inverter(r1: float, r2: float) -> Circuit:
    return small(
        [
            Section("U1A", "n", "0", "out", "inverter"),
            Resistor("R1", "in", "n", r1, ""),
            Resistor("R2", "n", "out", r2, ""),
        ]
    )


ohms = st.floats(1e2, 1e7)


@given(r1=ohms, r2=ohms, gain=st.floats(1e2, 1e8))
def test_inverter_with_finite_gain(r1: float, r2: float, gain: float) -> None:
    circuit = inverter(r1, r2)
    board = Board(circuit.values, inverse_gain=1.0 / gain)
    row = Reduction(circuit, board).solution((0,)).voltage["out"]
    assert row[0] == pytest.approx(-(r2 / r1) / (1.0 + (1.0 + r2 / r1) / gain), rel=1e-9)


@given(r1=ohms, r2=ohms, offset=st.floats(-0.1, 0.1), bias=st.floats(-1e-6, 1e-6))
def test_inverter_s_offset_and_bias(r1: float, r2: float, offset: float, bias: float) -> None:
    """Vos (1 + R2/R1) and, a current into the input, + I R2."""
    circuit = inverter(r1, r2)
    board = Board(circuit.values, offset={"U1A": offset}, bias={"U1A": bias})
    row = Reduction(circuit, board).solution((0,)).voltage["out"]
    want = offset * (1.0 + r2 / r1) + bias * r2
    assert row[1] == pytest.approx(want, rel=1e-9, abs=1e-12 * (1 + r2 / r1))


@given(r1=ohms, r2=ohms, gain=st.floats(1e2, 1e8), offset=st.floats(-0.1, 0.1))
def test_non_inverting_amplifier(r1: float, r2: float, gain: float, offset: float) -> None:
    circuit = small(
        [
            Section("U1A", "n", "in", "out", ""),
            Resistor("R1", "0", "n", r1, ""),
            Resistor("R2", "n", "out", r2, ""),
        ]
    )
    board = Board(circuit.values, offset={"U1A": offset}, inverse_gain=1.0 / gain)
    row = Reduction(circuit, board).solution((0,)).voltage["out"]
    noise = 1.0 + r2 / r1
    want = noise / (1.0 + noise / gain)
    assert row == pytest.approx([want, want * offset], rel=1e-9, abs=1e-12)


@given(r=ohms, c=st.floats(1e-10, 1e-5), offset=st.floats(-0.1, 0.1), gain=st.floats(1e2, 1e9))
def test_integrator_with_offset_and_finite_gain(
    r: float, c: float, offset: float, gain: float
) -> None:
    """Capacitor from output to input; its voltage is the state."""
    circuit = small(
        [
            Section("U1A", "n", "0", "out", ""),
            Resistor("R1", "in", "n", r, ""),
            Capacitor("C1", "out", "n", c, ""),
        ],
        ("C1",),
    )
    rails = {"U1A": (-13.0, 13.0)}
    board = Board(circuit.values, {"U1A": offset}, rails, inverse_gain=1.0 / gain)
    mode = Reduction(circuit, board).system().mode((0,))
    # out = G (offset - n), x = out - n, so n = (G offset - x)/(1 + G); x' = -(u - n)/(R C).
    n_of_x, n_of_1 = -1.0 / (1.0 + gain), gain * offset / (1.0 + gain)
    assert mode.A[0, 0] * r * c == pytest.approx(n_of_x, rel=1e-6, abs=1e-12)
    assert mode.B[0] * r * c == pytest.approx(-1.0, rel=1e-9)
    assert mode.d[0] * r * c == pytest.approx(n_of_1, rel=1e-9, abs=1e-12)


def test_a_saturated_section_holds_its_rail_and_lets_go() -> None:
    load: list[Part] = [Resistor("R3", "in", "x", 1e3, ""), Capacitor("C1", "x", "0", 1e-9, "")]
    circuit = small([*inverter(1e3, 10e3).parts, *load], ("C1",))
    board = Board(circuit.values, rails={"U1A": (-12.0, 13.0)}, offset={"U1A": 0.01})
    reduction = Reduction(circuit, board)
    system = reduction.system()
    for u, want in ((-5.0, 13.0), (-1.0, 10.11), (0.5, -4.89), (3.0, -12.0)):
        key = system.mode_at(np.zeros(1), u)
        got = reduction.output(key, "out", np.zeros((1, 1)), np.array([u]))[0]
        assert got == pytest.approx(want, rel=1e-9)
        assert system.mode(key).clipped is (abs(want) in (12.0, 13.0))


FLOATING: dict[str, list[Part]] = {
    "one resistor": [Resistor("R1", "a", "b", 1e3, "")],
    "triangle": [
        Resistor("R1", "a", "b", 1.1e3, ""),
        Resistor("R2", "b", "c", 2.7e3, ""),
        Resistor("R3", "c", "a", 3.3e3, ""),
    ],
    "no feedback": [Section("U1A", "n", "0", "out", ""), Resistor("R1", "in", "n", 1e3, "")],
    "shorted capacitors": [
        Capacitor("C1", "a", "0", 1e-9, ""),
        Capacitor("C2", "a", "0", 1e-9, ""),
    ],
}


@pytest.mark.parametrize("name", ["one resistor", "no feedback", "shorted capacitors"])
def test_singular_circuits_are_refused(name: str) -> None:
    parts = FLOATING[name]
    states = tuple(p.name for p in parts if isinstance(p, Capacitor))
    circuit = small([*parts, Resistor("R9", "in", "0", 1e3, "")], states)
    board = nominal_board(circuit, ideal=True)
    with pytest.raises(FloatingCircuit):
        Reduction(circuit, board).system().mode((0,) * len(circuit.sections))


def test_singular_circuits_are_refused_whatever_the_rounding() -> None:
    """A floating mesh of resistors: the pivot that ought to be zero is often only rounding."""
    rng = np.random.default_rng(0)
    missed = []
    for _ in range(50):
        r = [float(v) for v in rng.uniform(1e3, 1e5, 3)]
        mesh: list[Part] = [
            Resistor("R1", "a", "b", r[0], ""),
            Resistor("R2", "b", "c", r[1], ""),
            Resistor("R3", "c", "a", r[2], ""),
            Resistor("R9", "in", "0", 1e3, ""),
        ]
        circuit = small(mesh)
        try:
            Reduction(circuit, nominal_board(circuit)).solution(())
        except FloatingCircuit:
            continue
        missed.append(r)
    assert not missed


def test_references_are_used_once() -> None:
    with pytest.raises(InputError, match="R1"):
        small([Resistor("R1", "in", "0", 1e3, ""), Resistor("R1", "in", "0", 2e3, "")])


@settings(max_examples=60)
@given(seed=st.integers(0, 10**6))
def test_mode_at_from_anywhere(seed: int) -> None:
    """Whatever mode the walk starts in, it ends in one that holds, and the outputs agree."""
    rng = np.random.default_rng(seed)
    circuit = circuit_of(EXACT, f20=0.0)
    board = replace(
        nominal_board(circuit),
        offset={s.name: float(rng.normal(0, 3e-3)) for s in circuit.sections},
        rails={
            s.name: (-float(rng.uniform(12, 14)), float(rng.uniform(12, 14)))
            for s in circuit.sections
        },
    )
    reduction = Reduction(circuit, board)
    system = reduction.system()
    x = rng.uniform(-12.0, 12.0, 4) * rng.choice([0.01, 0.1, 1.0])
    u = float(rng.uniform(-5, 5))
    found = set()
    limiting = [i for i, s in enumerate(circuit.sections) if s.limits]
    for _ in range(6):
        near = [0] * len(circuit.sections)
        for i in limiting:
            near[i] = int(rng.integers(-1, 2))
        try:
            system.mode(tuple(near))
        except FloatingCircuit:
            continue
        key = system.mode_at(x, u, tuple(near))
        assert all(g.C @ x + g.D * u + g.e <= 0.0 for g in system.mode(key).guards)
        found.add(key)
    assert len(found) == 1


def test_vector_field_is_continuous_across_every_boundary() -> None:
    """Springs and limiters are: the saltation matrix is the identity."""
    rng = np.random.default_rng(3)
    circuit = circuit_of(EXACT)
    board = replace(
        nominal_board(circuit),
        offset={s.name: float(rng.normal(0, 3e-3)) for s in circuit.sections},
    )
    system = Reduction(circuit, board).system()
    seen = 0
    for key in [system.start, *(g.target for g in system.mode(system.start).guards)]:
        mode = system.mode(key)
        for g in mode.guards:
            if not np.abs(g.C).any():
                continue
            x = rng.standard_normal(4)
            x -= g.C * (g.C @ x + g.e) / (g.C @ g.C)  # on the boundary, at u = 0
            there = system.mode(g.target)
            back = [h for h in there.guards if h.target == key]
            assert len(back) == 1
            here = mode.A @ x + mode.d
            other = there.A @ x + there.d
            assert other == pytest.approx(here, rel=1e-6, abs=1e-6 * np.abs(here).max())
            assert back[0].C @ x + back[0].e == pytest.approx(0.0, abs=1e-9 * np.abs(x).max())
            seen += 1
    assert seen > 20


def test_mirror_only_for_symmetric_boards() -> None:
    circuit = circuit_of(EXACT)
    even = nominal_board(circuit, ideal=True)
    assert Reduction(circuit, even).system().mirror is not None
    for other in (
        replace(even, offset={**even.offset, "U3A": 1e-3}),
        replace(even, bias={"U1A": 1e-12}),
        replace(even, rails={**even.rails, "U1A": (-13.0, 13.5)}),
    ):
        assert Reduction(circuit, other).system().mirror is None


def test_boards_with_everything_agree_with_ngspice() -> None:
    """Offsets, unequal rails, finite gain, bias, spread: ngspice's waveforms over three periods."""
    rng = np.random.default_rng(5)
    circuit = circuit_of(EXACT)
    board = Board(
        values={n: v * float(rng.uniform(0.99, 1.01)) for n, v in circuit.values.items()},
        offset={s.name: float(rng.normal(0, 5e-3)) for s in circuit.sections},
        rails={
            s.name: (-float(rng.uniform(12, 14)), float(rng.uniform(12, 14)))
            for s in circuit.sections
        },
        inverse_gain=1e-3,  # far below any part's, so that its effect is seen
        bias={s.name: 1e-7 for s in circuit.sections},
    )
    system = Reduction(circuit, board).system()
    frequency, amplitude = 400.0, 1.2
    start = np.array([0.02, -0.03, 0.01, 0.02])
    flow = Flow(system, Drive(2 * np.pi * frequency, -amplitude))
    points = 50
    want = flow.run(start, 3, points=points).strobes
    text = deck.write(
        circuit, board, Excitation(frequency, amplitude), SolverSettings("trap", 2e-6, 1e-5),
        title="everything", stop_time=3 / frequency, initial=start,
    )  # fmt: skip
    nets = circuit.state_nets
    waves = open_simulator("shared").run(text, nets, 3 / frequency)
    grid = np.arange(len(want)) / frequency / points
    y = np.stack([np.interp(grid, waves.axis, waves.signals[n]) for n in nets], axis=1)
    # Output nets against capacitor voltages: they differ by the summing node, out/gain - offset.
    reduction = Reduction(circuit, board)
    outs = np.stack(
        [
            reduction.output(
                system.start, n, want, -amplitude * np.sin(2 * np.pi * frequency * grid)
            )
            for n in nets
        ],
        axis=1,
    )
    peak = np.abs(outs).max(axis=0)
    assert (np.abs(y - outs)[2:].max(axis=0) / peak).max() < 5e-3
