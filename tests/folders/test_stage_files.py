"""Designs with either stage, through files, gate, study and report; parts chosen by hand."""

from __future__ import annotations

import math
import subprocess
from pathlib import Path
from typing import Any

import pytest

from designer.base.design_folder import Folder
from designer.base.plain_json import dumps
from designer.check import checked_design
from designer.check.synthesis_result import Synthesis
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.design import Certificate, Design
from designer.circuit.netlist import Circuit
from designer.folders import design_files
from designer.folders.json_answers import synthesis_json
from designer.folders.origin import provenance
from designer.model.circuit_table import DeadZone
from designer.model.clearance import Sides
from designer.model.find_responses import find
from designer.model.model_file import ModelFile, read_model_file
from designer.report.data import ReportData
from designer.report.write import render_html, render_markdown
from designer.spice.pool import SpicePool
from designer.verdicts.cross_check import ask_random
from designer.verdicts.ngspice_runs import cross_checks
from designer.yields.layers import samples_task
from designer.yields.study import RunResult, Study
from designer.yields.study_plan import plan_study
from tests.shared.exploring import quick
from tests.shared.quick_folders import without_starts
from tests.shared.stages import CATALOG, bought, one_sided, stage
from tests.spice.test_rectifier_ngspice import LOW, SCALED

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "paper.toml"
CASES: dict[str, tuple[DeadZone, Sides, dict[str, float], tuple[float, ...]]] = {
    "rectifier": ("rectifier", "both", SCALED, (1.55,)),
    "upper half": ("rectifier", "upper", LOW, (1.2,)),
    "lower half": ("rectifier", "lower", LOW, (0.41,)),
    "saturation, upper": ("saturation", "upper", bought(one_sided()), (1.2,)),
    "saturation, lower": ("saturation", "lower", bought(one_sided()), (0.54,)),
}


def made(name: str, tmp_path: Path) -> Synthesis:
    """The design as a synthesis would leave it."""
    kind, sides, values, omegas = CASES[name]
    text = EXAMPLE.read_text().replace('sides = "both"', f'sides = "{sides}"')
    text = text.replace('dead_zone = "saturation"', f'dead_zone = "{kind}"')
    text = text.split("[[response]]")[0] + text[text.index("[circuit]") :]
    for omega in omegas:
        text = text.replace("[circuit]", f"[[response]]\nomega = {omega}\n\n[circuit]")
    path = tmp_path / "model.toml"
    path.write_text(text)
    modelfile = read_model_file(path)
    circuit = stage(kind, sides, values)
    return Synthesis(modelfile, CATALOG, find(modelfile.model, modelfile.responses),
                     design_of(modelfile, circuit))  # fmt: skip


def design_of(modelfile: ModelFile, circuit: Circuit) -> Design:
    errors = coefficient_errors(circuit, modelfile.model.second_order())
    return Design(modelfile.model, circuit, errors, Certificate("bound", 0.0, "none"), {}, {}, 0.0)


@pytest.mark.parametrize("name", CASES)
def test_files_are_read_back_as_the_same_design(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_starts(monkeypatch)
    first = made(name, tmp_path)
    texts = design_files.texts(first)
    folder = Folder(tmp_path / "out")
    folder.path.mkdir()
    for file, text in texts.items():
        (folder.path / file).write_text(text)
    no_origin: Any = {}
    said: Any = synthesis_json(
        first.modelfile, first.design, first.model_responses, no_origin, first.seconds
    )
    (folder.path / "design.json").write_text(dumps(said))
    again = design_files.load(folder, first.modelfile, CATALOG)
    assert again.design.circuit == first.design.circuit
    zone = said["dead_zone"]
    assert zone["kind"] == CASES[name][0]
    assert abs(zone["slope_error"]) <= first.design.errors.max_error
    both = CASES[name][1] == "both"
    assert (zone["bias_error"] is None) is both
    assert math.isfinite(zone["threshold_lower"]) is (CASES[name][1] != "upper")


@pytest.mark.parametrize("name", ["rectifier", "saturation, upper"])
def test_the_deck_runs_in_plain_ngspice(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_starts(monkeypatch)
    deck = tmp_path / "circuit.cir"
    deck.write_text(design_files.texts(made(name, tmp_path))["circuit.cir"])
    done = subprocess.run(
        ["ngspice", "-b", str(deck)], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.returncode == 0
    rows = [r for r in done.stdout.splitlines() if r[:1].isdigit()]
    assert len(rows) > 1000
    assert "aborted" not in done.stderr


@pytest.mark.parametrize("name", quick(["rectifier", "upper half", "saturation, lower"]))
def test_gate_study_and_report(name: str, tmp_path: Path) -> None:
    """Every engine shows the same response; the report names the stage's parts."""
    first = made(name, tmp_path)
    with SpicePool(2) as pool:
        checked = checked_design.check(first.design, first.model_responses, pool)
        plan = plan_study(first.modelfile, first.design, checked, CATALOG, samples=2, seed=1)
        answers = samples_task(plan, range(2))(2, lambda: None)
        asks = ask_random(answers)
        heard = cross_checks(plan, asks, pool, 2)
    for c in checked:
        assert c.gate is not None
        assert c.gate.passed
        assert c.agrees, (c.model.orbit.response, c.circuit.response)
    known = {(a.sample, a.question): a for a in answers}
    assert len(heard) == len(asks) >= len(answers)
    assert all(h.agrees(known[h.sample, h.question]) is not False for h in heard)
    study = Study(
        checked, plan, tuple(range(len(checked))), {}, tuple(answers), cross_checks=tuple(heard)
    )
    source = provenance(first.modelfile, CATALOG.hash, seed=1, spread={})
    result = RunResult(
        first.modelfile, CATALOG, first.model_responses, first.design, checked, study, source
    )
    data = ReportData(result, "designer run model.toml")
    page = render_html(data)
    assert render_markdown(data)
    if CASES[name][0] == "rectifier":
        assert "1N4148" in page
        assert "LM4040C50" in page
