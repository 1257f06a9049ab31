"""Verbs that the page starts: each a process of its own, in a folder of its own."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Literal

from designer.base.environment import python_command
from designer.base.errors import InputError
from designer.explorer.wire import Message

JobVerb = Literal["run", "search"]
REPORT = "report.html"
MOST_AT_ONCE = 2
"""Jobs at a time: each takes all cores."""
LOG = ".log"


@dataclass
class Job:
    """A verb at work, or done."""

    verb: JobVerb
    """What is done."""
    folder: Path
    """The design folder that it makes."""
    process: subprocess.Popen[str]
    line: str = ""
    """The last line that it said."""
    status: int | None = None
    """Its exit status; None while it works."""

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.name

    @property
    def report(self) -> bool:
        """Whether its report can be read."""
        return (self.folder / REPORT).is_file()

    def message(self) -> Message:
        """What the page shows of it."""
        return {
            "kind": "job",
            "name": self.name,
            "verb": self.verb,
            "line": self.line,
            "status": self.status,
            "report": self.report,
        }


class JobProcesses:
    """The jobs of one server.

    changed : is called with a job's message whenever it changes, on a thread of its own.
    """

    def __init__(self, changed: Callable[[Message], None]) -> None:
        self._changed = changed
        self._jobs: dict[str, Job] = {}
        self._threads: list[threading.Thread] = []

    def start(self, verb: JobVerb, model: Path) -> Job:
        """Begin ``designer VERB model --out FOLDER``, in a folder beside the model file that is not
        there yet; what it says goes to a file beside that folder.

        Raises
        ------
        InputError : ``MOST_AT_ONCE`` are at work.
        """
        if sum(job.status is None for job in self._jobs.values()) >= MOST_AT_ONCE:
            expected = f"at most {MOST_AT_ONCE} jobs at a time; wait for one to end"
            raise InputError(None, verb, "another job", expected)
        folder = _free(model.with_suffix(""), verb)
        words = python_command("-m", "designer", verb, str(model), "--out", str(folder))
        process = subprocess.Popen(
            words,
            cwd=model.parent,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
        )
        job = self._jobs[folder.name] = Job(verb, folder, process)
        thread = threading.Thread(target=self._heed, args=(job,), daemon=True)
        self._threads.append(thread)
        thread.start()
        return job

    @property
    def messages(self) -> list[Message]:
        """One for each job, in their order."""
        return [job.message() for job in self._jobs.values()]

    def report(self, name: str) -> Path | None:
        """The report of a job that was started here; None where there is none."""
        job = self._jobs.get(name)
        return job.folder / REPORT if job is not None and job.report else None

    def close(self) -> None:
        """Interrupt what is at work; ``--resume`` goes on with it."""
        for job in self._jobs.values():
            if job.status is None:
                with contextlib.suppress(ProcessLookupError):
                    job.process.send_signal(signal.SIGINT)
        for thread in self._threads:
            thread.join(30.0)

    def _heed(self, job: Job) -> None:
        """Pass on what a job says until it ends."""
        stream = job.process.stderr
        assert stream is not None
        log = job.folder.with_name(job.folder.name + LOG)
        with stream:
            lines = self._told(job, stream)
            with contextlib.suppress(OSError), log.open("w", encoding="utf-8", buffering=1) as copy:
                copy.writelines(f"{line}\n" for line in lines)
            for _ in lines:  # the log cannot be written: what the job says is told all the same
                pass
        job.status = job.process.wait()
        self._changed(job.message())

    def _told(self, job: Job, stream: IO[str]) -> Iterator[str]:
        """The lines that a job says, each once it has been passed on."""
        for line in _lines(stream):
            job.line = line.removeprefix("designer: ")[:300]
            self._changed(job.message())
            yield line


def _lines(stream: IO[str]) -> Iterator[str]:
    return map(str.strip, filter(str.strip, stream))


def _free(path: Path, verb: str) -> Path:
    """A name that nothing has: "hammer-run", "hammer-run-2", …"""
    number = 1
    while True:
        folder = path.with_name(f"{path.name}-{verb}" + (f"-{number}" if number > 1 else ""))
        if not folder.exists() and not folder.with_name(folder.name + LOG).exists():
            return folder
        number += 1
