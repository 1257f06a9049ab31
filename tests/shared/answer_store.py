"""Answers that one process of a test run has computed and the others look up, by what was asked.

Of one run alone: all its processes have the same sources, libraries and environment.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import pickle
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import wraps
from pathlib import Path
from types import ModuleType
from typing import IO, Any

import numpy as np
import pytest

from tests.shared.house import ORDER

PATIENCE = 1000.0
"""Seconds that a process waits for another's answer: less than a test may take."""
_answers: dict[str, bytes] = {}
_folders: list[Path] = []
_running: list[pytest.Item] = []


def open_store(folder: Path) -> None:
    """Keep answers in this folder, which is of this run."""
    folder.mkdir(exist_ok=True)
    _folders[:] = [folder]


@contextmanager
def during(item: pytest.Item) -> Iterator[None]:
    """Inside, this test runs."""
    _running[:] = [item]
    try:
        yield
    finally:
        _running.clear()


def stored(function: Callable[..., Any], of: int | None = None) -> Callable[..., Any]:
    """The same function, which looks among the stored answers first; errors are raised anew. Each
    caller gets an object of its own.

    What a test computes while it has patched what the function may use is not stored.

    of : how many of its first arguments decide its answer; None for all, by name or by place.
    """

    @wraps(function)
    def answer(*arguments: Any, **named: Any) -> Any:
        deciding = (arguments, named) if of is None else arguments[:of]
        catalogs = os.environ.get("DESIGNER_CATALOGS")
        asked = function.__module__, function.__qualname__, catalogs, _plain(deciding)
        key = hashlib.sha256(repr(asked).encode()).hexdigest()
        if key not in _answers:
            with _alone(_folders[0] / key) as path:
                if not path.exists():
                    found = function(*arguments, **named)
                    if not _patched(function):
                        _put(path, found)
                    return found
                _answers[key] = path.read_bytes()
        return pickle.loads(_answers[key])

    return answer


def _patched(function: Callable[..., Any]) -> bool:
    """Whether the running test's ``monkeypatch`` has put anything where the function may meet it:
    not in a package after its own, which it cannot import."""
    patch = getattr(_running[0], "funcargs", {}).get("monkeypatch") if _running else None
    if patch is None:
        return False
    last = _place(function.__module__, len(ORDER))
    return bool(patch._setitem) or any(
        _place(_home(target), -1) <= last for target, *_ in patch._setattr
    )


def _home(target: object) -> str:
    """The name of a module, or where a class or an object's class stands."""
    if isinstance(target, ModuleType):
        return target.__name__
    return (target if isinstance(target, type) else type(target)).__module__


def _place(module: str, outside: int) -> int:
    """That of a module's package in the order. outside : what stands for all others."""
    home, _, rest = module.partition(".")
    package = rest.partition(".")[0]
    return ORDER.index(package) if home == "designer" and package in ORDER else outside


@contextmanager
def _alone(path: Path) -> Iterator[Path]:
    """Inside, no other process computes this answer too: it waits for it.

    Raises
    ------
    TimeoutError : another has computed it for longer than ``PATIENCE``.
    """
    with path.with_suffix(".lock").open("w") as lock:
        _wait(lock)
        yield path


def _wait(lock: IO[str]) -> None:
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > end:
                raise TimeoutError(
                    f"{lock.name}: another process computes this answer since {PATIENCE:g} s"
                ) from None
            time.sleep(0.05)


def _put(path: Path, found: Any) -> None:
    partial = path.with_suffix(".part")
    partial.write_bytes(pickle.dumps(found))
    partial.replace(path)


def _plain(value: Any) -> Any:
    """Of equal values equal words, in every process: a pickle also tells which strings are one
    object, and in which order a set has its members."""
    if is_dataclass(value) and not isinstance(value, type):
        kind = type(value)
        return (
            kind.__module__,
            kind.__qualname__,
            [_plain(getattr(value, f.name)) for f in fields(value)],
        )
    if isinstance(value, Mapping):
        return "mapping", [(_plain(key), _plain(each)) for key, each in value.items()]
    if isinstance(value, set | frozenset):
        return "set", sorted(repr(_plain(each)) for each in value)
    if isinstance(value, tuple | list):
        return [_plain(each) for each in value]
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        return value.dtype.str, value.shape, value.tobytes()
    if value is None or isinstance(value, str | bytes | bool | int | float | Path | Enum):
        return repr(value)
    return pickle.dumps(value)
