"""What the paper says of the model's dynamics, against what is found.

Each statement is judged by the branches and windows that were followed, not by figures written
down here; only the paper's own words and figures are.

The main window of 1-p-p is the widest one of its symmetric orbits. From there down to the main
window of 1-(p+1)-(p+1) the paper has chaos; whether that is so is looked for from rest.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.bifurcations import sweep
from designer.bifurcations.branch_survey import Survey
from designer.bifurcations.doubling_cascade import Cascade, cascade
from designer.bifurcations.points import Bifurcation, PointKind
from designer.bifurcations.windows import BranchWindow
from designer.dynamics.counts import Counts, read_counts
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.model import Dimensionless
from designer.model.swept_model import ModelSubject

STEPS = 61
"""Frequencies at which the motion from rest is looked at, in each gap."""


@dataclass(frozen=True)
class WindowGap:
    """From the main window of 1-p-p (``high`` is its lower end) down to the next one's upper
    end."""

    p: int
    """p of the upper window."""
    after: int
    """p of the next window down."""
    low: float
    """Upper end of the next window."""
    high: float
    """Lower end of the upper window."""
    seen: tuple[tuple[float, str], ...]
    """(ω, response) seen from rest, falling, inside the gap."""

    @property
    def chaotic(self) -> int:
        """At how many frequencies the motion is aperiodic."""
        return sum(name == OrbitStatus.APERIODIC for _, name in self.seen)


def gaps(
    model: Dimensionless,
    mains: Sequence[tuple[int, BranchWindow]],
    steps: int = STEPS,
    progress: Callable[[], None] = lambda: None,
) -> list[WindowGap]:
    """What rest leads to between neighbouring main windows that do not overlap.

    mains : p and main window, p rising. progress : called once a gap.
    """
    out = []
    for (p, upper), (after, lower) in itertools.pairwise(mains):
        low, high = lower.high.value, upper.low.value
        if high > low:
            values = np.linspace(low, high, steps + 2)[1:-1]
            plan = sweep.SweepPlan(ModelSubject(model), "omega", values, ("start 0",))
            (track,) = sweep.run(plan).steps.values()
            seen = [(float(w), s.response) for w, s in zip(values, track, strict=True)]
            out.append(WindowGap(p, after, low, high, tuple(seen[::-1])))
        progress()
    return out


def out_of_turn(windows: Sequence[BranchWindow], gap: WindowGap) -> list[tuple[float, int]]:
    """(ω, q) of each 1-q-q in a gap that is not in turn, falling.

    In turn are 1-p-p, twins too, and below it 1-(p+1)-(p+1); once that was seen, 1-p-p no more.
    Windows stand with their middle, beside the motions from rest.
    """
    seen = [(w, name) for w, name in gap.seen]
    for each in windows:
        middle = 0.5 * (each.low.value + each.high.value)
        if gap.low < middle < gap.high:
            seen.append((middle, each.response))
    out, last = [], gap.p
    for value, name in sorted(seen, reverse=True):
        q = equal(name)
        if q is None:
            continue
        if q < last or q > gap.after:
            out.append((value, q))
        else:
            last = q
    return out


def faults(windows: Sequence[BranchWindow], gap: WindowGap) -> str:
    """What in a gap is not as the paper has it; empty where all is."""
    parts = []
    if not gap.chaotic:
        parts.append("no aperiodic motion")
    strays: dict[int, list[float]] = {}
    for value, q in out_of_turn(windows, gap):
        strays.setdefault(q, []).append(value)
    for q, values in strays.items():
        low, high = f"{min(values):.5f}", f"{max(values):.5f}"
        where = low if low == high else f"{low} to {high}"
        parts.append(f"1-{q}-{q} out of turn at ω = {where}")
    return f"between p = {gap.p} and {gap.after} {' and '.join(parts)}" if parts else ""


def strays(windows: Sequence[BranchWindow], mains: Sequence[tuple[int, BranchWindow]]) -> list[str]:
    """Which 1-q-q have a window, by its middle, inside the main window of another p."""
    out = []
    for p, main in mains:
        for each in windows:
            q = equal(each.response)
            middle = 0.5 * (each.low.value + each.high.value)
            if q not in (None, p) and main.low.value < middle < main.high.value:
                out.append(f"1-{q}-{q} at ω = {middle:.5f} beside 1-{p}-{p}")
    return out


def equal(name: str) -> int | None:
    """q of "1-q-q", or None."""
    counts = read_counts(name)
    return counts.p if counts and counts.n == 1 and counts.symmetric else None


AGREES, IN_PART, DISAGREES = "agrees", "in part", "disagrees"
PITCHFORK = 1.47
"""The pitchfork of the symmetric 1-1-1, as the paper gives it."""
SWEEP = "designer bifurcation examples/paper.toml"


@dataclass(frozen=True)
class Statement:
    """A statement of the paper, against what is found here."""

    paper: str
    """What the paper says, and where."""
    found: str
    """What is found here."""
    verdict: str
    """"agrees", "in part" or "disagrees"."""
    command: str
    """The command line that shows it."""


def main_windows(
    windows: Sequence[BranchWindow], p: int
) -> tuple[BranchWindow | None, BranchWindow | None]:
    """The widest symmetric window of 1-p-p, and the widest of its twins."""
    name = f"1-{p}-{p}"
    out = []
    for symmetric in (True, False):
        own = [w for w in windows if w.response == name and w.symmetric is symmetric]
        out.append(max(own, key=lambda w: w.width, default=None))
    return out[0], out[1]


def symmetric_mains(windows: Sequence[BranchWindow]) -> list[tuple[int, BranchWindow]]:
    """p and the widest symmetric window of 1-p-p, for those of p = 1 … 8 that there are."""
    tops = [(p, main_windows(windows, p)[0]) for p in range(1, 9)]
    return [(p, w) for p, w in tops if w is not None]


def statements(
    survey: Survey,
    windows: Sequence[BranchWindow],
    gaps: Sequence[WindowGap],
    chatter: Sequence[tuple[float, Orbit]],
) -> list[Statement]:
    """Every statement, in the paper's order.

    gaps : what lies between the main windows. chatter : frequencies with the orbit reached from
    rest there, highest first.
    """
    symmetric, twins = main_windows(windows, 1)
    assert symmetric is not None
    assert twins is not None
    out = [_pitchfork(symmetric), _first_end(survey, windows, twins)]
    out += [_doublings(windows), _second(windows), _twins(windows), _order(windows, gaps)]
    out.append(_chattering(survey, windows, chatter))
    return [*out, _each(windows), _grazings(survey)]


def _pitchfork(symmetric: BranchWindow) -> Statement:
    end = symmetric.low
    same = end.why == PointKind.PITCHFORK
    close = abs(end.value - PITCHFORK) < 0.005
    return Statement(
        f"Sec. 4: as ω falls 1-1-1 loses its symmetry in a pitchfork at ω = {PITCHFORK}, where the "
        "largest exponent is 0",
        f"A {end.why} at ω = {end.value:.6f}; the multiplier is 1 there, so the exponent is 0. The "
        f"paper's figure is {abs(PITCHFORK / end.value - 1.0):.1%} off",
        (AGREES if close else IN_PART) if same else DISAGREES,
        f"{SWEEP} --from 1.4 --to 1.6 --steps 201 --down --out out/pitchfork",
    )


def _first_end(survey: Survey, windows: Sequence[BranchWindow], twins: BranchWindow) -> Statement:
    way = cascade(windows, twins)
    grazing = _grazing(survey, twins)
    grazed = ""
    if grazing is not None:
        state = "stable" if grazing.stable[0] and grazing.stable[1] else "unstable"
        grazed = (
            ". The 1-1-1AS orbit itself first touches the stop once more at "
            f"ω = {grazing.value:.5f}, {state} by then"
        )
    return Statement(
        "Sec. 4: grazing turns 1-1-1AS into 1-1-2, whose period doublings lead to chaos",
        f"A {twins.low.why} at ω = {twins.low.value:.5f} ends 1-1-1AS. Going on down: "
        f"{way.describe()}{grazed}",
        AGREES if twins.low.why == PointKind.GRAZING else DISAGREES,
        f"{SWEEP} --from 1.28 --to 1.4 --steps 601 --down --out out/first-cascade",
    )


def _grazing(survey: Survey, twins: BranchWindow) -> Bifurcation | None:
    """Where the orbits beyond a window's lower end first touch a stop once more."""
    end = twins.low.point
    if end is None:
        return None
    before, after = end.stable
    if before == after:  # the counts change there: the window lies at the higher values
        before = survey.branches[twins.branch].points[int(end.position)].value > end.value
    grazings = [
        p
        for p in survey.on(twins.branch)
        if p.kind is PointKind.GRAZING
        and (p.position > end.position if before else p.position < end.position)
    ]
    return min(grazings, key=lambda p: abs(p.position - end.position), default=None)


