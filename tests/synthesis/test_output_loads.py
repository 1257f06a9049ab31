"""Peak outputs of the op-amps: against transfer functions, plain sampling and ngspice."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus, failed
from designer.dynamics.piecewise_linear import Drive
from designer.spice import deck
from designer.spice.deck import SolverSettings
from designer.spice.worker import open_simulator
from designer.synthesis import output_loads
from designer.synthesis.output_loads import Loads, Run
from tests.circuit.test_reduction import EXACT, circuit_of
from tests.shared.oracles import linear_matrix

SECONDS = float(np.sqrt(1e-4 * 36e3 * 100e-9))
"""Of a unit of model time in the E24 network: sqrt(R1 C1 R4 C2)."""


def drive_at(omega: float, volts: float = 0.6) -> Drive:
    return Drive(omega / SECONDS, -volts)


def test_linear_circuit_by_its_transfer_functions() -> None:
    """Amplitudes of v1 … v4 from Eq. (12), and the currents that leave into what hangs on them."""
    circuit = circuit_of(EXACT, stops=False)
    reduction = Reduction(circuit, nominal_board(circuit, ideal=True))
    omega = 0.8 / SECONDS
    into = np.array([0.0, -1.0 / (EXACT["R6"] * EXACT["C2"]), 0.0, 0.0])
    X = np.linalg.solve(1j * omega * np.eye(4) - linear_matrix(EXACT), 0.4 * into)
    run = Run("0.8", Drive(omega, 0.4), np.imag(X), 1)
    found = output_loads.over(reduction, [run])
    for section, state in {"U1A": 0, "U2C": 1, "U1C": 2, "U2D": 3, "U2A": 0, "U1B": 1}.items():
        load = found.of(section)
        assert load.high == pytest.approx(abs(X[state]), rel=1e-7)
        assert load.low == pytest.approx(-abs(X[state]), rel=1e-7)
        assert (load.low_in, load.high_in, load.current_in) == ("0.8", "0.8", "0.8")
    G = {name: 1.0 / ohms for name, ohms in EXACT.items() if name[0] == "R"}
    # v1 drives R4, its inverter's R100 and C1; its inverse drives R101 and R10.
    integrator = abs(X[0]) * abs(G["R4"] + G["R100"] + 1j * omega * EXACT["C1"])
    assert found.of("U1A").current == pytest.approx(integrator, rel=1e-7)
    assert found.of("U2A").current == pytest.approx(abs(X[0]) * (G["R101"] + G["R10"]), rel=1e-7)
    # v4 drives R9, R106 and C4; its inverse R107, R3 and R7.
    integrator = abs(X[3]) * abs(G["R9"] + G["R106"] + 1j * omega * EXACT["C4"])
    assert found.of("U2D").current == pytest.approx(integrator, rel=1e-7)
    inverse = abs(X[3]) * (G["R107"] + G["R3"] + G["R7"])
    assert found.of("U1D").current == pytest.approx(inverse, rel=1e-7)
    assert found.of("U1D").peak == pytest.approx(abs(X[3]), rel=1e-7)


def uneven(values: Mapping[str, float] = EXACT) -> Board:
    """A board whose op-amps have offsets and rails of their own."""
    circuit = circuit_of(values)
    rng = np.random.default_rng(5)
    return Board(
        circuit.values,
        {s.name: float(rng.normal(0.0, 2e-3)) for s in circuit.sections},
        {
            s.name: (-float(rng.uniform(12, 14)), float(rng.uniform(12, 14)))
            for s in circuit.sections
        },
        1e-5,
        {s.name: 65e-12 for s in circuit.sections},
    )


def wanted(reduction: Reduction, omega: float) -> list[Run]:
    drive = drive_at(omega)
    orbit = settle(Flow(reduction.system(), drive), np.zeros(4))
    assert orbit.status is OrbitStatus.PERIODIC
    assert orbit.p + orbit.q > 1
    runs, left_out = output_loads.runs([omega], [drive], [orbit])
    assert not left_out
    return runs


def figures(found: Loads) -> Array:
    return np.array([[load.low, load.high, load.current] for load in found.sections])


@pytest.mark.parametrize("omega", [1.55, 0.85])
def test_finer_strobes_do_not_change_the_extremes(
    omega: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    reduction = Reduction(circuit_of(EXACT), uneven())
    runs = wanted(reduction, omega)
    found = figures(output_loads.over(reduction, runs))
    scale = np.abs(found).max(axis=0)
    monkeypatch.setattr(output_loads, "RESOLUTION", output_loads.RESOLUTION / 16)
    monkeypatch.setattr(output_loads, "MOST_POINTS", 10**7)
    change = np.abs(figures(output_loads.over(reduction, runs)) - found).max(axis=0)
    assert (change / scale).max() < 1e-5
    # Strobes alone, nothing between them: never beyond, and close behind.
    monkeypatch.setattr(output_loads, "ROUNDS", 0)
    plain = figures(output_loads.over(reduction, runs))
    behind = np.stack([plain[:, 0] - found[:, 0], found[:, 1] - plain[:, 1]])
    assert behind.min() > -1e-6 * scale[1]
    assert behind.max() < 1e-3 * scale[1]
    assert (found[:, 2] - plain[:, 2]).min() > -1e-6 * scale[2]


def test_runs_together_have_the_extremes_of_each() -> None:
    """A peak well inside that of a run before it is not refined, in whichever order they come."""
    reduction = Reduction(circuit_of(EXACT), uneven())
    runs = [*wanted(reduction, 1.55), *wanted(reduction, 0.85)]
    each = np.array([figures(output_loads.over(reduction, [run])) for run in runs])
    lowest, highest = each.min(axis=0), each.max(axis=0)
    for some in (runs, runs[::-1]):
        found = figures(output_loads.over(reduction, some))
        np.testing.assert_array_equal(found, np.column_stack([lowest[:, 0], highest[:, 1:]]))


def test_a_section_at_its_limit_shows_its_rail() -> None:
    board = uneven()
    reduction = Reduction(circuit_of(EXACT), board)
    found = output_loads.over(reduction, wanted(reduction, 1.55)).of("U3C")
    assert (found.low, found.high) == pytest.approx(board.rails["U3C"], rel=1e-9)


def test_ngspice_s_waveforms_have_these_peaks() -> None:
    """The voltages of every output, and two currents put together from voltages."""
    circuit = circuit_of(EXACT)
    board = nominal_board(circuit)
    reduction = Reduction(circuit, board)
    orbit_run = wanted(reduction, 0.85)[0]
    found = output_loads.over(reduction, [orbit_run])
    drive = orbit_run.drive
    period, nets = drive.period, [s.output for s in circuit.sections]
    text = deck.write(
        circuit,
        board,
        Excitation(drive.omega / (2 * np.pi), -drive.amplitude),
        SolverSettings("trap", period / 4000, 1e-5),
        title="peaks",
        stop_time=3 * period,
        initial=orbit_run.start,
    )
    extra = ["d4", "s2", "i1", "s4"]
    saved = " ".join(f"v({net})" for net in dict.fromkeys([*nets, *extra, "vg"]))
    lines = [f".save {saved}" if x.startswith(".save") else x for x in text.splitlines()]
    waves = open_simulator().run("\n".join(lines) + "\n", [*nets, *extra], 3 * period).signals
    for s in circuit.sections:
        load, wave = found.of(s.name), waves[s.output]
        assert wave.max() == pytest.approx(load.high, abs=1e-2 * load.peak)
        assert wave.min() == pytest.approx(load.low, abs=1e-2 * load.peak)
    at_fv = (waves["fv"] - waves["d4"]) / EXACT["R210"] + (waves["fv"] - waves["s2"]) / EXACT["R50"]
    assert np.abs(at_fv).max() == pytest.approx(found.of("U3D").current, rel=1e-2)
    at_v1n = (waves["v1n"] - waves["i1"]) / EXACT["R101"]
    at_v1n += (waves["v1n"] - waves["s4"]) / EXACT["R10"]
    assert np.abs(at_v1n).max() == pytest.approx(found.of("U2A").current, rel=1e-2)


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6))
def test_modes_of_many_states_are_those_of_each(seed: int) -> None:
    rng = np.random.default_rng(seed)
    reduction = Reduction(circuit_of(EXACT), uneven())
    system = reduction.system()
    x = rng.uniform(-9.0, 9.0, (12, 4)) * rng.choice([0.01, 0.1, 1.0], (12, 1))
    angle = rng.uniform(-3.0, 3.0, 12)
    flow, keys = Flow(system, Drive(1.0, 3.0)), [system.start]
    at = output_loads.modes_at(flow, x, angle, keys)
    wanted = [system.mode_at(a, 3.0 * float(np.sin(b))) for a, b in zip(x, angle, strict=True)]
    assert [keys[i] for i in at] == wanted


def test_kirchhoff_holds_at_every_output() -> None:
    """What an output gives is what its resistors and capacitors take, in an odd mode too."""
    circuit = circuit_of(EXACT)
    reduction = Reduction(circuit, uneven())
    index = [s.name for s in circuit.sections].index("U3C")
    start = reduction.system().start
    for key in (start, (*start[:index], 1, *start[index + 1 :])):
        solved = reduction.solution(key)
        for s in circuit.sections:
            taken = np.zeros(6)
            for r in circuit.resistors:
                for here, there in ((r.a, r.b), (r.b, r.a)):
                    if here == s.output:
                        taken += (solved.voltage[here] - solved.voltage[there]) / r.value
            for c in circuit.capacitors:
                taken += (c.plus == s.output) * solved.current[c.name]
            assert solved.output[s.name] == pytest.approx(taken, rel=1e-9, abs=1e-12)


def test_what_has_no_orbit_is_left_out_and_said() -> None:
    reduction = Reduction(circuit_of(EXACT), uneven())
    drive = drive_at(1.55)
    lost = Orbit(OrbitStatus.APERIODIC, start=np.zeros(4), mode=reduction.system().start)
    runs, left_out = output_loads.runs(
        [1.55, 1.55, 0.2], [drive] * 3, [failed("no answer"), lost, lost]
    )
    assert left_out == {"1.55": "no answer"}
    assert [r.name for r in runs] == ["1.55 (2)", "1.55 (2) from rest", "0.2", "0.2 from rest"]
    assert [r.periods for r in runs] == [output_loads.UNSETTLED, output_loads.REST] * 2
    nothing = output_loads.over(reduction, [], left_out)
    assert nothing == Loads((), left_out)
    with pytest.raises(KeyError):
        nothing.of("U1A")
    with pytest.raises(InputError, match="periods"):
        output_loads.over(reduction, [Run("none", drive, np.zeros(4), 0)])
