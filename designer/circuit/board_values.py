"""The values of one board: each part's own, and those of the nominal board."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from designer.circuit.netlist import Circuit


@dataclass(frozen=True)
class Board:
    """One copy of a circuit with its actual values: what a Monte Carlo sample is.

    What is missing has no offset and no bias, and the circuit's own supply, bandwidth and slew
    rate.
    """

    values: Mapping[str, float]
    """Ohm or farad by part name."""
    offset: Mapping[str, float] = field(default_factory=dict)
    """Input offset [V] by section."""
    rails: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """(low, high) output limits [V] by section."""
    inverse_gain: float = 0.0
    """1/open-loop gain, 0 for ideal op-amps."""
    bias: Mapping[str, float] = field(default_factory=dict)
    """Current into each input [A] by section."""
    reference: Mapping[str, float] = field(default_factory=dict)
    """Volts by name of the reference."""
    drop: Mapping[str, float] = field(default_factory=dict)
    """Forward voltage [V] by name of the diode, while it conducts."""
    supply: Mapping[str, float] = field(default_factory=dict)
    """Volts of the rails by name."""
    gain_bandwidth: Mapping[str, float] = field(default_factory=dict)
    """Gain-bandwidth product [Hz] by section, which ngspice's models with a bandwidth use."""
    slew: Mapping[str, float] = field(default_factory=dict)
    """Slew rate [V/s] by section, likewise."""

    @property
    def mirror_symmetric(self) -> bool:
        """No offset, no bias and equal rails: x → -x is a symmetry of a stage that is even."""
        level = not any(self.offset.values()) and not any(self.bias.values())
        return level and all(low == -high for low, high in self.rails.values())


def nominal_board(circuit: Circuit, *, ideal: bool = False) -> Board:
    """The board with the nominal values, no offset, equal rails.

    ideal : infinite gain and no bias current, as the matching conditions assume.
    """
    return Board(
        values=circuit.values,
        offset={s.name: 0.0 for s in circuit.sections},
        rails={name: (-limit, limit) for name, limit in circuit.output_limits().items()},
        inverse_gain=0.0 if ideal else 1.0 / circuit.gain,
        bias={} if ideal else {s.name: circuit.bias for s in circuit.sections},
        reference={r.name: r.volts for r in circuit.references},
        drop={d.name: d.model.drop for d in circuit.diodes},
    )
