"""Compiled answers of many boards: where each settles, by the rules of ``dynamics.attractors``.

The usual way (settle, polish, describe) is compiled, for n states and C clearances. What is
unusual on it is left to the caller: no period after 800 drive periods, a mode that is no working
one. A working mode that has not been built yet is asked for.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee, compiled
from designer.kernels.kernel_mode_tables import FILLED, DrivenModes, Modes, Unit
from designer.kernels.kernel_orbit import (
    CURSOR,
    DONE,
    FOUND,
    LEFT,
    NONE,
    SPENT,
    UNKNOWN_MODE,
    count_impacts,
    polisher,
)
from designer.kernels.kernel_propagators import GUARD, MEASURE, MODE, RunTrail, advance, mode_at

Float = NDArray[np.float64]
Int = NDArray[np.int64]

POINTS = 128
"""Of an orbit per drive period, for its asymmetry and its waveform."""
IMPACTS = 512
"""Impacts of an orbit over two laps that there is room for."""
STAGES = (20, 20, 100, 660)
"""Drive periods that are run between two looks for a period, as in ``dynamics.attractors``."""
STILL = 1e-9
"""Share of the largest below which a state hardly moves, as in ``dynamics.orbit``."""
ASK, BUILD, NOWHERE = 1, 2, 3
"""Answers beside FOUND: nothing that the compiled code decides, the caller settles it; a mode that
has to be built before the question is put again; no mode that has been built holds at the start."""
CODE, BEGIN, MET, MISSING, COUNTED = 0, 1, 2, 3, 5
"""Places in ``Answers.whole``: FOUND, ASK, BUILD or NOWHERE; the mode at the start; impacts; the
mode and the guard beyond which one is missing; then as ``counted`` of ``kernels.kernel_orbit``."""
ASYMMETRY, UNDECIDED = range(2)
"""Places in ``Answers.facts``; the last is 1.0 where a tangency is undecided."""


class Answers(NamedTuple):
    """What ``answer_all`` writes for each of E questions."""

    whole: Int
    """(E, COUNTED + 2 + 2 C) ints, see the places above; C clearances."""
    start: Float
    """(E, n) a strobe of the orbit."""
    monodromy: Float
    """(E, n, n) its matrix."""
    extremes: Float
    """(E, n + W, 2) least and greatest value of each state, and of each displacement that is
    none."""
    graze: Float
    """(E, C, 2) smallest penetration and nearest miss in each clearance."""
    facts: Float
    """(E, 2) see the places above."""
    when: Float
    """(E, IMPACTS) times of the impacts over two laps."""
    speed: Float
    """(E, IMPACTS) velocities at the impacts over two laps."""
    stop: Int
    """(E, IMPACTS, 2) clearances and sides of the impacts over two laps."""
    trace: Float
    """(E, MAX_PERIOD · POINTS) the state that moves most in the first clearance, over n periods."""


class Anchors(NamedTuple):
    """The drive's sine and cosine at the start of each stretch of a period."""

    one: Float
    """(1, 2) at the start of the one stretch."""
    few: Float
    """(32, 2) of 32 stretches."""
    many: Float
    """(POINTS, 2) of POINTS stretches."""


class DrivenBoard(NamedTuple):
    """A board under a drive."""

    driven: DrivenModes
    """Its modes and their tables."""
    period: float
    """Period of the drive."""
    anchors: Anchors
    """Of whole periods and of parts of one."""
    trail: RunTrail
    """What a measured run writes."""
    missing: Int
    """(2,) mode and guard beyond which a mode has not been built; -1 for none."""


@callee
def _run(
    board: DrivenBoard, x: Float, cursor: Int, phi: Float, anchor: Float, strobes: Float,
    impacts: Int,
) -> int:  # fmt: skip
    """``advance``; what it misses is noted."""
    code = advance(
        board.driven, x, cursor, board.period, anchor, phi, strobes, impacts, board.trail
    )
    if code == UNKNOWN_MODE:
        board.missing[0], board.missing[1] = cursor[MODE], cursor[GUARD]
    return code


