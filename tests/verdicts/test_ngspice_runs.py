"""The start rule: who starts where, for how long, and what ngspice then says."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import Read
from designer.spice.simulator import SimulationFailed, SpiceJob
from designer.spread.spread import draw
from designer.verdicts import cross_check, ngspice_runs
from designer.verdicts.cross_check import (
    MOST_PERIODS,
    OR,
    UNDECIDED,
    Ask,
    CrossCheck,
    StartKind,
    Why,
    ask_random,
    is_answer,
    least_way,
)
from designer.verdicts.ngspice_runs import (
    REMAINDER,
    NgspiceAnswer,
    Query,
    cross_checks,
    periods_to_settle,
    run_queries,
)
from designer.verdicts.verdict import StudyPlan, Verdict
from designer.yields.layers import fill_cross_checks, samples_task
from designer.yields.row_store import BlockStore
from designer.yields.study_identity import study_hash
from tests.shared.paper_cases import flow_of, subject
from tests.verdicts.test_verdict import nothing, plan


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
# How long


@pytest.mark.parametrize("p", [1, 2, 7])
def test_the_way_is_as_long_as_the_multiplier_and_the_exact_trajectory_say(p: int) -> None:
    who = subject(p)
    flow = flow_of(who)
    start = 1.2 * who.orbit.start
    target = settle(flow, start)
    assert target.n
    periods = periods_to_settle(flow, start, target)
    assert isinstance(periods, int)
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
    # ngspice looks for no period above 16: a thousand are no reason to run four thousand.
    for n, way, judged in ((16, 16 * 10, 4 * 16), (17, 20, 2 * 16), (972, 20, 2 * 16)):
        of_period = replace(orbit, n=n, multipliers=np.array([0.5 + 0j]))
        assert least_way(n, of_period.radius) == way
        run = replace(who, orbit=of_period, discard=way, brief=True)
        assert numerics_gate.length(run) == way + judged
    long = replace(orbit, n=972, multipliers=np.array([0.5 + 0j]))
    assert periods_to_settle(flow, orbit.start, long) == 20
    slow = replace(orbit, multipliers=np.array([1.0 - 5.0 / (MOST_PERIODS + 1.0) + 0j]))
    assert periods_to_settle(flow, orbit.start, slow) == MOST_PERIODS + 1
    for radius in (1.0, 1.5, math.nan):
        unstable = replace(orbit, multipliers=np.array([radius + 0j]))
        assert periods_to_settle(flow, orbit.start, unstable) == math.inf
    # An orbit that the trajectory never reaches.
    far = replace(orbit, start=2.0 * orbit.start, multipliers=np.array([0.1 + 0j]))
    assert periods_to_settle(flow, orbit.start, far) == math.inf


def test_the_way_is_looked_at_no_longer_than_it_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cost of the question is that of the answer, not of the longest way there may be."""
    who = subject(1)
    flow, run = flow_of(who), Flow.run
    spent: list[int] = []

    def counted(self: Flow, x: Any, periods: int, **more: Any) -> Any:
        spent.append(periods)
        return run(self, x, periods, **more)

    monkeypatch.setattr(Flow, "run", counted)
    periods = periods_to_settle(flow, 1.2 * who.orbit.start, who.orbit)
    assert sum(spent) <= 2 * periods + 2 * ngspice_runs.STRETCH
    spent.clear()
    never = replace(who.orbit, start=2.0 * who.orbit.start, multipliers=np.array([0.1 + 0j]))
    assert periods_to_settle(flow, who.orbit.start, never, 100) == math.inf
    assert sum(spent) <= 100 + 2 * ngspice_runs.STRETCH


# ---------------------------------------------------------------------------------------------
# What ngspice says


class Counting:
    """A pool that counts the jobs it is given."""

    def __init__(self, pool: SpicePool) -> None:
        self.pool, self.jobs = pool, 0

    def map(self, jobs: Iterable[SpiceJob[Any] | None]) -> Iterator[tuple[int, Any]]:
        def counted() -> Iterator[SpiceJob[Any] | None]:
            for job in jobs:
                self.jobs += job is not None
                yield job

        return self.pool.map(counted())


@pytest.mark.parametrize(("expected", "runs"), [("1-1-1", 1), ("1-2-2", 3)])
def test_a_disagreement_is_asked_again_until_two_steps_say_the_same(
    pool: SpicePool, expected: str, runs: int
) -> None:
    who, calls = subject(1), []
    counting = Counting(pool)
    query = Query(who, SolverSettings("trap", who.period / 400.0), expected, 3)
    progress: Callable[[], None] = lambda: calls.append(1)  # noqa: E731
    (heard,) = run_queries(counting, [query], progress)  # type: ignore[arg-type]
    assert heard.response == "1-1-1"
    assert heard.remedies == ""
    assert counting.jobs == runs
    assert calls == [1]


