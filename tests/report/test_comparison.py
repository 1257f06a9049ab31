"""The comparison: each figure against a hand calculation, and the command that shows it."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer.base import figure_style
from designer.base.manifest import MANIFEST
from designer.catalog.fields import PRICE_CLASSES
from designer.catalog.parts_catalog import load_catalog
from designer.circuit import paper_values
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.netlist import Circuit
from designer.circuit.paper_values import ComparedCircuit
from designer.circuit.reduction import Reduction
from designer.cli import entry
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.circuit_table import CircuitSpec
from designer.model.find_responses import find
from designer.model.model_file import parse_model_file
from designer.model.response_table import Response
from designer.report import compare_plots, compare_table, comparison
from designer.report.comparison import OURS, DesignColumn, comparison_json
from tests.shared.model_text import COARSE_CIRCUIT

pytestmark = pytest.mark.usefixtures("designs_are_made_once")

CATALOG = load_catalog()
PAPER, SPEC = paper_values.MODEL, CircuitSpec()
BASE = (
    """\
format = 1
title = "small"
[model]
m = 0.5
k = 0.5
k0 = {k0}
c = 0.5
zeta = 0.1
f20 = 0.0
b = 0.25
[[response]]
omega = 0.85
expect = "1-2-2"
"""
    + COARSE_CIRCUIT
)
SMALL = BASE.format(k0=0.95)


@pytest.fixture(scope="module")
def columns() -> dict[str, DesignColumn]:
    """The paper's columns, for one response at ω = 0.85 and one that nothing is expected of."""
    found = find(PAPER, [*parse_model_file(SMALL).responses, Response(1.55)])
    return {
        c.name: comparison.column(c, PAPER, found, SPEC, CATALOG)
        for c in paper_values.candidates(PAPER, SPEC, CATALOG)
    }


def test_printed_values_show_what_the_errata_say(columns: dict[str, DesignColumn]) -> None:
    """μ = 21.06 · 20/20.88 = 20.17; b = 0.25 · 1.2346/1.28; 357.419 Hz for 355.88 Hz."""
    printed = columns["paper, as printed"]
    mu = 21.06 * 20.0 / 20.88
    assert printed.k0 == pytest.approx(mu / (1.0 + mu), rel=1e-9)
    assert round(printed.k0, 3) == 0.953
    assert printed.b == pytest.approx(13.0 / 210.6 * 100.0 / 20.0 / 1.28, rel=1e-9)
    assert round(printed.b, 3) == 0.241
    right = 1.0 / (2.0 * math.pi * math.sqrt(1e-4 * 20e3 * 100e-9))
    assert printed.frequency_error == pytest.approx(math.log(357.419 / right), rel=1e-9)
    assert printed.errors is not None
    assert printed.errors.scales.threshold == pytest.approx(13.0 / 210.6, rel=1e-9)
    assert [s.is_wanted for s in printed.settled] == [True, True]


def test_corrected_values_have_these_right(columns: dict[str, DesignColumn]) -> None:
    for name in ("paper, corrected", "paper, corrected, rounded"):
        assert columns[name].b == pytest.approx(0.25, rel=1e-9)
        assert columns[name].frequency_error == pytest.approx(0.0, abs=1e-12)
    assert columns["paper, corrected"].k0 == pytest.approx(0.95, rel=1e-12)


def test_f20_by_the_ratio_of_the_driving_resistors() -> None:
    """P2/P1 = R6 C2/(R12 C4), whatever the other parts are."""
    model = replace(PAPER, f20=0.3)
    values = paper_values.way(model) | {"R12": 300e3}
    circuit = paper_values.circuit(model, values, CATALOG.opamp("TL074C"))
    candidate = ComparedCircuit("x", "", circuit, *paper_values.generator(model, values))
    got = comparison.column(candidate, model, [], SPEC, CATALOG)
    assert got.f20 == pytest.approx(1.0 / (1.0 + 3.0), rel=1e-9)
    assert got.b == pytest.approx(0.25, rel=1e-9)
    assert got.settled == ()
    assert got.loads.sections == ()
    assert got.current is None


