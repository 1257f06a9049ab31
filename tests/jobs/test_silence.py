"""No stage is silent for long: it says what it works on and how far it is."""

from __future__ import annotations

import ast
import io
import re
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

import designer
from designer.base import progress
from designer.base.progress import SILENCE, Progress, ProgressLines, Terminal, doing, part
from designer.cli import entry
from designer.jobs import study_job, usual_times
from designer.jobs.options import Options
from designer.model.model_file import parse_model_file
from tests.shared.model_text import COARSE_CIRCUIT, PAPER_TABLE

pytestmark = pytest.mark.usefixtures("figures_are_blank")

TEXT = f'format = 1\n{PAPER_TABLE}[[response]]\nomega = 0.54\nexpect = "1-3-3"\n{COARSE_CIRCUIT}'
PACKAGE = Path(designer.__file__).parent
Captured = pytest.CaptureFixture[str]


class Clock:
    """Seconds that pass when a test says so."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_a_stage_without_steps_says_how_long_it_has_lasted(capsys: Captured) -> None:
    clock = Clock()
    lines = ProgressLines(clock)
    lines.stage("parts")
    lines.beat()
    clock.now = SILENCE - 0.1
    lines.beat()
    assert capsys.readouterr().err == "parts …\n"
    clock.now = SILENCE
    lines.beat()
    lines.beat()
    assert capsys.readouterr().err == "  0:00:10 so far\n"
    lines.doing("linear block")
    clock.now = 2 * SILENCE
    lines.beat()
    assert capsys.readouterr().err == "  0:00:20 so far: linear block\n"
    lines.stage("report")
    clock.now += SILENCE
    lines.beat()
    assert capsys.readouterr().err == "report …\n  0:00:10 so far\n"


def test_a_stage_whose_steps_are_slow_says_how_far_it_is(capsys: Captured) -> None:
    clock = Clock()
    lines = ProgressLines(clock)
    step = lines.stage("boards", 10)
    for _ in range(4):
        clock.now += 1.0
        step()
    clock.now = SILENCE
    lines.beat()
    assert capsys.readouterr().err == "boards …\n  4/10, 24/min, 0:00:15 left\n"


def test_what_is_worked_on_reaches_who_is_watched() -> None:
    class Listener(Progress):
        said: tuple[str, ...] = ()

        def doing(self, text: str) -> None:
            super().doing(text)
            assert self._stage is not None
            self.said = (*self.said, self._stage.detail)

    doing("nobody hears it")
    with Listener() as listener:
        listener.stage("parts")
        with part("without swing"):
            doing("linear block")
            with part("every 8th resistor"):
                doing("joins")
        doing("dead zone")
        # Another thread is nobody's: a board that is built there is no part of the work.
        other = threading.Thread(target=doing, args=("elsewhere",))
        other.start()
        other.join()
    doing("nor this")
    assert listener.said == (
        "without swing",
        "without swing, linear block",
        "without swing, every 8th resistor",
        "without swing, every 8th resistor, joins",
        "dead zone",
    )


def test_what_is_watched_is_looked_at_from_time_to_time(
    capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a call from the work: it may sit in a solver."""
    heard = threading.Event()

    class Listener(ProgressLines):
        def _say(self, line: str) -> None:
            super()._say(line)
            heard.set()

    monkeypatch.setattr(progress, "BEAT", 0.01)
    monkeypatch.setattr(progress, "SILENCE", 0.0)
    with Listener() as listener:
        listener.stage("cvxpy")
        heard.clear()
        assert heard.wait(60.0)
    assert "  0:00:00 so far" in capsys.readouterr().err


def test_a_terminal_shows_what_is_worked_on(monkeypatch: pytest.MonkeyPatch) -> None:
    class Tty(io.StringIO):
        def isatty(self) -> bool:
            return True

    tty = Tty()
    monkeypatch.setattr(sys, "stderr", tty)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with Terminal() as terminal:
        terminal.stage("parts")
        doing("dead zone, tables 2")
        terminal._bars.refresh()
        assert "parts: dead zone, tables 2" in tty.getvalue()


