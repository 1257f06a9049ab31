"""The ends of a sweep's windows, located by continuation, and the families of windows.

From its orbits in the middle and at both ends of each periodic window the branch is followed, a
little past what the sweep shows in any case, and beyond that for as long as the response is stable
there: a sweep that comes from another attractor enters a response late, or leaves it early. It is
followed until the response ends or the sweep's range does; an end that was not located says so.
Windows of a few steps, and of long periods, are left out, and say that: a finer sweep has them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from designer.base.threads import parallel
from designer.bifurcations import branch_survey
from designer.bifurcations.branch_survey import Survey, passes
from designer.bifurcations.branch_switch import REACH, birth, close
from designer.bifurcations.continuation import Branch, BranchPoint, End, apart, start, trace
from designer.bifurcations.flow_family import Family
from designer.bifurcations.orbit_jumps import goes_on, one_orbit
from designer.bifurcations.points import Bifurcation, locate as points_on
from designer.bifurcations.sweep import Sweep, Window
from designer.bifurcations.windows import NOT_LOCATED, BranchWindow, WindowEnd, all_windows
from designer.dynamics import attractors
from designer.dynamics.counts import period_of, read_counts
from designer.dynamics.orbit import Orbit
from designer.dynamics.steady_state import SteadyMotion

if TYPE_CHECKING:
    from designer.answers.bifurcation_answer import EndRow

LEAST_STEPS, LONGEST = 4, 4
"""Of a window whose ends are looked for: steps, and period."""
BEYOND = 2
"""Steps past a window's ends that its branch is followed, stable or not."""
SAME = 1e-7
"""Of the parameter: points of a kind nearer than this are one (the same end from both sides, or
seen on both tracks)."""
NOT_SOUGHT = "not looked for"
"""What is said of the ends of a window that is left out."""
REASONS = {
    NOT_LOCATED: "the response changes between two orbits of its branch, where no point was found",
    End.LOST: "its branch was followed to here and lost",
    End.POINTS: "its branch was followed to here, the most points that are",
    End.JOINED: "its branch joins another here, at a point that was not found",
    End.STOPPED: "its branch was let go here",
}
"""Why an end of a branch's window is no located one."""


@dataclass(frozen=True)
class SweptEnd:
    """An end of a sweep's window, by the branch that its response lies on."""

    window: Window
    side: int
    """1 for its upper end, -1 for the lower."""
    kind: str
    """Kind of the bifurcation, "limit of the parameter" (the sweep's range ends first),
    ``NOT_LOCATED`` or ``NOT_SOUGHT``."""
    value: float | None
    """Of the parameter: the end's; where it was not located, how far the response is known."""
    error: float | None
    """Half the width of the interval that holds the end, where one is known."""
    reason: str = ""
    """Why it was not located or not looked for, in words."""

    def as_dict(self) -> EndRow:
        """Plain data by the keys of the contract."""
        row: EndRow = {"kind": self.kind, "value": self.value, "error": self.error}
        if self.reason:
            row["reason"] = self.reason
        return row


@dataclass(frozen=True)
class WindowEnds:
    """What the branches of a sweep's windows show."""

    points: tuple[Bifurcation, ...]
    """Bifurcation points on them within the sweep, ascending."""
    ends: tuple[tuple[SweptEnd, SweptEnd] | None, ...]
    """The lower and the upper end of each window of the sweep; None of one that is not periodic."""
    families: tuple[int | None, ...]
    """The family of each window, as of ``families``."""

    @property
    def missing(self) -> list[SweptEnd]:
        """The ends that were looked for and not located, each once, ascending."""
        out: dict[tuple[object, ...], SweptEnd] = {}
        for end in (end for pair in self.ends if pair is not None for end in pair):
            if end.kind == NOT_LOCATED and end.value is not None:
                place = float(f"{end.value:.6g}")
                out.setdefault((end.window.response, end.side, place), end)
        return sorted(out.values(), key=lambda end: (end.value or 0.0, end.side))


@dataclass(frozen=True)
class _Followed:
    """What following the branches of one window has found."""

    points: Sequence[Bifurcation] = ()
    ends: tuple[SweptEnd, SweptEnd] | None = None
    branches: Sequence[Branch] = ()

    def judged_by(self, points: Sequence[Bifurcation]) -> tuple[SweptEnd, SweptEnd] | None:
        """The ends, nearer where one of all windows' points says so.

        Where a branch loses its stability and has it again between two of its points, neither
        change was seen; another window's branch, with its points elsewhere, may have seen both.
        """
        if self.ends is None:
            return None
        low, high = (self._nearer(end, points) for end in self.ends)
        return low, high

    def _nearer(self, end: SweptEnd, points: Sequence[Bifurcation]) -> SweptEnd:
        edge = end.window.high if end.side > 0 else end.window.low
        if end.value is None or end.kind == NOT_SOUGHT:
            return end
        low, high = sorted((edge, end.value))
        between = [p for p in points if low < p.value < high and _stability_ends(p, end.side)]
        for point in sorted(between, key=lambda p: abs(p.value - edge)):
            orbit = point.point.orbit
            if any(passes(branch, point.value, orbit) for branch in self.branches):
                where = str(point.kind), point.value, point.error
                return SweptEnd(end.window, end.side, *where)
        return end


