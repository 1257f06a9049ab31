"""Linear blocks of any pattern of terms against full enumeration of small catalogues."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import linprog

from designer.base.arrays import Array
from designer.base.eseries import series_values
from designer.circuit.coefficients import EXACT
from designer.circuit.scale_fit import minimax
from designer.circuit.terms import terms
from designer.linear_network import linear_search
from designer.linear_network.linear_block import errors_of
from designer.linear_network.linear_search import best
from designer.linear_network.linear_terms import (
    ANY,
    Bounds,
    LinearBlock,
    LinearQuestion,
    Shortfall,
    Targets,
)
from designer.linear_network.term_search import LOWER, TermConditions, TermDives, TermSearch
from designer.model.circuit_table import CircuitSpec
from designer.synthesis.attempt import _in_ratio
from designer.synthesis.dead_zone_target import slope_interval
from tests.shared.exploring import quick
from tests.shared.term_enumeration import Everything, Limits, everything, term_name

CLOSE = 1e-7
"""Of two errors: the reported one is by linear programming, whose tolerance this is."""
SINGLE = np.array([[0, 1], [1, 1]])
UNDAMPED = np.array([[0, 1], [1, 0]])
NO_COUPLING_DAMPER = np.array([[0, 1, 0, 0], [1, 1, 1, 0], [0, 0, 0, 1], [1, 0, 1, 1]])
ONE_DAMPER = np.array([[0, 1, 0, 0], [1, 1, 1, 0], [0, 0, 0, 1], [1, 0, 1, 0]])
APART = np.array([[0, 1, 0, 0], [1, 1, 0, 0], [0, 0, 0, 1], [0, 0, 1, 1]])
CHAIN = np.zeros((6, 6), dtype=int)
CHAIN[0::2, 1::2] = np.eye(3)
CHAIN[1::2, 0::2] = np.tri(3, k=1) * np.tri(3, k=1).T
CHAIN[1::2, 1::2] = np.eye(3)
PATTERNS = {
    "one mass": (SINGLE, 3, 3),
    "no damper": (UNDAMPED, 2, 2),
    "no coupling damper": (NO_COUPLING_DAMPER, 2, 2),
    "one damper": (ONE_DAMPER, 3, 2),
    "apart": (APART, 3, 2),
    "chain of three": (CHAIN, 2, 1),
}


def catalogue(rng: np.random.Generator, n: int, m: int) -> tuple[Array, Array]:
    resistors = 1e4 * 2.0 ** np.arange(n) * np.exp(rng.normal(0.0, 0.02, n))
    capacitors = 1e-8 * 2.0 ** np.arange(m) * np.exp(rng.normal(0.0, 0.02, m))
    return np.asarray(resistors), np.asarray(capacitors)


def near_exact(pattern: Array, resistors: Array, capacitors: Array, seed: int) -> Array:
    """A state matrix of this pattern that some choice of the catalogue meets within a per cent."""
    rng = np.random.default_rng(seed)
    volts = np.exp(rng.normal(0.0, 0.2, len(pattern)))
    c = rng.choice(capacitors, len(pattern))
    A = np.zeros(pattern.shape)
    for a, b in np.argwhere(pattern):
        A[a, b] = 1e-3 / (rng.choice(resistors) * c[a]) * volts[b] / volts[a]
        A[a, b] *= np.exp(rng.normal(0.0, 0.005)) if a % 2 else 1.0
    # The displacement's rate is the velocity itself: its unit is free.
    unit = np.ones(len(A))
    unit[1::2] = A[0::2, 1::2].diagonal()
    return A * unit[:, None] / unit[None, :]


def bounds_of(limits: Limits, states: int) -> Bounds:
    peaks = np.array(limits.peaks or np.ones(states))
    return Bounds(limits.seconds, limits.level, limits.share, limits.stop, peaks, mass=limits.mass)


def compare(
    answer: LinearBlock | Shortfall,
    truth: Everything,
    slack: float = 0.0,
    preferred: frozenset[float] = frozenset(),
) -> None:
    """The answer against every choice that is allowed."""
    if len(truth.errors) == 0 or truth.errors.min() > linear_search.LAST_LEVEL:
        assert isinstance(answer, Shortfall), "parts where none are allowed"
        return
    least = float(truth.errors.min())
    assert isinstance(answer, LinearBlock), answer
    assert answer.proved
    assert answer.bound <= least + CLOSE
    assert answer.least <= max(least, EXACT) + CLOSE
    own = (truth.values == [answer.values[name] for name in truth.names]).all(axis=1)
    (row,) = np.flatnonzero(own)  # one of the allowed ones
    assert truth.errors[row] == pytest.approx(answer.error, abs=CLOSE)
    equals = truth.errors <= max(least, EXACT) + slack
    kinds = truth.kinds(preferred)
    assert kinds[row] <= kinds[equals].min()


def solve(
    A: Array, resistors: Array, capacitors: Array, limits: Limits, **asked: Any
) -> LinearBlock | Shortfall:
    spec = CircuitSpec(**asked) if asked else ANY
    bounds = bounds_of(limits, len(A))
    prices = np.ones(len(capacitors))
    return best(Targets.from_state_matrix(A), resistors, capacitors, prices, bounds, spec)


@pytest.mark.parametrize("name", quick(PATTERNS))
@settings(max_examples=3)
@given(seed=st.integers(0, 10**6))
def test_every_choice_of_a_small_catalogue(name: str, seed: int) -> None:
    pattern, n, m = PATTERNS[name]
    resistors, capacitors = catalogue(np.random.default_rng(seed), n, m)
    A = near_exact(pattern, resistors, capacitors, seed)
    truth = everything(A, resistors, capacitors)
    if name == "apart":
        # The volts of one mass against the other's are free; the package makes peaks equal.
        truth = truth.keeping(Limits())
    compare(solve(A, resistors, capacitors, Limits()), truth)


@pytest.mark.parametrize("name", quick(["one mass", "one damper", "no coupling damper"]))
@settings(max_examples=4)
@given(seed=st.integers(0, 10**6))
def test_every_choice_under_side_conditions(name: str, seed: int) -> None:
    pattern, n, m = PATTERNS[name]
    rng = np.random.default_rng(seed)
    resistors, capacitors = catalogue(rng, n, m)
    A = near_exact(pattern, resistors, capacitors, seed)
    seconds = np.sort(1e-3 * np.exp(rng.uniform(-2.0, 2.0, 2)))
    limits = Limits(
        seconds=(float(seconds[0]), float(seconds[1])),
        level=float(np.exp(rng.uniform(0.3, 3.0))),
        share=float(np.exp(rng.uniform(0.0, 3.0))),
        stop=float(1e4 * np.exp(rng.uniform(-0.5, 0.7))),
        mass=int(rng.integers(len(A) // 2)),
        peaks=tuple(np.exp(rng.normal(0.0, 0.4, len(A))).tolist()),
    )
    truth = everything(A, resistors, capacitors).keeping(limits)
    compare(solve(A, resistors, capacitors, limits), truth)


MATCHED = [
    (("R1", "R8"),),
    (("C2", "C4"), ("C1", "C3")),
    (("R4", "R11"), ("R7", "R1"), ("C4", "C1")),
    (("R10", "R5", "R2"), ("R50", "R204")),
]


@pytest.mark.parametrize("matched", MATCHED, ids=str)
@pytest.mark.parametrize("seed", quick(range(2)))
def test_every_choice_with_matched_parts(matched: tuple[tuple[str, ...], ...], seed: int) -> None:
    resistors, capacitors = catalogue(np.random.default_rng(seed), 2, 2)
    A = near_exact(NO_COUPLING_DAMPER, resistors, capacitors, seed)
    limits = Limits(matched=matched)
    truth = everything(A, resistors, capacitors).keeping(limits)
    compare(solve(A, resistors, capacitors, limits, matched=matched), truth)


def test_conditions_at_scales_that_leave_no_error_are_those_of_the_bounds() -> None:
    """Errors that such scales take away are -(T + p_b - p_a) of the term from state b to the rate
    of a: then those are the nominal scales, and ratios of peak voltages are known."""
    rng = np.random.default_rng(4)
    targets = Targets.from_state_matrix(NO_COUPLING_DAMPER * np.exp(rng.normal(size=(4, 4))))
    peaks = np.exp(rng.normal(0.0, 0.4, 4))
    conditions = TermConditions(targets, Bounds((0.7, 1.6), 2.5, 1.8, 0.0, peaks, mass=1))
    held = 0
    for _ in range(400):
        seconds, logs = rng.normal(0.0, 0.3), np.append(0.0, rng.normal(0.0, 0.5, 3))
        offsets = -np.array([seconds + logs[b] - logs[a] for a, b in targets.entries])
        volts = np.exp(logs) * peaks
        together = [volts[:2], volts[2:], volts[1::2]]  # of one mass, of one mass, velocities
        wanted = (
            0.7 <= np.exp(seconds) <= 1.6
            and all(pair.max() <= 2.5 * pair.min() for pair in together)
            and volts.max() <= 1.8 * volts[2]
        )
        assert conditions.hold(offsets) is bool(wanted)
        held += bool(wanted)
    assert 20 < held < 380


@pytest.mark.parametrize("most", [2, 3, 4])
@pytest.mark.parametrize("slack", [0.0, 0.02])
def test_every_choice_of_few_values(most: int, slack: float) -> None:
    resistors, capacitors = catalogue(np.random.default_rng(most), 3, 2)
    A = near_exact(ONE_DAMPER, resistors, capacitors, most)
    preferred = frozenset([float(resistors[0])])
    limits = Limits(most=most, preferred=preferred)
    truth = everything(A, resistors, capacitors).keeping(limits)
    asked = {"most_values": most, "preferred": tuple(preferred), "slack": slack}
    compare(solve(A, resistors, capacitors, limits, **asked), truth, slack, preferred)


def test_the_cheapest_of_equals_is_taken() -> None:
    """Capacitors and resistors that are twice as large each give the same products."""
    resistors, capacitors = np.array([1e4, 2e4, 4e4]), np.array([1e-8, 2e-8])
    A = np.array([[0.0, 1.0], [-4.0, -1.0]])
    for prices in ([1.0, 5.0], [5.0, 1.0]):
        bounds = bounds_of(Limits(), 2)
        answer = best(Targets.from_state_matrix(A), resistors, capacitors, np.array(prices), bounds)
        assert isinstance(answer, LinearBlock)
        truth = everything(A, resistors, capacitors)
        equals = truth.take(truth.errors <= EXACT)
        fewest = equals.take(equals.kinds() == equals.kinds().min())
        price = np.array(prices)[np.searchsorted(capacitors, fewest.values[:, -2:])].sum(axis=1)
        own = [prices[np.searchsorted(capacitors, answer.values[f"C{i}"])] for i in (1, 2)]
        assert len(set(answer.values.values())) == fewest.kinds().min()
        assert sum(own) == price.min()


@pytest.mark.parametrize("steps", quick([400, 8_000, 100_000]))
def test_a_lower_bound_is_one_where_the_work_runs_out(
    steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(linear_search, "MOST_STEPS", steps)
    resistors, capacitors = catalogue(np.random.default_rng(3), 2, 2)
    A = near_exact(NO_COUPLING_DAMPER, resistors, capacitors, 3)
    truth = float(everything(A, resistors, capacitors).errors.min())
    answer = solve(A, resistors, capacitors, Limits())
    if isinstance(answer, Shortfall):
        assert not answer.whole
        return
    assert answer.bound <= truth + CLOSE
    assert answer.error >= truth - CLOSE
    assert answer.proved is (answer.error <= answer.bound + EXACT)


@pytest.mark.parametrize("name", quick(["one damper", "no coupling damper", "chain of three"]))
def test_dives_find_a_choice_near_the_best_there_is(name: str) -> None:
    """Against every choice: one that keeps the conditions, and the same one each time."""
    pattern, n, m = PATTERNS[name]
    resistors, capacitors = catalogue(np.random.default_rng(5), n, m)
    A = near_exact(pattern, resistors, capacitors, 5)
    limits = Limits(level=20.0)
    truth = everything(A, resistors, capacitors).keeping(limits)
    question = LinearQuestion(
        Targets.from_state_matrix(A), resistors, capacitors, np.ones(m),
        bounds_of(limits, len(A)), ANY,
    )  # fmt: skip
    first, second = (TermDives(TermSearch(question)).best(EXACT, 4_000_000) for _ in range(2))
    assert (first.error, first.parts.tolist()) == (second.error, second.parts.tolist())
    assert truth.errors.min() - CLOSE <= first.error <= truth.errors.min() / LOWER + CLOSE
    terms_here = len(question.targets.entries)
    values = [*resistors[first.parts[:terms_here]], *capacitors[first.parts[terms_here:]]]
    named = dict(zip(question.targets.parts, values, strict=True))
    own = (truth.values == [named[part] for part in truth.names]).all(axis=1)
    (row,) = np.flatnonzero(own)
    assert truth.errors[row] == pytest.approx(first.error, abs=CLOSE)


@pytest.mark.slow
@pytest.mark.parametrize("pattern", [SINGLE, NO_COUPLING_DAMPER], ids=["one mass", "two masses"])
def test_series_are_proved(pattern: Array) -> None:
    resistors, capacitors = series_values(["E96"], 4.7e3, 5e5), series_values(["E12"], 1e-9, 1e-6)
    rng = np.random.default_rng(1)
    A = pattern * np.exp(rng.uniform(-0.7, 0.7, pattern.shape))
    A[0::2] = pattern[0::2]
    seconds = 1.0 / (2e3 * np.pi), 1.0 / (100 * np.pi)
    limits = Limits(seconds=seconds, level=4.0, share=1.6)
    answer = solve(A, resistors, capacitors, limits)
    assert isinstance(answer, LinearBlock)
    assert answer.proved
    assert answer.error < 2e-5
    assert answer == solve(A, resistors, capacitors, limits)  # the same answer each time


@pytest.mark.parametrize("masses", [1, 2, 3, 5])
def test_names_and_values_are_those_of_the_circuit_s_terms(masses: int) -> None:
    """The resistors of ``circuit.terms``, and errors that their products of values give."""
    rng = np.random.default_rng(masses)
    full = rng.uniform(0.5, 2.0, (2, masses, masses))
    A = np.zeros((2 * masses, 2 * masses))
    A[0::2, 1::2] = np.eye(masses)
    A[1::2, 0::2], A[1::2, 1::2] = -full[0], -full[1]
    if masses == 5:
        A[1, 6] = 0.0
    targets = Targets.from_state_matrix(A)
    of_circuit = terms((-A[1::2, 1::2]).tolist(), (-A[1::2, 0::2]).tolist(), [0.0] * masses)
    assert sorted(targets.resistors) == sorted(t.resistor for t in of_circuit)
    named = [term_name(masses, a, b) for a, b in targets.entries]
    assert list(targets.resistors) == named
    values = {name: float(np.exp(rng.normal(0.0, 0.1))) for name in targets.parts}
    errors = errors_of(values, targets)
    scales = minimax(errors.offsets, errors.columns)
    volts = np.concatenate([[1.0], np.exp(errors.volts @ scales)[1:]])
    # T of the first mass's rate, taken back: rate = T + x - v - c.
    rate = float(errors.rates[0] @ scales + errors.rate_offsets[0])
    tau = np.exp(rate) * volts[1] * values["C2"]
    products = [
        tau * volts[b] / volts[a] / (values[r] * values[f"C{a + 1}"] * abs(A[a, b]))
        for r, (a, b) in zip(targets.resistors, targets.entries, strict=True)
    ]
    worst = float(np.abs(np.log(products)).max())
    assert worst == pytest.approx(np.abs(errors.offsets + errors.columns @ scales).max(), abs=1e-9)


def test_three_masses_carry_a_bound_and_a_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a hundredth of the work: the answer is no proof, and the bound is below it."""
    monkeypatch.setattr(linear_search, "MOST_STEPS", linear_search.MOST_STEPS // 100)
    monkeypatch.setattr(TermSearch, "growth", 1.6)
    resistors, capacitors = series_values(["E24"], 4.7e3, 5e5), series_values(["E12"], 1e-9, 1e-6)
    A = CHAIN * np.exp(np.random.default_rng(0).uniform(-0.5, 0.5, (6, 6)))
    A[0::2] = CHAIN[0::2]
    seconds = 1.0 / (2e3 * np.pi), 1.0 / (100 * np.pi)
    answer = solve(A, resistors, capacitors, Limits(seconds=seconds, level=4.0, share=1.6))
    assert isinstance(answer, LinearBlock)
    assert 0.0 < answer.bound < answer.error < 0.02
    errors = errors_of(answer.values, Targets.from_state_matrix(A))
    fresh = errors.offsets + errors.columns @ minimax(errors.offsets, errors.columns)
    assert np.abs(fresh).max() == pytest.approx(answer.error, abs=CLOSE)


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), tied=st.booleans())
def test_the_drive_of_three_masses_is_the_nearest_in_ratio(seed: int, tied: bool) -> None:
    """Against every choice; two of the resistors are equal, or none."""
    rng = np.random.default_rng(seed)
    volts, values = rng.uniform(1e-4, 3e-4, 3), series_values(["E12"], 1e4, 1e5)
    roots = ["R8", "R8", "R24"] if tied else ["R8", "R16", "R24"]
    lists = dict.fromkeys(roots, values)
    chosen = np.array(_in_ratio(volts, roots, lists, 8.0))
    every = np.array(list(itertools.product(values, repeat=3)))
    every = every[every[:, 0] == every[:, 1]] if tied else every
    needed = np.log(volts * every)
    spread = np.ptp(needed, axis=1)
    amplitude = np.exp(needed.mean(axis=1))
    spread = spread[(amplitude <= 8.0) & (amplitude >= 0.2 * 8.0)]
    assert np.ptp(np.log(volts * chosen)) == pytest.approx(spread.min(), abs=1e-9)
    assert np.exp(np.log(volts * chosen).mean()) <= 8.0 * (1.0 + 1e-9)


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6), mass=st.integers(0, 2))
def test_the_freedom_of_a_stop_on_any_mass(seed: int, mass: int) -> None:
    """A gain at an end of the interval fits with no larger error; one beyond it does not."""
    rng = np.random.default_rng(seed)
    A = CHAIN * np.exp(rng.uniform(-0.5, 0.5, (6, 6)))
    A[0::2] = CHAIN[0::2]
    targets = Targets.from_state_matrix(A)
    values = {name: float(np.exp(rng.normal(0.0, 0.05))) for name in targets.parts}
    low, high = slope_interval(values, targets, 3.0, mass)
    own = (2 * mass + 1, 2 * mass)

    def least(gain: float) -> float:
        """The least error with the stop's own: gain/C tau v_x/v_v over the wanted 3.0."""
        rows = [*targets.entries, own]
        h = [-np.log(values[r] * values[f"C{a + 1}"] * abs(A[a, b])) for r, (a, b) in
             zip(targets.resistors, targets.entries, strict=True)]  # fmt: skip
        h.append(np.log(gain / values[f"C{own[0] + 1}"] / 3.0))
        D = np.zeros((len(rows), 7))
        for row, (a, b) in zip(D, rows, strict=True):
            row[0] = 1.0
            row[1 + b] += 1.0
            row[1 + a] -= 1.0
        D = np.delete(D, 1, axis=1)
        slack = np.r_[np.ones(len(rows) - 1), 0.0]  # the stop's error is none
        found = linprog(
            np.r_[np.zeros(6), 1.0],
            A_ub=np.block([[D, -slack[:, None]], [-D, -slack[:, None]]]),
            b_ub=np.concatenate([-np.array(h), h]),
            bounds=[(None, None)] * 7,
        )
        assert found.fun is not None
        return float(found.fun)

    errors = errors_of(values, targets)
    scales = minimax(errors.offsets, errors.columns)
    best_error = np.abs(errors.offsets + errors.columns @ scales).max()
    for end, beyond in ((low, 0.999), (high, 1.001)):
        assert least(end) == pytest.approx(best_error, abs=1e-8)
        assert least(end * beyond) > best_error + 1e-6
