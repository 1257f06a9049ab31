"""All wanted responses on one board: the same parts for all, the generator's settings its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from typing import Protocol

from designer.yields.verdict import Verdict, Yield


class JudgedSample(Protocol):
    """A verdict on one response of one sample: as built, tuned or reached."""

    @property
    def sample(self) -> int: ...

    @property
    def verdict(self) -> Verdict: ...


WORST_FIRST = (Verdict.LOST, Verdict.GRAZING, Verdict.FAILED, Verdict.OK)
"""What decides for a board: one response lost is one too many, whatever the others are."""


def all_on_one(rows: Iterable[JudgedSample], census: bool = False) -> Yield:
    """Boards by the worst verdict among their rows, which hold every wanted response once.

    census : see ``Yield``.
    """
    boards: dict[int, set[Verdict]] = {}
    for row in rows:
        boards.setdefault(row.sample, set()).add(row.verdict)
    tally = Counter(worst(met) for met in boards.values())
    return Yield(
        tally[Verdict.OK],
        tally[Verdict.LOST],
        tally[Verdict.GRAZING],
        tally[Verdict.FAILED],
        census=census,
    )


def worst(verdicts: Collection[Verdict]) -> Verdict:
    """What becomes of a board with these verdicts."""
    return next(v for v in WORST_FIRST if v in verdicts)
