"""Stops with damping, or a restitution: chosen parts, the exact circuit's boards, and ngspice."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import permutations

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.board.kicad_sim import directives
from designer.check.deck_runs import FirstRun
from designer.check.synthesis_result import Synthesis, synthesise
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Capacitor, Excitation
from designer.circuit.nominal import circuit_flow, nominal_reduction, on_circuit
from designer.dynamics.orbit import OrbitStatus
from designer.jobs.bench_job import check_fits
from designer.model.model_file import parse_model_file
from designer.spice import deck, equation_check
from designer.spice.deck import SolverSettings
from designer.spice.pool import SpicePool
from designer.spice.worker import open_simulator
from designer.spread.spread import Spread, draw_many
from designer.workbench.force_balance import ForceBalance
from designer.workbench.prediction import POINTS as WAVE_POINTS, BoardPrediction
from tests.shared.exploring import quick
from tests.shared.system_text import clearance, system_text, table
from tests.synthesis.test_law_circuits import shows_what_the_model_does

DRIVE = table("force", on="ball", amplitude=1.0) + table("response", omega=1.3)


def one(*more: str) -> str:
    ground = ("ball", "ground")
    return system_text({"ball": 1.0}, {ground: 1.0}, {ground: 0.1}, *more, DRIVE)


TEXTS = {
    "restitution": one(
        clearance("A", "ball", "ground", upper=0.5, stiffness=20.0, restitution=0.7)
    ),
    "both sides": one(
        clearance("A", "ball", "ground", upper=0.4, lower=0.6, stiffness=15.0, damping=0.8)
    ),
    "lower, in steps": one(
        clearance(
            "A", "ball", "ground", lower=0.5, stiffness=10.0, damping=0.5, preload=0.2,
            preload_over=0.1,
        )
    ),
    "between masses": system_text(
        {"ball": 1.0, "table": 2.0},
        {("ball", "table"): 1.0, ("table", "ground"): 3.0},
        {("ball", "table"): 0.1, ("table", "ground"): 0.3},
        clearance("A", "ball", "table", upper=0.5, lower=0.3, stiffness=15.0, damping=0.6),
        clearance("B", "table", "ground", upper=0.2, stiffness=12.0, restitution=0.5),
        table("force", on="ball", amplitude=1.0),
        table("response", omega=0.9),
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def pool() -> Iterator[SpicePool]:
    """Workers that import the package once, for all tests of this file."""
    with SpicePool(2) as workers:
        yield workers


@cache
def made(name: str) -> Synthesis:
    return synthesise(parse_model_file(TEXTS[name]))


def excitation_of(result: Synthesis) -> Excitation:
    design, (response,) = result.design, result.model_responses
    return design.excitation(response.b, response.omega)


@pytest.mark.parametrize("name", quick(TEXTS))
def test_chosen_parts_do_what_the_model_does(name: str) -> None:
    result = made(name)
    shows_what_the_model_does(result)
    circuit = result.design.circuit
    dampers = {c.name: c.role for c in circuit.dependent_capacitors}
    wanted = {"C50", "C51", "C60"} if name == "between masses" else {"C50"}
    assert dampers.keys() == wanted
    assert all(role.startswith("damper of the stop force") for role in dampers.values())
    assert any("stop damping" in error for error in result.design.errors.errors)


def with_damper(result: Synthesis, factor: float) -> Synthesis:
    circuit = result.design.circuit
    parts = tuple(
        replace(p, value=factor * p.value) if isinstance(p, Capacitor) and p.name == "C50" else p
        for p in circuit.parts
    )
    return replace(result, design=replace(result.design, circuit=replace(circuit, parts=parts)))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["restitution", "both sides"])
def test_ngspice_s_transfer_functions_know_the_damper(name: str, pool: SpicePool) -> None:
    """In each contact they are the model's; with another damper they are not, and only there."""
    right, wrong = (
        equation_check.check(each.design, each.model_responses, pool)
        for each in (made(name), with_damper(made(name), 1.1))
    )
    assert right.passed, right.problem
    assert {f.name.split(",")[0] for f in wrong.findings if not f.passed} == {"transfer"}
    assert not any(f.name == "transfer, open" for f in wrong.findings if not f.passed)


