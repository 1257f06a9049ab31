"""What a block of boards answers on the exact circuit: every question, from its nominal orbit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import Ensemble, displacement
from designer.circuit.netlist import Excitation
from designer.dynamics.attractors import settle, with_exponent
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.kernels.kernel_boards import POINTS
from designer.spice.numerics_gate import GateSubject
from designer.verdicts.verdict import Answer, Question, StudyPlan, Verdict, rounded

Case = tuple[int, Question, Excitation, Array]
"""A board by its place in an ensemble, the question that it is asked, the generator's setting and
the start."""


def settled(
    ensemble: Ensemble,
    cases: Sequence[Case],
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
    *,
    within: int | None = None,
) -> list[tuple[Orbit, Verdict, str]]:
    """The orbit of each case, its verdict and the reason; ``progress`` is called once each.

    within : as of ``Ensemble.respond``.
    """
    if not cases:
        return []
    boards, questions, excitations, starts = zip(*cases, strict=True)
    drives = [excitation.drive for excitation in excitations]
    orbits = ensemble.settle(
        boards, drives, np.array(starts), jobs=jobs, within=within, progress=progress
    )
    if within is None:
        orbits = [
            _decidable(orbit, question, excitation, ensemble, board)
            for (board, question, excitation, _), orbit in zip(cases, orbits, strict=True)
        ]
    return [(orbit, *q.judge(orbit)) for q, orbit in zip(questions, orbits, strict=True)]


def block(
    plan: StudyPlan,
    indices: range,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> list[Answer]:
    """An answer for every board and every question, in order; ``progress`` is called once each."""
    boards = Ensemble(plan.boards(indices), jobs=jobs)
    return [answer for answer, _, _ in _settled_boards(plan, boards, indices, jobs, progress)]


def of_boards(
    plan: StudyPlan,
    boards: Boards,
    indices: range,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> list[Answer]:
    """The answers (as of ``block``) of what the boards of these samples have become by an
    adjustment."""
    ensemble = Ensemble(plan.modelled(boards), jobs=jobs)
    return [answer for answer, _, _ in _settled_boards(plan, ensemble, indices, jobs, progress)]


def subjects(plan: StudyPlan, indices: range, jobs: int) -> list[tuple[Answer, GateSubject | None]]:
    """``block``'s answers, each with what ngspice needs of its board; None without an orbit."""
    drawn = Ensemble(plan.boards(indices), jobs=jobs)
    pairs: list[tuple[Answer, GateSubject | None]] = []
    for answer, orbit, boards in _settled_boards(plan, drawn, indices, jobs, lambda: None):
        subject = None
        if len(orbit.start):
            reduction = boards.reduction(answer.sample - indices.start)
            excitation = plan.questions[answer.question].excitation
            subject = GateSubject(reduction, excitation, orbit)
        pairs.append((answer, subject))
    return pairs


def _settled_boards(
    plan: StudyPlan, boards: Ensemble, indices: range, jobs: int, progress: Callable[[], None]
) -> Iterator[tuple[Answer, Orbit, Ensemble]]:
    pairs = plan.rows(indices)
    settled = boards.respond(
        [i for i, _ in pairs],
        [plan.questions[number].excitation.drive for _, number in pairs],
        np.array([plan.questions[number].start.start for _, number in pairs]),
        jobs=jobs,
        progress=progress,
    )
    twins = all(stop.upper and stop.lower for stop in plan.circuit.stops)
    wanted = [images(_nominal_displacement(plan, q), mirror=twins) for q in plan.questions]
    for (i, number), response in zip(pairs, settled, strict=True):
        question = plan.questions[number]
        orbit = _decidable(response.orbit, question, question.excitation, boards, i)
        verdict, reason = question.judge(orbit)
        waveform = float("nan")
        if orbit.status is OrbitStatus.PERIODIC:
            waveform = waveform_error(response.trace, wanted[number])
        answer = Answer(
            sample=indices[i],
            question=number,
            verdict=verdict,
            response=orbit.response,
            reason=reason,
            radius=rounded(orbit.radius),
            penetration=rounded(orbit.penetration),
            miss=rounded(orbit.miss),
            asymmetry=rounded(orbit.asymmetry),
            periods=orbit.periods,
            waveform=rounded(waveform),
        )
        yield answer, orbit, boards


def _decidable(
    orbit: Orbit, question: Question, excitation: Excitation, ensemble: Ensemble, board: int
) -> Orbit:
    """The orbit of a board, with its exponent to a smaller error where a least one is wanted and
    the first estimate does not tell."""
    chaotic = orbit.status is OrbitStatus.APERIODIC
    if question.wanted.least_exponent is None or not chaotic:
        return orbit
    if question.judge(orbit)[0] is not Verdict.FAILED:
        return orbit
    return with_exponent(Flow(ensemble.reduction(board).system(), excitation.drive), orbit)


def images(wanted: Array, *, mirror: bool = False) -> Array:
    """(k, n · POINTS) a displacement (n · POINTS,) from each of its n drive periods on.

    mirror : the mirror image, half a drive period on, too: a board with stops on both sides may
    show the twin, and is as good.
    """
    both = [wanted] + ([-np.roll(wanted, -POINTS // 2)] if mirror else [])
    shifted = [np.roll(one, k * POINTS) for one in both for k in range(len(wanted) // POINTS)]
    return np.array(shifted).reshape(len(shifted), len(wanted))


def waveform_error(waveform: Array, wanted: Array) -> float:
    """RMS difference of a displacement (m,) and the ``images`` (k, m) that are wanted, from the
    nearest of them, over their peak; nan where they have different periods."""
    if waveform.shape != wanted.shape[1:] or not len(wanted):
        return float("nan")
    square = ((wanted - waveform) ** 2).mean(axis=1).min()
    return float(np.sqrt(square) / np.abs(wanted[0]).max())


def _nominal_displacement(plan: StudyPlan, question: Question) -> Array:
    """The nominal board's displacement; empty where it has no answer, and then no board has a
    waveform error."""
    reduction, orbit = Ensemble(plan.nominal()).reduction(0), question.start
    try:
        flow = Flow(reduction.system(), question.excitation.drive)
        if orbit.start.shape != (flow.system.size,):  # op-amps that lag have states of their own
            orbit = settle(flow, reduction.state(orbit.start))
        periodic = orbit.status is OrbitStatus.PERIODIC
        return displacement(flow, orbit) if periodic else np.zeros(0)
    except ArithmeticError:
        return np.zeros(0)
