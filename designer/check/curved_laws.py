"""Curved laws whose straight pieces are off where a motion draws them: cubic springs and Hertzian
stops.

A law's pieces are laid for the whole of a stated span, and their error counts against the force at
its end. A motion beyond it, or over a small part of it, meets another law than the stated one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from designer.base.arrays import Array
from designer.base.si_unit import value_text
from designer.check.absolute_motion import followed
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import ANSWERS, Orbit
from designer.laws.hertz_law import POWER
from designer.laws.law_elements import NonlinearElement, SmoothLaw
from designer.model.lumped_elements import Gap
from designer.model.lumped_system import LumpedSystem
from designer.model.mechanics import MechanicalModel

if TYPE_CHECKING:
    from designer.answers.shared_rows import MisfitRows

POINTS = 200
"""Points of a drive period. A wave of the drive's tenth harmonic is missed by at most 1.2 %
there."""
COARSE = 0.05
"""The error of the pieces from which on it is said, over the largest force of the motion."""
PLACES = 400
"""The displacements of a motion at which the pieces are held against the law."""


@dataclass(frozen=True)
class LawMisfit:
    """A curved law whose force is off where a motion draws it: beyond its span, where it goes on
    straight, or where its pieces are few."""

    where: tuple[str, ...]
    """What a cubic spring joins; of Hertzian stops the clearance alone."""
    span: float
    """Displacement up to which the pieces are laid: the range of a spring, the depth of stops."""
    reached: float
    """Largest displacement over the motion, in the same unit."""
    error: float
    """Largest error of the force over the motion, over the largest force in it."""

    @property
    def beyond(self) -> bool:
        """Whether the motion leaves the span."""
        return self.reached > self.span

    @property
    def spring(self) -> bool:
        """Whether the law is a cubic spring's."""
        return len(self.where) == 2

    def text(self, response: str, *, in_si: bool) -> str:
        """The misfit in words. response : what draws the law so far. in_si : whether lengths are in
        metres."""
        reached, span = (
            value_text(x, "m") if in_si else f"{x:.4g}" for x in (self.reached, self.span)
        )
        name, more = "range", "points"
        if self.spring:
            one, other = self.where
            drawn = f"draws the cubic spring between {one} and {other} to {reached}"
        else:
            name, more = "depth", "pieces"
            drawn = f"goes {reached} deep into the Hertzian stops of {self.where[0]}"
        off = f"off by up to {100.0 * self.error:.3g} % of its largest"
        if self.beyond:
            beyond = f"beyond the {name} of {span}, where the force goes on straight and is {off}"
            return f"{response} {drawn}, {beyond}: state a larger {name}"
        few = f"of the {name} of {span}, where few {more} stand for the law and the force is {off}"
        return f"{response} {drawn} {few}: state more {more}, or a smaller {name}"


def misfits_json(misfits: Iterable[LawMisfit]) -> MisfitRows:
    """Misfits by their kinds, for JSON; nothing without any."""
    rows: MisfitRows = {}
    for each in misfits:
        reached, error = each.reached, each.error
        if each.spring:
            of_spring: Literal["beyond_range", "coarse_range"]
            of_spring = "beyond_range" if each.beyond else "coarse_range"
            rows.setdefault(of_spring, []).append(
                {"between": each.where, "range": each.span, "reached": reached, "error": error}
            )
        else:
            of_stops: Literal["beyond_depth", "coarse_depth"]
            of_stops = "beyond_depth" if each.beyond else "coarse_depth"
            (name,) = each.where
            rows.setdefault(of_stops, []).append(
                {"clearance": name, "depth": each.span, "reached": reached, "error": error}
            )
    return rows


def misfits_in(answer: MisfitRows) -> Iterator[LawMisfit]:
    """The misfits that stand in the JSON object of a response."""
    for each in (*answer.get("beyond_range", ()), *answer.get("coarse_range", ())):
        yield LawMisfit(tuple(each["between"]), each["range"], each["reached"], each["error"])
    for each in (*answer.get("beyond_depth", ()), *answer.get("coarse_depth", ())):
        yield LawMisfit((each["clearance"],), each["depth"], each["reached"], each["error"])


