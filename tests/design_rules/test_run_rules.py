"""The verb ``rules``: what it reads, prints and writes, and that every rule is tested and told."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from hypothesis import given, strategies as st

from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.base.plain_json import dumps
from designer.catalog.design_rule import (
    FAIL,
    IDLE,
    NOT_RUN,
    PASS,
    Finding,
    Override,
    RuleOutcome,
    judged,
    not_run,
)
from designer.catalog.design_rules import BY_ID, RULES
from designer.cli import entry
from designer.design_rules import on_nets, on_precision, on_ratings, rule_reports, run_rules
from designer.folders.design_source import design_inputs
from designer.folders.json_answers import synthesis_json
from designer.folders.origin import provenance
from designer.model.model_file import parse_model_file
from designer.verbs.rules import rules
from tests.cli.test_entry import _tree
from tests.design_rules import test_rules_board
from tests.shared import rule_cases
from tests.shared.exploring import quick
from tests.shared.rule_cases import TEXT, base
from tests.shared.stages import CATALOG

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

DOCS = Path(__file__).resolve().parents[2] / "docs" / "rules.md"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A design folder of the design that pairs start from."""
    return written(tmp_path_factory.mktemp("rules") / "design", TEXT)


def written(path: Path, text: str) -> Path:
    """A design folder with this model file, and the parts of ``base``."""
    modelfile = parse_model_file(text)
    folder = Folder(path)
    inputs = design_inputs(modelfile, CATALOG)
    folder.begin({"design": (inputs, ["model.toml", "design.json"])}, {})
    said = provenance(modelfile, CATALOG.hash)
    folder.write("model.toml", text)
    made = base().synthesis
    folder.write(
        "design.json",
        dumps(synthesis_json(modelfile, made.design, made.model_responses, said, 0.0)),
    )
    folder.finish("design")
    return path


@pytest.fixture
def design(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "design"))


def refused(words: list[str], capfd: pytest.CaptureFixture[str], *said: str) -> None:
    assert entry.status(words) == 2
    printed = capfd.readouterr()
    assert printed.out == ""
    assert "Traceback" not in printed.err
    for word in said:
        assert word in printed.err


# ---------------------------------------------------------------------------------------------
# Every rule


