"""The order of the paper's 1-p-p as ω falls, and what lies between their windows.

The main window of 1-p-p is the widest one of its symmetric orbits. From there down to the main
window of 1-(p+1)-(p+1) the paper has chaos; whether that is so is looked for from rest.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from designer.bifurcations import sweep
from designer.bifurcations.windows import BranchWindow
from designer.dynamics.counts import read_counts
from designer.dynamics.orbit import OrbitStatus
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
