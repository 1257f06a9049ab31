"""Compiled core of the sweeps of a model: a transient with its exponent, what is seen after it, and
the name of the motion.

The motion is carried by ``kernels.kernel_modal`` and named by the rules of
``kernels.kernel_orbit``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee, compiled
from designer.kernels.kernel_algebra import spectral_radius
from designer.kernels.kernel_modal import (
    STATE,
    WIDTH,
    ModalTables,
    Watch,
    carry,
    mode_of,
    unwatched,
)
from designer.kernels.kernel_orbit import (
    CHAOS,
    DONE,
    FOUND,
    MAX_PERIOD,
    SPENT,
    count_impacts,
    distance,
    polisher,
)

Float = NDArray[np.float64]
Int = NDArray[np.int64]

RENEWAL = 5
"""Periods between two normalisations of the tangent vector."""
ALIGN = 10
"""Periods in which the tangent vector turns towards the leading direction; they do not count."""
PERIODIC, APERIODIC, NOT_SETTLED, STOPPED, UNNAMED = 0, 1, 2, 3, 4
"""What ``motion`` answers; STOPPED: the flow came to no end."""
SPAN = 200
"""Periods that an exponent has to be taken over before it is believed to be chaos."""
MORE = 300
"""Periods of a further attempt."""


class DrivenModel(NamedTuple):
    """A model under its drive."""

    tables: ModalTables
    """Tables of its modes."""
    period: float
    """Period of the drive."""
    max_events: int
    """Most mode changes in a drive period."""


@callee
def _lap(
    model: DrivenModel, x: Float, cursor: Int, phi: Float, strobes: Float, impacts: Int
) -> int:
    """The ``lap`` of ``kernels.kernel_orbit``."""
    if cursor[0] < 0:
        cursor[0] = mode_of(model.tables.data, x)
    return carry(
        model.tables, x, cursor, model.period, phi, model.max_events, strobes, impacts, unwatched()
    )


@callee
def _exponent(model: DrivenModel, x: Float, cursor: Int, periods: int, rates: Float) -> float:
    """Carry x (4,), written, over ``periods``; the growth of a tangent vector per period.

    cursor : (2,) mode, -1 for the one that holds at x, and on return the flow's code. rates ← of
    the whole blocks of ``RENEWAL`` periods that count, as many as there is room for. nan where the
    flow stopped.
    """
    phi = np.zeros((4, 1))
    phi[0, 0], phi[1, 0], phi[2, 0], phi[3, 0] = 0.5, -0.3, 0.7, 0.4
    place, code = np.zeros(3, dtype=np.int64), DONE
    place[0] = cursor[0]
    growth, done, counted = 0.0, 0, 0
    while done < periods:
        n = min(RENEWAL, periods - done)
        strobes, impacts = np.zeros((n + 1, 4)), np.zeros((n, 2), dtype=np.int64)
        code = _lap(model, x, place, phi, strobes, impacts)
        cursor[0], cursor[1] = place[0], code
        if code != DONE:
            return np.nan
        size = 0.0
        for i in range(4):
            x[i] = strobes[n, i]
            size += phi[i, 0] * phi[i, 0]
        size = max(np.sqrt(size), 1e-300)
        for i in range(4):
            phi[i, 0] /= size
        if done >= ALIGN:
            growth += np.log(size)
            counted += n
            block = done // RENEWAL - ALIGN // RENEWAL
            if n == RENEWAL and block < len(rates):
                rates[block] = np.log(size) / n
        done += n
    return float(growth / max(counted, 1))


@callee
def _travel(
    model: DrivenModel, x: Float, settle: int, tangents: int, strobes: Float, watch: Watch,
    cursor: Int, rates: Float,
) -> float:  # fmt: skip
    """The run of ``motion``, and the growth of a tangent vector in it."""
    cursor[0], cursor[1] = -1, DONE
    free, growth = settle - tangents, np.nan
    if free > 0:
        passed, impacts = np.zeros((free + 1, 4)), np.zeros((free, 2), dtype=np.int64)
        cursor[1] = _lap(model, x, cursor, np.zeros((0, 0)), passed, impacts)
        for i in range(4):
            x[i] = passed[free, i]
    if tangents > 0 and cursor[1] == DONE:
        growth = _exponent(model, x, cursor, tangents, rates)
    if cursor[1] != DONE:
        return growth
    keep = strobes.shape[0] - 1
    mode, impacts = np.zeros(2, dtype=np.int64), np.zeros((keep, 2), dtype=np.int64)
    mode[0] = cursor[0] if cursor[0] >= 0 else mode_of(model.tables.data, x)
    cursor[1] = carry(
        model.tables, x, mode, model.period, np.zeros((0, 0)), model.max_events, strobes, impacts,
        watch,
    )  # fmt: skip
    cursor[0] = mode[0]
    return growth


@callee
def _describe(
    model: DrivenModel, x: Float, n: int, peak: Float, facts: Float, counted: Int
) -> bool:
    """Count the impacts of the orbit through x; False if it drifts.

    facts[1] ← largest |x(nT/2) + x(0)| over the peak, nan for an even period.
    """
    strobes, impacts = np.zeros((3 * n + 1, 4)), np.zeros((3 * n, 2), dtype=np.int64)
    cursor, nothing = np.zeros(3, dtype=np.int64), np.zeros((0, 0))
    cursor[0] = -1
    code = _lap(model, x, cursor, nothing, strobes, impacts)
    if code != DONE or not count_impacts(strobes, impacts, n, peak, counted):
        return False
    facts[1] = np.nan
    if n % 2 == 1:
        half = DrivenModel(model.tables, 0.5 * n * model.period, model.max_events)
        strobes, impacts = np.zeros((2, 4)), np.zeros((1, 2), dtype=np.int64)
        cursor[0] = -1
        _lap(half, x, cursor, nothing, strobes, impacts)
        for i in range(4):  # it ends with the drive's cosine at 1, and here that is -1
            cosine = model.tables.data[cursor[0] * WIDTH + STATE + 20 + i]
            strobes[1, i] = 2.0 * cosine - strobes[1, i]
        facts[1] = distance(strobes[1], x, peak)
    return True


_polish = polisher(_lap)


@callee
def _periodic(
    model: DrivenModel, strobes: Float, peak: Float, orbit: Float, facts: Float, counted: Int
) -> bool:
    """Whether the end of a run leads to a periodic orbit, which is then written."""
    monodromy = np.zeros((4, 4))
    code = _polish(model, strobes, -1, peak, orbit, monodromy, counted)
    if code != FOUND or not _describe(model, orbit, counted[0], peak, facts, counted):
        return False
    facts[0] = spectral_radius(monodromy, 48)
    facts[2] = np.log(max(facts[0], 1e-300)) / counted[0]
    return True


@callee
def _classify(
    model: DrivenModel, strobes: Float, patience: int, growth: float, span: int, peak: Float,
    orbit: Float, facts: Float, counted: Int, cursor: Int,
) -> int:  # fmt: skip
    """What the motion at the end of strobes (k, 4) is; growth : of a tangent vector per period over
    ``span`` periods."""
    if _periodic(model, strobes, peak, orbit, facts, counted):
        return PERIODIC
    x = strobes[strobes.shape[0] - 1].copy()
    tail, impacts = np.zeros((2 * MAX_PERIOD + 1, 4)), np.zeros((2 * MAX_PERIOD, 2), dtype=np.int64)
    turns = 1 + max(patience, 0) // (MORE + 2 * MAX_PERIOD)
    cursor[0], cursor[1] = -1, DONE
    for turn in range(turns):
        facts[2] = growth
        for i in range(4):
            orbit[i] = x[i]
        if growth > CHAOS and (turn > 0 or span >= SPAN):
            return APERIODIC
        if turn == turns - 1:
            break
        growth = _exponent(model, x, cursor, MORE, np.zeros(0))
        if cursor[1] == DONE:
            cursor[1] = _lap(model, x, cursor, np.zeros((0, 0)), tail, impacts)
        if cursor[1] != DONE:
            return STOPPED
        counted[SPENT] += MORE + 2 * MAX_PERIOD
        if _periodic(model, tail, peak, orbit, facts, counted):
            return PERIODIC
        for i in range(4):
            x[i] = tail[2 * MAX_PERIOD, i]
    return NOT_SETTLED


@compiled
def motion(
    model: DrivenModel, x: Float, settle: int, tangents: int, strobes: Float, watch: Watch,
    cursor: Int, rates: Float, patience: int, orbit: Float, facts: Float, counted: Int,
) -> tuple[float, int]:  # fmt: skip
    """From x (4,), written, over ``settle`` periods, the last ``tangents`` of them with a tangent
    vector; then watch those of ``strobes`` (keep + 1, 4). Returns the growth per period (nan where
    the flow stopped), and what the motion at the end is: PERIODIC … STOPPED.

    rates ← growth of the whole blocks of ``RENEWAL`` periods that count, as many as there is room
    for. cursor ← (2,) mode and the flow's code. Where that is not DONE, ``counted`` is empty, or
    there were more impacts than room, the motion is UNNAMED, and nothing below is written.

    watch.peak is never 0 afterwards. patience : periods that may be added where it is neither
    periodic nor chaotic. orbit : (4,) a strobe of it, or where the motion was left. facts : (3,)
    spectral radius, asymmetry half a period later, growth per period. counted : (4,) as
    ``kernels.kernel_orbit`` has it.
    """
    growth = _travel(model, x, settle, tangents, strobes, watch, cursor, rates)
    if cursor[1] != DONE or len(counted) == 0 or watch.entries[0] > len(watch.velocities):
        return growth, UNNAMED
    peak, top = watch.peak, 0.0
    for i in range(4):
        top = max(top, peak[i])
    for i in range(4):
        peak[i] = max(peak[i], max(1e-9 * top, 1e-300))
    return growth, _classify(
        model, strobes, patience, growth, tangents, peak, orbit, facts, counted, cursor
    )
