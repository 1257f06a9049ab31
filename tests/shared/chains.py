"""Chains of masses between two walls, with clearances, and circuits of them for boards.

The values of their parts can be bought and keep no equation: boards, drawings and packages are what
the circuits are for.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from designer.circuit import build
from designer.circuit.dead_zone_parts import Kind, dead_zone_stage
from designer.circuit.netlist import Circuit
from designer.model.circuit_table import CircuitSpec
from designer.model.mechanics import MechanicalModel
from designer.model.model_file import parse_model_file
from tests.shared.stages import CATALOG, SATURATION, SUPPLY


class AnyValue(dict[str, float]):
    """10 nF for every capacitor, 10 kΩ for every resistor that has no value of its own."""

    def __missing__(self, name: str) -> float:
        return 10e-9 if name.startswith("C") else 10e3


def table(kind: str, **keys: Any) -> str:
    """A table of a model file."""
    lines = [f"{key} = {list(v) if isinstance(v, tuple) else v!r}" for key, v in keys.items()]
    return "\n".join([f"[[{kind}]]", *lines, ""])


def chain_text(masses: int, *more: str) -> str:
    """The model file of masses m1, m2, … with a spring and a damper before, between and behind
    them, a force on the first, and further tables."""
    names = ["ground", *(f"m{i + 1}" for i in range(masses)), "ground"]
    tables = [table("mass", name=name, mass=1.0) for name in names[1:-1]]
    for pair in pairwise(names):
        tables.append(table("spring", between=pair, stiffness=1.0))
        tables.append(table("damper", between=pair, damping=0.1))
    force = () if "[[force]]" in "".join(more) else (table("force", on="m1", amplitude=1.0),)
    return "\n".join(['format = 2\ntitle = "a chain"\n', *tables, *force, *more])


def chain(masses: int, *more: str) -> MechanicalModel:
    """The model of ``chain_text``."""
    return parse_model_file(chain_text(masses, *more)).model


def chain_circuit(
    model: MechanicalModel,
    kind: Kind = "saturation",
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
    table("clearance", name="A", between=("m1", "ground"), **EVEN),
    table("clearance", name="B", between=("m2", "m3"), **EVEN),
)
"""A clearance to ground and one between two masses, for chains of three masses or more."""
PRELOADED = table("clearance", name="A", between=("m1", "ground"), upper=-0.1, stiffness=4.0)
"""One stop, in contact at rest."""
EVERYTHING = (
    *TWO_GAPS,
    table("clearance", name="C", between=("m4", "ground"), lower=0.3, stiffness=3.0),
    table("force", on="m1", amplitude=1.0, constant=0.2),
    table("force", on="m3", amplitude=-0.5),
)
"""Three clearances of a chain of four masses, a constant force, forces in phase and antiphase."""