def _stability_ends(point: Bifurcation, side: int) -> bool:
    """Whether a branch is stable on the other side of a point alone."""
    stable = point.stable_sides
    return stable is not None and stable[-side] and not stable[side]


def windows(sweep: Sweep) -> list[Window]:
    """Those whose ends are looked for."""
    return [w for w in sweep.windows if not _left_out(w)]


def _left_out(window: Window) -> str:
    """Why the ends of a window are not looked for; "" where they are."""
    if not period_of(window.response):
        return "not periodic"
    if window.steps < LEAST_STEPS:
        return f"fewer than {LEAST_STEPS} steps of the sweep show it"
    return f"its period is longer than {LONGEST}" if period_of(window.response) > LONGEST else ""


def locate(
    sweep: Sweep, jobs: int = 1, progress: Callable[[], None] = lambda: None
) -> list[Bifurcation]:
    """The points, ascending; ``progress`` is called once a window."""
    return list(find(sweep, jobs, progress).points)


def find(sweep: Sweep, jobs: int = 1, progress: Callable[[], None] = lambda: None) -> WindowEnds:
    """The points and the windows' ends; ``progress`` is called once a window that is followed."""

    def one(window: Window) -> _Followed:
        if not period_of(window.response):
            return _Followed()
        if reason := _left_out(window):
            low, high = (_unknown(window, side, NOT_SOUGHT, reason) for side in (-1, 1))
            return _Followed(ends=(low, high))
        found = _follow(sweep, window, sweep.plan.subject.family(sweep.plan.parameter))
        progress()
        return found

    each = list(parallel(one, sweep.windows, jobs))
    out: list[Bifurcation] = []
    for point in sorted((p for followed in each for p in followed.points), key=_order):
        same_kind = [p for p in out if p.kind is point.kind]
        if not any(abs(p.value - point.value) <= SAME * abs(point.value) for p in same_kind):
            out.append(point)
    ends = tuple(followed.judged_by(out) for followed in each)
    return WindowEnds(tuple(out), ends, families(sweep, jobs))


def _order(point: Bifurcation) -> tuple[float, str]:
    return point.value, str(point.kind)


def _unknown(window: Window, side: int, kind: str, reason: str) -> SweptEnd:
    """An end of which only the sweep's last step with the response is known."""
    return SweptEnd(window, side, kind, window.high if side > 0 else window.low, None, reason)


def _follow(sweep: Sweep, window: Window, over: Family) -> _Followed:
    """Bifurcation points on the branches of a window's orbits, and its lower and upper end."""
    values = [float(v) for v in sweep.plan.values]
    orbits = _orbits(sweep, window, over)
    if not orbits:
        reason = "none of its orbits was solved for"
        low_end, high_end = (_unknown(window, side, NOT_LOCATED, reason) for side in (-1, 1))
        return _Followed(ends=(low_end, high_end))
    margin = BEYOND * (values[1] - values[0])
    low, high = window.low - margin, window.high + margin
    counts = orbits[0][1].counts.family

    def over_with(p: BranchPoint) -> bool:
        """Whether a point is past what the sweep shows of the window, and no longer the stable
        response."""
        return not low <= p.value <= high and not (p.stable and p.counts.family == counts)

    found = branch_survey.survey(over, orbits, values[0], values[-1], depth=0, until=over_with)
    found = _led_on(found)
    stretches = all_windows(found)
    first = min(orbits, key=lambda o: o[0])
    last = max(orbits, key=lambda o: o[0])
    points = [p for p in found.points if values[0] <= p.value <= values[-1]]
    ends = (
        _end(window, -1, found, stretches, *first),
        _end(window, 1, found, stretches, *last),
    )
    return _Followed(points, ends, found.branches)


