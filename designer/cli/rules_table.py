"""What the rules say, as a table for people, on standard error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from designer.catalog.design_rule import FAIL, NOT_RUN, PASS
from designer.cli.tables import add_row, new_console, new_table, print_line


def show(answer: Mapping[str, Any]) -> None:
    """Every rule with what was found; then what to do about those that fail."""
    console = new_console()
    table = new_table("Design rules", "rule", "status", "found", "limit")
    for rule in answer["rules"]:
        limit = rule["limit"] + (" (model file)" if rule["reason"] else "")
        add_row(table, rule["id"], rule["status"], rule["found"], limit)
    console.print(table)
    for rule in answer["rules"]:
        if rule["reason"]:
            print_line(console, f"{rule['id']}: the model file's limit, because: {rule['reason']}")
    for rule in answer["rules"]:
        if rule["status"] == FAIL:
            print_line(console, f"{rule['id']} fails: {rule['do']}")
    count = answer["counts"]
    print_line(console, f"{count[PASS]} pass, {count[FAIL]} fail, {count[NOT_RUN]} not run")
    idle = [rule["id"] for rule in answer["rules"] if rule["status"] == NOT_RUN]
    if idle:
        print_line(console, f"Not run is no pass. Rules that were not looked at: {', '.join(idle)}")