@callee
def _lap(
    board: DrivenBoard, x: Float, cursor: Int, phi: Float, strobes: Float, impacts: Int
) -> int:
    """The ``lap`` of ``kernels.kernel_orbit``; measured where cursor[MEASURE] is 1."""
    return _run(board, x, cursor, phi, board.anchors.one, strobes, impacts)


@callee
def _trace(board: DrivenBoard, x: Float, mode: int, anchor: Float, strobes: Float) -> int:
    """A run over the stretches of ``strobes``, each a part of a period."""
    cursor = np.zeros(CURSOR, dtype=np.int64)
    impacts = np.zeros((len(strobes), 2 * board.driven.modes.side.shape[1]), dtype=np.int64)
    cursor[MODE] = mode
    return _run(board, x, cursor, np.zeros((0, 0)), anchor, strobes, impacts)


@callee
def _raise(peak: Float) -> None:
    """peak (states,) ← what ``orbit.peaks_of`` makes of it."""
    top = 0.0
    for i in range(len(peak)):
        top = max(top, peak[i])
    for kind in range(2):
        own = 0.0
        for i in range(kind, len(peak), 2):
            own = max(own, peak[i])
        least = STILL * (own if own > STILL * top else top)
        for i in range(kind, len(peak), 2):
            peak[i] = max(peak[i], max(least, 1e-300))


@callee
def _peaks(board: DrivenBoard, x: Float, mode: int, peak: Float) -> bool:
    """``attractors.peaks_near``; False where the run does not come to its end."""
    strobes = np.zeros((33, len(x)))
    if _trace(board, x, mode, board.anchors.few, strobes) != DONE:
        return False
    for i in range(len(x)):
        peak[i] = 0.0
        for k in range(33):
            peak[i] = max(peak[i], abs(strobes[k, i]))
    _raise(peak)
    return True


_polish = polisher(_lap)


@callee
def _respond(board: DrivenBoard, x: Float, stages: int, e: int, answers: Answers) -> int:
    """``attractors.settle`` from x (n,) as long as the way is the usual one: FOUND, ASK or
    NOWHERE."""
    n, columns = len(x), 2 * board.driven.modes.side.shape[1]
    cursor, counted = np.zeros(CURSOR, dtype=np.int64), answers.whole[e, COUNTED:]
    peak, point, monodromy = np.zeros(n), answers.start[e], answers.monodromy[e]
    end, nothing = x.copy(), np.zeros((0, 0))
    if mode_at(board.driven, x, cursor) == LEFT:
        return NOWHERE
    cursor[MODE], counted[SPENT] = -1, 0
    for stage in range(stages):
        length = STAGES[stage]
        strobes = np.zeros((length + 1, n))
        impacts = np.zeros((length, columns), dtype=np.int64)
        if _lap(board, end, cursor, nothing, strobes, impacts) != DONE:
            return ASK
        for i in range(n):
            end[i] = strobes[length, i]
        if not _peaks(board, end, cursor[MODE], peak):
            return ASK
        counted[SPENT] += length + 1
        code = _polish(board, strobes, cursor[MODE], peak, point, monodromy, counted)
        if code == FOUND and _describe(board, point, e, answers):
            return FOUND
        if code != NONE:
            return ASK
    return ASK


