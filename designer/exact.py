"""A block of boards on the exact circuit rung: every question, from its nominal orbit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from designer import ensemble
from designer.circuit import nominal_board
from designer.circuit_kernel import POINTS
from designer.deck import Excitation
from designer.ensemble import Ensemble
from designer.flow import Flow
from designer.gate import Subject
from designer.orbit import Orbit, OrbitStatus
from designer.reduction import Reduction
from designer.spread import draw_many
from designer.system import Array, Drive, PiecewiseLinearSystem
from designer.verdict import Answer, StudyPlan, judge


def drive_of(excitation: Excitation) -> Drive:
    """The generator's setting as the exact circuit sees it (``Excitation`` says why the minus)."""
    return excitation.drive


def block(
    plan: StudyPlan,
    indices: range,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> list[tuple[Answer, Subject | None]]:
    """An answer for every board and every question, in order; with what ngspice would need of it.

    ``progress`` is called once an answer.
    """
    boards = Ensemble(draw_many(plan.circuit, plan.spread, plan.seed, indices))
    drives = [drive_of(q.excitation) for q in plan.questions]
    asked = [(i, number) for i in range(len(indices)) for number in range(len(plan.questions))]
    found = boards.respond(
        [i for i, _ in asked],
        [drives[number] for _, number in asked],
        np.array([plan.questions[number].start.start for _, number in asked]),
        jobs=jobs,
        progress=progress,
    )
    nominal = [_displacement(plan, number) for number in range(len(plan.questions))]
    twins = all(stop.upper and stop.lower for stop in plan.circuit.stops)
    out: list[tuple[Answer, Subject | None]] = []
    for (i, number), response in zip(asked, found, strict=True):
        orbit, question = response.orbit, plan.questions[number]
        verdict, reason = judge(orbit, question.spec, question.start)
        subject = None
        waveform = float("nan")
        if len(orbit.start):
            subject = Subject(boards.reduction(i), question.excitation, orbit)
            if orbit.status is OrbitStatus.PERIODIC:
                waveform = waveform_error(response.trace, nominal[number], mirror=twins)
        answer = Answer(
            sample=indices[i],
            question=number,
            verdict=verdict,
            response=orbit.response,
            reason=reason,
            radius=_kept(orbit.radius),
            penetration=_kept(orbit.penetration),
            miss=_kept(orbit.miss),
            asymmetry=_kept(orbit.asymmetry),
            periods=orbit.periods,
            waveform=_kept(waveform),
        )
        out.append((answer, subject))
    return out


def displacement(system: PiecewiseLinearSystem, drive: Drive, orbit: Orbit) -> Array:
    """(n · POINTS,) the first moving state over the n periods of an orbit."""
    return ensemble.displacement(Flow(system, drive), orbit)


def waveform_error(shown: Array, wanted: Array, *, mirror: bool = False) -> float:
    """RMS difference of two displacements over ``wanted``'s peak, at the best shift by whole drive
    periods; nan where they have different periods.

    mirror : the mirror image of ``wanted``, half a drive period on, does as well: a board with
    stops on both sides may show the twin, and is as good.
    """
    if len(shown) != len(wanted):
        return float("nan")
    images = [wanted] + ([-np.roll(wanted, -POINTS // 2)] if mirror else [])
    least = min(
        float(np.sqrt(np.mean((np.roll(shown, k * POINTS) - image) ** 2)))
        for image in images
        for k in range(len(shown) // POINTS)
    )
    return least / float(np.abs(wanted).max())


def _displacement(plan: StudyPlan, number: int) -> Array:
    """Empty where the nominal circuit has no answer; then no board has a waveform error."""
    question = plan.questions[number]
    system = Reduction(plan.circuit, nominal_board(plan.circuit)).system()
    try:
        return displacement(system, drive_of(question.excitation), question.start)
    except ArithmeticError:
        return np.zeros(0)


def _kept(value: float) -> float:
    """A margin to nine digits: its last few depend on how a process lies in memory (which loops of
    the numerical libraries run), and equal studies are equal files."""
    return float(f"{value:.9g}")
