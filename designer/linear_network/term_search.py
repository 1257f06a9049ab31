"""Any number of masses and any pattern of terms: levels of error searched by a tree of choices.

At each level the compiled loops (``linear_network.kernel_terms``) go through every choice that can
reach it; the error of what they return is computed afresh by linear programming. The side
conditions hold on nominal scales, which need no solver: the least squares of the errors. At error
eps those are within a fixed multiple of eps of any scales with that error, and by so much the loops
are wider.

The terms of a linear block are chosen group by group, and each group is probed at one place. A term
that ties two sets of states together is free; every further term between states that are tied
already has to meet a value. So a group is a term that ties, with all that become ties by it. The
group with the fewest choices comes first; one that nothing later needs comes last, and is probed as
soon as its states are tied.

A mixed-integer program mixes the values of known choices of a linear block. It is one-hot in
logarithms: each part has one of the values that it has in some choice, all scales are free, the
largest error stays within a limit. Fewest distinct values, then the lowest price; cvxpy states it
and HiGHS solves it, with a limit on its nodes.

First dives: cells of the time scale all over its range, each searched for a limited number of steps
in a drawn order, at a level that every choice lowers. Then neighbours: all parts of some masses are
free, the others stay, and what is better than the best so far is sought near its time scale. The
draws follow from counts, so the same question has the same answer. Nothing is proved.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, combinations, islice
from typing import TYPE_CHECKING

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.base.progress import best_so_far, doing
from designer.circuit.coefficients import EXACT
from designer.circuit.scale_fit import least_largest, minimax
from designer.linear_network.kernel_terms import CELL, TermRules, choices, dives
from designer.linear_network.linear_terms import (
    Bounds,
    Levels,
    LinearQuestion,
    Targets,
    equal_values,
    preferred_logs,
    scale_columns,
    sums,
)
from designer.linear_network.milp import NODES, PRICE_WEIGHT, SOLVER, chosen_row, distinct_values

if TYPE_CHECKING:
    pass


ROUNDING = 1e-9
"""Allowance for rounding in the comparison of logarithms."""


@dataclass(frozen=True)
class TermConditions:
    """The conditions of ``Bounds`` for these terms."""

    targets: Targets
    bounds: Bounds

    def hold(self, offsets: Array) -> bool:
        """Whether they hold for a choice with these (terms,) offsets of the errors."""
        G, g = self.inequalities
        return bool((G @ offsets <= g + ROUNDING).all())

    @cached_property
    def inequalities(self) -> tuple[Array, Array]:
        """G (k, terms), g (k,): the conditions are G @ offsets <= g."""
        constant, matrix = self._nominal
        pairs = np.argwhere(np.isfinite(self._limits) & ~np.eye(len(self._limits), dtype=bool))
        rows = [(matrix[1 + i] - matrix[1 + j]) for i, j in pairs]
        ends = [self._limits[i, j] - constant[1 + i] + constant[1 + j] for i, j in pairs]
        for sign, end in zip((-1.0, 1.0), self._ends, strict=True):
            if np.isfinite(end):
                rows.append(sign * matrix[0])
                ends.append(sign * (end - constant[0]))
        return np.array(rows).reshape(-1, matrix.shape[1]), np.array(ends)

    def apart(self, level: float) -> Array:
        """(2n, 2n) largest ln volts of the row's state over the column's, at an error ``level``."""
        constant, matrix = self._nominal
        room = np.abs(matrix[1:, None, :] - matrix[None, 1:, :]).sum(axis=2)
        apart = self._limits + level * room + ROUNDING
        for i, j in self._joined:
            apart[j, i] = min(apart[j, i], constant[1 + j] - constant[1 + i] + ROUNDING)
            apart[i, j] = min(apart[i, j], constant[1 + i] - constant[1 + j] + ROUNDING)
        np.fill_diagonal(apart, 0.0)
        for k in range(len(apart)):
            apart = np.minimum(apart, apart[:, k : k + 1] + apart[k : k + 1, :])
        return np.asarray(apart)

    def seconds(self, level: float) -> Array:
        """(2,) range of ln of the time scale, at an error ``level``."""
        room = level * np.abs(self._nominal[1][0]).sum() + ROUNDING
        return np.asarray(self._ends + np.array([-room, room]))

    @cached_property
    def _ends(self) -> Array:
        return np.asarray(np.log(np.maximum(self.bounds.seconds, 1e-300)))

    @cached_property
    def _limits(self) -> Array:
        """(2n, 2n) largest ln volts of the row's state over the column's; infinite where free."""
        states, peaks = len(self.targets.coefficients), np.log(self.bounds.peaks)
        level, reference = np.log(self.bounds.level), 2 * self.bounds.mass
        ratio = np.full((states, states), np.inf)
        ratio[1::2, 1::2] = level
        for i in range(0, states, 2):
            ratio[i, i + 1] = ratio[i + 1, i] = level
        ratio[:, reference] = np.minimum(ratio[:, reference], np.log(self.bounds.share))
        np.fill_diagonal(ratio, 0.0)
        return np.asarray(ratio - peaks[:, None] + peaks[None, :])

    @cached_property
    def _joined(self) -> Index:
        """(j, 2) states that get equal peak voltages: they join what no term joins."""
        sets = list(range(len(self.targets.coefficients)))
        for a, b in self.targets.entries:
            sets = [sets[a] if number == sets[b] else number for number in sets]
        first = sorted({number: i for i, number in reversed(list(enumerate(sets)))}.values())
        return np.array([(0, i) for i in first[1:]], dtype=np.int64).reshape(-1, 2)

    @cached_property
    def _nominal(self) -> tuple[Array, Array]:
        """The nominal scales, T and the 2n of ln volts, are constant + matrix @ offsets."""
        terms, states = len(self.targets.entries), len(self.targets.coefficients)
        columns = np.insert(scale_columns(self.targets), 1, 0.0, axis=1)
        equal = np.eye(1 + states)[1:]
        joins = np.array([equal[j] - equal[i] for i, j in self._joined]).reshape(-1, 1 + states)
        peaks = np.log(self.bounds.peaks)
        wanted = np.array([peaks[i] - peaks[j] for i, j in self._joined])
        inverse = np.zeros((1 + states, terms + len(joins)))
        free = [0, *range(2, 1 + states)]  # the volts of x1 are 1
        inverse[free] = np.linalg.pinv(np.concatenate([columns, joins])[:, free])
        return inverse[:, terms:] @ wanted, -inverse[:, :terms]


MOST = 12
"""Choices whose values are mixed: the last ones, which are the best."""


@dataclass(frozen=True)
class TermProgram:
    """What the program chooses from."""

    choices: Index
    """(k, parts) indices of values, in the order of ``Targets.parts``."""
    logs: tuple[Array, Array]
    """ln of the resistances and of the capacitances."""
    free: Mask
    """Which resistances, then which capacitances do not count as distinct."""
    prices: Array
    """Price class of each capacitance."""
    targets: Targets
    conditions: TermConditions
    equal: Index
    """(j, 2) places of parts that must be equal."""

    def solve(self, limit: float, most: int) -> tuple[str, Index | None]:
        """HiGHS' status, and the choice of fewest values with an error up to ``limit``, if it has
        one. most : distinct values that are known to do."""
        import cvxpy as cp  # takes a second

        known, terms = self.choices[-1], len(self.targets.entries)
        values = [np.unique(column) for column in self.choices[-MOST:].T]
        picks = [cp.Variable(len(own), boolean=True) for own in values]
        r, c = self.logs
        # Relative to a choice that is known: small numbers only.
        logs = [(r if k < terms else c) for k in range(len(picks))]
        moved = [
            (log[own] - log[known[k]]) @ pick
            for k, (log, own, pick) in enumerate(zip(logs, values, picks, strict=True))
        ]
        states = [a for a, _ in self.targets.entries]
        change = cp.hstack([-(moved[k] + moved[terms + a]) for k, a in enumerate(states)])
        start = -(r[known[:terms]] + c[known[terms:]][states] + self.targets.wanted)
        columns = scale_columns(self.targets)
        near = np.linalg.lstsq(columns, -start, rcond=None)[0]
        shift = cp.Variable(columns.shape[1], bounds=[-20.0, 20.0])
        errors = start + columns @ near + change + columns @ shift
        G, g = self.conditions.inequalities
        shifted = [own + (0 if k < terms else len(r)) for k, own in enumerate(values)]
        used, rest = distinct_values(
            list(zip(picks, shifted, strict=True)), np.flatnonzero(self.free)
        )
        rest += [cp.sum(pick) == 1 for pick in picks]
        rest += [cp.abs(errors) <= limit, cp.sum(used) <= most]
        rest += [G @ start + G @ change <= g] if len(g) else []
        rest += [values[i] @ picks[i] == values[j] @ picks[j] for i, j in self.equal if i < j]
        price = sum(
            self.prices[own] @ pick for own, pick in zip(values[terms:], picks[terms:], strict=True)
        )
        problem = cp.Problem(cp.Minimize(cp.sum(used) + PRICE_WEIGHT * price), rest)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of an answer at the limit of nodes
            problem.solve(solver=cp.HIGHS, **SOLVER, mip_max_nodes=NODES)
        rows = [chosen_row(pick) for pick in picks]
        if any(row is None for row in rows):
            return str(problem.status), None
        chosen = [own[row] for own, row in zip(values, rows, strict=True)]
        return str(problem.status), np.array(chosen, dtype=np.int64)


NARROW = 2e-5
"""Of all values, those that a term between tied states leaves: any small number gives the order."""
Entry = tuple[int, int]
"""A term: the state of its integrator and the state fed in."""


@dataclass(frozen=True)
class TermOrder:
    """An order of terms."""

    entries: tuple[Entry, ...]
    """The terms in the order in which they are chosen."""
    probes: Index
    """(j, 3) probes, ascending: before which place, and the range of places that must have
    parts."""


@dataclass(frozen=True)
class _Tied:
    """Which states are tied to each other, by a number for each set, and which have a capacitor."""

    sets: tuple[int, ...]
    capacitors: frozenset[int]

    def ties(self, entry: Entry) -> bool:
        """Whether a term ties two states that are not tied yet."""
        return self.sets[entry[0]] != self.sets[entry[1]]

    def after(self, entry: Entry) -> _Tied:
        one, other = (self.sets[state] for state in entry)
        sets = tuple(one if number == other else number for number in self.sets)
        return _Tied(sets, self.capacitors | {entry[0]})

    def choices(self, entry: Entry, resistors: int, capacitors: int) -> float:
        many = resistors * (1 if entry[0] in self.capacitors else capacitors)
        return many if self.ties(entry) else many * NARROW


def order_of(entries: Sequence[Entry], states: int, resistors: int, capacitors: int) -> TermOrder:
    """The order for so many states, resistor and capacitor values."""
    start = _Tied(tuple(range(states)), frozenset())
    left, tied, groups, last = list(entries), start, list[list[Entry]](), list[bool]()
    while left:
        options = [_group(entry, left, tied) for entry in left]
        ranks = [_rank(group, left, tied, resistors, capacitors) for group in options]
        best = min(range(len(options)), key=ranks.__getitem__)
        groups.append(options[best])
        last.append(ranks[best][0])
        for entry in options[best]:
            left.remove(entry)
            tied = tied.after(entry)
    begins = [0, *accumulate(len(group) for group in groups)]
    probes = []
    for number, group in enumerate(groups):
        if last[number]:
            early = _earliest(group, groups[:number], start)
            if early < number:
                probes.append((begins[early], begins[number], begins[number + 1]))
    chosen = tuple(entry for group in groups for entry in group)
    return TermOrder(chosen, np.array(sorted(probes), dtype=np.int64).reshape(-1, 3))


def _group(first: Entry, left: Sequence[Entry], tied: _Tied) -> list[Entry]:
    """The group that is chosen with a term: itself, then the terms whose two states it ties to each
    other, which leaves few values for them; those without a capacitor yet come last."""
    if not tied.ties(first):
        return [first]
    now = tied.after(first)
    narrow = [e for e in left if e != first and tied.ties(e) and not now.ties(e)]
    return [first, *sorted(narrow, key=lambda e: e[0] not in now.capacitors)]


def _rank(
    group: Sequence[Entry], left: Sequence[Entry], tied: _Tied, resistors: int, capacitors: int
) -> tuple[bool, float, float]:
    """Whether nothing later needs the group, ln of its choices, and the work to make them."""
    rest, now, total, work = [e for e in left if e not in group], tied, 1.0, 0.0
    for entry in group:
        total *= now.choices(entry, resistors, capacitors)
        work += total
        now = now.after(entry)
    # What is new: the states of the smaller of the two sets, and the capacitors.
    sets = [{i for i, n in enumerate(tied.sets) if n == tied.sets[e]} for e in group[0]]
    states = min(sets, key=len) if tied.ties(group[0]) else set()
    new = now.capacitors - tied.capacitors
    needed = any(a in states or b in states or a in new for a, b in rest)
    return not needed, round(float(np.log(total)), 6), work


def _earliest(group: Sequence[Entry], before: Sequence[Sequence[Entry]], tied: _Tied) -> int:
    """How many of the groups before it this one needs: its ties and its capacitors."""
    whole = tied
    for entry in (e for earlier in before for e in earlier):
        whole = whole.after(entry)
    owned = whole.capacitors & {entry[0] for entry in group}
    for number, earlier in enumerate(before):
        now = tied.after(group[0])
        if owned <= tied.capacitors and not any(now.ties(entry) for entry in group):
            return number
        for entry in earlier:
            tied = tied.after(entry)
    return len(before)


CANDIDATE, OF_STATES = 20, 6
"""Steps of a search that one candidate of the compiled loops counts for with so many states or
fewer; its work grows with their square."""
FRESH = 2000
"""Candidates that the linear program of one choice counts for."""
ROOM = 64
"""Choices that the loops return at a time, at first."""
TINY = 1e-9
"""Allowance for rounding of logarithms and for the accuracy of linear programming."""


@dataclass(frozen=True)
class TermSearch:
    """The choices of a linear block with any pattern of terms."""

    question: LinearQuestion
    first: float = EXACT
    """The first level of error: one up to this is none."""
    growth: float = 1.3
    """From level to level."""

    def level(self, level: float, patience: int) -> Levels:
        """The least error of about ``level``; what is found narrows the rest of the search."""
        rules, (terms, states) = self.rules(level), self._size
        best, parts = np.inf, np.full(terms + states, -1)
        known, t, steps, room = set[bytes](), -np.inf, 0, ROOM
        most = self.question.spec.most_values
        kinds = terms + states if most is None else most
        while t < np.inf and best > EXACT and steps * self.candidate < patience:
            self._tell(level, rules, t)
            rows = np.zeros((room, terms + states), dtype=np.int64)
            left = patience // self.candidate - steps
            t, count, taken = choices(rules, min(level, best), t, left, kinds, np.inf, rows)
            steps, room = steps + taken, room * 4 if count == room else ROOM
            for row in rows[:count][:, self.by_name]:
                if row.tobytes() in known:
                    continue
                known.add(row.tobytes())
                steps += FRESH
                error = self.error(row)
                if error < best and self.allowed(row):
                    best, parts = error, row
                    best_so_far(f"integrators with an error of {best:.2g}", step=True)
        reached = 0 if known else -1
        return Levels(best, parts, 0.0, t == np.inf, reached, len(known), steps * self.candidate)

    def fewest(self, parts: Index, limit: float, patience: int) -> tuple[Index, str]:
        """The choice of fewest values, least price, of those up to the limit.

        The loops go on from one to a better one; the mixed-integer program mixes the values of all
        that were met.
        """
        limit = max(limit, EXACT)
        rules, (terms, states) = self.rules(limit), self._size
        best, met, t, steps, room = parts, [parts], -np.inf, 0, 8
        known = set[bytes]()
        while t < np.inf and steps * self.candidate < patience:
            self._tell(limit, rules, t)
            rows = np.zeros((room, terms + states), dtype=np.int64)
            left = patience // self.candidate - steps
            t, count, taken = choices(rules, limit, t, left, *self.cost(best), rows)
            before = best
            for row in rows[:count][:, self.by_name]:
                if row.tobytes() in known or self.cost(row) >= self.cost(best):
                    continue
                known.add(row.tobytes())
                taken += FRESH
                if self._good(row, limit):
                    best = row
                    met.append(row)
            room = room * 4 if count == room and best is before else 8
            steps += taken
        doing(f"integrators, fewest values of {len(met)} choices")
        word, chosen = self._program(np.array(met)).solve(limit, self.cost(best)[0])
        # The solver is not believed: its choice stands only if it is as good as the one known.
        if chosen is None or self.cost(chosen) > self.cost(best) or not self._good(chosen, limit):
            chosen = best
        return chosen, f"HiGHS: {word}"

    def error(self, parts: Index) -> float:
        """The least largest error of one choice, by linear programming from its values alone."""
        return least_largest(self.offsets(parts), self.columns)

    def cost(self, parts: Index) -> tuple[int, float]:
        """Distinct values of one choice, without the preferred, and the price of its
        capacitors."""
        r, c = parts[: self._size[0]], parts[self._size[0] :]
        kinds = len(set(r[~self._free[0][r]].tolist())) + len(set(c[~self._free[1][c]].tolist()))
        return kinds, float(self.question.prices[c].sum())

    @cached_property
    def _size(self) -> tuple[int, int]:
        targets = self.question.targets
        return len(targets.entries), len(targets.coefficients)

    @cached_property
    def _logs(self) -> tuple[Array, Array]:
        return np.log(self.question.resistors), np.log(self.question.capacitors)

    @cached_property
    def _free(self) -> tuple[Mask, Mask]:
        r, c = self._logs
        preferred = self.question.spec.preferred
        return preferred_logs(r, preferred), preferred_logs(c, preferred)

    @cached_property
    def columns(self) -> Array:
        """(terms, 2n) change of the errors with each scale, that of time first."""
        return scale_columns(self.question.targets)

    @cached_property
    def candidate(self) -> int:
        """Steps that one candidate counts for."""
        return CANDIDATE * max(self._size[1], OF_STATES) ** 2 // OF_STATES**2

    def allowed(self, parts: Index) -> bool:
        """Whether a choice keeps the side conditions."""
        return self._conditions.hold(self.offsets(parts))

    def offsets(self, parts: Index) -> Array:
        """(terms,) errors of a choice with all scales 0."""
        terms, (r, c) = self._size[0], self._logs
        states = [a for a, _ in self.question.targets.entries]
        return -(r[parts[:terms]] + c[parts[terms:]][states] + self.question.targets.wanted)

    def _tell(self, level: float, rules: TermRules, t: float) -> None:
        low, high = rules.seconds
        share = min(max(t - low, 0.0) / (high - low + TINY), 1.0)
        tried = f": {share:.0%} of the time scales tried" if share >= 0.01 else ""
        doing(f"integrators with errors up to {level:.2g}{tried}")

    @cached_property
    def _conditions(self) -> TermConditions:
        return TermConditions(self.question.targets, self.question.bounds)

    @cached_property
    def _equal(self) -> Index:
        """(j, 2) places among the parts that must be equal."""
        equal = equal_values(self.question.targets.parts, self.question.spec.matched)
        return np.argwhere(equal)

    def _good(self, parts: Index, limit: float) -> bool:
        tied = all(parts[i] == parts[j] for i, j in self._equal)
        allowed = tied and self.allowed(parts)
        return allowed and self.error(parts) <= limit + TINY

    def _program(self, met: Index) -> TermProgram:
        free = np.concatenate(self._free)
        return TermProgram(
            met, self._logs, free, self.question.prices, self.question.targets, self._conditions,
            self._equal,
        )  # fmt: skip

    @cached_property
    def order(self) -> TermOrder:
        """The order in which the loops choose the terms."""
        many = len(self.question.resistors), len(self.question.capacitors)
        return order_of(self.question.targets.entries, self._size[1], *many)

    @cached_property
    def by_name(self) -> list[int]:
        """Columns of the loops' rows in the order of ``Targets.parts``."""
        terms, states = self._size
        names = self.question.targets.entries
        columns = [self.order.entries.index(entry) for entry in names]
        return [*columns, *range(terms, terms + states)]

    def rules(self, level: float) -> TermRules:
        """The rules with the room that nominal scales need at a level."""
        r, c = self._logs
        entries, targets = self.order.entries, self.question.targets
        target = np.array([a for a, _ in entries])
        every, sum_r, sum_c = sums(r, c)
        w = np.log([targets.coefficients[entry] for entry in entries])
        # A time scale is a mean of what terms round a loop are made to be.
        reach = every[0] + w.min() - level, every[-1] + w.max() + level
        return TermRules(
            target=target,
            source=np.array([b for _, b in entries]),
            wanted=w,
            first=np.array([a not in target[:i] for i, a in enumerate(target)]),
            probes=self.order.probes,
            r=r,
            c=c,
            sums=every,
            sum_r=sum_r,
            sum_c=sum_c,
            allowed=self._range_of_resistors(),
            apart=self._conditions.apart(level),
            seconds=np.clip(self._conditions.seconds(level), *reach),
            like=self._like(),
            fixed=np.full(sum(self._size), -1),
            free_r=self._free[0],
            free_c=self._free[1],
            prices=self.question.prices.astype(float),
        )

    def _range_of_resistors(self) -> Array:
        """(terms, 2) range of ln of each resistor: that of the stop's mass is limited."""
        bounds = self.question.bounds
        out = np.tile([-np.inf, np.inf], (self._size[0], 1))
        own = (2 * bounds.mass + 1, 2 * bounds.mass)
        if own in self.order.entries:
            limits = max(bounds.stop, 1e-300), bounds.stop_most
            out[self.order.entries.index(own)] = np.log(limits)
        return out

    def _like(self) -> Index:
        """(terms + states,) an earlier part that each must equal, in the order of the loops."""
        terms, states = self._size
        rows = [a for a, _ in self.order.entries]
        chosen = [rows.index(state) for state in range(states)]
        when = [*range(terms), *chosen]
        out = np.full(terms + states, -1)
        for i, j in self._equal:
            here, there = self.by_name[i], self.by_name[j]
            if when[there] < when[here] or (when[there] == when[here] and there < here):
                out[here] = there
        return out


