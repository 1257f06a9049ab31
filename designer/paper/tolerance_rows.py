"""The rows of the paper's tolerance report."""

from __future__ import annotations

from dataclasses import dataclass

from designer.yields.verdict import Yield


@dataclass(frozen=True)
class YieldRow:
    """The yield of one response in one case."""

    circuit: str
    """Name of the circuit."""
    resistor: float
    """Grade of the resistors, a fraction."""
    capacitor: float
    """Grade of the capacitors, a fraction."""
    offsets: bool
    """Whether the op-amps have offsets."""
    expect: str
    """The wanted response, such as "1-3-3"."""
    omega: float
    """Dimensionless frequency."""
    kind: str
    """Kind of the yield, one of ``KINDS``."""
    there: bool
    """Whether the nominal circuit shows it; where it does not every count is 0."""
    ok: int
    """Boards that keep the response."""
    lost: int
    """Boards that lose the response."""
    grazing: int
    """Boards whose count of impacts is undecided."""
    failed: int
    """Boards without an answer."""

    @property
    def counted(self) -> Yield:
        return Yield(self.ok, self.lost, self.grazing, self.failed)
