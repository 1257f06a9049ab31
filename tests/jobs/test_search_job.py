"""A search with its folder: written, reused, interrupted, and taken by every other verb."""

from __future__ import annotations

import csv
import json
import shlex
from collections import Counter
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

import designer
from designer.answers.search_answer import ConfirmedCure
from designer.base.design_folder import MODEL, Folder
from designer.base.errors import EnvironmentMissing, InputError
from designer.base.manifest import StageName
from designer.base.plain_json import dumps
from designer.base.progress import Progress, report_to
from designer.centering.answer_cache import AnswerCache
from designer.centering.levers import DesignChoice
from designer.cli import entry as cli
from designer.fidelity.trade_study import IDEAL, SHARE
from designer.jobs import fidelity_choice, search_job
from designer.jobs.job_outcome import JobOutcome
from designer.jobs.options import Options
from designer.jobs.repair_job import CureResult
from designer.jobs.search_job import confirms, search_into, to_confirm
from designer.jobs.search_stage import resolved, searched_into
from designer.jobs.synthesise_job import synthesise_into
from designer.model.model_file import ModelFile, parse_model_file, read_model_file
from designer.verbs.search import KINDS
from designer.verdicts.verdict import Verdict
from tests.shared.search_cases import asked, made
from tests.shared.typed_answers import OF_VERB, assert_type

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

OPEN = 'omega = "best"\nexpect = "1-2-2"\nb = [0.25, 0.27]'
MORE = "[spread]\noffset = 0\n"


def run(*arguments: object) -> int:
    return cli.status([str(a) for a in arguments])