def test_parts_and_price_by_counting(columns: dict[str, DesignColumn]) -> None:
    """11 + 1 + 8 + 11 resistors (R12 and the stops' R50 counted once), 4 capacitors, 3 packages."""
    printed = columns["paper, as printed"].bill
    assert printed.parts == 11 + 1 + 8 + 11 + 4 + 3
    assert printed.packages == 3
    # 5 kΩ and 9 kΩ are in no series up to E96; the others are 0.6 to 1.2 % from one.
    off = {"R2", "R3", "R8", "R9", "R50", "R200", "R203", "R204", "R207"}
    assert set(printed.unsold) == off
    circuit = columns["paper, as printed"].candidate.circuit
    r = len({x.value for x in circuit.resistors})
    assert printed.distinct == r + 2
    rounded = columns["paper, corrected, rounded"]
    assert rounded.bill.unsold == ()
    own = rounded.candidate.circuit
    price = sum(
        PRICE_CLASSES[CATALOG.part("resistor", x.value, 0.01).price - 1] for x in own.resistors
    )
    price += sum(
        PRICE_CLASSES[CATALOG.part("capacitor", x.value, 0.01).price - 1] for x in own.capacitors
    )
    price += 3 * PRICE_CLASSES[CATALOG.opamp("TL074C").price - 1]
    assert rounded.bill.price == pytest.approx(price)
    assert printed.price == pytest.approx(price - 9 * PRICE_CLASSES[0])


def corrected() -> Circuit:
    return paper_values.circuit(PAPER, paper_values.corrected(), CATALOG.opamp("TL074C"))


def with_offset(section: str, volts: float) -> Board:
    board = nominal_board(corrected(), ideal=True)
    return replace(board, offset={section: volts}, inverse_gain=1e-9)


def edge(board: Board, rest: np.ndarray[Any, np.dtype[np.float64]], side: int) -> float:
    """v1 where contact begins, found by halving on the mode that holds."""
    system = Reduction(corrected(), board).system()
    inside, outside = 0.0, side * 0.2
    for _ in range(60):
        middle = 0.5 * (inside + outside)
        x = rest.copy()
        x[0] = middle
        if system.mode(system.mode_at(x, 0.0)).sides[0]:
            outside = middle
        else:
            inside = middle
    return outside


def test_offset_share_is_that_of_boards_at_rest() -> None:
    """One section's offset at a time, on a board left alone until it rests."""
    volts, squares = 2e-5, 0.0
    for section in corrected().sections:
        board = with_offset(section.name, volts)
        system = Reduction(corrected(), board).system()
        flow = Flow(system, Drive(2.0 * np.pi * 300.0, 0.0))
        rest = flow.run(np.zeros(4), 600).strobes[-1]
        shift = rest[0] - 0.5 * (edge(board, rest, 1) + edge(board, rest, -1))
        squares += float(shift / volts) ** 2
    share = comparison.offset_share(corrected(), CATALOG.opamp("TL074C"))
    assert share is not None
    threshold = 13.0 / 210.6
    assert share.typical == pytest.approx(3e-3 * math.sqrt(squares) / threshold, rel=1e-4)
    assert share.maximum == pytest.approx(10.0 / 3.0 * share.typical, rel=1e-12)


def test_offset_of_u3a_by_hand() -> None:
    """fv moves by -(1 + A-) δ; at rest v1/R4 - v3/R5 + fv/R50 = 0 and v3 = v1 R11/R10."""
    circuit, delta = corrected(), 1e-5
    values = circuit.values
    force = -(1.0 + 21.06) * delta / values["R50"]
    want = -force / (1.0 / values["R4"] - values["R11"] / (values["R10"] * values["R5"]))
    nominal, width = comparison._distances(circuit, nominal_board(circuit, ideal=True))
    moved, _ = comparison._distances(circuit, with_offset("U3A", delta))
    assert comparison._shift(moved, nominal) == pytest.approx(want, rel=1e-6)
    assert width == pytest.approx(13.0 / 210.6, rel=1e-9)


def test_no_clearance_no_share() -> None:
    linear = replace(PAPER, k0=0.0)
    circuit = paper_values.circuit(linear, paper_values.way(linear), CATALOG.opamp("TL074C"))
    assert comparison.offset_share(circuit, CATALOG.opamp("TL074C")) is None
    candidate = ComparedCircuit("linear", "", circuit, *paper_values.generator(linear,
    circuit.values
        | {n: paper_values.PRINTED[n] for n in ("R200", "R201", "R202", "R203")}))  # fmt: skip
    got = comparison.column(candidate, linear, find(linear, [Response(0.9)]), SPEC, CATALOG)
    assert math.isnan(got.k0)
    assert math.isnan(got.b)
    assert got.settled[0].orbit.response == "1-0-0"
    assert got.settled[0].is_wanted
    assert comparison_json([got])["columns"][0]["offset"] is None


