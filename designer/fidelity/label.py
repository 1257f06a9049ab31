"""Which response of a design is meant: two may share ω, or even ω and b, so its number leads."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from designer.model.find_responses import ModelResponse


@dataclass(frozen=True)
class ResponseLabel:
    """Which wanted response of the model file."""

    number: int
    """Number in the order of the model file, from 1."""
    omega: float
    """Dimensionless frequency."""
    b: float
    """Dimensionless clearance."""
    expected: str | None
    """The wanted n-p-q; None where any was."""

    @classmethod
    def of(cls, number: int, response: ModelResponse) -> ResponseLabel:
        """The label of response number ``number``."""
        return cls(number, response.omega, response.b, response.expected)

    def as_dict(self) -> dict[str, Any]:
        """``number``, ``omega``, ``b`` and ``expected``."""
        return asdict(self)
