"""Drives of any shape, and two channels of the generator: parts, boards, decks, and ngspice."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.base.defaults import DIALECTS
from designer.base.errors import InputError
from designer.board.board_parts import board_circuit, fault_current, protection_offset
from designer.board.kicad_sim import models
from designer.catalog.parts_catalog import load_catalog
from designer.check.deck_runs import FirstRun
from designer.check.synthesis_result import Synthesis, synthesise
from designer.circuit.board_values import nominal_board
from designer.circuit.design import settings
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Connector, Resistor
from designer.circuit.nominal import circuit_flow, nominal_reduction, on_circuit
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.drive_shape import SINE, wave
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.folders.bench_tables import scales_csv, setup_csv, waveform_csv
from designer.folders.design_files import chosen, waveform_names
from designer.jobs.bench_job import check_fits
from designer.model.model_file import parse_model_file
from designer.spice import deck, equation_check, numerics_gate, simulator_decks
from designer.spice.deck import SolverSettings
from designer.spice.pool import SpicePool
from designer.spice.worker import open_simulator
from designer.spread.spread import Spread, draw_many
from designer.synthesis.output_loads import design_loads
from designer.synthesis.part_checks import unit_circuit
from designer.workbench import prediction as prediction_module
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.naming import identify_response
from designer.workbench.prediction import POINTS, BoardPrediction
from designer.yields.adjustment import Adjustment
from tests.shared.exploring import quick
from tests.shared.simulated_scope import SimulatedScope
from tests.shared.system_text import clearance, system_text, table
from tests.synthesis.test_law_circuits import shows_what_the_model_does

GROUND = ("ball", "ground")
PAIR = ("ball", "table")


def one(*more: str) -> str:
    stops = clearance("A", *GROUND, upper=0.5, lower=0.5, stiffness=9.0)
    return system_text({"ball": 1.0}, {GROUND: 1.0}, {GROUND: 0.1}, stops, *more)


def two(*more: str) -> str:
    springs = {PAIR: 0.7, GROUND: 1.0}
    dampers = {GROUND: 0.1, ("table", "ground"): 0.2}
    stops = clearance("A", *PAIR, upper=0.4, stiffness=9.0)
    return system_text({"ball": 1.0, "table": 1.5}, springs, dampers, stops, *more)


RESPONSE = table("response", omega=1.3)
TEXTS = {
    "square": one(table("force", on="ball", amplitude=1.0, waveform="square", terms=5), RESPONSE),
    "phase": one(table("force", on="ball", amplitude=1.0, phase=0.7), RESPONSE),
    "against each other": two(
        *(
            table("force", on=name, amplitude=size, waveform="sawtooth", terms=3, phase=0.7)
            for name, size in (("ball", 1.0), ("table", -0.6))
        ),
        RESPONSE,
    ),
    "shaken": two(
        "[base]\namplitude = 0.5\nharmonics = [[2, 0.2, 0.9], [3, 0.05, 0.2]]\n", RESPONSE
    ),
    "two phases": two(
        table("force", on="ball", amplitude=1.0),
        table("force", on="table", amplitude=0.6, phase=1.2),
        RESPONSE,
    ),
    "force beside base": two(
        table("force", on="table", amplitude=0.5, waveform="square", terms=3),
        "[base]\namplitude = 0.5\n",
        RESPONSE,
    ),
    "three phases": system_text(
        {"ball": 1.0, "table": 1.5, "top": 0.8},
        {GROUND: 1.0, PAIR: 0.7, ("table", "top"): 0.9},
        {GROUND: 0.1, ("table", "ground"): 0.2, ("top", "ground"): 0.1},
        clearance("A", *GROUND, upper=0.5, stiffness=6.0),
        *(
            table("force", on=name, amplitude=0.5, phase=f"{120 * k} deg")
            for k, name in enumerate(("ball", "table", "top"))
        ),
        RESPONSE,
    ),
    "stops that stay": one('[base]\namplitude = 0.8\nstops = "fixed"\n', RESPONSE),
    "two masses, stops that stay": system_text(
        {"ball": 1.0, "table": 1.5},
        {GROUND: 1.0, PAIR: 0.7, ("table", "ground"): 0.5},
        {GROUND: 0.05, ("table", "ground"): 0.4},
        clearance("A", *GROUND, upper=0.4, stiffness=9.0, damping=0.1),
        '[base]\namplitude = 0.8\nphase = 0.3\nstops = "fixed"\n',
        RESPONSE,
    ),
}
SECOND = ("two phases", "force beside base", "three phases", "two masses, stops that stay")
"""Those that take two channels."""


@pytest.fixture(scope="module")
def pool() -> Iterator[SpicePool]:
    """Workers that import the package once, for all tests of this file."""
    with SpicePool(2) as workers:
        yield workers


@cache
def made(name: str) -> Synthesis:
    return synthesise(parse_model_file(TEXTS[name]))


@pytest.mark.parametrize("name", quick(TEXTS, 2))
def test_chosen_parts_do_what_the_model_does(name: str) -> None:
    result = made(name)
    shows_what_the_model_does(result)
    circuit = result.design.circuit
    assert (circuit.second is not None) is (name in SECOND)
    assert {"ig", "ig2"} & set(circuit.nets) == {
        "against each other": {"ig"}, "three phases": {"ig", "ig2"},
    }.get(name, set())  # fmt: skip


@pytest.mark.parametrize("name", quick(TEXTS, 2))
def test_the_generator_makes_the_forces_of_the_model(name: str) -> None:
    """Volts through the resistors of each mass, as forces over a period, are those of the file."""
    result = made(name)
    design, (response,) = result.design, result.model_responses
    drive = design.excitation(response.b, response.omega).drive
    angle = np.linspace(0.0, 2.0 * np.pi, 500)
    gains = design.errors.drive_gain, design.errors.second_gain
    volts = drive.at(angle), drive.second_at(angle)
    found = -sum(np.outer(v, gain) for v, gain in zip(volts, gains, strict=True))
    wanted = sum(
        np.outer(np.sin(w.order * angle), w.sine) + np.outer(np.cos(w.order * angle), w.cosine)
        for w in design.model.second_order().drive_waves(response.omega)
    )
    assert found == pytest.approx(wanted, abs=0.03 * np.abs(wanted).max())


@pytest.mark.parametrize("name", quick(TEXTS, 2))
def test_ngspice_moves_as_the_exact_circuit_does(name: str) -> None:
    """Two periods from the orbit; the generator's nets have the voltages of the drive."""
    result = made(name)
    design, (response,) = result.design, result.model_responses
    reduction, circuit = nominal_reduction(design), design.circuit
    excitation = design.excitation(response.b, response.omega)
    flow = circuit_flow(reduction.system(), design, response)
    orbit = on_circuit(reduction.system(), design, response)
    assert orbit.status is OrbitStatus.PERIODIC
    period = 1.0 / excitation.frequency
    text = deck.write(
        circuit, reduction.board, excitation, SolverSettings("trap", period / 4000),
        title="two periods", stop_time=2.0 * period, initial=orbit.start,
    )  # fmt: skip
    nets = (*circuit.state_nets, *circuit.generator_nets)
    waves = open_simulator("shared").run(text, nets, 2.0 * period)
    grid = np.arange(2, 800) / 400 * period
    wanted = flow.run(orbit.start, 2, mode=orbit.mode, points=400).strobes[2:800]
    angle = flow.drive.omega * grid
    volts = np.stack([flow.drive.at(angle), flow.drive.second_at(angle)], axis=1)
    wanted = np.hstack([wanted, volts[:, : len(circuit.generators)]])
    for k, net in enumerate(nets):
        got = np.interp(grid, waves.axis, waves.signals[net])
        assert np.abs(got - wanted[:, k]).max() < 5e-3 * np.abs(wanted[:, k]).max(), net