class Saying:
    """A pool whose runs end as they are told to: a number of impacts, or a reason to fail."""

    def __init__(self, *ends: int | str) -> None:
        self.ends, self.steps = list(ends), 0

    def map(self, jobs: Iterable[SpiceJob[Any] | None]) -> Iterator[tuple[int, Any]]:
        for i, _ in enumerate(jobs):
            end = self.ends[self.steps]
            self.steps += 1
            if end == 0:
                yield i, Read(Orbit(OrbitStatus.NOT_SETTLED), np.zeros((9, 4)), None)
            elif isinstance(end, str):
                yield i, SimulationFailed(end)
            else:
                orbit = Orbit(OrbitStatus.PERIODIC, n=1, p=end, q=end)
                yield i, Read(orbit, np.zeros((9, 4)), None)


@pytest.mark.parametrize(
    ("ends", "refinements", "response", "reason"),
    [
        ((1,), 2, "1-1-1", ""),
        # Two steps in a row may share an error: only a third makes a difference sure.
        ((2, 2, 2), 3, "1-2-2", ""),
        ((2, 2, 1, 1), 3, "1-1-1", ""),
        ((2, 2), 1, "1-2-2", ""),
        ((2, 2, 1), 2, UNDECIDED, "1-2-2, at a smaller step 1-1-1"),
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
        # Nor is a run that has not settled: a finer one takes its place, and then a longer one.
        ((0, 1), 1, "1-1-1", ""),
        ((0, 0, 1), 1, "1-1-1", ""),
        ((0, 2), 1, UNDECIDED, "only one run had an answer: 1-2-2"),
        ((0, 2, 2), 2, "1-2-2", ""),
        ((2, 0, 2), 1, "1-2-2", ""),
        ((0, 2, 1), 2, UNDECIDED, "1-2-2, at a smaller step 1-1-1"),
        ((0, 0, 0), 1, "not settled", ""),
    ],
)
def test_only_two_answers_that_are_the_same_count(
    ends: tuple[int | str, ...], refinements: int, response: str, reason: str
) -> None:
    who, pool, calls = subject(1), Saying(*ends), []
    query = Query(who, SolverSettings("trap", who.period / 400.0), "1-1-1", refinements)
    (heard,) = run_queries(pool, [query], lambda: calls.append(1))  # type: ignore[arg-type]
    assert (heard.response, heard.reason) == (response, reason)
    both = OR.join(reason.split(", at a smaller step "))
    assert heard.either == (both if ", at a" in reason else "")
    assert pool.steps == len(ends)
    assert calls == [1]


@pytest.mark.slow
def test_a_board_still_on_its_way_gets_the_time_it_needs(pool: SpicePool) -> None:
    """From far off, and judged at once: two short runs see no period at either step size."""
    who = subject(1)
    early = replace(who, start=1.5 * who.orbit.start, discard=0)
    settings = SolverSettings("trap", who.period / 400.0)
    for step in (settings, replace(settings, max_step=settings.max_step / 2.0)):
        ((_, first),) = pool.map([numerics_gate.job(early, step)])
        assert not isinstance(first, SimulationFailed)
        assert first.orbit.status is OrbitStatus.NOT_SETTLED
    (heard,) = run_queries(pool, [Query(early, settings, "1-1-1", 1)])
    assert heard.response == "1-1-1"


@pytest.mark.parametrize(
    ("steps", "way", "ends", "runs", "response"),
    [
        (400, 100, (2, 2), 2, "1-2-2"),
        (400, 3900, (2, 2), 2, "1-2-2"),
        (400, 4000, (2,), 1, UNDECIDED),  # a quarter of the step would be more than 16000 periods
        (400, 3900, (0, 1), 2, "1-1-1"),
        (400, 8000, (0,), 1, "not settled"),
        (400, 1000, (0, 0, 1), 3, "1-1-1"),
        (400, 2000, (0, 2), 2, UNDECIDED),
        (400, 4000, (0, 2), 2, UNDECIDED),
        (4000, 100, (2, 2), 2, "1-2-2"),
        (4000, 1000, (2,), 1, UNDECIDED),  # four times 4 million steps are more than 8 million
    ],
)
def test_a_long_way_is_not_gone_again_at_any_price(
    steps: int, way: int, ends: tuple[int, ...], runs: int, response: str
) -> None:
    who, pool = replace(subject(1), discard=way), Saying(*ends)
    query = Query(who, SolverSettings("trap", who.period / steps), "1-1-1", 1)
    (heard,) = run_queries(pool, [query])  # type: ignore[arg-type]
    assert heard.response == response
    assert pool.steps == runs


