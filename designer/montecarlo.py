"""How many boards will show the response: Monte Carlo over component spread.

Every verdict is decided on the exact circuit rung, started on the nominal design's orbit. ngspice
repeats samples of each response from the attractor that the exact rung reached, and others from
the nominal orbit (``designer.confirmation``). Finished blocks of samples go to disk at once
(``designer.blocks``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from designer import exact
from designer.confirmation import (
    NOMINAL_REFINEMENTS,
    OWN_REFINEMENTS,
    OWN_SAMPLES,
    Heard,
    Query,
    confirm,
    periods_to_settle,
    starts_from_nominal,
)
from designer.flow import Flow
from designer.gate import Subject
from designer.verdict import Answer, Question, StudyPlan
from designer.workers import SpicePool


def run_block(
    plan: StudyPlan,
    block: range,
    pool: SpicePool | None,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> list[Answer]:
    """Answers for every sample of the block and every question, in order.

    ``progress`` is called once per answer, and once more for each run that ngspice is asked for.
    """
    found = exact.block(plan, block, jobs, progress)
    answers = [answer for answer, _ in found]
    if pool is None:
        return answers
    own, far = {}, {}
    for k, (answer, subject) in enumerate(found):
        question = plan.questions[answer.question]
        if subject is None or question.settings is None:
            continue
        if answer.sample < OWN_SAMPLES:
            own[k] = Query(subject, question.settings, answer.response)
        if starts_from_nominal(answer.sample, subject.orbit):
            way = _from_nominal(subject, question)
            if way is None:
                answers[k] = replace(answer, ngspice_nominal_reason="too long a way to be asked")
                progress()
            else:
                far[k] = Query(way, question.settings, answer.response)
    for k, heard in _ask(pool, own, OWN_REFINEMENTS, progress):
        answers[k] = replace(
            answers[k],
            ngspice=heard.response,
            ngspice_reason=heard.reason,
            ngspice_remedies=heard.remedies,
        )
    for k, heard in _ask(pool, far, NOMINAL_REFINEMENTS, progress):
        answers[k] = replace(
            answers[k],
            ngspice_nominal=heard.response,
            ngspice_nominal_reason=heard.reason,
            ngspice_nominal_remedies=heard.remedies,
            ngspice_nominal_periods=far[k].subject.discard,
        )
    return answers


def _ask(
    pool: SpicePool, queries: dict[int, Query], refinements: int, progress: Callable[[], None]
) -> Iterator[tuple[int, Heard]]:
    heard = confirm(pool, list(queries.values()), refinements, progress)
    return zip(queries, heard, strict=True)


def _from_nominal(subject: Subject, question: Question) -> Subject | None:
    """The sample's run from the nominal orbit, long enough to arrive; None if that is too long."""
    start = question.start.start
    periods = periods_to_settle(_flow(subject, question), start, subject.orbit)
    return None if periods is None else replace(subject, start=start, discard=periods)


def _flow(subject: Subject, question: Question) -> Flow:
    return Flow(subject.system, exact.drive_of(question.excitation))
