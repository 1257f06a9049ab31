"""Eq. (1)-(5): domains, the way there and back, and that both forms say the same of the motion."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, strategies as st

from designer.base.errors import InputError
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.clearance import Clearance
from designer.model.mechanics import SecondOrderSystem
from designer.model.model import Dimensionless, Mechanical
from tests.shared.oracles import Plain, model_matrix

PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
HAMMER = Mechanical(
    M1=2.0, M2=3.0, C1=56.0, C2=24.0, K0=540e3, K1=60e3, K2=40e3, B=0.5e-3, P1=80.0, P2=20.0
)

share = st.floats(0.01, 0.99)
positive = st.floats(1e-6, 1e6)


@st.composite
def dimensionless(draw: st.DrawFn) -> Dimensionless:
    return Dimensionless(
        m=draw(share),
        k=draw(share),
        k0=draw(st.floats(0.0, 0.999)),
        c=draw(st.floats(0.0, 0.99)),
        zeta=draw(st.floats(1e-4, 5.0)),
        f20=draw(st.floats(0.0, 1.0)),
        b=draw(positive),
        sides=draw(st.sampled_from(["both", "upper", "lower"])),
    )


@given(model=dimensionless(), M1=positive, K1=positive, force=positive)
def test_round_trip_from_dimensionless(
    model: Dimensionless, M1: float, K1: float, force: float
) -> None:
    back = Mechanical.from_dimensionless(model, M1=M1, K1=K1, force=force).dimensionless()
    for f in fields(model):
        got, want = getattr(back, f.name), getattr(model, f.name)
        if f.name == "sides":
            assert got == want
        else:
            assert got == pytest.approx(want, rel=1e-11, abs=1e-15), f.name


@given(values=st.lists(st.floats(1e-3, 1e3), min_size=10, max_size=10))
def test_round_trip_from_mechanical(values: list[float]) -> None:
    names = [f.name for f in fields(Mechanical) if f.name != "sides"]
    one = Mechanical(**dict(zip(names, values, strict=True)))  # type: ignore[arg-type]
    two = Mechanical.from_dimensionless(
        one.dimensionless(), M1=one.M1, K1=one.K1, force=one.P1 + one.P2
    )
    for name in names:
        assert getattr(two, name) == pytest.approx(getattr(one, name), rel=1e-8), name


def test_the_hammer_is_what_the_example_says() -> None:
    """The figures in the comment at the top of examples/drill.toml."""
    got = HAMMER.dimensionless()
    assert (got.m, got.k, got.k0, got.c, got.f20, got.b) == pytest.approx(
        (0.6, 0.4, 0.9, 0.3, 0.2, 0.3)
    )
    assert got.zeta == pytest.approx(0.081, abs=5e-4)
    assert HAMMER.scales.omega(340.0) == pytest.approx(340.0 * math.sqrt(2.0 / 60e3))


def test_the_paper_case() -> None:
    assert PAPER.mu == pytest.approx(19.0)
    system = PAPER.second_order()
    assert system.mass == pytest.approx([1.0, 1.0])
    assert system.damping == pytest.approx(np.array([[0.2, -0.2], [-0.2, 0.4]]))
    assert system.stiffness == pytest.approx(np.array([[1.0, -1.0], [-1.0, 2.0]]))
    assert system.force == pytest.approx([1.0, 0.0])
    assert system.clearances == (Clearance.even(0, PAPER.mu, 0.25),)


def test_corrected_eq_4_follows_from_eq_1() -> None:
    """Symbolically: Eq. (1)-(2) under the substitution of Eq. (3), term by term."""
    M1, M2, C1, C2, K0, K1, K2, P1, P2 = sp.symbols("M1 M2 C1 C2 K0 K1 K2 P1 P2", positive=True)
    m, k, k0, c = M2 / (M1 + M2), K2 / (K1 + K2), K0 / (K0 + K1), C2 / (C1 + C2)
    zeta, f20 = C1 / (2 * sp.sqrt(K1 * M1)), P2 / (P1 + P2)
    T, X = sp.sqrt(M1 / K1), (P1 + P2) / K1  # seconds and metres per unit
    unit = P1 + P2  # newtons per unit
    pairs = [
        (M2 * X / T**2 / unit, m / (1 - m)),
        (C1 * X / T / unit, 2 * zeta),
        ((C1 + C2) * X / T / unit, 2 * zeta / (1 - c)),
        ((K1 + K2) * X / unit, 1 / (1 - k)),
        (K0 * X / unit, k0 / (1 - k0)),
        (P1 / unit, 1 - f20),
        (P2 / unit, f20),
    ]
    for physical, printed in pairs:
        assert sp.simplify(physical - printed) == 0


@given(model=dimensionless())
def test_state_matrix_is_that_of_the_equations(model: Dimensionless) -> None:
    p = Plain(model.m, model.k, model.k0, model.c, model.zeta, model.f20, model.b)
    got = model.second_order().state_matrix()
    assert np.abs(got - model_matrix(p)).max() <= 1e-12 * np.abs(got).max()


@pytest.mark.parametrize("sides", ["both", "upper", "lower"])
def test_si_trajectory_is_the_dimensionless_one_scaled(sides: str) -> None:
    given = replace(HAMMER, sides=sides)  # type: ignore[arg-type]
    si, model, Omega = given.scales, given.dimensionless(), 200.0
    slow = Flow(model.second_order().piecewise_linear(), Drive(si.omega(Omega)))
    fast = Flow(given.second_order().piecewise_linear(), Drive(Omega))
    start = np.array([0.1, 0.2, -0.1, 0.05])
    X, T = si.length_scale, si.time_scale
    units = np.array([X, X / T, X, X / T])
    a = slow.run(start, 5, measure=True)
    b = fast.run(start * units, 5, measure=True)
    assert b.strobes / units == pytest.approx(a.strobes, abs=1e-11)
    assert b.counts.tolist() == a.counts.tolist()
    assert a.counts.sum() > 0
    assert b.impacts.time / T == pytest.approx(a.impacts.time, abs=1e-10)
    assert b.penetration / X == pytest.approx(a.penetration, abs=1e-11)


OUTSIDE = [
    *((name, value) for name in ("m", "k") for value in (0.0, 1.0, -0.1, 1.1)),
    *((name, value) for name in ("k0", "c") for value in (1.0, -1e-9, 2.0)),
    *(("zeta", value) for value in (0.0, -0.1)),
    *(("f20", value) for value in (-1e-9, 1.0 + 1e-9)),
    *(("b", value) for value in (0.0, -1.0)),
    *((name, value) for name in "m k k0 c zeta f20 b".split() for value in (math.nan, math.inf)),
    ("sides", "left"),
]


@pytest.mark.parametrize(("name", "value"), OUTSIDE)
def test_values_outside_their_domain_are_refused_by_name(name: str, value: object) -> None:
    with pytest.raises(InputError) as caught:
        replace(PAPER, **{name: value})  # type: ignore[arg-type]
    assert caught.value.field == f"model.{name}"
    assert caught.value.exit_status == 2


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *((name, bad) for name in "M1 M2 C1 K1 K2 B".split() for bad in (0.0, -1.0)),
        *((name, -1.0) for name in "C2 K0 P1 P2".split()),
        *((f.name, math.nan) for f in fields(Mechanical) if f.name != "sides"),
        *((f.name, math.inf) for f in fields(Mechanical) if f.name != "sides"),
        ("sides", "none"),
    ],
)
def test_mechanical_values_outside_their_domain_are_refused(name: str, value: object) -> None:
    with pytest.raises(InputError) as caught:
        replace(HAMMER, **{name: value})  # type: ignore[arg-type]
    assert caught.value.field == f"mechanical.{name}"


def test_a_model_without_force_is_refused() -> None:
    with pytest.raises(InputError, match="P1 \\+ P2"):
        replace(HAMMER, P1=0.0, P2=0.0)


@pytest.mark.parametrize(
    "edge", [{"k0": 0.0}, {"c": 0.0}, {"f20": 0.0}, {"f20": 1.0}, {"k0": 0.999999}]
)
def test_closed_ends_of_the_domains_are_in(edge: dict[str, float]) -> None:
    model = replace(PAPER, **edge)  # type: ignore[arg-type]
    assert bool(model.second_order().clearances) is (model.k0 > 0.0)
    model.second_order().piecewise_linear()


def test_no_clearance_is_one_mode_without_guards() -> None:
    system = replace(PAPER, k0=0.0).second_order().piecewise_linear()
    assert system.mode(system.start).guards == ()
    assert system.clearances == ()


@pytest.mark.parametrize("sides", ["both", "upper", "lower"])
@given(x=st.floats(-2.0, 2.0), v=st.floats(-2.0, 2.0))
def test_restoring_force_is_the_clipped_difference(sides: str, x: float, v: float) -> None:
    """A x + d in the mode that holds at x is f(x) = mu (x - clip(x, -b, b)), sides counted."""
    system = replace(PAPER, sides=sides).second_order().piecewise_linear()  # type: ignore[arg-type]
    state = np.array([x, v, 0.3, -0.2])
    mode = system.mode(system.mode_at(state, 0.0))
    upper = max(x - 0.25, 0.0) if sides != "lower" else 0.0
    lower = min(x + 0.25, 0.0) if sides != "upper" else 0.0
    want = -x - 0.2 * v + 0.3 + 0.2 * -0.2 - PAPER.mu * (upper + lower)
    assert (mode.A @ state + mode.d)[1] == pytest.approx(want, abs=1e-12)
    assert all(g.C @ state + g.e <= 0.0 for g in mode.guards)


def test_clearances_on_any_mass() -> None:
    """Three masses, stops on the second and third: keys, sides and displacements in their order."""
    system = SecondOrderSystem(
        np.array([1.0, 2.0, 3.0]),
        0.1 * np.eye(3),
        np.eye(3),
        np.array([0.0, 1.0, 0.0]),
        (Clearance.even(1, 8.0, 0.5), Clearance.even(2, 9.0, 0.25, "lower", "B")),
    ).piecewise_linear()
    assert system.states == ("x1", "x1'", "x2", "x2'", "x3", "x3'")
    assert [int(np.argmax(row)) for row in system.displacement] == [2, 4]
    assert system.mirror is None
    assert system.mode_at(np.array([9.0, 0, 0.6, 0, -0.3, 0]), 0.0) == (1, -1)
    assert system.mode_at(np.array([9.0, 0, -0.6, 0, 0.3, 0]), 0.0) == (-1, 0)
    mode = system.mode((1, -1))
    assert mode.A[3, 2] == pytest.approx(-(1.0 + 8.0) / 2.0)
    assert mode.d[3] == pytest.approx(8.0 * 0.5 / 2.0)
    assert mode.A[5, 4] == pytest.approx(-(1.0 + 9.0) / 3.0)
    assert mode.d[5] == pytest.approx(-9.0 * 0.25 / 3.0)
