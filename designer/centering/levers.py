"""What a search moves beside the places: op-amp, dead zone, and what the synthesis aims at."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from designer.base.errors import InputError
from designer.catalog.parts_catalog import Catalog
from designer.circuit.dead_zone_parts import stage_kind
from designer.model.circuit_table import CircuitSpec, DeadZone
from designer.model.model_file import ModelFile
from designer.synthesis.limits import NO_AIMS, Aims
from designer.synthesis.part_checks import stage_refusal

PLACES, TOPOLOGY = "places", "opamp and dead zone"
LEVERS = ("opamp", "dead zone", "amplitude", "state scales", "noise gain", "time scale")
"""In the order in which they are tried."""
SWINGS = (0.85, 0.7, 0.5)
"""Of the op-amps' limits: what the peaks may use, so the threshold in volts follows."""
SHARES = (1.6, 1.2, 1.0)
"""Peaks of the other states over x1's."""
NOISE_GAINS = (30.0, 6.0)
"""Of the stages whose gain is a ratio of resistors."""


@dataclass(frozen=True)
class DesignChoice:
    """How a design is made."""

    opamp: str
    """Name of the op-amp."""
    dead_zone: DeadZone
    """Kind of the dead-zone stage."""
    frequency: tuple[float, float]
    """Band for the frequency of ω = 1 [Hz]."""
    aims: Aims = NO_AIMS
    """What is aimed at inside the side conditions."""

    @classmethod
    def of(cls, modelfile: ModelFile) -> DesignChoice:
        """What the model file says; a stage that it does not state is one that it can have."""
        spec = modelfile.circuit
        kind = stage_kind(spec, modelfile.model.second_order().dead_zones)
        return cls(spec.opamp, kind, spec.frequency)

    def spec(self, base: CircuitSpec) -> CircuitSpec:
        """The table ``[circuit]`` of a design made so; the match decides over its parts."""
        return replace(
            base,
            objective="match" if base.objective == "match" else "margin",
            opamp=self.opamp,
            # A saturation that is stated belongs to the op-amp that it is stated for.
            saturation=base.saturation if self.opamp == base.opamp else None,
            dead_zone=self.dead_zone,
            frequency=self.frequency,
        )

    def get(self, lever: str) -> object:
        """What it says of one of the ``LEVERS``."""
        return {
            "opamp": self.opamp,
            "dead zone": self.dead_zone,
            "amplitude": self.aims.swing,
            "state scales": self.aims.share,
            "noise gain": self.aims.noise_gain,
            "time scale": self.frequency,
        }[lever]

    def with_lever(self, lever: str, value: Any) -> DesignChoice:
        """The same with one lever elsewhere."""
        field = {"amplitude": "swing", "state scales": "share", "noise gain": "noise_gain"}
        if lever in field:
            changed: dict[str, Any] = {field[lever]: value}
            return replace(self, aims=replace(self.aims, **changed))
        name = {"opamp": "opamp", "dead zone": "dead_zone", "time scale": "frequency"}[lever]
        moved: dict[str, Any] = {name: value}
        return replace(self, **moved)


def topologies(modelfile: ModelFile, catalog: Catalog) -> list[DesignChoice]:
    """Every op-amp with every dead zone that the search may take and that makes the model's
    clearances, the file's own first if it is one of them; with every dead zone if none makes them.

    Raises
    ------
    InputError : an op-amp that the catalogue does not have.
    """
    file_choice, spec = DesignChoice.of(modelfile), modelfile.search
    for name in spec.opamps:
        try:
            catalog.opamp(name, modelfile.circuit.supply)
        except InputError as error:
            field = "search.opamps" if error.field == "circuit.opamp" else error.field
            raise InputError(None, field, error.found, error.expected) from None
    opamps = spec.opamps or (file_choice.opamp,)
    dead_zones = modelfile.model.second_order().dead_zones
    able = [zone for zone in spec.dead_zones if stage_refusal(dead_zones, zone) is None]
    choices = [
        replace(file_choice, opamp=opamp, dead_zone=zone)
        for opamp in opamps
        for zone in able or spec.dead_zones
    ]
    return sorted(choices, key=lambda choice: choice != file_choice)


def variants(choice: DesignChoice, lever: str) -> Iterator[DesignChoice]:
    """The other settings of one of the levers after the dead zone."""
    low, high = choice.frequency
    ratio = (high / low) ** (1.0 / 3.0)
    options: dict[str, tuple[object, ...]] = {
        "amplitude": SWINGS,
        "state scales": SHARES,
        "noise gain": NOISE_GAINS,
        "time scale": tuple((low * ratio**k, low * ratio ** (k + 1)) for k in range(3)),
    }
    for value in options[lever]:
        if value != choice.get(lever):
            yield choice.with_lever(lever, value)


def slower(choice: DesignChoice, frequency: float, low: float) -> Iterator[DesignChoice]:
    """The same with the model's own frequency at half of ``frequency`` [Hz], a quarter, and so on,
    not below ``low``."""
    high = frequency / 2.0
    while high > low * math.sqrt(2.0):
        yield replace(choice, frequency=(high / math.sqrt(2.0), high))
        high /= 2.0
