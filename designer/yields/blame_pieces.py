"""The parts of a blame that are done, so that interrupted work goes on where it was."""

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
    pieces: StoredParts,
    name: str,
    progress: Callable[[], None],
    make: Callable[[Callable[[], None]], Value],
) -> Value:
    """What the part of this name holds, made by ``make`` where it is not there.

    make : takes the callback for its steps. progress : called once a step, also for those of a
    part that is there, so that what a blame cost does not depend on interruptions.
    """
    known = pieces.get(name)
    if known is not None:
        value, steps = known
        for _ in range(steps):
            progress()
        made: Value = value
        return made
    steps = 0

    def step() -> None:
        nonlocal steps
        steps += 1
        progress()

    made = make(step)
    pieces.put({name: (made, steps)})
    return made
