"""The types of the JSON objects, and whether an object is of its own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, NotRequired, get_args, get_origin

import pytest
from pydantic import ConfigDict, TypeAdapter, ValidationError
from typing_extensions import get_type_hints, is_typeddict

from designer.answers.bench_answer import BenchJson
from designer.answers.bifurcation_answer import BifurcationAnswer
from designer.answers.catalog_answer import CatalogNames, NewAnswer, OpAmpChecks
from designer.answers.cure_answer import CureAnswer
from designer.answers.design_answer import DesignAnswer
from designer.answers.export_answer import ExportJson
from designer.answers.rules_answer import RulesJson
from designer.answers.search_answer import SearchAnswer
from designer.answers.simulate_answer import SimulateAnswer
from designer.answers.study_answer import RunAnswer, StudyAnswer
from designer.answers.trade_answer import TradeAnswer
from designer.base.plain_json import plain
from designer.cli import app, command_line

OF_VERB: dict[str, Any] = {
    "simulate": SimulateAnswer,
    "bifurcation": BifurcationAnswer,
    "search": SearchAnswer | CureAnswer,
    "run": RunAnswer,
    "synthesise": DesignAnswer,
    "synthesize": DesignAnswer,
    "tolerance": StudyAnswer,
    "trade": TradeAnswer,
    "rules": RulesJson,
    "bench": BenchJson,
    "export": ExportJson,
    "catalog": CatalogNames | OpAmpChecks,
    "new": NewAnswer,
}
"""The type of what each verb prints."""
NOT_FOUND = {"responses"}
"""Keys of what any verb prints where the model does not show a response."""


def check_type(answer: object, verb: str) -> None:
    """Raises AssertionError where what a verb prints is not of its type: a key that this does not
    declare, one that is missing, a value of another type."""
    value = plain(answer)
    if value.keys() != NOT_FOUND:
        assert_type(value, OF_VERB[verb])


def assert_type(value: object, kind: Any) -> None:
    """Raises AssertionError where a value is not of a type, or of a union of types."""
    try:
        _reader(kind).validate_python([value], strict=True)
    except ValidationError as error:
        raise AssertionError(str(error)) from error


@cache
def _reader(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(list[kind], config=ConfigDict(extra="forbid"))


def declared(kind: Any) -> set[str]:
    """The keys of a type, and of all that stands in it."""
    return set(_keys(kind, set()))


def _keys(kind: Any, seen: set[Any]) -> Iterator[str]:
    if is_typeddict(kind) and kind not in seen:
        seen.add(kind)
        for key, hint in get_type_hints(kind, include_extras=True).items():
            yield key
            yield from _keys(hint, seen)
    for each in get_args(kind):
        yield from _keys(each, seen)


def needed(kind: Any) -> set[str]:
    """The keys that a type must have, as paths such as "responses.omega"; of what is in lists and
    objects the innermost."""
    if not is_typeddict(kind):
        return {path for each in get_args(kind) for path in needed(each)}
    hints = get_type_hints(kind, include_extras=True)
    paths = {
        key: needed(hint)
        for key, hint in hints.items()
        # Of annotations that are text, Python does not look for what may be missing.
        if key in kind.__required_keys__ and not _may_miss(hint)
    }
    return {f"{key}.{p}" if p else key for key, inner in paths.items() for p in inner or {""}}


def _may_miss(hint: Any) -> bool:
    origin: Any = get_origin(hint)
    return origin is NotRequired


@contextmanager
def printed_answers_checked() -> Iterator[None]:
    """Inside, what a verb prints in this process is of its type."""
    write, run = app.print_json, command_line.dispatch
    verbs: list[str] = []

    def dispatch(arguments: list[str]) -> int:
        verbs[:] = arguments[:1]
        return run(arguments)

    def checked(answer: object) -> None:
        check_type(answer, *verbs)
        write(answer)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(command_line, "dispatch", dispatch)
        patched.setattr(app, "print_json", checked)
        yield
