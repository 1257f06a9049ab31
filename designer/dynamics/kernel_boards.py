"""Compiled answers of many boards: where each settles, by the rules of ``dynamics.attractors``.

The usual way (settle, polish, describe) is compiled. What is unusual on it is left to the caller: a
period above ``LONGEST``, none after 140 drive periods, a mode that is no working one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import compiled, inlined
from designer.dynamics.kernel_four_state import RunTrail, advance, mode_at
from designer.dynamics.kernel_mode_tables import INTS, WIDTH, Modes, fill
from designer.dynamics.kernel_orbit import (
    DONE,
    FOUND,
    LEFT,
    NONE,
    SPENT,
    count_impacts,
    polisher,
)

Float = NDArray[np.float64]
Int = NDArray[np.int64]

POINTS = 128
"""Of an orbit per drive period, for its asymmetry and its waveform."""
LONGEST = 4
"""Longest period that is polished."""
IMPACTS = 512
"""Impacts of an orbit over two laps that there is room for."""
STAGES = (20, 20, 100)
"""Drive periods that are run between two looks for a period."""
ASK = 1
"""Answer beside FOUND: nothing that the compiled code decides; the caller settles it."""
MODE = 5
"""Place in ``Answers.whole``."""


class Answers(NamedTuple):
    """What ``respond_all`` writes for each of E questions."""

    whole: Int
    """(E, 7) ints: FOUND or ASK, n, p, q, drive periods spent, mode at the start, impacts."""
    real: Float
    """(E, 32): start (4), monodromy (16), extremes (8), penetration, miss, asymmetry, 1.0 where a
    tangency is undecided."""
    when: Float
    """(E, IMPACTS) times of the impacts over two laps."""
    speed: Float
    """(E, IMPACTS) velocities at the impacts over two laps."""
    stop: Int
    """(E, IMPACTS) stops of the impacts over two laps."""
    trace: Float
    """(E, LONGEST · POINTS) the displacement over n drive periods."""


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

    data: Float
    """(K, WIDTH) tables of its working modes."""
    ints: Int
    """(K, INTS) their integers."""
    drive: Float
    """(3,) omega, period, most events in a stretch."""
    anchors: Anchors
    """Of whole periods and of parts of one."""
    trail: RunTrail
    """What a measured run writes."""


@inlined
def _lap(
    board: DrivenBoard, x: Float, cursor: Int, phi: Float, strobes: Float, impacts: Int
) -> int:
    """The ``lap`` of ``dynamics.kernel_orbit``; measured where cursor[2] is 1."""
    return advance(
        board.data, board.ints, x, cursor, board.drive, board.anchors.one, phi, strobes, impacts,
        board.trail,
    )  # fmt: skip


@inlined
def _trace(board: DrivenBoard, x: Float, mode: int, anchor: Float, strobes: Float) -> int:
    """A run over the stretches of ``strobes``, each a part of a period."""
    cursor, impacts = np.zeros(3, dtype=np.int64), np.zeros((len(strobes), 2), dtype=np.int64)
    cursor[0] = mode
    return advance(
        board.data, board.ints, x, cursor, board.drive, anchor, np.zeros((0, 0)), strobes, impacts,
        board.trail,
    )  # fmt: skip


@inlined
def _peaks(board: DrivenBoard, x: Float, mode: int, peak: Float) -> bool:
    """``attractors.peaks_near``; False where the run does not come to its end."""
    strobes = np.zeros((33, 4))
    if _trace(board, x, mode, board.anchors.few, strobes) != DONE:
        return False
    top = 0.0
    for i in range(4):
        peak[i] = 0.0
        for k in range(33):
            peak[i] = max(peak[i], abs(strobes[k, i]))
        top = max(top, peak[i])
    for i in range(4):
        peak[i] = max(peak[i], max(1e-9 * top, 1e-300))
    return True


_polish = polisher(_lap)


@inlined
def _respond(board: DrivenBoard, x: Float, j: int, e: int, answers: Answers) -> int:
    """``attractors.settle`` from x (4,) as long as the way is the usual one: FOUND or ASK."""
    cursor, counted = np.zeros(3, dtype=np.int64), np.zeros(4, dtype=np.int64)
    peak, point, monodromy = np.zeros(4), np.zeros(4), np.zeros((4, 4))
    end, nothing = x.copy(), np.zeros((0, 0))
    cursor[0] = -1
    for stage in range(3):
        length = STAGES[stage]
        strobes, impacts = np.zeros((length + 1, 4)), np.zeros((length, 2), dtype=np.int64)
        if _lap(board, end, cursor, nothing, strobes, impacts) != DONE:
            return ASK
        for i in range(4):
            end[i] = strobes[length, i]
        if not _peaks(board, end, cursor[0], peak):
            return ASK
        counted[SPENT] += length + 1
        code = _polish(board, strobes, cursor[0], LONGEST, peak, point, monodromy, counted)
        if code == FOUND and _describe(board, point, counted, j, e, answers):
            for i in range(4):
                for k in range(4):
                    answers.real[e, 4 + 4 * i + k] = monodromy[i, k]
            answers.whole[e, 4] = counted[SPENT]
            return FOUND
        if code != NONE:
            return ASK
    return ASK


@inlined
def _describe(board: DrivenBoard, x: Float, counted: Int, j: int, e: int, answers: Answers) -> bool:
    """``attractors.describe`` of the orbit through x, written as answer e; False if it drifts."""
    cursor, nothing, peak = np.zeros(3, dtype=np.int64), np.zeros((0, 0)), np.zeros(4)
    trail, real, whole, n = board.trail, answers.real[e], answers.whole[e], counted[0]
    for i in range(4):
        trail.extremes[i, 0], trail.extremes[i, 1] = np.inf, -np.inf
    trail.graze[0], trail.graze[1], trail.graze[2], trail.met[0] = np.inf, np.inf, 0.0, 0
    strobes, impacts = np.zeros((3 * n + 1, 4)), np.zeros((3 * n, 2), dtype=np.int64)
    # Measured over two laps, so that a contact that lasts over the strobe is seen whole once.
    cursor[2] = 1
    cursor[0] = whole[MODE] = mode_at(board.data, board.ints, x)
    if _lap(board, x, cursor, nothing, strobes[: 2 * n + 1], impacts[: 2 * n]) != DONE:
        return False
    met = trail.met[0]
    real[28], real[29] = trail.graze[0], trail.graze[1]
    cursor[2] = 0
    if _lap(board, strobes[2 * n], cursor, nothing, strobes[2 * n :], impacts[2 * n :]) != DONE:
        return False
    if met > len(trail.when):
        return False
    for i in range(4):
        low, high = trail.extremes[i, 0], trail.extremes[i, 1]
        peak[i] = max(abs(low), abs(high))
        real[i], real[20 + 2 * i], real[21 + 2 * i] = x[i], low, high
    if not count_impacts(strobes, impacts, n, peak, counted):
        return False
    real[31] = trail.graze[2]
    whole[1], whole[2], whole[3], whole[6] = n, counted[1], counted[2], met
    for k in range(met):
        answers.when[e, k], answers.stop[e, k] = trail.when[k], trail.stop[k]
        answers.speed[e, k] = trail.at[k, j + 1] if j < 3 else 0.0
    return _draw(board, x, n, j, peak, real, answers.trace[e])


@inlined
def _draw(
    board: DrivenBoard, x: Float, n: int, j: int, peak: Float, real: Float, trace: Float
) -> bool:
    """trace ← the displacement over the orbit, and its asymmetry."""
    length = n * POINTS
    strobes = np.zeros((length + 1, 4))
    if _trace(board, x, -1, board.anchors.many, strobes) != DONE:
        return False
    worst = 0.0
    for k in range(length):
        trace[k] = strobes[k, j]
        for i in range(4):
            pair = strobes[k, i] + strobes[(k + length // 2) % length, i]
            worst = max(worst, abs(pair) / peak[i])
    real[30] = worst if n % 2 == 1 else np.nan
    return True


@compiled
def respond_all(
    modes: Modes,
    which: Int,
    drives: Float,
    starts: Float,
    max_events: int,
    anchors: Anchors,
    j: int,
    answers: Answers,
) -> None:
    """Each of E questions: board which[e] under drives[e] from starts[e].

    which : (E,); drives : (E, 3) omega, amplitude, offset; starts : (E, 4). j : which state is the
    displacement.
    """
    count = modes.A.shape[1]
    data, ints = np.zeros((count, WIDTH)), np.zeros((count, INTS), dtype=np.int64)
    trail = RunTrail(
        np.zeros((4, 2)),
        np.zeros(3),
        np.zeros(IMPACTS),
        np.zeros((IMPACTS, 4)),
        np.zeros(IMPACTS, dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )
    drive = np.zeros(3)
    board = DrivenBoard(data, ints, drive, anchors, trail)
    drive[2] = max_events
    fits = LEFT
    for e in range(len(which)):
        same = e > 0 and which[e] == which[e - 1]
        for k in range(3):
            same = same and drives[e, k] == drives[e - 1, k]
        if not same:
            fits = fill(data, ints, modes, which[e], drives[e, 0], drives[e, 1], drives[e, 2])
            drive[0], drive[1] = drives[e, 0], 2.0 * np.pi / drives[e, 0]
        answers.whole[e, 0] = ASK
        if fits == DONE:
            answers.whole[e, 0] = _respond(board, starts[e], j, e, answers)
