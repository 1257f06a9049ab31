"""Nonlinear forces as a sum of dead zones, which is how a circuit makes them."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest

import numpy as np

from designer.base.errors import InputError
from designer.laws.force_law import ForceLaw
from designer.model.clearance import Clearance, Side, combined

ROUNDING = 1e-9
"""Relative: of a slope, what is none."""
Bend = tuple[float, float]
"""Where the slope changes, as a distance from rest, and by how much."""


def dead_zones(clearances: Sequence[Clearance], laws: Sequence[ForceLaw]) -> tuple[Clearance, ...]:
    """What all nonlinear forces are the sum of: of each clearance the first spring of its stops, in
    their order; then further springs and every bend of a law.

    Raises
    ------
    InputError : a combination of displacements without a factor above 0.
    """
    first, further = [], list[Clearance]()
    for stop in clearances:
        springs = {side: end.springs for side, end in stop.sides}
        ends = {
            side: replace(Side(*springs[side][0]), preload=end.jump) for side, end in stop.sides
        }
        own = replace(stop, upper=ends.get(1), lower=ends.get(-1))
        first.append(_per_first_mass(own))
        like = replace(own, bend_of=stop.name, damping=0.0)
        further += _of_bends(like, {side: each[1:] for side, each in springs.items()}, 0.0)
    for law in laws:
        like, sign = _place_of(law)
        bends = {sign * side: each for side, each in law.bends.items()}
        further += _of_bends(like, bends, law.slope)
    further = [_per_first_mass(each) for each in further]
    return (*first, *_with_names_of_their_own(first, further))


def _place_of(law: ForceLaw) -> tuple[Clearance, int]:
    """A dead zone of what a law depends on, without ends, and the sign with which it does."""
    sign = 1 if max(law.row) > 0.0 else -1
    row, push = sign * np.array(law.row), sign * np.array(law.push)
    mass, other, combination = combined(row)
    like = Clearance(
        law.name, mass, other, None, None, bend_of=law.name, quantity=law.quantity,
        combination=combination, push=tuple(push.tolist()),
    )  # fmt: skip
    return like, sign


def _per_first_mass(zone: Clearance) -> Clearance:
    """The same with its displacement, and its force, as one mass has them: its factor in the sum
    is 1, and that with which it is pushed 1 or -1."""
    if zone.plain:
        return zone
    terms, pushed = dict(zone.terms), dict(zone.pushed)
    able = [mass for mass, factor in terms.items() if factor > 0.0 and pushed.get(mass)]
    if not able:
        what = f"law {zone.bend_of}.of" if zone.bend_of else f"clearance {zone.name}.of"
        expected = (
            "for a circuit a factor above 0, of a mass that the force moves: the other signs, with "
            "upper and lower exchanged, are the same clearance"
        )
        raise InputError(None, what, "a combination without one", expected)
    mass = max(able, key=lambda each: (pushed[each] > 0.0, terms[each]))
    factor, own = terms[mass], abs(pushed[mass])

    def scaled(stop: Side | None) -> Side | None:
        if stop is None:
            return None
        return Side(stop.gap / factor, factor * own * stop.stiffness, (), own * stop.preload)

    size = max(len(zone.combination), len(zone.push))
    row, push = (
        tuple(each.get(i, 0.0) / by for i in range(size))
        for each, by in ((terms, factor), (pushed, own))
    )
    first, other, combination = combined(np.array(row))
    return replace(
        zone,
        mass=mass if combination else first,
        other=other,
        combination=combination,
        push=() if push == row else push,
        upper=scaled(zone.upper),
        lower=scaled(zone.lower),
        damping=factor * own * zone.damping,
    )


def _of_bends(
    like: Clearance, bends: Mapping[int, Sequence[Bend]], slope: float
) -> Iterator[Clearance]:
    """Those of the bends on each side, from rest on; slope : at rest, of which what limits takes
    its own."""
    for upper, lower in zip_longest(bends.get(1, ()), bends.get(-1, ())):
        above, below = upper and Side(*upper), lower and Side(*lower)
        if above and below and above.stiffness < 0.0 and below.stiffness < 0.0:
            common = min(-above.stiffness, -below.stiffness, max(slope, 0.0))
            if common > ROUNDING * -above.stiffness:
                slope -= common
                ends = [replace(end, stiffness=-common) for end in (above, below)]
                yield replace(like, upper=ends[0], lower=ends[1], limits=True)
                above, below = _less(above, common), _less(below, common)
        if above and below and (above.stiffness > 0.0) != (below.stiffness > 0.0):
            yield replace(like, upper=above, lower=None)
            above = None
        if above or below:
            yield replace(like, upper=above, lower=below)


def _less(end: Side, common: float) -> Side | None:
    """An end that falls by so much less; None where that is by nothing."""
    left = end.stiffness + common
    return replace(end, stiffness=left) if left < ROUNDING * end.stiffness else None


def _with_names_of_their_own(
    first: Sequence[Clearance], further: Sequence[Clearance]
) -> list[Clearance]:
    """The further dead zones named after what they are bends of, and numbered; nets bear these
    names, so they are letters, digits and underscores."""
    taken = {stop.name for stop in first}
    count: dict[str, int] = defaultdict(int)
    out = []
    for each in further:
        stem = re.sub(r"\W", "_", each.bend_of, flags=re.ASCII)
        name = ""
        while not name or name in taken:
            count[stem] += 1
            name = f"{stem}_{count[stem]}"
        taken.add(name)
        out.append(replace(each, name=name))
    return out
