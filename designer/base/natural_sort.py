"""The order of names that end in numbers."""

from __future__ import annotations

import re


def natural_key(name: str) -> tuple[object, ...]:
    """Sort key: R2 before R10."""
    return tuple(int(t) if t.isdigit() else t for t in re.split(r"(\d+)", name))
