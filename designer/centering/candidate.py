"""What a search finds on its way: candidates, which of two is better, what a lever is worth."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.stats import norm

from designer.centering.levers import DesignChoice
from designer.centering.ngspice_check import Agreement
from designer.centering.places import Scored
from designer.centering.windows import Stretch
from designer.check.synthesis_result import Synthesis
from designer.circuit.design import Design
from designer.model.find_responses import ModelResponse
from designer.model.response_table import Response

MISSING = -30.0
"""Standard deviations, further than any response that is there may stand."""
ALIKE = 0.05
"""Standard deviations: distances that differ by less are equal; so few boards tell no more."""
GAIN = 1e-3
"""Of the product of the predicted yields: what is worth moving a lever for."""


@dataclass(frozen=True)
class Candidate:
    """A design with its responses at their places, and what boards of it showed.

    scored : by response.
    """

    choice: DesignChoice
    design: Design
    found: tuple[ModelResponse, ...]
    scored: tuple[Scored, ...]

    @property
    def distances(self) -> tuple[float, ...]:
        return tuple(s.distance for s in self.scored)

    @property
    def shown_at(self) -> tuple[Response, ...]:
        """Each response with its place."""
        return tuple(r.spec for r in self.found)

    @property
    def rank(self) -> tuple[float, float]:
        """The smallest distance; the logarithm of the product of the predicted yields, in which a
        response that the nominal board does not show counts as one ``MISSING`` away."""
        logs = [float(norm.logcdf(max(d, MISSING))) for d in self.distances]
        return min(self.distances), sum(logs)


@dataclass(frozen=True)
class Step:
    """A lever that was tried. setting : where it was put. rank : of the design then; None where
    there is none, for the reason given. kept : whether it stayed there."""

    lever: str
    setting: str
    rank: tuple[float, float] | None
    kept: bool
    reason: str = ""


@dataclass(frozen=True)
class Contribution:
    """What a lever is worth. alone : rank of the match design with this lever moved; without : of
    the final design with it moved back; None where there is no such design. by : who moved it:
    the ``exact`` circuit's boards, or ``ngspice``, whose reason no exact distance shows."""

    lever: str
    start: str
    final: str
    alone: tuple[float, float] | None
    without: tuple[float, float] | None
    by: str = "exact"


@dataclass(frozen=True)
class Listened:
    """What ngspice said of a design, by response. frequency : at ω = 1 [Hz]. kept : whether this
    design was taken."""

    frequency: float
    agreements: tuple[Agreement, ...]
    kept: bool


@dataclass(frozen=True)
class Searched:
    """What a search found.

    made : the design with its resolved model file. start : the match design with every response
    in the middle of its widest stretch. final : what was found, as it was predicted. heard : of
    ngspice, about it and slower ones; empty where none was asked.
    candidates : designs; places : that were asked.
    """

    made: Synthesis
    start: Candidate | None
    final: Candidate
    steps: tuple[Step, ...]
    contributions: tuple[Contribution, ...]
    heard: tuple[Listened, ...]
    windows: tuple[tuple[Stretch, ...], ...]
    candidates: int
    places: int
    seed: int


def better(rank: tuple[float, float], than: tuple[float, float]) -> bool:
    """Whether a design of this rank (``Candidate.rank``) is to take the place of another.

    Where both lack a response, the sum decides, which counts what they lack.
    """
    if rank[0] != than[0] and not abs(rank[0] - than[0]) <= ALIKE:
        return rank[0] > than[0]
    return rank[1] - than[1] > GAIN
