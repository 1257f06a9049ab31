"""Checks of hand-written files that end in an ``InputError``: file, field, found, expected.

A field of a table states in one place what it accepts and how that reads in a message:

    supply: Annotated[float, number("V", "a number > 0", lambda x: x > 0)] = 15.0

pydantic walks the tables (missing keys, unknown keys, nesting); ``checked`` turns the first thing
it dislikes into an ``InputError``, ``validated`` each of them. Nothing is converted silently: a
text is no number where the field has no unit, 1 is not true, and a key that nobody reads is an
error.
"""

from __future__ import annotations

import difflib
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError
from pydantic_core import CoreSchema, core_schema

from designer.base.errors import MISSING, InputError
from designer.base.units import parse_quantity

STRICT = ConfigDict(extra="forbid", frozen=True, strict=True)
"""For every table: unknown keys are errors, nothing is converted, nothing changes later."""

ModelT = TypeVar("ModelT", bound=BaseModel)


@dataclass(frozen=True)
class Problem:
    """What is wrong with one key of a field that is a table."""

    key: str
    """The key; "" for the field itself."""
    found: object
    """The value that stands there."""
    expected: str
    """What would be accepted, in words."""


class FieldProblems(ValueError):
    """Everything that is wrong with one field that is a table."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        super().__init__("; ".join(problem.expected for problem in problems))
        self.problems = tuple(problems)


@dataclass(frozen=True)
class Accepts:
    """What a field accepts: in words, and as a function that returns the value or raises.

    ``check`` raises ValueError for what it does not accept; a message there says more than
    ``expected`` does and is added to it. FieldProblems stand for themselves.
    """

    expected: str
    """What is accepted, in words."""
    check: Callable[[Any], Any]
    """Returns the value that a field's content stands for."""

    def __get_pydantic_core_schema__(
        self, _source: object, _handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._checked)

    def _checked(self, value: object) -> object:
        try:
            return self.check(value)
        except FieldProblems:
            raise
        except ValueError as error:
            detail = f" ({error})" if str(error) else ""
            raise ValueError(self.expected + detail) from None


def number(
    unit: str,
    expected: str,
    fine: Callable[[float], bool] = math.isfinite,
    *,
    optional: bool = False,
) -> Accepts:
    """A finite number for which ``fine`` holds; with a unit also as text ("22.1k", "100nF")."""

    def check(value: object) -> float | None:
        if value is None and optional:
            return None
        result = _quantity(value, unit)
        if not fine(result):
            raise ValueError
        return result

    return Accepts(expected, check)


def span(unit: str, expected: str, fine: Callable[[float], bool]) -> Accepts:
    """Two numbers [low, high], low <= high, ``fine`` for both."""

    def check(value: object) -> tuple[float, float]:
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise ValueError
        low, high = (_quantity(end, unit) for end in value)
        if not (fine(low) and fine(high)):
            raise ValueError
        if low > high:
            raise ValueError("the range is reversed")
        return low, high

    return Accepts(expected, check)


def physical(unit: str, *, zero: bool = False) -> Accepts:
    """A number > 0 (or >= 0) with a unit of ``EXAMPLES``, or text that ends in it."""
    bound = ">= 0" if zero else "> 0"
    expected = f"a number {bound} in {unit}, or text such as {EXAMPLES[unit]}"
    return number(unit, expected, lambda value: value > 0.0 or (zero and value == 0.0))


def physical_span(unit: str) -> Accepts:
    """A range of numbers > 0 with a unit of ``EXAMPLES``."""
    expected = f"a range [low, high] of numbers > 0 in {unit}, or texts such as {EXAMPLES[unit]}"
    return span(unit, expected, lambda value: value > 0.0)


EXAMPLES = {
    "kg": '"2.5 kg"',
    "N s/m": '"55 N s/m"',
    "N/m": '"12 kN/m"',
    "m": '"0.5 mm"',
    "N": '"80 N"',
    "rad/s": '"240 rad/s"',
    "V": '"15 V"',
    "Ω": '"22.1k"',
    "F": '"100nF"',
    "Hz": '"1 kHz"',
}
"""How a value of each unit may be written."""


def choice(*names: str) -> Accepts:
    """One of the named words."""
    listed = ", ".join(f'"{name}"' for name in names[:-1])
    expected = f'{listed} or "{names[-1]}"' if listed else f'"{names[-1]}"'

    def check(value: object) -> str:
        if not isinstance(value, str):
            raise ValueError
        if value not in names:
            raise ValueError(did_you_mean(value, names))
        return value

    return Accepts(expected, check)


def flag() -> Accepts:
    """true or false, and no number in their place."""

    def check(value: object) -> bool:
        if not isinstance(value, bool):
            raise ValueError
        return value

    return Accepts("true or false", check)


def line(expected: str, longest: int = 200) -> Accepts:
    """Printable text of one line, not blank."""

    def check(value: object) -> str:
        if not isinstance(value, str) or not value.strip():
            raise ValueError
        if not value.isprintable():
            raise ValueError("line breaks and control characters are not allowed")
        if len(value) > longest:
            raise ValueError(f"at most {longest} characters")
        return value

    return Accepts(expected, check)


def lines(expected: str) -> Accepts:
    """A list of texts of one line each."""
    one = line(expected).check

    def check(value: object) -> tuple[str, ...]:
        if not isinstance(value, list | tuple):
            raise ValueError
        return tuple(one(item) for item in value)

    return Accepts(expected, check)


