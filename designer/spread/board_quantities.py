"""The single numbers in which boards of a circuit differ: a part's value, an offset, a limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit

_GROUPS = ("values", "offset", "low", "high", "bias", "reference", "supply")
"""Of ``Boards``: what the exact circuit depends on and a spread may draw. The drop of a diode and
the gain are the same on every board; the bandwidth is for ngspice's models alone."""
ROUNDING = 1e-12
"""What is no difference from a nominal value, over that value."""
_NAMES = {"values": "", "reference": "", "supply": ""}


@dataclass(frozen=True)
class Quantity:
    """One column of ``Boards``."""

    part: str
    """Name of the part, section, reference or rail."""
    group: str
    """Name of the field of ``Boards`` that holds it."""
    nominal: float
    """Value on the nominal board, in ohm, farad, volt or ampere."""
    sigma: float
    """Standard deviation over the spread, in the same unit; where all boards are off by the same,
    as bias currents are at one temperature, by how much."""

    @property
    def name(self) -> str:
        """ "R203", "U1A.offset", "U1A.high", "VCC"."""
        return self.part + _NAMES.get(self.group, f".{self.group}")


def quantities(circuit: Circuit, boards: Boards) -> tuple[Quantity, ...]:
    """What differs between these boards, or from the nominal one, in the circuit's order.

    The limits of sections that are not meant to reach them are left out: while nothing clips they
    do nothing.
    """
    limiting = {s.name for s in circuit.sections if s.limits}
    nominal = Boards.of(circuit, [nominal_board(circuit)])
    varying = []
    for group in _GROUPS:
        columns: Mapping[str, Array] = getattr(boards, group)
        for part, values in columns.items():
            if group in ("low", "high") and part not in limiting:
                continue
            exact = _nominal(nominal, group, part)
            sigmas = float(np.std(values)), abs(float(np.mean(values)) - exact)
            sigma = next((s for s in sigmas if s > ROUNDING * abs(exact)), 0.0)
            if sigma:
                varying.append(Quantity(part, group, exact, sigma))
    return tuple(varying)


def column(boards: Boards, quantity: Quantity) -> Array:
    """(N,) this quantity on each board; nominal where the boards do not have it."""
    columns: Mapping[str, Array] = getattr(boards, quantity.group)
    values = columns.get(quantity.part)
    return np.full(len(boards), quantity.nominal) if values is None else values


def with_column(boards: Boards, quantity: Quantity, values: Array) -> Boards:
    """The boards with this quantity (N,) in the place of theirs."""
    columns: Mapping[str, Array] = getattr(boards, quantity.group)
    changed: dict[str, Any] = {quantity.group: {**columns, quantity.part: np.asarray(values)}}
    return replace(boards, **changed)


def exact_in(boards: Boards, groups: tuple[str, ...]) -> Boards:
    """The boards with these fields of ``Boards`` as on the nominal board, for every part."""
    nominal = Boards.of(boards.circuit, [nominal_board(boards.circuit)])
    changed: dict[str, Any] = {
        group: {
            part: np.full(len(boards), _nominal(nominal, group, part))
            for part in getattr(boards, group)
        }
        for group in groups
    }
    return replace(boards, **changed)


def _nominal(nominal: Boards, group: str, part: str) -> float:
    columns: Mapping[str, Array] = getattr(nominal, group)
    if part in columns:
        return float(columns[part][0])
    # Only rails are not on the nominal board: there they are the circuit's.
    return next(r.volts for r in nominal.circuit.rails if r.name == part)


def between(boards: Boards, share: Array) -> Boards:
    """(N,) shares of the straight way from the nominal board to each of these: 0 is nominal."""
    nominal = Boards.of(boards.circuit, [nominal_board(boards.circuit)])
    changed: dict[str, Any] = {}
    for group in _GROUPS:
        columns: dict[str, Array] = {}
        for part, values in getattr(boards, group).items():
            exact = _nominal(nominal, group, part)
            columns[part] = exact + share * (values - exact)
        changed[group] = columns
    return replace(boards, **changed)
