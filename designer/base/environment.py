"""Environment variables of a process: what ngspice may see of the world.

This module is imported by every worker process: it imports the standard library only.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping


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
