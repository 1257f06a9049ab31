"""Many boards together are the single boards; a part made exact is at its nominal value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.base.errors import InputError
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import Board, nominal_board
from designer.spread.spread import Spread, draw, draw_many
from tests.circuit.test_rectifier import BOTH
from tests.circuit.test_reduction import EXACT, circuit_of

CIRCUIT = circuit_of(EXACT)
SPREAD = Spread(0.01, 0.05, 3e-3, 10e-3)


def test_many_are_the_single_ones() -> None:
    for circuit in (CIRCUIT, BOTH):
        many = draw_many(circuit, SPREAD, 3, range(4, 9))
        alone = [draw(circuit, SPREAD, 3, i) for i in range(4, 9)]
        assert [many.board(k) for k in range(len(many))] == alone
        assert [many.take([3, 0, 3]).board(k) for k in range(3)] == [alone[3], alone[0], alone[3]]


def test_an_exact_part_is_nominal_and_the_others_stay() -> None:
    many = draw_many(BOTH, SPREAD, 3, range(5))
    nominal = nominal_board(BOTH)
    reference = BOTH.references[0].name
    names = {"R1", "C2", "U1A", reference}
    for before, after in ((many.board(k), many.exact(names).board(k)) for k in range(len(many))):
        for name, value in after.values.items():
            assert value == (nominal.values if name in names else before.values)[name]
        for name in after.rails:
            source = nominal if name in names else before
            assert after.rails[name] == source.rails[name]
            assert after.offset[name] == source.offset[name]
        assert after.reference[reference] == nominal.reference[reference]
    everything = {*nominal.values, *nominal.rails, *nominal.reference}
    assert many.exact(everything).board(2) == nominal


def test_a_drawn_supply_made_exact_is_the_circuit_s() -> None:
    board = replace(nominal_board(BOTH), supply={"VCC": 14.2, "VEE": -15.1})
    many = Boards.of(BOTH, [board])
    assert many.exact({"VCC"}).board(0).supply == {"VEE": -15.1}


def test_an_unknown_part_is_refused() -> None:
    with pytest.raises(InputError, match="R999"):
        draw_many(CIRCUIT, SPREAD, 1, range(1)).exact({"R999"})


def test_boards_of_one_board() -> None:
    board: Board = nominal_board(CIRCUIT)
    many = Boards.of(CIRCUIT, [board])
    assert len(many) == 1
    assert many.board(0) == board
    assert np.all(many.low["U1A"] == -CIRCUIT.saturation)
