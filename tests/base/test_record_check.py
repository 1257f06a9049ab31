"""Values of other types make no record."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Literal

import numpy as np
import pytest

from designer.base.arrays import Array, Mask
from designer.base.record_check import checked_record, read_record


class Colour(StrEnum):
    RED = "red"


@dataclass(frozen=True)
class Inner:
    """A record in another."""

    size: float


@dataclass(frozen=True)
class Outer:
    """Every kind of field that a stored record has."""

    count: int
    size: float
    good: bool | None
    name: str
    colour: Colour
    side: Literal["upper", "lower"]
    pairs: tuple[tuple[int, int], ...]
    ends: tuple[str, float]
    inner: Inner | None
    numbers: Array
    mask: Mask
    more: float = 0.0


WHOLE: dict[str, Any] = {
    "count": 3,
    "size": 1.5,
    "good": None,
    "name": "a",
    "colour": Colour.RED,
    "side": "upper",
    "pairs": ((1, 2), (3, 4)),
    "ends": ("a", 1),
    "inner": Inner(1.0),
    "numbers": np.zeros(3),
    "mask": np.zeros(3, dtype=bool),
}
"""Values that fit; a whole number is a float too."""
OTHERS: dict[str, tuple[Any, ...]] = {
    "count": (None, True, 1.0, "1"),
    "size": (None, False, "1.5", [1.5]),
    "good": (0, "true"),
    "name": (None, 1, Colour.RED),
    "colour": ("red", None),
    "side": ("middle", None),
    "pairs": (None, [(1, 2)], ((1, 2, 3),), ((1, 2.0),), (1, 2)),
    "ends": (("a",), ("a", "b"), ("a", 1.0, 2.0)),
    "inner": ({"size": 1.0}, 1.0),
    "numbers": (None, [0.0], np.array(["a"]), np.zeros(1, dtype=complex)),
    "mask": (np.zeros(3), None),
    "more": (None,),
}


def test_values_that_fit_make_the_record() -> None:
    assert checked_record(Outer, WHOLE) == Outer(**WHOLE)
    assert checked_record(Outer, {**WHOLE, "more": 2}).more == 2


@pytest.mark.parametrize(("key", "value"), [(k, v) for k, vs in OTHERS.items() for v in vs])
def test_values_of_other_types_do_not(key: str, value: Any) -> None:
    with pytest.raises(TypeError, match=key):
        checked_record(Outer, {**WHOLE, key: value})


def test_a_field_too_many_or_too_few() -> None:
    with pytest.raises(TypeError):
        checked_record(Outer, {**WHOLE, "other": 1})
    with pytest.raises(TypeError):
        checked_record(Outer, {key: WHOLE[key] for key in WHOLE if key != "count"})


PLAIN: dict[str, Any] = {
    **WHOLE,
    "colour": "red",
    "pairs": [[1, 2], [3, 4]],
    "ends": ["a", 1],
    "inner": {"size": 1.0},
    "numbers": [0.5, 2],
}
"""The same as JSON and Parquet hold it."""


def test_a_record_is_read_from_plain_data() -> None:
    read, wanted = read_record(Outer, PLAIN), Outer(**WHOLE)
    assert read.numbers.tolist() == [0.5, 2.0]
    assert read.numbers.dtype == float
    assert replace(read, numbers=wanted.numbers) == wanted


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("colour", "blue"),
        ("colour", None),
        ("pairs", [[1, 2, 3]]),
        ("pairs", [[1, None]]),
        ("ends", ["a"]),
        ("inner", {"size": None}),
        ("inner", {"width": 1.0}),
        ("numbers", [0.5, None]),
        ("numbers", ["a"]),
        ("size", "1.5"),
    ],
)
def test_plain_data_of_other_types_make_none(key: str, value: Any) -> None:
    with pytest.raises((TypeError, ValueError)):
        read_record(Outer, {**PLAIN, key: value})
