"""What the user wants of the parts beyond the smallest error."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Wishes:
    """Conditions and preferences on the values of the parts."""

    matched: tuple[tuple[str, ...], ...] = ()
    """Groups of part names whose values must be equal, such as ("R2", "R3", "R8")."""
    preferred: frozenset[float] = frozenset()
    """Values [ohm or F] that count for nothing where distinct values are counted."""
    most_values: int | None = None
    """Limit on the distinct values, resistors and capacitors together, the preferred ones left out;
    None for no limit."""
    slack: float = 0.0
    """How much the linear block's error may exceed its least in the second stage, which seeks the
    fewest distinct values and then the lowest price."""


NO_WISHES = Wishes()
