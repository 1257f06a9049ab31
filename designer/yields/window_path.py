"""The window of a response in the generator's settings, followed from the nominal board to another.

A window may be a thousandth of the bands, too little to be met by trying. So the nominal board is
turned into the other one along the straight line between them, and the wanted orbit is followed by
shooting. At each step the setting moves to the middle of what the functions that end the orbit
(``dynamics.continued_orbit``), linearised, leave within the bands: the largest ball on which all
are positive, its radius in half-bands (the Chebyshev centre, a linear program). Shooting goes on
where the orbit leaves its window, and the next program leads back. Windows need not be convex: a
path finds one of them, if any.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from designer.base.arrays import Array
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import Ensemble
from designer.circuit.reduction import FloatingCircuit
from designer.dynamics.continued_orbit import ContinuedOrbit, Function, follow, functions, valleys
from designer.dynamics.flow import Flow
from designer.model.tuning_bands import Bands
from designer.spread.board_quantities import between
from designer.verdicts.verdict import Question
from designer.yields.adjustment import Adjustment, widths

PROBE = 0.01
"""Of a half-band, and of the way: the step of a difference quotient."""
STRIDE, SHORTEST = 1.0 / 8.0, 1.0 / 64.0
"""Of the way: the first and longest step, and the shortest."""
REACH = 2.0
"""Of the deepest contact: extremes farther from a stop have no say."""
MOVE, FINE, FINEST = 0.2, 0.1, 0.005
"""Half-bands: how far the setting moves in a longest step, on the board itself at first, and where
moving ends."""
ROAMING = 8
"""Steps of the first kind on the board itself."""
MOST_FOLLOWED = 150
"""Orbits that one path follows, at most."""
RESERVE = 24
"""More than one step and what follows it need: with fewer left a path ends."""


@dataclass(frozen=True)
class PathSetting:
    """A setting on a path."""

    setting: Adjustment
    """The setting, as changes of the generator."""
    radius: float
    """Radius, in half-bands, of the ball about it on which the linearised functions stay positive;
    negative outside of the window; -inf where the path ended on the way to the board."""


@dataclass(frozen=True)
class _Point:
    """share of the way and setting (3,) in half-bands, the orbit there, and the functions with
    their values (k,)."""

    share: float
    setting: Array
    orbit: ContinuedOrbit
    wanted: tuple[Function, ...]
    values: Array


@dataclass(frozen=True)
class _Slopes:
    """By the three settings, in half-bands, and the share of the way: of the functions (k, 4), and
    of the orbit's start (4, states)."""

    values: Array
    start: Array


def find_window(
    board: Boards,
    question: Question,
    bands: Bands,
    first: float = 0.0,
    *,
    tied: bool = True,
) -> tuple[list[PathSetting], int]:
    """Follow the question's orbit to a board (``Boards`` of one): the settings met on the board
    itself, in order, or the one where the path ended on the way; and how many orbits were followed.

    first : half-bands of DC offset at which the path sets out on the nominal board. Where a window
    lies on either side of the symmetric setting, it says to which one the path goes. tied : where
    a step of the board must be shortened, the setting moves less with it; else it may still go as
    far. Neither leads into every window that the other does.
    """
    path = _Path(board, question, bands)
    return path.walk(first, tied), path.followed