def test_a_run_that_fails_says_why(pool: SpicePool) -> None:
    who = subject(1)
    broken = replace(who, start=np.full(4, np.nan))
    query = Query(broken, SolverSettings("trap", who.period / 400.0), "1-1-1", 1)
    (heard,) = run_queries(pool, [query])
    assert heard.response == "failed"
    assert heard.reason


def both(samples: range, questions: int = 2) -> list[Ask]:
    """Every sample and question from both starts."""
    return [
        Ask(i, number, kind, Why.RANDOM)
        for i in samples
        for number in range(questions)
        for kind in (StartKind.NOMINAL, StartKind.OWN)
    ]


@pytest.mark.slow
def test_boards_from_the_nominal_orbit(pool: SpicePool) -> None:
    """Against runs made here: from the nominal start, of 60 periods, the last six judged."""
    p = asking()
    answers = {(a.sample, a.question): a for a in samples_task(p, range(2))(2, nothing)}
    asks = both(range(2))
    heard = cross_checks(p, asks, pool, 2)
    assert [(h.sample, h.question, h.kind) for h in heard] == [
        (a.sample, a.question, a.kind) for a in asks
    ]
    for h in heard:
        question, answer = p.questions[h.question], answers[h.sample, h.question]
        assert h.agrees(answer) is True
        assert h.survives(question) is (answer.verdict is Verdict.OK)
        if h.kind is StartKind.OWN:
            assert h.periods == numerics_gate.DISCARD
            continue
        reduction = Reduction(p.circuit, draw(p.circuit, p.spread, p.seed, h.sample))
        drive = Drive(2 * np.pi * question.excitation.frequency, -question.excitation.amplitude)
        orbit = settle(Flow(reduction.system(), drive), question.start.start)
        settings = question.settings
        assert settings is not None
        long = GateSubject(
            reduction, question.excitation, orbit, start=question.start.start, discard=54
        )
        ((_, found),) = pool.map([numerics_gate.job(long, settings)])
        assert not isinstance(found, SimulationFailed)
        assert h.response == found.orbit.response == answer.response
        assert h.periods >= 5.0 / (1.0 - orbit.radius)


def test_how_often_the_step_is_divided_goes_with_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """As often as is asked from the nominal orbit; a board's own orbit needs no more for it."""
    asked: list[int] = []

    def count(
        _pool: Any, queries: Iterable[Query]
    ) -> Iterator[tuple[int, tuple[Query, NgspiceAnswer]]]:
        for k, query in enumerate(queries):
            asked.append(query.refinements)
            yield k, (query, NgspiceAnswer("1-1-1"))

    monkeypatch.setattr(ngspice_runs, "queries_run", count)
    pool: Any = None
    asks = both(range(1), 1)
    cross_checks(asking(), asks, pool, 1)
    cross_checks(asking(), asks, pool, 1, refinements=5)
    assert [ask.kind for ask in asks] == [StartKind.NOMINAL, StartKind.OWN]
    assert asked == [2, 2, 5, 2]  # the longer run, from the nominal orbit, comes first


def test_what_is_left_out_of_the_record_changes_nothing(pool: SpicePool) -> None:
    """ngspice keeps no point of a long way; what it computes, and what is read of it, is equal."""
    who = replace(subject(1), start=1.2 * subject(1).orbit.start, discard=30)
    settings = SolverSettings("trap", who.period / 400.0)
    short, whole = numerics_gate.job(who, settings), numerics_gate.job(who, settings, whole=True)
    kept = replace(short, netlist=whole.netlist)
    assert short.netlist != whole.netlist
    found = dict(pool.map([short, kept]))
    assert not isinstance(found[0], SimulationFailed)
    assert not isinstance(found[1], SimulationFailed)
    assert found[0].strobes.tobytes() == found[1].strobes.tobytes()
    assert found[0].orbit.response == found[1].orbit.response


