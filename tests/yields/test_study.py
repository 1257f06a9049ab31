"""A study as a whole: how it grows, what it keeps, and that nothing stops it for good."""

from __future__ import annotations

import json
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from designer.base import progress
from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.base.manifest import ManifestStage
from designer.cli import entry
from designer.folders import model_source, study_json
from designer.folders.study_stores import NGSPICE, PIECES
from designer.model.distributions import Uniform
from designer.spice import equation_check, numerics_gate
from designer.spice.deck import SolverSettings
from designer.verdicts import cross_check, exact_circuit, ngspice_runs
from designer.verdicts.cross_check import CrossCheck, StartKind, Why, ask_random
from designer.verdicts.verdict import BLOCK, Answer, Verdict
from designer.yields import layers, tolerance_study
from designer.yields.layers import CHUNK, LocalRunner
from designer.yields.loss_attribution import attribute
from designer.yields.row_store import BlockStore
from designer.yields.stored_parts import StoredParts
from designer.yields.study import Study
from designer.yields.tolerance_study import GROWTH, LongWork, Stores, StudyWork, tolerance
from tests.folders.test_study_cache import MAP
from tests.shared.folder_contents import differing, without_cost
from tests.shared.model_text import SMALL
from tests.shared.quick_folders import without_starts
from tests.verdicts.test_verdict import plan
from tests.yields.test_loss_attribution import _Memory

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

ROOT = Path(__file__).resolve().parents[2]
SETTINGS = SolverSettings("trap", 1e-4)


# ---------------------------------------------------------------------------------------------
# Margins in numbers


def test_quantiles_of_a_margin_say_how_many_boards_have_it() -> None:
    """A board without a miss, and one whose waveform was not compared, count in the others only."""
    ok = Answer(0, 0, Verdict.OK, "1-1-1", "", 0.5, 1.0, 1.0, 0.0, 40, 0.1)
    answers = [
        ok,
        replace(ok, sample=1, miss=math.inf),
        replace(ok, sample=2, miss=math.inf, waveform=math.nan),
        replace(ok, sample=3, verdict=Verdict.LOST),
    ]
    said = study_json.margins(answers)
    assert said["boards"] == 3
    assert said["counted"] == {
        "radius": 3, "penetration": 3, "miss": 1, "asymmetry": 3, "waveform": 2,
    }  # fmt: skip
    none = study_json.margins([replace(a, miss=math.inf) for a in answers])
    assert (none["miss"], none["counted"]["miss"]) == (None, 0)


# ---------------------------------------------------------------------------------------------
# Until the intervals are narrow


class Fixed:
    """Stands for `samples_task`: board i is ok but for every ``lost``-th."""

    def __init__(self, lost: int) -> None:
        self.lost = lost

    def __call__(self, _plan: Any, indices: range) -> Any:
        return lambda jobs, step: [
            Answer(
                i, number, Verdict.LOST if i % self.lost == 0 else Verdict.OK,
                "1-1-1", "", 0.5, 1.0, 1.0, 0.0, 40,
            )
            for i in indices
            for number in range(2)
        ]  # fmt: skip


def grown(until: float, monkeypatch: pytest.MonkeyPatch, lost: int = 10) -> Study:
    monkeypatch.setattr(layers, "samples_task", Fixed(lost))
    work = StudyWork(1, None, Stores(), LocalRunner(1), "exact")
    checked: Any = (None, None)
    return work.grown(Study(checked, plan(200), (0, 1), {}, (), until=until))


