"""Every rule on a circuit, each with the function that looks at it, and all of them at once.

Rules on a board stand in ``design_rules.on_board``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from designer.base.progress import doing
from designer.catalog.design_rule import (
    DesignRule,
    Finding,
    NotRun,
    Override,
    RuleOutcome,
    judged,
    not_run,
)
from designer.catalog.design_rules import BY_ID, RULES
from designer.design_rules import on_nets, on_precision, on_ratings
from designer.design_rules.rule_subject import Look, RuleSubject

LOOKS: dict[str, Look] = {**on_nets.LOOKS, **on_ratings.LOOKS, **on_precision.LOOKS}
"""By id, in the order of the list."""


def on_circuit(subject: RuleSubject, overrides: Mapping[str, Override]) -> tuple[RuleOutcome, ...]:
    """Every rule on the circuit, in the order of the list."""
    outcomes = []
    for rule in RULES:
        if rule.scope == "circuit":
            doing(f"design rule {rule.id}")
            outcomes.append(look(rule.id, subject, overrides.get(rule.id)))
    return tuple(outcomes)


def look(id_: str, subject: RuleSubject, override: Override | None = None) -> RuleOutcome:
    """One rule on the circuit; what cannot be looked at is not run, and says why."""
    rule = BY_ID[id_]
    return outcome(rule, lambda: LOOKS[id_](subject), override)


def outcome(
    rule: DesignRule, find: Callable[[], Iterable[Finding]], override: Override | None
) -> RuleOutcome:
    """What a rule says of what ``find`` finds."""
    try:
        return judged(rule, list(find()), override)
    except NotRun as reason:
        return not_run(rule, str(reason), override)
    except ArithmeticError as error:
        return not_run(rule, f"no answer: {error}", override)
