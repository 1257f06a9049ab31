"""The best linear block of a catalogue, and the proof that no other is better.

Levels of error grow from below. At each level every ratio choice that can reach it is joined
(``synthesis.linear_block``) and completed to values, best first. A level at which nothing can be
completed is a lower bound; at the first level where something can, the least error among the
completions is the optimum. Among the choices that reach it, cvxpy and HiGHS choose those with the
fewest distinct values and the lowest price (``synthesis.tie_break``). Work is limited by count,
never by time; where it runs out, the last empty level is what the certificate says.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array, Index
from designer.base.progress import doing, part
from designer.circuit.coefficients import EXACT
from designer.synthesis.kernel_linear import Rules, Values, complete
from designer.synthesis.linear_block import PARTS, Targets, catalogue, slice_from
from designer.synthesis.linear_rules import Bounds, rules_of
from designer.synthesis.preferences import NO_WISHES, Wishes
from designer.synthesis.tie_break import ROOM, Shortfall, error_of, pool_of, select

FIRST_LEVEL, GROWTH, LAST_LEVEL = 1e-9, 1.6, 0.1
"""Levels: the first, then 1e-6 and on by this factor, up to the last."""
MOST_STEPS = 600_000_000
"""Steps of the compiled loops that one search may take: a few seconds."""
THINNED = (8, 4, 2)
"""Where the work runs out with nothing found: every 8th, 4th, 2nd resistor alone is searched."""


@dataclass(frozen=True)
class Cost:
    """What a search took."""

    seconds: float
    """Wall time [s]."""
    rows: int
    """Ratio choices that were joined."""
    steps: int
    """Steps of the loops."""


@dataclass(frozen=True)
class LinearBlock:
    """The parts chosen, and what is known of them."""

    values: dict[str, float]
    """Chosen values by part name [ohm, F]."""
    error: float
    """The least that the largest of the ten errors can be made by the scales; with ``Wishes.slack``
    up to that much above ``least``."""
    least: float
    """The least error that was found."""
    bound: float
    """No choice under the conditions has a smaller error."""
    proved: bool
    """Whether ``least`` is within ``EXACT`` of ``bound``."""
    proof: str
    """How the bound is known, in words."""
    solver: str
    """The solver's word for the choice among equals."""
    cost: Cost
    """What the search took."""


@dataclass(frozen=True)
class LevelSearch:
    """Where a search of levels ended."""

    error: float
    """The least error that was found; infinite if nothing was."""
    parts: Index
    """(14,) indices of the values with that error."""
    empty: float
    """Highest level at which nothing can be completed."""
    whole: bool
    """Whether nothing was left out."""
    reached: int
    """How far any row came, -1 if there was none."""
    rows: int
    """Ratio choices that were joined."""
    steps: int
    """Steps of the loops."""


