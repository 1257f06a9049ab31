"""The JSON objects have the keys of their types: what the contract says, what was stored. What
verbs print is looked at in every test that has them print it (``tests/conftest.py``)."""

from __future__ import annotations

import json
import re
import zipfile
from pathlib import Path
from typing import Any

import pytest

from designer.answers.bench_answer import BenchJson
from designer.answers.bifurcation_answer import BifurcationAnswer
from designer.answers.catalog_answer import CatalogNames, NewAnswer, OpAmpChecks
from designer.answers.design_answer import DesignAnswer
from designer.answers.export_answer import ExportJson
from designer.answers.rules_answer import RulesJson
from designer.answers.search_answer import ConfirmationFile, ConfirmationRow, SearchFile, SearchRow
from designer.answers.simulate_answer import SimulateAnswer
from designer.answers.study_answer import StudyAnswer
from designer.answers.trade_answer import TradeAnswer
from designer.cli import entry
from designer.cli.app import VERBS as VERBS_OF_TOOL
from tests.shared.typed_answers import OF_VERB, assert_type, check_type, declared

ROOT = Path(__file__).resolve().parents[2]
JSON = (ROOT / "docs" / "contract.md").read_text("utf-8").split("\n## JSON\n")[1].split("\n## ")[0]
HEAD, *SECTIONS = JSON.split("\n### ")
FILES = {
    "design.json": DesignAnswer,
    "tolerance.json": StudyAnswer,
    "rules.json": RulesJson,
    "search.json": SearchFile,
    "confirmation.json": ConfirmationFile,
    "trade.json": TradeAnswer,
}
STORED = sorted((ROOT / "tests" / "jobs" / "folders").glob("*/*.zip"))
"""Folders that released versions wrote."""
REPORTS = sorted(
    path
    for name in FILES
    for path in (ROOT / "reports").rglob(name)
    if (path.parent / "manifest.json").is_file()
)
"""Of versions since then, and before."""


VERBS = (
    "simulate",
    "bifurcation",
    "synthesise",
    "tolerance",
    "search",
    "trade",
    "rules",
    "bench",
    "catalog",
)


def keys_of(text: str) -> set[str]:
    return {word for word in re.findall(r"`([^`]+)`", text) if re.fullmatch(r"[a-z]\w*", word)}


def section(verb: str) -> set[str]:
    (text,) = (each for each in SECTIONS if f"`{verb}`" in each.splitlines()[0])
    return keys_of("".join(text.splitlines(keepends=True)[1:]))


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
            "wait_seconds worst "
            # Of ``search``.
            "border line mechanism shares",
            "",
        ),
        # A run's keys are those of ``run``; settings of ngspice are of its own.
        ("search", SearchRow | ConfirmationRow, "", "confirmation cure model passed run search"),
        ("trade", TradeAnswer, "", ""),
        # The counts' keys are statuses.
        ("rules", RulesJson | ExportJson, "fail not_run pass seconds", "export"),
        ("bench", BenchJson, "seconds", ""),
        ("catalog", CatalogNames | OpAmpChecks | NewAnswer, "", "catalog new"),
    ],
    ids=lambda value: value if value in VERBS else "",
)
def test_the_contract_has_the_keys(verb: str, kind: Any, elsewhere: str, open_: str) -> None:
    """elsewhere : keys that its section leaves to another page. open_ : keys of objects that may
    have any."""
    said, keys = section(verb), declared(kind)
    known = said | keys_of(HEAD)
    unsaid = {k.replace(" ", "_") for k in keys if not {k, own_unit(k)} & known}
    assert unsaid == set(elsewhere.split())
    assert said - keys == set(open_.split())


@pytest.mark.parametrize("archive", STORED, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_folders_of_released_versions_are_of_the_types(archive: Path) -> None:
    with zipfile.ZipFile(archive) as stream:
        for name in FILES.keys() & set(stream.namelist()):
            assert_type(json.loads(stream.read(name)), FILES[name])


@pytest.mark.parametrize("path", REPORTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_folders_of_reports_are_of_the_types(path: Path) -> None:
    assert_type(json.loads(path.read_text("ascii")), FILES[path.name])


@pytest.mark.parametrize(
    ("verb", "wrong", "where"),
    [
        ("simulate", {"engine": "model", "responses": [{"omga": 0.85}]}, r"responses\.0\.omga"),
        ("simulate", {"engin": "model", "responses": []}, r"\.engin\n"),
        ("bifurcation", {"kind": "sweep", "windws": [], "tracks": []}, r"\.windws\n"),
        ("export", {"format": 1, "files": "a", "provenance": {}}, r"\.files\n"),
    ],
)
def test_another_key_is_seen(verb: str, wrong: Any, where: str) -> None:
    with pytest.raises(AssertionError, match=where):
        check_type(wrong, verb)


def test_what_a_verb_prints_is_looked_at(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(OF_VERB, "catalog", RulesJson)
    assert entry.status(["catalog", "--json"]) != 0
    assert "RulesJson" in capsys.readouterr().err


def test_every_verb_has_a_type() -> None:
    assert OF_VERB.keys() == set(VERBS_OF_TOOL) - {"reproduce", "explore"}
