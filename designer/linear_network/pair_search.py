"""Two masses with all terms: levels of error searched by joins.

At each level every ratio choice that can reach it is joined (``linear_network.linear_block``) and
completed to values, best first. Among the choices of least error cvxpy and HiGHS choose those with
the fewest distinct values and the lowest price.

The joins leave every choice that reaches the least error, and elementary inequalities those of
them that can have the fewest distinct values. cvxpy and HiGHS choose one completion of each mass
that agree, with the four scales as continuous variables. The solver is not believed: its choice
is rebuilt from the values and its error computed afresh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from designer.base.arrays import Array, Index
from designer.base.progress import best_so_far, doing
from designer.circuit.scale_fit import minimax
from designer.linear_network.kernel_completions import complete, gather
from designer.linear_network.kernel_linear import Rules, Values
from designer.linear_network.linear_block import (
    PARTS,
    catalogue,
    residuals_of,
    rules_of,
    slice_from,
)
from designer.linear_network.linear_terms import Levels, LinearQuestion
from designer.linear_network.milp import PRICE_WEIGHT, SOLVER, chosen_row, distinct_values

if TYPE_CHECKING:
    pass


ROOM, GROUPS, COMPLETIONS = 1 << 13, 1 << 12, 1 << 14
"""Completions of one mass that are held for one group; groups and completions in all."""
LARGEST = 300
"""Completions that the program holds; of more, those with the fewest values and least price."""
LEAST_UNIT = 1e-9
"""Errors are counted in units of the limit, and that is at least this."""

OWN = [PARTS.index(name) for name in ("R2", "R9", "R3", "R8", "C2", "C4")]
FIRST = [PARTS.index(name) for name in ("R4", "R10", "R1", "C1")]
SECOND = [PARTS.index(name) for name in ("R5", "R11", "R7", "C3")]
"""Columns of a group's own parts, and of those that a completion of each mass brings."""


@dataclass(frozen=True)
class _Side:
    """Completions of one mass: (k, 14) indices of the values, the group's own parts among them and
    -1 for the other mass; and (k,) the group of each."""

    parts: Index
    group: Index


@dataclass(frozen=True)
class _Pool:
    """What the program chooses from, and the fewest distinct values of a choice."""

    sides: tuple[_Side, _Side]
    fewest: int

    def __len__(self) -> int:
        return sum(len(side.group) for side in self.sides)


def fewest_values(
    values: Values, rules: Rules, parts: Index, limit: float, prices: Array, patience: int
) -> tuple[Index, str]:
    """The choice (14,) with the fewest distinct values, then the lowest price; and HiGHS' word.

    parts : (14,) a choice with an error of at most ``limit``. prices : price class of each
    capacitor. patience : steps of the loops.
    """
    doing("integrators, choices of least error")
    pool, known = _pool(values, rules, parts, limit, prices, patience)
    doing(f"integrators, fewest values of {len(pool)} choices")
    status, chosen = _solve(values, rules, pool, limit, prices)
    # The solver is not believed: its choice stands only if it is as good as the one that is known.
    if chosen is None or not (
        error_of(values, rules, chosen) <= limit + 2e-9
        and kinds_of(rules, chosen[None, :])[0] <= pool.fewest
        and prices[chosen[10:]].sum() <= prices[known[10:]].sum()
        and not any(chosen[i] != chosen[j] for i, j in np.argwhere(rules.ties))
    ):
        chosen = known
    return chosen, f"HiGHS: {status}"


def _pool(
    values: Values, rules: Rules, parts: Index, limit: float, prices: Array, patience: int
) -> tuple[_Pool, Index]:
    """The completions that can belong to a choice of the fewest values, and one such choice."""
    best, fewest = parts.copy(), int(kinds_of(rules, parts[None, :])[0])
    columns = (FIRST, SECOND)
    rows = [[np.where(np.isin(np.arange(14), [*OWN, *own]), best, -1)[None, :]] for own in columns]
    labels = [[np.zeros(1, dtype=np.int64)] for _ in columns]
    start, label, slices = 0, 1, len(values.deltas) * len(values.r)
    while start < slices and patience > 0:
        doing(f"choices of least error, {start / slices:.0%}")
        fewer = rules._replace(most=min(rules.most, fewest))
        piece = slice_from(values, fewer, limit, start, patience)
        groups = np.zeros((GROUPS, 2), dtype=np.int64)
        own1 = np.zeros((COMPLETIONS, 5), dtype=np.int64)
        own2 = np.zeros((COMPLETIONS, 5), dtype=np.int64)
        now = best.copy()
        count, n, n1, n2, _, taken = gather(
            values, fewer, piece.rows, limit, patience, ROOM, fewest, groups, own1, own2, now
        )
        if count < fewest:
            best, fewest = now, count
        shared = piece.rows[groups[:n, 0]]
        group = np.full((n, 14), -1, dtype=np.int64)
        group[:, OWN] = np.column_stack(
            [shared[:, 1:5], values.delta_c2[groups[:n, 1]], values.delta_c4[groups[:n, 1]]]
        )
        for side, own in enumerate((own1[:n1], own2[:n2])):
            filled = group[own[:, 0]]
            filled[:, columns[side]] = own[:, 1:]
            rows[side].append(filled)
            labels[side].append(own[:, 0] + label)
        label, start = label + n, piece.following
        patience -= piece.steps + taken
    sides = [_Side(np.concatenate(r), np.concatenate(g)) for r, g in zip(rows, labels, strict=True)]
    return _largest(rules, sides, fewest, prices), best