def _doublings(windows: Sequence[BranchWindow]) -> Statement:
    own = [w for w in windows if w.response in ("1-1-2", "1-2-1")]
    if not own:
        return Statement("1-1-2", "No stable 1-1-2 was met", DISAGREES, SWEEP)
    main = max(own, key=lambda w: w.width)
    way = cascade(windows, main)
    names = [w.response for w in way.steps]
    fine = len(names) > 1 and names[1] in ("2-2-4", "2-4-2")
    return Statement(
        "Sec. 4: 1-1-2 → 2-2-4 → 4-4-8 → … → chaos by period doublings",
        f"1-1-2 is stable from ω = {main.low.value:.5f} to {main.high.value:.5f}, and begins in a "
        f"{main.high.why}: it coexists with the other responses and does not come out of 1-1-1AS. "
        f"Down from there: {way.describe()}",
        (AGREES if main.high.why == PointKind.GRAZING else IN_PART) if fine else DISAGREES,
        f"{SWEEP} --from 1.28 --to 1.4 --steps 601 --starts 8 --out out/second-attractor",
    )


def _second(windows: Sequence[BranchWindow]) -> Statement:
    symmetric, twins = main_windows(windows, 2)
    if symmetric is None:
        return Statement("1-2-2", "No stable 1-2-2 was met", DISAGREES, SWEEP)
    way = cascade(windows, symmetric)
    names = [w.response for w in way.steps]
    fine = twins is not None and "2-4-4" in names
    only = names[:2] == ["1-2-2", "2-4-4"]
    return Statement(
        "Sec. 4: chaos gives way to 1-2-2, which doubles its period to 2-4-4, 4-8-8, … to chaos",
        f"1-2-2 begins in a {symmetric.high.why} at ω = {symmetric.high.value:.5f}. Down from "
        f"there: {way.describe()}. The loss of symmetry before the first doubling is not in the "
        "paper's chain, though its Fig. 3 shows the twins",
        AGREES if only else IN_PART if fine else DISAGREES,
        f"{SWEEP} --from 0.6 --to 0.95 --steps 701 --down --out out/second-window",
    )


