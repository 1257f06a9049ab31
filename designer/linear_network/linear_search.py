"""The best linear block of a catalogue, and the proof that no other is better.

Levels of error grow from below. A level at which no choice can be completed is a lower bound; at
the first level where one can, the least error among them is the optimum. Two masses with all terms
are searched by joins (``linear_network.pair_search``), every other pattern of terms by a tree of
choices (``linear_network.term_search``). Among the choices that reach the optimum, cvxpy and HiGHS
choose those with the fewest distinct values and the lowest price. Work is limited by count, never
by time; where it runs out, the last empty level is what the certificate says, and the answer of a
tree is the best that dives into it find (``linear_network.term_search``).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.progress import part
from designer.circuit.coefficients import EXACT
from designer.linear_network.linear_terms import (
    ANY,
    Bounds,
    Levels,
    LevelSearch,
    LinearBlock,
    LinearQuestion,
    Shortfall,
    Targets,
)
from designer.linear_network.pair_search import PairSearch
from designer.linear_network.term_search import TermDives, TermSearch
from designer.model.circuit_table import CircuitSpec

LAST_LEVEL = 0.1
"""The last level of error that is searched."""
MOST_STEPS = 600_000_000
"""Steps of the compiled loops that one search may take: a few seconds by joins, up to a minute in
a tree of choices."""
THINNED = (8, 4, 2)
"""Where the work runs out with nothing found: every 8th, 4th, 2nd resistor alone is searched."""
ROUNDING = 1e-10
"""Of an error against its level."""


def best(
    targets: Targets,
    resistors: Array,
    capacitors: Array,
    prices: Array,
    bounds: Bounds,
    spec: CircuitSpec = ANY,
    level: float | None = None,
    empty: float = 0.0,
) -> LinearBlock | Shortfall:
    """The choice of least error, among those the fewest distinct values and the lowest price.

    resistors, capacitors : what can be bought [ohm], [F]. prices : (len(capacitors),) price class
    of each; resistors of a grade cost the same. spec : its matched, preferred, most_values and
    slack count. level : the one level of error that is searched; without it they grow until
    something is found. empty : a level at which wider conditions leave nothing, so that a tree of
    choices may begin there.

    A ``Shortfall`` names what leaves no choice: "distinct values", "matched parts", "frequency",
    "signal level", "stop stiffness", "signal resistors" or "side conditions" (together) if there is
    one without it, else "coefficients" or, where ratios can be met but no level of them,
    "displacement integrators".
    """
    low, high = bounds.signal
    signal = np.sort(resistors[(resistors >= low) & (resistors <= high)])
    if len(signal) == 0:
        return Shortfall("signal resistors", True)
    if bounds.stop > signal[-1]:
        return Shortfall("stop stiffness", True)
    order = np.argsort(capacitors, kind="stable")
    capacitors, prices = capacitors[order], prices[order]
    question = LinearQuestion(targets, signal, capacitors, prices, bounds, spec)
    if level is None:
        levels = _answered(question, MOST_STEPS, empty)
    else:
        search = _search(question)
        levels = search.level(max(level, search.first), MOST_STEPS)
        if levels.nothing:
            return Shortfall("coefficients", levels.whole)
    if levels.nothing and not levels.whole and question.by_joins:
        levels = _thinned(levels, question)
    if levels.nothing:
        return Shortfall(_what_binds(levels, question, resistors), levels.whole)
    return _linear_block(levels, question)


def lower_bound(question: LinearQuestion, found: float, patience: int) -> tuple[float, str]:
    """A level of error below which no choice keeps the conditions, and how that is known.

    question : with every resistor and capacitor, ascending. found : an error that a choice has.
    patience : steps, after which the last empty level stands.
    """
    low, high = question.bounds.signal
    own = question.resistors
    question = replace(question, resistors=np.sort(own[(own >= low) & (own <= high)]))
    levels = _levels(question, patience, last=found)
    if not levels.nothing:
        return (levels.error if levels.whole else levels.empty), _proof(levels, question)
    proof = f"{_scope(levels, question)}; the next level was not searched to its end"
    if levels.whole:
        proof = _scope(levels, question)
    return levels.empty, f"{proof} ({levels.steps:.3g} steps)"


def _search(question: LinearQuestion) -> LevelSearch:
    return PairSearch(question) if question.by_joins else TermSearch(question)


def _linear_block(levels: Levels, question: LinearQuestion) -> LinearBlock:
    """Of the choices with the error that was found: the fewest distinct values, the least price."""
    search, resistors = _search(question), len(question.targets.entries)
    limit = levels.error + max(question.spec.slack, 0.0)
    index, solver = search.fewest(levels.parts, limit, MOST_STEPS // 8)
    error = search.error(index)
    least = min(error, levels.error)  # with work left over, the second stage may find better
    bound = levels.error if levels.whole else min(levels.empty, least)
    chosen = [
        *question.resistors[index[:resistors]].tolist(),
        *question.capacitors[index[resistors:]].tolist(),
    ]
    return LinearBlock(
        values=dict(zip(question.targets.parts, chosen, strict=True)),
        error=error,
        least=least,
        bound=bound,
        proved=least <= bound + EXACT,
        proof=_proof(levels, question),
        solver=solver,
    )


def _levels(
    question: LinearQuestion, patience: int, empty: float = 0.0, last: float = LAST_LEVEL
) -> Levels:
    """Search level by level until something is found, the levels or the steps end.

    empty : a level at which there is nothing. last : the last one that is searched.
    """
    search = _search(question)
    level = max(empty, search.first)
    levels = Levels(np.inf, np.full(len(question.targets.parts), -1), empty, False, -1, 0, 0)
    while True:
        level = min(level, last, levels.error)
        at = search.level(level, patience - levels.steps)
        best = at.error <= level + ROUNDING
        empty = level if at.whole and not best else levels.empty
        levels = replace(at.after(levels), empty=empty, whole=at.whole and (best or at.nothing))
        if best or not at.whole or level >= last:
            return levels
        level *= 1e3 if level < 1e-6 else search.growth


def _answered(question: LinearQuestion, patience: int, empty: float = 0.0) -> Levels:
    """The levels; in a tree of choices with half of the work, and where it runs out with nothing
    found, the best that dives find with the other half. Its bound stays the level that is empty."""
    if question.by_joins:
        return _levels(question, patience)
    levels = _levels(question, patience // 2, empty)
    if not levels.nothing or levels.whole:
        return levels
    near = TermDives(TermSearch(question)).best(max(levels.empty, EXACT), patience // 2)
    return replace(near.after(levels), empty=levels.empty, whole=False)


def _thinned(levels: Levels, question: LinearQuestion) -> Levels:
    """Something to offer where the work ran out: the best of a part of the resistors.

    Its bound stays that of the whole catalogue.
    """
    resistors = len(question.targets.entries)
    for every in THINNED:
        # The thinned values are a part of all values, so an index is found again in those.
        taken = np.arange(0, len(question.resistors), every)
        fewer = replace(question, resistors=question.resistors[taken])
        with part(f"every {every}th resistor"):
            thin = _levels(fewer, MOST_STEPS // 8, levels.empty)
        parts = thin.parts.copy()
        parts[:resistors] = taken[parts[:resistors]]
        levels = replace(replace(thin, parts=parts).after(levels), empty=levels.empty, whole=False)
    return levels


def _what_binds(levels: Levels, question: LinearQuestion, resistors: Array) -> str:
    """What leaves no choice: the first preference or condition without which there is one."""
    for name, relaxed in _relaxations(question, resistors):
        with part(f"without {name}"):
            again = _answered(relaxed, MOST_STEPS // 8)
        if not again.nothing:
            return name
    return "displacement integrators" if levels.reached >= 0 else "coefficients"


def _relaxations(
    question: LinearQuestion, resistors: Array
) -> Iterator[tuple[str, LinearQuestion]]:
    """The question without each condition that it has, by the condition's name."""
    bounds, spec = question.bounds, question.spec
    off: dict[str, dict[str, Any]] = {
        "frequency": {"seconds": (0.0, np.inf)},
        "signal level": {"level": np.inf, "share": np.inf},
        "stop stiffness": {"stop": 0.0},
    }
    there = {
        name: without
        for name, without in off.items()
        if any(getattr(bounds, key) != value for key, value in without.items())
    }
    none = replace(bounds, **{k: v for without in off.values() for k, v in without.items()})
    if spec.most_values is not None:
        yield "distinct values", replace(question, spec=replace(spec, most_values=None))
    if spec.matched:
        yield "matched parts", replace(question, spec=replace(spec, matched=()))
    for name, without in there.items():
        yield name, replace(question, bounds=replace(bounds, **without))
    if len(resistors) > len(question.resistors):
        yield "signal resistors", replace(question, resistors=resistors)
        yield "side conditions", replace(question, resistors=resistors, bounds=none)
    elif there:
        yield "side conditions", replace(question, bounds=none)


