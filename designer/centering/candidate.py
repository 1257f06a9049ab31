"""Candidates of a search, which of two is better, and what a lever is worth."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.special import log_ndtr

from designer.centering.levers import DesignChoice
from designer.centering.ngspice_check import Agreement
from designer.centering.operating_points import Scored
from designer.centering.response_windows import Stretch
from designer.check.synthesis_result import Synthesis
from designer.circuit.design import Design
from designer.model.find_responses import ModelResponse
from designer.model.response_table import Response

MISSING = -30.0
"""Standard deviations, further than any response that is there may stand."""
ALIKE = 0.05
"""Standard deviations: reliability indices that differ by less are equal; so few boards tell no
more."""
GAIN = 1e-3
"""The least gain in the product of the predicted yields that is worth moving a lever for."""


@dataclass(frozen=True)
class Candidate:
    """A design with its responses at their places, and what boards of it showed."""

    choice: DesignChoice
    """How the design is made."""
    design: Design
    model_responses: tuple[ModelResponse, ...]
    """The design's responses at their operating points, and what the model shows there."""
    scored: tuple[Scored, ...]
    """The operating point of each response, with what boards showed there."""

    @property
    def reliability_indices(self) -> tuple[float, ...]:
        return tuple(s.reliability_index for s in self.scored)

    @property
    def wanted(self) -> tuple[Response, ...]:
        """Each response with its operating point."""
        return tuple(r.spec for r in self.model_responses)

    @property
    def rank(self) -> tuple[float, float]:
        """The smallest reliability index; the logarithm of the product of the predicted yields, in
        which a response that the nominal board does not show counts as one ``MISSING`` away."""
        logs = [float(log_ndtr(max(d, MISSING))) for d in self.reliability_indices]
        return min(self.reliability_indices), sum(logs)


@dataclass(frozen=True)
class Step:
    """A lever that was tried."""

    lever: str
    setting: str
    """Setting that the lever was put to."""
    rank: tuple[float, float] | None
    """Rank of the design then; None where there is none, for the reason given."""
    adopted: bool
    """Whether the lever stayed at this setting."""
    reason: str = ""
    """Why there is no design."""


@dataclass(frozen=True)
class Contribution:
    """What a lever is worth."""

    lever: str
    start: str
    """Its setting in the match design."""
    final: str
    """Its setting in the final design."""
    alone: tuple[float, float] | None
    """Rank of the match design with this lever moved; None where there is no such design."""
    without: tuple[float, float] | None
    """Rank of the final design with this lever moved back; None where there is no such design."""
    by: str = "exact"
    """Who moved it: the ``exact`` circuit's boards, or op-amps that take time, ``bandwidth`` or
    ``ngspice``, whose reason no reliability index of the exact circuit shows."""


@dataclass(frozen=True)
class FidelityOutcome:
    """How op-amps that take time agree with the exact circuit about a design."""

    fidelity: str
    """Who was asked: the exact circuit with ``bandwidth``, or ngspice's ``dynamic``."""
    frequency: float
    """Frequency at ω = 1 [Hz]."""
    agreements: tuple[Agreement, ...]
    """How many boards show each response on both."""
    adopted: bool = False
    """Whether this design was chosen."""

    @property
    def holds(self) -> bool:
        """Whether no response is shown to be lost."""
        return not any(a.borne_out is False for a in self.agreements)


@dataclass(frozen=True)
class SearchResult:
    """The design that a search chose, and how it came to it."""

    synthesis: Synthesis
    """The design with its resolved model file."""
    start: Candidate | None
    """The match design with every response in the middle of its widest stretch."""
    final: Candidate
    """The chosen design with its predicted yields."""
    steps: tuple[Step, ...]
    """The levers that were tried, in order."""
    contributions: tuple[Contribution, ...]
    """What each lever that moved is worth."""
    checks: tuple[FidelityOutcome, ...]
    """What op-amps that take time make of the design and slower ones, in the order in which they
    were asked; empty where ngspice was not to be asked."""
    windows: tuple[tuple[Stretch, ...], ...]
    """The stretches where the model shows each response."""
    candidates: int
    """Number of designs that were made."""
    places: int
    """Number of operating points at which boards were simulated."""
    seed: int


def better(rank: tuple[float, float], than: tuple[float, float]) -> bool:
    """Whether a design of this rank (``Candidate.rank``) is to take the place of another.

    Where both lack a response, the sum decides, which counts what they lack.
    """
    if rank[0] != than[0] and not abs(rank[0] - than[0]) <= ALIKE:
        return rank[0] > than[0]
    return rank[1] - than[1] > GAIN