def test_what_cannot_be_computed_leaves_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(*_: Any, **__: Any) -> None:
        raise ArithmeticError("coefficients of the wrong sign: x2'' x1")

    monkeypatch.setattr(comparison, "coefficient_errors", wrong)
    candidate = paper_values.candidates(PAPER, SPEC, CATALOG)[1]
    got = comparison.column(candidate, PAPER, find(PAPER, [Response(0.85)]), SPEC, CATALOG)
    assert got.errors is None
    assert "x2'' x1" in got.reason
    assert got.settled[0].orbit.status is OrbitStatus.PERIODIC  # from rest
    assert got.current is not None
    answer = comparison_json([got])["columns"][0]
    assert answer["max_error"] is None
    assert answer["k0"] is None
    assert answer["peaks"]["U3C"]["high"] == pytest.approx(13.0)
    # Drawn all the same.
    assert "<svg" in figure_style.to_svg(compare_plots.comparison([answer]))


def test_amplifiers_of_duals_stand_in_the_rows_of_the_papers() -> None:
    """The corrected circuit from quads and from duals: equal peaks, each under the paper's name."""
    quads = paper_values.candidates(PAPER, SPEC, CATALOG)[1]
    values = quads.circuit.values
    duals = paper_values.circuit(PAPER, values, CATALOG.opamp("TL072C"))
    found = find(PAPER, [Response(0.85)])
    got = [
        comparison.column(replace(quads, circuit=circuit), PAPER, found, SPEC, CATALOG)
        for circuit in (quads.circuit, duals)
    ]
    paper, other = comparison_json(got)["columns"]
    assert "paper_names" not in paper
    assert other["paper_names"]["U2A"] == "U2C", "the integrator of M1's velocity"
    assert list(other["peaks"]) == [s.name for s in duals.sections]
    assert compare_table.peaks(other) == paper["peaks"]
    rows = {row[0]: row[1:] for row in compare_table.rows({"columns": [paper, other]})}
    assert all(len(set(cells)) == 1 for name, cells in rows.items() if "peak" in name)
    assert sum("peak" in name for name in rows) == 12
    assert (paper["packages"], other["packages"]) == (3, 6)


def test_the_picture_of_next_to_nothing() -> None:
    """One column without errors, peaks or offsets: said in each panel, and no warning."""
    candidate = paper_values.candidates(PAPER, SPEC, CATALOG)[1]
    answer = comparison_json([comparison.column(candidate, PAPER, [], SPEC, CATALOG)])["columns"][0]
    empty = answer | {"errors": None, "peaks": {}, "offset": None}
    figure = compare_plots.comparison([empty])
    said = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert said == ["no coefficient could be compared", "no response is wanted", "no clearance"]
    assert "<svg" in figure_style.to_svg(figure)


def test_a_circuit_that_is_driven_too_hard_says_so() -> None:
    candidate = paper_values.candidates(PAPER, SPEC, CATALOG)[1]
    loud = replace(candidate, amplitude=250.0 * candidate.amplitude)
    got = comparison.column(loud, PAPER, find(PAPER, [Response(0.85)]), SPEC, CATALOG)
    assert not got.settled[0].is_wanted
    assert got.b == pytest.approx(0.25 / 250.0, rel=1e-6)
    assert max(load.peak for load in got.loads.sections if load.section == "U1A") > 12.9


# ---------------------------------------------------------------------------------------------
# The command


def model(folder: Path, text: str = SMALL) -> Path:
    path = folder / "small.toml"
    path.write_text(text, encoding="utf-8")
    return path


