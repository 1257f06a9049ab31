"""Which attractors many starts of one system lead to, with its chaos told from its transients.

Chaos can be a transient that lives for thousands of drive periods, as long as it happens to. What
one start cannot tell many can: while none of their chaotic motions ends they are watched for
together, and where some of them end the others have to outlive these by far.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from designer.base.arrays import Array
from designer.dynamics import step_budget
from designer.dynamics.attractors import LOOK, followed, same, settle, with_exponent
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.step_budget import Budget

CALM = 30_000
"""Drive periods that all chaotic motions of one system are watched for together, without an end of
one of them, before they are called chaotic."""
SHORTEST = 60
"""Fewest drive periods that each of many is followed for in the first round."""
OUTLIVED = 10.0
"""Where some of them do end, how many of their mean lives the others have to be watched for."""


def coexisting(flow: Flow, states: Iterable[Array]) -> list[Orbit]:
    """The different attractors that these starts lead to, in order of discovery.

    Starts that are left when ``step_budget.STARTS`` steps are spent are not run. Mirror twins
    count as one; aperiodic ones are not told apart, nor are quasi-periodic ones.
    """
    attractors: list[Orbit] = []
    for orbit in outlived(flow, settled(flow, states)):
        met = (k for k, other in enumerate(attractors) if same(flow, orbit, other))
        k = next(met, len(attractors))
        if k == len(attractors):
            attractors.append(orbit)
        else:
            lives = attractors[k].transients + orbit.transients
            attractors[k] = replace(attractors[k], transients=lives)
    return attractors


def settled(flow: Flow, states: Iterable[Array]) -> list[Orbit]:
    """Where these starts settle, as far as ``step_budget.STARTS`` steps carry."""
    orbits: list[Orbit] = []
    left = float(step_budget.STARTS)
    for x in states:
        if left <= 0.0:
            break
        budget = Budget(min(step_budget.SETTLING, left))
        orbits.append(settle(flow, np.asarray(x, dtype=float), budget=budget, watch=0))
        left -= budget.spent
    return orbits


def outlived(
    flow: Flow, orbits: Sequence[Orbit], *, measure: bool = False, known: Sequence[int] = ()
) -> list[Orbit]:
    """Motions of one system, those without a period followed until it is known whether their chaos
    ends: without an end of one of them together for ``CALM`` drive periods, and each for
    ``OUTLIVED`` times as long as those lived on the average that did end.

    measure : the first that is chaotic in the end gets its exponent (``with_exponent``), which is
    one more long look. known : lives of the chaos of other starts (``Orbit.transients``). What
    is chaotic still when ``step_budget.STARTS`` more steps are spent, although others ended, is not
    settled.
    """
    out, left = list(orbits), float(step_budget.STARTS)
    lives = list(known)
    length, calm, each = 0, 0, 0
    while True:
        chaotic = [k for k, o in enumerate(out) if o.status is OrbitStatus.APERIODIC]
        if not chaotic:
            return out
        if calm >= CALM and each >= OUTLIVED * _mean(lives):
            if not measure:
                return out
            k, before = chaotic[0], out[chaotic[0]]
            out[k] = with_exponent(flow, before)
            if out[k].status is OrbitStatus.APERIODIC:
                return out
            out[k] = _ended(out[k], each + out[k].periods - before.periods, lives)
            calm = 0
            continue
        length = 2 * length or max(SHORTEST, min(2 * LOOK, CALM // len(chaotic)))
        for k in chaotic:
            if left <= 0.0:
                return [_open(o, lives) for o in out] if lives else out
            before, budget = out[k], Budget(min(left, step_budget.SETTLING))
            later = followed(flow, before, length, budget)
            left -= budget.spent
            if budget.left <= 0.0:  # cut short: as far as it was seen it is chaotic
                continue
            out[k], calm = later, calm + length
            if later.status is not OrbitStatus.APERIODIC:
                out[k] = _ended(later, each + later.periods - before.periods, lives)
                calm = 0
        each += length


def _ended(orbit: Orbit, life: int, lives: list[int]) -> Orbit:
    """What chaos has ended on, with its life, which is added to those of others."""
    lives.append(life)
    return replace(orbit, transients=(life,))


def _mean(lives: Sequence[int]) -> float:
    return sum(lives) / max(len(lives), 1)


def _open(orbit: Orbit, lives: Sequence[int]) -> Orbit:
    """A motion that is chaotic where others were so for a time: nobody knows whether it stays."""
    if orbit.status is not OrbitStatus.APERIODIC:
        return orbit
    reason = (
        f"chaotic for {orbit.periods} drive periods, and no more are run; the chaos of other "
        f"starts ended after {_mean(lives):.0f} on the average, so this may be a transient too"
    )
    return replace(orbit, status=OrbitStatus.NOT_SETTLED, reason=reason)
