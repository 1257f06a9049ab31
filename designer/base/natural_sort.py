"""The order of names that end in numbers."""

from __future__ import annotations

import re


def natural_key(name: str) -> tuple[object, ...]:
    """Sort key: R2 before R10.

    name : any text, also of a board that somebody else has drawn: "R²", or a number of 5000 digits.
    """
    parts = re.split(r"(\d+)", name, flags=re.ASCII)
    return tuple(_size(part) if k % 2 else part for k, part in enumerate(parts))


def _size(digits: str) -> tuple[int, str]:
    """What orders digits as the numbers that they are."""
    significant = digits.lstrip("0")
    return len(significant), significant
