"""Runs of ngspice on samples: which it makes, and how long.

Two starts. On the sample's own orbit of the exact circuit ngspice only has to stay there. From the
nominal design's orbit it has to find its way, as the exact circuit did: at least 5/(1 - ρ) drive
periods (times n for a period of n), and no fewer than the exact trajectory from that very start
takes to come within `REMAINDER` of its attractor. `verdicts.cross_check` says who is asked.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import groupby
from typing import TypeVar

import numpy as np

from designer.base.arrays import Array
from designer.base.defaults import Fidelity
from designer.dynamics.counts import MAX_PERIOD
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.spice import convergence_aids as remedies, numerics_gate
from designer.spice.convergence_aids import RunQueue, Task
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import Read, name_in_ngspice
from designer.spice.simulator import SimulationFailed
from designer.verdicts import exact_circuit
from designer.verdicts.cross_check import (
    MOST_PERIODS,
    MOST_STEPS,
    OR,
    UNDECIDED,
    Ask,
    CrossCheck,
    StartKind,
    is_answer,
    least_way,
    longest_way,
)
from designer.verdicts.verdict import StudyPlan

T = TypeVar("T")

REMAINDER = 5e-4
"""How near its attractor a trajectory has arrived, over the peak: a quarter of the strobe
tolerance."""
MOST_AGAIN, MOST_STEPS_AGAIN = 4 * MOST_PERIODS, 8 * MOST_STEPS
"""Longest run that is made again, in drive periods at the step of the first, a quarter of the step
counting four times, and in steps."""
FINER = 4
"""The number by which the step is divided in each round where ngspice disagrees. Half a step may
say the same by the same error: next to a period doubling it takes a sixteenth to see."""
MOST_PATIENCE = 16
"""How many times the pool's time a run at a finer step may take."""
SURE_ROUND = 2
"""The first round whose answer may charge the exact circuit with a difference, if so many are
allowed."""
STRETCH = 40
"""Drive periods after which the exact trajectory is looked at again, and for which it must have
stayed with the attractor before it counts as arrived."""
LONG = 4 * MAX_PERIOD
"""Drive periods in which any period, or none, is seen."""
OWN_REFINEMENTS, NOMINAL_REFINEMENTS = 2, 2
"""Rounds of finer steps at most where ngspice disagrees."""


@dataclass(frozen=True)
class Query:
    """One run of ngspice."""

    subject: GateSubject
    """The response and the board that is run."""
    settings: SolverSettings
    expected: str
    """Response of the exact circuit."""
    refinements: int = OWN_REFINEMENTS
    """Rounds of finer steps at most."""

    @property
    def steps(self) -> float:
        """Steps of the run, which its time goes with."""
        return numerics_gate.length(self.subject) * self.subject.period / self.settings.max_step


@dataclass(frozen=True)
class NgspiceAnswer:
    """What ngspice answers to a query; the fields are those of a ``CrossCheck``."""

    response: str
    """n-p-q, status or ``UNDECIDED``."""
    reason: str = ""
    """Why that is the answer; both answers of an undecided one."""
    remedies: str = ""
    """Remedies that the last run needed."""
    symmetric: bool = False
    """Whether the orbit is its own mirror image."""
    either: str = ""
    """Both answers of an undecided one, if both are any."""
    finer: int = 1
    """The number by which the step of the run that answers was divided."""


def cross_checks(
    plan: StudyPlan,
    asks: Sequence[Ask],
    pool: SpicePool,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
    *,
    fidelity: Fidelity = "ideal",
    refinements: int = NOMINAL_REFINEMENTS,
) -> list[CrossCheck]:
    """ngspice's answers in the order of ``asks``, without those that cannot be asked; see
    `checks_run`. progress : called once for each answer."""
    answers: dict[int, CrossCheck] = {}
    for k, answer in checks_run(
        plan, [asks], pool, jobs, fidelity=fidelity, refinements=refinements
    ):
        if answer is not None:
            answers[k] = answer
            progress()
    return [answers[k] for k in sorted(answers)]


def checks_run(
    plan: StudyPlan,
    blocks: Iterable[Sequence[Ask]],
    pool: SpicePool,
    jobs: int,
    *,
    fidelity: Fidelity = "ideal",
    refinements: int = NOMINAL_REFINEMENTS,
) -> Iterator[tuple[int, CrossCheck | None]]:
    """ngspice's answers as they come, with the number of the ask, counted through all blocks.

    The exact circuit is asked again for the boards of a block, before the last runs of the block
    before have ended: where to start and how long to run is its to say. Of a block the longest
    runs come first.

    Parameters
    ----------
    fidelity : the op-amps' model. Above ``ideal`` a board's own orbit is only near ngspice's, so
        that as many periods are discarded as shrink a deviation to a hundredth.
    refinements : rounds of finer steps at most, of runs from the nominal orbit.

    Yields
    ------
    None where the exact circuit has no orbit or the response no settings.
    """
    ask_of: dict[int, tuple[int, Ask]] = {}
    ready_rows: deque[tuple[int, CrossCheck | None]] = deque()

    def queries() -> Iterator[Query]:
        first = 0
        for block in blocks:
            ready = []
            for k, (ask, query) in enumerate(
                _queries(plan, block, jobs, fidelity, refinements), first
            ):
                if isinstance(query, Query):
                    ready.append((k, ask, query))
                else:
                    ready_rows.append((k, query))
            for k, ask, query in sorted(ready, key=lambda one: -one[2].steps):
                ask_of[len(ask_of)] = k, ask
                yield query
            first += len(block)

    for number, (query, answer) in queries_run(pool, queries()):
        yield from _drained(ready_rows)
        k, ask = ask_of[number]
        yield k, _row(ask, answer, query.subject.discard)
    yield from _drained(ready_rows)


