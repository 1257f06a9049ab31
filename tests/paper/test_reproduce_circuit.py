"""``designer reproduce circuit``: its pieces against what is known otherwise, and its folder."""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer.base.errors import InputError
from designer.catalog.parts_catalog import load_catalog
from designer.circuit import paper_values
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.reduction import Reduction
from designer.cli import entry
from designer.fidelity import runge_kutta
from designer.fidelity.cpu_clock import Entrant, here, rounds
from designer.model.find_responses import ModelResponse, find
from designer.model.model import Dimensionless
from designer.paper import misprints, reproduce_circuit
from designer.paper.circuit_page import _between
from designer.paper.circuits import (
    CORRECTED,
    PRINTED,
    Built,
    build,
    dc_curve,
    follow,
    model_flow,
    model_with,
)
from designer.paper.misprints import MISPRINTS, apply
from designer.paper.reproduce_circuit import (
    CircuitExtent,
    _stage,
    names,
    reproduce,
    shifts,
    signs,
    stage_curve,
)
from designer.spice.pool import SpicePool

CATALOG = load_catalog()
SMALL = CircuitExtent(p=(1,), circuits=(PRINTED, CORRECTED), patterns=4, clocked=(1,), rounds=2)


@cache
def corrected() -> Built:
    return build(CORRECTED, CATALOG)


@cache
def first() -> tuple[ModelResponse, ...]:
    made = model_with("saturation")
    return find(made.model, made.responses[:1])


