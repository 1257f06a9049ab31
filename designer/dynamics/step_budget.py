"""How much work a computation may take, counted in steps: never by a clock.

A count is the same on every machine, so an answer that was cut short is cut at the same place. A
step is one of the general kernel, some 0.05 to 0.3 µs; the fast paths are charged by what they
take of it.
"""

from __future__ import annotations

from dataclasses import dataclass

RUN = 200_000_000
"""Steps of one run of a flow that nobody limits: some ten seconds and more of compiled work."""
SETTLING = 20_000_000
"""Steps that settling one start may take: one to four seconds."""
STARTS = 20_000_000
"""Steps that all starts together may take that are tried for one response."""


@dataclass
class Budget:
    """Work that a computation may take."""

    left: float = RUN
    """Steps that may still be taken; below 0 where the last run of a fast path took more."""
    spent: float = 0.0
    """Steps that were taken."""

    def take(self, steps: float) -> None:
        """Count these."""
        self.left -= steps
        self.spent += steps
