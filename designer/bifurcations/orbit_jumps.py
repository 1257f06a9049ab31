"""Where the steps of a sweep go over from one orbit to another, and where one orbit goes on.

Neighbouring steps show one orbit if it is followed from the value of the one to that of the other
without turning back on the way. Two orbits may have one n-p-q, as on both sides of a fold, and one
orbit may have two, as on both sides of a grazing: the name decides nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from designer.base.arrays import Array
from designer.bifurcations.continuation import BranchPoint, follow, start
from designer.bifurcations.flow_family import Family
from designer.dynamics import attractors
from designer.dynamics.orbit import Orbit
from designer.dynamics.steady_state import SteadyMotion

LEAST_RUN = 4
"""Steps that show how much an orbit changes from one to the next."""
SUDDEN = 3.0
"""Times the change of the steps before and after: less is no jump. Near a fold an orbit changes as
the square root of the distance, at most 2.4 times as much in the last step as in the one before."""
SEEN = 1e-3
"""A change that is less than this share of the greatest displacement is no jump."""
SAME = 1e-6
"""How near two states of one orbit lie, over the peak."""


def jumps(family: Family, values: Sequence[float], steps: Sequence[SteadyMotion]) -> list[int]:
    """Numbers of the steps whose orbit is another than that of the step before, though n-p-q and
    symmetry are the same.

    values, steps : of one followed track, ascending. A step is looked at where the displacements
    change much more than beside it; whether it is a jump is decided by following the orbit. Where
    that cannot be told the steps are of one window.
    """
    out: list[int] = []
    first = 0
    for end in range(1, len(steps) + 1):
        if end < len(steps) and _name(steps[end]) == _name(steps[first]):
            continue
        if steps[first].n and end - first >= LEAST_RUN:
            changes = [_change(*steps[k - 1 : k + 1]) for k in range(first + 1, end)]
            for place, change in enumerate(changes):
                neighbours = max(
                    changes[max(place - 1, 0) : place] + changes[place + 1 : place + 2]
                )
                k = first + 1 + place
                a, b = (values[k - 1], steps[k - 1]), (values[k], steps[k])
                if change > max(SEEN, SUDDEN * neighbours) and goes_on(family, a, b) is False:
                    out.append(k)
        first = end
    return out


def goes_on(
    family: Family, a: tuple[float, SteadyMotion], b: tuple[float, SteadyMotion]
) -> bool | None:
    """Whether the periodic orbits of two steps, each with its value of the parameter, are one that
    goes on from the one value to the other; None where neither can be followed so far."""
    if a[1].n != b[1].n or not a[1].n:
        return False
    one, other = _solved(family, *a), _solved(family, *b)
    if one is None or other is None:
        return None
    ways = [
        _leads(family, (a[0], one), (b[0], other)),
        _leads(family, (b[0], other), (a[0], one)),
    ]
    return True if True in ways else False if False in ways else None


def one_orbit(a: SteadyMotion, b: SteadyMotion) -> bool:
    """Whether two steps at one value show the same orbit, by its name and its displacements."""
    return _name(a) == _name(b) and _change(a, b) < SEEN


def _name(step: SteadyMotion) -> tuple[str, bool | None]:
    return step.response, step.symmetric


def _change(a: SteadyMotion, b: SteadyMotion) -> float:
    """Of the least displacement in a period, its smallest and its largest value, from one step to
    the next; in parts of the larger size. 0 where a step has none, as a block of a stranger may."""
    if not (len(a.minima) and len(b.minima)):
        return 0.0
    ends = np.array([[step.minima.min(), step.minima.max()] for step in (a, b)])
    size = float(np.abs(ends).max())
    return float(np.abs(ends[1] - ends[0]).max()) / size if size else 0.0


def _solved(family: Family, value: float, step: SteadyMotion) -> Orbit | None:
    """The orbit of a step, to the last digits."""
    flow = family.flow(value)
    solution = attractors.shoot(flow, step.start, step.n)
    if solution is None:
        return None
    orbit = attractors.describe(flow, solution[0], step.n, solution[1])
    return orbit if orbit.counts.family == step.counts.family else None


def _leads(family: Family, a: tuple[float, Orbit], b: tuple[float, Orbit]) -> bool | None:
    """Whether the orbit at the value of ``a``, followed towards that of ``b``, is ``b``'s there;
    None where it was lost on the way."""
    try:
        origin = start(family, a[1], a[0])
    except ArithmeticError:
        return None
    sign = 1.0 if b[0] > a[0] else -1.0
    low, high = min(a[0], b[0]), max(a[0], b[0])
    branch = follow(origin, low, high, sign, until=_turned(a[0], sign))
    if not bool(np.all(sign * np.diff(branch.values) >= 0.0)):
        return False
    last = branch.points[-1]
    if last.value != b[0]:
        return None
    flow = family.flow(b[0])
    laps: Array = flow.run(b[1].start, b[1].n).strobes[:-1]
    away = np.abs(laps - last.solved.x) / branch.curve.scale[:-1]
    return bool(away.max(axis=1).min() < SAME)


def _turned(value: float, sign: float) -> Callable[[BranchPoint], bool]:
    """Whether a point lies behind the one before: past a fold. value : of the first point."""
    reached = [value]

    def turned(point: BranchPoint) -> bool:
        back = sign * (point.value - reached[0]) < 0.0
        reached[0] = point.value
        return back

    return turned
