"""The person at the bench: sees what a screen shows, and finds what can be found by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.circuit.reduction import Reduction
from designer.dynamics.counts import Counts
from designer.dynamics.flow import Flow
from designer.model.tuning_bands import Bands
from designer.yields import bench_procedure
from designer.yields.adjustment import AS_BUILT, Adjustment
from designer.yields.bench_procedure import find_on_bench
from tests.shared.bench_plans import question, shifted
from tests.shared.paper_cases import subject

SEED = (3, 0, 0)


@pytest.mark.parametrize("p", range(1, 9))
def test_the_nominal_response_is_seen_at_once(p: int) -> None:
    found = find_on_bench(subject(p).system, question(p), Bands(), seed=SEED)
    assert (found.seen, found.steps, found.setting) == (True, 1, AS_BUILT)


def test_the_state_where_the_person_stops_is_the_board_s() -> None:
    asked = question(2)
    found = find_on_bench(subject(2).system, asked, Bands(), seed=SEED)
    peak = np.abs(asked.start.extremes).max(axis=1)
    np.testing.assert_array_less(np.abs(found.state - asked.start.start) / peak, 1e-6)


def test_another_number_of_pulses_is_not_taken_for_the_wanted_one() -> None:
    asked = question(4)
    other = replace(asked, spec=replace(asked.spec, expect=Counts(1, ((3, 3),))))
    bands = Bands(0.0, 0.0, 0.0)
    found = find_on_bench(subject(4).system, other, bands, seed=SEED)
    assert not found.seen
    assert found.setting == AS_BUILT


def test_a_multiple_of_the_period_is_not_taken_for_the_wanted_one() -> None:
    """1-1-1 shows two pulses a side in two periods, but repeats after one."""
    asked = question(1)
    other = replace(asked, spec=replace(asked.spec, expect=Counts(2, ((2, 2),))))
    found = find_on_bench(subject(1).system, other, Bands(0.0, 0.0, 0.0), seed=SEED)
    assert not found.seen


@pytest.mark.parametrize("ratio", [0.03, -0.03])
def test_a_constant_force_is_found_and_cancelled(ratio: float) -> None:
    """As far as the pattern needs. The board shows 8-48-48 until then, which no rounding moves."""
    p = 6
    asked = question(p)
    gain = sum(1.0 / r.value for r in subject(p).circuit.resistors if "s2" in r.nets)
    lever = subject(p).circuit.values["R6"] * gain
    board = shifted(p, ratio * asked.excitation.amplitude / lever, "U2C")
    system = Reduction(subject(p).circuit, board).system()
    found = find_on_bench(system, asked, Bands(0.0, 0.0, 0.05), seed=SEED)
    assert found.seen
    assert 1 < found.steps <= 1 + bench_procedure.CENTRING_STEPS
    assert abs(ratio - found.setting.offset) < 0.7 * abs(ratio)
    flow = Flow(system, found.setting.of(asked.excitation).drive)
    counts = flow.run(found.state, 3).counts.sum(axis=(0, 1))
    assert counts.tolist() == [3 * p, 3 * p]


def test_the_procedure_ends_and_stays_inside_the_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = question(1)
    never = replace(asked, spec=replace(asked.spec, expect=Counts(1, ((7, 7),))))
    visited = []
    look = bench_procedure._Person.look

    def noted(self: bench_procedure._Person, setting: Adjustment) -> bool:
        visited.append(setting)
        return look(self, setting)

    monkeypatch.setattr(bench_procedure._Person, "look", noted)
    bands = Bands(0.02, 0.05, 0.03)
    found = find_on_bench(subject(1).system, never, bands, seed=SEED)
    assert not found.seen
    assert found.setting == AS_BUILT
    assert found.steps == len(visited) <= bench_procedure.MOST_STEPS
    assert all(Adjustment.at(setting.vector, bands) == setting for setting in visited)
    rows = {(round(s.frequency, 9), round(s.amplitude, 9)) for s in visited}
    assert len(rows) == 11 * 5  # every frequency at every amplitude


def test_readings_follow_the_seed_and_stay_within_a_step() -> None:
    def person(seed: int) -> bench_procedure._Person:
        return bench_procedure._Person(
            subject(1).system, question(1), Bands(), np.random.default_rng(seed)
        )

    step = person(0).step
    peak = np.abs(question(1).start.extremes[0]).max()
    assert step == pytest.approx(2.5 * peak / 256)
    values = [person(s)._read(0.0123) for s in (1, 1, 2, 3)]
    assert values[0] == values[1]
    assert len(set(values)) > 1
    assert np.abs(np.array(values) - 0.0123).max() <= 1.5 * step
