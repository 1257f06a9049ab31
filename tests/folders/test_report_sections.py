"""Answers of later verbs in the report of a study: the same facts in both files, no byte without
need, and nothing where there is no report to show them in."""

from __future__ import annotations

import json
import re
import shutil
import zipfile
from pathlib import Path
from typing import Any, cast

import pytest

from designer.base.design_folder import REPORTS, Folder
from designer.base.manifest import StageName
from designer.base.page import Page, PageSection, markdown
from designer.base.plain_json import dumps
from designer.fidelity import trade_files
from designer.folders.report_sections import BENCHED, SHOWN, design_hash, renew_report
from designer.report.page_html import render_page
from designer.report.verb_sections import SECTIONS, SHOWN as KINDS, is_whole
from tests.shared.house import ROOT
from tests.shared.typed_answers import needed

STORED = Path(__file__).parents[1] / "jobs" / "folders" / "0.1.0" / "format-1.zip"
TRADE = json.loads((ROOT / "reports/speed-accuracy/trade.json").read_text("utf-8"))
for _row in TRADE["rungs"]:  # of an earlier version
    _row.setdefault("convergence", None)
YIELD = {"failed": 0, "rate": 0.812, "low": 0.786, "high": 0.835}
REPAIRED = {"failed": 2, "rate": 0.993, "low": 0.983, "high": 0.997}
TRIAL = {"price": 1.75, "said": ["0.1 % R1 R7", "op-amp <b>X</b>"], "measured": [REPAIRED]}
REPAIR: dict[str, Any] = {
    "format": 1,
    "reached": True,
    "why": "",
    "target": 0.98,
    "price": 1.75,
    "said": TRIAL["said"],
    "responses": [
        {"omega": 0.85, "expected": "1-2-2", "before": YIELD, "after": REPAIRED, "limit": "R7"}
    ],
    "front": [{"price": 0.0, "said": [], "measured": [YIELD]}, TRIAL],
    "refused": [{"upgrades": ["trimmer fitted"], "why": "no room beside U2"}],
}


