"""The best linear block of a catalogue, and the proof that no other is better.

Levels of error grow from below. At each level every ratio choice that can reach it is joined
(``synthesis.linear_block``) and completed to values, best first. A level at which nothing can be
completed is a lower bound; at the first level where something can, the least error among the
completions is the optimum. Among the choices that reach it, cvxpy and HiGHS choose those with the
fewest distinct values and the lowest price (``synthesis.tie_break``). Work is limited by count,
never by time; where it runs out, the last empty level is what the certificate says.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.base.arrays import Array, Index
from designer.base.progress import doing, part
from designer.circuit.coefficients import EXACT
from designer.model.circuit_table import CircuitSpec
from designer.synthesis.kernel_linear import Rules, Values, complete
from designer.synthesis.linear_block import (
    ANY,
    PARTS,
    Bounds,
    Targets,
    catalogue,
    rules_of,
    slice_from,
)
from designer.synthesis.tie_break import ROOM, Shortfall, error_of, fewest_values

FIRST_LEVEL, GROWTH, LAST_LEVEL = 1e-9, 1.6, 0.1
"""Levels: the first, then 1e-6 and on by this factor, up to the last."""
MOST_STEPS = 600_000_000
"""Steps of the compiled loops that one search may take: a few seconds."""
THINNED = (8, 4, 2)
"""Where the work runs out with nothing found: every 8th, 4th, 2nd resistor alone is searched."""


@dataclass(frozen=True)
class LinearBlock:
    """The parts chosen, and what is known of them."""

    values: dict[str, float]
    """Chosen values by part name [ohm, F]."""
    error: float
    """The least that the largest of the ten errors can be made by the scales; with a slack up to
    that much above ``least``."""
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


@dataclass(frozen=True)
class _Question:
    """What is searched: values [ohm], [F], side conditions, and what the model file asks for."""

    targets: Targets
    resistors: Array
    capacitors: Array
    bounds: Bounds
    spec: CircuitSpec

    @cached_property
    def values(self) -> Values:
        return catalogue(self.resistors, self.capacitors)

    @cached_property
    def rules(self) -> Rules:
        return rules_of(self.values, self.targets, self.bounds, self.spec)


@dataclass(frozen=True)
class _Levels:
    """Where a search of levels ended: the least error with its (14,) indices of values, the highest
    level at which nothing can be completed, whether nothing was left out, how far any row came (-1
    without a row), the ratio choices that were joined and the steps of the loops."""

    error: float
    parts: Index
    empty: float
    whole: bool
    reached: int
    rows: int
    steps: int

    @property
    def nothing(self) -> bool:
        return not np.isfinite(self.error)

    def after(self, before: _Levels) -> _Levels:
        """This search with the work of the one before counted too."""
        return replace(
            self,
            reached=max(before.reached, self.reached),
            rows=before.rows + self.rows,
            steps=before.steps + self.steps,
        )


def best(
    targets: Targets,
    resistors: Array,
    capacitors: Array,
    prices: Array,
    bounds: Bounds,
    spec: CircuitSpec = ANY,
    level: float | None = None,
) -> LinearBlock | Shortfall:
    """The choice of least error, among those the fewest distinct values and the lowest price.

    resistors, capacitors : what can be bought [ohm], [F]. prices : (len(capacitors),) price class
    of each; resistors of a grade cost the same. spec : its matched, preferred, most_values and
    slack count. level : the one level of error that is searched; without it they grow until
    something is found. A ``Shortfall`` names what leaves no choice: "distinct values", "matched
    parts", "frequency", "signal level", "stop stiffness", "signal resistors" or "side conditions"
    (together) if there is one without it, else "coefficients" or, where ratios can be met but no
    level of them, "displacement integrators".
    """
    low, high = bounds.signal
    signal = np.sort(resistors[(resistors >= low) & (resistors <= high)])
    if len(signal) == 0:
        return Shortfall("signal resistors", True)
    if bounds.stop > signal[-1]:
        return Shortfall("stop stiffness", True)
    order = np.argsort(capacitors, kind="stable")
    capacitors, prices = capacitors[order], prices[order]
    question = _Question(targets, signal, capacitors, bounds, spec)
    if level is None:
        found = _levels(question, MOST_STEPS)
    else:
        found = _level(question, level, MOST_STEPS)
        if found.nothing:
            return Shortfall("coefficients", found.whole)
    if found.nothing and not found.whole:
        found = _thinned(found, question)
    if found.nothing:
        return Shortfall(_what_binds(found, question, resistors), found.whole)
    return _linear_block(found, question, prices)


def _linear_block(found: _Levels, question: _Question, prices: Array) -> LinearBlock:
    """Of the choices with the error that was found: the fewest distinct values, the least price."""
    values, rules = question.values, question.rules
    limit = found.error + max(question.spec.slack, 0.0)
    index, solver = fewest_values(values, rules, found.parts, limit, prices, MOST_STEPS // 8)
    error = error_of(values, rules, index)
    least = min(error, found.error)  # with work left over, the second stage may find better
    bound = found.error if found.whole else min(found.empty, least)
    chosen = [*question.resistors[index[:10]].tolist(), *question.capacitors[index[10:]].tolist()]
    return LinearBlock(
        values=dict(zip(PARTS, chosen, strict=True)),
        error=error,
        least=least,
        bound=bound,
        proved=least <= bound + EXACT,
        proof=_proof(found, len(question.resistors), len(question.capacitors)),
        solver=solver,
    )


def _levels(question: _Question, patience: int, level: float = FIRST_LEVEL) -> _Levels:
    """Search level by level until something is found, the levels or the steps end."""
    found = _Levels(np.inf, np.full(len(PARTS), -1), 0.0, False, -1, 0, 0)
    while True:
        level = min(level, LAST_LEVEL)
        at = _level(question, level, patience - found.steps)
        empty = level if at.whole and at.nothing else found.empty
        found = replace(at.after(found), empty=empty)
        if not at.nothing or not at.whole or level >= LAST_LEVEL:
            return found
        level *= 1e3 if level < 1e-6 else GROWTH


def _level(question: _Question, level: float, patience: int) -> _Levels:
    """The least error at most ``level``; each slice is searched below the best so far."""
    values, rules = question.values, question.rules
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
    return _Levels(best, parts, 0.0, whole, reached, rows, steps)


def _thinned(found: _Levels, question: _Question) -> _Levels:
    """Something to offer where the work ran out: the best of a part of the resistors.

    Its bound stays that of the whole catalogue.
    """
    for every in THINNED:
        # The thinned values are a part of all values, so an index is found again in those.
        taken = np.arange(0, len(question.resistors), every)
        fewer = replace(question, resistors=question.resistors[taken])
        with part(f"every {every}th resistor"):
            thin = _levels(fewer, MOST_STEPS // 8, max(found.empty, FIRST_LEVEL))
        found = replace(found.after(thin), whole=False)
        if thin.error < found.error:
            parts = thin.parts.copy()
            parts[:10] = taken[parts[:10]]
            found = replace(found, error=thin.error, parts=parts)
    return found


def _what_binds(found: _Levels, question: _Question, resistors: Array) -> str:
    """What leaves no choice: the first preference or condition without which there is one."""
    for name, relaxed in _relaxations(question, resistors):
        with part(f"without {name}"):
            again = _levels(relaxed, MOST_STEPS // 8)
        if not again.nothing:
            return name
    return "displacement integrators" if found.reached >= 0 else "coefficients"


def _relaxations(question: _Question, resistors: Array) -> Iterator[tuple[str, _Question]]:
    """The question without each condition that it has, by the condition's name."""
    bounds, spec = question.bounds, question.spec
    none = replace(bounds, seconds=(0.0, np.inf), level=np.inf, share=np.inf, stop=0.0)
    if spec.most_values is not None:
        yield "distinct values", replace(question, spec=replace(spec, most_values=None))
    if spec.matched:
        yield "matched parts", replace(question, spec=replace(spec, matched=()))
    for name, relaxed in (
        ("frequency", replace(bounds, seconds=none.seconds)),
        ("signal level", replace(bounds, level=np.inf, share=np.inf)),
        ("stop stiffness", replace(bounds, stop=0.0)),
    ):
        if relaxed != bounds:
            yield name, replace(question, bounds=relaxed)
    if len(resistors) > len(question.resistors):
        yield "signal resistors", replace(question, resistors=resistors)
        yield "side conditions", replace(question, resistors=resistors, bounds=none)
    elif none != bounds:
        yield "side conditions", replace(question, bounds=none)


def _proof(found: _Levels, resistors: int, capacitors: int) -> str:
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
