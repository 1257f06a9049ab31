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
from designer.circuit.netlist import nominal_board
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics.orbit import Orbit
from designer.model.tuning_bands import Bands
from designer.spread.spread import draw_many
from designer.yields.bench_procedure import BenchResult, find_on_bench
from designer.yields.centring import centring_offset
from designer.yields.generator_offsets import AS_BUILT, Adjustment
from designer.yields.setting_search import BoardCase, seek
from designer.yields.verdict import Answer, StudyPlan, Verdict, judge, kept

DIGITS = 6
"""Decimals of the centring DC offset over the amplitude."""
_NAN = float("nan")


@dataclass(frozen=True)
class Tuned:
    """One sample of one response, with the generator free within the bands."""

    sample: int
    """Number of the board."""
    question: int
    """Number of the question of the plan."""
    verdict: Verdict
    """Ok where some setting works; failed where none is known to and at least half of those asked,
    as built among them, gave no answer; else grazing where one is undecided, and lost where none
    was found, which is no proof that there is none."""
    response: str
    """n-p-q or status at the setting, or as built where nothing was found."""
    reason: str
    """Why it is not ok, or ""."""
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

    @property
    def bench_setting(self) -> Adjustment:
        return Adjustment(self.bench_frequency, self.bench_amplitude, self.bench_offset)


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
    known = {(a.sample, a.question): a for a in answers}
    ensemble = Ensemble(draw_many(plan.circuit, plan.spread, plan.seed, indices))
    asked = [(i, number) for i in range(len(indices)) for number in range(len(plan.questions))]
    bad = [
        (i, number) for i, number in asked if known[indices[i], number].verdict is not Verdict.OK
    ]
    nominal = Reduction(plan.circuit, nominal_board(plan.circuit)).system()

    def centre(board: int, number: int) -> float:
        try:
            volts = centring_offset(ensemble.reduction(board).system(), nominal)
        except FloatingCircuit:
            return 0.0
        return round(volts / plan.questions[number].excitation.amplitude, DIGITS)

    cases = {
        (i, number): BoardCase(i, plan.questions[number], centre(i, number)) for i, number in bad
    }
    seek(ensemble, list(cases.values()), bands, jobs=jobs)
    benches = _on_bench(
        plan, indices, ensemble, [known[indices[i], number] for i, number in asked], bands, jobs
    )
    rows = []
    for (i, number), (result, verdict, response, reason) in zip(asked, benches, strict=True):
        answer, case = known[indices[i], number], cases.get((i, number))
        rows.append(
            Tuned(
                sample=indices[i],
                question=number,
                **_outcome(answer, case),
                bench_verdict=verdict,
                bench_response=response,
                bench_reason=reason,
                bench_seen=result.seen,
                bench_frequency=result.setting.frequency,
                bench_amplitude=result.setting.amplitude,
                bench_offset=result.setting.offset,
                bench_steps=result.steps,
            )
        )
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
    known = {(a.sample, a.question): a for a in answers}
    ensemble = Ensemble(draw_many(plan.circuit, plan.spread, plan.seed, indices))
    asked = [known[i, number] for i in indices for number in range(len(plan.questions))]
    return [row[1] for row in _on_bench(plan, indices, ensemble, asked, bands, jobs)]


def _outcome(answer: Answer, case: BoardCase | None) -> dict[str, Any]:
    """The columns of what exists: the search's where there was one, else the board's as built."""
    if case is None or case.found is None:
        verdict, reason = answer.verdict, answer.reason
        if case is not None:
            verdict, reason = _not_found(answer, case)
        works = verdict is Verdict.OK
        return _columns(
            AS_BUILT, case, verdict, answer.response, reason,
            *((answer.radius, answer.penetration, answer.miss) if works else (_NAN, _NAN, _NAN)),
        )  # fmt: skip
    orbit = case.found.orbit
    return _columns(
        case.found.setting, case, Verdict.OK, orbit.response, "",
        orbit.radius, orbit.penetration, orbit.miss,
    )  # fmt: skip


def _not_found(answer: Answer, case: BoardCase) -> tuple[Verdict, str]:
    met = [answer.verdict, *(t.verdict for t in case.tries)]
    silent = met.count(Verdict.FAILED)
    if silent == len(met):
        return Verdict.FAILED, answer.reason
    if 2 * silent >= len(met):
        return Verdict.FAILED, f"{silent} of {len(met)} settings gave no answer"
    reason = f"not found among {len(case.tries)} tries"
    if silent:
        reason += f", {silent} of {len(met)} settings gave no answer"
    return (Verdict.GRAZING if Verdict.GRAZING in met else Verdict.LOST), reason


def _columns(
    setting: Adjustment,
    case: BoardCase | None,
    verdict: Verdict,
    response: str,
    reason: str,
    radius: float,
    penetration: float,
    miss: float,
) -> dict[str, Any]:
    return {
        "verdict": verdict,
        "response": response,
        "reason": reason,
        "frequency": setting.frequency,
        "amplitude": setting.amplitude,
        "offset": setting.offset,
        "tries": 0 if case is None else len(case.tries),
        "unanswered": 0 if case is None else case.unanswered,
        "followed": 0 if case is None else case.followed,
        "radius": kept(radius),
        "penetration": kept(penetration),
        "miss": kept(miss),
    }


def _on_bench(
    plan: StudyPlan,
    indices: range,
    ensemble: Ensemble,
    known: Sequence[Answer],
    bands: Bands,
    jobs: int,
) -> list[tuple[BenchResult, Verdict, str, str]]:
    """What the person finds on each board, and what it really is (verdict, response, reason):
    ``known`` are the answers as built, in the rows' order."""

    def play(answer: Answer) -> BenchResult:
        board = answer.sample - indices.start
        question = plan.questions[answer.question]
        try:
            system = ensemble.reduction(board).system()
            stream = crc32(question.stream.encode("utf-8"))
            return find_on_bench(system, question, bands, seed=(plan.seed, answer.sample, stream))
        except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError) as error:
            failure = f"{type(error).__name__}: {error}"
            return BenchResult(AS_BUILT, question.start.start, False, 0, failure)

    results = list(parallel(play, known, jobs))
    moved = [k for k, r in enumerate(results) if r.seen and r.setting != AS_BUILT]
    orbits: dict[int, Orbit] = {}
    if moved:
        settled = ensemble.settle(
            [known[k].sample - indices.start for k in moved],
            [
                results[k].setting.of(plan.questions[known[k].question].excitation).drive
                for k in moved
            ],
            np.array([results[k].state for k in moved]),
            jobs=jobs,
        )
        orbits = dict(zip(moved, settled, strict=True))
    out = []
    for k, (answer, result) in enumerate(zip(known, results, strict=True)):
        question = plan.questions[answer.question]
        if k in orbits:
            verdict, reason = judge(orbits[k], question.spec, question.start)
            out.append((result, verdict, orbits[k].response, reason))
        elif result.seen or (answer.verdict is Verdict.FAILED and not result.failure):
            out.append((result, answer.verdict, answer.response, answer.reason))
        elif result.failure:
            out.append((result, Verdict.FAILED, answer.response, result.failure))
        else:
            reason = f"not seen at {result.steps} settings"
            out.append((result, Verdict.LOST, answer.response, reason))
    return out
