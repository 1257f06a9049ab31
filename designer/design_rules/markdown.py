"""The rules as a table in Markdown: what docs/rules.md holds."""

from __future__ import annotations

from designer.catalog.design_rule import DesignRule, Scope
from designer.catalog.design_rules import RULES

TITLES: dict[Scope, str] = {"circuit": "On the circuit", "board": "On the board"}


def table(scope: Scope) -> str:
    """The rules of one scope, one a row, in the order of the list."""
    rows = [_row(rule) for rule in RULES if rule.scope == scope]
    head = ["| id | what is found | limit | source | what to do |", "|---|---|---|---|---|"]
    return "\n".join([*head, *rows]) + "\n"


def _row(rule: DesignRule) -> str:
    limit = rule.limit_is
    if rule.limit is not None:
        limit = rule.bound(rule.limit)
    elif rule.least:
        limit = f"at least: {limit}"
    else:
        limit = f"at most: {limit}"
    unit = f" [{rule.unit}]" if rule.unit else ""
    cells = (f"`{rule.id}`", f"{rule.title}{unit}", limit, rule.source, rule.do)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