def _largest(rules: Rules, sides: Sequence[_Side], fewest: int, prices: Array) -> _Pool:
    """Without the rows that have too many values by themselves, and no larger than the program
    can be: groups and rows with the fewest values and the lowest price first, and always the
    choice that is known."""
    ranked, least = [], []
    for side in sides:
        kinds = kinds_of(rules, side.parts)
        bought = side.parts[:, 10:]
        price = np.where(bought >= 0, prices[np.maximum(bought, 0)], 0.0).sum(axis=1)
        order = np.lexsort((np.arange(len(kinds)), price, kinds))
        order = order[kinds[order] <= fewest]
        ranked.append(_Side(side.parts[order], side.group[order]))
        worst_first = order[::-1]
        least.append(dict(zip(side.group[worst_first], kinds[worst_first], strict=True)))
    both = sorted(least[0].keys() & least[1].keys())
    both.sort(key=lambda g: int(least[0][g] + least[1][g]))
    taken = [np.zeros(len(side.group), dtype=bool) for side in ranked]
    room = LARGEST
    for g in [0, *both]:
        for side, own in zip(ranked, taken, strict=True):
            rows = np.flatnonzero((side.group == g) & ~own)
            own[rows[: max(room // 2, 0)]] = True
        room = LARGEST - int(sum(own.sum() for own in taken))
    first, second = (_Side(s.parts[t], s.group[t]) for s, t in zip(ranked, taken, strict=True))
    return _Pool((first, second), fewest)


def residuals(values: Values, rules: Rules, parts: Index) -> tuple[Array, Array]:
    """(k, 10) offsets and (10, 4) scales (alpha, p, q1, q3) of the coefficient errors.

    parts : (k, 14) indices.
    """
    return residuals_of(values.r[parts[:, :10]], values.c[parts[:, 10:]], rules.w)


def error_of(values: Values, rules: Rules, parts: Index) -> float:
    """The least max error of one choice, by linear programming from its values alone."""
    h, D = residuals(values, rules, parts[None, :])
    return float(np.abs(h[0] + D @ minimax(h[0], D)).max())


def kinds_of(rules: Rules, parts: Index) -> Index:
    """Distinct values of each row of (k, 14) parts; without the preferred, -1 is no part."""
    many = len(rules.free_r)
    code = np.where(parts < 0, -1, parts + np.where(np.arange(14) < 10, 0, many)[None, :])
    free = np.concatenate([rules.free_r, rules.free_c, [True]])
    ordered = np.sort(np.where(free[code], -1, code), axis=1)
    is_first = np.diff(ordered, axis=1, prepend=-1) > 0
    return np.asarray(is_first.sum(axis=1))


def _nominal(values: Values, rules: Rules, parts: Index) -> Array:
    """(k, 4) scales that make the errors small; q1 of first rows, q3 of second ones."""
    whole = np.maximum(parts, 0)
    h, _ = residuals(values, rules, whole)
    alpha = -h[:, :4].mean(axis=1)
    p = 0.5 * (h[:, 3] - h[:, 2])
    return np.stack([alpha, p, -h[:, 4] - alpha, -h[:, 7] - alpha], axis=1)


def _solve(
    values: Values, rules: Rules, pool: _Pool, limit: float, prices: Array
) -> tuple[str, Index | None]:
    """The solver's status and the parts it chose, if it chose any."""
    import cvxpy as cp  # takes a second

    unit = max(limit, LEAST_UNIT)
    first, second = pool.sides
    z1 = cp.Variable(len(first.group), boolean=True)
    z2 = cp.Variable(len(second.group), boolean=True)
    shift = cp.Variable(4, bounds=[-100.0, 100.0])
    # Errors relative to each row's nominal scales, in units of the limit: small numbers only.
    offsets, scales = [], []
    for side in pool.sides:
        h, D = residuals(values, rules, np.maximum(side.parts, 0))
        own = _nominal(values, rules, side.parts)
        offsets.append((h + own @ D.T) / unit)
        scales.append(own)
    of_second = np.isin(np.arange(10), (6, 7, 9))
    offsets[0][:, of_second] = 0.0
    offsets[1][:, ~of_second] = 0.0
    groups = np.unique(first.group)
    member = [(side.group[None, :] == groups[:, None]).astype(float) for side in pool.sides]
    # Resistors and capacitors are counted together: the latter's indices follow the former's.
    shifted = np.where(np.arange(14) < 10, 0, len(rules.free_r))
    uses = [(z1, first.parts[:, k] + shifted[k]) for k in range(14) if k not in SECOND]
    uses += [(z2, second.parts[:, k] + shifted[k]) for k in SECOND]
    free = np.flatnonzero(np.concatenate([rules.free_r, rules.free_c]))
    used, rest = distinct_values(uses, free)
    kinds = cp.sum(used)
    rest += [
        cp.sum(z1) == 1,
        cp.sum(z2) == 1,
        member[0] @ z1 == member[1] @ z2,
        cp.abs(offsets[0].T @ z1 + offsets[1].T @ z2 + D @ shift) <= 1.0 + 1e-7,
        kinds == pool.fewest,
    ]
    if np.isfinite(rules.share):
        # ln of x2's peak voltage over x1's: p - q1 + q3.
        above = scales[0][:, 1] - scales[0][:, 2]
        room = rules.share - rules.peaks[2] + rules.peaks[0] + 1e-9
        rest.append(above @ z1 + scales[1][:, 3] @ z2 <= room)
    for i, j in np.argwhere(rules.ties):
        if i not in SECOND and j in SECOND:
            rest.append(first.parts[:, i] @ z1 == second.parts[:, j] @ z2)
    price1 = prices[first.parts[:, [10, 11, 13]]].sum(axis=1)
    price2 = prices[second.parts[:, 12]]
    objective = kinds + PRICE_WEIGHT * (price1 @ z1 + price2 @ z2)
    problem = cp.Problem(cp.Minimize(objective), rest)
    problem.solve(solver=cp.HIGHS, **SOLVER)
    row1, row2 = chosen_row(z1), chosen_row(z2)
    if row1 is None or row2 is None:
        return str(problem.status), None
    parts = first.parts[row1].copy()
    parts[SECOND] = second.parts[row2][SECOND]
    return str(problem.status), parts


@dataclass(frozen=True)
class PairSearch:
    """The choices of two masses with all terms."""

    question: LinearQuestion
    """What is searched."""
    first: float = 1e-9
    """The first level of error; the next is 1e-6."""
    growth: float = 1.6
    """From level to level after that."""

    @cached_property
    def values(self) -> Values:
        """The tables of what can be bought."""
        return catalogue(self.question.resistors, self.question.capacitors)

    @cached_property
    def rules(self) -> Rules:
        """The conditions."""
        q = self.question
        return rules_of(self.values, q.targets, q.bounds, q.spec)

    def error(self, parts: Index) -> float:
        """The least max error of one choice, by linear programming from its values alone."""
        return error_of(self.values, self.rules, parts)

    def fewest(self, parts: Index, limit: float, patience: int) -> tuple[Index, str]:
        """The choice of fewest values, least price, of those up to the limit."""
        prices = self.question.prices
        return fewest_values(self.values, self.rules, parts, limit, prices, patience)

    def level(self, level: float, patience: int) -> Levels:
        """The least error at most ``level``; each slice is searched below the best so far."""
        values, rules = self.values, self.rules
        best, parts = np.inf, np.full(len(PARTS), -1)
        start, whole, reached, rows, steps = 0, True, -1, 0, 0
        slices = len(values.deltas) * len(values.r)
        while start < slices:
            share = start / slices
            tried = f": {share:.0%} of the joins" if share >= 0.01 else ""
            doing(f"integrators with errors up to {level:.2g}{tried}")
            below = min(level, best)
            piece = slice_from(values, rules, below, start, patience - steps)
            left = patience - steps - piece.steps
            now = np.full(len(PARTS), -1)
            error, far, full, taken = complete(
                values, rules, piece.rows, piece.errors, below, max(left, 0), ROOM, now
            )
            if error < best:
                best, parts = error, now
                best_so_far(f"integrators with an error of {best:.2g}", step=True)
            whole = whole and full and not piece.cut
            reached = max(reached, far) if len(piece.rows) else reached
            rows, steps, start = (
                rows + len(piece.rows),
                steps + piece.steps + taken,
                piece.following,
            )
            if steps >= patience:
                whole = whole and start == slices
                break
        return Levels(best, parts, 0.0, whole, reached, rows, steps)
