"""Windows of a sweep that one orbit goes through, and the number that they have in common.

Where a turning point touches a stop or leaves it, the counts of impacts change and the orbit goes
on: two windows, one family.
"""

from __future__ import annotations

from designer.base.threads import parallel
from designer.bifurcations.orbit_jumps import goes_on, one_orbit
from designer.bifurcations.sweep import Sweep
from designer.dynamics.counts import read_counts
from designer.dynamics.steady_state import SteadyMotion


def families(sweep: Sweep, jobs: int = 1) -> tuple[int | None, ...]:
    """For each window of the sweep the number of its family, from 1; None of one that is not
    periodic.

    Neighbouring windows of a track are of one family where the orbit at the last step of the one
    goes on to that at the first step of the other; windows of two tracks where they show the same
    orbit.
    """
    windows, values = sweep.windows, sweep.plan.values.tolist()
    spans = [(values.index(w.low), values.index(w.high)) for w in windows]
    names = [(w.response, w.symmetric) for w in windows]
    counts = [read_counts(w.response) for w in windows]
    over = sweep.plan.subject.family(sweep.plan.parameter)

    def shown(window: int, place: int) -> dict[str, SteadyMotion]:
        """The steps of a window at a value, by track."""
        track = windows[window].track
        tracks = (track,) if track in sweep.steps else sweep.plan.tracks
        steps = {t: sweep.steps[t][place] for t in tracks}
        return {t: s for t, s in steps.items() if (s.response, s.symmetric) == names[window]}

    def border(pair: tuple[int, int]) -> bool:
        """Whether the second window begins where the first one ends, at an orbit of its period."""
        a, b = (counts[k] for k in pair)
        alike = a is not None and b is not None and a.n == b.n
        near = spans[pair[0]][1] + 1 == spans[pair[1]][0]
        return alike and near and windows[pair[0]].track == windows[pair[1]].track

    def joined(pair: tuple[int, int]) -> bool:
        last, begin = spans[pair[0]][1], spans[pair[1]][0]
        before, after = shown(pair[0], last), shown(pair[1], begin)
        tracks = [track for track in before if track in after]
        return any(
            goes_on(over, (values[last], before[t]), (values[begin], after[t])) for t in tracks
        )

    def shared(a: int, b: int) -> bool:
        """Whether windows of two tracks show one orbit."""
        low, high = max(spans[a][0], spans[b][0]), min(spans[a][1], spans[b][1])
        if windows[a].track == windows[b].track or names[a] != names[b] or low > high:
            return False
        one, other = (next(iter(shown(k, (low + high) // 2).values())) for k in (a, b))
        return one_orbit(one, other)

    periodic = [k for k, count in enumerate(counts) if count is not None]
    pairs = [(a, b) for a in periodic for b in periodic]
    borders = [pair for pair in pairs if border(pair)]
    same = [p for p, one in zip(borders, parallel(joined, borders, jobs), strict=True) if one]
    same += [(a, b) for a, b in pairs if a < b and shared(a, b)]
    leader = {k: k for k in periodic}
    for a, b in same:
        low, high = sorted((leader[a], leader[b]))
        leader = {k: low if first == high else first for k, first in leader.items()}
    numbers = {first: number for number, first in enumerate(sorted(set(leader.values())), 1)}
    return tuple(numbers[leader[k]] if k in leader else None for k in range(len(windows)))
