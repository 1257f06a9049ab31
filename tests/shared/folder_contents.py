"""What is in a folder, so that two can be compared: the command that made them may have taken
another time."""

from __future__ import annotations

import json
from pathlib import Path


def without_cost(folder: Path) -> dict[str, object]:
    """Files by their places; JSON as an object without its ``cost``, the one that may differ."""
    out: dict[str, object] = {}
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        name, content = path.relative_to(folder).as_posix(), path.read_bytes()
        out[name] = content
        if name.endswith(".json"):
            out[name] = {k: v for k, v in json.loads(content).items() if k != "cost"}
    return out


def differing(one: Path, other: Path) -> set[str]:
    """Files that only one of two folders has, or that differ; by name, for the difference of two
    reports takes minutes to show."""
    first, second = without_cost(one), without_cost(other)
    return {name for name in {**first, **second} if first.get(name) != second.get(name)}
