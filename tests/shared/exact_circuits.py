"""Circuits with exact values: by hand from the equations of motion, not from the code's formulas.

Every capacitor has 10 nF. State i stands for ``volts[i]`` volts a unit, one unit of time takes
``seconds``. A voltage V through R into an integrator of C moves its output by -V/(R C).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from designer.base.arrays import Array
from designer.circuit import build
from designer.circuit.dead_zone_parts import DeadZoneStage
from designer.circuit.netlist import Circuit
from designer.circuit.terms import terms
from designer.model.mechanics import Clearance, SecondOrderSystem
from tests.shared.stages import CATALOG, VREF

FARAD = 10e-9
IDLE = 8.0
"""Volts at which a half's output stands, a drop beside it, where the other half begins to drive."""
DIFFERENCE = 1.5
"""Gain of the difference amplifiers."""
STAGE = DeadZoneStage("rectifier", CATALOG.diode("1N4148"), CATALOG.reference("LM4040C50"))


@dataclass(frozen=True)
class Scale:
    """How the circuit and the model correspond."""

    seconds: float
    volts: Array
    generator: float
    """Generator volts for the model's drive."""


def unit_volts(clearance: Clearance, scale: Scale) -> float:
    """Volts of a unit of displacement in a clearance: of its first mass, or behind the difference
    amplifier."""
    gain = 1.0 if clearance.other is None else DIFFERENCE
    return gain * float(scale.volts[2 * clearance.mass])


def exact_values(system: SecondOrderSystem, scale: Scale) -> dict[str, float]:
    """Ohm and farad by part name."""
    volts, C, n = scale.volts, FARAD, system.size
    ramp = C / scale.seconds  # siemens for one unit a unit of time, before the scales
    values = {f"C{i + 1}": C for i in range(2 * n)}
    values |= {f"R{k}": 10e3 for k in (*range(100, 100 + 4 * n), 190, 191, 206, 207)}
    force = system.drive_force(system.own_frequency)
    for t in terms(system.damping.tolist(), system.stiffness.tolist(), force.tolist()):
        kind, i, j = t.quantity
        if kind == "mass":
            rate, source = 1.0, float(volts[2 * i + 1])
        elif kind == "force":
            rate, source = abs(force[i]) / system.mass[i], scale.generator
        else:
            matrix = system.damping if kind == "damping" else system.stiffness
            rate = abs(matrix[i, j]) / system.mass[i]
            source = float(volts[2 * j + (kind == "damping")])
        values[t.resistor] = source / (rate * volts[t.state] * ramp)
    for i, constant in enumerate(system.constant.tolist()):
        if constant:
            velocity = volts[2 * i + 1]
            values[f"R{160 + i}"] = VREF * system.mass[i] / (abs(constant) * velocity * ramp)
    for k, clearance in enumerate(system.clearances):
        own = unit_volts(clearance, scale)
        base, small = 200 + 100 * k, 50 + 10 * k
        gain, reference = 1.0, clearance.first.stiffness
        for side, stop in clearance.sides:
            first = base + (0 if side > 0 else 3)
            slope = gain * stop.stiffness / reference
            values |= {f"R{first}": 10e3, f"R{first + 2}": 10e3 * slope}
            if stop.gap:
                values[f"R{first + 1}"] = 10e3 * VREF / (abs(stop.gap) * own)
        values |= {f"R{base + k}": 10e3 for k in (10, 11, 12)}
        if len(clearance.sides) == 2:
            span = own * sum(stop.gap for _, stop in clearance.sides)
            values |= dict.fromkeys((f"R{base + 8}", f"R{base + 9}"), 10e3 * IDLE / span)
        masses = [(small, clearance.mass)]
        if clearance.other is not None:
            masses.append((small + 1, clearance.other))
            ratio = volts[2 * clearance.mass] / volts[2 * clearance.other]
            values |= {f"R{base + 20}": 20e3, f"R{base + 21}": 20e3 / ratio}
            values |= {f"R{base + 22}": DIFFERENCE * 20e3}
            values |= {f"R{base + 24}": 10e3, f"R{base + 25}": 10e3}
        for number, mass in masses:
            rate = reference / system.mass[mass] * volts[2 * mass + 1] * ramp
            values[f"R{number}"] = gain * own / rate
    return values


def exact_circuit(system: SecondOrderSystem, scale: Scale, stage: DeadZoneStage = STAGE) -> Circuit:
    """The circuit of these values, its op-amps out of reach of their limits."""
    force = system.drive_force(system.own_frequency).tolist()
    circuit = build.build(
        terms(system.damping.tolist(), system.stiffness.tolist(), force),
        exact_values(system, scale),
        CATALOG.opamp("TL074C"),
        supply=15.0,
        saturation=13.0,
        clearances=system.clearances,
        constants=system.constant.tolist(),
        stage=stage,
    )
    return replace(circuit, saturation=1e4)
