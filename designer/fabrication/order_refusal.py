"""Why a board is not sent to a fab: rules that fail, and what nobody has checked."""

from __future__ import annotations

from collections.abc import Sequence

from designer.catalog.design_rule import FAIL, NOT_RUN, PASS, RuleOutcome
from designer.design_rules.kicad_drc import OPEN, SHORT

WANTED = (OPEN, SHORT)
"""Rules that have to be run and passed; any other may stay without a run."""


def refusals(outcomes: Sequence[RuleOutcome]) -> tuple[str, ...]:
    """A line for each reason against an order; none where it may be sent."""
    return tuple(
        f"{one.rule.id}: {one.found}; {one.rule.do}"
        for one in outcomes
        if one.status == FAIL or (one.rule.id in WANTED and one.status != PASS)
    )


def not_checked(outcomes: Sequence[RuleOutcome]) -> tuple[str, ...]:
    """A line for each rule that was not run, with the reason."""
    return tuple(f"{one.rule.id}: {one.found}" for one in outcomes if one.status == NOT_RUN)
