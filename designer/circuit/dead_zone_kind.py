"""Which dead-zone stage a circuit has: its kind, its sides, its diodes and references."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from designer.catalog.catalog import Catalog
from designer.catalog.entries import DiodeEntry, ReferenceEntry

Kind = Literal["saturation", "rectifier"]
Sides = Literal["both", "upper", "lower"]

DIODE, REFERENCE = "1N4148", "LM4040C50"
"""What a rectifier is made of where nothing else is said."""


@dataclass(frozen=True)
class Zone:
    """The stage that makes the dead zone."""

    kind: Kind = "saturation"
    """"saturation", the paper's stage that clips, or "rectifier", whose dead zone is flat."""
    sides: Sides = "both"
    """The stops that exist."""
    diode: DiodeEntry | None = None
    """The rectifier's diode; None for the other kind."""
    reference: ReferenceEntry | None = None
    """The rectifier's reference; None for the other kind."""

    @property
    def positions(self) -> tuple[int, ...]:
        """1 for the upper stop, -1 for the lower."""
        return {"both": (1, -1), "upper": (1,), "lower": (-1,)}[self.sides]


def zone_of(
    kind: Kind, sides: Sides, catalog: Catalog, diode: str = DIODE, reference: str = REFERENCE
) -> Zone:
    """The stage with the parts of these names.

    Raises
    ------
    InputError : the catalogue has no such diode or reference.
    """
    if kind == "saturation":
        return Zone(kind, sides)
    return Zone(kind, sides, catalog.diode(diode), catalog.reference(reference))
