"""What an option must be."""

from __future__ import annotations

import os

from designer.base.errors import InputError


def cores() -> int:
    """How many cores this process may use: the default of ``jobs``."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def at_least(name: str, value: int, least: int) -> None:
    """InputError unless an option is large enough."""
    if value < least:
        raise InputError(None, name, value, f"a whole number >= {least}")
