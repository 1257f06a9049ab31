"""What a repair found: choices of upgrades, each with what was promised and what boards show."""

from __future__ import annotations

from dataclasses import dataclass, field

from designer.centering.repair_branch import Refused
from designer.centering.repair_linear_model import LinearModel
from designer.centering.repair_measure import MeasuredYield
from designer.centering.repair_upgrade import Upgrades
from designer.check.synthesis_result import Synthesis


@dataclass(frozen=True)
class Trial:
    """A choice of upgrades, what was promised and what fresh boards show."""

    branch: str
    upgrades: Upgrades
    """Upgrades that were chosen."""
    price: float
    """Price over the design as it is [euro]."""
    predicted: tuple[float, ...]
    """Yield that was predicted, by response."""
    measured: tuple[MeasuredYield, ...]
    """Yield that fresh boards show, by response."""
    target: float
    """Yield that is wanted of every response."""

    @property
    def worst(self) -> MeasuredYield:
        """The yield of the response that the fewest boards show."""
        return min(self.measured, key=lambda m: (m.rate, m.interval))

    @property
    def reached(self) -> bool:
        return all(m.reached for m in self.measured)


@dataclass(frozen=True)
class Repair:
    """What was found."""

    base: Synthesis
    """The design as it is."""
    target: float
    """Yield that is wanted of every response."""
    budget: float | None
    """Largest price that is allowed [euro]; None for none."""
    before: Trial
    """What boards of the design as it is show."""
    rounds: tuple[Trial, ...]
    """Each choice against its measurement, the last the answer's where ``reached``."""
    reached: bool
    """Whether every response has the yield that is wanted."""
    why: str
    """Why the search for upgrades ended."""
    limits: tuple[str, ...]
    """What stands in the way of each response, or would come first."""
    front: tuple[Trial, ...]
    """Trials by price."""
    refused: tuple[Refused, ...] = ()
    """Branches that cannot be built."""
    pictures: tuple[LinearModel, ...] = field(default=(), repr=False)
    """Pictures of the branches that were looked at."""

    @property
    def best(self) -> Trial:
        """The answer; where the target was not reached, the trial with the highest worst yield."""
        if self.reached:
            return self.rounds[-1] if self.rounds else self.before
        return max((self.before, *self.rounds), key=lambda t: (t.worst.rate, -t.price))