@pytest.mark.parametrize("name", quick([*SECOND, "against each other"]))
def test_decks_for_other_simulators_have_the_same_generator(name: str) -> None:
    design, (response,) = made(name).design, made(name).model_responses
    excitation = design.excitation(response.b, response.omega)
    circuit, period = design.circuit, 1.0 / excitation.frequency
    run = simulator_decks.ResponseRun(
        response.omega, None, excitation, SolverSettings("trap", period / 2000), period, None
    )
    nets = circuit.generator_nets
    both = [
        open_simulator("batch").run(
            simulator_decks.write(dialect, circuit, [run], title="a period").replace(
                ".print tran", ".save"
            ),
            nets,
            period,
        )
        for dialect in DIALECTS
    ]
    for waves in both:
        angle = excitation.drive.omega * waves.axis
        wanted = excitation.drive.at(angle), excitation.drive.second_at(angle)
        for net, volts in zip(nets, wanted, strict=False):
            assert waves.signals[net] == pytest.approx(volts, abs=1e-3 * np.abs(volts).max())


def test_the_sheet_s_generators_are_those_of_the_deck() -> None:
    design, (response,) = (
        made("three phases").design,
        made("three phases").model_responses,
    )
    excitation = design.excitation(response.b, response.omega)
    run = FirstRun(excitation, SolverSettings("trap", 1e-6), 1e-3, None)
    library = models(design.circuit, (), run)
    for line in deck.generators(design.circuit, excitation):
        assert line.replace(" 0 SIN", " bottom SIN") in library
    assert library.count(".subckt generator") == 2