@pytest.mark.parametrize("name", quick(TEXTS))
def test_ngspice_moves_as_the_exact_circuit_does(name: str) -> None:
    """Two periods from a state in contact: the deck gives every damper the voltage that it has."""
    result = made(name)
    design, (response,) = result.design, result.model_responses
    reduction = nominal_reduction(design)
    system, circuit = reduction.system(), design.circuit
    excitation, flow = excitation_of(result), circuit_flow(system, design, response)
    orbit = on_circuit(system, design, response)
    fine = flow.run(orbit.start, orbit.n, mode=orbit.mode, points=400)
    output = np.array([
        reduction.output(system.mode_at(x, u), circuit.stops[0].output, x[None, :], np.array([u]))
        for x, u in zip(fine.strobes, -excitation.amplitude
                        * np.sin(2.0 * np.pi * np.arange(len(fine.strobes)) / 400), strict=True)
    ])[:, 0]  # fmt: skip
    # A board that starts in contact has to start with its dampers charged; a phase of 0 is open.
    # So the drive is turned: the deepest point of a period becomes the start.
    deepest = int(np.argmax(np.abs(output)))
    assert abs(output[deepest]) > 0.2
    turn = (deepest % 400) / 400
    period = 1.0 / excitation.frequency
    text = deck.write(
        circuit, reduction.board, excitation, SolverSettings("trap", period / 4000),
        title="a contact", stop_time=2.0 * period, initial=fine.strobes[deepest],
    )  # fmt: skip
    sine = re.search(r"SIN\(.*\)", text)
    assert sine is not None
    turned = sine[0].replace(" 180)", f" {180.0 + 360.0 * turn!r})")
    text = text.replace(sine[0], turned)
    line = next(line for line in text.splitlines() if line.startswith("C50 "))
    charged = float(line.partition("IC=")[2])
    assert charged == pytest.approx(output[deepest], abs=1e-3)
    waves = open_simulator("shared").run(text, circuit.state_nets, 2.0 * period)
    grid = np.arange(800) / 400 * period
    for k, net in enumerate(circuit.state_nets):
        wanted = np.take(fine.strobes[:-1, k], deepest + np.arange(800), mode="wrap")
        got = np.interp(grid, waves.axis, waves.signals[net])
        # ngspice's first points, a thousandth of a period, find the op-amps' outputs.
        assert np.abs(got - wanted)[2:].max() < 5e-3 * np.abs(wanted).max(), net


@pytest.mark.slow
@pytest.mark.parametrize("name", ["both sides", "between masses"])
def test_boards_that_leap_are_those_of_the_general_kernel(name: str) -> None:
    """Orbits and multipliers: these come from the jump of the rates where a contact begins."""
    result = made(name)
    design, (response,) = result.design, result.model_responses
    orbit = on_circuit(nominal_reduction(design).system(), design, response)
    boards = draw_many(design.circuit, Spread(0.01, 0.01, 1e-3, 4e-3), 5, range(3))
    drive = excitation_of(result).drive
    asked = range(3), [drive] * 3, np.tile(orbit.start, (3, 1))
    fast, slow = Ensemble(boards), Ensemble(boards, fast=False)
    for a, b in zip(fast.settle(*asked), slow.settle(*asked), strict=True):
        assert a.status is b.status is OrbitStatus.PERIODIC
        assert a.counts == b.counts
        peak = np.abs(b.extremes).max(axis=1)
        assert np.abs((a.start - b.start) / peak).max() < 1e-9
        assert a.radius == pytest.approx(b.radius, rel=1e-6)
    assert len(fast._reductions) <= 1, "the compiled way serves all but what settles slowly"


