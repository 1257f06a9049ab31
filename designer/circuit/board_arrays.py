"""Many boards of one circuit at once: an array of N values wherever a board has one."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from designer.base.arrays import Array, Index
from designer.base.errors import InputError
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.netlist import Circuit

_RAILS = ("low", "high")
_OF_A_BOARD = (
    "values", "offset", "bias", "reference", "drop", "supply", "gain_bandwidth", "slew",
)  # fmt: skip
_BY_NAME = (*_OF_A_BOARD, *_RAILS)


@dataclass(frozen=True)
class Boards:
    """N boards of a circuit; every mapping is from a name to an array (N,), see
    ``board_values.Board``."""

    circuit: Circuit
    values: Mapping[str, Array]
    """Ohm or farad by part."""
    offset: Mapping[str, Array]
    """Input offset [V] by section."""
    low: Mapping[str, Array]
    """Lower output limit [V] by section."""
    high: Mapping[str, Array]
    """Upper output limit [V] by section."""
    bias: Mapping[str, Array]
    """Current into each input [A] by section."""
    reference: Mapping[str, Array]
    """Volts by reference."""
    drop: Mapping[str, Array]
    """Forward voltage [V] by diode, while it conducts."""
    supply: Mapping[str, Array]
    """Volts by rail."""
    gain_bandwidth: Mapping[str, Array]
    """Gain-bandwidth product [Hz] by section."""
    inverse_gain: Array
    """(N,) 1/open-loop gain."""
    slew: Mapping[str, Array] = field(default_factory=dict)
    """Slew rate [V/s] by section."""
    bandwidth: bool = False
    """Whether they are computed with op-amps that lag, see ``reduction.Reduction``."""

    def __len__(self) -> int:
        return len(self.inverse_gain)

    @property
    def stacked(self) -> Board:
        """All in the form of one board, an array (N,) wherever a board has a number."""
        return self._board(lambda column: column)

    def board(self, index: int) -> Board:
        """One of them."""
        return self._board(lambda column: float(column[index]))

    def _board(self, pick: Callable[[Array], Any]) -> Board:
        columns: dict[str, Any] = {
            group: {name: pick(column) for name, column in getattr(self, group).items()}
            for group in _BY_NAME
        }
        low, high = columns.pop("low"), columns.pop("high")
        rails = {name: (low[name], high[name]) for name in low}
        return Board(**columns, rails=rails, inverse_gain=pick(self.inverse_gain))

    def take(self, which: Index | Sequence[int]) -> Boards:
        """These of them, in this order; one may be taken more than once."""
        index = np.asarray(which, dtype=np.intp)
        picked: dict[str, Any] = {
            group: {name: column[index] for name, column in getattr(self, group).items()}
            for group in _BY_NAME
        }
        return replace(self, **picked, inverse_gain=self.inverse_gain[index])

    def exact(self, names: Collection[str]) -> Boards:
        """The same boards with these parts, op-amp sections, references and supplies as drawn in
        the circuit: at their nominal values, without offset.

        Raises
        ------
        InputError : the circuit has no part of such a name.
        """
        nominal = Boards.of(self.circuit, [nominal_board(self.circuit)])
        known = {name for group in _BY_NAME for name in getattr(nominal, group)}
        known |= {rail.name for rail in self.circuit.rails}
        for name in sorted(set(names) - known):
            raise InputError(None, "part", name, "a part of the circuit")

        def at_nominal(group: str) -> dict[str, Array]:
            theirs: Mapping[str, Array] = getattr(nominal, group)
            columns = {}
            for name, column in getattr(self, group).items():
                if name not in names:
                    columns[name] = column
                elif name in theirs:
                    columns[name] = np.full(len(self), theirs[name][0])
            return columns  # what the nominal board lacks is the circuit's own

        changed: dict[str, Any] = {group: at_nominal(group) for group in _BY_NAME}
        return replace(self, **changed)

    @classmethod
    def of(cls, circuit: Circuit, boards: Sequence[Board]) -> Boards:
        """Single boards together. A name must be in all of them or in none."""

        def columns(groups: Sequence[Mapping[str, float]]) -> dict[str, Array]:
            return {name: np.array([group[name] for group in groups]) for name in groups[0]}

        grouped: dict[str, Any] = {
            group: columns([getattr(b, group) for b in boards]) for group in _OF_A_BOARD
        }
        return cls(
            circuit=circuit,
            low=columns([{name: low for name, (low, _) in b.rails.items()} for b in boards]),
            high=columns([{name: high for name, (_, high) in b.rails.items()} for b in boards]),
            inverse_gain=np.array([b.inverse_gain for b in boards]),
            **grouped,
        )