FIRST_LEVEL = 0.03
"""The level of the first dives: twice the half step of E96 and more."""
LOWER = 0.9
"""From an error that was reached to the next level."""
CELLS = 32
"""Cells of the time scale in one call of the loops."""
DIVE = 10_000
"""Candidates in one cell."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""Multiples of it, without their whole part, lie evenly in 0 to 1 however many there are."""
FREE = 3
"""Masses whose parts are free together, at most."""


@dataclass
class TermDives:
    """The best choice so far, and the work that it took."""

    search: TermSearch
    """The choices that there are."""
    error: float = np.inf
    """The least error."""
    parts: Index | None = None
    """Its (parts,) indices of values."""
    steps: int = 0
    """Candidates that were looked at."""
    number: int = 0
    """Cells that were begun."""

    def best(self, least: float, patience: int) -> Levels:
        """The best choice that so many steps find; one with an error of ``least`` ends it."""
        most = patience // self.search.candidate
        self._dive(least, most // 2)
        while self.parts is not None and self.error > least and self.steps < most:
            if not self._nearer(most) and not self._dive(least, min(self.steps + most // 8, most)):
                break
        chosen = np.full(len(self.search.question.targets.parts), -1)
        chosen = chosen if self.parts is None else self.parts
        steps = self.steps * self.search.candidate
        return Levels(self.error, chosen, 0.0, False, -1, self.number, steps)

    @property
    def _level(self) -> float:
        return min(FIRST_LEVEL, LOWER * self.error)

    def _dive(self, least: float, most: int) -> bool:
        """Dives all over the time scale, until so many candidates are looked at; whether one was
        better."""
        before = self.error
        while self.error > least and self.steps < most:
            level = self._level
            rules = self.search.rules(level)
            low, high = rules.seconds
            shares = ((self.number + np.arange(CELLS)) * GOLDEN) % 1.0
            doing(f"integrators, dives for an error below {level:.2g}: {self.steps / most:.0%}")
            self._look(rules, level, low + (high - low) * shares)
        return self.error < before

    def _nearer(self, most: int) -> bool:
        """Better choices with all but some masses' parts as they are; whether there was one."""
        before = self.error
        for masses in self._sets():
            if self.steps >= most:
                break
            doing(f"integrators, neighbours of an error of {self.error:.2g}")
            level = LOWER * self.error
            rules = self.search.rules(level)._replace(fixed=self._fixed(masses))
            scales = minimax(self.search.offsets(self._known), self.search.columns)
            near = 2.0 * self.error
            cells = float(scales[0]) + np.arange(-near, near, CELL * level)
            self._look(rules, level, cells)
        return self.error < before

    @property
    def _known(self) -> Index:
        assert self.parts is not None
        return self.parts

    def _sets(self) -> Iterator[tuple[int, ...]]:
        """Sets of masses, single ones first."""
        masses = range(len(self.search.question.targets.coefficients) // 2)
        for size in range(1, min(FREE, len(masses)) + 1):
            yield from islice(combinations(masses, size), len(masses) ** 2)

    def _fixed(self, masses: tuple[int, ...]) -> Index:
        """(parts,) in the order of the loops, the values of parts that touch none of the masses."""
        entries = self.search.order.entries
        own = [a // 2 in masses or b // 2 in masses for a, b in entries]
        states = range(len(self.search.question.targets.coefficients))
        free = np.array(own + [a // 2 in masses for a in states])
        fixed = np.full(len(free), -1)
        fixed[self.search.by_name] = self._known
        return np.where(free, -1, fixed)

    def _look(self, rules: TermRules, level: float, cells: Array) -> None:
        """A choice of one of these cells, if it is better and keeps the conditions."""
        row = np.zeros((1, len(self.search.by_name)), dtype=np.int64)
        most = self.search.question.spec.most_values
        kinds = row.size if most is None else most
        begun, any_found, taken = dives(rules, level, cells, DIVE, kinds, self.number, row)
        self.number += begun
        self.steps += taken + begun
        if not any_found:
            return
        self.steps += FRESH
        parts = row[0][self.search.by_name]
        error = self.search.error(parts)
        if error < self.error and self.search.allowed(parts):
            self.error, self.parts = error, parts
            best_so_far(f"integrators with an error of {error:.2g}", step=True)
