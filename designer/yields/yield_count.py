"""How many boards keep a response: verdicts counted to a yield with its interval."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from designer.base.proportion import wilson
from designer.verdicts.verdict import Verdict

if TYPE_CHECKING:
    from designer.answers.study_answer import CountKeys

WORST_FIRST = (Verdict.LOST, Verdict.GRAZING, Verdict.FAILED, Verdict.OK)
"""What decides for a board: one response lost is one too many, whatever the others are."""


@dataclass(frozen=True)
class Yield:
    """Counts of boards, with the two-sided 95 % Wilson interval of ok/(samples - failed)."""

    ok: int
    """Boards that keep the response."""
    lost: int
    """Boards that lose the response."""
    grazing: int
    """Boards whose count of impacts is undecided."""
    failed: int
    """Boards without an answer."""
    census: bool = field(default=False, kw_only=True)
    """Whether these are all the boards there are; then the interval is the rate itself."""

    @property
    def samples(self) -> int:
        return self.ok + self.lost + self.grazing + self.failed

    @property
    def rate(self) -> float:
        """nan where nothing was decided."""
        decided = self.samples - self.failed
        return self.ok / decided if decided else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        decided = self.samples - self.failed
        if self.census and decided:
            return self.rate, self.rate
        return wilson(self.ok, decided)

    @property
    def counts(self) -> CountKeys:
        """The counts by the keys of the contract."""
        return {
            "ok": self.ok,
            "lost": self.lost,
            "grazing": self.grazing,
            "failed": self.failed,
            "samples": self.samples,
        }


class JudgedSample(Protocol):
    """A verdict on one response of one sample, such as a `BoardRow`."""

    @property
    def sample(self) -> int: ...
    @property
    def verdict(self) -> Verdict: ...


def count(rows: Iterable[JudgedSample], census: bool = False) -> Yield:
    """The yield of a set of rows of one question. census : see ``Yield``."""
    return count_verdicts((row.verdict for row in rows), census)


def count_verdicts(verdicts: Iterable[Verdict], census: bool = False) -> Yield:
    """The yield of boards with these verdicts. census : see ``Yield``."""
    tally = Counter(verdicts)
    return Yield(
        tally[Verdict.OK],
        tally[Verdict.LOST],
        tally[Verdict.GRAZING],
        tally[Verdict.FAILED],
        census=census,
    )


def all_on_one(rows: Iterable[JudgedSample], census: bool = False) -> Yield:
    """Boards by the worst verdict among their rows, which hold every wanted response once: the
    parts are the same for all, the generator's settings are each response's own.

    census : see ``Yield``.
    """
    boards: dict[int, set[Verdict]] = {}
    for row in rows:
        boards.setdefault(row.sample, set()).add(row.verdict)
    return count_verdicts(map(worst, boards.values()), census)


def worst(verdicts: Collection[Verdict]) -> Verdict:
    """What becomes of a board with these verdicts."""
    return next(v for v in WORST_FIRST if v in verdicts)


def reasons(rows: Iterable[tuple[Verdict, str]]) -> dict[str, int]:
    """How many boards are not ok for the same reason, by "verdict: reason", most frequent first.

    Reasons that differ only in their figures are one.
    """
    counts = Counter(
        f"{verdict}: {_without_figures(reason)}" if reason else str(verdict)
        for verdict, reason in rows
        if verdict is not Verdict.OK
    )
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))


def _without_figures(reason: str) -> str:
    for kind in ("asymmetric", "not found", "not seen"):
        if reason.startswith(f"{kind} "):
            return kind
    return "most settings gave no answer" if reason.endswith("settings gave no answer") else reason