def test_a_rule_is_named_while_it_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some take seconds: who waits is told which."""
    told: list[str] = []
    monkeypatch.setattr(run_rules, "doing", told.append)
    monkeypatch.setattr(run_rules, "LOOKS", dict.fromkeys(run_rules.LOOKS, lambda _: []))
    outcomes = run_rules.on_circuit(base(), {})
    assert told == [f"design rule {outcome.rule.id}" for outcome in outcomes] != []


def test_every_rule_has_a_function_and_a_pair() -> None:
    ids = [rule.id for rule in RULES]
    assert len(set(ids)) == len(ids)
    of_circuit = [rule.id for rule in RULES if rule.scope == "circuit"]
    assert list(run_rules.LOOKS) == of_circuit
    files = on_nets, on_ratings, on_precision
    assert sum(len(file.LOOKS) for file in files) == len(of_circuit)  # none hides another
    assert set(rule_cases.PAIRS) == set(of_circuit)
    of_board = {
        *test_rules_board.BY_KICAD,
        *test_rules_board.BY_REPORT,
        *test_rules_board.BY_READING,
    }
    assert of_board == set(ids) - set(of_circuit)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.id)
def test_every_rule_says_what_it_is(rule: Any) -> None:
    assert re.fullmatch(r"[a-z]+(-[a-z]+)*", rule.id)
    assert rule.title
    assert rule.source
    assert rule.do
    assert (rule.limit is None) is bool(rule.limit_is)


def test_the_documentation_holds_the_table_of_the_code() -> None:
    text = DOCS.read_text(encoding="utf-8")
    assert rule_reports.table("circuit") in text
    assert rule_reports.table("board") in text


# ---------------------------------------------------------------------------------------------
# The model file


def limits(text: str) -> Any:
    return parse_model_file(TEXT + text).rules


def test_limits_of_a_model_file() -> None:
    found = limits(
        '[rules.swing]\nlimit = "12.5 V"\nreason = "measured"\n'
        "[rules.power]\nlimit = 0.8\nreason = 'cold'\n"
        "[rules.summing-length]\nlimit = '30mm'\nreason = 'short'\n"
        "[rules.supply-width]\nlimit = 0.5\nreason = 'wide'\n"
    )
    assert dict(found) == {
        "swing": Override(12.5, "measured"),
        "power": Override(0.8, "cold"),
        "summing-length": Override(30.0, "short"),
        "supply-width": Override(0.5, "wide"),
    }
    assert limits("") == {}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[rules.swng]\nlimit = 1.0\nreason = 'x'", ["rules.swng", 'did you mean "swing"']),
        ("[rules.swing]\nlimit = 12.0", ["rules.swing.reason is missing"]),
        ("[rules.swing]\nlimit = 12.0\nreason = ' '", ["rules.swing.reason"]),
        ("[rules.swing]\nlimit = 12.0\nreason = 5", ["rules.swing.reason"]),
        ("[rules.swing]\nreason = 'x'", ["rules.swing.limit is missing"]),
        ("[rules.swing]\nlimit = '12 A'\nreason = 'x'", ["rules.swing.limit", "in V"]),
        ("[rules.swing]\nlimit = -1.0\nreason = 'x'", ["rules.swing.limit", ">= 0"]),
        ("[rules.swing]\nlimit = nan\nreason = 'x'", ["rules.swing.limit"]),
        ("[rules.swing]\nlimit = true\nreason = 'x'", ["rules.swing.limit", "true"]),
        ("[rules.power]\nlimit = '0.5'\nreason = 'x'", ["rules.power.limit", "without quotes"]),
        ("[rules.swing]\nlimit = 1.0\nreason = 'x'\nskip = true", ["rules.swing.skip"]),
        ("[rules]\nswing = 12.0", ["rules.swing", "12.0"]),
        ("[[rules]]\nswing = 12.0", ["rules"]),
    ],
)
def test_what_a_model_file_may_not_say(text: str, said: list[str]) -> None:
    with pytest.raises(InputError) as error:
        limits(text)
    for word in said:
        assert word in str(error.value)


# ---------------------------------------------------------------------------------------------
# The verb


@pytest.mark.parametrize(("why", "open_"), [(IDLE, False), ("no board was given", True)])
def test_what_a_design_does_not_have_leaves_nothing_open(why: str, open_: bool) -> None:
    assert RuleOutcome(RULES[0], NOT_RUN, why).open is open_
    assert not RuleOutcome(RULES[0], FAIL, why).open


def test_prints_and_writes_the_same_and_keeps_the_folder_whole(
    design: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    before = _tree(design)
    assert entry.status(["rules", str(design), "--json"]) == 0
    answer = json.loads(capfd.readouterr().out)
    assert json.loads((design / "rules.json").read_text()) == answer
    assert answer["format"] == 1
    assert [r["id"] for r in answer["rules"]] == [rule.id for rule in RULES]
    for rule in answer["rules"]:
        assert {"id", "status", "found", "limit", "source", "do"} <= set(rule)
        assert rule["status"] in (PASS, FAIL, NOT_RUN)
        assert all(isinstance(rule[key], str) for key in ("found", "limit", "source", "do"))
    assert answer["counts"] == {PASS: 26, FAIL: 0, NOT_RUN: 30}
    # Of the 30 only the law that falls is none of this design's; the board was not given.
    assert answer["complete"] is False
    (idle,) = (r["id"] for r in answer["rules"] if r["found"] == IDLE)
    assert idle == "far-slope"
    assert answer["provenance"]["versions"]["designer"]
    after = _tree(design)
    assert set(after) - set(before) == {"rules.json"}
    folder = Folder(design)
    assert folder.manifest is not None
    assert folder.manifest.complete
    assert folder.changed("rules") is None
    # A second look replaces the first: nothing else changes.
    assert entry.status(["rules", str(design), "-q"]) == 0
    again = json.loads((design / "rules.json").read_text())
    assert {k: v for k, v in again.items() if k != "cost"} == {
        k: v for k, v in answer.items() if k != "cost"
    }


def test_a_rule_that_fails_is_exit_1_and_an_overridden_one_is_said(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    text = TEXT + '[rules.swing]\nlimit = "1 V"\nreason = "a test"\n'
    design = written(tmp_path / "design", text)
    assert entry.status(["rules", str(design), "--junit", str(tmp_path / "junit.xml")]) == 1
    printed = capfd.readouterr()
    assert printed.out == ""
    assert "swing fails:" in printed.err
    assert "the model file's limit, because: a test" in printed.err
    (said,) = [r for r in json.loads((design / "rules.json").read_text())["rules"]
               if r["id"] == "swing"]  # fmt: skip
    assert (said["status"], said["reason"], said["source"]) == (FAIL, "a test", "the model file")
    assert said["usual_bound"] > 10.0
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()[0]
    assert suite.get("failures") == "1"


def test_a_board_is_looked_at(
    design: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(
        "PATH", str(tmp_path)
    )  # no KiCad: tests/design_rules/test_rules_board.py has it
    board = tmp_path / "some.kicad_pcb"
    board.write_text(test_rules_board.drawn(), encoding="utf-8")
    assert entry.status(["rules", str(design), "--board", str(board), "--json"]) == 0
    answer = json.loads(capfd.readouterr().out)
    assert answer["board"] == "some.kicad_pcb"
    status = {r["id"]: r["status"] for r in answer["rules"]}
    assert status["decoupling-distance"] == PASS
    assert status["clearance"] == NOT_RUN
    assert len(answer["provenance"]["settings"]["board_sha256"]) == 64


def test_a_changed_part_is_a_finding_and_no_refusal(
    design: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exit 1, in the JUnit report; what was not looked at is skipped there and told in the end."""
    monkeypatch.setenv("PATH", str(tmp_path))
    board, report = tmp_path / "some.kicad_pcb", tmp_path / "junit.xml"
    text = test_rules_board.drawn().replace('(property "Value" "36kΩ"', '(property "Value" "47k"')
    board.write_text(text, encoding="utf-8")
    assert entry.status(["rules", str(design), "--board", str(board), "--junit", str(report)]) == 1
    printed = capfd.readouterr().err
    assert "part-value fails:" in printed
    assert "Not run is no pass." in printed.replace("\n", " ")
    assert "unconnected" in printed[printed.index("Not run is no pass.") :]
    suite = ElementTree.parse(report).getroot()[0]
    assert suite.get("failures") == "1"
    cases = {case.get("name"): case for case in suite}
    failure = cases["part-value"].find("failure")
    assert failure is not None
    assert "R4 is 47k, not 36kΩ" in str(failure.get("message"))
    skipped = {name for name, case in cases.items() if case.find("skipped") is not None}
    untracked = {"fab-track", "board-layers", "far-slope"}
    assert skipped == {*test_rules_board.BY_KICAD, *test_rules_board.BY_REPORT, *untracked}


