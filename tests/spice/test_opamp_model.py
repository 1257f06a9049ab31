"""Each op-amp model in ngspice, held against the catalogue's figures, one measurement at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from designer.base.defaults import Fidelity
from designer.catalog.fields import Figure
from designer.catalog.netlist_guard import check_netlist
from designer.catalog.parts_catalog import load_catalog
from designer.catalog.vendor_model import PINS, VendorModel
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.spice import deck
from designer.spice.batch_backend import BatchNgspice
from designer.spice.deck import SolverSettings
from designer.spice.opamp_check import FigureCheck, OpAmpBench, checks
from designer.spice.opamp_model import FIDELITIES, recovery, second_pole
from designer.spice.worker import open_simulator
from tests.circuit.test_reduction import EXACT, circuit_of
from tests.shared.exploring import quick

CATALOG = load_catalog()
NAMES = [o.name for o in CATALOG.opamps]
CIRCUIT = circuit_of(EXACT)
WITH_MEMORY = [r for r in FIDELITIES if r != "ideal"]

each = pytest.mark.parametrize("name", quick(NAMES, 2))
every_fidelity = pytest.mark.parametrize("fidelity", FIDELITIES)
every_fidelity_with_memory = pytest.mark.parametrize("fidelity", WITH_MEMORY)


@each
@every_fidelity
def test_static_figures(name: str, fidelity: Fidelity) -> None:
    """Open-loop gain within 0.1 %, offset within 1 ppm plus 1/gain, bias within 1 fA."""
    opamp = CATALOG.opamp(name)
    bench = OpAmpBench.of(opamp, fidelity)
    assert bench.open_loop_gain() == pytest.approx(opamp.gain.nominal, rel=1e-3)
    offset = opamp.offset.nominal
    assert bench.offset() == pytest.approx(offset, rel=1e-6 + 2.0 / opamp.gain.nominal, abs=1e-11)
    assert replace(bench, vos=-offset).offset() == pytest.approx(-offset, rel=1e-4)
    for current in bench.bias():
        assert current == pytest.approx(opamp.bias.nominal, abs=1e-15)


@each
@pytest.mark.parametrize("fidelity", ["ideal", "dynamic"])
def test_swing(name: str, fidelity: Fidelity) -> None:
    """Below ``full`` the limits are those of the pin, whatever the load; each rail its own."""
    bench = OpAmpBench.of(CATALOG.opamp(name), fidelity)
    low, high = 0.9 * bench.rails[0], 0.97 * bench.rails[1]
    bench = replace(bench, rails=(low, high))
    for load in (2e3, 10e3):
        assert bench.swing(load) == pytest.approx((low, high), abs=1e-3)


@each
def test_swing_follows_the_load(name: str) -> None:
    """``full``: the figures at 10 kΩ and 2 kΩ within 1 mV, and in between by Ohm's law."""
    opamp = CATALOG.opamp(name)
    bench = OpAmpBench.of(opamp, "full")
    light = opamp.saturation.nominal
    assert bench.swing(10e3) == pytest.approx((-light, light), abs=1e-3)
    heavy = bench.swing(2e3)
    if opamp.swing_2k is not None:
        want = opamp.swing_2k.nominal
        assert heavy == pytest.approx((-want, want), abs=1e-3)
    resistance = (light - heavy[1]) / (heavy[1] / 2e3 - light / 10e3)
    between = (light + resistance * light / 10e3) / (1.0 + resistance / 5e3)
    assert bench.swing(5e3)[1] == pytest.approx(between, abs=1e-3)
    assert bench.swing(1e9)[1] < opamp.rated_supply


@each
def test_output_current_limit(name: str) -> None:
    opamp = CATALOG.opamp(name)
    want = opamp.output_current.nominal
    assert OpAmpBench.of(opamp, "full").short_circuit() == pytest.approx((-want, want), rel=1e-3)


