"""What a model file of format 1 cannot say: more than two masses in a chain, stops on the first.

Keys of such systems are named before anything else is checked, so that nobody looks for a misspelt
key where only another format has one. The limits stand in docs/model-file.md.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields

from designer.base.errors import InputError
from designer.model.model import Dimensionless, Mechanical

KNOWN = (
    "format 1 knows two masses in a chain with stops on the first, at one distance, and forces "
    "of one frequency on the masses; format = 2 knows any masses, springs, dampers, clearances, "
    "forces and a moving base"
)
WHERE = "docs/model-file.md, Limits"
TABLES = {
    "mass": "a list of masses",
    "masses": "a list of masses",
    "spring": "a list of springs",
    "springs": "a list of springs",
    "damper": "a list of dampers",
    "dampers": "a list of dampers",
    "clearance": "a list of clearances",
    "clearances": "a list of clearances",
    "stop": "a list of stops",
    "stops": "a list of stops",
    "force": "a list of forces",
    "forces": "a list of forces",
    "base": "base motion",
    "friction": "friction",
}
"""Top-level keys of other systems, and what each would be."""
OF_A_MODEL = (
    (r"[A-Za-z]+_?([3-9]|[1-9]\d+)", "a third mass"),
    (r"[Bb]_?[12]|[Bb]_?(upper|lower)|gap\w*|clearances?", "a second clearance"),
    (r"[Kk]_?0_?([12]|upper|lower)", "a second clearance"),
    (r"base\w*|[YZ]0?|[xy]_?base|[xy]_?g(round)?", "base motion"),
    (r"friction\w*|mu", "friction"),
    (r"[Cc]_?0", "damping in the stops"),
    (r"cubic\w*|law|alpha|beta|gamma", "a nonlinear spring"),
    (r"[Ff]_?0|preload\w*|constant|gravity|g", "a constant force"),
)
"""Patterns of keys of ``[model]`` and ``[mechanical]``, and what each would be."""
MODELS = {"model": Dimensionless, "mechanical": Mechanical}
"""The two tables that a model may be given in."""


def check(data: Mapping[str, object], file: str | None) -> None:
    """Refuse a model file of format 1 that describes a system that format 1 does not know.

    Raises
    ------
    InputError : it has such a key; names what format 1 knows, and the page with its limits.
    """
    if data.get("format") == 2:
        return
    for key, feature in TABLES.items():
        if key in data:
            raise InputError(file, key, f"a table {key!r}", _unknown(key, feature))
    for table, record in MODELS.items():
        content = data.get(table)
        keys = {field.name for field in fields(record)}
        for key in content if isinstance(content, Mapping) else ():
            for pattern, feature in OF_A_MODEL:
                if key not in keys and re.fullmatch(pattern, key, re.ASCII):
                    text = f"unknown key {key!r}"
                    raise InputError(file, f"{table}.{key}", text, _unknown(key, feature))


def _unknown(key: str, feature: str) -> str:
    return f"a model without {feature}: {KNOWN}; {key} is not known ({WHERE})"
