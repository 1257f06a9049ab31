"""What a run says while it works."""

from __future__ import annotations

import io
import sys

import pytest

from designer.progress import EVERY, Lines, Terminal, how_far, progress_for, rate


@pytest.mark.parametrize(
    ("done", "total", "seconds", "said"),
    [
        (50, 200, 10.0, "50/200, 5/s, 0:00:30 left"),
        (1, 100, 10.0, "1/100, 6/min, 0:16:30 left"),
        (10, 1_000_000, 1.0, "10/1000000, 10/s, 27:46:39 left"),
    ],
)
def test_rate_and_time_left(done: int, total: int, seconds: float, said: str) -> None:
    assert how_far(done, total, seconds) == said


def test_rates() -> None:
    assert [rate(v) for v in (1234.5, 1.0, 0.5)] == ["1.23e+03/s", "1/s", "30/min"]


def test_lines_say_how_far_from_time_to_time(capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    lines = Lines(lambda: now[0])
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
    lines.stage("without steps")()
    assert capsys.readouterr().err == "without steps …\n"


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
    assert "3/3" in shown.getvalue()
    assert "left:" in shown.getvalue()