@each
def test_supply_current(name: str) -> None:
    """The quiescent current within 0.1 %; the load's on top, from the rail that carries it."""
    opamp = CATALOG.opamp(name)
    bench = OpAmpBench.of(opamp, "full")
    quiet = opamp.supply_current.nominal
    assert bench.supply_current() == pytest.approx((quiet, quiet), rel=1e-3)
    load = (bench.rails[1] / 2 + bench.vos) / 2e3
    assert bench.supply_current(2e3) == pytest.approx((quiet + load, quiet), rel=1e-3)


@each
def test_noise(name: str) -> None:
    """At 1 kHz the figure within 0.1 %; a corner leaves sqrt(1 + fc/f) of the white level."""
    opamp = CATALOG.opamp(name)
    bench = OpAmpBench.of(opamp, "full")
    figure = opamp.noise.nominal
    assert bench.noise(1e3) == pytest.approx(figure, rel=1e-3)
    corner = opamp.noise_corner.nominal if opamp.noise_corner else 0.0
    for frequency in (10.0, 10e3):
        shape = np.sqrt((1.0 + corner / frequency) / (1.0 + corner / 1e3))
        assert bench.noise(frequency) == pytest.approx(figure * shape, rel=5e-3)


@each
def test_second_pole(name: str) -> None:
    """``full``: the phase margin of the catalogue (at most 88°), within 0.1°."""
    opamp = CATALOG.opamp(name)
    frequency, phase = OpAmpBench.of(opamp, "full").unity_gain()
    margin = min(opamp.phase_margin.nominal if opamp.phase_margin else 60.0, 88.0)
    assert phase == pytest.approx(margin, abs=0.1)
    expected = opamp.gbw.nominal * np.sin(np.radians(margin))
    assert frequency == pytest.approx(expected, rel=2e-3)


@each
def test_an_input_below_the_common_mode_range(name: str) -> None:
    """A follower follows to 0.5 V inside the range. Beyond, one with phase reversal goes to the
    wrong rail; any other stays at the end of the range, or at its output limit before that."""
    opamp = CATALOG.opamp(name)
    bench = OpAmpBench.of(opamp, "full")
    end = opamp.common_mode.min
    assert end is not None
    slow = 200.0 * bench.supply / opamp.slew.nominal
    deck = bench.deck([
        f"VIN inp 0 PWL(0 0 {slow!r} {end - 0.5!r} {2 * slow!r} {end - 0.5!r})",
        "RF out inn 1", "RL out 0 1e6", f".tran {slow / 100!r} {2 * slow!r} 0 {slow / 100!r}",
    ])  # fmt: skip
    plot = BatchNgspice().analyse(deck)[-1].vectors
    inside = np.interp(slow * (end + 0.5) / (end - 0.5), plot["time"], plot["out"])
    beyond = plot["out"][-1]
    limit = bench.swing(1e6)[0]
    assert inside == pytest.approx(max(end + 0.5, limit), abs=0.01)
    if opamp.phase_reversal:
        assert beyond == pytest.approx(-limit, abs=0.01)
    else:
        assert beyond == pytest.approx(max(end, limit), abs=0.02)


def test_the_old_tl074_reverses_and_the_new_does_not() -> None:
    reversing = [o.name for o in CATALOG.opamps if o.phase_reversal]
    assert reversing == ["TL074C", "TL072C", "TL071C"]


@each
@every_fidelity_with_memory
def test_frequency_response(name: str, fidelity: Fidelity) -> None:
    """Gain-bandwidth within 2 % a decade below unity gain."""
    opamp = CATALOG.opamp(name)
    at = opamp.gbw.nominal / 10.0
    frequency, gain = OpAmpBench.of(opamp, fidelity).response(at, 2.0 * at)
    assert abs(gain[0]) * frequency[0] == pytest.approx(opamp.gbw.nominal, rel=0.02)


@each
def test_one_pole(name: str) -> None:
    frequency, phase = OpAmpBench.of(CATALOG.opamp(name), "dynamic").unity_gain()
    assert frequency == pytest.approx(CATALOG.opamp(name).gbw.nominal, rel=1e-3)
    assert phase == pytest.approx(90.0, abs=0.1)


