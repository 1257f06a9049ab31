"""Records from plain data, whose values are of the types that their classes state.

What is stored may come from anyone, with a seal that is right: a value of another type would be met
far from the file, by whoever computes with it.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from enum import Enum
from functools import cache
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

Record = TypeVar("Record")
_KINDS = {"f": "fiu", "i": "iu", "u": "iu", "c": "cfiu", "b": "b"}
"""Kinds of arrays that stand for each kind."""
_hints: Callable[[Any], dict[str, Any]] = cache(get_type_hints)


def read_record(kind: type[Record], row: Mapping[str, Any], *, null: float | None = None) -> Record:
    """The record of a dataclass from what JSON and Parquet hold of it: a text for an enumeration,
    a list for a tuple or an array, a mapping for a record.

    null : what a missing number stands for where its field has to have one, such as nan in JSON,
    which has none.

    Raises
    ------
    TypeError, ValueError : a value is not of its field's type, is missing, or has no field.
    """
    hints = _hints(kind)
    values = {name: _read(v, hints.get(name), null) for name, v in row.items()}
    return checked_record(kind, values)


def _read(value: object, kind: Any, null: float | None) -> Any:
    """A value as its annotation has it; as it is where that says nothing of it."""
    if value is None:
        return null if kind is float else None
    if isinstance(value, int | float):
        return value
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        return _read(value, inner[0], null)
    if origin is tuple and isinstance(value, list):
        each = inner[:1] * len(value) if inner[-1] is Ellipsis else inner
        return tuple(_read(v, k, null) for v, k in zip(value, each, strict=True))
    if origin is Mapping and isinstance(value, Mapping):
        return {key: _read(v, inner[1], null) for key, v in value.items()}
    if origin is np.ndarray and isinstance(value, list):
        array = np.array(value)  # with something else in it than numbers it fits no annotation
        return array.astype(float) if array.dtype.kind in "iu" else array
    if isinstance(kind, type):
        if issubclass(kind, Enum):
            return kind(value)
        if isinstance(value, Mapping) and is_dataclass(kind):
            return read_record(kind, value, null=null)
    return value


def checked_record(kind: type[Record], values: Mapping[str, Any]) -> Record:
    """The record of a dataclass with these values.

    Raises
    ------
    TypeError : a value is not of its field's type, is missing, or has no field.
    """
    hints = _hints(kind)
    for name, value in values.items():
        if name in hints and not fits(value, hints[name]):
            raise TypeError(f"{name}: {type(value).__name__} for {hints[name]}")
    return kind(**values)


def fits(value: object, kind: Any) -> bool:
    """Whether a value is of the type of an annotation. A whole number is a float too; a truth value
    is neither."""
    if kind is Any:
        return True
    if kind is None or kind is type(None):
        return value is None
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        return any(fits(value, each) for each in inner)
    if origin is Literal:
        return value in inner
    if origin is tuple:
        return isinstance(value, tuple) and _fit_each(value, inner)
    if origin is Mapping:
        return isinstance(value, Mapping) and all(
            fits(key, inner[0]) and fits(each, inner[1]) for key, each in value.items()
        )
    if origin is np.ndarray:
        scalar = get_args(inner[1])[0]
        kinds = _KINDS[np.dtype(scalar).kind]
        return isinstance(value, np.ndarray) and value.dtype.kind in kinds
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    if kind in (int, bool, str) or issubclass(kind, Enum):
        return type(value) is kind
    return isinstance(value, kind)


def _fit_each(values: tuple[object, ...], kinds: tuple[Any, ...]) -> bool:
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        return all(fits(each, kinds[0]) for each in values)
    return len(values) == len(kinds) and all(map(fits, values, kinds))
