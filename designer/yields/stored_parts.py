"""The finished parts of long work, so that interrupted work goes on where it was."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

Value = TypeVar("Value")


class StoredParts:
    """Finished parts by name; this one forgets everything that is put into it."""

    def get(self, name: str) -> Any | None:
        """None where the part is not there."""
        return None

    def put(self, values: Mapping[str, Any]) -> None:
        """Store these parts."""


def counted(
    parts: StoredParts,
    name: str,
    progress: Callable[[], None],
    compute: Callable[[Callable[[], None]], Value],
) -> Value:
    """The part of this name, computed and stored where it is not there.

    compute : takes the callback for its steps. progress : called once a step, also for those of a
    part that is there, so that the cost does not depend on interruptions.
    """
    stored: tuple[Value, int] | None = parts.get(name)
    if stored is not None:
        value, steps = stored
        for _ in range(steps):
            progress()
        return value
    steps = 0

    def step() -> None:
        nonlocal steps
        steps += 1
        progress()

    value = compute(step)
    parts.put({name: (value, steps)})
    return value