def _twins(windows: Sequence[BranchWindow]) -> Statement:
    having: list[int] = []
    lacking: list[int] = []
    for p in range(2, 9):
        (lacking if main_windows(windows, p)[1] is None else having).append(p)
    words = f"Stable 1-p-p twins were found for p = {_list(having)}"
    if lacking:
        words += f"; none for p = {_list(lacking)} on the branches followed"
    return Statement(
        "Sec. 4 and Fig. 3: for p ≥ 2 as well two antisymmetric trajectories appear, by the start",
        words,
        AGREES if not lacking else IN_PART if having else DISAGREES,
        "designer reproduce dynamics --out out/paper-dynamics",
    )


def _order(windows: Sequence[BranchWindow], gaps: Sequence[WindowGap]) -> Statement:
    there = symmetric_mains(windows)
    falling = all(a[1].high.value > b[1].high.value for a, b in itertools.pairwise(there))
    apart = all(a[1].low.value > b[1].high.value for a, b in itertools.pairwise(there))
    looked = [(g.p, g.after) for g in gaps] == [(a[0], b[0]) for a, b in itertools.pairwise(there)]
    wrong = [text for text in (faults(windows, gap) for gap in gaps) if text]
    wrong += strays(windows, there)
    chaos = ", ".join(f"{g.p}–{g.after}: {g.chaotic} of {len(g.seen)}" for g in gaps)
    complete = [p for p, _ in there] == list(range(1, 9))
    return Statement(
        "Sec. 4: 1-1-1, chaos, 1-2-2, chaos, … 1-p-p in turn as ω falls",
        f"Symmetric windows of p = {_list([p for p, _ in there])}, "
        + ("each below the one before" if falling else "not in this order")
        + ("; their main windows do not overlap" if apart else "; some overlap")
        + ". What begins each of them from above: "
        + ", ".join(f"{p}: {w.high.why}" for p, w in there)
        + (f". Aperiodic from rest between them: {chaos}" if gaps else "")
        + (f". Not as said: {'; '.join(wrong)}" if wrong else ""),
        AGREES if complete and falling and apart and looked and not wrong else IN_PART,
        f"{SWEEP} --from 0.1 --to 1.8 --steps 1801 --down --out out/fig2",
    )


