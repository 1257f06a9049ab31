"""What rules say, for others: outcomes as a JUnit report, the rules as a table in Markdown."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree import ElementTree

from designer.catalog.design_rule import FAIL, NOT_RUN, DesignRule, RuleOutcome, Scope
from designer.catalog.design_rules import RULES


def junit(title: str, outcomes: Sequence[RuleOutcome]) -> str:
    """An XML text for continuous integration: one test case a rule; what was not run is skipped.

    Characters that XML 1.0 cannot hold become "?".
    """
    suite = ElementTree.Element(
        "testsuite",
        name=_clean(f"design rules: {title}"),
        tests=str(len(outcomes)),
        failures=str(sum(each.status == FAIL for each in outcomes)),
        skipped=str(sum(each.status == NOT_RUN for each in outcomes)),
        errors="0",
    )
    for each in outcomes:
        case = ElementTree.SubElement(
            suite, "testcase", classname=f"rules.{each.rule.scope}", name=each.rule.id
        )
        if each.status == NOT_RUN:
            ElementTree.SubElement(case, "skipped", message=_clean(each.found))
            continue
        text = f"found {each.found}; {each.limit_text}"
        if each.override is not None:
            text += f" (the model file's limit: {each.override.reason})"
        if each.status == FAIL:
            failure = ElementTree.SubElement(case, "failure", message=_clean(text), type="rule")
            failure.text = _clean(f"{each.rule.title}\n{each.do}")
        else:
            ElementTree.SubElement(case, "system-out").text = _clean(text)
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    xml = ElementTree.tostring(suites, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{xml}\n'


def _clean(text: str) -> str:
    """XML 1.0, production 2."""
    return re.sub("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "?", text)


def table(scope: Scope) -> str:
    """The rules of one scope as docs/rules.md holds them, in the order of the list."""
    rows = [_row(rule) for rule in RULES if rule.scope == scope]
    head = ["| id | what is found | limit | source |", "|---|---|---|---|"]
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
    cells = (f"`{rule.id}`", f"{rule.title}{unit}", limit, rule.source)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