def _silent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every call of `doing` is followed by a look, as if it had taken long."""
    monkeypatch.setattr(progress, "SILENCE", 0.0)
    said = Progress.doing

    def doing(self: Progress, text: str) -> None:
        said(self, text)
        self.beat()

    monkeypatch.setattr(Progress, "doing", doing)


@pytest.mark.slow
def test_quiet_is_quiet_and_the_log_has_it(
    tmp_path: Path, capfd: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    _silent(monkeypatch)
    model, log = tmp_path / "m.toml", tmp_path / "log"
    model.write_text(TEXT, encoding="utf-8")
    words = [
        "simulate",
        str(model),
        "--engine",
        "circuit",
        "--starts",
        "1",
        "-q",
        "--log",
        str(log),
    ]
    assert entry.status(words) == 0
    assert capfd.readouterr() == ("", "")
    line = re.compile(r"so far: with the \w+ stage, integrators with errors up to")
    assert line.search(log.read_text("utf-8"))
    assert entry.status([word for word in words if word != "-q"]) == 0
    assert line.search(capfd.readouterr().err)


class Walk(ProgressLines):
    """Every stage lasts too long without a step, and so does all that it works on."""

    def __init__(self) -> None:
        self.clock = Clock()
        super().__init__(self.clock)
        self.stages: dict[str, list[str]] = {}
        self._lines: list[str] = []

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        step = super().stage(text, total)
        self._lines = self.stages.setdefault(text, [])  # the report is written twice
        self._late()
        return step

    def doing(self, text: str) -> None:
        super().doing(text)
        self._late()

    def _late(self) -> None:
        self.clock.now += SILENCE
        self.beat()

    def _say(self, line: str) -> None:
        self._lines.append(line)


STAGES = {
    "ngspice": "",
    "responses of the model, parts": "swing|integrators|dead zone|cost|design rule power",
    "files of the design": "bill",
    "KiCad project": "",
    "start recipes, design rules of the circuit": "start recipe of response 1 of 1, direct",
    "ngspice, equation check": "6 of 6 runs",
    "exact circuit": "",
    "ngspice, numerics gate": "step size 1 of at most 5: 3 of 3 runs",
    "tolerance study, 2 boards, responses: 1": "",
    "boards in ngspice, 4 runs": "",
    "report": "",  # the yields are written before the attribution
    "blame, boards asked again": "",
}
"""The stages of a run, and what is said within each, if there is more to say than how long."""


@pytest.mark.slow
def test_no_stage_of_a_run_is_silent(tmp_path: Path) -> None:
    options, modelfile = Options(samples=2, jobs=2), parse_model_file(TEXT)
    usual = {**usual_times.of_design(modelfile), **usual_times.STUDIED}
    with Walk() as walk, walk.whole(usual):
        study_job.run_into(modelfile, tmp_path / "out", options, lambda _: "run")
    assert list(walk.stages) == list(STAGES)
    assert [next(n for n in walk.stages if n.startswith(phase)) for phase in usual] == [
        name for name in walk.stages if name.startswith(tuple(usual))
    ]
    told = [line for name in list(walk.stages)[1:] for line in walk.stages[name]]
    assert all("; whole: " in line for line in told)
    for name, wanted in STAGES.items():
        lines = walk.stages[name]
        assert any("so far" in line or "/" in line for line in lines), name
        for text in filter(None, wanted.split("|")):
            assert any(text in line for line in lines), (name, text)


@pytest.mark.slow
def test_each_usual_time_is_of_a_stage_that_there_is() -> None:
    """Names of stages are texts, here as there."""
    sources = [p for p in PACKAGE.rglob("*.py") if p.name != Path(usual_times.__file__).name]
    nodes = [node for p in sources for node in ast.walk(ast.parse(p.read_text("utf-8")))]
    texts = {n.value for n in nodes if isinstance(n, ast.Constant) and isinstance(n.value, str)}
    for phase in {**usual_times.SEARCH, **usual_times.RUN, **usual_times.REPAIRED}:
        # A title may be made of pieces, of which the first is no shorter than a word.
        assert any(t.startswith(phase) or (t in phase[: len(t)] and len(t) > 4) for t in texts)
