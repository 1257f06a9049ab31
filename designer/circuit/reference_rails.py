"""The shunt references: one on each polarity, for all thresholds and constant forces.

So the ratio of two thresholds does not depend on a reference.
"""

from __future__ import annotations

from collections.abc import Mapping

from designer.base.errors import InputError
from designer.catalog.entries import ReferenceEntry
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Part, Reference
from designer.circuit.resistors import Resistors

RAILS = {1: "vrp", -1: "vrn"}
"""Nets that the references hold, by their sign."""
_NAMES, _SUPPLIES = {1: "VR1", -1: "VR2"}, {1: POSITIVE, -1: NEGATIVE}
RECTIFIER_FEEDS = {1: "R206", -1: "R207"}
"""Resistors from the supplies to the references, beside a rectifier: the paper's stage has other
parts of these names."""
FEEDS = {1: "R180", -1: "R181"}
"""The same in other circuits."""


class ReferenceRails:
    """Makes each reference, with its feed, where it is first needed.

    Raises
    ------
    InputError : a reference is needed and none was given.
    """

    def __init__(
        self, reference: ReferenceEntry | None, resistors: Resistors, feeds: Mapping[int, str]
    ) -> None:
        self._reference = reference
        self._resistors = resistors
        self._feeds = feeds
        self._made: set[int] = set()

    def __call__(self, sign: int, role: str, feed_role: str) -> list[Part]:
        """The reference of this sign and its feed; nothing where they are there already."""
        if self._reference is None:
            raise InputError(None, "circuit.reference", "none", "a reference for this circuit")
        if sign in self._made:
            return []
        self._made.add(sign)
        net, entry = RAILS[sign], self._reference
        ends = (net, GROUND) if sign > 0 else (GROUND, net)
        return [
            Reference(
                _NAMES[sign],
                *ends,
                volts=entry.voltage,
                grade=entry.grade,
                model=entry.name,
                role=role,
                least=entry.least_current,
                impedance=entry.dynamic_impedance,
            ),
            *self._resistors(self._feeds[sign], _SUPPLIES[sign], net, feed_role),
        ]
