"""What a cure found: choices of upgrades, each with what was promised and what boards show."""

from __future__ import annotations

from dataclasses import dataclass, field

from designer.centering.cure_branch import Refused
from designer.centering.cure_linear_model import LinearModel
from designer.centering.cure_measure import MeasuredYield
from designer.centering.cure_upgrade import Upgrades
from designer.check.synthesis_result import Synthesis


@dataclass(frozen=True)
class Trial:
    """A choice of upgrades, what was promised and what fresh boards show.

    price : over the design as it is [euro]. predicted, measured : by response.
    """

    branch: str
    upgrades: Upgrades
    price: float
    predicted: tuple[float, ...]
    measured: tuple[MeasuredYield, ...]
    target: float

    @property
    def worst(self) -> MeasuredYield:
        """Of the response that the fewest boards show."""
        return min(self.measured, key=lambda m: (m.rate, m.counts.interval))

    @property
    def reached(self) -> bool:
        return all(m.reached for m in self.measured)


@dataclass(frozen=True)
class Cure:
    """What was found.

    before : the design as it is. rounds : each choice against its measurement, the last the
    answer's where ``reached``. limits : by response, what stands in the way or comes first. front :
    trials by price. refused : branches that cannot be built. pictures : of the branches that were
    looked at.
    """

    base: Synthesis
    target: float
    budget: float | None
    before: Trial
    rounds: tuple[Trial, ...]
    reached: bool
    why: str
    limits: tuple[str, ...]
    front: tuple[Trial, ...]
    refused: tuple[Refused, ...] = ()
    pictures: tuple[LinearModel, ...] = field(default=(), repr=False)

    @property
    def best(self) -> Trial:
        """The answer; where the target was not reached, the trial with the highest worst yield."""
        if self.reached:
            return self.rounds[-1] if self.rounds else self.before
        return max((self.before, *self.rounds), key=lambda t: (t.worst.rate, -t.price))
