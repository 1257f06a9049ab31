"""Parts that must be equal: the groups of a stage, and the lists of values that they share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, product

import numpy as np

from designer.base.arrays import Array

TIED = 3000
"""Combinations of values that are tried for parts that must be equal across tables."""


@dataclass(frozen=True)
class Ties:
    """Parts that must be equal."""

    tie: Mapping[str, str]
    """Group by part name; parts of one group are equal."""
    value: Mapping[str, float]
    """Values that are given, by part name [ohm]."""


def ties_of(
    parts: tuple[str, ...], groups: Sequence[Sequence[str]], fixed: Mapping[str, float]
) -> Ties | None:
    """The groups of the stage's own parts; None where two different values are asked of one."""
    tie: dict[str, str] = {}
    value: dict[str, float] = {}
    for group in groups:
        own = [name for name in group if name in parts]
        if not own:
            continue
        roots = {tie.get(name, name) for name in own}
        root = min(roots)
        given = {fixed[name] for name in group if name in fixed}
        given |= {value[r] for r in roots if r in value}
        if len(given) > 1:
            return None
        members = [n for n in parts if tie.get(n, n) in roots]
        tie |= dict.fromkeys(members, root)
        value |= dict.fromkeys(members, given.pop()) if given else {}
    return Ties(tie, value)


def tied_lists(
    lists: Mapping[str, Array], ties: Ties, atoms: Sequence[Sequence[str]]
) -> Iterator[Mapping[str, Array] | None]:
    """The lists with each group that stands in several tables at one value, for every value.

    atoms : the parts of each table. Ends with None where not every combination could be tried.
    """
    groups: dict[str, list[str]] = {}
    for name, root in ties.tie.items():
        groups.setdefault(root, []).append(name)
    across = [
        g for g in groups.values() if len(g) > 1 and not any(set(g) <= set(atom) for atom in atoms)
    ]
    common = []
    for group in across:
        shared = lists[group[0]]
        for name in group[1:]:
            shared = np.intersect1d(shared, lists[name])
        common.append(shared)
    for chosen in islice(product(*common), TIED):
        own = {n: np.array([v]) for g, v in zip(across, chosen, strict=True) for n in g}
        yield {**lists, **own}
    if np.prod([float(len(c)) for c in common]) > TIED:
        yield None
