"""The tables ``[[response]]`` of a model file: what a board shall show."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Annotated, Literal, NoReturn

from pydantic import BaseModel

from designer.base.errors import MISSING, InputError
from designer.base.schema import STRICT, Accepts, choice, flag, number, physical, shown, span
from designer.model.model import Mechanical
from designer.model.si_units import FREQUENCIES, angular_frequency

Twin = Literal["either", "exact"]

MAX_PERIODS = 16
"""Largest n of an n-p-q response (docs/definitions.md)."""

_EXPECT = re.compile(r"([1-9]\d?)-(0|[1-9]\d{0,3})-(0|[1-9]\d{0,3})", re.ASCII)


@dataclass(frozen=True)
class Expect:
    """An n-p-q response."""

    n: int
    """Least period, in forcing periods."""
    p: int
    """Impacts at the upper stop in n forcing periods."""
    q: int
    """Impacts at the lower stop in n forcing periods."""

    def __str__(self) -> str:
        return f"{self.n}-{self.p}-{self.q}"

    @classmethod
    def parse(cls, text: str) -> Expect:
        """Read "1-2-2"; ValueError unless n is 1 to 16 and p and q are integers >= 0."""
        match = _EXPECT.fullmatch(text)
        if not match or int(match[1]) > MAX_PERIODS:
            raise ValueError(f"not n-p-q with n from 1 to {MAX_PERIODS}")
        return cls(int(match[1]), int(match[2]), int(match[3]))

    def accepts(self, n: int, p: int, q: int, twin_exact: bool = False) -> bool:
        """Whether n-p-q is this response, or its mirror twin n-q-p unless ``twin_exact``."""
        if (n, p, q) == (self.n, self.p, self.q):
            return True
        return not twin_exact and (n, p, q) == (self.n, self.q, self.p)


@dataclass(frozen=True)
class Response:
    """A response that the board shall show."""

    omega: float | None
    """Dimensionless frequency; None for "best": the tool chooses it."""
    expect: Expect | None = None
    """The wanted n-p-q, or None where any is of interest."""
    twin: Twin = "either"
    """"either" accepts the mirror twin of ``expect`` as well; "exact" does not."""
    symmetric: bool | None = None
    """Whether the orbit has to be symmetric (True), asymmetric (False) or either (None)."""
    b: float | tuple[float, float] | None = None
    """Clearance at which this response is wanted: a value, a range to choose from, or None for the
    model's own."""

    def accepts(self, n: int, p: int, q: int) -> bool:
        """Whether n-p-q is what is expected here; without an expectation, anything is."""
        return self.expect is None or self.expect.accepts(n, p, q, self.twin == "exact")


def response_of(
    table: ResponseTable, index: int, mechanical: Mechanical | None, file: str | None
) -> Response:
    place = f"response[{index}]"

    def refuse(key: str, found: object, expected: str) -> NoReturn:
        raise InputError(file, f"{place}.{key}", found, expected)

    given = [key for key in _FREQUENCY if getattr(table, key) is not None]
    if len(given) > 1:
        many = {2: "two", 3: "three"}[len(given)]
        refuse(given[-1], " and ".join(given), f"one of the {many}")
    omega = None if table.omega == "best" else table.omega
    angular = table.frequency if table.Omega is None else table.Omega
    if angular is not None:
        key = given[0]
        if mechanical is None:
            told = table.Omega if key == "Omega" else angular / (2.0 * math.pi)
            unit = "rad/s" if key == "Omega" else "Hz"
            refuse(key, told, f"omega: {key} in {unit} needs a table [mechanical]")
        omega = mechanical.omega(angular)
        if not 0.0 < omega < math.inf:
            refuse(key, angular, "a frequency within the range of numbers")
    elif table.omega is None:
        more = ", or Omega in rad/s, or frequency in Hz"
        refuse("omega", MISSING, _OMEGA + ("" if mechanical is None else more))
    if table.twin == "exact" and table.expect is None:
        refuse("twin", shown(table.twin), "an expect that it can apply to")
    assert not isinstance(omega, str)
    return Response(omega, table.expect, table.twin, table.symmetric, table.b)


_OMEGA = 'a number > 0, or "best"'
_FREQUENCY = ("omega", "Omega", "frequency")
"""The keys that give a response's frequency."""


def _positive(value: float) -> bool:
    return value > 0.0


def _omega() -> Accepts:
    frequency = number("", _OMEGA, _positive)

    def check(value: object) -> object:
        return value if value == "best" else frequency.check(value)

    return Accepts(_OMEGA, check)


def _frequency() -> Accepts:
    """A frequency in Hz, or a text with its unit; the value is in rad/s."""
    expected = f"a number > 0 in Hz, or text such as {FREQUENCIES}"

    def check(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError
        angular = angular_frequency(value)
        if not 0.0 < angular < math.inf:
            raise ValueError
        return angular

    return Accepts(expected, check)


def _expect() -> Accepts:
    def check(value: object) -> Expect:
        if not isinstance(value, str):
            raise ValueError
        try:
            return Expect.parse(value)
        except ValueError:
            raise ValueError from None

    return Accepts(f'n-p-q such as "1-2-2", with n from 1 to {MAX_PERIODS} and p, q >= 0', check)


def _clearance() -> Accepts:
    expected = "a number > 0, or a range [low, high] of numbers > 0"
    value_of, span_of = number("", expected, _positive), span("", expected, _positive)

    def check(value: object) -> object:
        return (span_of if isinstance(value, list) else value_of).check(value)

    return Accepts(expected, check)


class ResponseTable(BaseModel):
    """What a table may hold."""

    model_config = STRICT
    omega: Annotated[float | Literal["best"] | None, _omega()] = None
    Omega: Annotated[float | None, physical("rad/s")] = None
    frequency: Annotated[float | None, _frequency()] = None
    expect: Annotated[Expect | None, _expect()] = None
    twin: Annotated[Twin, choice("either", "exact")] = "either"
    symmetric: Annotated[bool | None, flag()] = None
    b: Annotated[float | tuple[float, float] | None, _clearance()] = None