@each
@every_fidelity_with_memory
def test_slew(name: str, fidelity: Fidelity) -> None:
    """Both edges within 1 % of the figure."""
    opamp = CATALOG.opamp(name)
    for edge in OpAmpBench.of(opamp, fidelity).slew():
        assert edge == pytest.approx(opamp.slew.nominal, rel=0.01)


@pytest.mark.parametrize("name", quick(NAMES))
@every_fidelity_with_memory
def test_recovery_is_the_parameter(name: str, fidelity: Fidelity) -> None:
    """No data sheet fixes it for every circuit: swept over two decades, it follows within 4 %.

    A second pole adds its own time constant. The middle of the sweep is the catalogue's figure, of
    which ``test_every_figure_agrees_with_its_model`` asks the same.
    """
    bench = OpAmpBench.of(CATALOG.opamp(name), fidelity)
    for factor in (0.1, 10.0):
        wanted = factor * recovery(bench.opamp)
        figure = Figure(None, wanted, None, "a test")
        swept = replace(bench, opamp=replace(bench.opamp, recovery=figure))
        lag = 0.0 if fidelity == "dynamic" else 0.5 / np.pi / second_pole(bench.opamp)
        assert swept.recovery() == pytest.approx(wanted + lag / 2, rel=0.04, abs=lag)


@every_fidelity
def test_a_deck_of_every_fidelity(fidelity: Fidelity) -> None:
    """It passes the filter, and four periods from a point of the orbit end near that point."""
    board = nominal_board(CIRCUIT)
    excitation = Excitation(400.0, 0.6)
    reduction = Reduction(CIRCUIT, board)
    flow = Flow(reduction.system(), Drive(2 * np.pi * 400.0, -excitation.amplitude))
    start = flow.run(np.zeros(4), 60).strobes[-1]
    text = deck.write(
        CIRCUIT, board, excitation, SolverSettings("trap", 1 / 400.0 / 400),
        title="test", stop_time=4 / 400.0, initial=start, fidelity=fidelity,
    )  # fmt: skip
    check_netlist(text)
    assert not any(line.startswith("+") for line in text.splitlines())
    waves = open_simulator("shared").run(text, CIRCUIT.state_nets, 4 / 400.0)
    for k, net in enumerate(CIRCUIT.state_nets):
        peak = np.abs(waves.signals[net]).max()
        # 60 mV at the threshold against 13 V at the limit: what the load takes of that shows here.
        assert waves.signals[net][-1] == pytest.approx(start[k], abs=0.05 * peak), net
        first = np.interp(1e-8, waves.axis, waves.signals[net])
        assert first == pytest.approx(start[k], abs=0.03 * peak), f"{net} does not start there"


def unity_gain(text: str, section: str, gbw: float) -> tuple[float, float]:
    """Frequency [Hz] of unity gain and the phase left there, of one section of a deck."""

    class Taken(OpAmpBench):
        """That section's line and the deck's own models, on the bench."""

        def deck(self, around: Sequence[str]) -> str:
            lines = text.splitlines()
            (own,) = (line.split() for line in lines if line.startswith(f"X{section} "))
            first = next(i for i, x in enumerate(lines) if x.startswith(".subckt"))
            last = max(i for i, x in enumerate(lines) if x.startswith(".ends"))
            here = ["* a section", "VCC vcc 0 15.0", "VEE vee 0 -15.0",
                    " ".join(["XU1", "inp", "inn", "out", *own[4:]])]  # fmt: skip
            return "\n".join([*here, *lines[first : last + 1], *around, ".end"]) + "\n"

    bench = OpAmpBench.of(CATALOG.opamp("TL074C"), "full")
    opamp = replace(bench.opamp, gbw=Figure(None, gbw, None, "a test"))
    return Taken(**{**bench.__dict__, "opamp": opamp}).unity_gain()


