"""What a repair is asked: kinds by name, a place for the repaired design, a spread with picked
parts."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer.base.errors import InputError
from designer.base.progress import Progress, report_to
from designer.catalog.parts_catalog import load_catalog
from designer.centering.repair_branch import KINDS, kind_named
from designer.centering.repair_upgrade import Upgrades, upgraded_file
from designer.cli import entry
from designer.jobs.options import Options
from designer.jobs.repair_job import repair_into
from designer.model.model_file import ModelFile, parse_model_file
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from designer.verbs.search import KINDS as UPGRADES
from tests.shared import paper_cases
from tests.shared.model_text import COARSE_CIRCUIT, PAPER_TABLE
from tests.shared.quick_folders import quick_folder

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

CATALOG = load_catalog()
SMALL = (
    "format = 1\n"
    + PAPER_TABLE
    + """\
[[response]]
omega = 1.55
expect = "1-1-1"
"""
    + COARSE_CIRCUIT
)


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return quick_folder(SMALL, tmp_path_factory.mktemp("cure") / "design")


@pytest.fixture(scope="module")
def another(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Another design; tests work on copies."""
    text = SMALL.replace("omega = 1.55", "omega = 1.5")
    return quick_folder(text, tmp_path_factory.mktemp("another") / "design")


class _Worked(Exception):
    """Somebody was asked to work."""


class _NoWork(Progress):
    def stage(self, text: str, total: int | None = None) -> Any:
        raise _Worked(text)


@pytest.mark.parametrize(
    ("said", "meant"),
    [("dead-zone", "dead zone"), ("dead zone", "dead zone"), ("op-amp", "op-amp"),
     ("grade", "grade"), ("deadzone", None), ("", None)],
)  # fmt: skip
def test_a_kind_needs_no_quotes(said: str, meant: str | None) -> None:
    assert kind_named(said) == meant


def test_help_lists_every_kind() -> None:
    assert tuple(kind_named(name) for name in UPGRADES) == KINDS
    assert not any(" " in name for name in UPGRADES)