@pytest.mark.parametrize("until", [0.2, 0.05, 0.03, 0.014])
def test_a_study_grows_to_the_first_edge_that_is_narrow(
    until: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = grown(until, monkeypatch)
    assert study.narrow is True
    assert study.plan.samples % BLOCK == 0
    assert len(study.answers) == 2 * study.plan.samples
    assert [a.sample for a in study.answers[::2]] == list(range(study.plan.samples))

    def width(n: int) -> float:
        """Wilson's, by its closed formula."""
        p, z = 1.0 - math.ceil(n / 10) / n, 1.959963984540054
        half = z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
        return 2.0 * half / (1 + z * z / n)

    assert width(study.plan.samples) < until
    step = BLOCK * max(1, round(GROWTH / (1.0 + GROWTH) * study.plan.samples / BLOCK))
    assert study.plan.samples == BLOCK or width(study.plan.samples - step) >= until


def test_a_study_that_ngspice_keeps_wide_ends_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """ngspice loses every other board: the 1000 that it is asked about leave 6 %."""

    def fill_cross_checks(_plan: Any, asks: Any, *_: Any, **__: Any) -> list[CrossCheck]:
        return [
            CrossCheck(
                a.sample, a.question, a.kind, a.why,
                "1-1-2" if a.sample % 2 else "1-1-1", "", "", 9, False,
            )
            for a in asks
        ]  # fmt: skip

    monkeypatch.setattr(layers, "samples_task", _first(Fixed(10)))
    monkeypatch.setattr(layers, "fill_cross_checks", fill_cross_checks)
    notes: list[str] = []
    monkeypatch.setattr(progress, "note", notes.append)
    p = plan(200)
    one = replace(p.questions[0], settings=SETTINGS)
    checked: Any = (None,)
    pool: Any = object()
    study = Study(checked, replace(p, questions=(one,)), (0,), {}, (), until=0.04)
    study = StudyWork(1, pool, Stores(), LocalRunner(1), "auto").grown(study)
    assert study.narrow is False
    (both,) = study.combined
    assert both is not None
    assert 0.04 <= both.width < 0.08
    assert "still wider than 0.04" in notes.pop()


def test_a_response_without_an_answer_does_not_drive_the_study(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its interval is everything, however many boards there are; the other one's still counts."""

    class Silent(Fixed):
        def __call__(self, plan: Any, indices: range) -> Any:
            made = super().__call__(plan, indices)
            return lambda jobs, step: [
                replace(a, verdict=Verdict.FAILED) if a.question == 1 else a
                for a in made(jobs, step)
            ]

    monkeypatch.setattr(layers, "samples_task", Silent(10))
    notes: list[str] = []
    monkeypatch.setattr(progress, "note", notes.append)
    work = StudyWork(1, None, Stores(), LocalRunner(1), "exact")
    checked: Any = (None, None)
    study = work.grown(Study(checked, plan(200), (0, 1), {}, (), until=0.06))
    assert study.narrow is False
    assert study.plan.samples == 2 * BLOCK  # 0.06 is wider than Wilson's at 450 of 500
    assert [note for note in notes if "response 2" in note]
    assert not [note for note in notes if "wider" in note]


@pytest.mark.parametrize("until", [0.064, 0.07, 0.076])
def test_boards_at_a_boundary_count_before_a_study_ends(
    until: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ngspice loses just the boards that are next to a boundary: asked after the last sample alone
    they would make the interval wider again, and the study would end wide."""

    class Near(Fixed):
        def __call__(self, plan: Any, indices: range) -> Any:
            made = super().__call__(plan, indices)
            return lambda jobs, step: [
                replace(a, penetration=0.01 * (a.sample - 99)) if 100 <= a.sample < 110 else a
                for a in made(jobs, step)
            ]

    def fill_cross_checks(_plan: Any, asks: Any, *_: Any, **__: Any) -> list[CrossCheck]:
        return [
            CrossCheck(
                a.sample, a.question, a.kind, a.why,
                "1-1-2" if 100 <= a.sample < 110 else "1-1-1", "", "", 9, False,
            )
            for a in asks
        ]  # fmt: skip

    monkeypatch.setattr(layers, "fill_cross_checks", fill_cross_checks)
    p = plan(200)
    nominal = replace(p.questions[0].start, graze=np.ones((1, 2)))
    spec = replace(p.questions[0].spec, expect=None)
    one = replace(p.questions[0], spec=spec, start=nominal, settings=SETTINGS)
    pool: Any = object()
    work = StudyWork(1, pool, Stores(), LocalRunner(1), "auto")
    checked: Any = (None,)
    study = Study(checked, replace(p, questions=(one,)), (0,), {}, (), until=until)
    monkeypatch.setattr(layers, "samples_task", _first(Near(10**9)))
    study = work.grown(study)
    (both,) = study.combined
    assert both is not None
    assert study.narrow is True
    assert both.width < until
    assert "boundary" in [s.name for s in both.strata]


@pytest.mark.parametrize("fidelity", ["auto", "ngspice"])
def test_boards_that_differ_are_explained_by_their_own_orbit(
    fidelity: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Board 45 is beyond those that are asked from their own orbit, and differs from the nominal
    one."""

    def fill_cross_checks(_plan: Any, asks: Any, *_: Any, **__: Any) -> list[CrossCheck]:
        return [
            CrossCheck(
                a.sample, a.question, a.kind, a.why,
                "3-3-3" if a.sample == 45 and a.kind is StartKind.NOMINAL else "1-1-1",
                "", "", 9, False,
            )
            for a in asks
        ]  # fmt: skip

    monkeypatch.setattr(layers, "samples_task", Fixed(10**9))
    monkeypatch.setattr(layers, "fill_cross_checks", fill_cross_checks)
    p = plan(60)
    spec = replace(p.questions[0].spec, expect=None)
    questions = tuple(replace(p.questions[0], spec=spec, settings=SETTINGS) for _ in range(2))
    pool: Any = object()
    checked: Any = (None, None)
    study = Study(checked, replace(p, questions=questions), (0, 1), {}, ())
    work = StudyWork(1, pool, Stores(), LocalRunner(1), fidelity)
    study = work.cross_checked(work.sampled(study))
    for both in study.combined:
        assert both is not None
        (difference,) = both.differences
        assert difference.sample == 45
        assert difference.explanation == "another attractor from the nominal orbit"


def test_boards_beyond_the_limit_of_steps_are_counted_and_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A million steps a board of the second question: ten of fifty fit, and ten next to a boundary
    are asked all the same."""
    made = Fixed(10**9)

    def fill_cross_checks(_plan: Any, asks: Any, *_: Any, **__: Any) -> list[CrossCheck]:
        return [
            CrossCheck(a.sample, a.question, a.kind, a.why, "1-1-1", "", "", 9, False) for a in asks
        ]

    monkeypatch.setattr(layers, "samples_task", made)
    monkeypatch.setattr(layers, "fill_cross_checks", fill_cross_checks)
    p = plan(60)
    (answer, *_) = made(p, range(1))(1, lambda: None)
    way = cross_check.least_way(1, answer.radius)
    coarse = replace(p.questions[0], settings=SETTINGS)
    step = 1.0 / (coarse.excitation.frequency * (1e6 - 1.0) / way)
    fine = replace(coarse, settings=replace(SETTINGS, max_step=step))
    notes: list[str] = []
    monkeypatch.setattr(progress, "note", notes.append)
    checked: Any = (None, None, None)
    study = Study(checked, replace(p, questions=(coarse, fine)), (0, 2), {1: "not shown"}, ())
    pool: Any = object()
    work = StudyWork(1, pool, Stores(), LocalRunner(1), "auto")
    study = work.cross_checked(work.sampled(study))
    nominal = [c for c in study.cross_checks if c.question == 1 and c.kind is StartKind.NOMINAL]
    random = {c.sample for c in nominal if c.why is Why.RANDOM}
    assert random == set(range(10))
    asked = {c.sample for c in nominal if c.sample < cross_check.NOMINAL_SAMPLES}
    left = cross_check.NOMINAL_SAMPLES - len(asked)
    assert study.not_asked == (0, left)
    assert [study.not_asked_of(i) for i in range(3)] == [0, 0, left]
    (note,) = notes
    assert note.startswith(f"response 3: {left} boards are not asked in ngspice")
    alone = StudyWork(1, None, Stores(), LocalRunner(1), "exact").cross_checked(study)
    assert alone.cross_checks == ()
    assert notes == [note]


def _first(made: Fixed) -> Any:
    """Of the first question alone."""
    return lambda plan, indices: (
        lambda jobs, step: [a for a in made(plan, indices)(jobs, step) if a.question == 0]
    )


def test_with_ngspice_more_boards_are_asked_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """The combined interval counts: exact samples alone cannot make it narrow."""
    monkeypatch.setattr(layers, "samples_task", Fixed(10**9))
    asked: list[int] = []

    def fill_cross_checks(_plan: Any, asks: Any, *_: Any, **__: Any) -> list[CrossCheck]:
        asked.append(sum(a.kind is StartKind.NOMINAL and a.why is Why.RANDOM for a in asks))
        return [
            CrossCheck(a.sample, a.question, a.kind, a.why, "1-1-1", "", "", 9, False) for a in asks
        ]

    monkeypatch.setattr(layers, "fill_cross_checks", fill_cross_checks)
    p = plan(200)
    questions = tuple(
        replace(q, spec=replace(q.spec, expect=None), settings=SETTINGS)
        for q in (p.questions[0], p.questions[0])
    )
    pool: Any = object()
    work = StudyWork(1, pool, Stores(), LocalRunner(1), "auto")
    checked: Any = (None, None)
    study = Study(checked, replace(p, questions=questions), (0, 1), {}, (), until=0.05)
    study = work.grown(study)
    assert study.narrow is True
    assert asked[0] == 100
    assert asked == sorted(asked)
    assert asked[-1] > 100
    assert all(both is not None and both.width < 0.05 for both in study.combined)


@pytest.mark.parametrize("spread", [None, Uniform(2e6, 4e6)])
def test_a_study_says_that_the_bandwidth_does_not_enter(
    spread: Uniform | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    p = plan(3)
    p = replace(p, spread=replace(p.spread, gain_bandwidth=spread))
    monkeypatch.setattr(tolerance_study, "plan_study", lambda *_, **__: p)
    notes: list[str] = []
    monkeypatch.setattr(progress, "note", notes.append)
    made: Any = SimpleNamespace(
        modelfile=SimpleNamespace(responses=(None,)), design=None, catalog=None
    )
    tolerance(made, samples=3, fidelity="exact", checked=())
    assert len(notes) == (spread is not None)
    assert all("gain-bandwidth does not enter the yield" in note for note in notes)


class AgreementCheck(progress.Progress):
    """Keeps what is said."""

    def __init__(self) -> None:
        self.stages: list[str] = []

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        self.stages.append(text)
        return lambda: None


@pytest.mark.parametrize(
    ("there", "said"),
    [
        (0, ["boards in ngspice, 120 runs"]),
        (20, ["boards in ngspice, 60 runs, 60 more are there"]),
        (50, []),
    ],
)
def test_only_runs_that_are_not_on_disk_are_announced(
    there: int, said: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """60 runs a response: 10 from a board's own orbit, 50 from the nominal one."""
    p = plan(200)
    p = replace(p, questions=tuple(replace(q, settings=SETTINGS) for q in p.questions))
    store = BlockStore(
        tmp_path, NGSPICE, CrossCheck, "x", omegas=[q.spec.omega for q in p.questions], size=CHUNK
    )

    def checks_run(_plan: Any, blocks: Any, *_: Any, **__: Any) -> Iterator[tuple[int, CrossCheck]]:
        for k, a in enumerate(ask for block in blocks for ask in block):
            yield k, CrossCheck(a.sample, a.question, a.kind, a.why, "1-1-1", "", "", 9, False)

    monkeypatch.setattr(ngspice_runs, "checks_run", checks_run)
    answers = Fixed(10**9)(None, range(200))(1, None)
    asks = ask_random(answers)
    layers.fill_cross_checks(p, [a for a in asks if a.sample < there], store, None, 1, lambda: None)  # type: ignore[arg-type]

    class Kept(Stores):
        def rows(self, *_: Any) -> BlockStore[Any]:
            return store

    heard, pool = AgreementCheck(), object()
    work = StudyWork(1, pool, Kept(), LocalRunner(1), "auto")  # type: ignore[arg-type]
    checked: Any = (None, None)
    study = Study(checked, p, (0, 1), {}, tuple(answers))
    with progress.report_to(heard):
        assert len(work._checks(study, asks)) == len(asks) == 120
    assert heard.stages == said


def test_a_map_that_is_there_is_not_made_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Interrupted at the third of four maps, a study goes on with the third."""
    p = plan()
    pieces = _Memory()
    made: list[tuple[str, int]] = []

    def yield_map(plan: Any, number: int, over: str, b: float, **_: Any) -> Any:
        made.append((over, number))
        if len(made) == 3:
            raise KeyboardInterrupt
        return MAP

    class Kept(Stores):
        def parts(self, work: LongWork, plan: Any) -> StoredParts:
            return pieces

    monkeypatch.setattr(tolerance_study, "yield_map", yield_map)
    work = StudyWork(1, None, Kept(), LocalRunner(1), "exact")
    checked: Any = (SimpleNamespace(model=SimpleNamespace(b=0.25)),) * 2
    study = Study(checked, p, (0, 1), {}, ())
    with pytest.raises(KeyboardInterrupt):
        work.mapped(study, ("b", "grade"))
    assert made == [("b", 0), ("b", 1), ("grade", 0)]
    assert len(work.mapped(study, ("b", "grade")).maps) == 4
    assert made[3:] == [("grade", 0), ("grade", 1)]


# ---------------------------------------------------------------------------------------------
# On disk


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("study")
    (path / "small.toml").write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def exact(home: Path) -> Path:
    """A design folder with a study on the exact circuit."""
    out = home / "exact"
    assert entry.status([*_words(home, out), "-q"]) == 0
    return out


def _words(home: Path, out: Path, *more: str) -> list[str]:
    model = str(home / "small.toml")
    return ["tolerance", model, "--out", str(out), "--samples", "12", "--rung", "exact", *more]


@pytest.mark.usefixtures("quick_reports")
def test_the_exact_circuit_needs_no_ngspice(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """No program on the path, and a library that is not there."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("NGSPICE_LIBRARY_PATH", str(tmp_path / "none.so"))
    without_starts(monkeypatch)
    assert entry.status([*_words(home, tmp_path / "out"), "--json", "-q"]) == 0
    answer = json.loads(capfd.readouterr().out)
    (response,) = answer["responses"]
    assert response["yield"]["samples"] == 12
    assert response["ngspice"] is None
    assert response["combined"] is None
    assert answer["equation_check"] is None
    fine = {"trusted": True, "reasons": []}
    assert response["trust"] == {"model": fine, "circuit": fine, "yield": fine}
    assert answer["provenance"]["versions"]["ngspice"] is None
    words = _words(home, tmp_path / "other")
    assert entry.status([*words[:-1], "auto", "-q"]) == 3
    assert not (tmp_path / "other").exists()


@pytest.mark.slow
def test_layers_are_added_and_stay(
    exact: Path, home: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Another layer needs no --overwrite; asked with fewer, the study shows what it has."""
    out = tmp_path / "exact"
    shutil.copytree(exact, out)
    block = out / "samples.parquet" / "block-000000.parquet"
    before = block.stat().st_mtime_ns
    words = _words(home, out)
    assert entry.status([*words, "--reached", "--json", "-q"]) == 0
    answer = json.loads(capfd.readouterr().out)
    assert answer["responses"][0]["reached"]["samples"] == 12
    assert answer["responses"][0]["tuned"] is None
    assert block.stat().st_mtime_ns == before
    whole = without_cost(out)
    assert "reached.parquet/block-000000.parquet" in whole
    assert entry.status([*words, "--json", "-q"]) == 0
    assert json.loads(capfd.readouterr().out) == answer
    assert without_cost(out) == whole
    # At once or one after the other: the same files.
    once = tmp_path / "once" / "exact"
    assert entry.status([*_words(home, once), "--reached", "-q"]) == 0
    assert without_cost(once) == whole


def _refused(*_: Any, **__: Any) -> Any:
    raise AssertionError("this was known")


@pytest.mark.slow
@pytest.mark.usefixtures("quick_reports")
def test_another_layer_asks_for_no_attribution_again_and_other_boards_do(
    exact: Path, home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "exact"
    shutil.copytree(exact, out)
    known = json.loads((out / "tolerance.json").read_text())["responses"][0]["blame"]
    asked: list[int] = []

    def counted(*args: Any, **options: Any) -> Any:
        asked.append(len(args[1]))
        return attribute(*args, **options)

    monkeypatch.setattr(tolerance_study, "attribute", counted)
    monkeypatch.setattr(StudyWork, "powered_up", lambda _, study: study)
    assert entry.status([*_words(home, out), "--reached", "-q"]) == 0
    assert asked == []
    assert json.loads((out / "tolerance.json").read_text())["responses"][0]["blame"] == known
    # Other samples, another seed: other boards are to blame.
    other = ["tolerance", str(out), "--blame-budget", "1", "--overwrite", "-q"]
    assert entry.status([*other, "--samples", "14"]) == 0
    assert entry.status([*other, "--samples", "12", "--seed", "2"]) == 0
    assert asked == [14, 12]


def test_a_model_without_a_title_has_the_same_name_in_its_folder(exact: Path) -> None:
    """The first file's, small.toml: the names of the KiCad project are made of it."""
    assert "title" not in SMALL
    assert model_source.source(exact, None)[0].title == "small"
    assert (exact / "kicad" / "small.kicad_sch").is_file()


@pytest.mark.slow
def test_yields_stand_before_the_attribution_and_it_goes_on_after_an_interruption(
    exact: Path, home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    out = tmp_path / "exact"
    shutil.copytree(exact, out)
    for path in out.iterdir():  # as if it had been killed before the first block
        if path.name in ("kept.npz", "tolerance.json", "report.md", "report.html"):
            path.unlink()
    manifest = json.loads((out / "manifest.json").read_text())
    manifest["stages"]["study"]["complete"] = manifest["complete"] = False
    (out / "manifest.json").write_text(json.dumps(manifest))

    def interrupted(*_: Any, **options: Any) -> Any:
        options["parts"].put({"nominal 0": ((), 0)})
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(tolerance_study, "attribute", interrupted)
        assert entry.status(["tolerance", str(out), "--resume"]) == 130
    assert "100.0   76–100" in capfd.readouterr().err
    early = json.loads((out / "tolerance.json").read_text())
    assert early["responses"][0]["yield"]["samples"] == 12
    assert early["responses"][0]["blame"] is None
    assert early["blame"]["status"] == "not done yet"
    assert "Blame not done yet" in (out / "report.md").read_text()
    assert "Blame not done yet" in (out / "report.html").read_text()
    assert (out / PIECES).exists()
    assert entry.status(["tolerance", str(out)]) == 2
    assert "--resume" in capfd.readouterr().err
    (out / PIECES).unlink()  # what was put there is none of this attribution
    assert entry.status([*_words(home, out), "--resume", "--json"]) == 0
    (line,) = [json.loads(capfd.readouterr().out)]
    assert line["blame"] == {"status": "whole", "share": 1.0, "budget": None, "reason": ""}
    assert without_cost(out) == without_cost(exact)


@pytest.mark.slow
def test_a_study_without_attribution_gets_it_later_and_loses_it_never(
    exact: Path, home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    out = tmp_path / "exact"
    shutil.copytree(exact, out)
    with monkeypatch.context() as patched:
        patched.setattr(tolerance_study, "attribute", _refused)
        assert entry.status(["tolerance", str(out), "--no-blame", "--json"]) == 0
        assert json.loads(capfd.readouterr().out)["blame"]["status"] == "whole"
        assert without_cost(out) == without_cost(exact)
        # Begun anew, of one board more.
        words = ["tolerance", str(out), "--samples", "13", "--overwrite", "--no-blame", "-q"]
        assert entry.status(words) == 0
        without = json.loads((out / "tolerance.json").read_text())
        assert without["blame"]["status"] == "left out"
        assert "Blame left out" in (out / "report.md").read_text()
        # The folder's own samples, and its own choice of no attribution.
        assert entry.status(["tolerance", str(out), "--json"]) == 0
        assert json.loads(capfd.readouterr().out)["samples"] == 13
    assert (
        entry.status(["tolerance", str(out), "--samples", "12", "--overwrite", "--no-blame"]) == 0
    )
    assert entry.status(["tolerance", str(out), "--blame", "-q"]) == 0
    assert json.loads((out / "tolerance.json").read_text())["blame"]["status"] == "whole"
    added, whole = without_cost(out), without_cost(exact)
    for name in ("manifest.json", "report.html", "report.md"):  # where the command line stands
        del added[name], whole[name]
    assert added == whole


@pytest.mark.slow
def test_another_layer_asks_ngspice_for_no_check_again_and_another_design_does(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "auto"
    words = [*_words(home, out)[:-1], "auto", "-q"]
    words[words.index("--samples") + 1] = "3"
    assert entry.status(words) == 0
    whole = without_cost(out)
    with monkeypatch.context() as patched:
        patched.setattr(numerics_gate, "check", _refused)
        patched.setattr(equation_check, "check", _refused)
        patched.setattr(tolerance_study, "attribute", _refused)
        assert entry.status([*words, "--reached"]) == 0
    added = without_cost(out)
    once = tmp_path / "once" / "auto"
    assert entry.status([w if w != str(out) else str(once) for w in words] + ["--reached"]) == 0
    assert without_cost(once) == added
    assert added["kept.npz"] == whole["kept.npz"]
    model = tmp_path / "other.toml"
    model.write_text(SMALL.replace("zeta = 0.1", "zeta = 0.11"))
    other = [w if w != str(home / "small.toml") else str(model) for w in words]
    asked: list[int] = []
    check = numerics_gate.check

    def counted(pool: Any, subjects: Any) -> Any:
        asked.append(len(subjects))
        return check(pool, subjects)

    monkeypatch.setattr(numerics_gate, "check", counted)
    assert entry.status([*other, "--overwrite"]) in (0, 1)
    assert asked == [1]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--samples", "0"], "--samples"),
        (["--until", "0"], "--until"),
        (["--until", "nan"], "--until"),
        (["--rung", "ideal"], "--rung"),
        (["--map", "zeta"], "--map"),
        (["--cluster", "localhost:8786"], "--cluster"),
        (["--blame-budget", "0"], "--blame-budget"),
        (["--blame-budget", "9", "--no-blame"], "--blame-budget"),
        (["--seed", "2"], "made with --seed 1, asked for 2"),
        (["--samples", "13"], "made with --samples 12, asked for 13"),
        (["--until", "0.5"], "made without --until, asked for 0.5"),
    ],
)
def test_bad_input_writes_nothing(
    exact: Path, home: Path, words: list[str], said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    before = without_cost(exact)
    assert entry.status([*_words(home, exact), *words, "-q"]) == 2
    assert said in capfd.readouterr().err
    assert without_cost(exact) == before


@pytest.mark.parametrize("change", ["gone", "design", "model", "manifest"])
def test_a_folder_that_changes_under_a_study_is_noticed(
    exact: Path, tmp_path: Path, change: str
) -> None:
    out = tmp_path / "out"
    shutil.copytree(exact, out)
    look = Folder(out).watch()
    look()
    if change == "gone":
        out.rename(tmp_path / "elsewhere")
    elif change == "manifest":
        said = json.loads((out / "manifest.json").read_text())
        study = said["stages"]["study"]
        study["inputs"]["seed"] = 7
        study["inputs_sha256"] = ManifestStage(study["inputs"]).hash
        (out / "manifest.json").write_text(json.dumps(said))
    else:
        path = out / {"design": "design.json", "model": "model.toml"}[change]
        path.write_text(path.read_text().replace("0.95", "0.96"))
    expected = {"gone": "No such file", "design": r"design\.json", "model": r"model\.toml"}
    with pytest.raises(InputError, match=expected.get(change, r"manifest\.json")):
        look()


@pytest.mark.slow
def test_a_deleted_folder_is_said_at_the_next_block(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    block = exact_circuit.block

    def deleted(plan: Any, indices: range, jobs: int, progress: Any) -> Any:
        rows = block(plan, indices, jobs, progress)
        shutil.rmtree(out)
        return rows

    monkeypatch.setattr(exact_circuit, "block", deleted)
    without_starts(monkeypatch)
    assert entry.status([*_words(home, out), "-q"]) == 2
    assert "the folder" in capfd.readouterr().err
    assert not out.exists()


# ---------------------------------------------------------------------------------------------
# Killed


@pytest.mark.slow
def test_killed_at_any_moment_a_study_ends_the_same(home: Path, tmp_path: Path) -> None:
    """All layers, killed at three random moments, resumed; beside one that nobody disturbed."""
    more = ["--rung", "auto", "--tuned", "--reached", "--map", "grade", "--jobs", "1"]
    whole, out = tmp_path / "whole" / "out", tmp_path / "killed" / "out"
    began = time.monotonic()
    assert _process(home, whole, *more).wait() == 0
    took = time.monotonic() - began
    chance = random.Random(11)
    kills = 0
    for _ in range(3):
        process = _process(home, out, *more, "--resume")
        try:
            process.wait(chance.uniform(0.1, 0.5) * took)
        except subprocess.TimeoutExpired:
            kills += 1
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    assert kills >= 2
    assert _process(home, out, *more, "--resume").wait() == 0
    assert not differing(out, whole)
    assert not list(out.rglob("*.part"))


def _process(home: Path, out: Path, *more: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "designer", *_words(home, out), *more, "-q"],
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
