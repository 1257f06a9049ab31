"""Values as strict JSON."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from designer.base.plain_json import dumps, plain


@dataclass(frozen=True)
class Pair:
    left: float
    right: tuple[int, ...]


@dataclass(frozen=True)
class Renamed:
    left: float

    def as_dict(self) -> dict[str, Any]:
        return {"other": self.left}


def test_values_that_json_has() -> None:
    value = {1: np.float64(0.5), "a": [math.nan, np.inf, np.int64(3), np.True_, None, "x"]}
    assert json.loads(dumps(value)) == {"1": 0.5, "a": [None, None, 3, True, None, "x"]}


def test_a_record_is_its_fields() -> None:
    assert plain({"pair": Pair(math.nan, (1, 2))}) == {"pair": {"left": None, "right": [1, 2]}}


@pytest.mark.parametrize("value", [Renamed(1.0), Pair, object(), {1, 2}])
def test_what_has_keys_of_its_own_is_refused(value: object) -> None:
    """A record with an ``as_dict`` says its keys itself; a class is no record."""
    with pytest.raises(TypeError, match="has no JSON form"):
        plain({"nested": [value]})
