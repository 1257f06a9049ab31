"""The rule that makes the matching conditions, with symbols: Eq. (14) as corrected comes out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, strategies as st

from designer.circuit.terms import Quantity, Term, inverted_states, terms

C1, C2, K1, K2, P1, P2 = sp.symbols("C1 C2 K1 K2 P1 P2", positive=True)
DAMPING = [[C1, -C1], [-C1, C1 + C2]]
STIFFNESS = [[K1, -K1], [-K1, K1 + K2]]


def sign(entry: Any) -> int:
    """Sign of an expression in positive symbols."""
    value = sp.sympify(entry)
    if value.is_zero:
        return 0
    assert value.is_positive or value.is_negative
    return 1 if value.is_positive else -1


def parts(text: str) -> sp.Expr:
    """An expression in part names: R1 and C1 stand for themselves."""
    names = {n: sp.Symbol(f"part_{n}", positive=True) for n in _names()}
    return sp.sympify(text, locals=names)


def _names() -> list[str]:
    return [f"R{i}" for i in range(1, 13)] + [f"C{i}" for i in range(1, 5)]


# Eq. (14) as it must read: the quantity of Eq. (1)-(2), and the parts that realise it.
CORRECTED_14: dict[Quantity, str] = {
    ("mass", 0, 0): "R1*C1",
    ("mass", 1, 1): "R7*C3",
    ("damping", 0, 0): "R1*C1/(R2*C2)",
    ("damping", 0, 1): "-R7*C3/(R3*C2)",
    ("damping", 1, 0): "-R1*C1/(R8*C4)",
    ("damping", 1, 1): "R7*C3/(R9*C4)",
    ("stiffness", 0, 0): "1/(R4*C2)",
    ("stiffness", 0, 1): "-1/(R5*C2)",
    ("stiffness", 1, 0): "-1/(R10*C4)",
    ("stiffness", 1, 1): "1/(R11*C4)",
    ("force", 0, 0): "1/(R6*C2)",
    ("force", 1, 0): "1/(R12*C4)",
}


def circuit_in_second_order_form(found: tuple[Term, ...]) -> dict[Quantity, sp.Expr]:
    """Eliminate the velocities from the integrators' own equations.

    An inverting integrator with input s through R on C follows v' = -s/(R C); an inverter turns
    the sign of s; the generator stands at phase π, so its input is -VM sin.
    """
    n = 1 + max(t.quantity[1] for t in found)
    v = [sp.Symbol(f"v{i}") for i in range(2 * n)]
    drive = sp.Symbol("VM")
    rate = [sp.Integer(0)] * (2 * n)
    for t in found:
        r, c = (sp.Symbol(f"part_{x}", positive=True) for x in (t.resistor, f"C{t.state + 1}"))
        source = -drive if t.source is None else (-1 if t.inverted else 1) * v[t.source]
        rate[t.state] -= source / (r * c)
    out: dict[Quantity, sp.Expr] = {}
    for i in range(n):
        # v_2i' = v_2i+1/T_i, so v_2i+1 = T_i v_2i' and v_2i+1' = T_i v_2i''.
        T = [1 / rate[2 * j].coeff(v[2 * j + 1]) for j in range(n)]
        out["mass", i, i] = T[i]
        for j in range(n):
            damping = sp.expand(rate[2 * i + 1]).coeff(v[2 * j + 1])
            out["damping", i, j] = -damping * T[j]
            out["stiffness", i, j] = -sp.expand(rate[2 * i + 1]).coeff(v[2 * j])
        out["force", i, 0] = sp.expand(rate[2 * i + 1]).coeff(drive)
    return {key: value for key, value in out.items() if value != 0}


def test_eq_14_as_corrected() -> None:
    realised = circuit_in_second_order_form(terms(DAMPING, STIFFNESS, [P1, P2], sign))
    assert set(realised) == set(CORRECTED_14)
    for quantity, value in realised.items():
        assert sp.simplify(value - parts(CORRECTED_14[quantity])) == 0, quantity


@pytest.mark.parametrize(
    ("damping", "stiffness", "force"),
    [
        (DAMPING, STIFFNESS, [P1, P2]),
        (DAMPING, STIFFNESS, [P1, 0]),
        (DAMPING, STIFFNESS, [0, P2]),
        ([[C1, 0], [0, C2]], STIFFNESS, [P1, P2]),
        ([[C1]], [[K1]], [P1]),
        (
            [[C1, -C1, 0], [-C1, C1 + C2, -C2], [0, -C2, C2]],
            [[K1, -K1, 0], [-K1, K1 + K2, -K2], [0, -K2, K2]],
            [P1, 0, 0],
        ),
    ],
    ids=["paper", "driven at M1", "driven at M2", "no coupling damper", "one mass", "three masses"],
)
def test_every_term_is_realised_with_its_sign_and_no_other(
    damping: list[list[Any]], stiffness: list[list[Any]], force: list[Any]
) -> None:
    truth = circuit_in_second_order_form(terms(damping, stiffness, force, sign))
    wanted: dict[Quantity, Any] = {}
    wanted |= {("damping", i, j): e for i, row in enumerate(damping) for j, e in enumerate(row)}
    wanted |= {("stiffness", i, j): e for i, row in enumerate(stiffness) for j, e in enumerate(row)}
    wanted |= {("force", i, 0): e for i, e in enumerate(force)}
    for quantity, entry in wanted.items():
        assert (quantity in truth) is (sign(entry) != 0), "a zero term has no part"
        if quantity in truth:
            positive = truth[quantity].is_positive
            assert positive is (sign(entry) > 0), "every sign can be realised"


def test_numbers_and_nets_are_the_paper_s() -> None:
    found = terms(DAMPING, STIFFNESS, [P1, P2], sign)
    assert [t.resistor for t in found] == [f"R{i}" for i in range(1, 13)]
    assert [t.state for t in found] == [0] + [1] * 5 + [2] + [3] * 5
    assert inverted_states(found) == (0, 1, 2, 3)


def test_the_paper_s_case_has_no_r12() -> None:
    found = terms(DAMPING, STIFFNESS, [P1, 0], sign)
    assert "R12" not in {t.resistor for t in found}
    assert len(found) == 11


@given(seed=st.integers(0, 10**6), n=st.integers(1, 6))
def test_one_integrator_a_state_one_resistor_a_coefficient(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    damping, stiffness = (rng.integers(-1, 2, (n, n)).astype(float) for _ in range(2))
    force = rng.integers(-1, 2, n).astype(float)
    found = terms(damping.tolist(), stiffness.tolist(), force.tolist())
    count = n + int((damping != 0).sum() + (stiffness != 0).sum() + (force != 0).sum())
    assert len(found) == count
    names = [t.resistor for t in found]
    assert len(set(names)) == count
    assert [t.state for t in found if t.quantity[0] == "mass"] == list(range(0, 2 * n, 2))
    for t in found:
        kind, i, j = t.quantity
        assert t.state == 2 * i + (kind != "mass")
        if kind == "damping":
            assert t.source == 2 * j + 1
            assert t.inverted == (damping[i, j] < 0)
        if kind == "stiffness":
            assert t.source == 2 * j
            assert t.inverted == (stiffness[i, j] < 0)
    needed = {t.source for t in found if t.inverted and t.source is not None}
    assert set(inverted_states(found)) == needed
