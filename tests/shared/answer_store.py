"""Answers that one process of the tests has computed and the others look up: by what was asked, and
by the sources that answer.
"""

from __future__ import annotations

import fcntl
import hashlib
import pickle
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("designer", "catalogs")


def _state() -> str:
    """A hash of what answers are made by: sources, catalogues, Python and NumPy."""
    digest = hashlib.sha256(repr((sys.version, np.__version__)).encode())
    for path in sorted(each for name in SOURCES for each in (ROOT / name).rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            digest.update(path.relative_to(ROOT).as_posix().encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


BEGAN = _state()
"""When this process began to import the sources."""
_answers: dict[str, Any] = {}
_folders: list[Path] = []


def open_store(place: Path) -> None:
    """Keep answers in this folder; those of other sources go."""
    mine = place / BEGAN
    for other in place.glob("*"):
        if other != mine:
            shutil.rmtree(other, ignore_errors=True)
    _folders[:] = [mine]


def stored(function: Callable[..., Any], of: int | None = None) -> Callable[..., Any]:
    """The same function, which looks among the stored answers first; errors are raised anew.

    of : how many of its first arguments decide its answer; None for all, by name or by place.
    """

    @wraps(function)
    def answer(*arguments: Any, **named: Any) -> Any:
        deciding = (arguments, named) if of is None else arguments[:of]
        asked = function.__module__, function.__qualname__, _plain(deciding)
        key = hashlib.sha256(repr(asked).encode()).hexdigest()
        if key not in _answers:
            with _alone(_folders[0] / key) as path:
                if path.exists():
                    _answers[key] = pickle.loads(path.read_bytes())
                else:
                    _answers[key] = function(*arguments, **named)
                    _put(path, _answers[key])
        return _answers[key]

    return answer


@contextmanager
def _alone(path: Path) -> Iterator[Path]:
    """Inside, no other process computes this answer too: it waits for it."""
    path.parent.mkdir(parents=True, exist_ok=True)  # a run of other sources may have removed it
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield path


def _put(path: Path, found: Any) -> None:
    """Store an answer, unless somebody has edited the sources since: it may be of either."""
    if _state() == BEGAN:
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