@pytest.mark.parametrize("sides", ["both", "upper", "lower"])
def test_runge_kutta_computes_the_model_in_each_of_its_forms(sides: str) -> None:
    """Against an adaptive integrator that knows nothing of the project's kernels."""
    model = Dimensionless(0.4, 0.6, 0.8, 0.3, 0.07, 0.2, 0.3, sides)  # type: ignore[arg-type]
    system = model.second_order()
    A = system.state_matrix()
    B = np.zeros(4)
    B[1::2] = system.force / system.mass
    low = -model.b if sides != "upper" else -math.inf
    high = model.b if sides != "lower" else math.inf

    def rhs(t: float, x: np.ndarray) -> np.ndarray:
        out = A @ x + B * math.sin(0.9 * t)
        out[1] -= model.mu * (x[0] - min(max(x[0], low), high))
        return np.asarray(out)

    start = np.array([0.1, 0.5, -0.2, 0.3])
    span = 3 * 2.0 * math.pi / 0.9
    wanted = solve_ivp(rhs, (0.0, span), start, method="DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
    steps = 1000
    fast = runge_kutta.run(model, 0.9, start, 3, steps)
    np.testing.assert_allclose(fast, wanted, atol=2e-5)
    slow = runge_kutta.run(model, 0.9, start, 3, steps, carry=runge_kutta.numbers)
    np.testing.assert_allclose(slow, fast, rtol=1e-11)
    np.testing.assert_allclose(
        runge_kutta.run_arrays(model, 0.9, start, 3, steps), fast, rtol=1e-11
    )
    drawn = runge_kutta.trace(model, 0.9, start, 3, 50, steps)
    np.testing.assert_allclose(drawn[-1], fast, rtol=1e-11)
    fine = runge_kutta.run(model, 0.9, start, 3, 32 * steps)
    assert np.abs(fine - wanted).max() < 0.1 * np.abs(fast - wanted).max()


def test_the_dc_curve_is_eq_20() -> None:
    """f = A− v1 - β clip(A+ v1, ± Esat), with the divider loaded, up to the op-amps' gain."""
    v = paper_values.PRINTED
    v1 = np.linspace(-0.15, 0.15, 61)
    steep = v["R201"] * v["R203"] / (v["R200"] * v["R202"])
    lower = 1.0 / (1.0 / v["R205"] + 1.0 / v["R208"])
    beta = lower / (v["R204"] + lower)
    wanted = v["R207"] / v["R206"] * v1 - beta * np.clip(steep * v1, -13.0, 13.0)
    np.testing.assert_allclose(dc_curve(build(PRINTED, CATALOG), v1), wanted, atol=2e-3)


@pytest.mark.slow
def test_ngspice_draws_the_same_curve_of_the_stage_alone() -> None:
    assert _stage(corrected().circuit) == {
        *(f"R{i}" for i in range(200, 211)), "U3A", "U3B", "U3C", "U3D"
    }  # fmt: skip
    with SpicePool(1) as pool:
        curve = stage_curve(pool, corrected().circuit, 0.12, 40)
    assert len(curve) == 41
    np.testing.assert_allclose(curve[:, 1], dc_curve(corrected(), curve[:, 0]), atol=1e-4)


def wanted_error(where: str) -> float:
    """The coefficient error of a misprint by hand, without its scales: at least half the size of
    the wrong ratio, for scales can share an error between two coefficients only."""
    m = paper_values.MODEL
    return {
        "Eq. (4), mass": math.log((m.m / (1 - m.m)) / (1 - m.m)),
        "Eq. (4), damping": math.log(1 / (1 - m.c)),
        "Eq. (4), stiffness": 2 * math.log(1 / (1 - m.k)),
        "Eq. (14), last line": math.log(10.0 / 2.0),
        "R50": math.log(22.1684 / 20.88),
    }[where]


@pytest.mark.parametrize(
    "where",
    ["Eq. (4), mass", "Eq. (4), damping", "Eq. (4), stiffness", "Eq. (14), last line", "R50"],
)
def test_a_misprint_changes_what_it_says(where: str) -> None:
    """The product of all ratios is free of scales: errors can be shared, not hidden."""
    (misprint,) = (m for m in MISPRINTS if m.where == where)
    one = apply(misprint, CATALOG)
    assert one.errors is not None
    wrong, base = wanted_error(where), 5e-4
    assert wrong / 4.0 - base < one.errors.max_error < wrong + base


def test_the_generators_misprints_leave_the_coefficients() -> None:
    right = misprints.corrected(CATALOG)
    by = {m.where: m for m in MISPRINTS}
    for where, frequency, amplitude in (
        ("Eq. (15) with Eq. (18)", 1.0, 1.28 / right.amplitude),
        ("Eq. (16), formula", 2.0, 1.0),
        ("Eq. (16), number", 357.419 / right.frequency, 1.0),
    ):
        misprint = by[where]
        assert misprint.build is not None
        made = misprint.build(CATALOG)
        assert made.circuit.values == right.circuit.values
        assert made.frequency / right.frequency == pytest.approx(frequency)
        assert made.amplitude / right.amplitude == pytest.approx(amplitude)
    other = by["Eq. (15)"].build
    assert other is not None
    driven = {r.name for r in other(CATALOG).circuit.resistors if "vg" in r.nets}
    assert driven == {"R12"}


def test_a_wrong_frequency_shows_in_the_response_and_not_in_the_coefficients() -> None:
    by = {m.where: m for m in MISPRINTS}
    (twice,) = follow(apply(by["Eq. (16), formula"], CATALOG), first())
    # The model itself at twice the frequency, from the same orbit, does not touch the stops.
    reached = model_flow(2 * 1.55).run(first()[0].orbit.start, 400).strobes[-1]
    later = model_flow(2 * 1.55).run(reached, 1, points=200).strobes[:, 0]
    assert np.abs(later).max() < paper_values.MODEL.b
    assert twice.orbit.response == "1-0-0"
    assert not twice.kept
    (right,) = follow(corrected(), first())
    assert right.kept
    assert right.error < 1e-3


def test_sign_patterns_are_all_or_a_draw_without_repetition() -> None:
    assert {tuple(row) for row in signs(3)} == {
        (a, b, c) for a in (1.0, -1.0) for b in (1.0, -1.0) for c in (1.0, -1.0)
    }
    few = signs(12, 100)
    assert few.shape == (100, 12)
    assert len({tuple(row) for row in few}) == 100
    np.testing.assert_array_equal(few[0], np.ones(12))
    np.testing.assert_array_equal(few, signs(12, 100))


@pytest.mark.slow
def test_offsets_are_those_of_single_boards() -> None:
    """Each pattern by itself, by the general settling: counts must be the same."""
    from dataclasses import replace

    from designer.dynamics.attractors import settle
    from designer.dynamics.flow import Flow

    (row,) = shifts(corrected(), first(), 3e-3, most=6)
    one = corrected()
    drive = one.excitation(1.55).drive
    own = settle(Flow(one.reduction().system(), drive), first()[0].orbit.start * one.volts)
    kept = 0
    for pattern in signs(12, 6):
        names_ = [s.name for s in one.circuit.sections]
        board = replace(
            nominal_board(one.circuit), offset=dict(zip(names_, 3e-3 * pattern, strict=True))
        )
        flow = Flow(Reduction(one.circuit, board).system(), drive, fast=False)
        kept += settle(flow, own.start).response == "1-1-1"
    assert row["there"]
    assert row["counted"]["ok"] == kept
    assert sum(row["counted"].values()) == 6


def test_rounds_take_turns_and_count_a_period() -> None:
    order: list[str] = []

    def work(name: str, seconds: float) -> float:
        order.append(name)
        return seconds

    both = [
        Entrant("a", 10, lambda: work("a", 1.0)),
        Entrant("b", 4, lambda: work("b", 2.0)),
    ]
    np.testing.assert_allclose(rounds(both, 3), [[0.1, 0.5]] * 3)
    assert order == ["a", "b"] * 3
    runs: list[int] = []
    made = here("c", lambda n: runs.append(n), 5)
    assert made.periods % 5 == 0
    made.work()
    assert runs[-1] == made.periods


def test_a_share_is_a_shade_between_two() -> None:
    assert _between("#000000", "#ffffff", 0.0) == "#000000"
    assert _between("#000000", "#ffffff", 1.0) == "#ffffff"
    assert _between("#000000", "#0a1428", 0.5) == "#050a14"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("circuit") / "out"
    reproduce(out, jobs=2, extent=SMALL)
    return out


@pytest.mark.slow
def test_the_folder_says_what_was_found(made: Path) -> None:
    said = json.loads((made / "circuit.json").read_text(encoding="utf-8"))
    printed = said["circuit-printed"]
    errors = coefficient_errors(build(PRINTED, CATALOG).circuit, paper_values.MODEL.second_order())
    assert printed["max_error"] == errors.max_error
    assert printed["responses"][0]["circuit"] == "1-1-1"
    assert printed["responses"][0]["ngspice"] == "1-1-1"
    assert printed["responses"][0]["error"] == pytest.approx(
        printed["responses"][0]["ngspice_error"], rel=0.05
    )
    (timed,) = said["clock"]["responses"]
    by = {m["name"]: m for m in timed["methods"]}
    assert by["Runge-Kutta, NumPy"]["ratio"] == 1.0
    assert 0.0 < by["Runge-Kutta, numba"]["error"] < 1e-4
    assert by["exact flow, model"]["error"] == 0.0
    assert 0.0 < by["ngspice, ideal op-amps"]["error"] < 2e-3
    assert all(m["seconds"] > 0.0 for m in by.values())
    assert {p.name for p in made.iterdir()} == {*names(SMALL), "cases"}
    text = (made / "README.md").read_text(encoding="utf-8")
    assert f"`{reproduce_circuit.COMMAND}`" in text.splitlines()[2]
    for name in names(SMALL):
        if name.endswith(".png"):
            assert f"({name})" in text
            assert (made / name).read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_it_goes_on_where_it_was(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="--resume"):
        reproduce(made, jobs=1, extent=SMALL)
    with pytest.raises(InputError, match="other settings"):
        reproduce(made, jobs=1, extent=CircuitExtent(p=(1,), patterns=5), resume=True)
    before = {p.name: p.read_bytes() for p in made.iterdir() if p.is_file()}
    (made / "cases" / "offsets-corrected.json").unlink()
    worked: list[float] = []
    real = shifts
    from designer.paper import reproduce_circuit

    def counted(*args: object, **rest: object) -> object:
        worked.append(args[2])  # type: ignore[arg-type]
        return real(*args, **rest)  # type: ignore[arg-type]

    monkeypatch.setattr(reproduce_circuit, "shifts", counted)
    reproduce(made, jobs=1, extent=SMALL, resume=True)
    assert worked == [3e-3, 10e-3]
    for name, content in before.items():
        if name != "circuit.json":
            assert (made / name).read_bytes() == content


@pytest.mark.parametrize("name", ["README.md", "fig7.png", "circuit.json"])
def test_a_file_of_the_users_is_not_written_over(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=name):
        reproduce(tmp_path, jobs=1, extent=SMALL)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text(encoding="utf-8") == "mine"


def test_the_circuit_draws_no_seeded_boards(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert entry.status(["reproduce", "circuit", "--samples", "3", "--out", str(out)]) == 2
    assert "--samples" in capfd.readouterr().err
    assert not out.exists()
