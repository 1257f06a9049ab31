"""What the slots of a repair's program have to do with each other: rows of it, as demands.

A trimmer that is set is set for every response. A part is an element of one array at most, and then
has no grade of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from designer.base.arrays import Array
from designer.catalog.parts_catalog import Catalog
from designer.centering.repair_milp import Demand, Slot
from designer.centering.repair_slots import PartSlot


def couplings(
    slots: Sequence[Slot], parts: Sequence[PartSlot], kinds: Sequence[Sequence[str]]
) -> list[Demand]:
    """Rows that keep the choice one that can be built.

    slots : of the program, those of ``parts`` first, then one for each response. kinds : of each
    response, the kinds of its ways.
    """
    return [*_one_setting(slots, parts, kinds), *_one_place(slots, parts)]


def _one_setting(
    slots: Sequence[Slot], parts: Sequence[PartSlot], kinds: Sequence[Sequence[str]]
) -> list[Demand]:
    demands = []
    for k, part in enumerate(parts):
        if part.trim is None:
            continue
        otherwise, unset = _none(slots), _none(slots)
        unset[k] = np.array([1.0, 0.0])
        for r, row in enumerate(kinds, start=len(parts)):
            otherwise[r] = np.array([float(kind != "trimmer") for kind in row])
            for w, kind in enumerate(row):
                if kind == "trimmer":
                    demands.append(Demand("trimmer set", 0.5, tuple(unset), (r, w)))
        demands.append(Demand("trimmer for all", 0.5, tuple(otherwise), (k, 1)))
    return demands


def _one_place(slots: Sequence[Slot], parts: Sequence[PartSlot]) -> list[Demand]:
    demands = []
    for name in dict.fromkeys(name for part in parts for name in part.network):
        rows = _none(slots)
        for k, part in enumerate(parts):
            if name in (*part.parts, *part.network):
                rows[k] = np.array([float(i > 0) for i in range(len(part.slot.options))])
        demands.append(Demand(f"{name} once", 1.5, tuple(rows)))
    return demands


def finest(parts: Sequence[PartSlot], catalog: Catalog) -> tuple[tuple[int, ...], ...]:
    """Options of ``parts`` whose boards vary least: the best grade of each and no array; and, where
    there are arrays, as many of them as go together, with the best grade of the others."""
    best = tuple(0 if p.network else _least(p, catalog) for p in parts)
    if not any(p.network for p in parts):
        return (best,)
    matched, inside = list(best), set[str]()
    for k, part in enumerate(parts):
        if part.network and not inside & {*part.network}:
            matched[k] = 1
            inside |= {*part.network}
    for k, part in enumerate(parts):
        if inside & {*part.parts}:
            matched[k] = 0
    return best, tuple(matched)


def _least(part: PartSlot, catalog: Catalog) -> int:
    grades = part.grades or tuple(catalog.reference(name).grade for name in part.models)
    return int(np.argmin(grades)) if grades else len(part.slot.options) - 1


def _none(slots: Sequence[Slot]) -> list[Array]:
    return [np.zeros(len(s.options)) for s in slots]
