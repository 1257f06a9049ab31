"""Model files of format 2, table by table."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

Joints = Mapping[tuple[str, str], Any]
"""A value by the two names between which an element stands."""


def table(kind: str, **keys: Any) -> str:
    """A table ``[[kind]]``: a line for each key."""
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in keys.items()]
    return "\n".join([f"[[{kind}]]", *lines, ""])


def clearance(name: str, *between: str, **keys: Any) -> str:
    """A table ``[[clearance]]``."""
    return table("clearance", name=name, between=between, **keys)


def system_text(masses: Mapping[str, Any], springs: Joints, dampers: Joints, *more: str) -> str:
    """The file of these masses, springs and dampers, and further tables."""
    tables = [table("mass", name=name, mass=mass) for name, mass in masses.items()]
    tables += [table("spring", between=pair, stiffness=k) for pair, k in springs.items()]
    tables += [table("damper", between=pair, damping=c) for pair, c in dampers.items()]
    return "".join(["format = 2\n", *tables, *more])
