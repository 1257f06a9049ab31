"""Whether a run looks for new failures, with more members of each population than CI has."""

from __future__ import annotations

import os

EXPLORING = os.environ.get("HYPOTHESIS_PROFILE") == "explore"
"""CI has the same members in each run: what they show once, they show again."""


def seeds(few: int) -> range:
    """Of a drawn population: so many members, ten times as many to look for new failures."""
    return range(10 * few if EXPLORING else few)