@callee
def _describe(board: DrivenBoard, x: Float, e: int, answers: Answers) -> bool:
    """``attractors.describe`` of the orbit through x, written as answer e; False if it drifts."""
    cursor, nothing, peak = np.zeros(CURSOR, dtype=np.int64), np.zeros((0, 0)), np.zeros(len(x))
    trail, whole, counted = board.trail, answers.whole[e], answers.whole[e, COUNTED:]
    n, columns, extremes = counted[0], 2 * len(trail.graze), answers.extremes[e]
    trail.extremes[:, 0], trail.extremes[:, 1], trail.graze[:] = np.inf, -np.inf, np.inf
    trail.undecided[0], trail.met[0] = 0.0, 0
    strobes, impacts = np.zeros((3 * n + 1, len(x))), np.zeros((3 * n, columns), dtype=np.int64)
    # Measured over two laps, so that a contact that lasts over the strobe is seen whole once.
    if mode_at(board.driven, x, cursor) != DONE:
        return False
    cursor[MEASURE], whole[BEGIN] = 1, cursor[MODE]
    if _lap(board, x, cursor, nothing, strobes[: 2 * n + 1], impacts[: 2 * n]) != DONE:
        return False
    met, facts = trail.met[0], answers.facts[e]
    # Element by element: a whole array would bring its error message, which takes long to compile.
    for c in range(len(trail.graze)):
        for k in range(2):
            answers.graze[e, c, k] = trail.graze[c, k]
    cursor[MEASURE] = 0
    if _lap(board, strobes[2 * n], cursor, nothing, strobes[2 * n :], impacts[2 * n :]) != DONE:
        return False
    if met > len(trail.when):
        return False
    for i in range(len(extremes)):
        extremes[i, 0], extremes[i, 1] = trail.extremes[i, 0], trail.extremes[i, 1]
        if i < len(x):
            peak[i] = max(abs(extremes[i, 0]), abs(extremes[i, 1]))
    _raise(peak)
    if not count_impacts(strobes, impacts, n, peak, counted):
        return False
    facts[UNDECIDED], whole[MET] = trail.undecided[0], met
    for k in range(met):
        clearance, drive = trail.stop[k, 0], board.driven.drive
        row = board.driven.modes.velocity[board.driven.board, clearance]
        answers.when[e, k] = trail.when[k]
        answers.speed[e, k] = row[len(x)] * drive[0] * drive[1] * np.cos(drive[0] * trail.when[k])
        answers.stop[e, k, 0], answers.stop[e, k, 1] = clearance, trail.stop[k, 1]
        for i in range(len(x)):
            answers.speed[e, k] += row[i] * trail.at[k, i]
    return _draw(board, x, n, peak, facts, answers.trace[e])


