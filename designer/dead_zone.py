"""Sizing a dead-zone stage: the stages of the search, matched parts, and the proof.

The search begins with few values for the resistors that only set a level and with the threshold as
high as the swing allows, and ends with the whole catalogue; it stops where the error is nothing or
is the least of the whole catalogue. Every answer is computed anew from its values.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product

import numpy as np

from designer import rectifier_stage, saturating_stage
from designer.dead_zone_target import EXACT, DeadZone, DeadZoneTarget
from designer.saturating_stage import LARGEST, LAST_LEVEL, Box, Least, Tables
from designer.system import Array
from designer.value_program import Ranking
from designer.wishes import NO_WISHES, Wishes

__all__ = ["DeadZone", "DeadZoneTarget", "parts_of", "size"]

ROOMS = ((1.06, 1.6, 2.5), (1.2, 1.6, 2.5))
"""How far below its largest value each of threshold, A- and fv slope may lie: first and at most."""
OPEN = (np.inf, np.inf, np.inf)
HANDY = 8
"""Most values of a resistor that only sets a level, before all are tried."""
TIED = 3000
"""Combinations of values that are tried for parts that must be equal across tables."""
LEVEL_SETTERS = ("R200", "R202", "R206", "R208", "R209")
LIGHT = ("R205", "R211", "R212")
"""Resistors that no output drives."""
ATOMS = (
    ("R206", "R207", "R209"),
    ("R210", "R50"),
    ("R200", "R201"),
    ("R202", "R203"),
    ("R204", "R205", "R208"),
    ("R200", "R211", "R212"),
)
"""Parts that stand in one table of the saturating stage."""


def parts_of(kind: str, sides: str) -> tuple[str, ...]:
    """Names of the resistors that the stage has, R50 included."""
    if kind == "rectifier":
        halves = {
            "both": range(200, 208),
            "upper": (200, 201, 202, 206),
            "lower": (203, 204, 205, 207),
        }
        return ("R50", *(f"R{i}" for i in halves[sides]))
    last = 211 if sides == "both" else 213
    return ("R50", *(f"R{i}" for i in range(200, last)))


def size(
    target: DeadZoneTarget,
    resistors: Array,
    base: float,
    used: frozenset[float],
    wishes: Wishes = NO_WISHES,
    fixed: Mapping[str, float] | None = None,
    price: Mapping[float, float] | None = None,
) -> DeadZone | str:
    """The stage for this target, or the name of the condition that leaves none.

    resistors : values that may be used [ohm], ascending. base : the first value tried for resistors
    that only set a level. used : values that the rest of the circuit has; they cost nothing in the
    second stage. fixed : values of parts outside the stage that matched groups may name. price :
    price class by value.
    """
    began = time.perf_counter()
    free = used | wishes.preferred
    most = None
    if wishes.most_values is not None:
        most = wishes.most_values - len(used - wishes.preferred)
        if most < 0:
            return "distinct values"
    ranking = Ranking(free, price or {}, EXACT, wishes.slack, most)
    inherent = rectifier_stage.EQUAL if target.kind == "rectifier" else ()
    groups = (*inherent, *wishes.matched)
    ties = _ties(parts_of(target.kind, target.sides), groups, fixed or {})
    if ties is None:
        return "matched parts"
    if target.kind == "rectifier":
        found = rectifier_stage.size(target, resistors, ranking, ties.tie, ties.value)
    else:
        found = _saturating(target, resistors, base, ranking, ties)
    if isinstance(found, str):
        return found
    return replace(found, seconds=time.perf_counter() - began)


@dataclass(frozen=True)
class Ties:
    """Parts that must be equal: tie maps each to its group; value : those that are given [ohm]."""

    tie: Mapping[str, str]
    value: Mapping[str, float]


def _ties(
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


@dataclass(frozen=True)
class Stage:
    """One stage of the search: the values of each part and the ranges.

    slope, whole : whether the slope's tables, or all, hold every value that the conditions leave.
    """

    lists: Mapping[str, Array]
    box: Box
    slope: bool = False
    whole: bool = False


@dataclass(frozen=True)
class Search:
    """What the stages found: the tables with the least error, a bound that holds for the whole
    catalogue, rows looked at, and where there is nothing, the condition that binds."""

    best: tuple[Tables, Least] | None
    bound: float
    looked_at: int
    binding: str

    @property
    def error(self) -> float:
        return LAST_LEVEL if self.best is None else self.best[1].error


def _saturating(
    target: DeadZoneTarget, resistors: Array, base: float, ranking: Ranking, ties: Ties
) -> DeadZone | str:
    found = Search(None, 0.0, 0, "stop slope")
    for stage in _stages(target, resistors, base, ranking.free, ties):
        found = _search(target, stage, ties, ranking.free | {base}, found)
        if found.best is not None and found.error <= max(found.bound, 0.0) + EXACT:
            break
        if found.best is not None and stage.whole:
            break
    if found.best is None:
        return found.binding
    picked = saturating_stage.pick(*found.best, ranking)
    if picked is None:
        return "distinct values" if ranking.most is not None else "noise gain"
    values, word = picked
    values = {name: values[name] for name in parts_of(target.kind, target.sides)}
    return _answer(target, values, found, word)


def _search(
    target: DeadZoneTarget, stage: Stage, ties: Ties, free: frozenset[float], so_far: Search
) -> Search:
    """One stage, for every value of the parts that are tied across tables."""
    best, looked_at, binding = so_far.best, so_far.looked_at, so_far.binding
    bound = np.inf
    for lists in _tied_lists(stage.lists, ties):
        if lists is None:
            bound = 0.0
            break
        level = LAST_LEVEL if best is None else best[1].error
        t = saturating_stage.tables(target, lists, ties.tie, stage.box, free, level)
        why = t.empty()
        if why is not None:
            binding = why if best is None else binding
            continue
        slope = float(saturating_stage.slope_errors(t).min())
        if t.steep_count() > LARGEST:
            bound = min(bound, slope)
            continue
        least = saturating_stage.least_error(t, EXACT)
        looked_at += len(t.left) + len(t.right) + len(t.divider) + t.steep_count()
        bound = min(bound, least.error if stage.whole else slope)
        # A wider range only where it is of use: the narrow one has the better threshold.
        margin = 0.0 if best is None or best[0].box == stage.box else EXACT
        if least.error <= (LAST_LEVEL if best is None else best[1].error - margin - 1e-12):
            best = (t, least)
        elif best is None:
            binding = "dead-zone bias" if slope > LAST_LEVEL else "dead-zone null"
        if best is not None and best[1].error <= EXACT:
            break
    if best is not None:
        bound = min(bound, best[1].error)  # no row of the tables is better than the best known
    if not (stage.slope or stage.whole) or (best is not None and best[1].error <= EXACT):
        bound = 0.0
    return Search(best, bound, looked_at, binding)


def _answer(
    target: DeadZoneTarget,
    values: dict[str, float],
    found: Search,
    word: str,
) -> DeadZone:
    errors = saturating_stage.errors(target, values)
    worst = max(abs(e) for e in errors.values())
    bound = min(found.bound, worst)
    if worst <= EXACT:
        proof = "nothing to improve: every error of the dead zone is at most 1e-6"
    elif worst <= bound + EXACT:
        proof = (
            "every value of R206, R207, R209 with the nearest R210/R50, in the order of the slope "
            "error, each with the nearest A+ and loaded divider of the whole catalogue"
        )
    else:
        proof = "best found; the whole catalogue was not searched"
    return DeadZone(
        values=values,
        errors=errors,
        threshold=saturating_stage.threshold(target, values),
        bound=bound,
        proved=worst <= max(bound, 0.0) + EXACT,
        proof=proof,
        solver=word,
        looked_at=found.looked_at,
        seconds=0.0,
    )


def _stages(
    target: DeadZoneTarget, resistors: Array, base: float, free: frozenset[float], ties: Ties
) -> Iterator[Stage]:
    near, far = (saturating_stage.box(target, *room) for room in ROOMS)
    names = parts_of(target.kind, target.sides)
    heavy = resistors[resistors >= target.load]
    every = {name: resistors if name in LIGHT else heavy for name in names}
    every |= {name: heavy[np.isclose(heavy, v, rtol=1e-9)] for name, v in ties.value.items()}
    handy = _handy(heavy, base, free)
    few = {name: np.intersect1d(every[name], handy[:1]) for name in LEVEL_SETTERS}
    some = {name: np.intersect1d(every[name], handy) for name in LEVEL_SETTERS}
    given = {name: every[name] for name in ties.value}
    slopes = every | some | given | {name: every[name] for name in ("R206", "R209")}
    fits = len(resistors) ** 3 <= LARGEST
    yield Stage(every | few | given, near)
    yield Stage(every | few | given, far)
    yield Stage(every | some | given, far)
    yield Stage(slopes, far, slope=target.strict)
    if target.strict:
        if fits:
            yield Stage(every, far, whole=True)
        last = saturating_stage.box(target, *OPEN)
    else:
        last = saturating_stage.free_box(target)
        yield Stage(slopes, replace(last, steep=far.steep), slope=True)
    yield Stage(every if fits else slopes, last, slope=True, whole=fits)


def _handy(heavy: Array, base: float, free: frozenset[float]) -> Array:
    """Values for resistors that only set a level, the first first: few where the list is long."""
    if len(heavy) == 0:
        return heavy
    room = [v for v in sorted(free) if base <= v <= 10.0 * base]
    wanted = [base, *room, *(base * f for f in (2.0, 5.0, 10.0, 3.0, 1.5, 4.0, 7.0))]
    near = [float(heavy[np.argmin(np.abs(np.log(heavy / v)))]) for v in wanted]
    most = int(np.clip(LARGEST / 2.5 / len(heavy) ** 2, 2, HANDY))
    return np.array(list(dict.fromkeys(near))[:most])


def _tied_lists(lists: Mapping[str, Array], ties: Ties) -> Iterator[Mapping[str, Array] | None]:
    """The lists with each group that stands in several tables at one value, for every value.

    Ends with None where not every combination could be tried.
    """
    groups: dict[str, list[str]] = {}
    for name, root in ties.tie.items():
        groups.setdefault(root, []).append(name)
    across = [
        g for g in groups.values() if len(g) > 1 and not any(set(g) <= set(atom) for atom in ATOMS)
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
