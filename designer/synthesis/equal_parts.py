"""Parts that must be equal: the groups of a stage, and the lists of values that they share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import islice, product

import numpy as np

from designer.base.arrays import Array

MOST_COMBINATIONS = 3000
"""Combinations of values that are tried for parts that must be equal across tables."""


@dataclass(frozen=True)
class EqualParts:
    """Parts that must be equal."""

    group: Mapping[str, str]
    """Group by part name; parts of one group are equal. Absent: equal to no other part."""
    value: Mapping[str, float]
    """Values that are given, by part name [ohm]."""

    def of(self, name: str) -> str:
        """The name that all parts equal to this one share."""
        return self.group.get(name, name)


def equal_parts(
    parts: tuple[str, ...], groups: Sequence[Sequence[str]], fixed: Mapping[str, float]
) -> EqualParts | None:
    """The groups of a stage's own parts; None where two different values are asked of one.

    fixed : values of parts outside the stage [ohm].
    """
    joined: dict[str, str] = {}
    value: dict[str, float] = {}
    for group in groups:
        own = [name for name in group if name in parts]
        if not own:
            continue
        roots = {joined.get(name, name) for name in own}
        given = {fixed[name] for name in group if name in fixed}
        given |= {value[r] for r in roots if r in value}
        if len(given) > 1:
            return None
        members = [n for n in parts if joined.get(n, n) in roots]
        joined |= dict.fromkeys(members, min(roots))
        value |= dict.fromkeys(members, given.pop()) if given else {}
    return EqualParts(joined, value)


def with_equal_parts(
    lists: Mapping[str, Array], equal: EqualParts, tables: Sequence[Sequence[str]]
) -> Iterator[Mapping[str, Array] | None]:
    """The lists with each group that stands in several tables at one value, for every value.

    tables : the parts of each table. Ends with None where not every combination could be tried.
    """
    groups: dict[str, list[str]] = {}
    for name, root in equal.group.items():
        groups.setdefault(root, []).append(name)
    across = [
        g for g in groups.values() if len(g) > 1 and not any(set(g) <= set(t) for t in tables)
    ]
    common = [reduce(np.intersect1d, [lists[name] for name in group]) for group in across]
    for chosen in islice(product(*common), MOST_COMBINATIONS):
        own = {n: np.array([v]) for g, v in zip(across, chosen, strict=True) for n in g}
        yield {**lists, **own}
    if np.prod([float(len(c)) for c in common]) > MOST_COMBINATIONS:
        yield None
