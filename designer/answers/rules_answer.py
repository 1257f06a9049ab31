"""The answer of ``rules``, which ``rules.json`` holds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NotRequired

from typing_extensions import TypedDict

from designer.answers.design_answer import RuleRow, RuleShown
from designer.answers.shared_rows import ProvenanceRow, Seconds

RuleCounts = TypedDict("RuleCounts", {"pass": int, "fail": int, "not run": int})


class RulesKeys(TypedDict):
    board: str | None
    counts: RuleCounts


class RulesShown(RulesKeys):
    """What a report shows of the rules, of earlier versions too."""

    rules: Sequence[RuleShown]


class RulesJson(RulesKeys):
    """What ``rules`` prints and ``rules.json`` holds."""

    format: int
    title: str
    complete: bool
    rules: Sequence[RuleRow]
    provenance: ProvenanceRow
    cost: Seconds
    not_stored: NotRequired[str]
