"""Outcomes of rules as a JUnit report, which continuous integration reads."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

from designer.catalog.design_rule import FAIL, NOT_RUN, RuleOutcome


def report(title: str, outcomes: Sequence[RuleOutcome]) -> str:
    """An XML text: one test case a rule; what was not run is skipped, with the reason.

    Characters that XML 1.0 cannot hold become "?".
    """
    count = {status: sum(o.status == status for o in outcomes) for status in (FAIL, NOT_RUN)}
    suite = ElementTree.Element(
        "testsuite",
        name=_clean(f"design rules: {title}"),
        tests=str(len(outcomes)),
        failures=str(count[FAIL]),
        skipped=str(count[NOT_RUN]),
        errors="0",
    )
    for each in outcomes:
        case = ElementTree.SubElement(
            suite, "testcase", classname=f"rules.{each.rule.scope}", name=each.rule.id
        )
        if each.status == NOT_RUN:
            ElementTree.SubElement(case, "skipped", message=_clean(each.found))
            continue
        said = f"found {each.found}; {each.limit_text}"
        if each.override is not None:
            said += f" (the model file's limit: {each.override.reason})"
        if each.status == FAIL:
            failure = ElementTree.SubElement(case, "failure", message=_clean(said), type="rule")
            failure.text = _clean(f"{each.rule.title}\n{each.rule.do}")
        else:
            ElementTree.SubElement(case, "system-out").text = _clean(said)
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    text = ElementTree.tostring(suites, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _clean(text: str) -> str:
    return "".join(ch if _allowed(ord(ch)) else "?" for ch in text)


def _allowed(code: int) -> bool:
    """XML 1.0, production 2."""
    return (
        code in (0x9, 0xA, 0xD)
        or 0x20 <= code <= 0xD7FF
        or 0xE000 <= code <= 0xFFFD
        or 0x10000 <= code <= 0x10FFFF
    )