def _drained(items: deque[T]) -> Iterator[T]:
    """The items, each of which is then gone."""
    while items:
        yield items.popleft()


def _row(ask: Ask, answer: NgspiceAnswer, periods: int) -> CrossCheck:
    return CrossCheck(**asdict(ask), **asdict(answer), periods=periods)


def _queries(
    plan: StudyPlan, asks: Sequence[Ask], jobs: int, fidelity: Fidelity, refinements: int
) -> Iterator[tuple[Ask, Query | CrossCheck | None]]:
    """Each ask with the run that answers it, or with what is known without one."""
    subjects = _subjects(plan, asks, jobs)
    for ask in asks:
        subject, question = subjects[ask.sample, ask.question], plan.questions[ask.question]
        if subject is None or question.settings is None:
            yield ask, None
            continue
        halvings = OWN_REFINEMENTS
        if ask.kind is StartKind.NOMINAL:
            flow = Flow(subject.system, subject.excitation.drive)
            most = longest_way(question)
            way = periods_to_settle(flow, question.start.start, subject.orbit, most)
            if way > most:
                yield ask, _too_long(ask, way, most)
                continue
            subject = replace(subject, start=question.start.start, discard=int(way))
            halvings = refinements
        elif fidelity != "ideal":
            subject = replace(subject, discard=way_to_fidelity(subject.orbit))
        subject = replace(subject, fidelity=fidelity, brief=True)
        expected = name_in_ngspice(subject.orbit.response)
        yield ask, Query(subject, question.settings, expected, halvings)


def _subjects(
    plan: StudyPlan, asks: Sequence[Ask], jobs: int
) -> dict[tuple[int, int], GateSubject | None]:
    """What ngspice needs of each board, by (sample, question)."""
    numbers = sorted({a.question for a in asks})
    fewer = replace(plan, questions=tuple(plan.questions[n] for n in numbers))
    samples = enumerate(sorted({a.sample for a in asks}))
    subjects: dict[tuple[int, int], GateSubject | None] = {}
    for _, group in groupby(samples, key=lambda pair: pair[1] - pair[0]):  # without gaps
        run = [sample for _, sample in group]
        for answer, subject in exact_circuit.subjects(fewer, range(run[0], run[-1] + 1), jobs):
            subjects[answer.sample, numbers[answer.question]] = subject
    return subjects


def way_to_fidelity(orbit: Orbit) -> int:
    """Drive periods from the exact circuit's orbit to that of another fidelity."""
    way = least_way(orbit.n, orbit.radius)
    return int(min(max(way, numerics_gate.DISCARD), numerics_gate.MOST_DISCARDED))


def _too_long(ask: Ask, way: float, most: float) -> CrossCheck:
    needed = f"{way:.0f}" if math.isfinite(way) else f"more than {most:.0f}"
    reason = f"too long a way from the nominal orbit: {needed} drive periods, at most {most:.0f} "
    reason += "are run"
    return _row(ask, NgspiceAnswer("", reason), 0)


def periods_to_settle(
    flow: Flow, start: Array, orbit: Orbit, most: float = MOST_PERIODS
) -> int | float:
    """Drive periods from ``start`` (states,) to the attractor ``orbit``.

    At least ``least_way``, and until every later strobe of the exact trajectory is
    within `REMAINDER` of a strobe of the orbit; "later" ends when the trajectory has stayed there
    for that least number again, or for `STRETCH`. More than ``most``, possibly inf, where the way
    is longer than that.
    """
    least = least_way(orbit.n, orbit.radius)
    if not 0 < orbit.n <= MAX_PERIOD or least > most:
        return least
    laps = flow.run(orbit.start, orbit.n, mode=orbit.mode or None).strobes[:-1]
    x, mode, periods, arrived = start, None, 0, 0
    peak = orbit.coarse_peaks
    stay = max(STRETCH, int(least))
    while periods - arrived < stay:
        if arrived > most:
            return math.inf
        way = flow.run(x, stay - (periods - arrived), mode=mode)
        if way.status is not FlowStatus.DONE:
            return math.inf
        gap = (np.abs(way.strobes[:, None] - laps) / peak).max(axis=2).min(axis=1)
        far = np.flatnonzero(gap > REMAINDER)
        arrived = periods + int(far[-1]) + 1 if len(far) else arrived
        periods += len(way.strobes) - 1
        x, mode = way.strobes[-1], way.mode
    return max(least, arrived)