@pytest.mark.parametrize("name", quick(TEXTS, 2))
def test_ngspice_s_transfer_functions_are_the_model_s(name: str, pool: SpicePool) -> None:
    """Of each channel; with another resistor in the second one they are not, and only there."""
    right = equation_check.check(made(name).design, made(name).model_responses, pool)
    assert right.passed, right.problem
    names = [f.name for f in right.findings]
    assert ("transfer, open, second channel" in names) is (name in SECOND)
    assert "transfer, open" in names
    if name not in SECOND:
        return
    design = made(name).design
    odd = design.model.second_order().drive_force(1.3, 1).nonzero()[0][-1]
    parts = tuple(
        replace(p, value=1.2 * p.value)
        if isinstance(p, Resistor) and p.name == f"R{170 + odd}" else p
        for p in design.circuit.parts
    )  # fmt: skip
    wrong = replace(design, circuit=replace(design.circuit, parts=parts))
    found = equation_check.check(wrong, made(name).model_responses, pool)
    assert [f.name for f in found.findings if not f.passed] == ["transfer, open, second channel"]


@pytest.mark.parametrize("name", quick(["two phases", "against each other"]))
def test_boards_answer_as_one_by_one(name: str) -> None:
    result = made(name)
    design, (response,) = result.design, result.model_responses
    orbit = on_circuit(nominal_reduction(design).system(), design, response)
    boards = draw_many(design.circuit, Spread(0.01, 0.01, 1e-3, 4e-3), 5, range(4))
    drive = design.excitation(response.b, response.omega).drive
    asked = range(4), [drive] * 4, np.tile(orbit.start, (4, 1))
    together, slow = Ensemble(boards), Ensemble(boards, fast=False)
    predicted = together.quick(*asked)
    pairs = zip(together.settle(*asked), slow.settle(*asked), predicted, strict=True)
    for a, b, guess in pairs:
        assert a.counts == b.counts
        assert a.start == pytest.approx(b.start, rel=1e-9, abs=1e-9)
        assert guess is not None
        assert guess.counts == b.counts


def test_no_current_is_lost_at_a_summing_node() -> None:
    """Kirchhoff's law with both channels on: what resistors bring, capacitors take."""
    circuit = made("two phases").design.circuit
    reduction = Reduction(circuit, nominal_board(circuit, ideal=True))
    x, channels = np.array([0.3, -0.8, 0.5, 0.2]), (0.7, -1.1)
    volts = reduction.voltages(circuit.open, x, channels)
    mode = reduction.system().mode(circuit.open)
    assert mode.second is not None
    rates = mode.A @ x + mode.B * channels[0] + mode.second * channels[1] + mode.d
    moved = 0
    for section in circuit.sections:
        node, brought = section.inverting, [0.0]
        for part in circuit.resistors:
            if node in (part.a, part.b):
                other = part.b if part.a == node else part.a
                brought.append((volts.get(other, 0.0) - volts[node]) / part.value)
        for name, rate in zip(circuit.states, rates, strict=True):
            own = next(c for c in circuit.capacitors if c.name == name)
            if node in (own.plus, own.minus):
                brought.append(own.value * rate * (1.0 if node == own.minus else -1.0))
                moved += 1
        assert sum(brought) == pytest.approx(0.0, abs=1e-9 * max(map(abs, brought)))
    assert moved == len(circuit.states)