@dataclass(frozen=True)
class CurvedLaw:
    """A law at b = 1, on one side of where it begins."""

    where: tuple[str, ...]
    """As of ``LawMisfit``."""
    span: float
    """As of ``LawMisfit``."""
    row: Array
    """(n,) coefficients of the masses' displacements in the one that it depends on."""
    starts: tuple[float | None, float | None]
    """Displacement, and negative displacement, past which it acts; None where it does not."""
    force: Callable[[Array], Array]
    """(k,) forces at displacements past the start."""
    points: Array
    """(p, 2) displacements past the start, and forces, that its pieces join; the last goes on."""

    def reached(self, displacements: Array) -> float:
        """The furthest past the start. displacements : (k, n) of the masses."""
        own = displacements @ self.row
        pairs = zip((own, -own), self.starts, strict=True)
        return max(float(x.max()) - start for x, start in pairs if start is not None)

    def error(self, reached: float) -> float:
        """Largest error of the pieces' force up to there, over the largest force up to there."""
        x = np.linspace(0.0, reached, PLACES + 1)
        wanted = self.force(x)
        (before, low), (last, high) = self.points[-2:]
        pieces = np.interp(x, *self.points.T)
        pieces += (high - low) / (last - before) * np.maximum(x - last, 0.0)
        largest = float(np.abs(wanted).max())
        return float(np.abs(pieces - wanted).max()) / largest if largest else 0.0


def law_misfits(
    model: MechanicalModel, flow: Flow, orbit: Orbit, units: Array
) -> tuple[LawMisfit, ...]:
    """The misfits of the laws that an orbit of ``flow`` draws beyond their spans, or over which
    their pieces are ``COARSE``.

    model : at the orbit's clearance. units : (n,) of each state of the flow per unit of the
    model's.
    """
    laws = curved_laws(model)
    if not laws or not isinstance(model, LumpedSystem) or orbit.status not in ANSWERS:
        return ()
    states = followed(flow, orbit, POINTS)
    if states is None:
        return ()
    # With another b all of a law's lengths are another, and its forces with them.
    displacements = (states[:, : len(units)] / units)[:, 0::2] / model.b
    out = []
    for law in laws:
        reached = law.reached(displacements)
        if reached > 0.0:
            error = law.error(reached)
            misfit = LawMisfit(law.where, model.b * law.span, model.b * reached, error)
            if misfit.beyond or error > COARSE:
                out.append(misfit)
    return tuple(out)


def curved_laws(model: MechanicalModel) -> tuple[CurvedLaw, ...]:
    """The cubic springs of a model, then its Hertzian stops."""
    if not isinstance(model, LumpedSystem):
        return ()
    springs = (
        _of_spring(model, element, element.curve)
        for element in model.nonlinear.values()
        if element.curve is not None
    )
    return (*springs, *(_of_stops(model, gap) for gap in model.gaps if gap.law == "hertz"))


def _of_spring(model: LumpedSystem, element: NonlinearElement, curve: SmoothLaw) -> CurvedLaw:
    upper = [(0.0, 0.0), *(point for point in element.corners if point[0] > 0.0)]
    return CurvedLaw(
        element.between or (),
        curve.span,
        model.row_of(element.factors),
        (0.0, 0.0),
        curve.force,
        np.array(upper),
    )


def _of_stops(model: LumpedSystem, gap: Gap) -> CurvedLaw:
    pieces, constant, depth = gap.hertz, gap.constant, gap.depth
    assert pieces is not None
    assert constant is not None
    assert depth is not None
    points, slope = [(0.0, 0.0)], pieces.stiffness
    for (at, more), (following, _) in pairwise((*((0.0, 0.0), *pieces.further), (depth, 0.0))):
        slope += more
        points.append((following, points[-1][1] + slope * (following - at)))
    return CurvedLaw(
        (gap.name,),
        depth,
        model.row_of(gap.factors),
        (gap.upper, gap.lower),
        lambda x: constant * x**POWER,
        np.array(points),
    )
