"""What goes to the page: JSON whose columns of numbers are 32-bit floats in base 64."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

Message = dict[str, Any]
"""An object with a ``kind``, and the ``id`` of the request that it answers."""
GAP = 65_535
"""What a column of 16-bit steps has for NaN."""
LEVELS = GAP - 1
"""Steps from the least number of such a column to the greatest."""


def column(values: ArrayLike) -> dict[str, str]:
    """Numbers of one column of a plot; NaN makes a gap."""
    packed = np.asarray(values, dtype="<f4").tobytes()
    return {"f4": base64.b64encode(packed).decode("ascii")}


def short_column(values: ArrayLike) -> dict[str, Any]:
    """The same in half the size: 16-bit steps between the least number and the greatest."""
    numbers = np.asarray(values, dtype=float)
    known = numbers[np.isfinite(numbers)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
    step = (high - low) / LEVELS or 1.0
    levels = np.where(np.isfinite(numbers), np.round((numbers - low) / step), GAP)
    packed = levels.astype("<u2").tobytes()
    return {"u2": base64.b64encode(packed).decode("ascii"), "low": low, "step": step}


def short_columns(values: Mapping[str, ArrayLike]) -> dict[str, dict[str, Any]]:
    """``columns`` in half the size."""
    return {name: short_column(each) for name, each in values.items()}


def columns(values: Mapping[str, ArrayLike]) -> dict[str, dict[str, str]]:
    """Columns of a plot by name, all of one length."""
    return {name: column(each) for name, each in values.items()}


def text_of(message: Message) -> str:
    """A message as the socket carries it; no NaN, which JSON does not have."""
    return json.dumps(message, ensure_ascii=False, allow_nan=False)
