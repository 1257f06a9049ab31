"""The order in which the terms of a linear block are chosen: groups, and where each is probed.

A term that ties two sets of states together is free; every further term between states that are
tied already has to meet a value. So a group is a term that ties, with all that become ties by it.
The group with the fewest choices comes first; one that nothing later needs comes last, and is
probed as soon as its states are tied.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from designer.base.arrays import Index

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

    def joins(self, entry: Entry) -> bool:
        return self.sets[entry[0]] != self.sets[entry[1]]

    def after(self, entry: Entry) -> _Tied:
        one, other = (self.sets[state] for state in entry)
        sets = tuple(one if number == other else number for number in self.sets)
        return _Tied(sets, self.capacitors | {entry[0]})

    def choices(self, entry: Entry, resistors: int, capacitors: int) -> float:
        many = resistors * (1 if entry[0] in self.capacitors else capacitors)
        return many if self.joins(entry) else many * NARROW


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
    """A term and what becomes narrow by it, those without a capacitor yet at the end."""
    if not tied.joins(first):
        return [first]
    now = tied.after(first)
    narrow = [e for e in left if e != first and tied.joins(e) and not now.joins(e)]
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
    states = min(sets, key=len) if tied.joins(group[0]) else set()
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
        if owned <= tied.capacitors and not any(now.joins(entry) for entry in group):
            return number
        for entry in earlier:
            tied = tied.after(entry)
    return len(before)
