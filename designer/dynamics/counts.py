"""n-p-q: the period of an orbit and its impacts on each stop (docs/definitions.md)."""

from __future__ import annotations

import re
from dataclasses import dataclass

Pairs = tuple[tuple[int, int], ...]
"""For each clearance the impacts on its upper and on its lower stop."""

MAX_PERIOD = 16
"""Largest n of an n-p-q response, in drive periods (docs/definitions.md)."""
MOST = 9999
"""Largest p or q of a response that can be asked for."""

_NUMBER = r"(?:0|[1-9]\d*)"
_COUNTS = re.compile(rf"([1-9]\d*)-({_NUMBER}-{_NUMBER}(?:;{_NUMBER}-{_NUMBER})*)", re.ASCII)


@dataclass(frozen=True, order=True)
class Counts:
    """An n-p-q response: "1-2-2", or "1-2-2;0-1" where there are two clearances."""

    n: int
    """Least period, in drive periods."""
    impacts: Pairs
    """Impacts on the upper and the lower stop of each clearance, in their order, in n drive
    periods; one pair of zeros for a system without clearances. A stop that is not there has 0."""

    def __str__(self) -> str:
        return f"{self.n}-" + ";".join(f"{p}-{q}" for p, q in self.impacts)

    @classmethod
    def parse(cls, text: str) -> Counts:
        """Read "1-2-2" or "1-2-2;0-1".

        Raises
        ------
        ValueError : n is not 1 to ``MAX_PERIOD``, or another number is not 0 to ``MOST``.
        """
        counts = read_counts(text)
        if counts is None or counts.n > MAX_PERIOD or max(map(max, counts.impacts)) > MOST:
            raise ValueError(f"not n-p-q with n from 1 to {MAX_PERIOD}")
        return counts

    @property
    def p(self) -> int:
        """Impacts on the upper stop of the first clearance."""
        return self.impacts[0][0]

    @property
    def q(self) -> int:
        """Impacts on the lower stop of the first clearance."""
        return self.impacts[0][1]

    @property
    def total(self) -> int:
        """Impacts on all stops."""
        return sum(map(sum, self.impacts))

    @property
    def rates(self) -> tuple[float, ...]:
        """Impacts on each stop in a drive period: upper, lower of each clearance in turn."""
        return tuple(k / self.n for pair in self.impacts for k in pair)

    @property
    def mirrored(self) -> Counts:
        """Those of the mirror twin: upper and lower stops change places."""
        return Counts(self.n, tuple((q, p) for p, q in self.impacts))

    @property
    def symmetric(self) -> bool:
        """Whether they are their mirror twin's too, as those of a symmetric orbit are."""
        return self == self.mirrored

    @property
    def family(self) -> Counts:
        """One and the same for both mirror twins: the lesser of the two."""
        return min(self, self.mirrored)

    @property
    def doubled(self) -> Counts:
        """The same orbit over twice its period: "2-4-4" of "1-2-2"."""
        return Counts(2 * self.n, tuple((2 * p, 2 * q) for p, q in self.impacts))


def period_of(response: str) -> int:
    """n of a response's text; 0 of a status."""
    counts = read_counts(response)
    return 0 if counts is None else counts.n


def read_counts(text: str) -> Counts | None:
    """The counts that a response's text states; None where it is a status, such as "aperiodic"."""
    match = _COUNTS.fullmatch(text)
    if match is None:
        return None
    pairs = (pair.split("-") for pair in match[2].split(";"))
    return Counts(int(match[1]), tuple((int(p), int(q)) for p, q in pairs))
