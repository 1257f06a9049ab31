"""``designer`` as a library: every verb is a function, and its results are frames and show
themselves in a notebook."""

from __future__ import annotations

import csv
import importlib
import inspect
import json
import math
import pickle
import pydoc
import shutil
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pytest

import designer
from designer.base.frames import MOST_ROWS, frame, table_html
from designer.board.bom import bill_csv
from designer.cli.app import VERBS
from designer.folders.board_files import bills
from designer.jobs import repair_job, search_job, trade_job
from designer.model.measured_values import MeasuredBoards
from designer.paper import reproduce_circuit, reproduce_dynamics, reproduce_tolerance
from designer.verdicts.verdict import Verdict
from tests.shared.house import ORDER
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE
from tests.shared.quick_folders import quick_folder

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

HOSTILE = "<script>alert(1)</script> & co"
TWO = '[[response]]\nomega = 0.85\nexpect = "1-2-2"\n[[response]]\nomega = 1.55\nexpect = "1-1-1"\n'
TEXT = f'format = 1\ntitle = "{HOSTILE}"\n{PAPER_TABLE}{TWO}{COARSE_RECTIFIER}'
SAMPLES = 5


class _Asked(Exception):
    """What a verb was about to do."""


@pytest.fixture(scope="module", autouse=True)
def every_package() -> None:
    """A package that bore a verb's name would now stand where the function should."""
    for package in ORDER:
        importlib.import_module(f"designer.{package}")


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("library") / "small.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return quick_folder(TEXT, tmp_path_factory.mktemp("library") / "design")


@pytest.fixture(scope="module")
def ruled(folder: Path) -> designer.RulesResult:
    return designer.rules(folder)


@pytest.fixture(scope="module")
def made(model: Path) -> designer.JobOutcome:
    return designer.synthesise(designer.read_model_file(model))


@pytest.fixture(scope="module")
def study(made: designer.JobOutcome) -> designer.Study:
    return designer.tolerance(made, samples=SAMPLES, rung="exact", blame=False, jobs=1).study


def test_every_verb_is_a_function() -> None:
    """``catalog`` is a package, so the verb's function is ``load_catalog``."""
    assert isinstance(importlib.import_module("designer.catalog"), ModuleType)
    names = {"load_catalog" if verb == "catalog" else verb for verb in VERBS} | {"cure"}
    for name in names:
        function = getattr(designer, name)
        assert inspect.isfunction(function), name
        assert function.__doc__, name
        assert "return" in function.__annotations__, name
    assert designer.synthesize is designer.synthesise


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb != "catalog"])
def test_help_says_types_and_what_each_word_is(verb: str) -> None:
    function = getattr(designer, verb)
    text = pydoc.plain(pydoc.render_doc(function))
    for code in ("Annotated", "lambda", " at 0x", "option("):
        assert code not in text
    for parameter, word, _ in importlib.import_module(function.__module__).VERB.words():
        assert f"    {parameter.name} : " in text
        assert word.help in text


def test_new_and_load_catalog(tmp_path: Path) -> None:
    path = designer.new(tmp_path / "mine.toml")
    assert len(designer.read_model_file(path).responses) == 2
    with pytest.raises(designer.InputError):
        designer.new(str(path))
    assert "TL074C" in {entry.name for entry in designer.load_catalog().opamps}


def test_simulate(model: Path) -> None:
    found = designer.simulate(designer.read_model_file(model), starts=4)
    table = found.table()
    assert [s.orbit.response for s in found] == ["1-2-2", "1-1-1"]
    assert len(table) == sum(1 + (s.twin is not None) + len(s.others) for s in found)
    wanted = table[table.orbit == "wanted"]
    assert list(wanted.response) == list(wanted.expected) == ["1-2-2", "1-1-1"]
    assert wanted.x1_max.to_numpy() == pytest.approx([0.401043, 0.388356], abs=1e-6)  # README.md


def test_a_table_and_an_answer_name_the_same_displacements() -> None:
    """Absolute ones, where the base moves and the equations count from it."""
    file = Path(__file__).parents[2] / "examples" / "hammer-base.toml"
    found = designer.simulate(file, frequency="54 Hz", starts=4)
    answer: Any = found.answer
    (row,), table = answer["responses"], found.table()
    assert row["base_amplitude"] > 0.0
    both = [row, *row["others"]]
    for kind in ("min", "max"):
        expected = [each[f"x1_{kind}"] for each in both]
        shown = table[table.orbit != "twin"][f"x1_{kind}"]
        assert list(shown) == pytest.approx(expected, rel=1e-12)
        assert expected[0] != pytest.approx(row["extremes"]["x1"][kind == "max"], rel=0.01)


