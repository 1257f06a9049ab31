"""The tables ``[rules.<id>]`` of a model file: another limit for a rule, and the reason for it.

    [rules.swing]
    limit = "12.5 V"
    reason = "measured on ten boards: nothing clips below 12.9 V"

The reason is required, and goes where the rule's outcome goes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from designer.base.errors import InputError
from designer.base.schema import Accepts, FileTable, checked, line, literal, number, one_of
from designer.base.units import format_quantity, parse_quantity
from designer.catalog.design_rule import DesignRule, Override
from designer.catalog.design_rules import BY_ID


def overrides(tables: Mapping[str, Any], file: str | None) -> dict[str, Override]:
    """The overrides by rule id, in the order of the rules.

    Raises
    ------
    InputError : an unknown id, no reason, or a limit that is no value in the rule's unit.
    """
    for name, table in tables.items():
        if name not in BY_ID:
            raise InputError(file, f"rules.{name[:60]}", "an unknown rule", one_of(name, BY_ID))
        if not isinstance(table, dict):
            raise InputError(file, f"rules.{name}", literal(table), "a table with limit and reason")
    return {
        name: _override(rule, tables[name], file) for name, rule in BY_ID.items() if name in tables
    }


@dataclass(frozen=True)
class _Table(FileTable):
    limit: Annotated[object, Accepts("a limit in the rule's unit", lambda value: value)]
    reason: Annotated[str, line("the reason for another limit, text of one line", 500)]


def _override(rule: DesignRule, table: dict[str, Any], file: str | None) -> Override:
    place = f"rules.{rule.id}"
    entry = checked(_Table, table, file, within=place)
    try:
        return Override(_limit(rule).read(entry.limit), entry.reason)
    except ValueError as error:
        raise InputError(file, f"{place}.limit", literal(entry.limit), str(error)) from None


def _limit(rule: DesignRule) -> Accepts:
    """What the limit of a rule may be, in its unit."""
    expected = f"a number >= 0 in {rule.unit}" if rule.unit else "a number >= 0"
    if rule.unit:
        expected += f', or text such as "{format_quantity(rule.limit or 1.0, rule.unit, 3)}"'
    plain = number(rule.unit, expected, lambda value: value >= 0.0)
    if rule.unit != "mm":
        return plain
    return Accepts(
        expected,
        lambda value: plain.check(
            1e3 * parse_quantity(value, "m") if isinstance(value, str) else value
        ),
    )
