"""The paper's own circuit: its values as printed, the same corrected, and its way for any model.

Sources are equations and sections of Shi and He, "Global bifurcation and circuit simulation of a
soft-impacting system"; what is corrected, and why, stands in docs/errata.md.

As printed means: the circuit of the printed values, driven as Section 5.3 says, with an amplitude
of 1.28 V and f = 357.419 ω. Where the print is inconsistent or silent:

- f20 = 0, so R6 feeds the generator to the mass M1; R12 has no part to play and is not built.
- R100 is missing in the list of the inverters' resistors; it is taken as the other seven.
- Eq. (16) as a formula, ω = π f √…, would give twice the printed number; the number is used.
- R208 = R209 = R210 have no value. Eq. (18) takes the divider as unloaded, which asks for large
  ones: they are taken as 100 kΩ, the largest resistance that the paper uses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.catalog.entries import OpAmp
from designer.catalog.parts_catalog import Catalog
from designer.circuit import build
from designer.circuit.netlist import Circuit
from designer.model.circuit_table import CircuitSpec
from designer.model.mechanics import MechanicalModel
from designer.model.model import Dimensionless

MODEL = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
"""The paper's case, Section 5.1."""
DEAD_ZONE = tuple(f"R{i}" for i in range(200, 211))
"""Fig. 5."""
AS_PRINTED = "paper, as printed"
"""Name of the candidate with the printed values."""
OPAMP, SUPPLY, SATURATION = "TL074C", 15.0, 13.0
"""Section 5.1 and 5.2: op-amp, rails and output limit [V]."""

_SOURCES: dict[str, dict[str, float]] = {
    "Section 5.1, chosen first": {
        "R1": 100e3, "R6": 100e3, "R7": 100e3, "R12": 100e3,
        "C1": 1e-9, "C2": 100e-9, "C3": 1e-9, "C4": 100e-9,
    },
    "Section 5.1, from Eq. (14)": {
        "R2": 22.37e3, "R3": 22.37e3, "R8": 22.37e3, "R4": 20e3, "R5": 20e3, "R10": 20e3,
        "R9": 11.19e3, "R11": 10e3, "R50": 20.88e3,
    },
    "Section 5.1, inverters (R100 is missing in the print)": {
        f"R{i}": 100e3 for i in range(100, 108)
    },
    "Section 5.2, Eq. (18)": {
        "R200": 5e3, "R201": 100e3, "R202": 1e3, "R203": 10.53e3, "R204": 9e3, "R205": 1e3,
    },
    "Section 5.2, Eq. (20)": {"R206": 1e3, "R207": 21.06e3},
    "not given; equal by Eq. (20)": {"R208": 100e3, "R209": 100e3, "R210": 100e3},
}  # fmt: skip
PRINTED: dict[str, float] = {n: v for group in _SOURCES.values() for n, v in group.items()}
"""Ohm and farad by part name, as printed."""
SOURCE: dict[str, str] = {name: where for where, group in _SOURCES.items() for name in group}
"""Where each printed value stands."""
PRINTED_AMPLITUDE = 1.28
"""Eq. (15) [V peak], for b = 0.25."""
PRINTED_FREQUENCY = 357.419
"""Below Eq. (16): Hz per unit of ω."""


@dataclass(frozen=True)
class ComparedCircuit:
    """A circuit with its generator's settings, to be compared."""

    name: str
    what: str
    """What it is, in one sentence."""
    circuit: Circuit
    frequency: float
    """Generator's frequency at ω = 1 [Hz]."""
    amplitude: float
    """Generator's amplitude at the model's b [V peak]."""


def is_the_papers(model: MechanicalModel) -> bool:
    """Whether the model is the paper's case, up to the rounding of a conversion from SI."""
    if not isinstance(model, Dimensionless):
        return False
    numbers = ("m", "k", "k0", "c", "zeta", "f20", "b")
    own, paper = ([getattr(one, name) for name in numbers] for one in (model, MODEL))
    return model.sides == MODEL.sides and np.allclose(own, paper, rtol=1e-9, atol=1e-12)


def candidates(
    model: MechanicalModel, spec: CircuitSpec, catalog: Catalog
) -> tuple[ComparedCircuit, ...]:
    """What stands beside a design of this model: empty where the paper's circuit cannot follow it.

    The paper's case: its values as printed, corrected, and corrected and rounded to the values of
    the model file's series. Another model: the paper's way, exact and rounded. All with the paper's
    op-amp, rails and limit.
    """
    if not isinstance(model, Dimensionless) or (model.k0 > 0.0 and model.sides != "both"):
        return ()  # the paper's way is for its two masses, its dead zone two-sided
    opamp = catalog.opamp(OPAMP)
    if is_the_papers(model):
        exact, name = corrected(), "paper, corrected"
        what = "the printed values with R50 and R204, amplitude and frequency corrected"
        first = ComparedCircuit(
            AS_PRINTED,
            "the printed values, driven with 1.28 V and f = 357.419 ω",
            circuit(model, PRINTED, opamp),
            PRINTED_FREQUENCY,
            PRINTED_AMPLITUDE,
        )
        out = [first]
    else:
        exact, name, out = way(model), "paper's way", []
        what = "the paper's four chosen values, the rest from the corrected Eq. (14), exact"
    out.append(ComparedCircuit(name, what, circuit(model, exact, opamp), *generator(model, exact)))
    near = rounded(exact, spec, catalog)
    out.append(
        ComparedCircuit(
            f"{name}, rounded",
            f"{what}; every value the nearest that can be bought",
            circuit(model, near, opamp),
            *generator(model, near),
        )
    )
    return tuple(out)