def test_loads_know_both_channels() -> None:
    """The current of every output against a fine sample of the nodal equations."""
    result = made("two phases")
    design, (response,) = result.design, result.model_responses
    reduction = nominal_reduction(design)
    loads = design_loads(design, reduction, result.model_responses)
    flow = circuit_flow(reduction.system(), design, response)
    orbit = on_circuit(reduction.system(), design, response)
    for start, periods in ((orbit.start, orbit.n), (np.zeros(4), 20)):
        run = flow.run(start, periods, points=200)
        angle = 2.0 * np.pi * np.arange(len(run.strobes)) / 200
        volts = zip(flow.drive.at(angle), flow.drive.second_at(angle), strict=True)
        peaks: dict[str, float] = {}
        for x, (u, w), phase in zip(run.strobes, volts, angle, strict=True):
            key = flow.mode_at(x, float(phase))
            one, other = reduction.solution(key).output, reduction.by_second(key).output
            for name, row in one.items():
                amperes = abs(row @ [*x, u, 1.0] + other[name][-2] * w)
                peaks[name] = max(peaks.get(name, 0.0), float(amperes))
        for name, most in peaks.items():
            assert most <= loads.of(name).current * (1.0 + 1e-4)
            if loads.of(name).current_in.endswith("rest") is (periods == 20):
                assert most == pytest.approx(loads.of(name).current, rel=1e-2)


@pytest.mark.parametrize("name", quick(["square", "two phases", "force beside base"], 2))
def test_the_bench_is_told_what_each_channel_gives(name: str) -> None:
    result = made(name)
    design, file = result.design, result.modelfile
    text = setup_csv(design, result.model_responses, [None] * len(result.model_responses))
    (row,) = csv.DictReader(io.StringIO(text))
    (knob,) = chosen(result)["knobs"]
    names = waveform_names(file)
    if name == "square":
        assert names == ("waveform.csv",)
        assert "phase2_deg" not in row
        assert "second" not in knob
    elif name == "two phases":
        assert names == ()
        assert float(row["phase2_deg"]) == pytest.approx(-np.rad2deg(1.2), rel=1e-4)
        assert knob["second"]["phase_deg"] == pytest.approx(-np.rad2deg(1.2))
    else:
        assert names == ("waveform.csv", "waveform2.csv")
        assert row["phase2_deg"] == "0"
    if "amplitude2_v_peak" in row:
        volts = knob["second"]["amplitude_v_peak"]
        assert float(row["amplitude2_v_peak"]) == pytest.approx(volts, rel=1e-4)
        assert float(row["amplitude2_vpp"]) == pytest.approx(2.0 * volts, rel=1e-4)
    for shape in design.drive_shapes:
        levels = np.array([float(line) for line in waveform_csv(shape).splitlines()])
        angle = 2.0 * np.pi * np.arange(len(levels)) / len(levels)
        assert levels == pytest.approx(-wave(shape, angle), abs=1e-6)
        assert np.abs(levels).max() == pytest.approx(1.0, abs=1e-3)


def test_a_volt_of_the_base_s_channel_is_an_acceleration_of_the_base() -> None:
    """Beside a force of its own the base has a channel to itself: Y ω² over its volts."""
    result = made("force beside base")
    design, base = result.design, result.modelfile.model.second_order().base
    (response,) = result.model_responses
    setting = design.excitation(response.b, response.omega)
    assert setting.second is not None
    found = design.base_per_volt(response.b, response.omega)
    assert found is not None
    channel, scale = found
    volts = (setting.amplitude, setting.second.amplitude)[channel]
    assert volts * scale == pytest.approx(base * response.omega**2, rel=1e-9)
    other = (design.errors.drive_gain, design.errors.second_gain)[channel]
    assert (other != 0.0).all()  # the base drives every mass
    assert made("two phases").design.base_per_volt() is None


def test_a_turned_knob_turns_both_channels() -> None:
    result = made("two phases")
    design, (response,) = result.design, result.model_responses
    own = design.excitation(response.b, response.omega)
    assert own.second is not None
    louder = Adjustment(frequency=0.01, amplitude=0.1).of(own)
    assert louder.second is not None
    assert louder.second.amplitude == pytest.approx(1.1 * own.second.amplitude)
    assert louder.amplitude == pytest.approx(1.1 * own.amplitude)