def test_bad_input_writes_nothing(
    design: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    before = _tree(design)
    board = tmp_path / "some.kicad_pcb"
    for text, said in (
        (test_rules_board.drawn()[:5000].rpartition("\n")[0], "a whole file"),
        (test_rules_board.renamed("R4", "R99"), "without R4; with R99"),
        (test_rules_board.drawn().replace("20241229", "20990101"), "from a newer one"),
    ):
        board.write_text(text, encoding="utf-8")
        out = tmp_path / "junit.xml"
        words = ["rules", str(design), "--board", str(board), "--junit", str(out)]
        refused(words, capfd, "some.kicad_pcb", said)
        assert not out.exists()
    refused(["rules", str(design), "--board", str(tmp_path / "none")], capfd, "--board")
    lost = tmp_path / "no folder" / "junit.xml"
    refused(["rules", str(design), "--junit", str(lost)], capfd, "--junit", "no such folder")
    refused(["rules", str(design), "--junit", str(tmp_path)], capfd, "--junit")
    refused(["rules", str(tmp_path)], capfd, "a design folder")
    refused(["rules", str(tmp_path / "model.toml")], capfd, "a design folder")
    (design / "rules.json").write_text("mine")
    refused(["rules", str(design)], capfd, "rules.json", "does not list")
    assert (design / "rules.json").read_text() == "mine"
    (design / "rules.json").unlink()
    assert _tree(design) == before


@pytest.mark.parametrize("before", quick([False, True]))
def test_a_folder_that_cannot_be_written_is_judged_all_the_same(
    design: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], before: bool
) -> None:
    """A read-only file system refuses to remove even what is not there."""
    if before:
        rules(design)
    tree = _tree(design)

    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    opened = Path.open

    def read_only(self: Path, mode: str = "r", **more: Any) -> Any:
        return opened(self, mode, **more) if mode in ("r", "rb") else refuse()

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", read_only)
        patch.setattr(Path, "unlink", refuse)
        patch.setattr(os, "replace", refuse)
        status = entry.status(["rules", str(design), "--json"])
    out, err = capfd.readouterr()
    answer = json.loads(out)
    assert status == (1 if answer["counts"]["fail"] else 0)
    assert "Read-only file system" in answer["not_stored"]
    assert "the answer is not stored" in err
    assert "Read-only file system" in err
    assert "Traceback" not in err
    assert _tree(design) == tree
    rules(design)
    stored = json.loads((design / "rules.json").read_text())
    assert "not_stored" not in stored
    assert stored["rules"] == answer["rules"]