@callee
def _draw(board: DrivenBoard, x: Float, n: int, peak: Float, facts: Float, trace: Float) -> bool:
    """trace ← the state that moves most in the first clearance; the asymmetry is a fact."""
    length, j = n * POINTS, 0
    if board.driven.modes.displacement.shape[1] > 0:
        row = board.driven.modes.displacement[board.driven.board, 0]
        for i in range(len(x)):
            if abs(row[i]) > abs(row[j]):
                j = i
    strobes = np.zeros((length + 1, len(x)))
    if _trace(board, x, -1, board.anchors.many, strobes) != DONE:
        return False
    worst = 0.0
    for k in range(length):
        trace[k] = strobes[k, j]
        for i in range(len(x)):
            pair = strobes[k, i] + strobes[(k + length // 2) % length, i]
            worst = max(worst, abs(pair) / peak[i])
    facts[ASYMMETRY] = worst if n % 2 == 1 else np.nan
    return True


@callee
def _respond_all(
    modes: Modes, which: Int, drives: Float, starts: Float, stages: int, anchors: Anchors,
    data: Float, ints: Int, width: int, far: int, leaps: bool, closely: bool, unit: Unit,
    answers: Answers,
) -> None:  # fmt: skip
    """Each of E questions: board which[e] under drives[e] from starts[e]."""
    n = len(unit)
    trail = RunTrail(
        np.zeros((n + len(modes.watched), 2)),
        np.zeros((modes.side.shape[1], 2)),
        np.zeros(1),
        np.zeros(IMPACTS),
        np.zeros((IMPACTS, n)),
        np.zeros((IMPACTS, 2), dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )
    missing = np.zeros(2, dtype=np.int64)
    for e in range(len(which)):
        same = e > 0 and which[e] == which[e - 1]
        for k in range(4):
            same = same and drives[e, k] == drives[e - 1, k]
        if not same:
            ints[:, FILLED] = 0
        driven = DrivenModes(
            modes, which[e], drives[e], data, ints, width, far, leaps, closely, unit
        )
        period = 2.0 * np.pi / drives[e, 0]
        board = DrivenBoard(driven, period, anchors, trail, missing)
        missing[0] = -1
        code = _respond(board, starts[e], stages, e, answers)
        answers.whole[e, CODE] = BUILD if missing[0] >= 0 else code
        answers.whole[e, MISSING], answers.whole[e, MISSING + 1] = missing[0], missing[1]


@callee
def _sweep_all(
    modes: Modes, board: int, drives: Float, laps: Int, states: Float, anchors: Anchors,
    data: Float, ints: Int, width: int, far: int, leaps: bool, closely: bool, unit: Unit,
    answers: Answers,
) -> None:  # fmt: skip
    """One board from each of E states through drives that follow each other, without settling."""
    n, columns = len(unit), 2 * modes.side.shape[1]
    trail = RunTrail(
        np.zeros((0, 2)),
        np.zeros((modes.side.shape[1], 2)),
        np.zeros(1),
        np.zeros(0),
        np.zeros((0, n)),
        np.zeros((0, 2), dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )
    cursor, nothing = np.zeros(CURSOR, dtype=np.int64), np.zeros((0, 0))
    missing, whole, ends = np.zeros(2, dtype=np.int64), answers.whole, answers.start
    missing[0] = -1
    for e in range(len(states)):
        whole[e, CODE], whole[e, MISSING] = DONE, -1
        for i in range(n):
            ends[e, i] = states[e, i]
    for s in range(len(drives)):
        ints[:, FILLED] = 0
        driven = DrivenModes(modes, board, drives[s], data, ints, width, far, leaps, closely, unit)
        driven_board = DrivenBoard(driven, 2.0 * np.pi / drives[s, 0], anchors, trail, missing)
        strobes = np.zeros((laps[s] + 1, n))
        impacts = np.zeros((laps[s], columns), dtype=np.int64)
        for e in range(len(states)):
            if whole[e, CODE] != DONE:
                continue
            cursor[MODE] = -1
            whole[e, CODE] = _lap(driven_board, ends[e], cursor, nothing, strobes, impacts)
            if missing[0] >= 0:
                whole[0, MISSING], whole[0, MISSING + 1] = missing[0], missing[1]
                return
            for i in range(n):
                ends[e, i] = strobes[laps[s], i]


@compiled
def answer_all(
    modes: Modes, which: Int, drives: Float, starts: Float, stages: int, laps: Int,
    anchors: Anchors, data: Float, ints: Int, width: int, far: int, leaps: bool, closely: bool,
    unit: Unit, answers: Answers,
) -> None:  # fmt: skip
    """Where boards settle, or what a sweep leads to: the flow in it is compiled for both at once.

    Without ``laps`` each of E questions: board which[e] under drives[e] from starts[e] settles in
    at most so many ``stages``, after which the question is left to the caller. With ``laps`` (S,),
    periods of each of S drives that follow each other: board which[0] goes through all of them from
    each of starts; answers.start gets where it ends, and the place CODE the code of ``advance``;
    where a mode is MISSING in the first answer, nothing else that was written counts.

    which : (E,); drives : (E, 4) or (S, 4) as ``DrivenModes.drive``; starts : (E, n) at drive phase
    0. data, ints, width, far, leaps, closely, unit : as of ``DrivenModes``; all questions share the
    room for tables.
    """
    if len(laps) > 0:
        _sweep_all(
            modes, which[0], drives, laps, starts, anchors, data, ints, width, far, leaps, closely,
            unit, answers,
        )  # fmt: skip
    else:
        _respond_all(
            modes, which, drives, starts, stages, anchors, data, ints, width, far, leaps, closely,
            unit, answers,
        )  # fmt: skip
