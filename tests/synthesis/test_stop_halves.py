"""Rectifier halves with given thresholds and slopes against every choice, one after the other."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.synthesis.stop_halves import HalfRules, HalfTarget, choose, least_error

E12 = np.array([10, 12, 15, 18, 22, 27, 33, 39, 47, 56, 68, 82]) * 1e3
RULES = HalfRules(reference=5.0, gain=3.0, load=2e3, noise_gain=30.0)


def by_hand(targets: list[HalfTarget], resistors: list[float], rules: HalfRules) -> float:
    """The least largest error, by a loop over all resistors of all halves."""
    steepest = max(t.siemens for t in targets)
    best = np.inf
    for force in resistors:
        if not rules.gain / 2.5 <= steepest * force <= rules.gain:
            continue
        worst = 0.0
        for t in targets:
            least = np.inf
            for source, feedback in product(resistors, resistors):
                error = abs(np.log(feedback / source / force / t.siemens))
                if not t.threshold:
                    if 1.0 + feedback / source <= rules.noise_gain:
                        least = min(least, error)
                    continue
                for level in resistors:
                    off = abs(np.log(rules.reference * source / level / t.threshold))
                    if 1.0 + feedback * (1.0 / source + 1.0 / level) <= rules.noise_gain:
                        least = min(least, max(error, off))
            worst = max(worst, least)
        best = min(best, worst)
    return float(best)


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6))
def test_no_choice_is_better(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sides = [1, -1][: int(rng.integers(1, 3))]
    targets = [
        HalfTarget(side, float(rng.choice([0.0, rng.uniform(0.3, 6.0)])), rng.uniform(3e-5, 2e-4))
        for side in sides
    ]
    wanted = by_hand(targets, E12.tolist(), RULES)
    assert least_error(targets, E12, RULES) == pytest.approx(wanted)
    found = choose(targets, E12, RULES, frozenset())
    if not np.isfinite(wanted):
        assert found is None
        return
    assert found is not None
    assert found.error == pytest.approx(wanted)
    for t in targets:
        half = found.halves[t.side]
        slope = half.feedback / half.source / found.force
        assert abs(np.log(slope / t.siemens)) <= wanted + 1e-6
        assert (half.threshold is None) is (t.threshold == 0.0)
        if half.threshold is not None:
            volts = RULES.reference * half.source / half.threshold
            assert abs(np.log(volts / t.threshold)) <= wanted + 1e-6


def test_known_values_come_first() -> None:
    """A level that many choices reach is made of what the circuit has."""
    targets = [HalfTarget(1, 5.0, 1e-4)]
    known = frozenset({22e3})
    found = choose(targets, E12, RULES, known)
    assert found is not None
    assert found.error == pytest.approx(0.0, abs=1e-12)
    half = found.halves[1]
    assert half.source == half.threshold == 22e3
