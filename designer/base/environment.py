"""What a process that is started here may see of the world: environment variables, modules.

This module is imported by every worker process: it imports the standard library only.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator, Mapping
from multiprocessing import resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess

SAFE_PATH: dict[str, str | None] = {"PYTHONSAFEPATH": "1"}
"""Environment of a Python that takes no module from its working directory."""


def clean_environment(home: str) -> dict[str, str | None]:
    """Changes that keep settings lying about from ngspice (None: remove)."""
    changes: dict[str, str | None] = {
        name: None for name in os.environ if name.startswith(("SPICE", "NGSPICE"))
    }
    return {**changes, "HOME": home, "LC_ALL": "C"}


@contextlib.contextmanager
def changed_environment(changes: Mapping[str, str | None]) -> Iterator[None]:
    """Change environment variables (None: remove) and put them back afterwards."""
    before = {name: os.environ.get(name) for name in changes}
    set_environment(changes)
    try:
        yield
    finally:
        set_environment(before)


def set_environment(values: Mapping[str, str | None]) -> None:
    """Set environment variables (None: remove)."""
    for name, value in values.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


def python_command(*words: str) -> list[str]:
    """The command of this Python with these words, such as "-m", "designer".

    It takes no module from its working directory.
    """
    return [sys.executable, "-P", *words]


class _SafeProcess(SpawnProcess):
    """A fresh process that takes no module from the working directory.

    It is started with ``-c``, which puts that folder first on the path until multiprocessing has
    begun and puts the parent's path in its place.
    """

    def start(self) -> None:
        with changed_environment(SAFE_PATH):
            super().start()


class _SafeContext(SpawnContext):
    Process = _SafeProcess


def spawn_context() -> SpawnContext:
    """The way in which every worker process is started.

    A script's own folder stays on the path of its workers, since they take over the parent's.
    """
    with changed_environment(SAFE_PATH):
        resource_tracker.ensure_running()  # a process too, started by the first that needs it
    return _SafeContext()