def run_queries(
    pool: SpicePool,
    queries: Sequence[Query],
    progress: Callable[[], None] = lambda: None,
) -> list[NgspiceAnswer]:
    """ngspice's answers, in order.

    A first answer that is the expected one stands: its settings have passed the gate at two step
    sizes. Where it is another the step is divided by `FINER`, round after round, as often as the
    query says at most, until the answer depends on it no more: two steps in a row say the same, and
    where that is not the expected response, the second of them is that of round `SURE_ROUND` or
    later, if that many are allowed. Where they never do, the answer is `UNDECIDED`. A failed run is
    no answer: it is neither the same as another nor different. Nor is one that has not settled: it
    is made again at the next step, and longer (`longer`) where it has not settled there either or
    there is no next one. Neither is done where it would take more than `MOST_AGAIN` says.
    ``progress`` is called once a query.
    """
    # The longest first: the workers then end together.
    order = sorted(range(len(queries)), key=lambda k: -queries[k].steps)
    answers: dict[int, NgspiceAnswer] = {}
    for number, (_, answer) in queries_run(pool, (queries[k] for k in order)):
        answers[order[number]] = answer
        progress()
    return [answers[k] for k in range(len(queries))]


def queries_run(
    pool: SpicePool, queries: Iterable[Query]
) -> Iterator[tuple[int, tuple[Query, NgspiceAnswer]]]:
    """`run_queries` as the answers come, with the number of the query."""
    queue = RunQueue((_Run(q, q.subject, q.settings) for q in queries), _task)
    for number, outcome in remedies.run(pool, queue):
        index, run = queue.ended(number)
        follows = _after(run, _answer_of(outcome))
        if isinstance(follows, _Run):
            queue.again.append((index, follows))
        else:
            yield index, (run.query, follows)


@dataclass(frozen=True)
class _Run:
    """A run to be made. round : how often its step has been divided. before : the last answer at a
    larger step, None where there was none."""

    query: Query
    subject: GateSubject
    settings: SolverSettings
    round: int = 0
    before: str | None = None


def _task(run: _Run) -> Task[Read]:
    patience = min(FINER**run.round, MOST_PATIENCE)
    return numerics_gate.task(run.subject, run.settings, patience=patience)


def _after(run: _Run, answer: NgspiceAnswer) -> _Run | NgspiceAnswer:
    """The run that follows, or the final answer."""
    query, fine = run.query, FINER**run.round
    answer = replace(answer, finer=fine)
    none, expected = not is_answer(answer.response), answer.response == query.expected
    same = not none and answer.response == (run.before or query.expected)
    if same and (expected or run.round >= SURE_ROUND):
        return answer
    # At the finer step as long as was asked at first: what had not settled may be the step's doing.
    may_refine = run.round < query.refinements and _may_take(query, query.subject, FINER * fine)
    unsettled = answer.response == OrbitStatus.NOT_SETTLED and not (run.round == 0 and may_refine)
    # A few strobes of a motion without a period may look like one.
    brief = run.subject.brief and query.expected == OrbitStatus.APERIODIC and not none
    more = longer(run.subject)
    if (unsettled or brief) and run.subject.judged < LONG and _may_take(query, more, fine):
        return replace(run, subject=more)
    if may_refine:
        finer = replace(run.settings, max_step=run.settings.max_step / FINER)
        before = run.before if none else answer.response
        return _Run(query, query.subject, finer, run.round + 1, before)
    return answer if none or same else _undecided(run.before, answer)


def _may_take(query: Query, subject: GateSubject, fine: int) -> bool:
    """Whether the run of a subject is made again at the query's step over ``fine``."""
    periods = fine * numerics_gate.length(subject)
    steps = periods * subject.period / query.settings.max_step
    return periods <= MOST_AGAIN and steps <= MOST_STEPS_AGAIN


def longer(subject: GateSubject) -> GateSubject:
    """Twice the way and `STRETCH` more, and `LONG` periods to judge: what had not settled may have
    been on its way yet, or have a period or none that a few strobes do not show."""
    return replace(subject, discard=2 * subject.discard + STRETCH, judged=LONG)


def _undecided(before: str | None, answer: NgspiceAnswer) -> NgspiceAnswer:
    if before is None:
        reason = f"only one run had an answer: {answer.response}"
        return replace(answer, response=UNDECIDED, reason=reason, symmetric=False)
    return replace(
        answer,
        response=UNDECIDED,
        reason=f"{before}, at a smaller step {answer.response}",
        symmetric=False,
        either=OR.join((before, answer.response)),
    )


def _answer_of(outcome: remedies.AidedRun[Read]) -> NgspiceAnswer:
    aids = " ".join(outcome.tried)
    if isinstance(outcome.result, SimulationFailed):
        return NgspiceAnswer(str(OrbitStatus.FAILED), outcome.result.reason, aids)
    orbit = outcome.result.orbit
    return NgspiceAnswer(orbit.response, orbit.reason, aids, bool(orbit.symmetric))
