"""Work for a second process: its answers, and what is left of them when it goes wrong."""

from __future__ import annotations

import math
import os
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from designer.base import second_process
from designer.base.second_process import Ask, other_process
from designer.cli import entry
from designer.folders import model_source
from tests.shared.house import ROOT
from tests.shared.model_text import SMALL

HERE = os.getpid()
REAL = second_process.OtherProcess
FIRST = """
import time
from designer.base.second_process import other_process
with other_process(2, {module!r}) as other:
    other(eval, {work!r})
    time.sleep(600)
"""
"""A first process that is killed meanwhile."""
BUSY = """
import socket, time
line = socket.create_connection(("127.0.0.1", {port}))
line.sendall(b"!")
end = time.monotonic() + 60.0
while time.monotonic() < end:
    pass
"""
"""What the second one is at: whoever listens sees the line close when the process ends."""
SOON = 20.0
"""Seconds, fewer than it is busy for."""


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


def test_a_result_is_kept_and_the_function_called_once() -> None:
    calls: list[int] = []
    with other_process(1) as other:
        answer = other(calls.append, 1)
        told = [answer.wait(), answer(), answer()]
    assert told == [False, None, None]
    assert calls == [1]


def test_whoever_waits_goes_on_when_the_process_is_closed() -> None:
    with ThreadPoolExecutor(2) as pool:
        with other_process(2) as other:
            at_work, behind_it = other(time.sleep, 600.0), other(os.getpid)
            waits = [pool.submit(answer.wait) for answer in (at_work, behind_it)]
        assert [waited.result(SOON) for waited in waits] == [False, False]
        assert other(os.getpid)() == HERE


@pytest.mark.parametrize("at", ["an import", "a function"])
def test_it_ends_with_a_first_process_that_is_killed(at: str, tmp_path: Path) -> None:
    """Whatever it is at."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(SOON)
        busy = BUSY.format(port=server.getsockname()[1])
        (tmp_path / "busy_module.py").write_text(busy, encoding="utf-8")
        module = "busy_module" if at == "an import" else "math"
        work = "1" if at == "an import" else "__import__('busy_module')"
        first = subprocess.Popen(
            [sys.executable, "-c", FIRST.format(module=module, work=work)],
            env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path)])},
        )
        try:
            line, _ = server.accept()
            line.settimeout(SOON)
            assert line.recv(1) == b"!"
        finally:
            first.kill()
            first.wait()
        with line:
            assert line.recv(1) == b""


@pytest.mark.parametrize("what", ["refused", "interrupted"])
def test_a_verb_that_makes_nothing_leaves_nothing_running(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """It is started before the model file is looked at."""
    started: list[second_process.OtherProcess] = []

    def start(modules: tuple[str, ...]) -> Ask:
        started.append(REAL(modules))
        return started[-1]

    monkeypatch.setattr(second_process, "OtherProcess", start)
    model = tmp_path / "model.toml"
    model.write_text(SMALL.replace("1-2-2", "1-2-x"), encoding="utf-8")
    if what == "interrupted":
        monkeypatch.setattr(
            model_source, "model_file", lambda *_: signal.raise_signal(signal.SIGINT)
        )
    words = ["synthesise", str(model), "--out", str(tmp_path / "out"), "--jobs", "2"]
    assert entry.status(words) == {"refused": 2, "interrupted": 130}[what]
    said = capfd.readouterr().err
    assert {"refused": "1-2-x", "interrupted": "interrupted"}[what] in said
    assert "Traceback" not in said
    (process,) = (each._process for each in started)
    assert process.poll() is not None


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
