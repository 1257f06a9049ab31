"""How many members of each population a run tests: a run that looks for new failures has more than
CI, and the quick tests have fewer."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import pytest
from _pytest.mark import ParameterSet

EXPLORING = os.environ.get("HYPOTHESIS_PROFILE") == "explore"
"""CI has the same members in each run: what they show once, they show again."""


def seeds(few: int) -> range:
    """Of a drawn population: so many members, ten times as many to look for new failures."""
    return range(10 * few if EXPLORING else few)


def quick(members: Iterable[Any], count: int = 1) -> list[Any]:
    """Values of a test's parameters, of which all but the first are among the slow tests. A tuple
    is of several parameters; where it is the value of one, it stands in ``pytest.param``."""
    out: list[Any] = []
    for number, member in enumerate(members):
        if not isinstance(member, ParameterSet):
            member = pytest.param(*(member if isinstance(member, tuple) else (member,)))
        more = () if number < count else (pytest.mark.slow,)
        out.append(member._replace(marks=(*member.marks, *more)))
    return out