def test_a_design_made_anew_forgets_its_rules(design: Path) -> None:
    rules(design)
    folder = Folder(design)
    folder.begin({"design": ({"model": "another"}, ["model.toml", "design.json"])}, {})
    assert folder.manifest is not None
    assert "rules" not in folder.manifest.stages


# ---------------------------------------------------------------------------------------------
# JUnit


def outcomes(reason: str) -> tuple[RuleOutcome, ...]:
    return (
        judged(BY_ID["swing"], [Finding(13.0, reason, 12.0)]),
        judged(BY_ID["load"], [Finding(3e3, "U1A")], Override(1e3, reason)),
        not_run(BY_ID["clearance"], reason),
    )


@given(text=st.text())
def test_a_junit_report_holds_any_text(text: str) -> None:
    root = ElementTree.fromstring(rule_reports.junit(text, outcomes(text)).encode("utf-8"))
    (suite,) = root
    assert (suite.get("tests"), suite.get("failures"), suite.get("skipped")) == ("3", "1", "1")
    first, second, third = suite
    assert [case.get("name") for case in suite] == ["swing", "load", "clearance"]
    assert [case.get("classname") for case in suite] == ["rules.circuit"] * 2 + ["rules.board"]
    assert first[0].tag == "failure"
    assert second[0].tag == "system-out"
    assert third[0].tag == "skipped"


def test_a_junit_report_says_what_was_found() -> None:
    root = ElementTree.fromstring(rule_reports.junit("<&>", outcomes("U1A")))
    assert root[0].get("name") == "design rules: <&>"
    failure = root[0][0][0]
    assert failure.get("message") == "found 13 V at U1A; at most 12 V"
    assert BY_ID["swing"].do in str(failure.text)
    assert "the model file's limit: U1A" in str(root[0][1][0].text)
