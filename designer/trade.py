"""What accuracy costs on a design: every rung against the most faithful one, and the cheapest that
answers each question.

Two truths are asked. ``board``: the nominal circuit on the rung ``full`` at its finest step; a rung
below it errs by what it leaves out and by its numerics. ``equations``: the exact flow of the model;
there only the ways to compute the model compete. A bound counts as kept only if the error and the
truth's own uncertainty, what its two finest steps differ by, keep it together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from designer.api import Synthesis
from designer.exact import images, waveform_error
from designer.orbit import Orbit, OrbitStatus
from designer.system import Array
from designer.trade_rungs import CIRCUIT, MODEL, RK4, TOP, Answer
from designer.trade_yield import BoardTrade

BOARD, EQUATIONS = "board", "equations"
VELOCITY, WAVEFORM, YIELD = 0.01, 0.001, 0.01
"""Bounds of the questions."""
RESPONSE, IMPACT, WAVE, SHARE = (
    "n-p-q",
    "impact velocity within 1 %",
    "waveform within 0.1 %",
    "yield within 1 %",
)
QUESTIONS = (RESPONSE, IMPACT, WAVE)
"""Of a response; ``SHARE`` is one of boards."""


@dataclass(frozen=True)
class Compared:
    """One rung at one setting on one response.

    right : whether its n-p-q is the truth's (either twin), by truth. error : RMS difference of x1
    over its peak; velocity : largest relative difference of an impact's velocity; both by truth,
    nan where they do not apply. numerical : error against the exact flow of the rung's own
    equations, or where there is none its own finest run; nan for what it is measured against.
    """

    omega: float
    expected: str | None
    answer: Answer
    right: Mapping[str, bool]
    error: Mapping[str, float]
    velocity: Mapping[str, float]
    numerical: float


@dataclass(frozen=True)
class Truth:
    """orbit, shown : of the reference. sure : whether its two finest steps show the same n-p-q.
    error, velocity : what they differ by."""

    orbit: Orbit
    shown: Array
    sure: bool
    error: float
    velocity: float


@dataclass(frozen=True)
class Cheapest:
    """The cheapest rung that answers a question; of all responses where ``omega`` is None.

    measured : the largest error with the truth's uncertainty, of this rung; for n-p-q the number of
    responses it has wrong. shown : whether that keeps the bound; where not, the rung is the one
    that comes nearest. seconds : CPU time of a drive period, summed over the responses.
    """

    question: str
    of: str
    omega: float | None
    rung: str
    level: str
    bound: float
    measured: float
    shown: bool
    seconds: float


@dataclass(frozen=True)
class Trade:
    """rows : by response, then rung and setting. truths : the board's, by response."""

    rows: tuple[tuple[Compared, ...], ...]
    truths: tuple[Truth, ...]
    boards: tuple[BoardTrade | None, ...]
    cheapest: tuple[Cheapest, ...]


def trade(
    made: Synthesis,
    answers: Sequence[Sequence[Answer]],
    boards: Sequence[BoardTrade | None] = (),
) -> Trade:
    """Judge what ``trade_rungs.answers`` and ``trade_yield.boards`` found, response by response."""
    truths = tuple(_truth(some) for some in answers)
    rows = tuple(
        _rows(r.omega, r.expected, some, truth)
        for r, some, truth in zip(made.found, answers, truths, strict=True)
    )
    found = []
    for of in (BOARD, EQUATIONS):
        for question in QUESTIONS:
            for one, truth in zip(rows, truths, strict=True):
                found.append(cheapest(question, of, [one], [truth]))
            if len(rows) > 1:
                found.append(cheapest(question, of, rows, truths))
    return Trade(
        rows,
        truths,
        tuple(boards),
        (*(c for c in found if c is not None), *_of_boards(boards)),
    )


def cheapest(
    question: str,
    of: str,
    rows: Sequence[Sequence[Compared]],
    truths: Sequence[Truth],
) -> Cheapest | None:
    """The cheapest rung and setting that keeps the bound on all of these responses; the nearest
    where none does. None where nothing was asked."""
    bound = {RESPONSE: 0.0, IMPACT: VELOCITY, WAVE: WAVEFORM}[question]
    kinds = dict.fromkeys((row.answer.rung, row.answer.level) for some in rows for row in some)
    best: Cheapest | None = None
    for rung, level in kinds:
        if not _competes(rung, level, of, rows):
            continue
        picked = [
            row
            for some in rows
            for row in some
            if (row.answer.rung, row.answer.level) == (rung, level)
        ]
        if len(picked) < len(rows):
            continue
        errors = [_error(question, of, row, t) for row, t in zip(picked, truths, strict=True)]
        measured = sum(errors) if question == RESPONSE else max(errors)
        seconds = sum(row.answer.seconds for row in picked)
        one = Cheapest(
            question,
            of,
            rows[0][0].omega if len(rows) == 1 else None,
            rung,
            level,
            bound,
            measured,
            measured <= bound,
            seconds,
        )
        if best is None or _rank(one) < _rank(best):
            best = one
    return best


