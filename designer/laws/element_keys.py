"""What keys accept that several elements have: a name, two bodies, a value of either sign; and how
an element is refused."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NoReturn

from designer.base.errors import MISSING, InputError
from designer.base.schema import Accepts, number, several, text

GROUND = "ground"
"""What a spring, a damper or a clearance may stand on beside the masses."""
NAME = text(
    r"[A-Za-z][A-Za-z0-9_]{0,31}",
    "a name: a letter, then letters, digits and _, at most 32 characters",
)
"""The name of an element."""
NUMBERS = (1e-60, 1e60)
"""Least and greatest size of a number that is not 0: the squares of ratios of such are still
numbers."""


def refuse(field: str, found: object, expected: str) -> NoReturn:
    """InputError of an element; the file is named where it is known."""
    raise InputError(None, field, found, expected)


def check_size(field: str, value: float, what: str = "a number") -> None:
    """Refuse a number outside ``NUMBERS``."""
    low, high = NUMBERS
    if value != 0.0 and not low <= abs(value) <= high:
        refuse(field, value, f"{what} from {low:g} to {high:g}")


def check_joined(
    field: str, between: tuple[str, str] | None, of: tuple[tuple[str, float], ...] | None
) -> None:
    """Refuse an element without one of ``between`` and ``of``, and factors that are no numbers."""
    if (between is None) == (of is None):
        found = MISSING if of is None else "between and of"
        refuse(f"{field}.between", found, "between = [A, B], or of = {A = factor, …}")
    for name, factor in of or ():
        if name == GROUND:
            refuse(f"{field}.of", GROUND, "masses: ground is what their displacements are from")
        check_size(f"{field}.of", factor, "numbers")


def two_bodies() -> Accepts:
    """Two bodies, of which one may be ground."""
    expected = 'two different names, of masses or "ground", such as ["hammer", "ground"]'
    each = several(expected, Accepts(expected, NAME.check, json=NAME.json), least=2)

    def check(value: object) -> tuple[str, str]:
        names = each.check(value)
        if len(names) != 2:
            raise ValueError
        return names[0], names[1]

    return Accepts(expected, check, json={**each.json, "maxItems": 2})


def combination() -> Accepts:
    """Factors of masses' displacements in a sum."""
    expected = "a factor for each mass, not 0, such as { hammer = 1.0, gear = -0.04 }"
    factor = number("", expected, lambda value: value != 0.0 and math.isfinite(value))

    def check(value: object) -> tuple[tuple[str, float], ...]:
        if not isinstance(value, Mapping) or not value:
            raise ValueError
        return tuple((NAME.check(name), factor.check(each)) for name, each in value.items())

    json = {"type": "object", "additionalProperties": {"type": "number"}, "minProperties": 1}
    return Accepts(expected, check, json=json)


def signed(unit: str, expected: str) -> Accepts:
    """A finite number of either sign, or text with its unit."""
    return number(unit, f"{expected} in {unit}, or text with its unit", math.isfinite)