def exactly(wanted: int, expected: str) -> Accepts:
    """One integer: the format number of a file."""

    def check(value: object) -> int:
        if type(value) is not int or value != wanted:
            raise ValueError
        return value

    return Accepts(expected, check)


def did_you_mean(found: str, known: Iterable[str]) -> str:
    """A hint such as ``did you mean "zeta"?``, or nothing."""
    folded = {name.casefold(): name for name in known}
    close = difflib.get_close_matches(found.casefold()[:100], folded, n=1, cutoff=0.6)
    return f'did you mean "{folded[close[0]]}"?' if close else ""


def one_of(found: str, known: Iterable[str]) -> str:
    """The known names in words, with a hint at the one that was probably meant."""
    names = list(known)
    hint = did_you_mean(found, names)
    return "one of " + ", ".join(names) + (f"; {hint}" if hint else "")


def parse_toml(text: str, file: str | None) -> dict[str, Any]:
    """The tables of a TOML text; a syntax error becomes an ``InputError`` that names the line."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(file, "the file", "tables or lists nested too deeply", "TOML") from None
    except ValueError as error:  # includes tomllib.TOMLDecodeError
        message = str(error)
        place = re.search(r" \(at line (\d+), column \d+\)$", message)
        content = text.splitlines()
        row = int(place[1]) if place else max(len(content), 1)
        found = content[row - 1].strip() if row <= len(content) else ""
        said = message[: place.start()] if place else message
        raise InputError(
            file, f"line {row}", found or "the end of the file", f"valid TOML ({said})"
        ) from None


def checked(
    model: type[ModelT], data: Mapping[str, object], file: str | None, *, within: str = ""
) -> ModelT:
    """``data`` as ``model``, or an ``InputError`` for the first thing that does not fit, by the
    order of ``validated``."""
    table, problems = validated(model, data, file, within=within)
    if table is None:
        raise problems[0]
    return table


def validated(
    model: type[ModelT], data: Mapping[str, object], file: str | None, *, within: str = ""
) -> tuple[ModelT | None, list[InputError]]:
    """``data`` as ``model``; or None, and an ``InputError`` for each thing that does not fit.

    Unknown keys come first: a misspelt key is also a missing one, and its spelling is the cause. A
    key that is missing because it is misspelt is not said again. ``within`` is put in front of the
    field's name.
    """
    try:
        return model.model_validate(data), []
    except ValidationError as error:
        problems = error.errors(include_url=False)
    out: list[InputError] = []
    misspelt: set[tuple[int | str, ...]] = set()
    for problem in sorted(problems, key=lambda p: p["type"] != "extra_forbidden"):
        place = problem["loc"]
        field = _dotted((within, *place) if within else place)
        if problem["type"] == "extra_forbidden":
            owner = _model_at(model, place[:-1])
            known = sorted(owner.model_fields) if owner else []
            expected = one_of(str(place[-1]), known)
            misspelt |= {(*place[:-1], name) for name in known if f'mean "{name}"?' in expected}
            out.append(InputError(file, field, f"unknown key {place[-1]!r}", expected))
        elif problem["type"] == "missing":
            if place not in misspelt:
                out.append(InputError(file, field, MISSING, _expected(model, place)))
        else:
            out += _wrong(file, field, dict(problem), _expected(model, place))
    return None, out


def _wrong(
    file: str | None, field: str, problem: Mapping[str, Any], expected: str
) -> list[InputError]:
    """The value of a field that is not what it accepts."""
    said = problem["ctx"]["error"] if problem["type"] == "value_error" else None
    if isinstance(said, FieldProblems):
        return [
            InputError(file, f"{field}.{p.key}" if p.key else field, p.found, p.expected)
            for p in said.problems
        ]
    return [
        InputError(file, field, shown(problem["input"]), expected if said is None else str(said))
    ]


def shown(value: object) -> str:
    """``value`` as the writer of the file knows it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    try:
        return repr(value)
    except ValueError:  # an integer with more digits than Python prints
        return "a very large integer"


def _quantity(value: object, unit: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError
    if isinstance(value, str) and not unit:
        raise ValueError("without quotes")
    return parse_quantity(value, unit)


def _dotted(place: tuple[int | str, ...]) -> str:
    """("response", 1, "omega") is response[2].omega: people count from one."""
    text = ""
    for part in place:
        if isinstance(part, int):
            text += f"[{part + 1}]"
        else:
            # A foreign key may hold anything.
            name = part if part.isprintable() else ascii(part)
            text += ("." if text else "") + name[:60]
    return text or "the file"


def _model_at(model: type[BaseModel], place: tuple[int | str, ...]) -> type[BaseModel] | None:
    """The table that a place lies in."""
    current: type[BaseModel] | None = model
    for part in place:
        if isinstance(part, int) or current is None:
            continue
        info = current.model_fields.get(part)
        current = _nested(info.annotation) if info else None
    return current


def _nested(annotation: object) -> type[BaseModel] | None:
    """The table inside an annotation such as ``tuple[Table, ...]`` or ``Table | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        found = _nested(argument)
        if found is not None:
            return found
    return None


def _expected(model: type[BaseModel], place: tuple[int | str, ...]) -> str:
    """In words, what the field at a place accepts."""
    keys = [part for part in place if isinstance(part, str)]
    owner = _model_at(model, tuple(keys[:-1])) if keys else None
    info = owner.model_fields.get(keys[-1]) if owner else None
    if info is None:
        return "a table"
    for item in info.metadata:
        if isinstance(item, Accepts):
            return item.expected
    return info.description or "a value"
