"""Branches and bifurcation points over an interval of a parameter, from known orbits on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.bifurcations.branch_switch import birth, close, switch
from designer.bifurcations.continuation import Branch, BranchPoint, End, start, trace
from designer.bifurcations.flow_family import Family
from designer.bifurcations.loop_check import images, place
from designer.bifurcations.orbit_curve import Curve
from designer.bifurcations.points import Bifurcation, PointKind, locate
from designer.dynamics.attractors import mirrored_strobes
from designer.dynamics.orbit import Orbit, OrbitStatus

DEPTH = 2
"""Branch switches in a row: a twin's period-doubled orbits, from a symmetric branch."""


@dataclass(frozen=True)
class Survey:
    """Branches, and the bifurcation points on them."""

    parameter: str
    """Name of the parameter along the branches."""
    branches: tuple[Branch, ...]
    """The branches, in the order in which they were found."""
    parents: tuple[int, ...]
    """For each branch the number of the one it was switched to from, or -1."""
    points: tuple[Bifurcation, ...]
    """Bifurcation points; ``Bifurcation.branch`` numbers the branches."""

    def on(self, branch: int) -> list[Bifurcation]:
        """The points on one branch, in its order."""
        return [p for p in self.points if p.branch == branch]


def survey(
    family: Family,
    orbits: Sequence[tuple[float, Orbit]],
    low: float,
    high: float,
    *,
    depth: int = DEPTH,
    until: Callable[[BranchPoint], bool] = lambda _: False,
    progress: Callable[[], None] = lambda: None,
) -> Survey:
    """Follow orbits both ways, and the branches that leave them where stability changes.

    orbits : values of the parameter with a periodic orbit found there, stable or not; those that
    lie on a branch already followed add none. low, high : ends of the interval. depth : branch
    switches in a row. until : where the branches of the orbits themselves are let go
    (``continuation.follow``). progress : called once a branch.
    """
    branches: list[Branch] = []
    parents: list[int] = []
    points: list[Bifurcation] = []

    def add(branch: Branch, parent: int) -> int:
        number = len(branches)
        branches.append(branch)
        parents.append(parent)
        points.extend(replace(p, born=birth(branch, p)) for p in locate(branch, number))
        progress()
        return number

    def is_followed(child: Branch, at: int = -1) -> bool:
        """Whether a followed branch passes the child's point of number ``at``.

        The last of the child's first points lies off its parent.
        """
        curve = child.curve
        orbit_images = images(curve, child.points[at].solved)
        return any(follows(b, curve.n, curve.symmetric, orbit_images) for b in branches)

    for value, orbit in orbits:
        if orbit.status is not OrbitStatus.PERIODIC or not low <= value <= high:
            continue
        if any(passes(b, value, orbit) for b in branches):
            continue
        try:
            origin = start(family, orbit, value)
        except ArithmeticError:
            continue
        queue = [(add(trace(origin, low, high, until=until), -1), 0)]
        while queue:
            number, deep = queue.pop(0)
            if deep == depth:
                continue
            lost: list[Branch] = []
            for bifurcation in [p for p in points if p.branch == number]:
                if not _leads(bifurcation):
                    continue
                child = switch(branches[number], bifurcation, low, high, is_followed=is_followed)
                if child is None:
                    continue
                if child.ends[1] is End.LOST:
                    lost.append(child)
                else:
                    queue.append((add(close(child, points), number), deep + 1))
            # A branch that was lost on the way may have been followed from its other end.
            queue.extend(
                (add(child, number), deep + 1)
                for child in lost
                if not is_followed(child, len(child.points) // 2)
            )
    return Survey(family.parameter, tuple(branches), tuple(parents), tuple(points))


def passes(branch: Branch, value: float, orbit: Orbit, tolerance: float = 1e-6) -> bool:
    """Whether an orbit, or its mirror twin, lies on a branch.

    tolerance : of the peak, at any of the strobes.
    """
    curve = branch.curve
    if curve.n != orbit.n:
        return False
    flow = curve.family.flow(value)
    laps = flow.run(orbit.start, orbit.n).strobes[:-1]
    if flow.system.mirror is not None:
        laps = np.concatenate([laps, mirrored_strobes(flow, orbit)])
    for a, b in zip(branch.points, branch.points[1:], strict=False):
        if not min(a.value, b.value) <= value <= max(a.value, b.value) or a.value == b.value:
            continue
        share = (value - a.value) / (b.value - a.value)
        guess = a.solved.y + share * (b.solved.y - a.solved.y)
        near = curve.near(guess[:-1], value)
        if near is not None and _least(laps, near.x, curve) < tolerance:
            return True
    return False


def follows(branch: Branch, n: int, symmetric: bool, orbit_images: Array) -> bool:
    """Whether a branch of such orbits passes one of these ``images``."""
    curve = branch.curve
    if (curve.n, curve.symmetric) != (n, symmetric):
        return False
    return place(curve, [p.solved for p in branch.points], orbit_images) is not None


def _least(laps: Array, x: Array, curve: Curve) -> float:
    return float((np.abs(laps - x) / curve.scale[:-1]).max(axis=1).min())


def _leads(bifurcation: Bifurcation) -> bool:
    """Whether another branch leaves at this point and the change concerns a stable orbit."""
    return (
        bifurcation.kind in (PointKind.PITCHFORK, PointKind.DOUBLING)
        and bifurcation.stable[0] != bifurcation.stable[1]
    )
