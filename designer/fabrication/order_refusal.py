"""Why a board is not sent to a fab: rules that fail, and what nobody has checked."""

from __future__ import annotations

from collections.abc import Sequence

from designer.base.errors import InputError
from designer.base.schema import one_of
from designer.catalog.design_rule import FAIL, NOT_RUN, PASS, RuleOutcome
from designer.catalog.design_rules import RULES
from designer.design_rules.kicad_drc import OPEN, SHORT

WANTED = (OPEN, SHORT)
"""Rules that have to be run and passed; any other may stay without a run."""


def check_accepted(names: Sequence[str]) -> None:
    """Whether these are rules whose failure may be accepted.

    Raises
    ------
    InputError : no such rule, or one without which no board works.
    """
    known = [rule.id for rule in RULES if rule.id not in WANTED]
    for name in names:
        if name not in known:
            raise InputError(None, "--accept", name, one_of(name, known))


def refusals(outcomes: Sequence[RuleOutcome], accepted: Sequence[str] = ()) -> tuple[str, ...]:
    """A line for each reason against an order; none where it may be sent.

    accepted : rules that may fail.
    """
    return tuple(
        f"{one.rule.id}: {one.found}; {one.do}"
        for one in outcomes
        if (one.status == FAIL and one.rule.id not in accepted)
        or (one.rule.id in WANTED and one.status != PASS)
    )


def read_back(faults: Sequence[str]) -> tuple[str, ...]:
    """A line for each fault that an order's files had when they were read back."""
    do = "fill the zones anew, mend the board, and run export --fab again"
    return tuple(f"order-files: {fault}; {do}" for fault in faults)


def accepted_failures(outcomes: Sequence[RuleOutcome], accepted: Sequence[str]) -> tuple[str, ...]:
    """A line for each rule that fails and is accepted."""
    return tuple(
        f"{one.rule.id}: {one.found}"
        for one in outcomes
        if one.status == FAIL and one.rule.id in accepted
    )


def not_checked(outcomes: Sequence[RuleOutcome]) -> tuple[str, ...]:
    """A line for each rule that was not run, with the reason."""
    return tuple(f"{one.rule.id}: {one.found}" for one in outcomes if one.status == NOT_RUN)