def test_an_unknown_kind_is_answered_with_the_known_ones(
    design: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["search", str(design), "--yield", "0.9", "--without", "dead-zones"]
    assert entry.status(asked) == 2
    told = capsys.readouterr().err
    assert "dead-zone" in told
    assert "Traceback" not in told


def test_kinds_by_either_name_are_the_same_inputs(design: Path, tmp_path: Path) -> None:
    """What is known of the folder afterwards says so."""
    said = []
    for name in ("dead-zone", "dead zone"):
        folder = Path(shutil.copytree(design, tmp_path / name))
        with pytest.raises(_Worked), report_to(_NoWork()):
            repair_into(folder, target=0.9, without=(name,))
        manifest = json.loads((folder / "manifest.json").read_text())
        said.append(manifest["stages"]["cure"]["inputs"]["without"])
    assert said == [["dead zone"], ["dead zone"]]


def test_a_place_with_a_design_is_refused_before_the_work(
    design: Path, another: Path, tmp_path: Path
) -> None:
    other = Path(shutil.copytree(another, tmp_path / "other"))
    before = {p.name: p.read_bytes() for p in other.iterdir() if p.is_file()}
    own = Path(shutil.copytree(design, tmp_path / "own"))
    with pytest.raises(InputError) as refused, report_to(_NoWork()):
        repair_into(own, target=0.9, out=other)
    assert refused.value.field == "--out"
    assert "cure" not in json.loads((own / "manifest.json").read_text())["stages"]
    assert {p.name: p.read_bytes() for p in other.iterdir() if p.is_file()} == before
    # The user says that it may go, or the place is free: then work begins.
    with pytest.raises(_Worked), report_to(_NoWork()):
        repair_into(own, target=0.9, out=other, options=Options(overwrite=True))
    third = Path(shutil.copytree(design, tmp_path / "third"))
    with pytest.raises(_Worked), report_to(_NoWork()):
        repair_into(third, target=0.9, out=tmp_path / "free")


def test_a_file_in_the_way_is_refused_before_the_work(
    design: Path, another: Path, tmp_path: Path
) -> None:
    """Even where what the manifest lists may be overwritten."""
    other = Path(shutil.copytree(another, tmp_path / "other"))
    manifest = json.loads((other / "manifest.json").read_text())
    del manifest["files"]["setup.csv"]
    (other / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(InputError, match="does not list"), report_to(_NoWork()):
        repair_into(design, target=0.9, out=other, options=Options(overwrite=True))
    assert "cure" not in json.loads((design / "manifest.json").read_text())["stages"]


BINNED = """
[spread]
resistors = { law = "binned", inner = 0.001 }
capacitors = { law = "binned", inner = 0.004 }
[[spread.part]]
names = ["R9"]
law = { law = "binned", inner = 0.002 }
"""


_ONE = next(f for f in CATALOG.families if f.name == "Yageo RC0603FR-07")
HALF = replace(CATALOG, families=(*CATALOG.families, replace(_ONE, name="RD07", grade=0.005)))
"""The catalogue with resistors of 0.5 % too: what is drawn is what can be bought."""


def deviations(upgrades: Upgrades) -> dict[str, np.ndarray]:
    """Of 4000 boards, by part."""
    made = paper_cases.synthesised()
    file: ModelFile = parse_model_file(made.modelfile.text + BINNED)
    circuit = made.design.circuit
    spread = spread_of(upgraded_file(file, upgrades), circuit, HALF)
    boards = draw_many(circuit, spread, 5, range(4000))
    sold = {r.name: r.value for r in circuit.resistors}
    sold |= {c.name: c.value for c in circuit.capacitors}
    return {name: boards.values[name] / sold[name] - 1.0 for name in sold}


def test_a_part_that_was_picked_out_lies_anywhere_within_its_grade() -> None:
    """Under a law that says what was picked out of the others, a better part is one of the picked:
    uniform, as its first moments show; one between the two lacks them still."""
    away = deviations(Upgrades(grades={"R4": 0.001, "R9": 0.001, "R8": 0.005, "C2": 0.004}))
    for name, grade in (("R4", 0.001), ("R9", 0.001), ("C2", 0.004)):
        assert np.abs(away[name]).max() <= grade * (1.0 + 1e-9)
        assert np.abs(away[name]).mean() == pytest.approx(0.5 * grade, rel=0.05)
        assert np.abs(away[name]).min() < 0.01 * grade
    for name, inner, outer in (("R8", 0.001, 0.005), ("R5", 0.001, 0.01), ("C4", 0.004, 0.01)):
        assert np.abs(away[name]).min() >= inner * (1.0 - 1e-9)
        assert np.abs(away[name]).mean() == pytest.approx(0.5 * (inner + outer), rel=0.05)


def test_help_says_the_kinds(capsys: pytest.CaptureFixture[str]) -> None:
    assert entry.status(["search", "--help"]) == 0
    plain = re.sub(r"[\s│]+", " ", capsys.readouterr().out).replace("- ", "-")
    for name in UPGRADES:
        assert name in plain


def test_a_damaged_study_is_made_again_and_no_other(
    another: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """A letter of ``cure-studies.json`` that says ok where it said lost, after Ctrl-C."""
    out = shutil.copytree(another, tmp_path / "out")
    studies, seen = {"a" * 64: {"0": "olg", "250": "o"}, "b" * 64: {"0": "ll"}}, []

    def interrupted(*_: Any, verdict_cache: Any, **__: Any) -> None:
        known, save = verdict_cache
        seen.append(known)
        save({"format": 1, "studies": studies})
        raise KeyboardInterrupt

    monkeypatch.setattr("designer.jobs.repair_job.VerdictCache", lambda known, save: (known, save))
    monkeypatch.setattr("designer.jobs.repair_job.find_repair", interrupted)
    words = ["search", str(out), "--yield", "0.9"]
    assert [entry.status(words), entry.status([*words, "--resume"])] == [130, 130]
    assert seen == [{}, studies]
    path = out / "cure-studies.json"
    assert json.loads(path.read_text())["studies"]["a" * 64]["0"] == "olg"
    path.write_text(path.read_text().replace("olg", "oog"))
    capfd.readouterr()
    assert entry.status([*words, "--resume"]) == 130
    assert seen[2] == {"b" * 64: {"0": "ll"}}
    assert "cure-studies.json: 1 entry is damaged, computed again" in capfd.readouterr().err
