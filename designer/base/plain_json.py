"""Values as strict JSON.

JSON has no NaN and no infinity: both become null.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

FORMAT = 1


def dumps(value: object, *, indent: int | None = 2) -> str:
    """Strict JSON in ASCII, ending in a newline; floats with all their digits."""
    return json.dumps(plain(value), indent=indent, allow_nan=False) + "\n"


def plain(value: object) -> Any:
    """The value in dicts, lists, str, int, bool, finite float and None; a record by its fields.

    Raises
    ------
    TypeError : something else, or a record with an ``as_dict``, whose keys are not its fields.
    """
    if value is None or isinstance(value, bool | np.bool_):
        return None if value is None else bool(value)
    if isinstance(value, str):
        return str(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, complex | np.complexfloating):
        return [plain(float(value.real)), plain(float(value.imag))]
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray | Sequence):
        return [plain(v) for v in value]
    if is_dataclass(value) and not isinstance(value, type) and not hasattr(value, "as_dict"):
        return {each.name: plain(getattr(value, each.name)) for each in fields(value)}
    raise TypeError(f"{type(value).__name__} has no JSON form")
