"""What a sweep's tracks show on both sides of a bifurcation point, in the order they meet it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.bifurcations.points import Bifurcation, Kind
from designer.bifurcations.sweep import DOWN, Sweep
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import Steady

LAG = 2
"""Steps past a point within which its change has to show: motion near one settles slowly."""
RISING = "rising"
"""For a track of fixed starts, which has no direction: by the rising parameter."""


@dataclass(frozen=True)
class Change:
    """What one track shows before and after a point.

    track : "down" or "up", "rising" for fixed starts, or None where no track shows the change.
    before, after : as in "1-1-1 symmetric"; after may be "". text : both, for people.
    """

    track: str | None
    before: str
    after: str
    text: str

    def as_dict(self) -> dict[str, str | None]:
        """Plain, for JSON."""
        return {"track": self.track, "from": self.before, "to": self.after, "text": self.text}


def changes(sweep: Sweep, point: Bifurcation) -> list[Change]:
    """One for each track that changes at the point; of fixed starts the first that does.

    Where none does (the branch is another one, or unstable on both sides), one without a track,
    that says what happens on the branch itself.
    """
    out: list[Change] = []
    for track in sweep.plan.tracks:
        found = _on(sweep, track, point)
        if found is None:
            continue
        name = track if sweep.plan.followed else RISING
        out.append(Change(name, *found, _text(point, *found)))
        if not sweep.plan.followed:
            break
    return out or [_of_branch(point)]


def label(response: str, symmetric: bool | None) -> str:
    """The response with its symmetry, where it has one."""
    said = {True: " symmetric", False: " asymmetric", None: ""}
    return response + said[symmetric if response.count("-") == 2 else None]


def family(response: str) -> str:
    """The response up to its mirror image, which swaps p and q."""
    parts = response.split("-")
    return "-".join([parts[0], *sorted(parts[1:])])


def _on(sweep: Sweep, track: str, point: Bifurcation) -> tuple[str, str] | None:
    """What the track shows on its two sides, if that differs and the branch is one of them."""
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
        if after.status is OrbitStatus.NOT_SETTLED or _shown(after) == _shown(before):
            continue
        near = {family(point.before), family(point.after)}
        if family(before.response) not in near and family(after.response) not in near:
            return None
        return _shown(before), _shown(after)
    return None


def _shown(step: Steady) -> str:
    return label(step.response, step.symmetric)


def _text(point: Bifurcation, before: str, after: str) -> str:
    if point.kind is not Kind.FOLD:
        return f"{before} → {after}"
    if family(before.split()[0]) in (family(point.before), family(point.after)):
        return f"{before} ends (fold) → {after}"
    return f"{before} → {after}, which begins (fold)"


def _of_branch(point: Bifurcation) -> Change:
    """By the branch alone, from its stable side where it has one."""
    before, after = point.before, point.after
    if point.stable[1] and not point.stable[0]:
        before, after = after, before
    unstable = "" if point.stable[0] or point.stable[1] else "unstable "
    if point.kind is Kind.GRAZING:
        return Change(None, before, after, f"{unstable}{before} → {after}")
    if point.kind is Kind.FOLD:
        return Change(None, before, "", f"{unstable}{before} ends (fold)")
    if unstable:
        return Change(None, before, "", f"unstable {before}")
    return Change(None, before, "", f"{before} loses its stability")
