"""The start rule: who starts where, for how long, and what ngspice then says."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer import confirmation, gate
from designer.attractor import settle
from designer.blocks import BlockStore
from designer.confirmation import (
    MOST_PERIODS,
    NOMINAL_SAMPLES,
    OWN_SAMPLES,
    REMAINDER,
    UNDECIDED,
    Query,
    confirm,
    periods_to_settle,
    starts_from_nominal,
)
from designer.deck import SolverSettings
from designer.flow import Flow
from designer.gate import Subject
from designer.montecarlo import run_block
from designer.ngspice import SimulationFailed
from designer.orbit import Orbit, OrbitStatus
from designer.reduction import Reduction
from designer.spread import draw
from designer.system import Drive
from designer.verdict import Answer, StudyPlan
from designer.waveform_orbit import Read
from designer.workers import SpiceJob, SpicePool
from tests.paper_cases import flow_of, subject
from tests.test_montecarlo import plan


@pytest.fixture(scope="module")
def pool() -> Iterator[SpicePool]:
    with SpicePool(2) as pool:
        yield pool


def asking(samples: int = 30) -> StudyPlan:
    """The small study, with settings for ngspice."""
    p = plan(samples)
    questions = tuple(
        replace(q, settings=SolverSettings("trap", 1.0 / q.excitation.frequency / 1000.0))
        for q in p.questions
    )
    return replace(p, questions=questions)


# ---------------------------------------------------------------------------------------------
# Who


@pytest.mark.parametrize(
    ("sample", "radius", "expected"),
    [
        (0, 0.1, True),
        (NOMINAL_SAMPLES - 1, math.nan, True),
        (NOMINAL_SAMPLES, 0.9, False),
        (NOMINAL_SAMPLES, 0.901, True),
        (10**6, 0.99, True),
        (NOMINAL_SAMPLES, math.nan, False),
    ],
)
def test_the_first_fifty_and_every_slow_one(sample: int, radius: float, expected: bool) -> None:
    known = np.zeros(0, dtype=complex) if math.isnan(radius) else np.array([0.1, -radius + 0j])
    orbit = Orbit(OrbitStatus.PERIODIC, n=1, p=1, q=1, multipliers=known)
    assert starts_from_nominal(sample, orbit) is expected
    assert NOMINAL_SAMPLES >= 50


# ---------------------------------------------------------------------------------------------
# How long


@pytest.mark.parametrize("p", [1, 2, 7])
def test_the_way_is_as_long_as_the_multiplier_and_the_exact_trajectory_say(p: int) -> None:
    who = subject(p)
    flow = flow_of(who)
    start = 1.2 * who.orbit.start
    target = settle(flow, start)
    assert target.n
    periods = periods_to_settle(flow, start, target)
    assert periods is not None
    assert periods >= target.n * 5.0 / (1.0 - target.radius)
    peak = np.abs(target.extremes).max(axis=1)
    laps = flow.run(target.start, target.n).strobes[:-1]

    def gap(x: np.ndarray[Any, Any]) -> float:
        return min(float((np.abs(x - lap) / peak).max()) for lap in laps)

    strobes = flow.run(start, 1000).strobes
    assert max(gap(x) for x in strobes[periods:]) <= REMAINDER
    shortest = math.ceil(5.0 / (1.0 - target.radius)) * target.n
    assert periods <= shortest or gap(strobes[periods - 1]) > REMAINDER


def test_ways_without_a_multiplier_or_an_end() -> None:
    who = subject(1)
    flow, orbit = flow_of(who), who.orbit
    assert periods_to_settle(flow, orbit.start, Orbit(OrbitStatus.APERIODIC)) == 20
    for radius in (1.0 - 5.0 / (MOST_PERIODS + 1.0), 1.0, 1.5):
        slow = replace(orbit, multipliers=np.array([radius + 0j]))
        assert periods_to_settle(flow, orbit.start, slow) is None
    # An orbit that the trajectory never reaches.
    far = replace(orbit, start=2.0 * orbit.start, multipliers=np.array([0.1 + 0j]))
    assert periods_to_settle(flow, orbit.start, far) is None


# ---------------------------------------------------------------------------------------------
# What ngspice says


class Counting:
    """A pool that counts the jobs it is given."""

    def __init__(self, pool: SpicePool) -> None:
        self.pool, self.jobs = pool, 0

    def map(self, jobs: Iterable[SpiceJob[Any]]) -> Iterator[tuple[int, Any]]:
        def counted() -> Iterator[SpiceJob[Any]]:
            for job in jobs:
                self.jobs += 1
                yield job

        return self.pool.map(counted())


@pytest.mark.parametrize(("expected", "runs"), [("1-1-1", 1), ("1-2-2", 2)])
def test_a_disagreement_is_asked_again_until_two_steps_say_the_same(
    pool: SpicePool, expected: str, runs: int
) -> None:
    who, calls = subject(1), []
    counting = Counting(pool)
    query = Query(who, SolverSettings("trap", who.period / 400.0), expected)
    progress: Callable[[], None] = lambda: calls.append(1)  # noqa: E731
    (heard,) = confirm(counting, [query], 3, progress)  # type: ignore[arg-type]
    assert heard.response == "1-1-1"
    assert heard.remedies == ""
    assert counting.jobs == runs
    assert calls == [1]


class Saying:
    """A pool whose runs end as they are told to: a number of impacts, or a reason to fail."""

    def __init__(self, *ends: int | str) -> None:
        self.ends, self.steps = list(ends), 0

    def map(self, jobs: Iterable[SpiceJob[Any]]) -> Iterator[tuple[int, Any]]:
        for i, _ in enumerate(jobs):
            end = self.ends[self.steps]
            self.steps += 1
            if isinstance(end, str):
                yield i, SimulationFailed(end)
            else:
                orbit = Orbit(OrbitStatus.PERIODIC, n=1, p=end, q=end)
                yield i, Read(orbit, np.zeros((9, 4)), None)


@pytest.mark.parametrize(
    ("ends", "refinements", "response", "reason"),
    [
        ((1,), 2, "1-1-1", ""),
        ((2, 2), 2, "1-2-2", ""),
        ((2, 1, 1), 2, "1-1-1", ""),
        ((2, 3, 3), 2, "1-3-3", ""),
        # The last two differ, whatever the last says.
        ((2, 1), 1, UNDECIDED, "1-2-2, at a smaller step 1-1-1"),
        ((2, 3), 1, UNDECIDED, "1-2-2, at a smaller step 1-3-3"),
        ((2, 1, 2), 2, UNDECIDED, "1-1-1, at a smaller step 1-2-2"),
        # A failure is no answer: not the same as another, and not what a later one differs from.
        (("died", 1), 2, "1-1-1", ""),
        (("died", "died", 1), 2, "1-1-1", ""),
        (("died", "stuck", "died"), 2, "failed", "died"),
        (("died", 2), 1, UNDECIDED, "only one run had an answer: 1-2-2"),
        ((2, "died", 2), 2, "1-2-2", ""),
        ((2, "died", 1), 2, UNDECIDED, "1-2-2, at a smaller step 1-1-1"),
        ((2, "died"), 1, "failed", "died"),
    ],
)
def test_only_two_answers_that_are_the_same_count(
    ends: tuple[int | str, ...], refinements: int, response: str, reason: str
) -> None:
    who, pool, calls = subject(1), Saying(*ends), []
    query = Query(who, SolverSettings("trap", who.period / 400.0), "1-1-1")
    (heard,) = confirm(pool, [query], refinements, lambda: calls.append(1))  # type: ignore[arg-type]
    assert (heard.response, heard.reason) == (response, reason)
    assert pool.steps == len(ends)
    assert calls == [1]


def test_a_run_that_fails_says_why(pool: SpicePool) -> None:
    who = subject(1)
    broken = replace(who, start=np.full(4, np.nan))
    query = Query(broken, SolverSettings("trap", who.period / 400.0), "1-1-1")
    (heard,) = confirm(pool, [query], 1)
    assert heard.response == "failed"
    assert heard.reason


def test_boards_from_the_nominal_orbit(pool: SpicePool) -> None:
    """Against runs made here: from the nominal start, of 60 periods, the last six judged."""
    p = asking()
    answers = run_block(p, range(2), pool, 2)
    for a in answers:
        question = p.questions[a.question]
        reduction = Reduction(p.circuit, draw(p.circuit, p.spread, p.seed, a.sample))
        drive = Drive(2 * np.pi * question.excitation.frequency, -question.excitation.amplitude)
        orbit = settle(Flow(reduction.system(), drive), question.start.start)
        settings = question.settings
        assert settings is not None
        long = Subject(
            reduction, question.excitation, orbit, start=question.start.start, discard=54
        )
        ((_, found),) = pool.map([gate.job(long, settings)])
        assert not isinstance(found, SimulationFailed)
        assert a.ngspice_nominal == found.orbit.response == a.response
        assert a.agrees_from_nominal is True
        assert a.agrees is True
        assert a.ngspice_nominal_periods >= 5.0 / (1.0 - orbit.radius)


def test_later_boards_are_asked_only_where_they_are_slow(
    pool: SpicePool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(confirmation, "NOMINAL_SAMPLES", 0)
    monkeypatch.setattr(confirmation, "SLOW", 1.0)
    p = asking()
    beyond = range(OWN_SAMPLES, OWN_SAMPLES + 3)
    answers = run_block(p, beyond, pool, 2)
    assert {(a.ngspice, a.ngspice_nominal, a.ngspice_nominal_periods) for a in answers} == {
        ("", "", 0)
    }
    monkeypatch.setattr(confirmation, "SLOW", 0.5)
    answers = run_block(p, beyond, pool, 2)
    asked = [a for a in answers if a.radius > 0.5]
    assert asked
    assert [a for a in answers if a.ngspice_nominal] == asked


def test_too_long_a_way_is_left_out_by_name(
    pool: SpicePool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(confirmation, "MOST_PERIODS", 3)
    calls: list[int] = []
    answers = run_block(asking(), range(1), pool, 2, lambda: calls.append(1))
    for a in answers:
        assert a.ngspice_nominal == ""
        assert a.ngspice_nominal_reason == "too long a way to be asked"
        assert a.agrees_from_nominal is None
        assert a.agrees is True
    assert len(calls) == 3 * len(answers)


def test_blocks_are_byte_equal_on_any_number_of_workers(pool: SpicePool, tmp_path: Path) -> None:
    p = asking(4)
    contents, known = [], []
    with SpicePool(1) as one:
        for name, workers, jobs in (("one", one, 1), ("two", pool, 2)):
            (tmp_path / name).mkdir()
            store = BlockStore.of(tmp_path / name, p)
            answers: list[Answer] = run_block(p, range(4), workers, jobs)
            store.write(range(4), answers)
            (file,) = (tmp_path / name / "samples.parquet").iterdir()
            contents.append(file.read_bytes())
            known.append(store.read(range(4)))
            assert known[-1] is not None
            assert [repr(a) for a in known[-1]] == [repr(a) for a in answers]
    assert contents[0] == contents[1]
    assert known[0] is not None
    assert all(a.ngspice_nominal for a in known[0])


class Broken:
    """A pool whose workers die on every deck."""

    def map(self, jobs: Iterable[SpiceJob[Any]]) -> Iterator[tuple[int, Any]]:
        for i, _ in enumerate(jobs):
            yield i, SimulationFailed("worker died (exit -11) twice")


def test_a_library_that_crashes_costs_no_verdict() -> None:
    p = asking()
    alone = run_block(p, range(2), None, 1)
    answers = run_block(p, range(2), Broken(), 1)  # type: ignore[arg-type]
    assert [(a.verdict, a.response, a.radius) for a in answers] == [
        (a.verdict, a.response, a.radius) for a in alone
    ]
    for a in answers:
        assert (a.ngspice, a.ngspice_nominal) == ("failed", "failed")
        assert a.ngspice_reason == a.ngspice_nominal_reason == "worker died (exit -11) twice"
        assert a.agrees is None
        assert a.agrees_from_nominal is None
