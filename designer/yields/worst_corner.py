"""Which coordinates of the spread move a margin most, and boards with those at the ends of their
ranges, in every combination.

Coordinates are those of the cube that boards are drawn from. So temperature, ageing and what parts
have in common are coordinates like any other, and a part's value at a corner is one that a board
can have: its temperature coefficient acts with the board's temperature, not beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from designer.base.arrays import Array, Index as Places
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import BRIEF, Ensemble
from designer.circuit.netlist import Circuit
from designer.spread.board_quantities import column
from designer.spread.spread import BOARD, Spread, part_of
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import StudyPlan, Verdict
from designer.yields.margins import Margin
from designer.yields.stored_parts import StoredParts, counted

CUBE = 512
"""Base samples of the Sobol indices; a power of two."""
RESAMPLES = 400
"""Resamples of the bootstrap: a standard error is known within 4 % then."""
NOISE = 1.96
"""Standard errors within which an index lies at 95 %."""
CORNER = 5
"""Coordinates that are put to the ends of their ranges."""
LAST = 1.0 - 2.0**-53
"""End of a coordinate of the cube."""


@dataclass(frozen=True)
class Index:
    """Sobol indices of the margin for one coordinate of the spread."""

    coordinate: str
    part: str
    """Name of the part that it belongs to."""
    first: float
    """First-order Sobol index."""
    total: float
    """Total Sobol index."""
    first_error: float = math.nan
    """Standard error of ``first``; nan where an earlier version made the index."""
    total_error: float = math.nan
    """Standard error of ``total``, likewise."""


@dataclass(frozen=True)
class Corner:
    """Coordinates at the ends of their ranges, all others in the middle of theirs."""

    coordinates: tuple[str, ...]
    """What was put to its ends."""
    worst: tuple[str, ...]
    """For each "low" or "high", the smaller or larger number, in the corner of the least margin."""
    margin: float
    """Margin in the worst corner."""
    verdict: Verdict
    """What became of the corner's board on the exact circuit."""
    response: str
    """n-p-q or status of the corner's board on the exact circuit."""
    survived: int
    """How many of the ``corners`` corners have a board that shows the response."""
    corners: int
    """Corners that were asked."""


def sobol(
    circuit: Circuit, spread: Spread, margins: Sequence[Margin], seed: int, base: int = CUBE
) -> list[tuple[Index, ...]]:
    """Sobol indices of each margin over the spread's coordinates, largest total first.

    Saltelli's estimators with ``base`` base samples on a scrambled Sobol set (scipy.stats), with
    standard errors by the bootstrap over base samples. Empty where nothing limits.
    """
    from scipy.stats import sobol_indices, uniform  # takes a second

    names = spread.coordinates(circuit)
    limited = [k for k, margin in enumerate(margins) if margin.limits]
    if not limited:
        return [() for _ in margins]

    def values(cube: Array) -> Array:
        boards = spread.from_cube(circuit, np.minimum(cube.T, LAST))
        return np.stack([margins[k].of(boards) for k in limited])

    errors: list[Array] = []

    def method(f_A: Array, f_B: Array, f_AB: Array) -> tuple[Array, Array]:  # scipy's names
        generator = np.random.default_rng([seed, base, RESAMPLES])
        drawn = generator.multinomial(base, np.full(base, 1.0 / base), RESAMPLES).astype(float)
        errors.extend(each.std(axis=-1, ddof=1) for each in saltelli(f_A, f_B, f_AB, drawn))
        first, total = saltelli(f_A, f_B, f_AB, np.ones((1, base)))
        return first[..., 0], total[..., 0]

    even: Any = uniform()  # scipy's own distribution is none by its type hints
    indices = sobol_indices(
        func=values,
        n=base,
        dists=[even] * len(names),
        rng=np.random.default_rng([seed, base]),
        method=method,
    )
    shape = (len(limited), len(names))
    ranked: list[tuple[Index, ...]] = [() for _ in margins]
    for k, *found in zip(
        limited,
        np.reshape(indices.first_order, shape).tolist(),
        np.reshape(indices.total_order, shape).tolist(),
        *(each.tolist() for each in errors),
        strict=True,
    ):
        rows = [Index(n, part_of(n), *each) for n, *each in zip(names, *found, strict=True)]
        ranked[k] = tuple(sorted(rows, key=lambda x: (-x.total, x.coordinate)))
    return ranked


