"""The deck: literal, one element a line, safe, and the same circuit as the exact reduction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.arrays import Array
from designer.catalog.netlist_guard import check_netlist
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.spice import deck
from designer.spice.deck import SolverSettings, title_line
from designer.spice.opamp_model import literal
from designer.spice.simulator import Waveforms
from designer.spice.worker import open_simulator
from designer.spread.spread import Spread, draw
from tests.circuit.test_reduction import EXACT, circuit_of

CIRCUIT = circuit_of(EXACT)
SETTINGS = SolverSettings("trap", 2e-6)


def text_of(board: Board | None = None, **changes: object) -> str:
    arguments: dict[str, object] = {"title": "a title", "stop_time": 1e-2, **changes}
    return deck.write(
        CIRCUIT, board or nominal_board(CIRCUIT), Excitation(400.0, 1.2), SETTINGS,
        **arguments,  # type: ignore[arg-type]
    )  # fmt: skip


def test_one_element_a_line_and_nothing_else() -> None:
    text = text_of()
    check_netlist(text)
    lines = text.splitlines()
    assert text.endswith(".end\n")
    assert not any(line.startswith("+") for line in lines)
    names = [line.split()[0] for line in lines if line[0].isalpha()]
    inside = {"Voffset", "Ibiasp", "Ibiasn", "Alimit"}
    want = [r.name for r in CIRCUIT.resistors] + [c.name for c in CIRCUIT.capacitors]
    want += [f"X{s.name}" for s in CIRCUIT.sections]
    assert sorted(n for n in names if n not in inside) == sorted([*want, "VM1"])
    assert ".ic" not in text.lower()
    assert text.count("IC=") == len(CIRCUIT.capacitors)


@settings(max_examples=200)
@given(title=st.text())
def test_any_title_is_one_safe_line(title: str) -> None:
    line = title_line(title)
    assert "\n" not in line
    assert line.isascii()
    assert line.isprintable()
    assert len(line) <= 122
    assert line.startswith("* ")
    assert len(line) > 2
    check_netlist(f"{line}\nR1 a 0 1\n.end\n")


@pytest.mark.parametrize(
    "title",
    ["", "#shell rm -rf", "*#quit", "\x00\n.include /etc/passwd", "μ×Ω", ".title",
     "a\r\n.end\nR9 b 0 1", "+ more", "x" * 500, "$HOME `id` \\"],
)  # fmt: skip
def test_hostile_titles(title: str) -> None:
    text = text_of(title=title)
    check_netlist(text)
    assert text.count("\n.end\n") == 1
    assert len(text.splitlines()) == len(text_of().splitlines())


@pytest.mark.parametrize("title", ["ng_script", "NG_ and more", "#ng_x"])
def test_titles_that_ngspice_takes_for_a_command(title: str) -> None:
    check_netlist(text_of(title=title))


@settings(max_examples=50)
@given(seed=st.integers(0, 10**6))
def test_numbers_round_trip_exactly(seed: int) -> None:
    rng = np.random.default_rng(seed)
    board = draw(CIRCUIT, Spread(0.01, 0.05, 3e-3, 10e-3), seed, 0)
    initial = rng.standard_normal(4)
    for line in text_of(board, initial=initial).splitlines():
        word = line.split()
        if word[0] in board.values:
            assert float(word[3]) == board.values[word[0]]
        if word[0] in CIRCUIT.states:
            assert word[4].startswith("IC=")
            assert float(word[4][3:]) == initial[CIRCUIT.states.index(word[0])]
        if word[0][0] == "X" and word[0][1:] in board.rails:
            given_ = dict(item.split("=") for item in word[7:])
            low, high = board.rails[word[0][1:]]
            assert float(given_["vos"]) == board.offset[word[0][1:]]
            assert (float(given_["low"]), float(given_["high"])) == (low, high)


@given(value=st.floats(allow_nan=False, allow_infinity=False))
def test_no_number_has_a_unit_letter(value: float) -> None:
    text = literal(value)
    assert float(text) == value
    assert set(text) <= set("0123456789+-.e")


def run(circuit: Circuit, board: Board, excitation: Excitation, initial: Array, periods: int,
        steps: int) -> Waveforms:  # fmt: skip
    stop = periods / excitation.frequency
    text = deck.write(
        circuit, board, excitation, SolverSettings("trap", 1 / excitation.frequency / steps),
        title="test", stop_time=stop, initial=initial,
    )  # fmt: skip
    return open_simulator("shared").run(text, circuit.state_nets, stop)


@pytest.mark.parametrize("kind", ["nominal", "bench-1", "large offsets"])
def test_ngspice_shows_what_the_exact_reduction_says(kind: str) -> None:
    """State nets over four periods with contacts: RMS of the difference below 5e-4 of the RMS."""
    board = nominal_board(CIRCUIT)
    if kind == "bench-1":
        board = draw(CIRCUIT, Spread(0.01, 0.01, 3e-3, 10e-3), 1, 4)
    if kind == "large offsets":
        rng = np.random.default_rng(8)
        offset = {s.name: float(rng.choice([-1, 1]) * 10e-3) for s in CIRCUIT.sections}
        board = replace(board, offset=offset)
    excitation = Excitation(400.0, 0.6)
    reduction = Reduction(CIRCUIT, board)
    flow = Flow(reduction.system(), Drive(2 * np.pi * 400.0, -excitation.amplitude))
    start = flow.run(np.zeros(4), 30).strobes[-1]
    exact = flow.run(start, 4, points=100, measure=True)
    assert exact.counts.sum() >= 4, "the test wants contacts"
    waves = run(CIRCUIT, board, excitation, start, 4, 2000)
    grid = np.arange(401) / 400.0 / 100
    u = -excitation.amplitude * np.sin(2 * np.pi * 400.0 * grid)
    for net in CIRCUIT.state_nets:
        want = reduction.output(reduction.system().start, net, exact.strobes, u)
        got = np.interp(grid, waves.axis, waves.signals[net])
        error = np.sqrt(np.mean((got - want)[1:] ** 2) / np.mean(want**2))
        assert error < 5e-4, (net, error)


def test_offset_s_sign_in_ngspice_is_the_reduction_s() -> None:
    """Turning every offset round has to turn the difference round: caught a sign once."""
    waves = {}
    for sign in (1.0, -1.0):
        board = replace(
            nominal_board(CIRCUIT),
            offset={s.name: sign * 5e-3 for s in CIRCUIT.sections},
            bias={},
        )
        flow = Flow(Reduction(CIRCUIT, board).system(), Drive(2 * np.pi * 400.0, 0.0))
        want = flow.run(np.zeros(4), 1).strobes[-1]
        got = run(CIRCUIT, board, Excitation(400.0, 0.0), np.zeros(4), 1, 4000)
        # v1 … v4 against capacitor voltages: the summing nodes stand at the offset.
        waves[sign] = np.array([got.signals[n][-1] for n in CIRCUIT.state_nets])
        assert waves[sign] - sign * 5e-3 == pytest.approx(want, abs=2e-5)
    assert waves[1.0] == pytest.approx(-waves[-1.0], abs=1e-5)
    assert np.abs(waves[1.0]).max() > 5e-3


def test_discharged_start() -> None:
    waves = run(CIRCUIT, nominal_board(CIRCUIT), Excitation(400.0, 1.0), np.zeros(4), 1, 200)
    assert abs(waves.signals["v1"][0]) < 1e-3
    assert np.abs(waves.signals["v1"]).max() > 1e-3