def read(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def files(folder: Path) -> dict[str, str]:
    """Hashes of the files, those of JSON without their times."""
    said = read(folder / "manifest.json")["files"]
    return {name: entry["sha256"] for name, entry in said.items()}


def with_trade(path: Path, fidelity: str, stage: StageName = "design", model: str = "") -> Folder:
    """A folder with a finished trade that says this fidelity of its yields.

    stage : what else there is, of the model file with the hash ``model``; as it is if "".
    """
    folder = Folder(path)
    if model:
        folder.begin({stage: ({"model": model}, ["design.json"])}, {})
        folder.write("design.json", '{"format": 1}')
        folder.finish(stage)
    folder.begin({"trade": ({}, ["trade.json"])}, {})
    row = {"question": SHARE, "of": IDEAL, "rung": fidelity, "measured": 0.005, "bound": 0.01}
    said = {"format": 1, "cheapest": [row], "rungs": [], "truths": []}  # as the first version wrote
    folder.write("trade.json", dumps(said))
    folder.finish("trade")
    return folder


class Heard(Progress):
    """Keeps its notes."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, text: str) -> None:
        self.notes.append(text)


@pytest.mark.parametrize(
    ("trade", "fidelity", "word"),
    [
        ("ideal", "ngspice", "every board in ngspice"),
        ("circuit", "exact", "40 boards of each response"),
        (None, "exact", "no trade of this design"),
    ],
)
def test_the_final_study_takes_its_fidelity_by_a_trade_and_says_so(
    tmp_path: Path, trade: str | None, fidelity: str, word: str
) -> None:
    folder = Folder(tmp_path) if trade is None else with_trade(tmp_path, trade)
    heard = Heard()
    with report_to(heard):
        assert fidelity_choice.for_search(folder, Options()) == fidelity
        assert word in heard.notes[0]
        for asked_for in ("exact", "ngspice"):
            assert fidelity_choice.for_search(folder, Options(rung=asked_for)) == asked_for
    assert len(heard.notes) == 1


def test_a_repair_has_no_fidelity(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("search", tmp_path, "--yield", 0.9, "--rung", "exact", "-q") == 2
    assert "--rung" in capsys.readouterr().err  # a cure is decided on the exact circuit


@pytest.mark.parametrize("stage", ["design", "search"])
def test_a_trade_counts_for_a_search_of_the_same_model_file(tmp_path: Path, stage: Any) -> None:
    folder = with_trade(tmp_path, "ideal", stage, "this")
    word = fidelity_choice.before_search(folder, "this")
    assert word is not None
    assert word.rung == "ngspice"
    assert fidelity_choice.before_search(folder, "another") is None
    assert fidelity_choice.before_search(Folder(tmp_path / "free"), "this") is None


def test_a_search_keeps_the_word_of_the_trade_that_it_replaces(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through interruptions, and until the design that was found has a trade of its own."""
    model, out = tmp_path / "model.toml", tmp_path / "out"
    model.write_text(asked(OPEN), encoding="utf-8")
    with_trade(out, "ideal", "design", read_model_file(model).sha256)

    def interrupted(*_: object, **__: object) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr("designer.jobs.search_stage.look", lambda *_: ())
    monkeypatch.setattr("designer.jobs.search_stage.design_search", interrupted)
    words = ("search", model, "--out", out, "-q")
    assert run(*words) == 2  # the design is one that no search made
    assert run(*words, "--overwrite") == 130
    kept = read(out / "manifest.json")["stages"]["search"]["kept"]["trade"]
    assert kept["rung"] == "ngspice"
    (out / "trade.json").unlink()  # as when the found design is written
    assert run(*words, "--resume") == 130
    assert read(out / "manifest.json")["stages"]["search"]["kept"]["trade"] == kept

    found = Folder(tmp_path / "found")
    stages: dict[StageName, Any] = {
        "search": ({}, ["search.json"]),
        "design": ({"model": "found"}, []),
    }
    found.begin(stages, {})
    found.write("search.json", dumps({"format": 1, "trade": {**kept, "model": "found"}}))
    found.finish("search")
    choice = fidelity_choice.choose(found)
    assert choice.rung == "ngspice"
    assert "stood here before" in choice.reason
    again = {**asdict(choice), "model": "found"}
    found.write("search.json", dumps({"format": 1, "trade": again}))
    assert fidelity_choice.choose(found) == choice  # said once, however often it is handed on
    found.write("search.json", dumps({"format": 1, "trade": {**again, "model": "another"}}))
    # The trade was of another design.
    assert fidelity_choice.choose(found) == fidelity_choice.FidelityChoice("auto", "")
    with_trade(tmp_path / "found", "circuit")
    assert fidelity_choice.choose(Folder(tmp_path / "found")).rung == "auto"
    found.write("search.json", dumps({"format": 1, "trade": {"rung": "none"}}))
    with pytest.raises(InputError, match="what search wrote"):
        fidelity_choice.choose(found)


@dataclass(frozen=True)
class Found:
    """What stands for a design that was found."""

    modelfile: ModelFile
    seconds: float = 0.0


@pytest.mark.parametrize("earlier", [None, "auto"])
def test_a_search_that_is_killed_as_it_begins_keeps_the_word_too(
    earlier: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Right after the manifest says that it has begun, with and without the file of an earlier
    search that says another thing; resumed, the found design has the word."""
    model, out = tmp_path / "model.toml", tmp_path / "out"
    model.write_text(asked(OPEN), encoding="utf-8")
    folder = with_trade(out, "ideal", "design", read_model_file(model).sha256)
    if earlier is not None:
        folder.begin({"search": ({}, ["search.json"])}, {})
        said = {"rung": earlier, "reason": "another", "model": "another"}
        folder.write("search.json", dumps({"format": 1, "trade": said}))
        folder.finish("search")
    begin = Folder.begin

    def killed(self: Folder, wanted: Any, *rest: Any) -> None:
        begin(self, wanted, *rest)
        if "search" in wanted:
            raise KeyboardInterrupt

    file = read_model_file(model)
    found = SimpleNamespace(synthesis=Found(file), final=SimpleNamespace(choice=None))
    for name, value in (
        ("look", ()),
        ("design_search", found),
        ("search_json", {"format": 1}),
        ("resolved", file),
    ):
        stage = f"designer.jobs.search_stage.{name}"
        monkeypatch.setattr(stage, lambda *_, value=value, **__: value)
    monkeypatch.setattr("designer.folders.kicad_files.project_texts", lambda *_: {})
    design = "designer.folders.design_files"
    monkeypatch.setattr(f"{design}.design_provenance", lambda _: {})
    monkeypatch.setattr(f"{design}.texts", lambda _: {MODEL: file.text})
    monkeypatch.setattr(f"{design}.write", lambda out, _, files: out.write(MODEL, files[MODEL]))
    monkeypatch.setattr(f"{design}.write_last", lambda *_: None)
    monkeypatch.setattr(Folder, "begin", killed)
    with pytest.raises(KeyboardInterrupt):
        searched_into(file, out, Options(jobs=1, overwrite=True))
    monkeypatch.setattr(Folder, "begin", begin)
    final = searched_into(file, out, Options(jobs=1, resume=True))
    trade = read(out / "search.json")["trade"]
    assert (trade["rung"], trade["model"]) == ("ngspice", final.sha256)
    assert fidelity_choice.choose(Folder(out)).rung == "ngspice"
    assert "kept" not in read(out / "manifest.json")["stages"]["search"]


def test_forty_boards_of_each_response_confirm_even_where_some_have_no_answer() -> None:
    answers: Any = [
        SimpleNamespace(sample=i, question=q, verdict=Verdict.FAILED if i % 3 == q else Verdict.OK)
        for i in range(100)
        for q in (0, 1)
    ]
    asks = to_confirm(answers)
    assert Counter(a.question for a in asks) == {0: 40, 1: 40}
    assert all(a.sample % 3 != a.question for a in asks)
    assert [a.sample for a in asks if a.question == 0][:3] == [1, 2, 4]
    assert Counter(a.question for a in to_confirm(answers[:20])) == {0: 6, 1: 7}


def test_a_resolved_file_says_what_was_open() -> None:
    asked_file = parse_model_file(asked(OPEN, more=MORE))
    synthesis = made()
    found = resolved(asked_file, synthesis, DesignChoice.of(asked_file), Path("model.toml"))
    (response,) = found.responses
    assert response.omega == synthesis.model_responses[0].omega
    assert response.b == synthesis.model_responses[0].b
    assert response.expect == asked_file.responses[0].expect
    assert found.circuit == asked_file.circuit
    assert found.spread == asked_file.spread
    assert found.search == asked_file.search
    assert (found.model, found.title) == (asked_file.model, asked_file.title)
    assert found.sha256 == parse_model_file(found.text).sha256


@pytest.mark.slow
def test_a_search_from_end_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        "designer.centering.design_search.LEVERS", ("opamp", "dead zone", "amplitude")
    )
    model, whole, cut = (
        tmp_path / "model.toml",
        tmp_path / "whole" / "found",
        tmp_path / "cut" / "found",
    )
    model.write_text(asked(OPEN, band=(0.75, 0.95)), encoding="utf-8")
    # The folders have one name: the report states the command.
    options = ("--samples", 40, "--jobs", 2, "-q")
    assert run("search", model, "--out", whole, *options, "--json") == 0
    answer = json.loads(capsys.readouterr().out)

    # The keys of ``synthesise``, yields of fresh boards, and what the search did.
    assert {"parts", "errors", "max_error", "certificate", "scales", "knobs"} <= set(answer)
    (response,) = answer["responses"]
    assert response["yield"]["samples"] == 40
    assert response["yield"]["ok"] >= 39
    assert response["limited_by"]["line"]
    (confirmed,) = answer["confirmation"]["responses"]
    assert answer["confirmation"]["rung"] == "dynamic"
    assert confirmed["asked"] >= 40
    assert confirmed["agreed"] >= 38
    search = answer["search"]
    assert search["final"]["smallest_distance"] >= search["start"]["smallest_distance"]
    assert search["steps"]

    # The chosen place stands wherever a verb looks for it.
    (place,) = search["final"]["responses"]
    assert 0.25 <= place["b"] <= 0.27
    assert 0.75 <= place["omega"] <= 0.95
    assert answer["knobs"][0]["omega"] == place["omega"]
    with (whole / "setup.csv").open(encoding="utf-8", newline="") as stream:
        assert float(next(csv.DictReader(stream))["omega"]) == place["omega"]
    assert (whole / "asked.toml").read_bytes() == model.read_bytes()
    written = parse_model_file((whole / "model.toml").read_text(encoding="utf-8"))
    assert written.responses[0].omega == place["omega"]

    # Again: nothing is done. With other inputs: refused.
    before = files(whole)
    assert run("search", model, "--out", whole, *options) == 0
    assert files(whole) == before
    assert run("search", model, "--out", whole, "--samples", 40, "--seed", 2, "-q") == 2
    assert files(whole) == before

    # Interrupted and resumed, it ends with the same files.
    write, left = AnswerCache._write, [3]

    def interrupted(self: AnswerCache, rows: dict[str, tuple[int, ...]]) -> None:
        write(self, rows)
        left[0] -= 1
        if not left[0]:
            raise KeyboardInterrupt

    monkeypatch.setattr(AnswerCache, "_write", interrupted)
    assert run("search", model, "--out", cut, *options) == 130
    monkeypatch.setattr(AnswerCache, "_write", write)
    assert not read(cut / "manifest.json")["complete"]
    assert run("search", model, "--out", cut, *options) == 2
    assert run("search", model, "--out", cut, *options, "--resume") == 0
    assert files(cut) == before

    # A trade of the found design that its final study does not suffice: the same search extends it.
    trade = whole / "trade.json"
    with_trade(whole, "ideal")
    capsys.readouterr()
    assert run("search", model, "--out", whole, *options, "--rung", "exact") == 0
    assert not (whole / "ngspice.parquet").exists()
    assert run("search", model, "--out", whole, *options[:-1], "--json") == 0
    said = capsys.readouterr()
    assert "every board in ngspice" in said.err
    (response,) = json.loads(said.out)["responses"]
    assert response["agreement"]["nominal_start"]["asked"] == 40
    assert trade.exists()

    # The folder is a design folder like any other.
    capsys.readouterr()
    assert run("simulate", whole, "--engine", "circuit", "--starts", 1, "-q", "--json") == 0
    assert json.loads(capsys.readouterr().out)["responses"][0]["response"] == "1-2-2"
    moved = whole.rename(tmp_path / "moved")
    assert run("tolerance", moved, "--samples", 40, "--rung", "exact", "--jobs", 2, "-q") == 0


@pytest.mark.parametrize("verb", ["search", "synthesise", "run", "tolerance"])
def test_what_cannot_be_sought_writes_nothing(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "model.toml"
    model.write_text(asked('omega = "best"'), encoding="utf-8")
    assert run(verb, model, "--out", tmp_path / "out", "-q") == 2
    said = capsys.readouterr().err
    assert str(model) in said
    assert "response[1].expect" in said
    assert not (tmp_path / "out").exists()


def test_a_match_leaves_no_place_open(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "model.toml"
    model.write_text(asked(OPEN, objective="match"), encoding="utf-8")
    assert run("synthesise", model, "--out", tmp_path / "out", "-q") == 2
    assert 'circuit.objective = "yield"' in capsys.readouterr().err


LISTED = """
[spread]
measured = "boards.csv"
"""


@pytest.mark.parametrize(
    ("words", "more", "field"),
    [
        (("--budget", 2), "", "--budget"),  # of a cure, which nothing asks for
        (("--without", "grade"), "", "--without"),
        (("--yield", 0.9, "--ppm", 10), "", "--ppm"),
        (("--ppm", 1), "", "--ppm"),
        (("--yield", 1.5), "", "--yield"),
        (("--ppm", 10, "--without", "solder"), "", "--without"),
        (("--ppm", 10), LISTED, "spread.measured"),
    ],
)
def test_a_cure_that_cannot_be_is_refused_before_the_search(
    words: tuple[object, ...],
    more: str,
    field: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    model = tmp_path / "model.toml"
    model.write_text(asked(OPEN, more=more), encoding="utf-8")
    (tmp_path / "boards.csv").write_text("board,part,value\nA,VCC,15.0\n", encoding="utf-8")
    assert run("search", model, *words, "--out", tmp_path / "out", "-q") == 2
    assert field in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("response", "target", "reached"),
    [
        ('omega = 0.85\nexpect = "1-2-2"', ("--yield", 0.5), True),
        ('omega = 0.215\nexpect = "1-8-8"', ("--yield", 0.97), False),  # nearly grazes
    ],
)
def test_the_design_of_a_search_is_cured_in_a_folder_of_its_own(
    response: str,
    target: tuple[object, ...],
    reached: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """What the search itself does is another test's: here a plain choice of parts stands for it, so
    that the cure alone is of its type."""
    model, out = tmp_path / "model.toml", tmp_path / "out"
    model.write_text(asked(response, objective="match"), encoding="utf-8")

    def chosen(file: ModelFile, folder: Path, options: Options, *rest: Any) -> JobOutcome:
        made_now = synthesise_into(file, folder, options)
        commands.append(rest[0](options))
        return replace(made_now, answer=found, satisfied=True)

    commands: list[str] = []
    nothing: dict[str, Any] = {"responses": []}
    found = nothing | {"search": {"final": nothing, "contributions": []}, "confirmation": nothing}
    monkeypatch.setattr("designer.jobs.search_job.search_into", chosen)
    monkeypatch.setattr("designer.verbs.search.whole_job", lambda answer: None)
    monkeypatch.setitem(OF_VERB, "search", object)
    monkeypatch.setattr(search_job, "LEAST", 3)  # boards in ngspice
    monkeypatch.setattr(search_job, "SAMPLES", 12)
    without = [word for kind in KINDS for word in ("--without", kind)]
    options = ("--out", out, *target, *without, "--jobs", 1, "-q")
    assert run("search", model, *options, "--json") == (0 if reached else 1)
    answer = json.loads(capsys.readouterr().out)
    assert_type(answer["cure"], ConfirmedCure)
    confirmation = answer["cure"].pop("confirmation")
    assert answer["cure"] == read(out / "cure.json")
    assert answer["cure"]["reached"] is reached
    if reached:
        (row,) = confirmation["responses"]
        assert row["gate"]["passed"]
        assert (row["asked"], row["agreed"]) == (3, 3)
    else:
        assert confirmation is None
    answer["cure"]["confirmation"] = confirmation
    assert (out / "cured" / "design.json").exists() is reached
    assert shlex.join(str(word) for word in target) in commands[0]

    # Again: nothing is done anew, and the same is said.
    before = files(out)
    assert run("search", model, *options, "--json") == (0 if reached else 1)
    assert json.loads(capsys.readouterr().out) == answer
    assert files(out) == before
    assert run("search", model, *options[:-1]) == (0 if reached else 1)
    said = capsys.readouterr().err
    assert (f"designer tolerance {out / 'cured'}" in said) is reached
    assert ("nothing has to change" if reached else "97 % not reached") in said
    assert ("ngspice confirms of the cured boards: 1-2-2 3/3" in said) is reached

    # What ngspice does not confirm is no cure.
    monkeypatch.setattr(search_job, "confirms", lambda row: False)
    assert run("search", model, *options) == 1

    # Another repair that does not come to a design: the old one is told of.
    if reached:
        failed = CureResult(
            cast(Any, {**answer["cure"], "reached": False, "why": "none"}), False, False
        )
        monkeypatch.setattr("designer.jobs.repair_job.repair_into", lambda *_, **__: failed)
        assert run("search", model, *options[:-1]) == 1
        assert "holds an earlier design" in capsys.readouterr().err


@pytest.mark.parametrize("found", [True, False])
@pytest.mark.parametrize("cured", [True, False])
@pytest.mark.parametrize("stood", [True, False])
def test_both_designs_are_to_be_confirmed(
    found: bool, cured: bool, stood: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The one that was found, and the one that came of its repair."""
    gate = {"passed": True}
    rows = {"responses": [{"gate": gate, "asked": 40, "agreed": 40 if cured else 0}]}
    monkeypatch.setattr(
        search_job, "search_into", lambda *_: JobOutcome({}, found, tmp_path, reused=True)
    )
    monkeypatch.setattr(
        "designer.jobs.repair_job.repair_into",
        lambda *_, **__: CureResult(cast(Any, {}), True, True),
    )
    monkeypatch.setattr(search_job, "confirmed_repair", lambda *_: (rows, stood))
    outcome = designer.search(parse_model_file(asked(OPEN)), tmp_path / "out", yield_=0.9)
    assert outcome.satisfied is (found and cured)
    assert outcome.reused is stood


def test_no_ngspice_is_said_before_a_repair_of_a_search_that_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a repair that is known not to reach its yield nothing is to be confirmed."""
    folder, asks = Folder(tmp_path / "out"), list[Path]()
    model = tmp_path / "model.toml"
    model.write_text(asked(OPEN), encoding="utf-8")

    def missing() -> str:
        raise EnvironmentMissing("the program ngspice is missing")

    def unreached(path: Path, **_: Any) -> CureResult:
        asks.append(path)
        return CureResult(cast(Any, {}), False, True)

    def stands(*_: Any) -> JobOutcome:
        return JobOutcome({}, True, folder.path, reused=True)

    monkeypatch.setattr(search_job, "program_version", missing)
    monkeypatch.setattr(search_job, "search_into", stands)
    monkeypatch.setattr("designer.jobs.repair_job.repair_into", unreached)
    command = ("search", model, "--out", folder.path, "--yield", 0.9, "--resume", "-q", "--json")
    folder.begin({"confirmation": ({}, ["confirmation.json"])}, {})
    folder.write("confirmation.json", "{}")
    folder.finish("confirmation")
    assert run(*command) == 3
    assert "ngspice" in capsys.readouterr().err
    assert not asks
    folder.begin({"cure": ({}, ["cure.json"])}, {})
    folder.write("cure.json", '{"format": 1, "reached": false}')
    folder.finish("cure")
    assert run(*command) == 1
    assert asks == [folder.path]


def test_a_place_for_the_repaired_design_is_kept_free(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, notes = tmp_path / "model.toml", tmp_path / "out" / "cured" / "notes.txt"
    model.write_text(asked(OPEN), encoding="utf-8")
    notes.parent.mkdir(parents=True)
    notes.write_text("mine", encoding="utf-8")
    assert run("search", model, "--yield", 0.9, "--out", tmp_path / "out", "-q") == 2
    assert "cured" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["cured"]


def test_a_search_s_tables_are_for_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study tells that its answer was shown; nobody did where the verb shows none so early."""
    folder = Folder(tmp_path)
    folder.begin({"search": ({}, ["search.json"])}, {})
    folder.write("search.json", dumps({"format": 1}))
    folder.finish("search")
    for name, value in (
        ("program_version", None),
        ("searched_into", None),
        ("run_into", JobOutcome({}, True, reused=True, shown=True)),
        ("_confirmed", ({"responses": []}, False)),
    ):
        job = f"designer.jobs.search_job.{name}"
        monkeypatch.setattr(job, lambda *_, value=value, **__: value)
    random = SimpleNamespace(answer=lambda _: {"responses": []})
    monkeypatch.setattr("designer.jobs.search_job.RANDOM", random)
    monkeypatch.setattr("designer.jobs.search_job.fidelity_choice.for_search", lambda *_: "exact")
    file: Any = None
    found = search_into(file, tmp_path, Options(), lambda _: "")
    assert found.satisfied
    assert not found.shown
    assert not found.reused  # the confirmation was made now


@pytest.mark.parametrize(
    ("passed", "asked", "agreed", "held"),
    [
        (True, 40, 40, True),
        (True, 40, 38, True),
        (True, 40, 37, False),
        (True, 0, 0, False),
        (False, 40, 40, False),
        (None, 40, 40, False),
    ],
)
def test_what_ngspice_bears_out(passed: bool | None, asked: int, agreed: int, held: bool) -> None:
    gate = None if passed is None else {"passed": passed}
    row: Any = {"gate": gate, "asked": asked, "agreed": agreed}
    assert confirms(row) is held