def _chattering(
    survey: Survey, windows: Sequence[BranchWindow], chatter: Sequence[tuple[float, Orbit]]
) -> Statement:
    shown = ", ".join(f"{orbit.response} at {w:g}" for w, orbit in chatter)
    most = max((w for w in windows if w.symmetric), key=lambda w: Counts.parse(w.response).p)
    down_to = min(p.value for branch in survey.branches for p in branch.points)
    lowest, orbit = chatter[-1]
    speeds = np.abs(orbit.impact_velocities[orbit.impact_sides > 0.0])
    dying = _dying(speeds)
    grows = orbit.p >= Counts.parse(most.response).p
    return Statement(
        "Sec. 4: as ω falls further p grows until the impacts become chattering",
        f"The most impacts of a symmetric response on the branches followed, for ω ≥ {down_to:g}, "
        f"are those of {most.response} (ω = {most.low.value:.6f} to {most.high.value:.6f}). From "
        f"rest: {shown}. At ω = {lowest:g} contact with the upper stop begins with the speeds "
        f"{', '.join(f'{v:.2g}' for v in speeds) or 'of no impact'}: "
        + ("bounces that die out, finite in number" if dying else "not bounces that die out"),
        AGREES if grows and dying else IN_PART,
        f"designer simulate examples/paper.toml --omega {lowest:g}",
    )


def _each(windows: Sequence[BranchWindow]) -> Statement:
    """The conclusions' course of every 1-p-p, of which Section 4 says the steps for p = 1, 2."""
    forks, doubles, others = [], [], []
    tops = symmetric_mains(windows)
    for p, top in tops:
        twins = main_windows(windows, p)[1]
        if top.low.why == PointKind.PITCHFORK:
            forks.append(p)
        if twins is not None and twins.low.why == PointKind.DOUBLING:
            doubles.append(p)
        elif twins is not None:
            others.append(f"{p} by a {twins.low.why}")
    whole = len(tops) == 8
    agrees = whole and len(forks) == len(doubles) == 8
    return Statement(
        "Sec. 6, 1 (i), (ii): as ω falls symmetric 1-p-p loses its symmetry in a pitchfork, and "
        "asymmetric 1-p-p goes over into chaos by period doublings",
        f"A pitchfork ends the main symmetric window for p = {_list(forks)}; a period doubling "
        f"ends that of the twins for p = {_list(doubles)}"
        + (f", and p = {', '.join(others)}" if others else ""),
        AGREES if agrees else IN_PART if forks and doubles else DISAGREES,
        "designer reproduce dynamics --out out/paper-dynamics",
    )


def _grazings(survey: Survey) -> Statement:
    """Where 1-p-p becomes 1-(p+1)-p, by grazing, as an attractor."""
    seen = []
    for point in survey.points:
        if point.kind is not PointKind.GRAZING or point.stable != (True, True):
            continue
        ends = [point.before, point.after]
        above, below = ends if point.direction < 0 else ends[::-1]
        p = equal(above)
        if p is not None and below in (f"1-{p + 1}-{p}", f"1-{p}-{p + 1}"):
            seen.append((point.value, f"{above} → {below} at ω = {point.value:.6f}"))
    words = "; ".join(text for _, text in sorted(seen, reverse=True))
    return Statement(
        "Sec. 6, 1: 1-p-p may undergo a grazing bifurcation, resulting in 1-(p+1)-p",
        f"As ω falls, stable on both sides: {words}" if seen else "Nowhere as an attractor",
        AGREES if seen else DISAGREES,
        f"{SWEEP} --from 1.21 --to 1.24 --steps 601 --starts 8 --out out/grazing",
    )


def _dying(speeds: Array) -> bool:
    """Whether there are several impacts in a period, each slower than the one before; the period
    may begin anywhere among them."""
    if len(speeds) < 2:
        return False
    return bool((np.diff(np.roll(speeds, -int(np.argmax(speeds)))) < 0.0).all())


def _list(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers)) if numbers else "none"


def main_cascades(windows: Sequence[BranchWindow]) -> dict[int, Cascade]:
    """For each p what 1-p-p goes over into as ω falls, from its main symmetric window on."""
    out = {}
    for p in range(1, 9):
        first = main_windows(windows, p)[0]
        if first is not None:
            out[p] = cascade(windows, first)
    return out
