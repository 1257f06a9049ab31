"""The verb ``bench``: records of boards in, their names, a page and pictures out."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from designer.base.errors import EnvironmentMissing, InputError
from designer.cli import entry as cli
from designer.folders import design_source
from designer.jobs import bench_job
from designer.verbs.bench import bench, channels_of
from designer.workbench import naming
from tests.shared.exploring import quick
from tests.shared.paper_cases import synthesised
from tests.shared.typed_answers import check_type
from tests.workbench.stored_records import stored


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What stands for the design folder of ``examples/paper.toml``."""
    place = tmp_path / "design"
    monkeypatch.setattr(design_source, "read_design", lambda *_: synthesised())
    monkeypatch.setattr(bench_job, "is_design_folder", lambda path: Path(path) == place)
    return place


def csv_of(number: int, path: Path) -> Path:
    """A stored record as a Rigol MSO5000 writes it."""
    record = stored(number).record
    names = ",".join(f"{channel}(V)" for channel in record.signals)
    table = np.column_stack([record.time, *record.signals.values()])
    np.savetxt(
        path, table, delimiter=",", fmt="%.7e", header=f"Time(s),{names}", comments="", newline="\n"
    )
    return path


@pytest.mark.slow
def test_records_are_named_and_laid_over_the_orbit(folder: Path, tmp_path: Path) -> None:
    files = [csv_of(2, tmp_path / "a.csv"), csv_of(8, tmp_path / "b.csv")]
    out = tmp_path / "board"
    result = bench(folder, files, out=out, ngspice=False)
    assert (
        json.loads((out / "bench.json").read_text("utf-8"))["records"] == (result.answer["records"])
    )
    answer: Any = result.answer
    sure, open_ = answer["records"]
    assert (sure["response"], sure["sure"], sure["wanted"]) == ("1-2-2", True, "1-2-2")
    assert sure["as_wanted"] is True
    assert sure["omega"] == pytest.approx(0.85, rel=3e-4)
    assert (open_["sure"], open_["as_wanted"]) == (False, False)
    assert stored(8).response in (open_["response"], *open_["others"])
    assert not result.satisfied
    for record in (sure, open_):
        assert max(record["exact_circuit"]["difference"].values()) < 0.3
    assert sure["exact_circuit"]["response"] == "1-2-2"
    page = (out / "bench.html").read_text("utf-8")
    assert page.count("<svg") >= 2
    assert open_["would_tell"] in page
    assert {p.name for p in out.iterdir()} == set(result.answer["files"])
    with pytest.raises(InputError, match="--overwrite"):
        bench(folder, files, out=out)
    assert list(result.table()["file"]) == ["a.csv", "b.csv"]


