"""The best linear block against full enumeration, with and without conditions and wishes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.arrays import Array
from designer.base.eseries import series_values
from designer.circuit.coefficients import EXACT
from designer.linear_network import linear_search
from designer.linear_network.linear_search import best
from designer.linear_network.linear_terms import ANY, Bounds, LinearBlock, Shortfall, Targets
from designer.model.circuit_table import CircuitSpec
from designer.model.model import Dimensionless
from tests.linear_network.test_linear_block import OPEN, random_model, targets_of, wanted_of
from tests.shared.exploring import quick, seeds
from tests.shared.linear_enumeration import Choices, Conditions, every_choice
from tests.shared.oracles import LINEAR_NAMES

CLOSE = 1e-7
"""Of two errors: the reported one is by linear programming, whose tolerance this is."""


def near_exact(rng: np.random.Generator) -> tuple[Dimensionless, Array, Array]:
    """A model that a three-by-two catalogue meets within a few per cent."""
    resistors = np.array([10e3, 20e3, 40e3]) * np.exp(rng.normal(0.0, 0.01, 3))
    capacitors = np.array([10e-9, 100e-9]) * np.exp(rng.normal(0.0, 0.01, 2))
    model = Dimensionless(
        m=0.5 + rng.normal(0, 0.01), k=0.5 + rng.normal(0, 0.01), k0=0.0,
        c=0.5 + rng.normal(0, 0.01), zeta=0.25 * np.exp(rng.normal(0, 0.02)), f20=0.0, b=0.25,
    )  # fmt: skip
    return model, resistors, capacitors


def truth_of(t: Targets, resistors: Array, capacitors: Array) -> Choices:
    wanted = wanted_of(t)
    return every_choice(
        tuple(resistors.tolist()),
        tuple(capacitors.tolist()),
        tuple(wanted[name] for name in LINEAR_NAMES),
    )


def compare(
    answer: LinearBlock | Shortfall,
    truth: Choices,
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
    assert answer.least == pytest.approx(least, abs=1e-10)
    assert answer.bound <= least + 1e-10
    assert answer.error <= least + slack + CLOSE
    same = np.ones(len(truth.errors), dtype=bool)
    for name, value in answer.values.items():
        same &= truth.values(name) == value
    (own,) = np.flatnonzero(same)  # one of the allowed ones
    assert truth.errors[own] == pytest.approx(answer.error, abs=CLOSE)
    equals = truth.errors <= least + slack + 1e-10
    kinds = truth.kinds(preferred)
    assert kinds[own] <= kinds[equals].min()


@pytest.mark.parametrize("seed", quick(seeds(3)))
def test_every_choice_of_a_small_catalogue(seed: int) -> None:
    model, resistors, capacitors = near_exact(np.random.default_rng(seed))
    t = targets_of(model)
    truth = truth_of(t, resistors, capacitors)
    compare(best(t, resistors, capacitors, np.ones(2), OPEN), truth)


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), shape=st.sampled_from([(2, 2), (2, 3), (1, 3), (3, 1)]))
def test_every_choice_of_random_catalogues(seed: int, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(seed)
    resistors = 1e4 * np.exp(rng.normal(0.0, 0.1, shape[0])) * 2.0 ** np.arange(shape[0])
    capacitors = 1e-8 * np.exp(rng.normal(0.0, 0.1, shape[1])) * 2.0 ** np.arange(shape[1])
    t = targets_of(random_model(rng))
    truth = truth_of(t, resistors, capacitors)
    compare(best(t, resistors, capacitors, np.ones(shape[1]), OPEN), truth)


def conditions(rng: np.random.Generator) -> tuple[Bounds, Conditions]:
    """Conditions that cut into what a small catalogue allows."""
    seconds = tuple(float(v) for v in np.sort(1e-3 * np.exp(rng.uniform(-2.0, 2.0, 2))))
    level, share = float(np.exp(rng.uniform(0.3, 3.0))), float(np.exp(rng.uniform(0.0, 3.0)))
    stop = float(1e4 * np.exp(rng.uniform(-0.5, 1.0)))
    peaks = tuple(float(v) for v in np.exp(rng.normal(0.0, 0.4, 4)))
    bounds = Bounds((seconds[0], seconds[1]), level, share, stop, np.array(peaks))
    kept = Conditions(
        (seconds[0], seconds[1]), level, share, stop, (peaks[0], peaks[1], peaks[2], peaks[3])
    )
    return bounds, kept


@pytest.mark.parametrize("seed", quick(seeds(8)))
def test_every_choice_under_side_conditions(seed: int) -> None:
    model, resistors, capacitors = near_exact(np.random.default_rng(seed % 4))
    t, (bounds, kept) = targets_of(model), conditions(np.random.default_rng(seed))
    truth = truth_of(t, resistors, capacitors).keeping(kept)
    compare(best(t, resistors, capacitors, np.ones(2), bounds), truth)


MATCHED = [
    (("R1", "R7"),),
    (("C2", "C4"), ("C1", "C3")),
    (("R2", "R3", "R8"),),
    (("R4", "R5", "R10"), ("R1", "R7"), ("C2", "C4")),
    (("R4", "R2"), ("R9", "R11"), ("C1", "C4")),
    (("R5", "R10"), ("R3", "R7"), ("R50", "R204")),
    (("R1", "R2"), ("R2", "R9")),
]


@pytest.mark.parametrize("matched", MATCHED, ids=str)
@pytest.mark.parametrize("seed", quick(seeds(2)))
def test_every_choice_with_matched_parts(matched: tuple[tuple[str, ...], ...], seed: int) -> None:
    model, resistors, capacitors = near_exact(np.random.default_rng(seed))
    t = targets_of(model)
    linear = tuple(group for group in matched if group != ("R50", "R204"))
    truth = truth_of(t, resistors, capacitors).keeping(Conditions(matched=linear))
    answer = best(t, resistors, capacitors, np.ones(2), OPEN, CircuitSpec(matched=matched))
    compare(answer, truth)


@pytest.mark.parametrize("most", quick([2, 3, 4, 5]))
@pytest.mark.parametrize("seed", seeds(3))
def test_every_choice_of_few_values(most: int, seed: int) -> None:
    model, resistors, capacitors = near_exact(np.random.default_rng(seed))
    t = targets_of(model)
    preferred = frozenset([float(resistors[seed % len(resistors)])])
    truth = truth_of(t, resistors, capacitors).keeping(Conditions(most=most, preferred=preferred))
    spec = CircuitSpec(most_values=most, preferred=tuple(preferred))
    compare(best(t, resistors, capacitors, np.ones(2), OPEN, spec), truth, 0.0, preferred)


@pytest.mark.parametrize("slack", quick([0.005, 0.05]))
@pytest.mark.parametrize("seed", seeds(3))
def test_slack_buys_fewer_values(slack: float, seed: int) -> None:
    model, resistors, capacitors = near_exact(np.random.default_rng(seed))
    t = targets_of(model)
    truth = truth_of(t, resistors, capacitors)
    answer = best(t, resistors, capacitors, np.ones(2), OPEN, CircuitSpec(slack=slack))
    compare(answer, truth, slack)


@pytest.mark.parametrize("seed", quick(range(4)))
def test_the_cheapest_of_equals_is_taken(seed: int) -> None:
    """Only levels of capacitors differ: R C products are the same, prices are not."""
    rng = np.random.default_rng(seed)
    resistors, capacitors = np.array([1e4, 2e4, 4e4]), np.array([1e-8, 2e-8])
    prices = rng.permutation([1.0, 5.0])
    t = targets_of(Dimensionless(0.5, 0.5, 0.0, 0.5, 0.25, 0.0, 0.25))
    truth = truth_of(t, resistors, capacitors)
    answer = best(t, resistors, capacitors, prices, OPEN)
    compare(answer, truth)
    assert isinstance(answer, LinearBlock)
    equals = truth.errors <= answer.least + 1e-10
    equals &= truth.kinds() == truth.kinds()[equals].min()
    cost = prices[truth.index[10:]].sum(axis=0)
    own = sum(prices[np.searchsorted(capacitors, answer.values[f"C{i}"])] for i in range(1, 5))
    assert own == cost[equals].min()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("steps", quick([10, 300, 1000, 2000]))
def test_a_lower_bound_is_one_where_the_work_runs_out(
    seed: int, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(linear_search, "MOST_STEPS", steps)
    model, resistors, capacitors = near_exact(np.random.default_rng(seed))
    t = targets_of(model)
    truth = float(truth_of(t, resistors, capacitors).errors.min())
    answer = best(t, resistors, capacitors, np.ones(2), OPEN)
    if isinstance(answer, Shortfall):
        assert not answer.whole
        return
    assert answer.bound <= truth + 1e-9
    assert answer.error >= truth - CLOSE
    assert answer.proved is (answer.error <= answer.bound + EXACT)


PAPER = Dimensionless(0.5, 0.5, 0.0, 0.5, 0.1, 0.0, 0.25)
BAND = Bounds((1.0 / (2e3 * np.pi), 1.0 / (100 * np.pi)), np.inf, np.inf, 0.0, np.ones(4))


def random_targets(seed: int) -> Dimensionless:
    rng = np.random.default_rng(seed)
    return Dimensionless(
        m=rng.uniform(0.2, 0.8), k=rng.uniform(0.2, 0.8), k0=0.0, c=rng.uniform(0.2, 0.8),
        zeta=float(np.exp(rng.uniform(np.log(0.02), np.log(0.3)))), f20=0.0, b=0.25,
    )  # fmt: skip


def test_exact_e24_parts_for_the_paper_are_found() -> None:
    resistors, capacitors = series_values(["E24"], 1e4, 1e5), series_values(["E12"], 1e-9, 1e-7)
    t = targets_of(PAPER)
    answer = best(t, resistors, capacitors, np.ones(len(capacitors)), OPEN)
    assert isinstance(answer, LinearBlock)
    assert answer.error < 1e-9
    assert answer.proved
    # What the paper-like solution R1 = R7, R2 = R3 = R8, R4 = R5 = R10, C1 = C3, C2 = C4 has.
    assert len(set(answer.values.values())) <= 8


@pytest.mark.parametrize(
    "series", quick(map(pytest.param, [("E24",), ("E96",), ("E192",), ("E24", "E96")]))
)
def test_series_are_proved(series: tuple[str, ...]) -> None:
    resistors, capacitors = series_values(series, 1e3, 1e6), series_values(["E12"], 1e-9, 1e-6)
    for seed in range(3):
        t = targets_of(random_targets(seed))
        answer = best(t, resistors, capacitors, np.ones(len(capacitors)), BAND)
        assert isinstance(answer, LinearBlock)
        assert answer.proved
        assert answer.error == pytest.approx(answer.bound, abs=CLOSE)
        assert answer.error < 1e-3
        free = best(t, resistors, capacitors, np.ones(len(capacitors)), OPEN)
        assert isinstance(free, LinearBlock)
        assert free.bound <= answer.error + 1e-9


def test_the_same_input_gives_the_same_answer() -> None:
    resistors, capacitors = series_values(["E24"], 1e3, 1e6), series_values(["E12"], 1e-9, 1e-6)
    t = targets_of(random_targets(1))
    a, b = (best(t, resistors, capacitors, np.ones(37), BAND) for _ in range(2))
    assert isinstance(a, LinearBlock)
    assert isinstance(b, LinearBlock)
    assert a == b


def test_what_leaves_no_choice_is_named() -> None:
    model, resistors, capacitors = near_exact(np.random.default_rng(0))
    t = targets_of(model)

    def why(bounds: Bounds = OPEN, spec: CircuitSpec = ANY) -> str:
        answer = best(t, resistors, capacitors, np.ones(2), bounds, spec)
        assert isinstance(answer, Shortfall)
        return answer.what

    assert why(spec=CircuitSpec(matched=(("R2", "R9"), ("C2", "C4")))) == "matched parts"
    assert why(spec=CircuitSpec(most_values=1)) == "distinct values"
    assert why(replace(OPEN, seconds=(1.0, 2.0))) == "frequency"
    assert why(replace(OPEN, level=1.01, peaks=np.array([1.0, 9.0, 1.0, 1.0]))) == "signal level"
    assert why(replace(OPEN, signal=(1.0, 2.0))) == "signal resistors"
    assert why(replace(OPEN, signal=(15e3, 50e3))) == "signal resistors"
    assert why(replace(OPEN, stop=1e6)) == "stop stiffness"
    far = targets_of(Dimensionless(0.11, 0.93, 0.0, 0.87, 0.017, 0.0, 0.25))
    answer = best(far, resistors[:2], capacitors, np.ones(2), OPEN)
    assert isinstance(answer, Shortfall)
    assert answer.whole
    assert answer.what in ("coefficients", "displacement integrators")