def test_the_board_has_a_jack_for_each_channel() -> None:
    result = made("force beside base")
    circuit, choice = board_circuit(result)
    jacks = {p.ways[0]: p.role for p in circuit.fittings if isinstance(p, Connector)}
    assert jacks["vg"] == "generator"
    assert jacks["vg2"] == "generator, second channel"
    # The mass that both drive takes the current of both.
    values = circuit.values
    both = 10.0 * (1.0 / values["R12"] + 1.0 / values["R171"])
    assert fault_current(circuit, "s4", 10.0) == pytest.approx(both)
    assert protection_offset(circuit, "s4", choice, result.catalog, 0.01) > 0.0


def test_no_record_of_such_a_board_is_named() -> None:
    for name, found in (("square", "another shape"), ("two phases", "a second channel")):
        prediction = BoardPrediction(made(name))
        with pytest.raises(InputError, match=r"one sine drives$") as refused:
            check_fits(prediction, fit=False, boards=False, decays=[])
        assert refused.value.found == f"a board whose drive has {found}"
        for asked in ("settings", "responses"):
            with pytest.raises(InputError, match=r"one sine drives$"):
                getattr(prediction, asked)
        assert prediction.zones


@pytest.mark.parametrize("name", quick(["phase", "stops that stay"]))
def test_a_sine_of_another_phase_is_predicted_from_its_phase_0_on(name: str) -> None:
    """Against the exact circuit under the drive of the model's phase; its record is named."""
    result = made(name)
    prediction, (response,) = BoardPrediction(result), result.model_responses
    check_fits(prediction, fit=False, boards=False, decays=[])
    (setting,) = settings(result.design, result.model_responses)
    ((_, sine, cosine),) = setting.shape
    assert abs(cosine) > 0.05
    true = on_circuit(prediction.reduction.system(), result.design, response)
    waves, (shown,) = prediction.waves(true, setting), prediction.responses
    grid = np.arange(len(waves["v1"])) / POINTS
    later = (grid - np.arctan2(cosine, sine) / (2.0 * np.pi)) % true.n
    for net in prediction.nets:
        whole = np.append(waves[net], waves[net][0])
        wanted = np.interp(later, np.arange(len(whole)) / POINTS, whole)
        assert shown.waves[net] == pytest.approx(wanted, abs=5e-3 * np.ptp(wanted))
    channels = ("v1", prediction.stops[0].output, prediction.generator)
    period = 1.0 / setting.frequency_hz
    time = np.arange(14 * POINTS) * period / POINTS
    record = SimulatedScope(channels=channels).record(
        time,
        {net: np.resize(waves[net], len(time)) for net in channels},
        period,
        np.random.default_rng(5),
    )
    motion = recorded_motion(
        record, prediction, stated={n: f"CH{k + 1}" for k, n in enumerate(channels)}
    )
    named = identify_response(motion, prediction)
    assert named.sure
    assert named.response == true.response == shown.orbit.response


def test_waves_of_another_attractor_are_not_predicted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The orbit is looked for from a point of its own; what counts otherwise is left out."""
    result, asked = made("phase"), []

    def found(flow: Flow, x: Array) -> Orbit:
        asked.append((x, orbit := settle(flow, x)))
        return orbit

    monkeypatch.setattr(prediction_module, "settle", found)
    (shown,) = BoardPrediction(result).responses
    ((x, orbit),) = asked
    assert shown.orbit is orbit
    assert orbit.n == 1
    assert np.abs(x - orbit.start).max() < 1e-9 * np.abs(orbit.extremes).max()
    for other in (replace(orbit, p=orbit.p + 1), replace(orbit, n=2), replace(orbit, n=0)):
        monkeypatch.setattr(prediction_module, "settle", lambda *_, other=other: other)
        assert BoardPrediction(result).responses == ()


THREE = table("force", on="ball", amplitude=1.0, harmonics=[[2, 0.3, 0.0]]) + table(
    "force", on="table", amplitude=0.6, phase=1.2
)


def test_three_shapes_are_refused() -> None:
    """Two of the forces, and the ground's beside them."""
    with pytest.raises(InputError, match="more than two phases or shapes"):
        synthesise(parse_model_file(two(THREE, "[base]\namplitude = 0.5\n", RESPONSE)))