def test_too_long_a_way_is_left_out_by_name(
    pool: SpicePool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cross_check, "MOST_PERIODS", 3)
    calls: list[int] = []
    p = asking()
    heard = cross_checks(p, both(range(1)), pool, 2, lambda: calls.append(1))
    answers = {a.question: a for a in samples_task(p, range(1))(1, nothing)}
    for h in heard:
        if h.kind is StartKind.OWN:
            assert h.agrees(answers[h.question]) is True
        else:
            assert (h.response, h.periods) == ("", 0)
            assert re.search(r"too long a way .*: \d+ drive periods, at most 3", h.reason)
            assert h.survives(p.questions[h.question]) is None
    assert len(calls) == len(heard) == 4


@pytest.mark.slow
def test_blocks_are_byte_equal_on_any_number_of_workers(pool: SpicePool, tmp_path: Path) -> None:
    p = asking(4)
    answers = samples_task(p, range(4))(2, nothing)
    asks = ask_random(answers)
    assert len(asks) == 16 - sum(a.response == "aperiodic" for a in answers) == 15
    contents, known = [], []
    with SpicePool(1) as one:
        for name, workers, jobs in (("one", one, 1), ("two", pool, 2)):
            (tmp_path / name).mkdir()
            heard = fill_cross_checks(p, asks, _store(tmp_path / name, p), workers, jobs, nothing)
            (file,) = (tmp_path / name / "ngspice.parquet").iterdir()
            contents.append(file.read_bytes())
            known.append(_store(tmp_path / name, p).read(range(10)))
            assert known[-1] == heard
    assert contents[0] == contents[1]


def _store(root: Path, p: StudyPlan) -> BlockStore[CrossCheck]:
    return BlockStore(root, "ngspice.parquet", CrossCheck, study_hash(p, "ngspice"), size=10)


@pytest.mark.slow
def test_what_was_heard_is_not_asked_again(pool: SpicePool, tmp_path: Path) -> None:
    """Fewer first, then more; until the last word is said nothing that is known is dropped."""
    p = asking(4)
    everything = both(range(3))
    counting = Counting(pool)

    def said(asks: list[Ask], **more: Any) -> list[CrossCheck]:
        return fill_cross_checks(p, asks, _store(tmp_path, p), counting, 1, nothing, **more)  # type: ignore[arg-type]

    first = said(both(range(2)))
    runs = counting.jobs
    assert runs >= 8
    whole = said(everything)
    assert counting.jobs - runs >= 4
    runs = counting.jobs
    assert set(first) < set(whole)
    assert said(both(range(1)), last=False) == whole[:4]
    assert said(everything) == whole
    named = [replace(a, why=Why.BOUNDARY) for a in both(range(1))]
    assert [h.why for h in said(named, earlier=whole)] == [Why.BOUNDARY] * 4
    assert counting.jobs == runs
    assert len(_store(tmp_path, p).read(range(10))) == 4


class Broken:
    """A pool whose workers die on every deck."""

    def map(self, jobs: Iterable[SpiceJob[Any] | None]) -> Iterator[tuple[int, Any]]:
        for i, _ in enumerate(jobs):
            yield i, SimulationFailed("worker died (exit -11) twice")


class Interrupted(Broken):
    """The same, until somebody presses Ctrl-C after so many decks."""

    def __init__(self, decks: int) -> None:
        self.left = decks

    def map(self, jobs: Iterable[SpiceJob[Any] | None]) -> Iterator[tuple[int, Any]]:
        for result in super().map(jobs):
            if not self.left:
                raise KeyboardInterrupt
            self.left -= 1
            yield result


def test_boards_next_to_a_boundary_are_asked_first_and_stored_as_they_come(tmp_path: Path) -> None:
    """Their answers outlive an interruption, though the rest of their block has none."""
    p, whole = asking(), Interrupted(10**6)
    near = [replace(a, why=Why.BOUNDARY) if a.sample == 1 else a for a in both(range(3))]
    boundary = [a for a in near if a.why is Why.BOUNDARY]
    cross_checks(p, boundary, whole, 1)  # type: ignore[arg-type]
    decks = 10**6 - whole.left
    with pytest.raises(KeyboardInterrupt):
        fill_cross_checks(p, near, _store(tmp_path, p), Interrupted(decks), 1, nothing)  # type: ignore[arg-type]
    stored = _store(tmp_path, p).read(range(10))
    assert [c.key for c in stored] == [a.key for a in boundary]


def test_a_library_that_crashes_is_said() -> None:
    heard = cross_checks(asking(), both(range(2)), Broken(), 1)  # type: ignore[arg-type]
    assert len(heard) == 8
    for h in heard:
        assert (h.response, h.reason) == ("failed", "worker died (exit -11) twice")
        assert not is_answer(h.response)