def test_multipliers_are_those_of_the_period_map() -> None:
    """By differences of the flow itself, which has no need of a formula for the jump."""
    result = made("restitution")
    design, (response,) = result.design, result.model_responses
    system = nominal_reduction(design).system()
    orbit = on_circuit(system, design, response)
    flow, step = circuit_flow(system, design, response), 1e-6

    def after(x: Array) -> Array:
        return np.asarray(flow.run(x, orbit.n).strobes[-1])

    columns = [
        (after(orbit.start + step * e) - after(orbit.start - step * e)) / (2.0 * step)
        for e in np.eye(len(orbit.start))
    ]
    radius = np.abs(np.linalg.eigvals(np.array(columns).T)).max()
    assert orbit.radius == pytest.approx(radius, rel=1e-4)


def test_what_one_capacitor_cannot_damp_is_refused() -> None:
    text = one(
        clearance(
            "A", "ball", "ground", upper=0.4, lower=0.6, upper_stiffness=15.0,
            lower_stiffness=10.0, damping=0.8,
        )
    )  # fmt: skip
    with pytest.raises(InputError) as caught:
        synthesise(parse_model_file(text))
    assert caught.value.field == "clearance A.damping"
    assert "a [[clearance]] for each" in caught.value.expected
    for key, value in (("matched", [["R1", "R2"]]), ("most_values", 12)):
        with pytest.raises(InputError, match=r"stops with damping \(A\)"):
            synthesise(parse_model_file(TEXTS["both sides"] + f"[circuit]\n{key} = {value!r}\n"))
    saturating = parse_model_file(TEXTS["restitution"] + '[circuit]\ndead_zone = "saturation"\n')
    with pytest.raises(InputError, match="never quite flat"):
        synthesise(saturating)


def test_a_record_balances_with_the_force_of_its_dampers() -> None:
    """The exact waves of the nominal board, by their own nets."""
    prediction = BoardPrediction(made("both sides"))
    (shown,) = prediction.responses
    nets = prediction.nets
    waves = np.column_stack([np.tile(shown.waves[net], 8) for net in nets])
    time = np.arange(len(waves)) / (WAVE_POINTS * shown.setting.frequency_hz)
    balance = ForceBalance(prediction, time, waves, np.zeros(waves.shape, dtype=bool))
    own = balance.balance(nets).misfit
    others = (balance.balance(way).misfit for way in permutations(nets) if way != nets)
    assert own < 0.05
    assert all(not misfit < 20.0 * own for misfit in others)


@pytest.mark.parametrize("option", ["fit", "boards"])
def test_no_board_with_dampers_is_fitted(option: str) -> None:
    asked = {"fit": False, "boards": False} | {option: True}
    with pytest.raises(InputError, match="dampers in its stops") as refused:
        check_fits(BoardPrediction(made("restitution")), **asked, decays=[])
    assert refused.value.field == f"--{option}"


def test_the_sheet_s_simulation_starts_with_charged_dampers() -> None:
    """In contact at the drive's phase 0."""
    text = system_text(
        {"ball": 1.0}, {("ball", "ground"): 1.0}, {("ball", "ground"): 0.1},
        clearance("A", "ball", "ground", upper=0.4, lower=0.4, stiffness=6.0, damping=0.8),
        table("force", on="ball", amplitude=1.0), table("response", omega=1.6),
    )  # fmt: skip
    result = synthesise(parse_model_file(text))
    design, (response,) = result.design, result.model_responses
    reduction = nominal_reduction(design)
    orbit = on_circuit(reduction.system(), design, response)
    key = reduction.system().mode_at(orbit.start, 0.0)
    fv = reduction.output(key, "fv", orbit.start[None], np.zeros(1))[0]
    assert abs(fv) > 0.5
    run = FirstRun(excitation_of(result), SolverSettings("trap", 1e-6), 1e-3, orbit.start)
    line = next(line for line in directives(design.circuit, run) if line.startswith(".ic v(/fv)"))
    assert float(line.partition("=")[2]) == pytest.approx(fv, abs=1e-3)