def amplitudes(name: str, omega: float) -> Array:
    return np.array(made(name).design.excitation(1.0, omega).amplitudes)


@pytest.mark.slow
def test_the_ground_s_channel_follows_the_frequency() -> None:
    ratios = amplitudes("force beside base", 2.0) / amplitudes("force beside base", 1.0)
    assert ratios == pytest.approx([1.0, 4.0])
    assert amplitudes("two phases", 2.0) == pytest.approx(amplitudes("two phases", 1.0))
    # Where the stops stay, springs give k Y and dampers d ω Y, a quarter turn ahead.
    ratio = amplitudes("stops that stay", 2.0) / amplitudes("stops that stay", 1.0)
    assert ratio == pytest.approx(abs(1.0 + 0.2j) / abs(1.0 + 0.1j))
    two_masses = "two masses, stops that stay"
    ratios = amplitudes(two_masses, 2.0) / amplitudes(two_masses, 1.0)
    assert sorted(ratios) == pytest.approx([1.0, 2.0])


def test_the_first_channel_is_where_an_offset_moves_the_clearance() -> None:
    """A shaker on each of two masses that nothing joins but a clearance at the second."""
    springs = {("a", "ground"): 1.0, ("b", "ground"): 1.5, ("a", "b"): 1e-3}
    text = system_text(
        {"a": 1.0, "b": 1.0}, springs, {("a", "ground"): 0.1, ("b", "ground"): 0.1},
        clearance("A", "b", "ground", upper=0.3, stiffness=8.0),
        table("force", on="a", amplitude=1.0),
        table("force", on="b", amplitude=0.5, phase=1.0),
        RESPONSE,
    )  # fmt: skip
    system = parse_model_file(text).model.second_order()
    assert [c.force.nonzero()[0].tolist() for c in system.channels(1.3) or ()] == [[1], [0]]
    assert system.drive_shapes(1.3)[1] == SINE


def test_twelve_masses_have_a_name_for_every_part() -> None:
    """A second channel and a constant force on the last of them."""
    names = [f"m{k}" for k in range(1, 13)]
    pairs = [(names[0], "ground"), *zip(names[1:], names[:-1], strict=True)]
    text = system_text(
        dict.fromkeys(names, 1.0), dict.fromkeys(pairs, 4.0), dict.fromkeys(pairs, 0.4),
        clearance("A", "m1", "ground", upper=0.3, stiffness=8.0),
        *(table("force", on=name, amplitude=0.5) for name in names[:10]),
        *(table("force", on=name, amplitude=0.5, phase=1.0) for name in names[10:]),
        *(table("force", on=name, constant=0.1) for name in names),
        '[circuit]\ndead_zone = "rectifier"\n', RESPONSE,
    )  # fmt: skip
    file = parse_model_file(text)
    circuit = unit_circuit(file.model, file.circuit, load_catalog())
    assert {"R1910", "R1911", "R171"} <= {part.name for part in circuit.parts}


def test_the_scale_card_has_the_size_of_forces_that_cancel() -> None:
    made_ = made("three phases")
    rows = csv.DictReader(io.StringIO(scales_csv(made_.modelfile, made_.design, ())))
    values = {row["quantity"]: float(row["value"]) for row in rows}
    gain = np.abs(made_.design.errors.second_gain).sum()
    name = "model force per volt of the generator's second channel"
    assert values[name] == pytest.approx(gain, rel=1e-5)


def test_the_gate_s_first_step_follows_the_harmonics_of_either_channel() -> None:
    design, (response,) = (
        made("force beside base").design,
        made("force beside base").model_responses,
    )
    excitation = design.excitation(response.b, response.omega)
    reduction = nominal_reduction(design)
    orbit = on_circuit(reduction.system(), design, response)
    own = numerics_gate.GateSubject(reduction, excitation, orbit)
    assert excitation.second is not None
    turned = replace(
        excitation, shape=excitation.second.shape,
        second=replace(excitation.second, shape=excitation.shape),
    )  # fmt: skip
    steps = [
        numerics_gate.first_steps(replace(own, excitation=e), 1.0) for e in (excitation, turned)
    ]
    assert steps == [5 * numerics_gate.STEPS_PER_WAVE] * 2
