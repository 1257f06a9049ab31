"""How far a generator is turned from what ``setup.csv`` says, for one board, and the DC offset that
puts the board's rest point where the nominal board has it.

Input offsets, bias currents and unequal output limits push the displacement at rest towards one
stop, or shift the stops: inside the clearance all of them act as one constant force. A DC offset of
the generator is another constant force, so one setting takes them away together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.circuit.netlist import Excitation
from designer.dynamics.piecewise_linear import PiecewiseLinearSystem
from designer.model.tuning_bands import Bands


@dataclass(frozen=True)
class Adjustment:
    """Changes of the generator's setting, as fractions of what ``setup.csv`` says."""

    frequency: float = 0.0
    """Over the frequency."""
    amplitude: float = 0.0
    """Over the amplitude, of both channels where there are two."""
    offset: float = 0.0
    """The DC offset, over the amplitude."""

    def of(self, excitation: Excitation) -> Excitation:
        """The generator's setting after the change."""
        return replace(
            excitation.louder(1.0 + self.amplitude),
            frequency=excitation.frequency * (1.0 + self.frequency),
            offset=excitation.offset + self.offset * excitation.amplitude,
        )

    @property
    def vector(self) -> Array:
        """(3,) frequency, amplitude, offset."""
        return np.array([self.frequency, self.amplitude, self.offset])

    @classmethod
    def at(cls, vector: Array, bands: Bands) -> Adjustment:
        """The nearest one inside the bands to frequency, amplitude, offset (3,)."""
        width = widths(bands)
        return cls(*np.clip(vector, -width, width).tolist())


AS_BUILT = Adjustment()


def widths(bands: Bands) -> Array:
    """(3,) half-widths of the bands of frequency, amplitude and offset."""
    return np.array([bands.frequency, bands.amplitude, bands.offset])


def rest_distances(system: PiecewiseLinearSystem) -> tuple[Array, Array]:
    """How far past each stop the system is at rest, and what one volt of DC adds to that.

    Rows of the clearances in order, upper stop before lower: two arrays (stops,), negative where
    rest lies inside the clearance, in units of the displacement.

    Raises
    ------
    np.linalg.LinAlgError : the system has no rest point inside the clearance.
    """
    mode = system.mode(system.start)
    per_volt, at_zero = np.linalg.solve(mode.A, -np.stack([mode.B, mode.d], axis=1)).T
    distances, slopes = [], []
    for clearance in range(len(system.clearances)):
        rows = system.contact_rows(clearance)
        for side in sorted(rows, reverse=True):
            C, D, e = rows[side][:-2], rows[side][-2], rows[side][-1]
            distances.append(float(C @ at_zero + e))
            slopes.append(float(C @ per_volt + D))
    return np.array(distances), np.array(slopes)


def centring_offset(board: PiecewiseLinearSystem, nominal: PiecewiseLinearSystem) -> float:
    """DC offset of the generator [V] that brings the board's distances at rest nearest to the
    nominal board's (least squares over the stops); 0 where there is no stop or no rest point.

    With two stops this centres the board; with one it restores the distance to it.
    """
    try:
        wanted, _ = rest_distances(nominal)
        distances, slopes = rest_distances(board)
    except np.linalg.LinAlgError:
        return 0.0
    weight = float(slopes @ slopes)
    if distances.shape != wanted.shape or weight == 0.0:
        return 0.0
    offset = -float(slopes @ (distances - wanted)) / weight
    return offset if np.isfinite(offset) else 0.0
