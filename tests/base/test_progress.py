"""What a run says while it works."""

from __future__ import annotations

import io
import re
import sys
import threading

import pytest

from designer.base import progress
from designer.base.errors import InputError
from designer.base.progress import (
    EVERY,
    MINUTE,
    SILENCE,
    Progress,
    ProgressLines,
    Terminal,
    WholeWork,
    best_so_far,
    doing,
    how_far,
    note,
    part,
    progress_for,
    rate,
    report_to,
    reported,
    seeking,
    within_stage,
)
from designer.base.threads import parallel


@pytest.mark.parametrize(
    ("done", "total", "seconds", "said"),
    [
        (50, 200, 10.0, "50/200, 5/s, 0:00:30 left"),
        (10, 100, 100.0, "10/100, 6/min, 0:15:00 left"),
        (100_000, 1_000_000, 10_000.0, "100000/1000000, 10/s, 25:00:00 left"),
        # The longest runs of ngspice come first: no word on the rest before a tenth is done.
        (2, 834, 25.8, "2/834, 4.65/min"),
        (83, 834, 100.0, "83/834, 49.8/min"),
        (300, None, 10.0, "300 steps, 30/s"),
    ],
)
def test_rate_and_time_left(done: int, total: int | None, seconds: float, said: str) -> None:
    assert how_far(done, total, seconds) == said


def test_rates() -> None:
    assert [rate(v) for v in (1234.5, 1.0, 0.5)] == ["1.23e+03/s", "1/s", "30/min"]


