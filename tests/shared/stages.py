"""Dead-zone stages sized by hand, around the linear block that is exact for the paper's case."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from designer.catalog.parts_catalog import load_catalog
from designer.circuit import build
from designer.circuit.dead_zone_parts import dead_zone_stage
from designer.circuit.netlist import Circuit
from designer.circuit.resistors import Composite
from designer.model.circuit_table import CircuitSpec, DeadZone
from designer.model.clearance import Sides
from designer.model.model import Dimensionless
from tests.circuit.test_reduction import EXACT

CATALOG = load_catalog()
SUPPLY, SATURATION, VREF = 15.0, 13.0, 5.0
PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
LINEAR = {n: v for n, v in EXACT.items() if not n.startswith(("R2", "R50")) or len(n) == 2}


def rectifier(threshold: float = 2.0, sides: Sides = "both") -> dict[str, float]:
    """Exact for the paper's case: slope of fv 2.49, R50 = slope · R4/μ, threshold [V]."""
    level = 10e3 * VREF / threshold
    values = {
        "R200": 10e3, "R201": level, "R202": 24.9e3, "R206": 2.2e3, "R208": level,
        "R203": 10e3, "R204": level, "R205": 24.9e3, "R207": 2.2e3, "R209": level,
    }  # fmt: skip
    return {**LINEAR, "R50": 2.49 * LINEAR["R4"] / PAPER.mu, **values}


def one_sided(threshold: float = 0.6, free: float = 11.0) -> dict[str, float]:
    """A saturating stage with one stop, exact for the paper's case: U3C is linear from
    ``threshold`` at the stop to ``free`` at the other end [V]; slope of fv 1."""
    steep = 2.0 * SATURATION / (threshold + free)  # A+
    shift = (free - threshold) / 2.0  # constant at the input of the steep path [V]
    loaded = 1.0 / (1.0 / 10e3 + 1.0 / 100e3)
    return {
        **LINEAR,
        "R50": LINEAR["R4"] / PAPER.mu,
        "R200": 10e3, "R201": 10e3, "R202": 10e3, "R203": 10e3 * steep,
        "R204": loaded * (steep - 1.0), "R205": 10e3, "R206": 10e3, "R207": 10e3,
        "R208": 100e3, "R209": 100e3, "R210": 100e3,
        "R211": 10e3 * SUPPLY / shift, "R212": 100e3 * SUPPLY / shift,
    }  # fmt: skip


def bought(values: Mapping[str, float]) -> dict[str, float]:
    """The nearest resistors that can be bought."""
    sold = CATALOG.values("resistor", ["E96", "E24"], 1e3, 1e6, 0.01)
    return {
        n: v if n[0] == "C" else float(sold[np.argmin(np.abs(np.log(sold / v)))])
        for n, v in values.items()
    }


def stage(
    kind: DeadZone,
    sides: Sides,
    values: Mapping[str, float],
    composites: Mapping[str, Composite] | None = None,
    f20: float = 0.0,
    opamp: str = "TL074C",
) -> Circuit:
    """The paper's circuit around one of the stages."""
    wanted = model(sides, f20)
    return build.circuit_of(
        wanted,
        values,
        CATALOG.opamp(opamp),
        supply=SUPPLY,
        saturation=SATURATION,
        stage=dead_zone_stage(wanted, CircuitSpec(dead_zone=kind), CATALOG),
        composites=composites or {},
    )


def model(sides: Sides = "both", f20: float = 0.0) -> Dimensionless:
    return Dimensionless(PAPER.m, PAPER.k, PAPER.k0, PAPER.c, PAPER.zeta, f20, PAPER.b, sides)
