"""The wanted orbit of another board, by shooting, and what is smooth and positive until it is lost.

Shooting goes on through a grazing and past the end of stability, where settling cannot. On the
followed orbit these are smooth in the board's parts, and the response is lost where the first
becomes negative:

- for each stop, every local maximum of the displacement past it, and every local minimum inside a
  contact, with the sign it has on the wanted orbit: the depth of a contact, the distance of a miss;
- with the monodromy matrix M and its multipliers μ: det(I + M) (period doubling), Π(1 - μi μj) over
  the pairs (torus), and det(I - M)·|det(I - M)| (fold: the square falls linearly towards it, and
  the sign is that of stability). The last is left out for a symmetric orbit, which may pass a
  pitchfork and keep its n-p-q.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.attractors import peaks_near, shoot
from designer.dynamics.flow import Flow

POINTS = 1024
"""Of a followed orbit per drive period; between them an extreme is a parabola's."""
SHIFT = 0.03
"""Of the drive period: how far an extreme may move between two boards and be the same."""
_STABILITY = {"doubling": "period doubling", "torus": "a torus", "fold": "a fold"}


@dataclass(frozen=True)
class Extreme:
    """An extreme of the displacement past a stop."""

    stop: tuple[int, int]
    """(clearance, side) of the stop."""
    top: bool
    """Whether it is a maximum."""
    time: float
    """Time in drive periods."""
    value: float
    """Value of the displacement past the stop [V]."""


@dataclass(frozen=True)
class ContinuedOrbit:
    """An orbit of ``periods`` drive periods: its extremes and functions of its multipliers."""

    extremes: tuple[Extreme, ...]
    """The extremes of the displacement past each stop."""
    stability: dict[str, float]
    """Functions of the multipliers by kind; positive while the orbit is stable."""
    periods: int
    """Drive periods until the orbit closes."""
    start: Array
    """(states,) start at a strobe."""


@dataclass(frozen=True)
class Function:
    """One way of losing the response, as found on a reference orbit."""

    kind: str
    """"contact", "miss", "parting", "doubling", "torus" or "fold"."""
    value: float
    """Value on the reference orbit, positive."""
    extreme: Extreme | None = None
    """The extreme that it is the value of; None where it is one of the multipliers."""
    place: tuple[int, int] = (0, 0)
    """Number of the extreme among those at the same stop, and how many these are."""

    @property
    def what(self) -> str:
        """ "contact 2 of 3 at the upper stop", "stability: a fold"."""
        if self.extreme is None:
            return f"stability: {_STABILITY[self.kind]}"
        stop = "upper stop" if self.extreme.stop[1] > 0 else "lower stop"
        if self.extreme.stop[0]:
            stop += f" of clearance {self.extreme.stop[0] + 1}"
        if self.kind == "parting":
            return f"parting inside a contact with the {stop}"
        return f"{self.kind} {self.place[0]} of {self.place[1]} at the {stop}"

    def on(self, orbit: ContinuedOrbit | None) -> float | None:
        """Its value on another orbit; None where it is not found there."""
        if orbit is None:
            return None
        if self.extreme is None:
            return orbit.stability[self.kind]
        same = self._same(orbit)
        if same is None:
            return None
        return same.value if self.extreme.value > 0.0 else -same.value

    def moved_to(self, orbit: ContinuedOrbit) -> Function:
        """The same function, to be looked for from this orbit on at its extreme's time there."""
        same = None if self.extreme is None else self._same(orbit)
        if self.extreme is None or same is None:
            return self
        return replace(self, extreme=replace(self.extreme, time=same.time))

    def _same(self, orbit: ContinuedOrbit) -> Extreme | None:
        """Its extreme on another orbit."""
        own, half = self.extreme, 0.5 * orbit.periods
        assert own is not None
        met = [
            (abs((e.time - own.time + half) % orbit.periods - half), e)
            for e in orbit.extremes
            if e.stop == own.stop and e.top == own.top
        ]
        away, same = min(met, key=lambda pair: pair[0], default=(np.inf, own))
        return None if away > SHIFT else same


def follow(flow: Flow, start: Array, periods: int) -> ContinuedOrbit | None:
    """The orbit of this period near a start (states,); None where shooting does not arrive."""
    shot = shoot(flow, start, periods, peak=peaks_near(flow, start))
    if shot is None:
        return None
    x, monodromy = shot
    return ContinuedOrbit(_extremes(flow, x, periods), _stability(monodromy), periods, x)


def functions(orbit: ContinuedOrbit, symmetric: bool) -> tuple[Function, ...]:
    """Every way of losing the response that is positive on this orbit."""
    out = []
    for e in orbit.extremes:
        alike = sorted(
            o.time
            for o in orbit.extremes
            if o.stop == e.stop and o.top == e.top and (o.value > 0.0) == (e.value > 0.0)
        )
        place = (1 + alike.index(e.time), len(alike))
        if e.top:
            out.append(Function("contact" if e.value > 0.0 else "miss", abs(e.value), e, place))
        elif e.value > 0.0:  # below zero it is the way back between two contacts
            out.append(Function("parting", e.value, e, place))
    for kind, value in orbit.stability.items():
        if value > 0.0 and not (kind == "fold" and symmetric):
            out.append(Function(kind, value))
    return tuple(out)


def valleys(orbit: ContinuedOrbit) -> tuple[Function, ...]:
    """How far the displacement falls back between two contacts: where one of these becomes
    negative, the two contacts are one."""
    return tuple(
        Function("valley", -e.value, e) for e in orbit.extremes if not e.top and e.value < 0.0
    )


def _stability(monodromy: Array) -> dict[str, float]:
    one = np.eye(len(monodromy))
    mu = np.linalg.eigvals(monodromy).astype(complex)
    pairs = np.triu_indices(len(mu), 1)
    fold = float(np.linalg.det(one - monodromy))
    return {
        "doubling": float(np.linalg.det(one + monodromy)),
        "torus": float(np.prod(1.0 - np.outer(mu, mu)[pairs]).real),
        "fold": fold * abs(fold),
    }


def _extremes(flow: Flow, x: Array, n: int) -> tuple[Extreme, ...]:
    """Every local extreme of the displacement past each stop over the n periods from x."""
    states = flow.run(x, n, points=POINTS).strobes[:-1]
    phase = 2.0 * np.pi * np.arange(n * POINTS) / POINTS
    drive = flow.drive.at(phase)
    out = []
    for j in range(len(flow.system.clearances)):
        for side, row in sorted(flow.system.contact_rows(j).items()):
            past = states @ row[:-2] + row[-2] * drive + row[-1]
            before, after = np.roll(past, 1), np.roll(past, -1)
            bend = before - 2.0 * past + after
            for top in (True, False):
                sign = 1.0 if top else -1.0
                at = (sign * past > sign * before) & (sign * past >= sign * after)
                for i in np.flatnonzero(at):
                    slope = 0.5 * (after[i] - before[i])
                    value = float(past[i] - 0.5 * slope**2 / bend[i])
                    time = (float(i) - float(slope / bend[i])) / POINTS
                    out.append(Extreme((j, side), top, time, value))
    return tuple(out)
