"""What a tolerance study has beside its answers as built, as a report sees it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from designer.yields.blame_analysis import Blame
from designer.yields.blame_status import BlameStatus
from designer.yields.verdict import Verdict
from designer.yields.yield_maps import YieldMap


class LayerRow(Protocol):
    """A row of a layer: one board of one question."""

    @property
    def sample(self) -> int: ...
    @property
    def question(self) -> int: ...
    @property
    def verdict(self) -> Verdict: ...


class Benched(LayerRow, Protocol):
    """A row of the tuned layer."""

    @property
    def bench_verdict(self) -> Verdict: ...


class Difference(Protocol):
    """A board on which the engines disagree."""

    @property
    def sample(self) -> int: ...
    @property
    def kind(self) -> str: ...
    @property
    def exact(self) -> str: ...
    @property
    def ngspice(self) -> str: ...
    @property
    def explanation(self) -> str: ...


class Counted(Protocol):
    """A share of boards."""

    @property
    def count(self) -> int: ...
    @property
    def of(self) -> int: ...
    @property
    def interval(self) -> tuple[float, float]: ...


class Both(Protocol):
    """The yield by both engines together."""

    @property
    def estimate(self) -> float: ...
    @property
    def low(self) -> float: ...
    @property
    def high(self) -> float: ...
    @property
    def undecided(self) -> int: ...
    @property
    def if_lost(self) -> float: ...
    @property
    def if_ok(self) -> float: ...
    @property
    def disagreement(self) -> Counted: ...
    @property
    def differences(self) -> Sequence[Difference]: ...


class Start(Protocol):
    """How to switch on so that the response is reached."""

    @property
    def text(self) -> str: ...


@dataclass(frozen=True)
class Layers:
    """What a study has beside its answers as built; empty or None where it was not asked."""

    tuned: Sequence[Benched] | None = None
    """Rows of all questions with the generator tuned."""
    trimmed: Sequence[LayerRow] | None = None
    """Rows of all questions with the trimmer set."""
    reached: Sequence[LayerRow] | None = None
    """Rows of all questions powered up."""
    combined: Sequence[Both | None] = ()
    """Yield by both engines, by response."""
    recipes: Sequence[Start] = ()
    """Recipes of power-up, by question."""
    blame: Blame | None = None
    """The blame of every question."""
    maps: Sequence[YieldMap] = ()
    """Yield maps of the study."""
    status: BlameStatus | None = None
    """How much of the blame there is; None where nobody says."""
