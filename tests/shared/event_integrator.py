"""Masses, springs, dampers and stops, integrated from Newton's law.

It shares no code with the package. Everything is a plain list, in absolute coordinates: a spring or
damper joins two masses, or a mass and the ground, which moves by base · sin ωt. Between two events
the equations are smooth and SciPy's DOP853 solves them; at each event it is restarted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
GROUND = -1
"""The other end of what joins a mass to the ground."""


@dataclass(frozen=True)
class Gap:
    """A clearance: (gap, stiffness) of each spring of its upper and of its lower stop; damping and
    preload act as soon as a stop is touched."""

    mass: int
    other: int = GROUND
    upper: tuple[tuple[float, float], ...] = ()
    lower: tuple[tuple[float, float], ...] = ()
    damping: float = 0.0
    preload: float = 0.0

    @property
    def thresholds(self) -> list[tuple[int, int, float, float]]:
        """(side, number, gap, stiffness) of every spring; number 0 is where contact begins."""
        sides = ((1, self.upper), (-1, self.lower))
        return [(side, i, *spring) for side, springs in sides for i, spring in enumerate(springs)]


@dataclass(frozen=True)
class Mechanism:
    """Links: (mass, other mass or GROUND, stiffness or damping)."""

    masses: list[float]
    springs: list[tuple[int, int, float]]
    dampers: list[tuple[int, int, float]]
    forces: list[float]
    omega: float
    gaps: list[Gap] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)
    base: float = 0.0
    fixed_stops: bool = False
    waves: list[tuple[int, int, float, float]] = field(default_factory=list)
    """Further forces (mass, n, amplitude, phase): amplitude · sin(nωt + phase)."""

    def ground(self, t: float) -> tuple[float, float]:
        """Displacement and velocity of the ground."""
        phase = self.omega * t
        return self.base * math.sin(phase), self.base * self.omega * math.cos(phase)

    def in_gap(self, gap: Gap, t: float, y: Array) -> tuple[float, float]:
        """Displacement and velocity in a clearance; y : (2n,) displacements, then velocities."""
        n = len(self.masses)
        if gap.other == GROUND:
            at, rate = (0.0, 0.0) if self.fixed_stops else self.ground(t)
        else:
            at, rate = float(y[gap.other]), float(y[n + gap.other])
        return float(y[gap.mass]) - at, float(y[n + gap.mass]) - rate

    def rates(self, t: float, y: Array, past: list[list[bool]]) -> Array:
        """y' with these springs of each clearance in contact."""
        n = len(self.masses)
        push = np.array(self.forces) * math.sin(self.omega * t)
        if self.constants:
            push += self.constants
        for mass, order, amplitude, phase in self.waves:
            push[mass] += amplitude * math.sin(order * self.omega * t + phase)
        place = np.append(y[:n], self.ground(t)[0])
        speed = np.append(y[n:], self.ground(t)[1])
        push = np.append(push, 0.0)
        for links, of in ((self.springs, place), (self.dampers, speed)):
            for a, b, value in links:
                pull = value * (of[b] - of[a])
                push[a] += pull
                push[b] -= pull
        for gap, met in zip(self.gaps, past, strict=True):
            d, v = self.in_gap(gap, t, y)
            force = 0.0
            for (side, number, distance, stiffness), touched in zip(
                gap.thresholds, met, strict=True
            ):
                if touched:
                    force -= stiffness * (d - side * distance)
                    force -= gap.damping * v + side * gap.preload if number == 0 else 0.0
            push[gap.mass] += force
            push[gap.other] -= force
        return np.concatenate([y[n:], push[:n] / self.masses])

    def distances(self, t: float, y: Array) -> list[list[float]]:
        """How far past each spring's beginning the displacement of each clearance is."""
        out = []
        for gap in self.gaps:
            d, _ = self.in_gap(gap, t, y)
            out.append([side * d - distance for side, _, distance, _ in gap.thresholds])
        return out

    def fastest(self) -> float:
        """No motion is faster than this, in rad per unit of time."""
        stiffness = sum(k for *_, k in self.springs)
        stiffness += sum(k for gap in self.gaps for *_, k in gap.thresholds)
        return math.sqrt(2.0 * stiffness / min(self.masses))


@dataclass(frozen=True)
class Entry:
    """The beginning of a contact."""

    time: float
    gap: int
    side: int
    velocity: float


def integrate(
    system: Mechanism, start: Array, end: float, *, rtol: float = 1e-12, shorter: float = 1.0
) -> tuple[Array, list[Entry]]:
    """State at time ``end`` from (2n,) displacements and velocities at time 0, and the contacts.

    shorter : how many times shorter than usual the steps are, for contacts in quick succession.
    """
    t, y = 0.0, np.array(start, dtype=float)
    past = [[d > 0.0 for d in row] for row in system.distances(t, y)]
    entries: list[Entry] = []
    step = min(2.0 * math.pi / system.omega / 40.0, 0.3 / system.fastest()) / shorter
    while t < end:
        places = [(i, k) for i, gap in enumerate(system.gaps) for k in range(len(gap.thresholds))]
        run = solve_ivp(
            lambda at, s: system.rates(at, s, past),
            (t, end),
            y,
            "DOP853",
            events=[_event(system, i, k, past) for i, k in places] or None,
            rtol=rtol,
            atol=1e-14,
            max_step=step,  # or two crossings between steps go unseen
        )
        assert run.success
        t, y = float(run.t[-1]), run.y[:, -1]
        if run.status != 1:
            break
        for (i, k), times in zip(places, run.t_events or (), strict=True):
            if not len(times):
                continue
            past[i][k] = not past[i][k]
            side, number, *_ = system.gaps[i].thresholds[k]
            if past[i][k] and number == 0:
                entries.append(Entry(t, i, side, system.in_gap(system.gaps[i], t, y)[1]))
    return y, entries


def _event(
    system: Mechanism, gap: int, spring: int, past: list[list[bool]]
) -> Callable[[float, Array], float]:
    def event(t: float, y: Array) -> float:
        return system.distances(t, y)[gap][spring]

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = -1.0 if past[gap][spring] else 1.0  # type: ignore[attr-defined]
    return event
