"""Work for a second process: its answers, and what is left of them when it goes wrong."""

from __future__ import annotations

import math
import os
from pathlib import Path

import pytest

from designer.base import second_process
from designer.base.second_process import other_process

HERE = os.getpid()
REAL = second_process.OtherProcess


@pytest.fixture(autouse=True)
def a_second_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """As outside of these tests."""
    monkeypatch.setattr(second_process, "OtherProcess", REAL)


def test_functions_are_called_there_one_after_the_other() -> None:
    with other_process(2, "math") as other:
        waiting = [other(math.factorial, n) for n in (3, 4)], other(os.getpid)
        assert [result() for result in waiting[0]] == [6, 24]
        assert waiting[1]() != HERE


def test_with_one_job_a_function_is_called_here_when_its_result_is_asked_for() -> None:
    with other_process(1, "no.such.module") as other:
        failing = other(math.factorial, -1)
        assert other(os.getpid)() == HERE
        with pytest.raises(ValueError, match="factorial"):
            failing()


def test_an_error_is_raised_here_and_the_process_goes_on() -> None:
    with other_process(2) as other:
        failing, after = other(math.factorial, -1), other(os.getpid)
        with pytest.raises(ValueError, match="factorial"):
            failing()
        assert after() != HERE


@pytest.mark.parametrize("module", ["no.such.module", "math"])
def test_what_the_process_does_not_answer_is_done_here(module: str) -> None:
    """It cannot import, or is killed while it works; the next call finds nobody either."""
    with other_process(2, module) as other:
        kill = f"__import__('os').getpid() != {HERE} and __import__('os').kill(0, 9)"
        if module == "math":
            assert other(eval, kill)() is False
        assert other(os.getpid)() == HERE


def test_what_a_function_prints_is_no_answer(capfd: pytest.CaptureFixture[str]) -> None:
    with other_process(2) as other:
        assert other(print, "words")() is None
        assert other(math.factorial, 3)() == 6
    assert capfd.readouterr().out == ""


def test_no_module_of_the_working_directory_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "pickle.py").write_text("raise SystemExit('taken')", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with other_process(2) as other:
        assert other(os.getpid)() != HERE


def test_a_block_within_the_block_of_another_asks_that() -> None:
    with other_process(2) as other:
        there = other(os.getpid)()
        with other_process(2, "no.such.module") as again:
            assert again(os.getpid)() == there
        assert other(os.getpid)() == there
    with other_process(2) as other:
        assert other(os.getpid)() not in (HERE, there)