def _proof(levels: Levels, question: LinearQuestion) -> str:
    """How the bound is known, in words."""
    pair = question.by_joins
    choice = "joined choice" if pair else "choice"
    did, those = ("completed", "joined") if pair else ("looked at", "looked at")
    empty = _scope(levels, question)
    after = "next level" if levels.empty > 0.0 else "first level"
    if levels.error <= EXACT and not levels.whole and not pair:
        return f"no error is below 0, and one up to {EXACT:g} counts as none"
    if levels.whole:
        return (
            f"{empty}; at the {after} every {choice} with an error below {levels.error:.6g} "
            f"was {did} and none is better ({levels.rows} {those} in all)"
        )
    return f"{empty}; the next level was not searched to its end ({levels.steps:.3g} steps)"


def _scope(levels: Levels, question: LinearQuestion) -> str:
    """Over which values there is nothing up to which level, in words."""
    resistors, capacitors = len(question.resistors), len(question.capacitors)
    pair = question.by_joins
    way = "joins" if pair else "tree of choices"
    scope = f"all {resistors} resistor and {capacitors} capacitor values"
    if levels.empty > 0.0:
        return (
            f"the {way} over {scope} leave{'' if pair else 's'} no choice with a linear error of "
            f"{levels.empty:.3g} or less"
        )
    return f"over {scope} the first level of error that was searched has an answer"
