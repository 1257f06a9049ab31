"""How far an op-amp's output reaches, by its load: one statement for every fidelity, the synthesis
and the report.

An output at its limit is a voltage behind a resistance, both from the data sheet's swings into
10 kΩ and into 2 kΩ. Beyond 10 kΩ no data sheet has a figure; that Ohm's law goes on is assumed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from designer.base.errors import InputError
from designer.catalog.entries import OpAmp

RATED_LOAD, HEAVY_LOAD = 10e3, 2e3
"""Loads [ohm] that the catalogue's ``swing`` (and ``saturation``) and ``swing_2k`` belong to."""


@dataclass(frozen=True)
class OutputStage:
    """An op-amp's output at its limit, alike at both ends."""

    limit: float
    """Size of the limit about ground [V]."""
    load: float | None
    """The load [ohm] that it is reached into; None: each output's own, whatever that is."""
    resistance: float
    """The resistance by which the limit falls with the current [ohm]."""
    source: str
    """Where the limit is from: "stated", "data sheet" or "assumed"."""

    @classmethod
    def of(cls, opamp: OpAmp | None, limit: float, load: float | None) -> OutputStage:
        """That of an op-amp with this limit [V] into a load [ohm]; a limit whatever the load is a
        stated one. None: of an op-amp without figures, whose limit no load changes."""
        resistance = saturation_resistance(opamp) if opamp is not None else 0.0
        if load is None or opamp is None:
            return cls(limit, load, resistance, "stated")
        return cls(limit, load, resistance, "assumed" if opamp.saturation.assumed else "data sheet")

    def limit_into(self, load: Any) -> Any:
        """The limit [V] of a pin with this load [ohm], a number or an array."""
        if self.load is None:
            return self.limit
        return self.unloaded(self.limit, self.load) / (1.0 + self.resistance / load)

    def unloaded(self, limit: Any, load: Any) -> Any:
        """What a pin that reaches ``limit`` [V] into this load [ohm] would reach without one."""
        return limit * (1.0 + self.resistance / load)


def output_at(opamp: OpAmp, supply: float, stated: float | None = None) -> OutputStage:
    """The output stage of an op-amp at rails of ± ``supply`` [V].

    stated : a limit [V] that takes the place of the data sheet's, as ``circuit.saturation`` of a
    model file does: that of every pin in its circuit. What the load changes of it while the output
    is at the limit is the op-amp's own either way.

    Raises
    ------
    InputError : swings that belong to no resistance.
    """
    if stated is not None:
        return OutputStage.of(opamp, stated, None)
    return OutputStage.of(opamp, opamp.saturation_at(supply), RATED_LOAD)


def saturation_resistance(opamp: OpAmp) -> float:
    """Resistance [Ω] by which the output limit falls from one load to the next.

    From the swing into 10 kΩ and into 2 kΩ. Where the second is not given, assumed: all of the
    distance to the rail at 10 kΩ, but no more than the output resistance.
    """
    light = opamp.saturation.nominal
    if opamp.swing_2k is not None:
        heavy = min(opamp.swing_2k.nominal, light)
        if heavy / HEAVY_LOAD <= light / RATED_LOAD:
            raise InputError(
                None,
                f"opamp {opamp.name}.swing_2k",
                opamp.swing_2k.nominal,
                f"a swing into 2 kΩ with more current than {light:g} V into 10 kΩ",
            )
        return max((light - heavy) / (heavy / HEAVY_LOAD - light / RATED_LOAD), 1e-3)
    headroom = max(opamp.rated_supply - light, 1e-6)
    return min(headroom * RATED_LOAD / light, opamp.output_resistance.nominal)