def difference(first: Orbit, second: Orbit) -> float:
    """Largest relative difference of the impacts' speeds, side by side in order of size; nan where
    the counts differ. A twin counts as the same: sides may be exchanged."""
    best = math.nan
    for turn in (1.0, -1.0):
        worst = 0.0
        for side in (1.0, -1.0):
            a = np.sort(np.abs(first.impact_velocities[first.impact_sides == side]))
            b = np.sort(np.abs(second.impact_velocities[second.impact_sides == turn * side]))
            if len(a) != len(b):
                worst = math.nan
                break
            if len(a):
                worst = max(worst, float((np.abs(a - b) / b.max()).max()))
        best = worst if math.isnan(best) else min(best, worst) if worst == worst else best
    return best


def alike(first: Orbit, second: Orbit) -> bool:
    """Whether two orbits are the same n-p-q, either twin; both without a period are alike too."""
    if first.status is not OrbitStatus.PERIODIC or second.status is not OrbitStatus.PERIODIC:
        return first.status is second.status and first.status is OrbitStatus.APERIODIC
    return first.n == second.n and sorted((first.p, first.q)) == sorted((second.p, second.q))


def _rank(one: Cheapest) -> tuple[bool, float]:
    """Those that keep the bound by their cost, the others by how far they are off."""
    measure = one.seconds if one.shown else one.measured
    return (not one.shown, math.inf if math.isnan(measure) else measure)


def _competes(rung: str, level: str, of: str, rows: Sequence[Sequence[Compared]]) -> bool:
    """The truth itself does not: its error is not known."""
    if of == EQUATIONS:
        return rung in (RK4, MODEL)
    finest = [row.answer.level for row in rows[0] if row.answer.rung == TOP][-1:]
    return not (rung == TOP and [level] == finest)


def _error(question: str, of: str, row: Compared, truth: Truth) -> float:
    """With the truth's own uncertainty; infinite where it cannot be said."""
    board = of == BOARD
    right = row.right[of] and (truth.sure or not board)
    if question == RESPONSE:
        return 0.0 if right else 1.0
    own = row.velocity if question == IMPACT else row.error
    beside = (truth.velocity if question == IMPACT else truth.error) if board else 0.0
    total = own[of] + beside
    return total if right and total == total else math.inf


def _truth(some: Sequence[Answer]) -> Truth:
    """The two finest runs of the top rung; without a run nothing is sure."""
    top = [a for a in some if a.rung == TOP]
    if len(top) < 2:
        return Truth(Orbit(OrbitStatus.FAILED), np.zeros(0), False, math.nan, math.nan)
    before, last = top[-2], top[-1]
    return Truth(
        last.orbit,
        last.shown,
        alike(before.orbit, last.orbit),
        _waveform(before.shown, last.shown),
        difference(before.orbit, last.orbit),
    )


def _rows(
    omega: float, expected: str | None, some: Sequence[Answer], truth: Truth
) -> tuple[Compared, ...]:
    exact = next(a for a in some if a.rung == MODEL)
    against = {BOARD: (truth.orbit, truth.shown), EQUATIONS: (exact.orbit, exact.shown)}
    return tuple(
        Compared(
            omega,
            expected,
            a,
            {of: alike(a.orbit, orbit) for of, (orbit, _) in against.items()},
            {of: _waveform(a.shown, shown) for of, (_, shown) in against.items()},
            {of: difference(a.orbit, orbit) for of, (orbit, _) in against.items()},
            _numerical(a, some),
        )
        for a in some
    )


def _numerical(answer: Answer, some: Sequence[Answer]) -> float:
    own = {RK4: MODEL, "ideal": CIRCUIT}.get(answer.rung, answer.rung)
    finest = [a for a in some if a.rung == own][-1]
    return math.nan if finest is answer else _waveform(answer.shown, finest.shown)


def _waveform(shown: Array, wanted: Array) -> float:
    if not len(wanted):
        return math.nan
    return waveform_error(shown, images(wanted, mirror=True))


def _of_boards(boards: Sequence[BoardTrade | None]) -> list[Cheapest]:
    """The exact circuit where its yield is near ngspice's; ngspice on every board where it is
    shown not to be."""
    asked = [b for b in boards if b is not None]
    out = []
    for some in [[b] for b in asked] + ([asked] if len(asked) > 1 else []):
        measured = max(b.bound for b in some)
        off = any(b.off(YIELD) for b in some)
        rung = "ideal" if off else CIRCUIT
        seconds = sum(b.seconds[rung] for b in some)
        out.append(
            Cheapest(
                SHARE,
                BOARD,
                some[0].omega if len(some) == 1 else None,
                rung,
                "gate" if off else "exact",
                YIELD,
                0.0 if off else measured,
                off or measured <= YIELD,
                seconds,
            )
        )
    return out