@every_fidelity_with_memory
def test_every_section_has_a_bandwidth_of_its_own(fidelity: Fidelity) -> None:
    """Half the gain-bandwidth: half the unity-gain frequency at the same phase margin, in the
    deck's own lines. Others keep theirs, and a deck without the figure is what it was."""
    circuit = replace(CIRCUIT, figures=CATALOG.opamp("TL074C"))
    board = nominal_board(circuit)
    typical = CATALOG.opamp("TL074C").gbw.nominal
    slow, other = circuit.sections[0].name, circuit.sections[1].name

    def text(board: Board) -> str:
        return deck.write(
            circuit, board, Excitation(400.0, 0.6), SolverSettings("trap", 1e-5),
            title="t", stop_time=1e-2, fidelity=fidelity,
        )  # fmt: skip

    drawn = text(replace(board, gain_bandwidth={slow: typical / 2.0}))
    check_netlist(drawn)
    frequency, margin = unity_gain(drawn, other, typical)
    assert unity_gain(drawn, slow, typical / 2.0) == pytest.approx(
        (frequency / 2.0, margin), rel=2e-4
    )
    changed = [
        pair for pair in zip(drawn.splitlines(), text(board).splitlines(), strict=True)
        if pair[0] != pair[1]
    ]  # fmt: skip
    assert [line.split()[0] for line, _ in changed] == [f"X{slow}"]
    assert changed[0][0].startswith(changed[0][1]), "what is drawn is added, nothing else"
    ideal = deck.write(
        circuit, replace(board, gain_bandwidth={slow: 1e5}), Excitation(400.0, 0.6),
        SolverSettings("trap", 1e-5), title="t", stop_time=1e-2,
    )  # fmt: skip
    assert "gbw" not in ideal


def test_a_vendor_s_model_keeps_its_bandwidth() -> None:
    lines = (".subckt vendor_x inp inn out vcc vee", "Eout out 0 inp inn 1e6",
             "Rs vcc vee 1e4", ".ends vendor_x")  # fmt: skip
    vendor = VendorModel("own", "vendor_x", PINS, lines, b"")
    circuit = replace(CIRCUIT, figures=replace(CATALOG.opamp("TL074C"), spice=vendor))
    board = replace(
        nominal_board(circuit), gain_bandwidth={s.name: 1e6 for s in circuit.sections}
    )  # fmt: skip
    text = deck.write(
        circuit, board, Excitation(400.0, 0.6), SolverSettings("trap", 1e-5),
        title="t", stop_time=1e-3, fidelity="full",
    )  # fmt: skip
    assert "gbw" not in text
    assert open_simulator("shared").run(text, circuit.state_nets, 1e-3).axis[-1] > 0.99e-3


def test_a_fidelity_without_figures() -> None:
    bare = replace(CIRCUIT, figures=None)
    with pytest.raises(ValueError, match="figures"):
        deck.write(
            bare, nominal_board(bare), Excitation(400.0, 1.0), SolverSettings("trap", 1e-6),
            title="t", stop_time=1e-3, fidelity="dynamic",
        )  # fmt: skip


@each
@every_fidelity
def test_every_figure_agrees_with_its_model(name: str, fidelity: Fidelity) -> None:
    found = checks(CATALOG.opamp(name), fidelity)
    assert [c.figure for c in found if not c.agrees] == []
    assert len({c.figure for c in found}) == len(found) >= 6


def test_a_figure_that_its_model_does_not_have_is_seen() -> None:
    opamp = CATALOG.opamp("TL074C")
    vendor = VendorModel(
        "own", "vendor_x", PINS,
        (".subckt vendor_x inp inn out vcc vee", "Eout out 0 inp inn 1e6", "Rs vcc vee 1e4",
         ".ends vendor_x"), b"",
    )  # fmt: skip
    found = checks(replace(opamp, spice=vendor), "dynamic")
    assert all(c.agrees for c in found), "below full the model is ours"
    bench = OpAmpBench.of(replace(opamp, spice=vendor), "full")
    assert bench.open_loop_gain() == pytest.approx(1e6, rel=1e-3)
    assert not FigureCheck("gain", "V/V", 2e5, 1e6, 0.01, False).agrees
