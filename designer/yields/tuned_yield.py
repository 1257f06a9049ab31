"""Tuned: which boards show a response at some setting of the generator within the bands.

What exists (``verdict``, by ``yields.setting_search``) and what a person with an oscilloscope
finds (``bench_verdict``, by ``yields.bench_procedure``), for each board and response.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any
from zlib import crc32

import numpy as np

from designer.base.threads import parallel
from designer.circuit.ensemble import Ensemble
from designer.circuit.reduction import FloatingCircuit
from designer.dynamics.orbit import Orbit
from designer.model.tuning_bands import Bands
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import Answer, BoardRow, StudyPlan, Verdict, rounded
from designer.yields.adjustment import AS_BUILT, Adjustment, centring_offset
from designer.yields.bench_procedure import BenchResult, find_on_bench
from designer.yields.setting_search import BoardCase, seek

DIGITS = 6
"""Decimals of the centring DC offset over the amplitude."""
_NAN = float("nan")


@dataclass(frozen=True)
class Tuned(BoardRow):
    """A board with the generator free within the bands.

    ``verdict`` : ok where some setting works; failed where none is known to and at least half of
    those asked, as built among them, gave no answer; else grazing where one is undecided, and lost
    where none was found, which is no proof that there is none. ``response`` : at the setting, or as
    built where nothing was found.
    """

    frequency: float
    """Change of the frequency at the setting, a fraction; 0 as built and where nothing was
    found."""
    amplitude: float
    """Change of the amplitude at the setting, a fraction; 0 as built and where nothing was
    found."""
    offset: float
    """DC offset at the setting, over the amplitude; 0 as built and where nothing was found."""
    tries: int
    """Settings that were asked."""
    unanswered: int
    """Settings without an answer."""
    followed: int
    """Orbits that were followed to find some of the settings."""
    radius: float
    """Largest modulus of the multipliers of the orbit found; nan without one."""
    penetration: float
    """Smallest penetration of the orbit found; nan without one."""
    miss: float
    """Nearest miss of the orbit found; nan without one."""
    bench_verdict: Verdict
    """Verdict of the exact circuit at the setting where the simulated person stopped; failed where
    the procedure could not be played."""
    bench_response: str
    """n-p-q or status of the exact circuit there."""
    bench_reason: str
    """Why that is not ok, or ""."""
    bench_seen: bool
    """Whether the person saw the wanted pattern there."""
    bench_frequency: float
    """Change of the frequency there, a fraction."""
    bench_amplitude: float
    """Change of the amplitude there, a fraction."""
    bench_offset: float
    """DC offset there, over the amplitude."""
    bench_steps: int
    """Settings of the generator that the person tried."""

    @property
    def setting(self) -> Adjustment:
        return Adjustment(self.frequency, self.amplitude, self.offset)


def tuned_block(
    plan: StudyPlan,
    indices: range,
    answers: Sequence[Answer],
    bands: Bands,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> list[Tuned]:
    """A row for every board of the block and every question, in order.

    answers : as built, of these boards (others may be among them). progress : called once a row.

    Raises
    ------
    KeyError : the answer as built of a board is missing.
    """
    ensemble, as_built = _answers_as_built(plan, indices, answers)
    nominal = Ensemble(plan.nominal()).reduction(0).system()

    def case_of(answer: Answer) -> BoardCase:
        board, question = answer.sample - indices.start, plan.questions[answer.question]
        try:
            volts = centring_offset(ensemble.reduction(board).system(), nominal)
        except FloatingCircuit:
            volts = 0.0
        return BoardCase(board, question, round(volts / question.excitation.amplitude, DIGITS))

    cases = {k: case_of(a) for k, a in enumerate(as_built) if a.verdict is not Verdict.OK}
    seek(ensemble, list(cases.values()), bands, jobs=jobs)
    rows = []
    for k, bench in enumerate(_on_bench(plan, indices, ensemble, as_built, bands, jobs)):
        outcome = _outcome(as_built[k], cases.get(k))
        rows.append(Tuned(as_built[k].sample, as_built[k].question, **outcome, **bench))
        progress()
    return rows


def benched_block(
    plan: StudyPlan,
    indices: range,
    answers: Sequence[Answer],
    bands: Bands,
    jobs: int,
) -> list[Verdict]:
    """The bench verdicts of ``tuned_block``, without the dear search for what else exists.

    Raises
    ------
    KeyError : the answer as built of a board is missing.
    """
    ensemble, as_built = _answers_as_built(plan, indices, answers)
    rows = _on_bench(plan, indices, ensemble, as_built, bands, jobs)
    return [row["bench_verdict"] for row in rows]


def _answers_as_built(
    plan: StudyPlan, indices: range, answers: Sequence[Answer]
) -> tuple[Ensemble, list[Answer]]:
    """The boards of a block, and their answers as built in the order of its rows."""
    answer_of = {(a.sample, a.question): a for a in answers}
    ensemble = Ensemble(plan.boards(indices))
    return ensemble, [answer_of[indices[i], number] for i, number in plan.rows(indices)]


def _outcome(answer: Answer, case: BoardCase | None) -> dict[str, Any]:
    """The columns of what exists: the search's where there was one, else the board's as built."""
    setting, response = AS_BUILT, answer.response
    verdict, reason = answer.verdict, answer.reason
    orbit: Answer | Orbit | None = answer
    if case is not None and case.best is not None:
        setting, orbit = case.best.setting, case.best.orbit
        verdict, response, reason = Verdict.OK, orbit.response, ""
    elif case is not None:
        verdict, reason = _not_found(answer, case)
        orbit = None
    return {
        "verdict": verdict,
        "response": response,
        "reason": reason,
        **vars(setting),
        "tries": 0 if case is None else len(case.tries),
        "unanswered": 0 if case is None else case.unanswered,
        "followed": 0 if case is None else case.followed,
        **{name: rounded(getattr(orbit, name, _NAN)) for name in ("radius", "penetration", "miss")},
    }


def _not_found(answer: Answer, case: BoardCase) -> tuple[Verdict, str]:
    verdicts = [answer.verdict, *(t.verdict for t in case.tries)]
    failed = verdicts.count(Verdict.FAILED)
    if failed == len(verdicts):
        return Verdict.FAILED, answer.reason
    if 2 * failed >= len(verdicts):
        return Verdict.FAILED, f"{failed} of {len(verdicts)} settings gave no answer"
    reason = f"not found among {len(case.tries)} tries"
    if failed:
        reason += f", {failed} of {len(verdicts)} settings gave no answer"
    return (Verdict.GRAZING if Verdict.GRAZING in verdicts else Verdict.LOST), reason


def _on_bench(
    plan: StudyPlan,
    indices: range,
    ensemble: Ensemble,
    as_built: Sequence[Answer],
    bands: Bands,
    jobs: int,
) -> list[dict[str, Any]]:
    """The columns of what the person finds on each board, and of what it really is.

    as_built : the answers as built, in the rows' order.
    """

    def play(answer: Answer) -> BenchResult:
        board, question = answer.sample - indices.start, plan.questions[answer.question]
        try:
            system = ensemble.reduction(board).system()
            stream = crc32(question.stream.encode("utf-8"))
            return find_on_bench(system, question, bands, seed=(plan.seed, answer.sample, stream))
        except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError) as error:
            failure = f"{type(error).__name__}: {error}"
            return BenchResult(AS_BUILT, question.start.start, False, 0, failure)

    results = list(parallel(play, as_built, jobs))
    moved = [k for k, r in enumerate(results) if r.seen and r.setting != AS_BUILT]
    questions = [plan.questions[answer.question] for answer in as_built]
    cases: list[Case] = [
        (
            as_built[k].sample - indices.start,
            questions[k],
            results[k].setting.of(questions[k].excitation),
            results[k].state,
        )
        for k in moved
    ]
    judged = iter(settled(ensemble, cases, jobs))
    rows = []
    for k, (answer, result) in enumerate(zip(as_built, results, strict=True)):
        verdict, response, reason = answer.verdict, answer.response, answer.reason
        if k in moved:
            orbit, verdict, reason = next(judged)
            response = orbit.response
        elif result.failure:
            verdict, reason = Verdict.FAILED, result.failure
        elif not result.seen and verdict is not Verdict.FAILED:
            verdict, reason = Verdict.LOST, f"not seen at {result.steps} settings"
        columns: dict[str, Any] = {"verdict": verdict, "response": response, "reason": reason}
        columns |= {"seen": result.seen, **vars(result.setting), "steps": result.steps}
        rows.append({f"bench_{name}": value for name, value in columns.items()})
    return rows
