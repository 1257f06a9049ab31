"""Parts, responses and tracks of the same design, computed once in a process: for tests that ask
what becomes of a design, and nothing of how it is found."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any

import pytest

from designer.check import synthesis_result
from designer.jobs import board_routing
from designer.synthesis import parts_choice

_ANSWERS: dict[tuple[str, bytes], Any] = {}


def _once(function: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(function)
    def answer(*arguments: Any, **named: Any) -> Any:
        key = function.__qualname__, pickle.dumps((arguments, named))
        if key not in _ANSWERS:
            _ANSWERS[key] = function(*arguments, **named)
        return _ANSWERS[key]

    return answer


@contextmanager
def made_once() -> Iterator[None]:
    """Inside, equal arguments have the answer that they had before; errors are raised anew."""
    with pytest.MonkeyPatch.context() as patched:
        for module, name in (
            (parts_choice, "synthesise"),
            (synthesis_result, "find"),
            (board_routing, "route_board"),
        ):
            patched.setattr(module, name, _once(getattr(module, name)))
        yield
