"""Finding the mode of a state: complementarity problems with known answers."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.arrays import Array
from designer.dynamics.drive_shape import SINE
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import (
    Drive,
    Guard,
    Mode,
    ModeKey,
    PiecewiseLinearSystem,
    SecondDrive,
)
from designer.dynamics.working_modes import TabulatedModes, anchors


def complementarity(M: Array, q: Array, weight: float = 1.0) -> PiecewiseLinearSystem:
    """w = M z + q, w ≥ 0, z ≥ 0, w·z = 0 as modes: entry i is 1 where z_i may be positive.

    weight : of the guards of w beside those of z, as volts stand beside amperes.
    """
    n = len(q)

    def build(key: ModeKey) -> Mode:
        on = [i for i in range(n) if key[i]]
        z = np.zeros(n)
        z[on] = np.linalg.solve(M[np.ix_(on, on)], -q[on])
        w = M @ z + q
        guards = [
            Guard(np.zeros(1), 0.0, -z[i] if key[i] else -weight * w[i],
                  (*key[:i], 1 - key[i], *key[i + 1 :]))
            for i in range(n)
        ]  # fmt: skip
        return Mode(np.zeros((1, 1)), np.zeros(1), np.zeros(1), tuple(guards), ())

    return PiecewiseLinearSystem(("x",), build, (0,) * n, (), (), ())


CYCLING = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]])


@pytest.mark.parametrize("near", list(itertools.product((0, 1), repeat=3)))
def test_a_walk_that_would_cycle_arrives(near: ModeKey) -> None:
    """Across the worst violation alone this one goes round for ever: z = 1/3 each is the answer."""
    system = complementarity(CYCLING, -np.ones(3), weight=0.1)
    assert system.mode_at(np.zeros(1), 0.0, near) == (1, 1, 1)
    worst, key = [], near
    for _ in range(40):
        guards = system.mode(key).guards
        values = [g.e for g in guards]
        if max(values) <= 0.0:
            break
        worst.append(key)
        key = guards[int(np.argmax(values))].target
    if near in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        assert len(worst) == 40, "this case is here because the plain walk does not end"


@settings(max_examples=60)
@given(seed=st.integers(0, 10**6))
def test_any_start_leads_to_the_one_answer(seed: int) -> None:
    """Random problems whose matrix has positive principal minors, against enumeration."""
    rng = np.random.default_rng(seed)
    n = 5
    A = rng.standard_normal((n, n))
    skew = rng.standard_normal((n, n))
    M = A @ A.T + 0.1 * np.eye(n) + skew - skew.T
    q = rng.standard_normal(n)
    system = complementarity(M, q, weight=float(rng.choice([1.0, 1e-3, 1e3])))
    keys = list(itertools.product((0, 1), repeat=n))
    answers = [k for k in keys if all(g.e <= 0.0 for g in system.mode(k).guards)]
    assert len(answers) == 1
    for near in (keys[int(i)] for i in rng.integers(0, len(keys), 4)):
        assert system.mode_at(np.zeros(1), 0.0, near) == answers[0]


def test_a_system_without_an_answer_says_so() -> None:
    system = complementarity(-np.eye(2), -np.ones(2))
    with pytest.raises(ArithmeticError, match="no mode holds"):
        system.mode_at(np.zeros(1), 0.0)


def test_a_displacement_that_is_a_state_is_told_from_one_that_is_made_of_it() -> None:
    rows = [[1, 0, 0, 0], [0, 1, 0, 0], [2, 0, 0, 0], [1, -3, 0, 0], [0, 0, 1, 0], [1, 0, 0, 1]]
    system = PiecewiseLinearSystem(
        ("x", "x'"), lambda _: Mode(np.eye(2), np.ones(2), np.zeros(2), (), ()), (),
        tuple("ABCDEF"), tuple(np.array(rows, dtype=float)), (),
    )  # fmt: skip
    assert system.state_in == (0, 1, None, None, None, None)
    assert system.moving == 0
    assert replace(system, displacement=system.displacement[3:]).moving == 1
    assert replace(system, displacement=()).moving == 0


def test_modes_that_somebody_else_has_built_are_taken_where_they_are_not_there() -> None:
    system = complementarity(np.eye(2), -np.ones(2))
    own = system.mode((0, 0))
    keys: tuple[ModeKey, ...] = ((0, 0), (1, 0))
    others = {key: complementarity(np.eye(2), np.ones(2)).mode(key) for key in keys}
    system.know(others)
    assert system.mode((0, 0)) is own
    assert system.mode((1, 0)) is others[1, 0]
    assert system.built == 2


def test_a_mode_keeps_the_number_that_it_gets() -> None:
    tables = TabulatedModes(complementarity(np.eye(2), -np.ones(2)), Drive(1.0))
    keys = [(0, 0), (1, 0), (1, 1)]
    assert [tables.number(key) for key in keys] == [0, 1, 2]
    assert [tables.number(key) for key in keys] == [0, 1, 2]
    assert tables.targets.keys == keys


def test_the_drive_begins_each_stretch_where_its_share_of_a_turn_is() -> None:
    """Quarters of a turn: sine and cosine of the drive, then of its third harmonic."""
    wanted = [[0, 1, 0, 1], [1, 0, -1, 0], [0, -1, 0, -1], [-1, 0, 1, 0]]
    assert anchors(4, (3,)) == pytest.approx(np.array(wanted), abs=1e-15)


def test_a_guard_may_look_at_the_second_drive() -> None:
    """x' = sin t while the second drive, sin t too, is above 1/2: from π/6 to 5π/6, in which x
    gains the square root of 3."""

    def build(key: ModeKey) -> Mode:
        sign = -1.0 if key[0] else 1.0
        guard = Guard(np.zeros(1), 0.0, -0.5 * sign, (1 - key[0],), -1, sign)
        moves = np.array([float(key[0])])
        return Mode(np.zeros((1, 1)), moves, np.zeros(1), (guard,), (), second=np.zeros(1))

    system = PiecewiseLinearSystem(("x",), build, (0,), (), (), (), continuous=False)
    flow = Flow(system, Drive(1.0, second=SecondDrive(1.0, SINE)))
    assert flow.run(np.zeros(1), 1).strobes[-1, 0] == pytest.approx(math.sqrt(3.0), abs=1e-9)
