"""What a sweep's tracks show on both sides of a bifurcation point, in the order they meet it.

A track shows a point only where it is on the branch that the point lies on, or on what is born
there: a track that changes beside it for another reason has nothing to do with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from designer.bifurcations.points import Bifurcation, Birth, PointKind
from designer.bifurcations.sweep import DOWN, Sweep
from designer.bifurcations.window_ends import SweptEnd
from designer.dynamics.counts import read_counts
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import SteadyMotion
from designer.plots.point_captions import caption, doubled, label

if TYPE_CHECKING:
    from designer.answers.bifurcation_answer import ChangeRow

LAG = 2
"""Steps past a point within which its change has to show: motion near one settles slowly."""
RISING = "rising"
"""How changes on a track of fixed starts are told, which has no direction: as the parameter
rises."""


@dataclass(frozen=True)
class TrackChange:
    """What one track shows before and after a point."""

    track: str | None
    """"down" or "up", "rising" for fixed starts, or None where no track shows the change."""
    before: str
    """What the track shows before the point, such as "1-1-1 symmetric"."""
    after: str
    """What the track shows after the point; may be ""."""
    text: str
    """What the track shows before and after the point, for people."""

    def as_dict(self) -> ChangeRow:
        """Plain, for JSON."""
        return {"track": self.track, "from": self.before, "to": self.after, "text": self.text}


def changes(sweep: Sweep, point: Bifurcation) -> list[TrackChange]:
    """One for each track that changes at the point; of fixed starts the first that does.

    Where none does (it is not on this branch, or that is unstable on both sides), one without a
    track, that says what happens on the branch itself.
    """
    out: list[TrackChange] = []
    for track in sweep.plan.tracks:
        sides = _on(sweep, track, point)
        if sides is None:
            continue
        name = track if sweep.plan.followed else RISING
        out.append(TrackChange(name, *sides, _text(point, *sides)))
        if not sweep.plan.followed:
            break
    return out or [_of_branch(point)]


def missing(end: SweptEnd, parameter: str, unit: str = "") -> str:
    """The caption of an end that was not located, such as "lower end of 1-1-0 not located; 1-1-0 is
    known down to ω = 0.9: its branch was followed to here and lost".

    parameter : how it is written. unit : of it.
    """
    owner = label(end.window.response, end.window.symmetric)
    which, way = ("upper", "up") if end.side > 0 else ("lower", "down")
    place = f"{parameter} = {end.value:.9g}{' ' + unit if unit else ''}"
    return f"{which} end of {owner} {end.kind}, known {way} to {place}: {end.reason}"


def family(response: str) -> str:
    """The response up to its mirror image, which swaps p and q."""
    counts = read_counts(response)
    return response if counts is None else str(counts.family)


def _on(sweep: Sweep, track: str, point: Bifurcation) -> tuple[str, str] | None:
    """What the track shows on its two sides, if that differs by what happens at the point."""
    above = int(np.searchsorted(sweep.plan.values, point.value))
    steps, step = sweep.steps[track], 1
    first, then = above - 1, above
    if track == DOWN:
        first, then, step = above, above - 1, -1
    if not 0 <= first < len(steps):
        return None
    before = steps[first]
    for index in range(then, then + step * (LAG + 1), step):
        if not 0 <= index < len(steps):
            return None
        after = steps[index]
        if after.status is OrbitStatus.NOT_SETTLED or _step_label(after) == _step_label(before):
            continue
        caused = _leaves(point, before, after, step) or _arrives(point, before, after, step)
        if not caused and not sweep.plan.followed:
            caused = _begins(point, after, step)
        return (_step_label(before), _step_label(after)) if caused else None
    return None


def _leaves(point: Bifurcation, before: SteadyMotion, after: SteadyMotion, step: int) -> bool:
    """Whether a track was on the branch, stable there, and loses it at the point.

    step : 1 where the track rises through the parameter, -1 where it falls.
    """
    if point.kind is PointKind.FOLD:
        return point.side == -step and any(point.stable) and _is(before, point, point.response)
    sides = point.stable_sides
    assert sides is not None
    responses = {point.direction: point.after, -point.direction: point.before}
    if not sides[-step] or not _is(before, point, responses[-step]):
        return False
    return not sides[step] or _is(after, point, responses[step])


def _arrives(point: Bifurcation, before: SteadyMotion, after: SteadyMotion, step: int) -> bool:
    """Whether a track was on what is born at the point, and goes over to the branch there."""
    born, sides = _born(point), point.stable_sides
    if born is None or sides is None or not born.stable or born.side != -step:
        return False
    whence = family(before.response) == family(born.response)
    return whence and sides[step] and _is(after, point, point.response)


def _begins(point: Bifurcation, after: SteadyMotion, step: int) -> bool:
    """Whether an orbit that a fixed start leads to is there only past this fold."""
    fold = point.kind is PointKind.FOLD and any(point.stable) and point.side == step
    return fold and _is(after, point, point.response)


def _born(point: Bifurcation) -> Birth | None:
    """What is born, where that was not looked for: as where a stable orbit loses its stability."""
    if point.born is not None or point.kind not in (PointKind.DOUBLING, PointKind.PITCHFORK):
        return point.born
    if point.stable[0] is point.stable[1]:
        return None
    unstable = -point.direction if point.stable[1] else point.direction
    twice = point.kind is PointKind.DOUBLING
    response = doubled(point.response) if twice else point.response
    return Birth(response, False, unstable, True)


def _is(step: SteadyMotion, point: Bifurcation, response: str) -> bool:
    """Whether a track shows this response, with the symmetry of the point's orbit."""
    return family(step.response) == family(response) and step.symmetric is point.symmetric


def _step_label(step: SteadyMotion) -> str:
    return label(step.response, step.symmetric)


def _text(point: Bifurcation, before: str, after: str) -> str:
    if point.kind is not PointKind.FOLD:
        return f"{before} → {after}"
    if family(before.split()[0]) == family(point.response):
        return f"{before} ends (fold) → {after}"
    return f"{before} → {after}, which begins (fold)"


def _of_branch(point: Bifurcation) -> TrackChange:
    """The caption by the branch alone, from its stable side where it has one."""
    before, after = point.before, point.after
    if point.stable[1] and not point.stable[0]:
        before, after = after, before
    return TrackChange(
        None, before, after if point.kind is PointKind.GRAZING else "", caption(point)
    )