def test_a_frequency_may_be_one_value_or_several() -> None:
    """54 Hz and 2π · 54 rad/s are one place, however they are given; what is none says what is."""
    file = Path(__file__).parents[2] / "examples" / "hammer-base.toml"
    words: list[dict[str, Any]] = [
        {"frequency": "54 Hz"},
        {"frequency": ["54 Hz"]},
        {"frequency": 54.0},
        {"omega": 108.0 * math.pi},
        {"omega": np.array([108.0 * math.pi])},
    ]
    answers = [designer.simulate(file, starts=1, **each).answer["responses"] for each in words]
    assert [len(responses) for responses in answers] == [1] * len(words)
    assert len({responses[0]["response"] for responses in answers}) == 1
    for (response,) in answers:
        assert response["omega"] == pytest.approx(108.0 * math.pi, rel=1e-15)
    for wrong in ({"omega": None}, {"frequency": b"54 Hz"}, {"omega": [True]}):
        with pytest.raises(designer.InputError, match="one value or a list of them"):
            designer.simulate(file, **wrong)


def test_bifurcation(model: Path, tmp_path: Path) -> None:
    words: dict[str, Any] = {"from_": 0.85, "to": 0.86, "steps": 3, "jobs": 1}
    found = designer.bifurcation(model, **words, out=tmp_path / "sweep")
    written = json.loads((tmp_path / "sweep" / "sweep.json").read_text(encoding="utf-8"))
    assert written == found.answer
    assert not found.reused
    windows = found.windows()
    assert len(windows) == len(written["windows"]) >= 1
    assert windows.iloc[0]["response"] == written["windows"][0]["response"] == "1-2-2"
    assert len(found.points()) == len(written["points"])
    assert designer.bifurcation(str(model), **words, out=str(tmp_path / "sweep")).reused
    steps, dots = found.steps(), found.diagram()
    assert list(steps.omega) == [0.85, 0.855, 0.86]
    assert list(steps.response) == ["1-2-2"] * 3
    least = dots[dots.quantity == "least displacement"]
    assert least.value.to_numpy() == pytest.approx(-0.401, abs=2e-3)  # the mirror of x1_max above
    assert len(least) == 3 * 30  # periods that are kept
    speeds = dots[dots.quantity.str.startswith("impact velocity")]
    assert len(speeds) == 2 * len(least)
    again = designer.bifurcation(str(model), **words, out=str(tmp_path / "sweep"))
    pd.testing.assert_frame_equal(again.diagram(), dots)
    pd.testing.assert_frame_equal(again.steps(), steps)
    pd.testing.assert_frame_equal(pickle.loads(pickle.dumps(again)).steps(), steps)
    shutil.rmtree(tmp_path / "sweep" / "sweep.parquet")
    with pytest.raises(designer.InputError, match=r"down-000000\.parquet is missing"):
        again.steps()
    assert not (tmp_path / "sweep" / "sweep.parquet").exists()
    assert found.cells().empty
    basins = designer.bifurcation(
        model, from_=-1.0, to=1.0, steps=2, basins=True, omega=0.85, map_=("x2", -1.0, 1.0, 2)
    )
    assert basins.windows().empty
    assert basins.diagram().query("quantity == 'none'").empty
    cells = basins.cells()
    assert cells[["x1", "x2"]].to_numpy().tolist() == [[x, y] for y in (-1, 1) for x in (-1, 1)]
    assert basins.answer["kind"] == "basins"
    assert set(cells.attractor) == {a["number"] for a in basins.answer["attractors"]}
    assert "x1 and x2" in basins._repr_html_()


@pytest.mark.slow
def test_export_and_rules_of_a_folder(folder: Path, ruled: designer.RulesResult) -> None:
    exported = designer.export(folder)
    assert all(path.is_file() for path in exported.files)
    assert {path.suffix for path in exported.files} >= {".kicad_sch", ".kicad_pcb"}
    decks = designer.export(str(folder), deck=["portable"])
    assert [path.suffix for path in decks.files] == [".cir"]
    written = json.loads((folder / "rules.json").read_text(encoding="utf-8"))
    assert ruled.passed == all(rule["status"] != "fail" for rule in written["rules"])
    assert list(ruled.table()["id"]) == [rule["id"] for rule in written["rules"]]


def test_a_folders_design_is_read(folder: Path, made: designer.JobOutcome) -> None:
    read = designer.read_design(folder)
    assert read.design.circuit.resistors == made.design.circuit.resistors
    assert read.modelfile.title == HOSTILE


