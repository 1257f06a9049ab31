"""The JSON objects have the keys of their types: what the contract says, what was stored. What
verbs print is looked at in every test that has them print it (``tests/conftest.py``)."""

from __future__ import annotations

import json
import re
import zipfile
from pathlib import Path
from typing import Any

import pytest

from designer.answers.bifurcation_answer import BifurcationAnswer
from designer.answers.design_answer import DesignAnswer
from designer.answers.simulate_answer import SimulateAnswer
from designer.answers.study_answer import StudyAnswer
from tests.shared.typed_answers import assert_type, check_type, declared

ROOT = Path(__file__).resolve().parents[2]
JSON = (ROOT / "docs" / "contract.md").read_text("utf-8").split("\n## JSON\n")[1].split("\n## ")[0]
HEAD, *SECTIONS = JSON.split("\n### ")
STORED = sorted((ROOT / "tests" / "jobs" / "folders").glob("*/*.zip"))
"""Folders that released versions wrote."""
REPORTS = sorted(
    path
    for name in ("design.json", "tolerance.json")
    for path in (ROOT / "reports").rglob(name)
    if (path.parent / "manifest.json").is_file()
)
"""Those of versions since then, and before."""


def keys_of(text: str) -> set[str]:
    return {word for word in re.findall(r"`([^`]+)`", text) if re.fullmatch(r"[a-z]\w*", word)}


def section(verb: str) -> set[str]:
    (text,) = (each for each in SECTIONS if each.startswith(f"`{verb}`\n"))
    return keys_of(text) - {verb}


def own_unit(key: str) -> str:
    """The key without the SI unit at its end."""
    return re.sub("_(m_s|m|hz)$", "", key)


@pytest.mark.parametrize(
    ("verb", "kind", "elsewhere", "open_"),
    [
        ("simulate", SimulateAnswer, "", ""),
        # Misfits are of ``simulate``.
        (
            "bifurcation",
            BifurcationAnswer,
            "between beyond_depth clearance coarse_depth coarse_range range reached size tip",
            "",
        ),
        # Rules are of ``rules``; conditions are open to any quantity.
        (
            "synthesise",
            DesignAnswer,
            "bound comparison_seconds do id scope source unit usual_bound value",
            "at_limit binding checked least quantity rules",
        ),
        # docs/bench.md has the recipe's settings, docs/blame.md the corner.
        (
            "tolerance",
            StudyAnswer,
            "able amplitude2_v_peak amplitude_v_peak board_reached board_trials coordinates "
            "corners hold_periods margin slower smooth survived sweep_seconds "
            "to_amplitude2_v_peak to_amplitude_v_peak to_frequency_hz trials verdict wait_periods "
            "wait_seconds worst",
            "",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) and value.isalpha() else "",
)
def test_the_contract_has_the_keys(verb: str, kind: Any, elsewhere: str, open_: str) -> None:
    """elsewhere : keys that its section leaves to another page. open_ : keys of objects that may
    have any."""
    said, keys = section(verb), declared(kind)
    known = said | keys_of(HEAD)
    assert {k for k in keys if not {k, own_unit(k)} & known} == set(elsewhere.split())
    assert said - keys == set(open_.split())


@pytest.mark.parametrize("archive", STORED, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_folders_of_released_versions_are_of_the_types(archive: Path) -> None:
    with zipfile.ZipFile(archive) as stream:
        for name, kind in (("design.json", DesignAnswer), ("tolerance.json", StudyAnswer)):
            assert_type(json.loads(stream.read(name)), kind)


@pytest.mark.parametrize("path", REPORTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_folders_of_reports_are_of_the_types(path: Path) -> None:
    assert_type(json.loads(path.read_text("ascii")), KINDS[path.name])


KINDS = {"design.json": DesignAnswer, "tolerance.json": StudyAnswer}


def test_another_key_is_seen() -> None:
    wrong = {"engine": "model", "responses": [{"omga": 0.85}]}
    with pytest.raises(AssertionError, match=r"responses\.0\.omga"):
        check_type(wrong)
