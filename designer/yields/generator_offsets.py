"""How far a generator is turned from what ``setup.csv`` says, for one board."""

from __future__ import annotations

from dataclasses import dataclass

from designer.circuit.netlist import Excitation
from designer.model.tuning_bands import Bands


@dataclass(frozen=True)
class Adjustment:
    """Changes of the generator's setting, as fractions."""

    frequency: float = 0.0
    """Over the frequency in ``setup.csv``."""
    amplitude: float = 0.0
    """Over the amplitude in ``setup.csv``."""
    offset: float = 0.0
    """The DC offset, over the amplitude in ``setup.csv``."""

    def of(self, excitation: Excitation) -> Excitation:
        """The generator's setting after the change."""
        return Excitation(
            excitation.frequency * (1.0 + self.frequency),
            excitation.amplitude * (1.0 + self.amplitude),
            excitation.offset + self.offset * excitation.amplitude,
        )

    def within(self, bands: Bands) -> Adjustment:
        """The nearest one inside the bands."""

        def cut(value: float, band: float) -> float:
            return min(max(value, -band), band)

        return Adjustment(
            cut(self.frequency, bands.frequency),
            cut(self.amplitude, bands.amplitude),
            cut(self.offset, bands.offset),
        )


AS_BUILT = Adjustment()
