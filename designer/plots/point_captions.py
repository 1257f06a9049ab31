"""What happens at a bifurcation point, in words: on which orbit, stable where, and what is born.

By the continued branch alone: the orbit at the point, its multipliers right beside it, and the
first orbits of what leaves it. What a sweep shows there is another matter (``point_changes``).
"""

from __future__ import annotations

from designer.bifurcations.points import SIDES, Bifurcation, PointKind
from designer.dynamics.counts import read_counts

NAMES = {
    PointKind.PITCHFORK: "pitchfork",
    PointKind.DOUBLING: "period doubling",
    PointKind.FOLD: "fold",
    PointKind.GRAZING: "grazing",
    PointKind.TORUS: "torus bifurcation",
    PointKind.CORNER: "corner of a force",
}
"""The names of the kinds in a sentence."""


def caption(point: Bifurcation, parameter: str = "", unit: str = "") -> str:
    """Such as "period doubling of 1-2-2 asymmetric at ω = 0.718977872: stable above, unstable
    below; 2-4-4 is born below, stable".

    parameter : how it is written; "" leaves out where the point lies. unit : of it.
    """
    place = f" at {parameter} = {point.value:.9g}{' ' + unit if unit else ''}" if parameter else ""
    owner = f" of {label(point.response, point.symmetric)}"
    if point.kind is PointKind.GRAZING:
        owner = f" at {point.stops}" if point.stops else ""
    elif point.kind is PointKind.CORNER:
        owner = f", {point.stops}, touched by {label(point.response, point.symmetric)}"
    return f"{NAMES[point.kind]}{owner}{place}: {_change(point)}"


def label(response: str, symmetric: bool | None) -> str:
    """The response with its symmetry, where it has one. One with more impacts on one stop than on
    the other is asymmetric, though at grazing the orbit that gains or loses the impact is not."""
    counts = read_counts(response)
    if counts is None or symmetric is None:
        return response
    return f"{response} {'symmetric' if symmetric and counts.symmetric else 'asymmetric'}"


def doubled(response: str) -> str:
    """The counts over twice the period: "1-2-2" becomes "2-4-4"."""
    counts = read_counts(response)
    return response if counts is None else str(counts.doubled)


def _change(point: Bifurcation) -> str:
    if point.kind is PointKind.FOLD:
        return _fold(point)
    if point.kind is PointKind.GRAZING:
        above, below = point.after, point.before
        if point.direction < 0:
            above, below = below, above
        if not (above and below):
            known = f"{label(below, point.symmetric)} below" if below else ""
            known = known or f"{label(above, point.symmetric)} above"
            return f"{known}; beyond no orbit of its period was found; {_stability(point)}"
        counts = (
            f"{label(below, point.symmetric)} below, {label(above, point.symmetric)} above; "
            "the counts of impacts change"
        )
        return f"{counts}; {_stability(point)}"
    if point.kind is PointKind.CORNER:
        return _stability(point)
    return f"{_stability(point)}; {_born(point)}"


def _stability(point: Bifurcation) -> str:
    """The stability of the branch on both sides."""
    sides = point.stable_sides
    assert sides is not None
    if sides[1] is sides[-1]:
        return "stable on both sides" if sides[1] else "unstable on both sides"
    return "stable above, unstable below" if sides[1] else "stable below, unstable above"


def _fold(point: Bifurcation) -> str:
    which = "a stable and an unstable orbit" if any(point.stable) else "two unstable orbits"
    return f"{which} meet, both {SIDES[point.side]}; {SIDES[-point.side]} there is neither"


def _born(point: Bifurcation) -> str:
    if point.kind is PointKind.TORUS:
        return "quasi-periodic motion is born"
    born = point.born
    response = point.response if born is None else born.response
    if point.kind is PointKind.DOUBLING and born is None:
        response = doubled(point.response)
    side = ""
    if born is not None:
        side = f" {SIDES[born.side]}, {'stable' if born.stable else 'unstable'}"
    if point.kind is PointKind.PITCHFORK:
        return f"its two asymmetric twins {response} are born{side}"
    return f"{response} is born{side}"
