"""The rows of the paper's tolerance report."""

from __future__ import annotations

from dataclasses import dataclass

from designer.yields.verdict import Yield


@dataclass(frozen=True)
class YieldRow:
    """The yield of one response in one case. kind : one of ``KINDS``. expect : "1-3-3". there :
    whether the nominal circuit shows it; where it does not every count is 0."""

    circuit: str
    resistor: float
    capacitor: float
    offsets: bool
    expect: str
    omega: float
    kind: str
    there: bool
    ok: int
    lost: int
    grazing: int
    failed: int

    @property
    def counted(self) -> Yield:
        return Yield(self.ok, self.lost, self.grazing, self.failed)
