"""The diode in series with a rail, which blocks a supply that is connected the wrong way round."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from designer.base.schema import FileTable, line
from designer.catalog import fields
from designer.catalog.entries import BoardEntry, PartCase
from designer.catalog.fields import Figure


@dataclass(frozen=True)
class ForwardDrop(FileTable):
    """The most that a diode drops at a current."""

    current: Annotated[float, fields.positive("A")]
    """The current [A]."""
    voltage: Annotated[float, fields.positive("V")]
    """Largest forward voltage there [V]."""
    source: Annotated[str, line("where the figure comes from")]
    """Where the figure comes from."""


@dataclass(frozen=True, kw_only=True)
class SupplyDiodeEntry(BoardEntry):
    """A diode that carries the current of a rail."""

    drops: tuple[ForwardDrop, ...]
    """Largest forward voltages, in any order of the currents."""
    reverse_voltage: Annotated[Figure, fields.figure("V")]
    """Largest reverse voltage [V]."""
    pins: Annotated[Mapping[str, str], fields.pins("cathode", "anode")] = field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}, hash=False
    )
    """Number of the footprint's pad by name; KiCad's have the cathode at 1."""
    assumed: Annotated[tuple[str, ...], fields.ASSUMED] = ()
    """What could not be compared with a data sheet, in words."""
    cases: tuple[PartCase, ...] = ()
    """Other cases that it is sold in."""

    def drop(self, current: float) -> float | None:
        """Most that it drops [V] at this current [A] and below: that of the next larger current
        that the sheet gives, for the drop grows with the current; None past the largest."""
        return min((d.voltage for d in self.drops if d.current >= current), default=None)
