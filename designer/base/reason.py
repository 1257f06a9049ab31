"""A reason why a result is not to be trusted."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Reason:
    """Why a result is not to be trusted."""

    words: str
    """The reason, without what was measured: two machines say the same."""
    figures: str = ""
    """What was measured, whose last digits two machines do not share; empty where there is none."""

    def __str__(self) -> str:
        return f"{self.words} ({self.figures})" if self.figures else self.words