def best(
    targets: Targets,
    resistors: Array,
    capacitors: Array,
    prices: Array,
    bounds: Bounds,
    wishes: Wishes = NO_WISHES,
    level: float | None = None,
) -> LinearBlock | Shortfall:
    """The choice of least error, among those the fewest distinct values and the lowest price.

    resistors, capacitors : what can be bought [ohm], [F]. prices : (len(capacitors),) price class
    of each; resistors of a grade cost the same. level : the one level of error that is searched;
    without it they grow until something is found. A ``Shortfall`` names what leaves no choice:
    "distinct values", "matched parts", "frequency", "signal level", "stop stiffness", "signal
    resistors" or "side conditions" (together) if there is one without it, else "coefficients" or,
    where ratios can be met but no level of them, "displacement integrators".
    """
    began = time.perf_counter()
    low, high = bounds.signal
    signal = np.sort(resistors[(resistors >= low) & (resistors <= high)])
    if len(signal) == 0:
        return Shortfall("signal resistors", True)
    if bounds.stop > signal[-1]:
        return Shortfall("stop stiffness", True)
    order = np.argsort(capacitors, kind="stable")
    capacitors, prices = capacitors[order], prices[order]
    values = catalogue(signal, capacitors)
    rules = rules_of(values, targets, bounds, wishes)
    if level is None:
        found = _levels(values, rules, MOST_STEPS)
    else:
        found = _level(values, rules, level, MOST_STEPS)
        if not np.isfinite(found.error):
            return Shortfall("coefficients", found.whole)
    if not np.isfinite(found.error) and not found.whole:
        found = _thinned(found, targets, signal, capacitors, bounds, wishes)
    if not np.isfinite(found.error):
        return _why(found, targets, signal, resistors, capacitors, bounds, wishes)
    limit = found.error + max(wishes.slack, 0.0)
    doing("linear block, choices of least error")
    pool, parts = pool_of(values, rules, found.parts, limit, prices, MOST_STEPS // 8)
    doing(f"linear block, fewest values of {len(pool.parts1) + len(pool.parts2)} choices")
    chosen = select(values, rules, pool, parts, limit, prices)
    index = chosen.parts
    error = error_of(values, rules, index)
    least = min(error, found.error)  # with work left over, the second stage may find better
    bound = found.error if found.whole else min(found.empty, least)
    return LinearBlock(
        values={
            name: float((signal if i < 10 else capacitors)[index[i]])
            for i, name in enumerate(PARTS)
        },
        error=error,
        least=least,
        bound=bound,
        proved=least <= bound + EXACT,
        proof=_proof(found, len(signal), len(capacitors)),
        solver=chosen.solver,
        cost=Cost(time.perf_counter() - began, found.rows, found.steps),
    )


def lower_bound(targets: Targets, resistors: Array, capacitors: Array) -> float:
    """What no choice from the whole catalogue can pass, whatever the side conditions."""
    free = Bounds((0.0, np.inf), np.inf, np.inf, 0.0, np.ones(4))
    values = catalogue(resistors, capacitors)
    found = _levels(values, rules_of(values, targets, free, NO_WISHES), MOST_STEPS)
    return found.error if found.whole else found.empty


def _levels(values: Values, rules: Rules, patience: int, level: float = FIRST_LEVEL) -> LevelSearch:
    """Search level by level until something is found, the levels or the steps end."""
    found = LevelSearch(np.inf, np.full(len(PARTS), -1), 0.0, False, -1, 0, 0)
    while True:
        level = min(level, LAST_LEVEL)
        at = _level(values, rules, level, patience - found.steps)
        found = replace(
            at,
            empty=level if at.whole and not np.isfinite(at.error) else found.empty,
            reached=max(found.reached, at.reached),
            rows=found.rows + at.rows,
            steps=found.steps + at.steps,
        )
        if np.isfinite(at.error) or not at.whole or level >= LAST_LEVEL:
            return found
        level *= 1e3 if level < 1e-6 else GROWTH


def _level(values: Values, rules: Rules, level: float, patience: int) -> LevelSearch:
    """The least error at most ``level``; each slice is searched below the best so far."""
    best, parts = np.inf, np.full(len(PARTS), -1)
    start, whole, reached, rows, steps = 0, True, -1, 0, 0
    slices = len(values.deltas) * len(values.r)
    while start < slices:
        doing(f"linear block, errors up to {level:.2g}: {start / slices:.0%} of the joins")
        below = min(level, best)
        piece = slice_from(values, rules, below, start, patience - steps)
        left = patience - steps - piece.steps
        now = np.full(len(PARTS), -1)
        error, far, full, taken = complete(
            values, rules, piece.rows, piece.errors, below, max(left, 0), ROOM, now
        )
        if error < best:
            best, parts = error, now
        whole = whole and full and not piece.cut
        reached = max(reached, far) if len(piece.rows) else reached
        rows, steps, start = rows + len(piece.rows), steps + piece.steps + taken, piece.following
        if steps >= patience:
            whole = whole and start == slices
            break
    return LevelSearch(best, parts, 0.0, whole, reached, rows, steps)


def _thinned(
    found: LevelSearch,
    targets: Targets,
    signal: Array,
    capacitors: Array,
    bounds: Bounds,
    wishes: Wishes,
) -> LevelSearch:
    """Something to offer where the work ran out: the best of a part of the resistors.

    Its bound stays that of the whole catalogue.
    """
    for every in THINNED:
        # The thinned values are a part of all values, so an index is found again in those.
        kept = np.arange(0, len(signal), every)
        values = catalogue(signal[kept], capacitors)
        rules = rules_of(values, targets, bounds, wishes)
        level = max(found.empty, FIRST_LEVEL)
        with part(f"every {every}th resistor"):
            thin = _levels(values, rules, MOST_STEPS // 8, level)
        found = replace(
            found,
            reached=max(found.reached, thin.reached),
            rows=found.rows + thin.rows,
            steps=found.steps + thin.steps,
        )
        if np.isfinite(thin.error) and thin.error < found.error:
            parts = thin.parts.copy()
            parts[:10] = kept[parts[:10]]
            found = replace(found, error=thin.error, parts=parts)
    return replace(found, whole=False)


def _why(
    found: LevelSearch,
    targets: Targets,
    signal: Array,
    resistors: Array,
    capacitors: Array,
    bounds: Bounds,
    wishes: Wishes,
) -> Shortfall:
    """What leaves no choice: the first wish or condition without which there is one."""
    none = replace(bounds, seconds=(0.0, np.inf), level=np.inf, share=np.inf, stop=0.0)
    relaxed = {
        "distinct values": (signal, bounds, replace(wishes, most_values=None)),
        "matched parts": (signal, bounds, replace(wishes, matched=())),
        "frequency": (signal, replace(bounds, seconds=none.seconds), wishes),
        "signal level": (signal, replace(bounds, level=np.inf, share=np.inf), wishes),
        "stop stiffness": (signal, replace(bounds, stop=0.0), wishes),
        "signal resistors": (resistors, bounds, wishes),
        "side conditions": (resistors, none, wishes),
    }
    for name, (allowed, kept, wanted) in relaxed.items():
        if len(allowed) == len(signal) and kept == bounds and wanted == wishes:
            continue
        values = catalogue(allowed, capacitors)
        with part(f"without {name}"):
            again = _levels(values, rules_of(values, targets, kept, wanted), MOST_STEPS // 8)
        if np.isfinite(again.error):
            return Shortfall(name, found.whole)
    last = "displacement integrators" if found.reached >= 0 else "coefficients"
    return Shortfall(last, found.whole)


def _proof(found: LevelSearch, resistors: int, capacitors: int) -> str:
    """How the bound is known, in words."""
    scope = f"all {resistors} resistor and {capacitors} capacitor values"
    empty = (
        f"the joins over {scope} leave no choice with a linear error of {found.empty:.3g} or less"
        if found.empty > 0.0
        else f"over {scope} the first level of error that was searched has an answer"
    )
    after = "next level" if found.empty > 0.0 else "first level"
    if found.whole:
        return (
            f"{empty}; at the {after} every joined choice with an error below {found.error:.6g} "
            f"was completed and none is better ({found.rows} joined in all)"
        )
    return f"{empty}; the next level was not searched to its end ({found.steps:.3g} steps)"
