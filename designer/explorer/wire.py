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


def column(values: ArrayLike) -> dict[str, str]:
    """Numbers of one column of a plot; NaN makes a gap."""
    packed = np.asarray(values, dtype="<f4").tobytes()
    return {"f4": base64.b64encode(packed).decode("ascii")}


def columns(values: Mapping[str, ArrayLike]) -> dict[str, dict[str, str]]:
    """Columns of a plot by name, all of one length."""
    return {name: column(each) for name, each in values.items()}


def text_of(message: Message) -> str:
    """A message as the socket carries it; no NaN, which JSON does not have."""
    return json.dumps(message, ensure_ascii=False, allow_nan=False)