@pytest.fixture(scope="module")
def studied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and a small report of it."""
    path = tmp_path_factory.mktemp("studied") / "design"
    with zipfile.ZipFile(STORED) as stream:
        stream.extractall(path)
    folder = Folder(path)
    assert folder.manifest is not None
    (path / "rules.json").rename(path / "stored.json")
    del folder.manifest.stages["rules"], folder.manifest.files["rules.json"]
    origin = PageSection("Provenance", ["One seed."], "provenance")
    made = PageSection("What was it made with?", [origin], "made", "", "One seed.")
    page = Page("Small", [], [PageSection("Yields", ["All."], "yields"), made])
    for name, text in zip(REPORTS, (render_page(page), markdown(page)), strict=True):
        folder.manifest.files[name] = ("study", None)
        folder.rewrite(name, text)
    return path


@pytest.fixture
def path(studied: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(studied, tmp_path / "design"))


def answered(path: Path, stage: Any, answer: dict[str, Any]) -> None:
    """As a verb leaves its answer in the folder."""
    folder, name = Folder(path), f"{stage}.json"
    with folder.working({stage: ({}, [name])}):
        folder.write(name, dumps(answer))
    renew_report(folder)


def test_a_report_of_an_earlier_version_shows_later_answers_too(path: Path) -> None:
    scales = PageSection("Scales and conditions", ["One volt."], "scales")
    page = Page("Old", [], [PageSection("Yields", ["All."], "yields"), scales])
    for name, text in zip(REPORTS, (render_page(page), markdown(page)), strict=True):
        Folder(path).rewrite(name, text)
    answered(path, "cure", REPAIR)
    html, text = reports(path)
    assert re.findall(r'<a href="#(\w+)">', html) == ["yields", "cure", "scales"]
    assert re.findall(r'<section id="(\w+)">', html) == ["yields", "cure", "scales"]
    assert text.index("## The cheapest cure") < text.index("## Scales and conditions")


def reports(path: Path) -> list[str]:
    return [(path / name).read_text("utf-8") for name in REPORTS]


def numbers(text: str) -> set[str]:
    return set(re.findall(r"\d+(?:\.\d+)?", re.sub(r"<[^>]*>", " ", text)))


def test_every_answer_stands_in_both_files(path: Path) -> None:
    answered(path, "trade", TRADE)
    answered(path, "cure", REPAIR)
    answer = json.loads((path / "stored.json").read_text("utf-8"))
    answered(path, "rules", answer)
    html, text = reports(path)
    entries = re.findall(r'<a href="#(\w+)">', html)
    assert entries == ["yields", "cure", "rules", "trade", "provenance"]
    assert re.findall(r'<section id="(\w+)">', html) == [*entries[:-1], "made", "provenance"]
    assert [line for line in text.splitlines() if line[:3] == "## "] == [
        "## Yields",
        "## The cheapest cure",
        "## Design rules",
        "## Time and error of the engines",
        "## What was it made with?",
    ]
    for rule in answer["rules"]:
        assert f'<td class="short">{rule["id"]}</td>' in html
    cheapest = [r for r in trade_files.sheet(TRADE).splitlines() if r.startswith("| n-p-q ")]
    assert len(cheapest) > 1
    assert set(cheapest) <= set(text.splitlines())
    assert "99.3 % (98.3 to 99.7 %), 2 failed" in text
    assert "op-amp &lt;b>X&lt;/b>" in text
    later = text[text.index("## The cheapest") : text.index("## What was")]
    assert numbers(later) <= numbers(html[html.index("<body>") :])
    for name in (name for names in SHOWN.values() for name in names):
        assert f'<a href="{name}">{name}</a>' in html
        assert f"[{name}]({name})" in text


class _Read(dict[str, Any]):
    """An object that notes which keys are read, as paths, but for those that may be missing."""

    def __init__(self, answer: dict[str, Any], keys: set[str], path: str = "") -> None:
        super().__init__({key: _reads(v, keys, f"{path}{key}.") for key, v in answer.items()})
        self._keys, self._path = keys, path
        self._free: set[str] = set()

    def __getitem__(self, key: str) -> Any:
        value = super().__getitem__(key)
        if key in self._free:
            return dict.copy(value) if isinstance(value, dict) else value
        self._keys.add(self._path + key)
        return value

    def get(self, key: str, default: Any = None) -> Any:
        self._free.add(key)
        value = super().get(key, default)
        return dict.copy(value) if isinstance(value, dict) else value


def _reads(value: Any, keys: set[str], path: str) -> Any:
    if isinstance(value, dict):
        return _Read(value, keys, path)
    return [_reads(item, keys, path) for item in value] if isinstance(value, list) else value


@pytest.mark.parametrize("verb", SECTIONS)
def test_what_a_section_reads_is_what_an_answer_has_to_have(verb: str, path: Path) -> None:
    """So that a KeyError is an error: an answer of an earlier version is known before."""
    stored = json.loads((path / "stored.json").read_text("utf-8"))
    answer = {"cure": REPAIR, "rules": stored, "trade": TRADE}[verb]
    keys: set[str] = set()
    for one in (answer, answer | {"reached": False}):
        SECTIONS[verb](_Read(one, keys), SHOWN[cast(StageName, verb)])
    inner = {key for key in keys if not any(k.startswith(f"{key}.") for k in keys)}
    assert inner == needed(KINDS[verb])
    assert is_whole(verb, answer)
    for key in needed(KINDS[verb]):
        fewer = json.loads(json.dumps(answer))
        *above, last = key.split(".")
        for item in _items(fewer, above):
            del item[last]
        assert not is_whole(verb, fewer)


def _items(value: Any, path: list[str]) -> list[Any]:
    """The objects at this path, in lists too."""
    if isinstance(value, list):
        return [found for item in value for found in _items(item, path)]
    return _items(value[path[0]], path[1:]) if path else [value]


def test_of_an_answer_with_fewer_figures_the_report_says_how_it_is_made_anew(path: Path) -> None:
    answered(path, "trade", {"format": 1, "cheapest": [{"question": "n-p-q"}]})
    for text in reports(path):
        assert "An earlier version made trade.md" in text
        assert "designer trade DIR --overwrite" in text


def test_a_second_time_changes_nothing_and_the_manifest_knows_the_report(path: Path) -> None:
    bare = reports(path)
    answered(path, "cure", REPAIR)
    with_repair, manifest = reports(path), (path / "manifest.json").read_bytes()
    assert bare != with_repair
    assert Folder(path).changed("study") is None
    answered(path, "cure", REPAIR)
    assert reports(path) == with_repair
    assert (path / "manifest.json").read_bytes() == manifest
    (path / "cure.json").write_text("{}", encoding="utf-8")  # damaged: it is told of no more
    renew_report(Folder(path))
    assert reports(path) == bare


def test_records_of_boards_in_the_folder_are_shown_with_their_pages(path: Path) -> None:
    bare = reports(path)
    row = {"omega": 0.85, "response": "1-2-2", "sure": True, "others": [], "wanted": "1-2-2",
           "advice": None}  # fmt: skip
    rows = [
        {**row, "file": "first.csv", "as_wanted": True},
        {**row, "file": "second.csv", "sure": False, "others": ["1-2-1"], "as_wanted": False},
    ]
    boards, design = path / "boards", design_hash(path)
    for name, of in (("A", design), ("earlier", "another")):
        (boards / name).mkdir(parents=True)
        answer = {"format": 1, "design_sha256": of, "records": rows}
        (boards / name / BENCHED).write_text(dumps(answer), encoding="utf-8")
    (boards / "broken").mkdir()
    (boards / "broken" / BENCHED).write_text("{", encoding="utf-8")
    for key in needed(KINDS["bench"]):
        last = key.removeprefix("records.")
        (boards / f"without-{last}").mkdir()
        fewer = [{k: v for k, v in rows[0].items() if k != last}, rows[1]]
        answer = {"format": 1, "design_sha256": design, "records": fewer}
        (boards / f"without-{last}" / BENCHED).write_text(dumps(answer), encoding="utf-8")
    renew_report(Folder(path))
    html, text = reports(path)
    assert '<a href="boards/A/bench.html">' in html
    assert "[boards/A/bench.html](boards/A/bench.html)" in text
    for page in (html, text):
        assert "what is wanted there: 1 of 2." in page
        assert "not sure" in page
        assert "earlier" not in page
        assert "without-" not in page
    assert Folder(path).changed("study") is None
    shutil.rmtree(boards)
    renew_report(Folder(path))
    assert reports(path) == bare


def test_a_report_that_somebody_changed_stays(path: Path) -> None:
    html, text = path / REPORTS[0], path / REPORTS[1]
    text.write_text("Mine.", encoding="utf-8")
    answered(path, "cure", REPAIR)
    assert text.read_text("utf-8") == "Mine."
    assert "The cheapest cure" in html.read_text("utf-8")


def test_without_a_finished_study_the_report_waits(path: Path) -> None:
    folder, before = Folder(path), reports(path)
    assert folder.manifest is not None
    folder.manifest.stages["study"].complete = False
    with folder.working({"cure": ({}, ["cure.json"])}):
        folder.write("cure.json", dumps(REPAIR))
    renew_report(folder)
    assert reports(path) == before