def test_lines_say_how_far_from_time_to_time(capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    lines = ProgressLines(lambda: now[0])
    step = lines.stage("boards", 100)
    for _ in range(100):
        now[0] += EVERY / 10.0
        step()
    out, err = capsys.readouterr()
    assert out == ""
    first, *rest = err.splitlines()
    assert first == "boards …"
    assert len(rest) == 9  # the tenth would come with the end
    assert rest[0] == "  10/100, 30/min, 0:03:00 left"
    lines.stage("one step")()
    assert capsys.readouterr().err == "one step …\n"


def test_work_that_waits_for_somebody_is_silent(capsys: pytest.CaptureFixture[str]) -> None:
    """A page that is served does nothing until it is asked."""
    now = [0.0]
    with ProgressLines(lambda: now[0]) as lines:
        now[0] += EVERY
        lines.beat()
        assert "starting" in capsys.readouterr().err
        lines.idle()
        now[0] += EVERY
        lines.beat()
        assert capsys.readouterr().err == ""
        lines.stage("boards")
        now[0] += EVERY
        lines.beat()
        assert "so far" in capsys.readouterr().err


def test_a_stage_of_unknown_length_is_not_silent(capsys: pytest.CaptureFixture[str]) -> None:
    """Blame and yield maps seek as many attractors as it takes."""
    now = [0.0]
    step = ProgressLines(lambda: now[0]).stage("blame")
    for _ in range(60):
        now[0] += 1.0
        step()
    first, *rest = capsys.readouterr().err.splitlines()
    assert first == "blame …"
    assert rest == ["  20 steps, 1/s", "  40 steps, 1/s", "  60 steps, 1/s"]


def test_a_terminal_shows_a_bar_with_the_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    class Tty(io.StringIO):
        def isatty(self) -> bool:
            return True

    shown = Tty()
    monkeypatch.setattr(sys, "stderr", shown)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with progress_for(quiet=False) as progress:
        assert isinstance(progress, Terminal)
        step = progress.stage("boards", 3)
        for _ in range(3):
            step()
        unknown = progress.stage("blame")
        for _ in range(5):
            unknown()
        with progress.whole({"design": 60.0}):
            progress.stage("design")
            progress.beat()
    assert "5/5" in shown.getvalue()
    assert "3/3" in shown.getvalue()
    assert " left" in shown.getvalue()
    assert re.search(r"✓.* whole .*100/100", shown.getvalue())


def test_what_is_printed_aside_stands_between_the_bars(capfd: pytest.CaptureFixture[str]) -> None:
    """Bars that are done stand above it and are not drawn again; the next ones begin below."""
    with Terminal() as progress:
        progress.stage("boards", 2)()
        with progress.aside():
            print("a table", file=sys.stderr)
        step = progress.stage("blame", 3)
        for _ in range(3):
            step()
    said = capfd.readouterr().err
    assert said.index("boards") < said.index("a table") < said.index("blame")
    assert "boards" not in said[said.index("a table") :]
    with Progress().aside():
        pass


def test_a_whole_says_how_far_it_is_beside_each_stage(capsys: pytest.CaptureFixture[str]) -> None:
    """A work that is twice as slow as usual in its first phase is taken to be so in the others."""
    now = [0.0]

    def later(seconds: float) -> str:
        now[0] += seconds
        lines.beat()
        said = capsys.readouterr().err.splitlines()
        return said[-1] if said else ""

    usual = {"design": 100.0, "boards": 200.0, "ngspice": 100.0}
    with ProgressLines(lambda: now[0]) as lines:
        assert "whole" not in later(SILENCE)
        with lines.whole(usual):
            assert later(SILENCE) == "  0:00:20 so far: starting"  # no phase has begun
            lines.stage("design of the paper's system")
            assert later(20.0) == "  0:00:20 so far; whole: 7 %, about 0:06:20 left"
            with lines.whole({"within": 1.0}):  # is a part of it
                lines.stage("a stage within")
            assert later(190.0) == "  0:03:10 so far; whole: 25 %, about 0:11:07 left"
            step = lines.stage("boards, 200 of them", 200)
            for _ in range(50):
                step()
            assert later(100.0).endswith("whole: 38 %, about 0:08:34 left")
            lines.stage("report")  # of no phase: it belongs to the one that is under way
            lines.stage("ngspice")
            assert later(700.0).endswith("whole: 85 %, about 0:02:55 left")
            lines.stage("design of another")
            assert later(SILENCE).endswith("whole: 85 %, about 0:02:58 left")
        lines.stage("one more")
        assert later(SILENCE) == "  0:00:10 so far"


def test_phases_whose_names_begin_alike_are_entered_in_their_order() -> None:
    """A search asks ngspice twice: about each candidate, and at the end."""
    now = [0.0]
    whole = WholeWork({"ngspice": 10.0, "study": 10.0, "ngspice, last": 40.0}, lambda: now[0])
    for stage, at, left in (
        ("ngspice, first", 0.0, 60.0),
        ("study", 10.0, 50.0),
        ("ngspice, again", 10.0, 50.0),
        ("ngspice, last one", 20.0, 40.0),
        ("report", 40.0, 20.0),
    ):
        now[0] = at
        whole.enter(stage)
        assert whole.far(0.0) == pytest.approx((at / (at + left), left))


def test_the_share_of_a_whole_never_falls() -> None:
    """Neither where the first phase lasts 25 times as long as usual and the others do not, nor
    where a stage turns out to have many more steps; and what was said in the first phase holds."""
    now = [0.0]
    whole = WholeWork({"parts": 12.0, "files": 60.0, "study": 40.0}, lambda: now[0])
    said: list[float] = []

    def watched(seconds: int, steps_left: float = 0.0) -> None:
        for _ in range(seconds):
            now[0] += 1.0
            far = whole.far(steps_left)
            assert far is not None
            said.append(far[0])
            assert far[1] > 0.0

    whole.enter("parts")
    watched(300)
    before = said[-1]
    whole.enter("files")
    watched(1)
    assert said[-1] == pytest.approx(before, abs=0.05)
    watched(59)
    watched(20, steps_left=2000.0)
    whole.enter("study")
    watched(40)
    assert said == sorted(said)
    assert 0.0 < said[0] < said[-1] < 1.0


def test_the_best_so_far_is_told_after_a_minute_and_each_minute(
    capsys: pytest.CaptureFixture[str],
) -> None:
    now = [0.0]

    def later(seconds: float) -> list[str]:
        now[0] += seconds
        lines.beat()
        said = capsys.readouterr().err.splitlines()
        return [line for line in said if "best" in line]

    with ProgressLines(lambda: now[0]) as lines:
        with seeking("parts"):
            assert later(0.9 * MINUTE) == []
            assert later(0.1 * MINUTE) == ["  parts, best so far after 0:01:00: none yet"]
            best_so_far("integrators", step=True)
            assert later(0.5 * MINUTE) == []
            assert later(0.5 * MINUTE) == ["  parts, best so far after 0:02:00: integrators"]
            best_so_far("a circuit")
            best_so_far("other integrators", step=True)
            assert later(MINUTE) == ["  parts, best so far after 0:03:00: a circuit"]
        assert later(2.0 * MINUTE) == []


def test_what_the_outer_search_knows_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """A search for designs chooses parts again and again."""
    now = [0.0]

    def told() -> str:
        capsys.readouterr()
        now[0] += MINUTE
        lines.beat()
        return next(line for line in capsys.readouterr().err.splitlines() if "best" in line)

    with ProgressLines(lambda: now[0]) as lines, seeking("design"):
        with part("design 1"), seeking("parts"):
            best_so_far("an error")
            assert told().endswith("design, best so far after 0:01:00: an error")
        assert told().endswith("none yet")
        best_so_far("a yield")
        with part("design 2"), seeking("parts"):
            best_so_far("another error")
            assert told().endswith(": a yield")


def test_a_note_reaches_who_is_watched(capsys: pytest.CaptureFixture[str]) -> None:
    note("nobody hears it")
    best_so_far("nor this")
    with seeking("anything"), ProgressLines():
        note("parts stand")
    assert capsys.readouterr().err == "parts stand\n"


def test_a_note_from_a_thread_of_parallel_is_heard(capsys: pytest.CaptureFixture[str]) -> None:
    """Once, and from a thread of its threads too."""
    met = threading.Barrier(2, timeout=60.0)

    def work(number: int) -> None:
        met.wait()  # two threads at once
        list(parallel(lambda own: note(f"{number}, {own}"), range(2), 2))

    with ProgressLines():
        list(parallel(work, range(2), 2))
    assert sorted(capsys.readouterr().err.splitlines()) == ["0, 0", "0, 1", "1, 0", "1, 1"]


def test_parts_of_a_work_are_not_told_to_who_is_told_of_another(
    capsys: pytest.CaptureFixture[str],
) -> None:
    now = [0.0]
    outer, inner = ProgressLines(lambda: now[0]), ProgressLines(lambda: now[0])

    def told(lines: ProgressLines) -> str:
        now[0] += SILENCE
        lines.beat()
        return capsys.readouterr().err.splitlines()[-1].partition(" so far: ")[2]

    with report_to(outer), part("outer"):
        outer.stage("design")
        with report_to(inner):
            inner.stage("study")
            with part("inner"):
                doing("x")
                assert told(inner) == "inner, x"
        with report_to(outer):
            doing("y")
        assert told(outer) == "outer, y"


def test_a_work_within_a_stage_has_no_stages_but_is_not_silent(
    capsys: pytest.CaptureFixture[str],
) -> None:
    now = [0.0]
    lines = ProgressLines(lambda: now[0])
    with report_to(lines), part("read back"):
        progress.stage("report")
        with within_stage():
            step = progress.stage("boards", 3)
            step()
            now[0] += SILENCE
            lines.beat()
            note("a damaged block")
            with report_to(ProgressLines()):
                progress.stage("another's")
        progress.stage("pictures")
    said = ["report …", "  0:00:10 so far: read back, boards", "a damaged block", "another's …"]
    assert capsys.readouterr().err.splitlines() == [*said, "pictures …"]


def test_who_is_to_be_told_is_a_progress() -> None:
    @reported
    def verb(*, progress: object = None) -> str:
        return "done"

    assert verb(progress=None) == verb(progress=Progress()) == "done"
    with pytest.raises(InputError, match=r"progress: found .*print.*, expected a designer\.base"):
        verb(progress=print)
