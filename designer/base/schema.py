"""Checks of hand-written files that end in an ``InputError``: file, field, found, expected.

A table of a file is a frozen dataclass; each field says what its key accepts and how that reads in
a message:

    @dataclass(frozen=True)
    class Rails(FileTable):
        supply: Annotated[float, number("V", "a number > 0", lambda x: x > 0)] = 15.0

``validated`` makes such a record of a TOML file: pydantic walks its tables, and each thing that it
refuses becomes an ``InputError``; ``checked`` raises the first. Nothing is converted silently: a
text is no number where the field has no unit, 1 is not true, and a key that nobody reads is an
error. What the code makes itself is not checked, but by ``check_values``.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

from pydantic import (
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    TypeAdapter,
    ValidationError,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, core_schema

from designer.base.errors import MISSING, InputError
from designer.base.json_schema import Json, either, listed
from designer.base.units import is_bare_milli, parse_quantity

SMALLEST = math.nextafter(0.0, 1.0)
"""The least number above 0."""
GREATEST = math.nextafter(math.inf, 0.0)
"""The greatest number."""


@dataclass(frozen=True)
class FileTable:
    """Base of the records that tables of files are read into."""

    __pydantic_config__ = ConfigDict(extra="forbid")


TableT = TypeVar("TableT", bound=FileTable)


class FieldProblems(ValueError):
    """Everything that is wrong with one field that is a table.

    problems : their fields are keys of that table, or "" for all of it.
    """

    def __init__(self, problems: Sequence[InputError]) -> None:
        super().__init__("; ".join(problem.expected for problem in problems))
        self.problems = tuple(problems)


@dataclass(frozen=True)
class Accepts:
    """What a field accepts: in words, and as a function that returns the value or raises.

    ``check`` raises ValueError for what it does not accept; its message is added to ``expected``.
    FieldProblems stand for themselves.
    """

    expected: str
    """What is accepted, in words."""
    check: Callable[..., Any]
    """Returns the value that a field's content stands for."""
    in_folder: bool = False
    """Whether ``check`` also takes the folder of the file."""
    json: Json = field(default_factory=dict)
    """JSON Schema of what is accepted, or of more; ``check`` decides."""

    def __get_pydantic_core_schema__(
        self, _source: object, _handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(
        self, _schema: CoreSchema, _handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {**self.json, "x-expected": self.expected}

    def _validate(self, value: object, info: core_schema.ValidationInfo) -> Any:
        return self.read(value, *([info.context] if self.in_folder else []))

    def read(self, value: object, *folder: Path | None) -> Any:
        """As ``check``, with all that is expected in the message of the ValueError."""
        try:
            return self.check(value, *folder)
        except FieldProblems:
            raise
        except ValueError as error:
            detail = f" ({error})" if str(error) else ""
            raise ValueError(self.expected + detail) from None


def such(expected: str, fits: Callable[[Any], bool], json: Json | None = None) -> Accepts:
    """A value for which ``fits`` holds, as it is."""

    def check(value: object) -> object:
        if not fits(value):
            raise ValueError
        return value

    return Accepts(expected, check, json=json or {})


def number(unit: str, expected: str, fine: Callable[[float], bool] = math.isfinite) -> Accepts:
    """A finite number for which ``fine`` holds; with a unit also as text ("22.1k", "100nF")."""

    def check(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError
        if isinstance(value, str) and not unit:
            raise ValueError("without quotes")
        if isinstance(value, str) and unit in MECHANICAL and is_bare_milli(value):
            raise ValueError(f'"m" alone could be metres or milli: write the unit {unit}')
        result = parse_quantity(value, unit)
        if not fine(result):
            raise ValueError
        return result

    return Accepts(expected, check, json={"type": ["number", "string"] if unit else "number"})


def fraction(example: str, *, zero: bool = False) -> Accepts:
    """A number in (0, 1), or in [0, 1) with ``zero``. example : as in "0.01 is 1 %"."""
    low = "[" if zero else "("
    return number(
        "",
        f"a fraction in {low}0, 1): {example}",
        lambda value: 0.0 < value < 1.0 or (zero and value == 0.0),
    )


def whole_number(expected: str, least: float, most: float = math.inf) -> Accepts:
    """A whole number from ``least`` to ``most``."""
    json = {"type": "integer", "minimum": least, **({"maximum": most} if most < math.inf else {})}
    return such(expected, lambda value: type(value) is int and least <= value <= most, json)


def span(unit: str, expected: str, fine: Callable[[float], bool]) -> Accepts:
    """Two numbers [low, high], low <= high, ``fine`` for both."""
    end = number(unit, expected, fine)

    def check(value: object) -> tuple[float, float]:
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise ValueError
        low, high = map(end.check, value)
        if low > high:
            raise ValueError("the range is reversed")
        return low, high

    return Accepts(expected, check, json=listed(end.json, 2, 2))


def physical(unit: str, *, zero: bool = False) -> Accepts:
    """A number > 0 (or >= 0) with a unit of ``EXAMPLES``, or text that ends in it."""
    bound = ">= 0" if zero else "> 0"
    expected = f"a number {bound} in {unit}, or text such as {EXAMPLES[unit]}"
    return number(unit, expected, lambda value: value > 0.0 or (zero and value == 0.0))


def physical_span(unit: str) -> Accepts:
    """A range of numbers > 0 with a unit of ``EXAMPLES``."""
    expected = f"a range [low, high] of numbers > 0 in {unit}, or texts such as {EXAMPLES[unit]}"
    return span(unit, expected, lambda value: value > 0.0)


MECHANICAL = ("kg", "N s/m", "N/m", "N", "m/s")
"""Units of quantities that nobody writes with a prefix alone."""
EXAMPLES = {
    "kg": '"2.5 kg"',
    "N s/m": '"55 N s/m"',
    "N/m": '"12 kN/m"',
    "m/s": '"50 mm/s"',
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

    return Accepts(expected, check, json={"enum": list(names)})


def flag() -> Accepts:
    """true or false, and no number in their place."""
    return such("true or false", lambda value: isinstance(value, bool), {"type": "boolean"})


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

    return Accepts(expected, check, json={"type": "string", "minLength": 1, "maxLength": longest})


def text(pattern: str, expected: str) -> Accepts:
    """Text that a regular expression matches as a whole."""
    fitting = re.compile(pattern, re.ASCII)
    return such(
        expected,
        lambda value: isinstance(value, str) and fitting.fullmatch(value) is not None,
        {"type": "string", "pattern": f"^(?:{pattern})$"},
    )


def several(
    expected: str, each: Accepts, *, least: int = 0, single: bool = False, again: bool = False
) -> Accepts:
    """A list of at least so many of what ``each`` accepts, as a tuple.

    single : one of them may stand for a list of it. again : whether one that is listed a second
    time counts a second time.
    """

    def check(value: object) -> tuple[Any, ...]:
        items = [value] if single and isinstance(value, str) else value
        if not isinstance(items, list) or len(items) < least:
            raise ValueError
        values = [each.check(item) for item in items]
        return tuple(values if again else dict.fromkeys(values))

    json = listed(each.json, least)
    return Accepts(expected, check, json=either(each.json, json) if single else json)


def lines(expected: str) -> Accepts:
    """A list of texts of one line each."""
    return several(expected, line(""), again=True)


FIRST_FORMAT = whole_number("1, the format that this version reads", 1, 1)
"""The format number of a file."""


def did_you_mean(word: str, choices: Iterable[str]) -> str:
    """A hint such as ``did you mean "zeta"?``, or nothing."""
    if not word:
        return ""
    folded = {name.casefold(): name for name in choices}
    close = difflib.get_close_matches(word.casefold()[:100], folded, n=1, cutoff=0.6)
    return f'did you mean "{folded[close[0]]}"?' if close else ""


def one_of(word: str, choices: Iterable[str]) -> str:
    """The choices in words, with a hint at the one that was probably meant."""
    names = list(choices)
    hint = did_you_mean(word, names)
    return "one of " + ", ".join(names) + (f"; {hint}" if hint else "")


def checked(
    table: type[TableT], data: Mapping[str, object], file: str | None, *, within: str = ""
) -> TableT:
    """``data`` as a record, or an ``InputError`` for the first thing that does not fit, by the
    order of ``validated``."""
    record, problems = validated(table, data, file, within=within)
    if record is None:
        raise problems[0]
    return record


def validated(
    table: type[TableT],
    data: Mapping[str, object],
    file: str | None,
    *,
    within: str = "",
    folder: Path | None = None,
) -> tuple[TableT | None, list[InputError]]:
    """``data`` as a record; or None, and an ``InputError`` for each thing that does not fit.

    Unknown keys come first: a misspelt key is also a missing one, and its spelling is the cause. A
    key that is missing because it is misspelt is named once.

    within : a prefix of the field's name. folder : the folder of the files that fields name.
    """
    try:
        record: TableT = _adapter(table).validate_python(data, context=folder)
        return record, []
    except ValidationError as error:
        problems = error.errors(include_url=False)
    out: list[InputError] = []
    misspelt: set[tuple[int | str, ...]] = set()
    for problem in sorted(problems, key=lambda p: p["type"] != _UNKNOWN):
        place = problem["loc"]
        field = _dotted((within, *place) if within else place)
        if problem["type"] == _UNKNOWN:
            keys = sorted(keys_of(_table_at(table, place[:-1])))
            # Past these nobody reads a hint, and ten thousand would take seconds.
            word = str(place[-1]) if len(out) < _MOST_HINTS else ""
            expected = one_of(word, keys)
            misspelt |= {(*place[:-1], name) for name in keys if f'mean "{name}"?' in expected}
            out.append(InputError(file, field, f"unknown key {place[-1]!r}", expected))
        elif problem["type"] == "missing":
            if place not in misspelt:
                out.append(InputError(file, field, MISSING, expected_of(table, place)))
        else:
            out += _wrong(file, field, dict(problem), expected_of(table, place))
    return None, out


_MOST_HINTS = 1000
_UNKNOWN = "unexpected_keyword_argument"  # pydantic's name of an unknown key


_adapter: Callable[[Any], TypeAdapter[Any]] = cache(TypeAdapter)


def _wrong(
    file: str | None, field: str, problem: Mapping[str, Any], expected: str
) -> list[InputError]:
    """The value of a field that is not what it accepts."""
    error = problem["ctx"]["error"] if problem["type"] == "value_error" else expected
    if not isinstance(error, FieldProblems):
        return [InputError(file, field, literal(problem["input"]), str(error))]
    return [
        p
        if p.file is not None
        else InputError(file, f"{field}.{p.field}" if p.field else field, p.found, p.expected)
        for p in error.problems
    ]


def literal(value: object) -> str:
    """``value`` as it would stand in the file."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    try:
        return repr(value)
    except ValueError:  # an integer with more digits than Python prints
        return "a very large integer"


def check_values(record: FileTable, prefix: str) -> None:
    """Check a record that was made in code against what the keys of its table accept.

    Raises
    ------
    InputError : names the first field that its key would not be read as, ``prefix`` in front.
    """
    for name, accepts in _accepted(type(record)):
        value = getattr(record, name)
        try:
            same = accepts.check(value) == value
        except ValueError:
            same = False
        if not same:
            raise InputError(None, f"{prefix}.{name}", value, accepts.expected)


def _find_accepted(table: type[FileTable]) -> tuple[tuple[str, Accepts], ...]:
    """The fields that state what they accept."""
    kinds = {key: get_args(annotation)[1:] for key, annotation in keys_of(table).items()}
    return tuple((key, a) for key, kind in kinds.items() for a in kind if isinstance(a, Accepts))


_accepted: Callable[[Any], tuple[tuple[str, Accepts], ...]] = cache(_find_accepted)


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


def _keys_of(table: type[FileTable]) -> Mapping[str, Any]:
    hints = get_type_hints(table, include_extras=True)
    return {_key(field.name, hints[field.name]): hints[field.name] for field in fields(table)}


keys_of: Callable[[Any], Mapping[str, Any]] = cache(_keys_of)
"""The keys that a table may have, each with the annotation of its field."""


def _key(name: str, annotation: Any) -> str:
    """The key of a field: its name, or the alias that its annotation states."""
    metadata = get_args(annotation)[1:] if get_origin(annotation) is Annotated else ()
    return next((each.alias for each in metadata if isinstance(each, FieldInfo)), None) or name


def _table_at(table: type[FileTable], place: tuple[int | str, ...]) -> type[FileTable]:
    """The table that a place lies in."""
    current = table
    for part in place:
        if isinstance(part, str):
            nested = nested_table(keys_of(current)[part])
            assert nested is not None
            current = nested
    return current


def nested_table(annotation: object) -> type[FileTable] | None:
    """The table inside an annotation such as ``tuple[Rails, ...]`` or ``Rails | None``."""
    if isinstance(annotation, type) and issubclass(annotation, FileTable):
        return annotation
    return next((t for t in map(nested_table, get_args(annotation)) if t is not None), None)


def accepts_value(table: type[FileTable], key: str, value: object) -> bool:
    """Whether a key of a table accepts this value; of one that holds tables, whether it is any."""
    annotation = keys_of(table)[key]
    if nested_table(annotation) is not None:
        listed = value if isinstance(value, list) else [value]
        return all(isinstance(each, Mapping) for each in listed)
    for each in get_args(annotation)[1:] if get_origin(annotation) is Annotated else ():
        if isinstance(each, Accepts) and not each.in_folder:
            try:
                each.check(value)
            except ValueError:
                return False
    return True


def expected_of(table: type[FileTable], place: tuple[int | str, ...]) -> str:
    """The values that the field at a place accepts, in words."""
    keys = [part for part in place if isinstance(part, str)]
    if not keys:
        return "a table"
    annotation = keys_of(_table_at(table, tuple(keys[:-1])))[keys[-1]]
    kind, *metadata = get_args(annotation) if get_origin(annotation) is Annotated else [annotation]
    for each in metadata:
        if isinstance(each, Accepts):
            return each.expected
    nested = nested_table(kind)
    assert nested is not None
    listed = get_origin(kind) is tuple
    noun = "tables" if listed and isinstance(place[-1], str) else "a table"
    if len(keys_of(nested)) > _MOST_KEYS:
        header = ".".join(keys)
        return f"{noun} [[{header}]]" if listed else f"{noun} [{header}]"
    return f"{noun.replace('tables', 'a list of tables')} of {', '.join(keys_of(nested))}"


_MOST_KEYS = 5  # a table of more is named by its header