def test_a_folder_is_studied_as_the_design_in_memory(
    folder: Path, tmp_path: Path, study: designer.Study
) -> None:
    """The same boards, written as ``tolerance`` writes them; read again from another object."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    words: dict[str, Any] = {"samples": SAMPLES, "rung": "exact", "blame": False, "jobs": 1}
    made = designer.tolerance(copy, **words)
    assert (made.folder, made.reused) == (copy, False)
    again = designer.tolerance(str(copy), **words)
    assert again.reused
    assert again.answer == made.answer
    assert again.answer["samples"] == SAMPLES
    for outcome in (made, again):
        pd.testing.assert_frame_equal(outcome.boards(), study.boards())
        pd.testing.assert_frame_equal(outcome.yields(), study.yields_table())
    assert list(again.bom().value) == list(made.bom().value)
    written = json.loads((copy / "tolerance.json").read_text(encoding="utf-8"))
    assert written["responses"] == made.answer["responses"]


def test_a_path_without_a_folder_to_write_is_refused_as_on_the_command_line(model: Path) -> None:
    for verb in (designer.synthesise, designer.run, designer.tolerance):
        with pytest.raises(designer.InputError, match="--out"):
            verb(model)
    with pytest.raises(designer.InputError, match="the study"):
        designer.synthesise(designer.read_model_file(model)).boards()


@pytest.mark.slow
def test_run(model: Path) -> None:
    """In ngspice, one response."""
    file = designer.read_model_file(model)
    one = replace(file, responses=file.responses[:1])
    result = designer.run(one, samples=2, jobs=1)
    assert len(result.study.boards()) == 2
    (checked,) = result.study.checked
    assert checked.ngspice is not None
    assert checked.ngspice.response == "1-2-2"
    assert HOSTILE not in result._repr_html_()
    (response,) = result.answer["responses"]
    assert response["ngspice"] == "1-2-2"
    assert response["yield"]["samples"] == 2
    assert result.answer["equation_check"]["passed"]
    assert result.folder is None


def test_search_and_cure_and_trade_ask_for_the_same_as_the_command_line(
    model: Path, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their work takes minutes; it ends here where it would begin."""

    def stop(*words: Any, **more: Any) -> Any:
        raise _Asked(*words, more)

    for module, name in (
        (search_job, "search_into"),
        (repair_job, "repair_into"),
        (trade_job, "answer"),
    ):
        monkeypatch.setattr(module, name, stop)
    with pytest.raises(_Asked) as met:
        designer.search(model, tmp_path / "out", samples=7, seed=3, rung="exact", jobs=1)
    file, out, options, *_ = met.value.args
    assert (file.title, out) == (HOSTILE, tmp_path / "out")
    assert (options.samples, options.seed, options.rung, options.jobs) == (7, 3, "exact", 1)
    with pytest.raises(_Asked) as met:
        designer.cure(folder, yield_=0.9, without=["trimmer"], seed=4)
    path, more = met.value.args
    assert path == folder
    assert (more["target"], more["without"], more["options"].seed) == (0.9, ["trimmer"], 4)
    with pytest.raises(_Asked) as met:
        designer.trade(folder, boards=6)
    _, out, options, extent, *_ = met.value.args
    assert (out, options.seed, extent.boards) == (folder, 1, 6)


def test_what_search_cure_and_trade_refuse(model: Path, folder: Path, tmp_path: Path) -> None:
    with pytest.raises(designer.InputError, match="--yield"):
        designer.search(folder)
    with pytest.raises(designer.InputError, match="--out"):
        designer.search(model)
    with pytest.raises(designer.InputError, match="--yield"):
        designer.cure(folder)
    with pytest.raises(designer.InputError, match="--boards"):
        designer.trade(model, boards=-1)
    with pytest.raises(designer.InputError, match="dynamics, circuit, tolerance"):
        designer.reproduce("statics", tmp_path)  # type: ignore[arg-type]
    with pytest.raises(designer.InputError, match="--samples"):
        designer.reproduce("circuit", tmp_path, samples=3)


def test_reproduce_hands_each_part_to_its_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, Path, dict[str, Any]]] = []
    for module in (reproduce_dynamics, reproduce_circuit, reproduce_tolerance):

        def report(out: Path, _name: str = module.__name__, **more: Any) -> None:
            asked.append((_name.rpartition("_")[2], out, more))

        monkeypatch.setattr(module, "reproduce", report)
    assert designer.reproduce("dynamics") == Path("reports/paper-dynamics")
    designer.reproduce("circuit", tmp_path / "circuit", jobs=1)
    designer.reproduce("tolerance", str(tmp_path), samples=3, seed=9)
    assert [(part, out) for part, out, _ in asked] == [
        ("dynamics", Path("reports/paper-dynamics")),
        ("circuit", tmp_path / "circuit"),
        ("tolerance", tmp_path),
    ]
    assert (asked[2][2]["samples"], asked[2][2]["seed"]) == (3, 9)


# ---------------------------------------------------------------------------------------------
# Frames


