"""Bifurcation points at the ends of a sweep's windows, located by continuation.

From the orbit in the middle of each periodic window its branch is followed a little past both ends
of the window, though never out of the sweep: points outside it are none of the sweep's. Windows of
a few steps, and of long periods, are left out: a finer sweep has them.
"""

from __future__ import annotations

from collections.abc import Callable

from designer.base.threads import parallel
from designer.bifurcations import branch_survey
from designer.bifurcations.flow_family import Family
from designer.bifurcations.points import Bifurcation
from designer.bifurcations.sweep import Sweep, Window
from designer.dynamics import attractors
from designer.dynamics.counts import read_counts

LEAST_STEPS, LONGEST = 4, 4
"""Of a window whose ends are looked for: steps, and period."""
BEYOND = 2
"""Steps past a window's ends that its branch is followed."""
SAME = 1e-7
"""Of the parameter: points of a kind nearer than this are one (the same end from both sides, or
seen on both tracks)."""


def windows(sweep: Sweep) -> list[Window]:
    """Those whose ends are looked for."""
    return [w for w in sweep.windows if w.steps >= LEAST_STEPS and 0 < period(w) <= LONGEST]


def period(window: Window) -> int:
    """n of a periodic window; 0 of others."""
    counts = read_counts(window.response)
    return 0 if counts is None else counts.n


def locate(
    sweep: Sweep, jobs: int = 1, progress: Callable[[], None] = lambda: None
) -> list[Bifurcation]:
    """The points, ascending; ``progress`` is called once a window."""

    def one(window: Window) -> list[Bifurcation]:
        points = _ends(sweep, window, sweep.plan.subject.family(sweep.plan.parameter))
        progress()
        return points

    every = [p for points in parallel(one, windows(sweep), jobs) for p in points]
    out: list[Bifurcation] = []
    for point in sorted(every, key=lambda p: (p.value, str(p.kind))):
        same_kind = [p for p in out if p.kind is point.kind]
        if not any(abs(p.value - point.value) <= SAME * abs(point.value) for p in same_kind):
            out.append(point)
    return out


def _ends(sweep: Sweep, window: Window, over: Family) -> list[Bifurcation]:
    values = [float(v) for v in sweep.plan.values]
    first = values.index(window.low)
    tracks = sweep.plan.tracks if window.track == "starts" else (window.track,)
    for k in (first + window.steps // 2, first + window.steps // 3, first + 1):
        for track in tracks:
            step = sweep.steps[track][k]
            if (step.response, step.symmetric) != (window.response, window.symmetric):
                continue
            flow = over.flow(values[k])
            solution = attractors.shoot(flow, step.start, step.n)
            if solution is None:
                continue
            orbit = attractors.describe(flow, solution[0], step.n, solution[1])
            margin = BEYOND * (values[1] - values[0])
            low, high = max(window.low - margin, values[0]), min(window.high + margin, values[-1])
            survey = branch_survey.survey(over, [(values[k], orbit)], low, high, depth=0)
            return [p for p in survey.points if values[0] <= p.value <= values[-1]]
    return []
