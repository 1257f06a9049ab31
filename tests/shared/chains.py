"""Chains of masses between two walls, with clearances, and circuits of them for boards.

The values of their parts can be bought and keep no equation: boards, drawings and packages are what
the circuits are for.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

from designer.circuit import build
from designer.circuit.dead_zone_parts import dead_zone_stage
from designer.circuit.netlist import Circuit
from designer.model.circuit_table import CircuitSpec, DeadZone
from designer.model.mechanics import MechanicalModel
from designer.model.model_file import parse_model_file
from tests.shared.stages import CATALOG, SATURATION, SUPPLY
from tests.shared.system_text import clearance, system_text, table


class AnyValue(dict[str, float]):
    """10 nF for every capacitor, 10 kΩ for every resistor that has no value of its own."""

    def __missing__(self, name: str) -> float:
        return 10e-9 if name.startswith("C") else 10e3


def chain_text(masses: int, *more: str) -> str:
    """The model file of masses m1, m2, … with a spring and a damper before, between and behind
    them, a force on the first, and further tables."""
    names = ["ground", *(f"m{i + 1}" for i in range(masses)), "ground"]
    pairs = list(pairwise(names))
    force = () if "[[force]]" in "".join(more) else (table("force", on="m1", amplitude=1.0),)
    title = 'title = "a chain"\n'
    links = dict.fromkeys(pairs, 1.0), dict.fromkeys(pairs, 0.1)
    text = system_text(dict.fromkeys(names[1:-1], 1.0), *links, *force, *more)
    return text.replace("format = 2\n", f"format = 2\n{title}", 1)


def chain(masses: int, *more: str) -> MechanicalModel:
    """The model of ``chain_text``."""
    return parse_model_file(chain_text(masses, *more)).model


def chain_circuit(
    model: MechanicalModel,
    kind: DeadZone = "saturation",
    opamp: str = "TL074C",
    values: Mapping[str, float] | None = None,
) -> Circuit:
    """The circuit of a model, with values that can be bought."""
    return build.circuit_of(
        model,
        AnyValue(values or {}),
        CATALOG.opamp(opamp),
        supply=SUPPLY,
        saturation=SATURATION,
        stage=dead_zone_stage(model, CircuitSpec(dead_zone=kind), CATALOG),
    )


EVEN = {"upper": 0.5, "lower": 0.5, "stiffness": 5.0}
TWO_GAPS = (
    clearance("A", "m1", "ground", **EVEN),
    clearance("B", "m2", "m3", **EVEN),
)
"""A clearance to ground and one between two masses, for chains of three masses or more."""
PRELOADED = clearance("A", "m1", "ground", upper=-0.1, stiffness=4.0)
"""One stop, in contact at rest."""
EVERYTHING = (
    *TWO_GAPS,
    clearance("C", "m4", "ground", lower=0.3, stiffness=3.0),
    table("force", on="m1", amplitude=1.0, constant=0.2),
    table("force", on="m3", amplitude=-0.5),
)
"""Three clearances of a chain of four masses, a constant force, forces in phase and antiphase."""