def test_the_verb_prints_the_object(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = csv_of(5, tmp_path / "a.csv")
    words = ["bench", str(folder), "--record", str(file), "--omega", "0.337"]
    assert cli.status([*words, "--channels", "v1=CH1,fv=CH2", "--json"]) == 0
    (record,) = json.loads(capsys.readouterr().out)["records"]
    assert record["response"] == "1-5-5"
    assert record["frequency"] == pytest.approx(stored(5).frequency, rel=2e-4)
    assert cli.status([*words, "--channels", "v1=CH9"]) == 2
    assert "CH9" in capsys.readouterr().err
    assert cli.status(["bench", str(folder)]) == 2
    assert "--record is missing" in capsys.readouterr().err


def test_a_stop_that_the_motion_does_not_reach_is_named_so(folder: Path, tmp_path: Path) -> None:
    """A sine into a stage that bends at 4.7 V; the lower stop is 3 V beyond the motion."""
    time = np.linspace(0.0, 9.0 / stored(2).frequency, 4000)
    v1 = 2.0 + 3.6 * np.sin(2.0 * np.pi * stored(2).frequency * time)
    noise = np.random.default_rng(2).normal(0.0, 0.01, (4000, 2))
    table = np.column_stack([time, v1 + noise[:, 0], np.maximum(v1 - 4.7, 0.0) + noise[:, 1]])
    path, out = tmp_path / "one.csv", tmp_path / "board"
    np.savetxt(path, table, delimiter=",", header="Time(s),CH1(V),CH2(V)", comments="")
    told = {"v1": "CH1", "fv": "CH2"}
    result = bench(folder, [path], omega=0.85, channels=told, out=out, ngspice=False)
    check_type(result.answer, "bench")
    (record,) = json.loads((out / "bench.json").read_text("utf-8"))["records"]
    (stop,) = record["stops"]
    assert record["response"] == "1-1-0"
    assert stop["upper"]["volts"] == pytest.approx(4.7, abs=4.0 * stop["upper"]["error"])
    assert stop["lower"]["error"] is None
    assert ", lower not reached." in (out / "bench.html").read_text("utf-8")


def test_tables_are_the_answer(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On standard output, and nothing with --quiet."""
    words = ["bench", str(folder), "--record", str(csv_of(2, tmp_path / "a.csv"))]
    assert cli.status(words) == 0
    assert "1-2-2" in capsys.readouterr().out
    assert cli.status([*words, "--quiet"]) == 0
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("omega", [0.0, -0.85, float("nan"), float("inf")])
def test_a_frequency_that_is_none_is_refused(folder: Path, tmp_path: Path, omega: float) -> None:
    with pytest.raises(InputError, match="above 0") as error:
        bench(folder, [csv_of(2, tmp_path / "a.csv")], omega=omega)
    assert error.value.field == "--omega"


@pytest.mark.slow
def test_ngspice_is_laid_over_a_record(folder: Path, tmp_path: Path) -> None:
    """A record of another run of ngspice: its nominal board moves alike, in phase."""
    out = tmp_path / "board"
    result = bench(folder, [csv_of(2, tmp_path / "a.csv")], out=out)
    (record,) = json.loads((out / "bench.json").read_text("utf-8"))["records"]
    assert record["ngspice"]["response"] == "1-2-2"
    assert not record["ngspice"]["fitted"]
    exact, wave = record["exact_circuit"]["difference"], record["ngspice"]["difference"]
    for net in ("v1", "fv"):
        assert wave[net] == pytest.approx(exact[net], abs=0.02)
    assert result.answer["records"] == [record]
    check_type(result.answer, "bench")
    assert "Dotted: ngspice" in (out / "bench.html").read_text("utf-8")


@pytest.mark.parametrize("error", quick([KeyboardInterrupt(), EnvironmentMissing("no ngspice")]))
def test_what_stands_before_ngspice_is_kept(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    def stop(_: object) -> None:
        raise error

    monkeypatch.setattr(bench_job, "require_ngspice", stop)
    out = tmp_path / "board"
    ends = (
        pytest.raises(KeyboardInterrupt) if isinstance(error, KeyboardInterrupt) else nullcontext()
    )
    with ends:
        bench(folder, [csv_of(2, tmp_path / "a.csv")], out=out)
    (record,) = json.loads((out / "bench.json").read_text("utf-8"))["records"]
    assert (record["response"], record["ngspice"]) == ("1-2-2", None)
    assert (out / "bench.html").exists()


@pytest.mark.slow
def test_boards_are_fitted_and_advised(folder: Path, tmp_path: Path) -> None:
    """Two boards with a record each: figures, advice for every response, a list to study."""
    files = []
    for name, number in (("A", 0), ("B", 2)):
        (tmp_path / name).mkdir()
        files.append(csv_of(number, tmp_path / name / "v1.csv"))
    out = tmp_path / "out"
    result = bench(folder, files, boards=True, out=out)
    check_type(result.answer, "bench")
    first, second = result.answer["boards"]
    assert (first["board"], second["board"]) == ("A", "B")
    assert not first["doubtful"]
    answer: Any = result.answer
    for board, record in zip((first, second), answer["records"], strict=True):
        assert board["files"] == ["v1.csv"]
        assert record["fitted"] == board["figures"] != []
        for figure in board["figures"]:
            assert figure["low"] < figure["value"] < figure["high"]
        assert {a["expected"] for a in board["advice"]} >= {"1-1-1", "1-2-2", "1-8-8"}
        assert record["advice"]["expected"] == record["wanted"] == record["response"]
        assert record["advice"]["words"] == "leave it as it is set"
        wave = record["ngspice"]
        assert (wave["response"], wave["fitted"]) == (record["response"], True)
        assert max(wave["difference"].values()) < 0.06  # the scope's gain is off by 2 % at most
    names = set(pd.read_csv(out / "boards.csv")["board"])
    assert names == {f"{board} {k}" for board in "AB" for k in range(1, 21)}
    page = (out / "bench.html").read_text("utf-8")
    assert "Board A" in page
    assert "What to turn" in page


def csv_of_decay(path: Path, frequency: float, damping: float) -> Path:
    """v1 as a damped oscillation [Hz] about 0.3 V, no contact, at the channels of record 3."""
    time = np.linspace(0.0, 0.1, 4000)
    rate = 2.0 * np.pi * frequency * damping
    v1 = 0.3 + 3.0 * np.exp(-rate * time) * np.cos(np.sqrt(1.0 / damping**2 - 1.0) * rate * time)
    noise = np.random.default_rng(2).normal(0.0, 0.02, (4000, 2))
    table = np.column_stack([time, v1 + noise[:, 0], noise[:, 1]])
    np.savetxt(path, table, delimiter=",", header="Time(s),CH1(V),CH2(V)", comments="")
    return path


@pytest.mark.slow
def test_the_generator_off_tells_the_resonance(folder: Path, tmp_path: Path) -> None:
    """A decay at a resonance of the spread, which the record alone knows to several per cent."""
    files, off = [csv_of(3, tmp_path / "on.csv")], tmp_path / "off.csv"
    (alone,) = bench(folder, files, fit=True).answer["boards"]
    known = {figure["name"]: figure for figure in alone["figures"]}
    wanted = known["resonance 1, open"]["value"]
    ratio = known["damping ratio 1, open"]["value"]
    decay = [csv_of_decay(off, 1.01 * wanted, ratio)]
    (board,) = bench(folder, files, decay=decay).answer["boards"]
    assert board["files"] == ["on.csv", "off.csv"]
    (figure,) = (f for f in board["figures"] if f["name"] == "resonance 1, open")
    assert figure["value"] == pytest.approx(1.01 * wanted, rel=2e-3)
    assert figure["high"] - figure["low"] < 0.01 * wanted


def test_a_decay_needs_a_record_of_its_board(folder: Path, tmp_path: Path) -> None:
    for name in "AB":
        (tmp_path / name).mkdir()
    files = [csv_of(3, tmp_path / "A" / "on.csv")]
    off = csv_of_decay(tmp_path / "B" / "off.csv", 100.0, 0.06)
    with pytest.raises(InputError, match="another --record of it"):
        bench(folder, files, boards=True, decay=[off])


@pytest.mark.parametrize("what", ["no record", "never free"])
def test_a_wrong_decay_is_refused_before_anything_is_named(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    def late(*_: object) -> None:
        raise AssertionError("a record was named")

    monkeypatch.setattr(naming, "identify_response", late)
    off = csv_of(3, tmp_path / "off.csv")  # the generator is on to its end
    if what == "no record":
        off.write_text("nothing\n" * 200)
    with pytest.raises(InputError) as error:
        bench(folder, [csv_of(3, tmp_path / "on.csv")], decay=[off], out=tmp_path / "out")
    assert "off.csv" in str(error.value)
    assert not (tmp_path / "out").exists()


def test_a_record_that_does_not_repeat_has_no_board(folder: Path, tmp_path: Path) -> None:
    record = stored(2).record
    time = record.time
    noise = np.random.default_rng(1).standard_normal((len(time), 2)).cumsum(axis=0)
    path = tmp_path / "noise.csv"
    np.savetxt(path, np.column_stack([time, noise]), delimiter=",", header="Time(s),CH1(V),CH2(V)",
               comments="")  # fmt: skip
    told = {"v1": "CH1", "fv": "CH2"}
    answer = bench(folder, [path], omega=0.85, channels=told, fit=True).answer
    (board,) = answer["boards"]
    assert "no record repeats" in board["reason"]
    assert answer["records"][0]["fitted"] == []
    assert answer["records"][0]["advice"] is None


def test_boards_in_one_folder_are_refused(folder: Path, tmp_path: Path) -> None:
    """They would be taken for one board."""
    files = [csv_of(0, tmp_path / "a.csv"), csv_of(2, tmp_path / "b.csv")]
    with pytest.raises(InputError, match="a folder for each board") as error:
        bench(folder, files, boards=True)
    assert error.value.field == "--boards"


@pytest.mark.parametrize("text", ["", "v1", "v1=", "v1=CH1,v1=CH2", "v1=CH1,fv=CH1"])
def test_channels_that_are_no_pairs_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="--channels"):
        channels_of(text)


def test_what_is_in_the_way_is_not_replaced(folder: Path, tmp_path: Path) -> None:
    file = csv_of(0, tmp_path / "a.csv")
    for out, found in ((folder, "a design folder"), (file, "a file")):
        if out == folder:
            folder.mkdir(exist_ok=True)
        with pytest.raises(InputError, match=found):
            bench(folder, [file], out=out)
    with pytest.raises(InputError, match=r"no manifest\.json"):
        bench(tmp_path / "elsewhere", [file])
