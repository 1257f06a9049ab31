"""A place as a model file: the same system when it is read again, and no file but its own."""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer import InputError, ModelFile, parse_model_file, read_model_file
from designer.explorer.job_processes import Job, JobProcesses
from designer.explorer.place import first_place, read_place
from designer.explorer.questions import read_question, save_model
from designer.explorer.saved_model import not_found, place_for, read_pins, save, saved_text
from tests.explorer.served import EXAMPLES
from tests.shared.model_text import COARSE_CIRCUIT, PAPER_TABLE
from tests.shared.system_text import system_text, table

MECHANICAL = (
    "format = 1\n[mechanical]\nM1 = '2 kg'\nM2 = 3\nC1 = 60\nC2 = 24\nK0 = '540 kN/m'\n"
    "K1 = '60 kN/m'\nK2 = '40 kN/m'\nB = '0.5 mm'\nP1 = 80\nP2 = 0\n"
)


POINTS = system_text(
    {"tip": "2 kg"},
    {("tip", "ground"): 900.0},
    {("tip", "ground"): 1.0},
    table("law", name="F", between=["tip", "ground"], points=[["-1 mm", 0], [0, 0], ["2 mm", 3]]),
    table("force", on="tip", amplitude=1.0),
)
MATRICES = """
format = 2
[matrices]
names = ["tip", "root"]
mass = [1, 2]
stiffness = [[3, -1], [-1, 4]]
damping = [[0.1, 0.05], [-0.05, 0.2]]
[[law]]
name = "F"
between = ["tip", "ground"]
points = [[-1, -1], [0, 0], [2, 1]]
[[force]]
on = "tip"
amplitude = 1
"""
TEXTS = {"mechanical": MECHANICAL, "points": POINTS, "matrices": MATRICES}


def file(name: str) -> ModelFile:
    if name in TEXTS:
        return parse_model_file(TEXTS[name])
    return read_model_file(EXAMPLES / f"{name}.toml")


FILES = (
    "paper",
    "mechanical",
    "three-masses",
    "hammer-base",
    "backlash",
    "preloaded",
    "aberdeen",
    "two-wells-chaos",
    "points",
    "matrices",
)


@pytest.mark.parametrize("name", FILES)
def test_a_saved_place_is_the_same_system_again(name: str) -> None:
    """Every parameter moved a little; matrices, forces and gaps are those of the place."""
    modelfile = file(name)
    model = modelfile.model
    words: dict[str, Any] = {
        each: model.parameter(each) * (1.0 + 0.003 * (k + 1))
        for k, each in enumerate(model.parameters)
        if each != "f20"
    }
    if "b" not in model.units:
        words["b"] = 1.0
    place = read_place(modelfile, words)
    text = saved_text(modelfile, place)
    again = parse_model_file(text)
    wanted, found = place.model.second_order(), again.model.second_order()
    for key in ("mass", "damping", "stiffness", "force", "constant"):
        assert getattr(found, key) == pytest.approx(getattr(wanted, key), rel=1e-9), key
    for law, same in zip(found.laws, wanted.laws, strict=True):
        assert np.array(law.points) == pytest.approx(np.array(same.points), rel=1e-9)
    for one, other in zip(found.clearances, wanted.clearances, strict=True):
        for a, b in zip(one.sides, other.sides, strict=True):
            assert np.array(a[1].springs) == pytest.approx(np.array(b[1].springs), rel=1e-9)
    assert found.base == pytest.approx(wanted.base)
    assert again.responses == modelfile.responses
    assert (again.circuit, again.spread) == (modelfile.circuit, modelfile.spread)
    assert again.si == modelfile.si or name == "mechanical"


def test_an_unchanged_place_changes_no_number() -> None:
    for name in FILES:
        modelfile = file(name)
        assert parse_model_file(saved_text(modelfile, read_place(modelfile, {}))).model == (
            modelfile.model
        )


def test_the_factor_of_gaps_goes_to_the_responses_that_have_none() -> None:
    modelfile = file("three-masses")
    again = parse_model_file(saved_text(modelfile, read_place(modelfile, {"b": 0.8})))
    assert [r.b for r in modelfile.responses] == [None] * len(again.responses)
    assert [r.b for r in again.responses] == [0.8] * len(again.responses)
    assert first_place(again).model.b == 0.8
    for b in (0.9, 1.0):
        again = parse_model_file(saved_text(again, read_place(again, {"b": b})))
        assert [r.b for r in again.responses] == [b] * len(again.responses)
    assert saved_text(again, read_place(again, {})) == saved_text(again, first_place(again))


def test_a_factor_that_no_response_can_have_is_refused() -> None:
    modelfile = file("points")
    assert not modelfile.responses
    assert "response" not in saved_text(modelfile, read_place(modelfile, {}))
    with pytest.raises(InputError, match=r"b: found 0\.8, expected 1, or a pin"):
        saved_text(modelfile, read_place(modelfile, {"b": 0.8}))


def test_pins_become_the_wanted_responses_and_are_looked_for() -> None:
    modelfile = file("paper")
    pins = read_pins(modelfile, ["0.85~1-2-2~0.25", "1.55~1-1-1~0.3", "0.54~1-7-7~0.25"])
    again = parse_model_file(saved_text(modelfile, read_place(modelfile, {"zeta": 0.1}), pins))
    wanted = [(r.omega, str(r.expect), r.b) for r in again.responses]
    assert wanted == [(0.85, "1-2-2", None), (1.55, "1-1-1", 0.3), (0.54, "1-7-7", None)]
    assert not_found(again) == ["1-7-7 at ω = 0.54"]


