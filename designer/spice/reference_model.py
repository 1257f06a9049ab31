"""A shunt voltage reference in ngspice, from the catalogue's least current and impedance.

It draws its least current at its voltage, below in proportion to the voltage: a reference that is
fed too little does not reach its voltage. What flows beyond that raises the voltage by the dynamic
impedance. Above ``ideal`` this takes the place of a source, which never lacks current.
"""

from __future__ import annotations

LARGEST = 10.0
"""Current [A] beyond anything that a feed resistor lets through."""


def instance(
    name: str, cathode: str, anode: str, *, volts: float, least: float, impedance: float
) -> str:
    """The element line of one reference of ``volts``; least current [A], impedance [ohm]."""
    return (
        f"X{name} {cathode} {anode} reference "
        f"volts={volts!r} least={least!r} impedance={impedance!r}"
    )


def subcircuit() -> list[str]:
    """The lines of the subcircuit ``reference``: pins cathode, anode."""
    return [
        ".subckt reference cathode anode volts=5 least=1e-4 impedance=1",
        "Rleast cathode anode {volts/least}",
        "Ashunt %vd(cathode anode) %id(cathode anode) shunt",
        ".model shunt limit(in_offset={-volts} gain={1/impedance} out_lower_limit=0 "
        f"out_upper_limit={LARGEST!r} limit_range={{least/100}} fraction=FALSE)",
        ".ends reference",
    ]