def corrected() -> dict[str, float]:
    """The printed values, with R50 for k0 = 0.95 and R204 for the divider's load by R208."""
    values = dict(PRINTED)
    return values | _dead_zone(values, MODEL.mu)


def way(model: Dimensionless) -> dict[str, float]:
    """The paper's procedure for any model: ohm and farad by part name, exact.

    Four values are chosen as in Section 5.1: R1 (and R6), R4, C1 = C3 and C2 = C4. The others
    follow from Eq. (14) in its corrected form (docs/errata.md), the dead zone's gains stay.
    """
    chosen = ("R1", "R4", "R6", "C1", "C2", "C3", "C4", *(f"R{i}" for i in range(100, 108)))
    values = {name: PRINTED[name] for name in (*chosen, *DEAD_ZONE)}
    C2, C4 = values["C2"], values["C4"]
    M1, K1 = values["R1"] * values["C1"], 1.0 / (values["R4"] * C2)
    M2 = M1 * model.m / (1.0 - model.m)
    damping = 2.0 * model.zeta * float(np.sqrt(K1 * M1))
    values |= {
        "R7": M2 / values["C3"],
        "R2": M1 / (damping * C2),
        "R3": M2 / (damping * C2),
        "R8": M1 / (damping * C4),
        "R9": M2 * (1.0 - model.c) / (damping * C4),
        "R5": 1.0 / (K1 * C2),
        "R10": 1.0 / (K1 * C4),
        "R11": (1.0 - model.k) / (K1 * C4),
        "R12": values["R6"],
    }
    if 0.0 < model.f20 < 1.0:
        values["R12"] = values["R6"] * C2 / C4 * (1.0 - model.f20) / model.f20
    return values | _dead_zone(values, model.mu) if model.k0 > 0.0 else values


def rounded(values: Mapping[str, float], spec: CircuitSpec, catalog: Catalog) -> dict[str, float]:
    """Each value's nearest, by ratio, in the model file's series, ranges and grades."""
    lists: dict[str, Array] = {
        "R": catalog.values("resistor", spec.resistors, *spec.resistor_range, spec.resistor_grade),
        "C": catalog.values(
            "capacitor", spec.capacitors, *spec.capacitor_range, spec.capacitor_grade
        ),
    }
    return {
        name: float(lists[name[0]][np.abs(np.log(lists[name[0]] / value)).argmin()])
        for name, value in values.items()
    }


def generator(model: Dimensionless, values: Mapping[str, float]) -> tuple[float, float]:
    """(Hz at ω = 1, volts peak) by Eq. (16) and (15) as corrected, from these values.

    ω = 2π f √(R1 C1 R4 C2); V = B R6 (1 - f20)/(b R4), and B = Esat/A+. Without stops B is taken
    as if there were one, so that the level is the paper's.
    """
    root = float(np.sqrt(values["R1"] * values["C1"] * values["R4"] * values["C2"]))
    steep = values["R201"] * values["R203"] / (values["R200"] * values["R202"])
    per_volt = values["R4"] / values["R6"] if model.f20 < 1.0 else values["R10"] / values["R12"]
    share = 1.0 - model.f20 if model.f20 < 1.0 else 1.0
    amplitude = share * SATURATION / steep / (model.b * per_volt)
    return 1.0 / (2.0 * np.pi * root), amplitude


def circuit(model: Dimensionless, values: Mapping[str, float], opamp: OpAmp) -> Circuit:
    """The paper's Fig. 4 and Fig. 5 with these values; terms that are zero have no part."""
    return build.circuit_of(model, values, opamp, supply=SUPPLY, saturation=SATURATION)


def _dead_zone(values: Mapping[str, float], mu: float) -> dict[str, float]:
    """R50 from K0, and R204 from the null with the divider loaded by R208."""
    linear = values["R207"] / values["R206"]
    slope = linear * values["R210"] / values["R209"]
    steep = values["R201"] * values["R203"] / (values["R200"] * values["R202"])
    beta = linear / steep * values["R208"] / values["R209"]
    lower = values["R205"] * values["R208"] / (values["R205"] + values["R208"])
    return {"R50": slope * values["R4"] / mu, "R204": lower * (1.0 / beta - 1.0)}