def _orbits(sweep: Sweep, window: Window, over: Family) -> list[tuple[float, Orbit]]:
    """Orbits of a window with their values of the parameter: one in its middle, and those nearest
    to its ends. They need not lie on one branch."""
    values = [float(v) for v in sweep.plan.values]
    first, steps = values.index(window.low), window.steps
    tracks = sweep.plan.tracks if window.track == "starts" else (window.track,)

    def orbit(k: int) -> Orbit | None:
        for track in tracks:
            step = sweep.steps[track][k]
            if (step.response, step.symmetric) != (window.response, window.symmetric):
                continue
            flow = over.flow(values[k])
            solution = attractors.shoot(flow, step.start, step.n)
            if solution is None:
                continue
            found = attractors.describe(flow, solution[0], step.n, solution[1])
            if found.counts.family == step.counts.family:
                return found
        return None

    out: dict[int, Orbit] = {}
    third = max(steps // 3, 1)
    for wanted in (
        (steps // 2, steps // 3, 1),
        range(third),
        range(steps - 1, steps - 1 - third, -1),
    ):
        for k in wanted:
            found = out.get(k) or orbit(first + k)
            if found is not None:
                out[k] = found
                break
    return [(values[first + k], found) for k, found in out.items()]


def _end(
    window: Window,
    side: int,
    found: Survey,
    stretches: Sequence[BranchWindow],
    value: float,
    orbit: Orbit,
) -> SweptEnd:
    """An end of the stable stretch that an orbit of the window lies on.

    side : 1 for the upper end, -1 for the lower.
    """
    for stretch in stretches:
        if not stretch.low.value <= value <= stretch.high.value:
            continue
        branch = found.branches[stretch.branch]
        first, last = stretch.span
        part = branch.points[max(first - 1, 0) : last + 2]
        if not passes(replace(branch, points=part), value, orbit):
            continue
        end = _outer(stretch, side)
        if end.why == End.CLOSED:  # where a loop was begun: the stretch goes on at its other end
            seam = [s for s in stretches if s.branch == stretch.branch and s is not stretch]
            others = [s for s in seam if _outer(s, -side).why == End.CLOSED]
            end = _outer(others[0], side) if others else end
        if end.point is not None or end.why == End.LIMIT:
            return SweptEnd(window, side, end.why, end.value, end.error)
        error = end.error if end.why == NOT_LOCATED else None
        reason = REASONS.get(end.why, end.why)
        return SweptEnd(window, side, NOT_LOCATED, end.value, error, reason)
    return _unknown(window, side, NOT_LOCATED, "its orbit there was not found on a stable branch")


def _outer(stretch: BranchWindow, side: int) -> WindowEnd:
    return stretch.high if side > 0 else stretch.low


# ---------------------------------------------------------------------------------------------


def _led_on(found: Survey) -> Survey:
    """The survey with each branch that joins another led on to the point where it does; the other
    is looked for beside it where it was not followed."""
    branches: list[Branch] = []
    points = list(found.points)
    for number, branch in enumerate(found.branches):
        for side in (0, 1):
            if branch.ends[side] is not End.JOINED:
                continue
            facing = branch if side else branch.reversed()
            closed = close(facing, points)
            if closed is facing:
                more = _parting_points(facing, len(found.branches) + len(branches))
                closed = close(facing, more)
                points += more if closed is not facing else []
            added = len(closed.points) - len(facing.points)
            branch = closed if side else closed.reversed()
            if not side and added:  # points count from the branch's beginning
                points = [
                    replace(p, position=p.position + added) if p.branch == number else p
                    for p in points
                ]
        branches.append(branch)
    return replace(found, branches=tuple(branches), points=tuple(points))


def _parting_points(branch: Branch, number: int) -> list[Bifurcation]:
    """Bifurcation points of the branch that another one's last point joins: of the symmetric
    orbits, of odd n, or of those of half the period. number : of that branch."""
    curve, last = branch.curve, branch.points[-1]
    n = curve.n if curve.n % 2 else curve.n // 2
    middle = last.solved.x + 0.5 * curve.scale[:-1] * apart(curve, last)
    seed = replace(last.orbit, start=middle, n=n)
    reach = REACH * float(curve.scale[-1])
    try:
        origin = start(curve.family, seed, last.value, symmetric=curve.n % 2 == 1)
    except ArithmeticError:
        return []
    stable = origin.points[0].stable
    low, high = last.value - reach, last.value + reach
    parent = trace(origin, low, high, until=lambda p: p.stable is not stable)
    return [replace(p, born=birth(parent, p)) for p in points_on(parent, number)]


def families(sweep: Sweep, jobs: int = 1) -> tuple[int | None, ...]:
    """For each window of the sweep the number of its family, from 1; None of one that is not
    periodic.

    Neighbouring windows of a track are of one family where the orbit at the last step of the one
    goes on to that at the first step of the other: where a turning point touches a stop or leaves
    it, the counts of impacts change, and the orbit goes on. Windows of two tracks are where they
    show the same orbit.
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