class _Path:
    def __init__(self, board: Boards, question: Question, bands: Bands) -> None:
        self.board, self.question, self.bands = board, question, bands
        self.widths = widths(bands)
        self.followed = 0
        self._reduced = (np.nan, Ensemble(board, fast=False))

    def walk(self, first: float, tied: bool) -> list[PathSetting]:
        nominal = self.question.start
        orbit = self._orbit(0.0, np.zeros(3), nominal.start) if nominal.n else None
        if orbit is None:
            return []
        wanted = _near((*functions(orbit, symmetric=False), *valleys(orbit)))
        current = _Point(0.0, np.zeros(3), orbit, wanted, _values(orbit, wanted))
        still = _Slopes(np.zeros((len(wanted), 4)), np.zeros((4, len(orbit.start))))
        current = self._at(current, still, 0.0, np.array([0.0, 0.0, first])) or current
        stride = STRIDE
        while current.share < 1.0 and self._may_go_on:
            slopes, ahead = self._slopes(current), min(stride, 1.0 - current.share)
            there = None
            while there is None and ahead >= SHORTEST:
                # A valley that closes on the way may open again: only at its end it has a say.
                trust = MOVE * (ahead / STRIDE if tied else 1.0)
                move = self._centre(current, slopes, ahead, trust, without="valley")
                lenient = ahead == SHORTEST
                there = self._at(current, slopes, ahead, move, lenient=lenient)
                ahead *= 0.5
            if there is None:
                break
            stride, current = min(4.0 * ahead, STRIDE), there
        if current.share < 1.0:
            return [PathSetting(self._adjustment(current.setting), -np.inf)]
        return self._centred(current)

    def _centred(self, current: _Point) -> list[PathSetting]:
        """From this point on the board itself to the middle of the window.

        Steps of one length at first, whatever they lead to: the functions have kinks where two
        contacts meet, and a climb would stop there. Then a climb from the best.
        """
        points: list[tuple[float, Adjustment, _Point, _Slopes]] = []

        def arrive(at: _Point) -> float:
            slopes = self._slopes(at)
            radius = _radius(at.values, slopes.values)
            points.append((radius, self._adjustment(at.setting), at, slopes))
            return radius

        arrive(current)
        for _ in range(ROAMING):
            _, _, at, slopes = points[-1]
            there = self._at(at, slopes, 0.0, self._centre(at, slopes, 0.0, FINE))
            if there is None or not self._may_go_on:
                break
            arrive(there)
        best = max(range(len(points)), key=lambda k: points[k][0])
        radius, _, current, slopes = points[best]
        trust = 0.5 * FINE
        while trust >= FINEST and self._may_go_on:
            there = self._at(current, slopes, 0.0, self._centre(current, slopes, 0.0, trust))
            if there is None or arrive(there) <= radius:
                trust *= 0.5
                continue
            radius, _, current, slopes = points[-1]
        return [PathSetting(setting, radius) for radius, setting, _, _ in points]

    @property
    def _may_go_on(self) -> bool:
        return self.followed + RESERVE <= MOST_FOLLOWED

    def _at(
        self, current: _Point, slopes: _Slopes, ahead: float, move: Array, *, lenient: bool = False
    ) -> _Point | None:
        """The orbit followed to there; None where it is lost, or one of its moved is.

        lenient : go on without the moved that are lost.
        """
        setting = np.clip(current.setting + move, -1.0, 1.0)
        change = np.append(setting - current.setting, ahead)
        near = current.orbit.start + change @ slopes.start
        orbit = self._orbit(current.share + ahead, setting, near)
        if orbit is None:
            return None
        values = _values(orbit, current.wanted)
        there = np.isfinite(values)
        if not (there.all() or (lenient and there.any())):
            return None
        moved = [
            f.moved_to(orbit) for f, is_there in zip(current.wanted, there, strict=True) if is_there
        ]
        return _Point(current.share + ahead, setting, orbit, tuple(moved), values[there])

    def _orbit(self, share: float, setting: Array, near: Array) -> ContinuedOrbit | None:
        self.followed += 1
        try:
            if self._reduced[0] != share:
                moved = between(self.board, np.array([share]))
                self._reduced = (share, Ensemble(moved, fast=False))
            system = self._reduced[1].reduction(0).system()
            drive = self._adjustment(setting).of(self.question.excitation).drive
            return follow(Flow(system, drive), near, self.question.start.n)
        except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError):
            return None

    def _adjustment(self, setting: Array) -> Adjustment:
        return Adjustment.at(setting * self.widths, self.bands)

    def _slopes(self, current: _Point) -> _Slopes:
        """Difference quotients; 0 where there is none."""
        values, start = np.zeros((len(current.wanted), 4)), np.zeros((4, len(current.orbit.start)))
        for k in range(4):
            if current.share == 1.0 if k == 3 else self.widths[k] == 0.0:
                continue
            for step in (PROBE, -PROBE):
                to = np.append(current.setting, current.share)
                to[k] += step
                if abs(to[k]) > 1.0:
                    continue
                orbit = self._orbit(float(to[3]), to[:3], current.orbit.start)
                if orbit is not None:
                    change = _values(orbit, current.wanted) - current.values
                    values[:, k] = np.nan_to_num(change / step)
                    start[k] = (orbit.start - current.orbit.start) / step
                    break
        return _Slopes(values, start)

    def _centre(
        self, current: _Point, slopes: _Slopes, ahead: float, trust: float, without: str = ""
    ) -> Array:
        """(3,) move to the middle of what is left when the board has moved ``ahead``.

        without : a kind of function that has no say.
        """
        values, size = current.values + ahead * slopes.values[:, 3], _size(slopes.values)
        used = np.array([f.kind != without for f in current.wanted]) & (size > 0.0)
        rows = np.column_stack([-slopes.values[used, :3], size[used]])
        low = np.maximum(-1.0 - current.setting, -trust)
        high = np.minimum(1.0 - current.setting, trust)
        box = [*zip(low, high, strict=True), (None, 1.0)]
        program = linprog([0.0, 0.0, 0.0, -1.0], rows, values[used], bounds=box)
        return np.zeros(3) if program.x is None else np.asarray(program.x[:3])


def _near(every: Sequence[Function]) -> tuple[Function, ...]:
    """Without the extremes that are far from their stop, such as those beyond the other one."""
    deepest = max((f.value for f in every if f.kind == "contact"), default=np.inf)
    return tuple(f for f in every if f.extreme is None or f.value < REACH * deepest)


def _values(orbit: ContinuedOrbit, wanted: Sequence[Function]) -> Array:
    """(k,) of these functions on an orbit; nan where one is not found."""
    return np.array([np.nan if (value := f.on(orbit)) is None else value for f in wanted])


def _size(slopes: Array) -> Array:
    return np.asarray(np.linalg.norm(slopes[:, :3], axis=1))


def _radius(values: Array, slopes: Array) -> float:
    """Half-bands, of the ball on which the linearised functions are positive; at most 1."""
    size = _size(slopes)
    return float((values[size > 0.0] / size[size > 0.0]).min(initial=1.0))