def test_a_file_in_hertz_millimetres_and_grams_is_saved_in_them() -> None:
    """The frequency reads back to the last digit, and a gap has the prefix it had."""
    text = (EXAMPLES / "hammer-base.toml").read_text("utf-8").split("[[response]]")[0]
    assert 'mass = "2 kg"' in text
    modelfile = parse_model_file(text.replace('mass = "2 kg"', 'mass = "2000g"', 1))
    omega = 72.0 * math.pi
    words = {"anvil.lower": 0.00123, "hammer.mass": 1.9}
    pins = read_pins(modelfile, [f"{omega!r}~1-0-1~1.0"])
    saved = saved_text(modelfile, read_place(modelfile, words), pins)
    assert 'frequency = "36 Hz"' in saved
    assert 'lower = "1.23 mm"' in saved
    assert 'mass = "1900g"' in saved
    again = parse_model_file(saved)
    assert again.responses[0].omega == omega
    assert again.model.parameter("anvil.lower") == 0.00123


@pytest.mark.parametrize(
    "texts",
    ["x", ["0.85~1-2-2"], ["0.85~one~0.25"], ["nan~1-1-1~0.25"], ["1~1-1-1~-2"], ["1"] * 99],
)
def test_what_is_no_pin_is_refused(texts: object) -> None:
    with pytest.raises(InputError):
        read_pins(file("paper"), texts)


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "../x", "/etc/passwd", "a/b", "a\\b", ".hidden", "x" * 80, "a\nb", "-rf", None],
)
def test_a_name_is_one_name(name: object, tmp_path: Path) -> None:
    with pytest.raises(InputError):
        place_for(tmp_path, name)


def test_no_file_is_replaced_unasked(tmp_path: Path) -> None:
    path = place_for(tmp_path, "mine.toml")
    assert path == tmp_path / "mine.toml"
    assert save(path, "one")
    assert not save(path, "two")
    assert path.read_text("utf-8") == "one"
    assert save(path, "two", overwrite=True)
    assert path.read_text("utf-8") == "two"
    outside = tmp_path / "outside"
    (tmp_path / "link.toml").symlink_to(outside)
    assert not save(tmp_path / "link.toml", "three")
    assert save(tmp_path / "link.toml", "three", overwrite=True)
    assert not outside.exists()


def asked(kind: str, **more: object) -> Any:
    question = read_question(json.dumps({"kind": kind, "id": -1, "words": {}, **more}))
    assert question is not None
    return question


def test_a_question_to_save_is_answered_and_asks_back(tmp_path: Path) -> None:
    modelfile, jobs = file("paper"), JobProcesses(lambda _: None)
    question = asked("save", name="mine", pins=["0.85~1-2-2~0.25"])
    (first,) = save_model(modelfile, tmp_path, jobs, question)
    assert first == {"kind": "saved", "name": "mine.toml", "missing": []}
    (same,) = save_model(modelfile, tmp_path, jobs, question)
    assert same["kind"] == "saved"
    (other,) = save_model(modelfile, tmp_path, jobs, asked("save", name="mine"))
    assert other == {"kind": "exists", "name": "mine.toml", "verb": "save"}
    assert len(read_model_file(tmp_path / "mine.toml").responses) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


def test_a_job_without_a_wanted_response_is_refused_before_anything_is_written(
    tmp_path: Path,
) -> None:
    modelfile = parse_model_file(f"format = 1\n{PAPER_TABLE}{COARSE_CIRCUIT}")
    with pytest.raises(InputError, match="pin one"):
        list(
            save_model(modelfile, tmp_path, JobProcesses(lambda _: None), asked("run", name="mine"))
        )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_job_has_a_folder_of_its_own_and_says_how_it_ended(tmp_path: Path) -> None:
    """A file that asks for what cannot be: the process ends with status 2 and its message."""
    path = tmp_path / "mine.toml"
    path.write_text(f"format = 1\n{PAPER_TABLE}{COARSE_CIRCUIT}", encoding="utf-8")
    (tmp_path / "mine-run").mkdir()
    told: list[dict[str, Any]] = []
    jobs = JobProcesses(told.append)
    job = jobs.start("run", path)
    job.process.wait(120)
    jobs.close()
    assert told[-1]["status"] == 2
    assert "response" in told[-1]["line"]
    assert job.folder == tmp_path / "mine-run-2"
    assert jobs.report("mine-run-2") is None
    assert jobs.report("../mine-run") is None
    assert "response" in (tmp_path / "mine-run-2.log").read_text("utf-8")


def test_a_job_is_told_of_to_its_end_where_its_log_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "mine-run.log").symlink_to("/dev/full")
    script = "for n in 1 2 3; do echo designer: step $n >&2; done"
    process = subprocess.Popen(["sh", "-c", script], stderr=subprocess.PIPE, text=True)
    told: list[dict[str, Any]] = []
    JobProcesses(told.append)._heed(Job("run", tmp_path / "mine-run", process))
    assert [message["line"] for message in told[:-1]] == ["step 1", "step 2", "step 3"]
    assert told[-1]["status"] == 0
