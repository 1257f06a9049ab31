"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from designer.base.errors import InputError

PART = ".part"


class NotWritten(InputError):
    """A place that cannot be written."""


WRITABLE = "a place that can be written"


def partial_of(path: Path) -> Path:
    """Where a file is written before it is put in its place."""
    return path.with_name(f".{path.name}{PART}")


@contextlib.contextmanager
def writing(path: Path, field: str = "--out", expected: str = WRITABLE) -> Iterator[None]:
    """A block that writes at this place.

    Raises
    ------
    NotWritten : an OSError in the block; field, expected : what it then says.
    """
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise NotWritten(path, field, reason, expected) from None


@contextlib.contextmanager
def appearing(path: Path, field: str = "--out", expected: str = WRITABLE) -> Iterator[Path]:
    """Where to write what stands at ``path`` once the block has ended; nothing is left of a block
    that fails. Raises as ``writing``."""
    partial = partial_of(path)
    with writing(path, field, expected):
        try:
            yield partial
            os.replace(partial, path)
        finally:
            with contextlib.suppress(OSError):
                partial.unlink(missing_ok=True)


def write(path: Path, content: str | bytes) -> None:
    """Write a file all at once; text in UTF-8.

    Raises
    ------
    NotWritten : it cannot.
    """
    with appearing(path) as partial:
        partial.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)
