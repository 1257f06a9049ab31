"""The tables ``[rules.<id>]`` of a model file: another limit for a rule, and the reason for it.

    [rules.swing]
    limit = "12.5 V"
    reason = "measured on ten boards: nothing clips below 12.9 V"

The reason is required, and goes where the rule's outcome goes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel

from designer.base.errors import InputError
from designer.base.schema import STRICT, Accepts, checked, line, one_of, shown
from designer.base.units import format_quantity
from designer.catalog.design_rule import DesignRule, Override
from designer.catalog.design_rules import RULES


def overrides(tables: Mapping[str, Any], file: str | None) -> dict[str, Override]:
    """The overrides by rule id, in the order of the rules.

    Raises
    ------
    InputError : an unknown id, no reason, or a limit that is no value in the rule's unit.
    """
    by_id = {rule.id: rule for rule in RULES}
    for name, table in tables.items():
        if name not in by_id:
            raise InputError(file, f"rules.{name[:60]}", "an unknown rule", one_of(name, by_id))
        if not isinstance(table, dict):
            raise InputError(file, f"rules.{name}", shown(table), "a table with limit and reason")
    return {
        name: _override(rule, tables[name], file) for name, rule in by_id.items() if name in tables
    }


class _Table(BaseModel):
    model_config = STRICT
    limit: Annotated[object, Accepts("a limit in the rule's unit", lambda value: value)]
    reason: Annotated[str, line("the reason for another limit, text of one line", 500)]


def _override(rule: DesignRule, table: dict[str, Any], file: str | None) -> Override:
    place = f"rules.{rule.id}"
    given = checked(_Table, table, file, within=place)
    what = f"a number >= 0 in {rule.unit}" if rule.unit else "a number >= 0"
    if rule.unit:
        what += f', or text such as "{format_quantity(rule.limit or 1.0, rule.unit, 3)}"'
    try:
        limit = _quantity(given.limit, rule.unit)
    except ValueError as error:
        detail = f" ({error})" if str(error) else ""
        raise InputError(file, f"{place}.limit", shown(given.limit), what + detail) from None
    return Override(limit, given.reason)


def _quantity(value: object, unit: str) -> float:
    from designer.base.units import parse_quantity

    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError
    if isinstance(value, str) and not unit:
        raise ValueError("without quotes")
    if unit == "mm" and isinstance(value, str):
        result = 1e3 * parse_quantity(value, "m")
    else:
        result = parse_quantity(value, unit)
    if result < 0.0:
        raise ValueError
    return result
