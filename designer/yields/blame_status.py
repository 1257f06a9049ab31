"""How much of a study's blame there is, in words for its answer, its page and the terminal."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from designer.yields.blame_analysis import Blame


class BlameStage(StrEnum):
    """How far a blame is."""

    WHOLE = "whole"
    PART = "part"
    NOT_YET = "not done yet"
    LEFT_OUT = "left out"


@dataclass(frozen=True)
class BlameStatus:
    """How much of a study's blame there is."""

    stage: BlameStage
    """How far the blame is."""
    share: float
    """Share of the whole work that was done."""
    budget: int | None
    """Steps that were allowed, None where all were."""
    reason: str
    """Why there is no blame, or not all of it; "" where it is whole."""

    @classmethod
    def of(cls, blame: Blame | None, wanted: bool = True) -> BlameStatus:
        """Of what a study has. wanted : whether a blame was asked for."""
        if blame is None and not wanted:
            return cls(BlameStage.LEFT_OUT, 0.0, None, "it was not asked for")
        if blame is None:
            reason = "the yields stand without it; it is worked out after them"
            return cls(BlameStage.NOT_YET, 0.0, None, reason)
        if blame.share >= 1.0:
            return cls(BlameStage.WHOLE, 1.0, blame.budget, "")
        reason = (
            f"{100.0 * blame.share:.0f} % of its work fits into {blame.budget} steps, so fewer "
            "boards were replayed and followed than without a budget"
        )
        return cls(BlameStage.PART, blame.share, blame.budget, reason)

    @property
    def sentence(self) -> str:
        """For people; "" where the blame is whole."""
        if self.stage is BlameStage.WHOLE:
            return ""
        if self.stage is BlameStage.PART:
            return f"Blame, in part: {self.reason}."
        return f"Blame {self.stage}: {self.reason}."

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "status": str(self.stage),
            "share": self.share,
            "budget": self.budget,
            "reason": self.reason,
        }