def test_the_boards_of_a_study_are_its_answers(study: designer.Study) -> None:
    boards = study.boards()
    assert len(boards) == len(study.answers) == 2 * SAMPLES
    omegas = {0: 0.85, 1: 1.55}  # of the questions, by the model file
    for row, answer in zip(boards.to_dict("records"), study.answers, strict=True):
        assert row["omega"] == omegas[answer.question]
        assert row["number"] == answer.question + 1
        assert row["verdict"] == answer.verdict.value
        assert row["board"] is None
        for name in ("sample", "response", "reason"):
            assert row[name] == getattr(answer, name)
    for name in ("radius", "penetration", "miss", "asymmetry", "periods", "waveform"):
        own = [getattr(a, name) for a in study.answers]
        np.testing.assert_array_equal(boards[name].to_numpy(), own)


def test_the_yields_of_a_study_are_counted_from_its_boards(study: designer.Study) -> None:
    """Also where boards were lost, one response was left out, and no board was asked at all."""
    spoilt = [replace(a, verdict=Verdict.LOST) if a.sample < 2 else a for a in study.answers]
    lossy = replace(study, answers=tuple(spoilt))
    boards, table = lossy.boards(), lossy.yields_table()
    for row in table.to_dict("records"):
        counted = Counter(boards[boards["number"] == row["number"]]["verdict"])
        assert (row["ok"], row["lost"]) == (counted["ok"], counted["lost"])
        assert row["samples"] == SAMPLES
        assert row["rate"] == pytest.approx(counted["ok"] / SAMPLES)
        assert row["low"] < row["rate"] < row["high"]
    assert list(table["lost"]) == [2, 2]
    partly = replace(
        study,
        response_indices=(1,),
        left_out={0: "why not"},
        answers=tuple(replace(a, question=0) for a in study.answers if a.question == 1),
    )
    assert list(partly.yields_table()["left_out"]) == ["why not", ""]
    assert set(partly.boards()["number"]) == {2}
    assert set(partly.boards()["omega"]) == {1.55}
    none = replace(study, answers=(), response_indices=(), left_out={0: "a", 1: "b"})
    assert none.boards().empty
    assert list(none.boards().columns) == list(study.boards().columns)


def test_the_boards_of_a_list_have_their_names(study: designer.Study) -> None:
    listed = MeasuredBoards(("left", "right"), {}, {}, b"")
    spread = replace(study.plan.spread, measured=listed)
    named = replace(study, plan=replace(study.plan, spread=spread))
    by = named.boards().groupby("sample").board.unique()
    assert [list(names) for names in by] == [["left"], ["right"], ["left"], ["right"], ["left"]]


def test_the_bill_is_that_of_the_folder(folder: Path, made: designer.JobOutcome) -> None:
    table = made.bom()
    with (folder / "bom.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [str(q) for q in table.quantity] == [row["quantity"] for row in rows]
    for name in ("designators", "value", "part_number", "grade"):
        assert list(table[name]) == [row[name] for row in rows]
    assert bills(made.synthesis)["bom.csv"].splitlines()[0] == bill_csv(()).strip()


def test_the_parts_are_those_of_the_design_file(folder: Path, made: designer.JobOutcome) -> None:
    table = made.design.parts_table()
    written = json.loads((folder / "design.json").read_text(encoding="utf-8"))["parts"]
    assert dict(zip(table.name, table.value, strict=True)) == written
    assert set(table[table.unit == "F"].name) == {n for n in written if n.startswith("C")}


# ---------------------------------------------------------------------------------------------
# Notebooks


@pytest.mark.parametrize("shown", ["made", pytest.param("ruled", marks=pytest.mark.slow)])
def test_a_hostile_title_is_escaped(shown: str, request: pytest.FixtureRequest) -> None:
    text = request.getfixturevalue(shown)._repr_html_()
    assert "<script" not in text
    assert "&lt;script&gt;" in text


def test_what_shows_itself_has_its_rows(made: designer.JobOutcome, study: designer.Study) -> None:
    (found,) = designer.simulate(made.synthesis.modelfile, [0.85], starts=4)
    for shown, words in (
        (made.design, (made.design.circuit.resistors[0].name, "Ω", "more rows")),
        (study, ("1-2-2", "1-1-1", f"{SAMPLES} boards")),
        (found, ("0.85", "1-2-2")),
    ):
        text = shown._repr_html_()
        assert all(word in text for word in words)


def test_a_table_of_html() -> None:
    rows = [{"a": "<b>", "n": 1 / 3, "none": None}] * (MOST_ROWS + 3)
    text = table_html("t < u", rows, "note & more")
    assert text.count("<tr>") == MOST_ROWS + 1
    for piece in ("<b>t &lt; u</b>", "&lt;b&gt;", "0.333333", "<td></td>", "note &amp; more"):
        assert piece in text
    assert "3 more rows" in text
    assert "<table>" not in table_html("empty", [])
    assert list(frame([], ("x", "y")).columns) == ["x", "y"]