def tree(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def printed(arguments: list[str | Path], capfd: pytest.CaptureFixture[str]) -> tuple[Any, str]:
    assert entry.status([str(a) for a in arguments]) == 0
    out, err = capfd.readouterr()
    return json.loads(out) if out else None, err


def test_another_system_has_no_circuit_of_the_paper_s(capfd: pytest.CaptureFixture[str]) -> None:
    path = Path(__file__).parents[2] / "examples" / "duffing-gap.toml"
    assert entry.status(["synthesise", str(path), "--compare"]) == 2
    said = capfd.readouterr().err
    assert f"{path}: --compare: found a file of format 2" in said


@pytest.mark.slow
def test_without_a_folder_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    path = model(tmp_path)
    monkeypatch.chdir(tmp_path)
    answer, err = printed(["synthesise", path, "--compare", "--json"], capfd)
    assert list(tree(tmp_path)) == ["small.toml"]
    assert "Side by side" not in err
    named = [c["name"] for c in answer["comparison"]["columns"]]
    assert named == ["paper, as printed", "paper, corrected", "paper, corrected, rounded", OURS]
    ours = answer["comparison"]["columns"][-1]
    assert ours["parts"] == answer["parts"]
    assert ours["max_error"] == answer["max_error"]
    assert ours["errors"] == answer["errors"]
    assert ours["distinct_values"] == answer["distinct_values"]
    assert ours["amplitude_v_peak"] == answer["knobs"][0]["amplitude_v_peak"]
    assert ours["responses"] == [
        {"omega": 0.85, "expected": "1-2-2", "circuit": "1-2-2", "kept": True, "reason": ""}
    ]
    assert answer["comparison"]["printed_in"]["R50"] == "Section 5.1, from Eq. (14)"
    assert answer["cost"]["comparison_seconds"] > 0.0


@pytest.mark.slow
def test_a_folder_holds_it_and_is_reused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path, out = model(tmp_path, BASE.format(k0=0.94)), tmp_path / "design"
    plain, _ = printed(["synthesise", path, "--out", out, "--json"], capfd)
    before = tree(out)
    answer, err = printed(["synthesise", out, "--compare", "--json"], capfd)
    after = tree(out)
    assert set(after) - set(before) == {"compare.json", "compare.svg", "compare.png"}
    assert {n: c for n, c in after.items() if n in before and n != MANIFEST} == {
        n: c for n, c in before.items() if n != MANIFEST
    }
    assert {k: v for k, v in answer.items() if k not in ("comparison", "cost")} == {
        k: v for k, v in plain.items() if k != "cost"
    }
    assert [c["name"] for c in answer["comparison"]["columns"]] == [
        "paper's way", "paper's way, rounded", OURS,
    ]  # fmt: skip
    manifest = json.loads(after[MANIFEST])
    assert manifest["complete"] is True
    assert manifest["files"]["compare.svg"]["stage"] == "comparison"
    # The same again, from the model file and with a table: nothing is computed, nothing changes.
    _, err = printed(["synthesise", path, "--out", out, "--compare"], capfd)
    assert tree(out) == after
    assert "was there already" in err
    for word in ("Side by side", "k0 as built", "paper's way, rounded", "peak U3C", "1 of 1"):
        assert word in err
    again, _ = printed(["synthesise", path, "--out", out, "--json"], capfd)
    assert "comparison" not in again
    # Times are not part of what a file is held to, so they may be gone.
    for name in ("design.json", "compare.json"):
        content = json.loads(after[name])
        del content["cost"]
        (out / name).write_text(json.dumps(content), encoding="utf-8")
    timeless, _ = printed(["synthesise", path, "--out", out, "--compare", "--json"], capfd)
    assert timeless == answer | {"cost": {"comparison_seconds": None}}
    # A file that was changed is not trusted.
    (out / "compare.json").write_text("{}", encoding="utf-8")
    assert entry.status(["synthesise", str(out), "--compare"]) == 2
    assert "compare.json" in capfd.readouterr().err


@pytest.mark.slow
def test_equal_runs_give_equal_files_and_another_design_takes_them_away(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path, out = model(tmp_path), tmp_path / "design"
    printed(["synthesise", path, "--out", out, "--compare", "--json"], capfd)
    after = tree(out)
    other = tmp_path / "other"
    printed(["synthesise", path, "--out", other, "--compare", "--json"], capfd)
    for name in ("compare.svg", "compare.png"):
        assert (other / name).read_bytes() == after[name]
    free = [
        json.loads(c) | {"cost": None} for c in (after["compare.json"], tree(other)["compare.json"])
    ]
    assert free[0] == free[1]
    # Another design takes its comparison with it.
    model(tmp_path, BASE.format(k0=0.96))
    printed(["synthesise", path, "--out", out, "--overwrite", "--json"], capfd)
    assert not (out / "compare.json").exists()
    assert not (out / "compare.png").exists()
