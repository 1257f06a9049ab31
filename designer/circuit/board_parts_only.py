"""Kinds of parts that a board needs and that no equation knows of.

Resistors, diodes and op-amp sections of the board alone are those of ``circuit.netlist``, with
other ``views``.
"""

from __future__ import annotations

from dataclasses import dataclass

from designer.base.views import View


@dataclass(frozen=True)
class SupplyCapacitor:
    """Capacitance [F] between the rails or a rail and ground; ``plus`` is the higher net.

    package : the op-amp package at whose supply pin it stands; "" for the board's bulk.
    """

    name: str
    plus: str
    minus: str
    value: float
    role: str
    package: str = ""
    views: View = View.FITTED

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.plus, self.minus)


@dataclass(frozen=True)
class Connector:
    """A pin header: ways are the nets of pins 1, 2, …"""

    name: str
    ways: tuple[str, ...]
    role: str
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
    role: str
    views: View = View.BOARD

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.net,)


@dataclass(frozen=True)
class Trimmer:
    """A trimming potentiometer of ``value`` [ohm] between two nets, with its wiper's."""

    name: str
    low: str
    wiper: str
    high: str
    value: float
    role: str
    views: View = View.FITTED

    @property
    def nets(self) -> tuple[str, ...]:
        return (self.low, self.wiper, self.high)
