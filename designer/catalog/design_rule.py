"""What a design rule is, what looking at it gives, and what a model file may change about it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from designer.base.units import spaced_quantity

if TYPE_CHECKING:
    from designer.answers.design_answer import RuleRow

Scope = Literal["circuit", "board"]
Status = Literal["pass", "fail", "not run"]
PASS: Status = "pass"
FAIL: Status = "fail"
NOT_RUN: Status = "not run"

ROUNDING = 1e-9
"""Relative tolerance: a limit that is met exactly is kept, whatever the last digit says."""


@dataclass(frozen=True)
class DesignRule:
    """One rule, without the function that looks at it."""

    id: str
    """Its name, in rules.json and in ``[rules.<id>]``."""
    scope: Scope
    """What the rule looks at."""
    title: str
    """What the rule asks for, in a line."""
    unit: str
    """Unit of the limit; "" for a ratio or a count."""
    limit: float | None
    """The number, or None where a data sheet or a table decides; ``limit_is`` then says which."""
    limit_is: str
    """What decides the limit where it is no number."""
    least: bool
    """Whether the limit is from below."""
    source: str
    """Where the limit comes from."""
    do: str
    """What helps where the rule fails."""

    def keeps(self, value: float, limit: float) -> bool:
        """Whether a value is on the right side of a limit; nan is on neither."""
        room = ROUNDING * abs(limit)
        return bool(value >= limit - room) if self.least else bool(value <= limit + room)

    def bound(self, limit: float) -> str:
        """A limit in words."""
        return f"at {'least' if self.least else 'most'} {value_text(limit, self.unit)}"


@dataclass(frozen=True)
class Finding:
    """What a rule found: the worst value, where it is, and the limit that holds there."""

    value: float
    """The worst value, in the rule's unit."""
    where: str = ""
    """The part, net or section that has it."""
    limit: float | None = None
    """The limit that holds here; None takes the rule's own."""
    more: str = ""
    """What else a reader should know."""
    do: str = ""
    """What helps here; "" where that is the rule's own."""


@dataclass(frozen=True)
class Override:
    """``[rules.<id>]`` of a model file: another limit, and why."""

    limit: float
    """The limit that holds instead of the rule's own, in the rule's unit."""
    reason: str
    """Why, in the user's words."""


@dataclass(frozen=True)
class RuleOutcome:
    """A rule and what became of it."""

    rule: DesignRule
    """The rule that was looked at."""
    status: Status
    """Whether it passed, failed or was not run."""
    found: str
    """What was found, in words."""
    value: float = float("nan")
    """The worst value that was found; nan where the rule was not run."""
    limit: float = float("nan")
    """The limit that held; nan where the rule was not run."""
    where: str = ""
    """The part, net or section that has the worst value."""
    override: Override | None = None
    """The model file's limit, where that held."""
    usual: float = field(default=float("nan"))
    """The limit that ``override`` replaces; nan where there is none."""
    own_do: str = ""
    """``Finding.do`` of the worst."""

    def as_dict(self) -> RuleRow:
        """The outcome by the keys of docs/contract.md, and more."""
        changed = self.override is not None
        limit = self.limit_text
        return {
            "id": self.rule.id,
            "status": self.status,
            "found": self.found,
            "limit": limit,
            "source": "the model file" if changed else self.rule.source,
            "do": self.do,
            "scope": self.rule.scope,
            "title": self.rule.title,
            "where": self.where,
            "value": self.value,
            "bound": self.limit,
            "unit": self.rule.unit,
            "reason": self.override.reason if self.override is not None else None,
            "usual_bound": self.usual if changed else None,
        }

    @property
    def do(self) -> str:
        """What helps where the rule fails."""
        return self.own_do or self.rule.do

    @property
    def open(self) -> bool:
        """Whether it could not be looked at, though the design may have what it is of."""
        return self.status == NOT_RUN and self.found != IDLE

    @property
    def limit_text(self) -> str:
        """The limit in words; what decides it where nothing was found."""
        if self.limit == self.limit:
            return self.rule.bound(self.limit)
        if self.rule.limit is not None:
            return self.rule.bound(self.rule.limit)
        return self.rule.limit_is


IDLE = "the design has nothing that this applies to"
"""Why a rule was not run that leaves nothing unknown."""


class NotRun(Exception):
    """A rule cannot be looked at; says why in words. Never a pass."""


def judged(
    rule: DesignRule, findings: Iterable[Finding], override: Override | None = None
) -> RuleOutcome:
    """Pass or fail by the worst of what was found, under the model file's limit or the usual one.

    Raises
    ------
    NotRun : there is nothing that the rule applies to.
    """
    ranked = [(_excess(rule, each, override), each) for each in findings]
    if not ranked:
        raise NotRun(IDLE)
    _, worst = max(ranked, key=lambda pair: pair[0])
    usual = usual_limit(rule, worst)
    limit = usual if override is None else override.limit
    text = value_text(worst.value, rule.unit)
    text += f" at {worst.where}" if worst.where else ""
    text += f"; {worst.more}" if worst.more else ""
    status = PASS if rule.keeps(worst.value, limit) else FAIL
    found = worst.value, limit, worst.where
    return RuleOutcome(rule, status, text, *found, override, usual, worst.do)


def usual_limit(rule: DesignRule, finding: Finding) -> float:
    """The limit of a rule where no model file changes it."""
    limit = finding.limit if finding.limit is not None else rule.limit
    assert limit is not None, f"{rule.id} has no limit"
    return limit


def _excess(rule: DesignRule, finding: Finding, override: Override | None) -> float:
    """How far past its limit, in limits; a value that is no number is the worst."""
    limit = usual_limit(rule, finding) if override is None else override.limit
    over = (limit - finding.value) if rule.least else (finding.value - limit)
    return float("inf") if over != over else over / (abs(limit) or 1.0)


def not_run(rule: DesignRule, why: str, override: Override | None = None) -> RuleOutcome:
    """What a rule says that could not be looked at."""
    limit = float("nan") if override is None else override.limit
    return RuleOutcome(rule, NOT_RUN, why, limit=limit, override=override)


def value_text(value: float, unit: str) -> str:
    """A value with its unit, to three digits, such as "18.5 kHz"."""
    if value != value or abs(value) == float("inf"):
        return "no number"
    if not unit:
        return f"{value:.3g}"
    if unit == "mm":
        return f"{value:.3g} mm"
    return spaced_quantity(value, unit, 3).replace("\u00a0", " ")
