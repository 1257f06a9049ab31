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
from designer.model.clearance import Clearance
from designer.model.mechanics import SecondOrderSystem
from tests.shared.stages import CATALOG, VREF

FARAD = 10e-9
IDLE = 8.0
"""Volts at which a half's output stands, a drop beside it, where the other half begins to drive."""
DIFFERENCE = 1.5
"""Gain of the difference amplifiers."""
FIRST, SECOND = 2.0, 0.7
"""Gains of the halves of a limiter."""
STAGE = DeadZoneStage("rectifier", CATALOG.diode("1N4148"), CATALOG.reference("LM4040C50"))


@dataclass(frozen=True)
class Scale:
    """How the circuit and the model correspond."""

    seconds: float
    volts: Array
    generator: float
    """Generator volts for the model's drive."""


def unit_volts(clearance: Clearance, scale: Scale) -> float:
    """Volts of a unit of displacement in a dead zone, or of velocity: of its first mass, or behind
    the amplifier that sums."""
    gain = 1.0 if len(clearance.terms) == 1 else DIFFERENCE
    return gain * float(scale.volts[clearance.watched])


def exact_values(system: SecondOrderSystem, scale: Scale) -> dict[str, float]:
    """Ohm and farad by part name."""
    volts, C, n = scale.volts, FARAD, system.size
    ramp = C / scale.seconds  # siemens for one unit a unit of time, before the scales
    values = {f"C{i + 1}": C for i in range(2 * n)}
    values |= {f"R{k}": 10e3 for k in (*range(100, 100 + 4 * n), 190, 191, 206, 207)}
    force, second = (system.drive_force(system.own_frequency, k) for k in (0, 1))
    zones, system = system.dead_zones, _linear_part(system)
    matrices = system.damping.tolist(), system.stiffness.tolist(), force.tolist()
    for t in terms(*matrices, second=second.tolist()):
        kind, i, j = t.quantity
        if kind == "mass":
            rate, source = 1.0, float(volts[2 * i + 1])
        elif kind == "force":
            rate, source = abs((force, second)[j][i]) / system.mass[i], scale.generator
        else:
            matrix = system.damping if kind == "damping" else system.stiffness
            rate = abs(matrix[i, j]) / system.mass[i]
            source = float(volts[2 * j + (kind == "damping")])
        values[t.resistor] = source / (rate * volts[t.state] * ramp)
    for i, constant in enumerate(system.constant.tolist()):
        if constant:
            velocity = volts[2 * i + 1]
            values[f"R{160 + i}"] = VREF * system.mass[i] / (abs(constant) * velocity * ramp)
    for k, clearance in enumerate(zones):
        own = unit_volts(clearance, scale)
        beyond = 2000 if k > 4 else 0
        base, small = 200 + 100 * k + beyond, 50 + 10 * k + beyond
        gain, reference = 1.0, clearance.first.stiffness
        for side, stop in clearance.sides:
            first = base + (0 if side > 0 else 3)
            slope = gain * stop.stiffness / reference
            values |= {f"R{first}": 10e3, f"R{first + 2}": 10e3 * slope}
            if stop.gap:
                values[f"R{first + 1}"] = 10e3 * VREF / (abs(stop.gap) * own)
        values |= {f"R{base + k}": 10e3 for k in (10, 11, 12)}
        if clearance.limits:
            gain = FIRST * SECOND
            values |= _limiter(clearance, base, own)
        elif len(clearance.sides) == 2:
            span = own * sum(stop.gap for _, stop in clearance.sides)
            values |= dict.fromkeys((f"R{base + 8}", f"R{base + 9}"), 10e3 * IDLE / span)
        own_volts = volts[clearance.state_of(clearance.mass)]
        for number, (mass, factor) in zip((20, 21, 30, 31), clearance.terms, strict=False):
            ratio = volts[clearance.state_of(mass)] / own_volts / abs(factor)
            values[f"R{base + number}"] = 20e3 * ratio
        values |= {f"R{base + 22}": DIFFERENCE * 20e3}
        values |= {f"R{base + 24}": 10e3, f"R{base + 25}": 10e3}
        for number, (mass, factor) in enumerate(clearance.pushed, small):
            share = abs(factor) / system.mass[mass] * volts[2 * mass + 1]
            values[f"R{number}"] = gain * own / (abs(reference) * share * ramp)
            if clearance.damping:
                values[f"C{number}"] = C * clearance.damping * share / own
    return values


def _limiter(clearance: Clearance, base: int, own: float) -> dict[str, float]:
    """The two halves of a limiter, one behind the other; own : volts of a unit in front of them."""
    assert clearance.upper is not None
    assert clearance.lower is not None
    above, span = clearance.upper.gap, clearance.upper.gap + clearance.lower.gap
    values = dict.fromkeys((f"R{base}", f"R{base + 3}"), 10e3)
    values |= {f"R{base + 2}": FIRST * 10e3, f"R{base + 5}": SECOND * 10e3}
    values[f"R{base + 4}"] = 10e3 * VREF / (FIRST * span * own)
    if above:
        values[f"R{base + 1}"] = 10e3 * VREF / (above * own)
    return values


def _linear_part(system: SecondOrderSystem) -> SecondOrderSystem:
    """Without the slope between the ends of a limiter, which its stage makes, and with a constant
    that takes away what the stage gives at rest."""
    stiffness, damping = system.stiffness.copy(), system.damping.copy()
    constant = system.constant.copy()
    for zone in system.dead_zones:
        if zone.limits:
            assert zone.lower is not None
            steep = -zone.lower.stiffness
            for i, a in zone.pushed:
                constant[i] += a * steep * zone.lower.gap
                for j, b in zone.terms:
                    matrix = damping if zone.quantity == "velocity" else stiffness
                    matrix[i, j] -= a * b * steep
    return replace(system, stiffness=stiffness, damping=damping, constant=constant)


def exact_circuit(system: SecondOrderSystem, scale: Scale, stage: DeadZoneStage = STAGE) -> Circuit:
    """The circuit of these values, its op-amps out of reach of their limits. The halves of stops
    with damping are apart, whatever the stage says."""
    damped = {i for i, zone in enumerate(system.dead_zones) if zone.damping}
    stage = replace(stage, apart=stage.apart | damped)
    force, second = (system.drive_force(system.own_frequency, k).tolist() for k in (0, 1))
    linear = _linear_part(system)
    circuit = build.build(
        terms(linear.damping.tolist(), linear.stiffness.tolist(), force, second=second),
        exact_values(system, scale),
        CATALOG.opamp("TL074C"),
        supply=15.0,
        saturation=13.0,
        clearances=system.dead_zones,
        constants=linear.constant.tolist(),
        stage=stage,
    )
    return replace(circuit, saturation=1e4)
