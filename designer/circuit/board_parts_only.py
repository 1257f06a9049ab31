"""Kinds of parts that a board needs and that no equation knows of.

Resistors, diodes and op-amp sections of the board alone are those of ``circuit.netlist``, with
other ``views``.
"""

from __future__ import annotations

from dataclasses import dataclass

from designer.base.views import View


@dataclass(frozen=True)
class SupplyCapacitor:
    """A capacitor between the rails, or between a rail and ground."""

    name: str
    plus: str
    """The higher net."""
    minus: str
    """The lower net."""
    value: float
    """Capacitance [F]."""
    role: str
    package: str = ""
    """The op-amp package at whose supply pin it stands; "" for the board's bulk."""
    views: View = View.FITTED

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.plus, self.minus)


@dataclass(frozen=True)
class SupplyDiode:
    """A diode between the supply's connector and a rail, which blocks the wrong polarity."""

    name: str
    anode: str
    """Net of the anode."""
    cathode: str
    """Net of the cathode."""
    source: str
    """The one of both nets that the connector is on."""
    model: str
    """Its name in the catalogue."""
    drop: float
    """Most that it drops at the current that the op-amps draw [V]."""
    role: str
    views: View = View.FITTED

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.anode, self.cathode)

    @property
    def positive(self) -> bool:
        """Whether it stands in the positive rail."""
        return self.anode == self.source


@dataclass(frozen=True)
class Connector:
    """A row of pins, or a coaxial jack."""

    name: str
    ways: tuple[str, ...]
    """Nets of pins 1, 2, …; of a jack the signal's and the shell's."""
    role: str
    series: str = ""
    """The series of a coaxial jack, "sma" or "bnc"; "" of a row of pins."""
    views: View = View.FITTED

    @property
    def nets(self) -> tuple[str, ...]:
        return self.ways


@dataclass(frozen=True)
class TestPoint:
    """A bare pad for a probe: on the board, but nothing to buy."""

    __test__ = False  # no test class, whatever its name begins with

    name: str
    net: str
    """The net that it carries."""
    role: str
    views: View = View.BOARD

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.net,)


@dataclass(frozen=True)
class Trimmer:
    """A trimming potentiometer."""

    name: str
    low: str
    """Net of the track's lower end."""
    wiper: str
    """Net of the wiper."""
    high: str
    """Net of the track's upper end."""
    value: float
    """Resistance of the track [ohm]."""
    role: str
    views: View = View.FITTED

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.low, self.wiper, self.high)
