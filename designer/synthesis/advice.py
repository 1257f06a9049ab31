"""What frees a condition that leaves no choice of parts."""

from __future__ import annotations

FREES = {
    "frequency": "widen circuit.frequency or circuit.capacitor_range",
    "displacement integrators": "add a series to circuit.capacitors or widen circuit.frequency",
    "signal resistors": "widen circuit.resistor_range, or leave out the side condition resistors",
    "coefficients": "add a series to circuit.resistors or circuit.capacitors, or widen the ranges",
    "stop slope": "widen circuit.resistor_range (R50 is the stop) or take a finer series",
    "stop stiffness": "a smaller model.k0 or a wider circuit.resistor_range: R4 is too small",
    "dead-zone null": "a finer series, or a larger model.b: the threshold may be too small a part "
    "of the swing for the gain of the saturating path",
    "dead-zone bias": "a finer series or a wider circuit.resistor_range (R211 and R212)",
    "threshold": "a finer series or a wider circuit.resistor_range (R200 and R201), or a larger "
    "model.b: the reference has to be divided down to the threshold",
    "reference current": "a wider circuit.resistor_range (R201 and R206) or a larger "
    "circuit.supply",
    "noise gain": "a larger model.b, or a larger circuit.resistor_range",
    "signal level": "leave level out of circuit.side_conditions, or take a wider "
    "circuit.resistor_range and circuit.capacitor_range",
    "side conditions": "fewer names in circuit.side_conditions, or wider ranges in circuit",
    "matched parts": "drop a group of circuit.matched or add a series",
    "distinct values": "raise circuit.most_values, or add circuit.preferred or circuit.slack",
    "swing": "a larger circuit.saturation or circuit.supply",
    "level": "a clearance (model.b) that is reached, a larger circuit.saturation, or an op-amp "
    "with less offset",
    "load": "an op-amp that drives more, or a wider circuit.resistor_range",
    "noise_gain": "a larger model.b, or a larger circuit.resistor_range",
    "bandwidth": "a faster circuit.opamp, or lower frequencies in circuit.frequency",
    "resistors": "another circuit.capacitor_range or circuit.frequency",
    "generator": "a smaller clearance, or smaller resistors in circuit.resistor_range",
}
"""By what binds, as ``Unreachable`` names it."""
