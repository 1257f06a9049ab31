"""Where the finished blocks of long work are kept, so that it goes on where it was."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

Kept = TypeVar("Kept")


class KeptBlocks(Protocol[Kept]):
    """Blocks by their place in the work: a number, or a track with one."""

    def read(self, *place: Any) -> Kept | None:
        """A finished block; None where there is none."""

    def write(self, block: Kept, *place: Any) -> None:
        """Keep a finished block."""


def stored(
    store: KeptBlocks[Kept] | None,
    place: tuple[Any, ...],
    may_be: Callable[[Kept], bool],
    make: Callable[[], Kept],
) -> Kept:
    """The block at a place, made and kept where the store has none that may be of this work."""
    block = None if store is None else store.read(*place)
    if block is None or not may_be(block):
        block = make()
        if store is not None:
            store.write(block, *place)
    return block
