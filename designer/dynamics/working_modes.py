"""Modes as the tabulated fast path takes them: of one system, added as the flow enters them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.piecewise_linear import Drive, Mode, ModeKey, PiecewiseLinearSystem
from designer.kernels import kernel_mode_tables as kernel
from designer.kernels.kernel_boards import POINTS, Anchors

MOST_STATES = 12
"""States up to which the fast path is compiled: beyond, its tables are too large for the cache of a
processor."""


@lru_cache(maxsize=32)
def anchors(points: int, orders: tuple[int, ...] = ()) -> Array:
    """(points, 2 + 2 h) sine and cosine of the drive, then of each harmonic, at the start of each
    stretch of a period; kept."""
    phases = 2.0 * np.pi * np.arange(points) / points
    return np.stack([f(n * phases) for n in (1, *orders) for f in (np.sin, np.cos)], axis=1)


ANCHORS = Anchors(anchors(1), anchors(32), anchors(POINTS))


def empty_modes(
    boards: int, modes: int, states: int, clearances: int, guards: int, watched: Sequence[int]
) -> kernel.Modes:
    """Room for so many boards, modes, states, clearances and guards of a mode; no mode is good.

    watched : the clearances whose displacement is not a state.
    """
    n = states
    return kernel.Modes(
        A=np.zeros((boards, modes, n, n)),
        B=np.zeros((boards, modes, n)),
        quadrature=np.zeros((boards, modes, n)),
        d=np.zeros((boards, modes, n)),
        guard=np.zeros((boards, modes, guards, n + 2)),
        past=np.zeros((boards, modes, clearances, n + 2)),
        displacement=np.zeros((boards, clearances, n + 2)),
        velocity=np.zeros((boards, clearances, n + 1)),
        watched=np.array(watched, dtype=np.int64),
        good=np.zeros((boards, modes), dtype=np.int64),
        target=np.full((modes, guards), kernel.FAR, dtype=np.int64),
        clearance=np.full((modes, guards), -1, dtype=np.int64),
        guards=np.zeros(modes, dtype=np.int64),
        side=np.zeros((modes, clearances), dtype=np.int64),
    )


def grown(modes: kernel.Modes, count: int, guards: int) -> kernel.Modes:
    """The same with room for ``count`` modes of as many guards."""
    boards, _, clearances, wide = modes.past.shape
    most = max(guards, modes.guard.shape[2])
    out = empty_modes(boards, count, wide - 2, clearances, most, modes.watched.tolist())
    for new, old in zip(out, modes, strict=True):
        new[tuple(slice(0, size) for size in old.shape)] = old
    return out


def drive_of(drive: Drive, max_events: int) -> Array:
    """(4,) as ``kernel.DrivenModes`` has it."""
    return np.array([drive.omega, drive.amplitude, drive.offset, float(max_events)])


def driven(
    modes: kernel.Modes, drive: Array, *, leaps: bool = False, closely: bool = False
) -> kernel.DrivenModes:
    """The first board's modes under a drive (4,), without tables yet. leaps, closely : as of
    ``kernel.DrivenModes``."""
    columns, counts, far = kernel.widths(modes)
    number = len(modes.guards)
    return kernel.DrivenModes(
        modes=modes,
        board=0,
        drive=drive,
        data=np.zeros(kernel.TABLES + number * columns),
        ints=np.zeros((number, counts), dtype=np.int64),
        width=columns,
        far=far,
        leaps=leaps,
        closely=closely,
        unit=(0.0,) * modes.A.shape[-1],
    )


class GuardTargets:
    """What stands beyond the guards of some modes: which are known by number, and how the others
    are marked.

    working : keys of the modes that may be entered; () for all.
    """

    def __init__(self, working: Iterable[ModeKey]) -> None:
        self.numbers: dict[ModeKey, int] = {}
        self.keys: list[ModeKey] = []
        self._working = frozenset(working)
        self._beyond: list[list[ModeKey]] = []
        self._guards_of: dict[ModeKey, list[tuple[int, int]]] | None = None

    def copy(self) -> GuardTargets:
        """The same, to which modes may be added apart from these."""
        out = GuardTargets(self._working)
        out.numbers, out.keys = dict(self.numbers), list(self.keys)
        out._beyond = list(self._beyond)
        return out

    def may_enter(self, key: ModeKey) -> bool:
        """Whether a mode is one of the working ones."""
        return not self._working or key in self._working

    def add(self, modes: kernel.Modes, key: ModeKey, beyond: list[ModeKey]) -> int:
        """Give the next mode its key and the keys beyond its guards; its number."""
        guards_of = self._before()
        number = self.numbers[key] = len(self.keys)
        self.keys.append(key)
        self._beyond.append(beyond)
        modes.guards[number] = len(beyond)
        for g, target in enumerate(beyond):
            guards_of.setdefault(target, []).append((number, g))
            unknown = kernel.UNBUILT if self.may_enter(target) else kernel.FAR
            modes.target[number, g] = self.numbers.get(target, unknown)
        for m, g in guards_of.get(key, ()):
            modes.target[m, g] = number
        return number

    def _before(self) -> dict[ModeKey, list[tuple[int, int]]]:
        """The guards before each mode, known or not, as (number, guard); listed on first use, for
        most copies get no mode."""
        if self._guards_of is None:
            self._guards_of = {}
            for m, targets in enumerate(self._beyond):
                for g, target in enumerate(targets):
                    self._guards_of.setdefault(target, []).append((m, g))
        return self._guards_of

    def beyond(self, number: int, guard: int) -> ModeKey:
        """Key of the mode beyond a guard."""
        return self._beyond[number][guard]


class TabulatedModes:
    """The modes of one system under one drive, with the tables of those that were entered."""

    def __init__(self, system: PiecewiseLinearSystem, drive: Drive) -> None:
        self._system = system
        self._drive = drive_of(drive, 0)
        self.targets = GuardTargets(system.working)
        count = len(system.clearances)
        watched = [c for c, state in enumerate(system.state_in) if state is None]
        self._modes = empty_modes(1, 1 + 2 * count, system.size, count, 2 * count, watched)
        for c in range(count):
            self._modes.displacement[0, c] = system.displacement[c]
            self._modes.velocity[0, c] = system.velocity[c]
        self.driven: kernel.DrivenModes | None = None
        self._closely = False

    def look_closely(self) -> bool:
        """Prove boundaries far step by step from now on; whether it was not so before."""
        before, self._closely = self._closely, True
        if self.driven is not None:
            self.driven = self.driven._replace(closely=True)
        return not before

    def limited(self, max_events: int) -> kernel.DrivenModes:
        """The driven modes, to be left after so many mode changes in a stretch."""
        if self.driven is None:
            leaps = not self._system.continuous
            self.driven = driven(self._modes, self._drive, leaps=leaps, closely=self._closely)
        self.driven.drive[3] = max_events
        return self.driven

    def number(self, key: ModeKey) -> int:
        """Number of a mode, which is added on its first use.

        Raises
        ------
        ArithmeticError : the mode cannot be built: with ideal op-amps nothing closes the loop
            between two diodes.
        """
        known = self.targets.numbers.get(key)
        return self._add(key) if known is None else known

    def enter(self, number: int, guard: int) -> None:
        """Add the mode beyond a guard; raises as ``number``."""
        self.number(self.targets.beyond(number, guard))

    def _add(self, key: ModeKey) -> int:
        mode, room = self._system.mode(key), len(self._modes.guards)
        number = len(self.targets.keys)
        if number == room or len(mode.guards) > self._modes.guard.shape[2]:
            self._modes = grown(self._modes, max(room, 2 * number), len(mode.guards))
        self.targets.add(self._modes, key, [guard.target for guard in mode.guards])
        self._write(number, mode)
        fits = self.driven is not None and self.driven.modes is self._modes
        if not fits or kernel.widths(self._modes)[:2] != _columns(self.driven):
            self.driven = None
        return number

    def _write(self, number: int, mode: Mode) -> None:
        out = self._modes
        out.A[0, number], out.B[0, number], out.d[0, number] = mode.A, mode.B, mode.d
        if mode.waves is not None:
            out.quadrature[0, number] = mode.waves[:, 0]
        out.good[0, number], out.side[number] = 1, mode.sides
        for c, side in enumerate(mode.sides):
            if side:
                out.past[0, number, c] = self._system.contact_rows(c)[side]
        for g, guard in enumerate(mode.guards):
            out.guard[0, number, g] = np.concatenate([guard.C, [guard.D, guard.e]])
            out.clearance[number, g] = guard.clearance


def _columns(driven_modes: kernel.DrivenModes | None) -> tuple[int, int]:
    """Columns of the tables and integers that there are."""
    if driven_modes is None:
        return 0, 0
    return driven_modes.width, driven_modes.ints.shape[1]