def saltelli(a: Array, b: Array, ab: Array, counts: Array) -> tuple[Array, Array]:
    """First-order and total indices (m, d, r) of m margins over d coordinates, in r resamples; 0
    where nothing varies.

    a, b : (m, n) margins of the two base sets, about their common mean. ab : (d, m, n) of ``a``
    with one coordinate from ``b``. counts : (r, n) how often each base sample stands in a resample.
    Source : Saltelli et al., Computer Physics Communications 181 (2010), table 2, (b) and (f).
    """
    share = (counts / counts.sum(axis=1, keepdims=True)).T
    variance = 0.5 * (a**2 + b**2) @ share - (0.5 * (a + b) @ share) ** 2
    first, total = (b * (ab - a)) @ share, 0.5 * (ab - a) ** 2 @ share
    with np.errstate(divide="ignore", invalid="ignore"):
        indices = [np.moveaxis(each / variance, 0, 1) for each in (first, total)]
    return np.nan_to_num(indices[0]), np.nan_to_num(indices[1])


def worst_corners(
    plan: StudyPlan,
    margins: Sequence[Margin],
    indices: Sequence[Sequence[Index]],
    jobs: int,
    progress: Callable[[], None],
    parts: StoredParts | None = None,
) -> list[Corner | None]:
    """For each question the corners of its ``CORNER`` largest indices, on the exact circuit; None
    where nothing limits. progress : called once an attractor. parts : the known ones, and where the
    others go.
    """
    parts = StoredParts() if parts is None else parts
    corners: list[Corner | None] = []
    for number, (margin, ranked) in enumerate(zip(margins, indices, strict=True)):
        # A margin of more crossings is another margin.
        name = f"corner {number} of {margin.sought}"
        compute = partial(_worst, plan, number, margin, ranked, jobs)
        corners.append(counted(parts, name, progress, compute))
    return corners


def _worst(
    plan: StudyPlan,
    number: int,
    margin: Margin,
    ranked: Sequence[Index],
    jobs: int,
    progress: Callable[[], None],
) -> Corner | None:
    """The corner of one question."""
    # Measured boards are in no order, so they have no ends.
    names = [x.coordinate for x in ranked if x.total > 0.0 and x.coordinate != BOARD][:CORNER]
    if not names:
        return None
    places = {name: k for k, name in enumerate(plan.spread.coordinates(plan.circuit))}
    columns = [places[name] for name in names]
    picks = np.array(list(product((0, 1), repeat=len(names))), dtype=np.intp)
    boards = _at(plan, columns, picks)
    question = plan.questions[number]
    start = question.start.start
    cases: list[Case] = [(i, question, question.excitation, start) for i in range(len(boards))]
    ensemble, values = Ensemble(boards), margin.of(boards)
    rows = settled(ensemble, cases, jobs, progress, within=BRIEF)
    worst = int(np.argmin(values))
    if rows[worst][1] is not Verdict.OK:  # what it shows instead is stated
        (rows[worst],) = settled(ensemble, [cases[worst]])
    ends = picks[worst] ^ _falling(plan, columns, names, margin)
    return Corner(
        tuple(names),
        tuple("low" if end == 0 else "high" for end in ends),
        float(values[worst]),
        rows[worst][1],
        rows[worst][0].response,
        sum(verdict is Verdict.OK for _, verdict, _ in rows),
        len(boards),
    )


def _at(plan: StudyPlan, columns: Sequence[int], picks: Places) -> Boards:
    """Boards with these coordinates at their first (0) or last (1) end, a row of ``picks`` each."""
    cube = np.full((len(picks), len(plan.spread.coordinates(plan.circuit))), 0.5)
    cube[:, columns] = np.where(picks == 1, LAST, 0.0)
    return plan.modelled(plan.spread.from_cube(plan.circuit, cube))


def _falling(
    plan: StudyPlan, columns: Sequence[int], names: Sequence[str], margin: Margin
) -> Places:
    """(k,) 1 where the quantity of a coordinate's name falls with it, as a lower limit does."""
    by_name = {q.name: q for q in margin.quantities}
    out = np.zeros(len(names), dtype=np.intp)
    for k, (place, name) in enumerate(zip(columns, names, strict=True)):
        if name in by_name:
            first, last = column(_at(plan, [place], np.array([[0], [1]])), by_name[name])
            out[k] = last < first
    return out
