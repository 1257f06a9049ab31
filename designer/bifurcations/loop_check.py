"""Whether an orbit lies on a stretch of a branch that was followed already.

An orbit of period n is met again as itself, at any of its n strobes, or as its mirror twin: a loop
of orbits may come back to its beginning some periods later, or mirrored. Where one of these images
comes near the chord between two neighbouring points of the branch, the branch's own point abreast
of it is solved for, and is the same orbit or is not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from designer.base.arrays import Array
from designer.bifurcations.orbit_curve import Curve, Solved

BESIDE = 0.25
"""Of the distance between two neighbouring points: images farther off their chord are passed over.
"""
EQUAL = 1e-6
"""In scaled units: orbits no farther apart are the same."""


def images(curve: Curve, solved: Solved) -> Array:
    """(k, states + 1) the strobes of an orbit, then its twin's, each with the parameter."""
    flow = curve.family.flow(solved.value)
    halves = flow.run(solved.x, curve.n, points=2).strobes[:-1]
    laps = halves[::2]
    if flow.system.mirror is not None:
        laps = np.concatenate([laps, halves[1::2] @ flow.system.mirror.T])
    return np.column_stack([laps, np.full(len(laps), solved.value)])


def place(curve: Curve, points: Sequence[Solved], orbit_images: Array) -> int | None:
    """Number of the first point after which the branch passes one of the images, or None.

    points : neighbours on ``curve``. seen : ``images`` of an orbit of its period.
    """
    if len(points) < 2:
        return None
    track = np.array([p.y for p in points]) / curve.scale
    chords = np.diff(track, axis=0)
    squares = np.maximum((chords**2).sum(axis=1), 1e-300)
    for image in orbit_images / curve.scale:
        off = image - track[:-1]
        share = (off * chords).sum(axis=1) / squares
        aside = np.linalg.norm(off - share[:, None] * chords, axis=1)
        near = (aside <= BESIDE * np.sqrt(squares) + EQUAL) & (share >= 0.0) & (share <= 1.0)
        for i in map(int, np.flatnonzero(near)):
            solved = curve.between(points[i], points[i + 1], float(share[i]))
            if solved is not None and np.abs(solved.y / curve.scale - image).max() < EQUAL:
                return i
    return None
