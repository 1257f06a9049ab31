"""Exact flow of a piecewise-linear system under a periodic drive.

The general engine: any number of states and modes, constant terms, guards that see the drive. Each
step is a matrix exponential; boundaries are found to rounding error and grazing ones are proved
absent or found (see ``kernels.kernel_general``). Four states with one stop pair take the modal
fast path (``dynamics.modal_tables``) where only strobes, impact counts and tangents are asked for;
every other system of few states, and a circuit that keeps to its working modes, takes that of
``kernels.kernel_propagators``. A drive with harmonics is the general kernel's alone, unless its
waves are asked to be states of that path.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array, Index
from designer.base.errors import InputError
from designer.base.threads import heed
from designer.dynamics import modal_tables, mode_tables, working_modes
from designer.dynamics.drive_shape import SINE
from designer.dynamics.drive_states import with_drive_states
from designer.dynamics.flow_result import FlowResult, FlowStatus, Impacts
from designer.dynamics.piecewise_linear import Drive, ModeKey, PiecewiseLinearSystem
from designer.dynamics.step_budget import Budget
from designer.dynamics.working_modes import MOST_STATES, TabulatedModes
from designer.kernels import (
    kernel_general as kernel,
    kernel_modal,
    kernel_orbit,
    kernel_propagators,
)
from designer.kernels.kernel_general import Log, ModeTables
from designer.kernels.kernel_modal import ModalTables
from designer.kernels.kernel_propagators import RunTrail

MAX_EVENTS = 10_000
"""Mode changes in one drive period past which the flow stops: chattering ends with a status."""


CHUNK = 500
"""Periods between two looks at ``interrupt``: some 10 to 100 ms of compiled work."""
SLICE = 5_000_000
"""Steps between two looks at it, where a period has many: half a second."""
FAST_STEP, FAST_PERIOD, FAST_IMPACT = 0.15, 10.0, 10.0
"""What a step, a period and an impact of the fast paths cost, in steps of the general kernel."""


class Flow:
    """The flow of one system under one drive; keeps the tables of the modes it has met. It is for
    one thread at a time.

    fast : take a fast path where one fits; False: always the general kernel. waves : the tabulated
    one too under a drive with further waves, which are states then. It is compiled for each number
    of states, which takes longer than most models run for.

    Raises
    ------
    ValueError : other waves than the drive's for a drive that is no sine itself.
    """

    def __init__(
        self,
        system: PiecewiseLinearSystem,
        drive: Drive,
        *,
        fast: bool = True,
        waves: bool = False,
    ) -> None:
        if system.orders is not None and not drive.is_sine:
            raise ValueError("waves beside a drive that is no sine")
        if system.mirror is not None and any(order % 2 == 0 for order in drive.orders):
            # Half a period later the drive is not its own negative.
            system = replace(system, mirror=None)
        self.system = system
        self.drive = drive
        self.orders = system.orders or drive.orders
        self._waves: tuple[int, ...] = ()
        self._modal: ModalTables | None = None
        self._tabulated: TabulatedModes | None = None
        if fast and drive.is_sine and not self.orders:
            self._modal = None if system.working else modal_tables.tables(system, drive)
            if self._modal is None and system.size <= MOST_STATES:
                self._tabulated = TabulatedModes(system, drive)
        elif fast and waves and system.size + 2 * len(self.orders) + 2 <= MOST_STATES:
            self._waves = (1, *self.orders)
            rest = replace(drive, amplitude=0.0, shape=SINE, second=None)
            self._tabulated = TabulatedModes(with_drive_states(system, drive), rest)
        self._index: dict[ModeKey, int] = {}
        self._keys: list[ModeKey] = []
        rows = zip(system.displacement, system.state_in, strict=True)
        self._watched = [row for row, state in rows if state is None]
        self._tables = self._room(4, 2)
        self._budget: Budget | None = None

    @contextmanager
    def within(self, budget: Budget) -> Iterator[Budget]:
        """What is run inside takes its steps from this budget (and none from one outside it); with
        nothing left a run ends with the status TOO_LONG."""
        outer, self._budget = self._budget, budget
        try:
            yield budget
        finally:
            self._budget = outer

    @cached_property
    def steps_a_period(self) -> float:
        """Steps that the general kernel takes for one drive period in the mode of rest; more where
        a contact is stiffer."""
        A = self.system.mode(self.system.start).A
        return self.drive.period / mode_tables.step_length(A, self.fastest)

    @property
    def fastest(self) -> float:
        """Angular frequency of the fastest wave that acts."""
        return self.drive.omega * max(self.orders, default=1)

    @property
    def met(self) -> list[ModeKey]:
        """Modes that the runs so far have entered; none of the modal fast path."""
        more = [] if self._tabulated is None else self._tabulated.targets.keys
        return list(dict.fromkeys([*more, *self._keys]))

    @property
    def kernel(self) -> str:
        """Which kernel carries it as long as all is usual: "modal", "tabulated" ("circuit" for one
        that keeps to its working modes) or "general"."""
        if self._modal is not None:
            return "modal"
        if self._tabulated is None:
            return "general"
        return "circuit" if self.system.working else "tabulated"

    def run(
        self,
        x: Array,
        periods: int,
        *,
        mode: ModeKey | None = None,
        tangent: Array | None = None,
        measure: bool = False,
        points: int = 1,
        stretches: int | None = None,
        max_events: int = MAX_EVENTS,
    ) -> FlowResult:
        """Start at a strobe (drive phase 0) in state x (n,) and run for ``periods`` periods.

        points : strobes per period; more than one gives a dense trace, as exact as the strobe.
        stretches : stop after so many of the ``periods · points`` stretches.
        tangent : (n, k) vectors to be carried by the linearised flow.
        measure : also log impacts and refine extremes, at about three times the cost.

        Raises
        ------
        InputError : no period, no point, or a state of the wrong shape or not finite.
        KeyboardInterrupt : ``interrupt`` was set by another thread.
        """
        x = np.array(x, dtype=float)
        _check(x, self.system.size, periods, points)
        key = self.mode_at(x, 0.0, mode)
        stretches = periods * points if stretches is None else stretches
        phi = np.zeros((0, 0)) if tangent is None else np.array(tangent, dtype=float, order="C")
        plain = points == 1 and not measure and stretches == periods
        # The fast paths stop at strobes alone; the general one pauses inside a period.
        short = FAST_PERIOD + FAST_STEP * self.steps_a_period <= SLICE
        modal = short and plain and (self.system.continuous or not phi.size)
        if self._modal is not None and modal:
            return self._run_modal(self._modal, x, periods, key, phi, max_events)
        room = 8 + 16 * periods if measure else 0
        if short and self._tabulated is not None and self._tabulated.targets.may_enter(key):
            result = self._run_tabulated(
                self._tabulated,
                x,
                stretches,
                points,
                key,
                phi,
                max_events,
                room,
                measure=measure,
            )
            if result is not None:
                return result
        return self._run_general(x, stretches, points, key, phi, max_events, room, measure=measure)

    def mode_at(self, x: Array, phase: float, near: ModeKey | None = None) -> ModeKey:
        """Key of the mode that holds at state x (n,) and drive phase ``phase`` [rad]; as of
        ``PiecewiseLinearSystem.mode_at``."""
        angle = np.array([phase])
        u, second_drive = float(self.drive.at(angle)[0]), float(self.drive.second_at(angle)[0])
        return self.system.mode_at(x, u, near, second_drive=second_drive)

    def to_strobe(self, x: Array, phase: float) -> FlowResult:
        """Start in state x (n,) at drive phase ``phase`` [rad] and run to the next strobe; by the
        general kernel.

        Raises
        ------
        InputError, KeyboardInterrupt : as ``run``; ArithmeticError : no mode holds at the start.
        """
        x = np.array(x, dtype=float)
        _check(x, self.system.size, 1, 1)
        key, nothing = self.mode_at(x, phase), np.zeros((0, 0))
        return self._run_general(
            x, 1, 1, key, nothing, MAX_EVENTS, 0, measure=False, phase=phase % (2.0 * np.pi)
        )

    def _run_general(
        self,
        x: Array,
        stretches: int,
        points: int,
        key: ModeKey,
        phi: Array,
        max_events: int,
        room: int,
        *,
        measure: bool,
        phase: float = 0.0,
    ) -> FlowResult:
        """The run by the general kernel, which builds modes as it meets them. phase : of the drive
        at the start."""
        z, before = mode_tables.augmented_state(x, phase, self.orders), phi.copy()
        clock, budget = np.array([phase / self.drive.omega, 0.0, 0.0]), self._budget or Budget()
        cursor = np.array([0, self._number(key), 0, 0], dtype=np.int64)
        log = self._log(x, stretches, room)
        # A contact that was already running has an unknown deepest point so far.
        depth = np.array([np.inf if side else 0.0 for side in self.system.mode(key).sides])
        code = kernel_orbit.DONE
        while cursor[0] < stretches:
            heed()
            given = clock[2] = max(min(float(SLICE), budget.left), 0.0)
            code = kernel.advance(
                self._tables,
                z,
                clock,
                cursor,
                self.drive.period / points,
                working_modes.anchors(points, self.orders),
                phi,
                depth,
                max_events,
                min(int(cursor[0]) + CHUNK * points, stretches),
                measure,
                not self.system.continuous,
                log,
            )
            budget.take(given - float(clock[2]))
            if code == kernel_orbit.UNKNOWN_MODE:
                self._link(int(cursor[1]), int(cursor[3]))
            elif code == kernel_orbit.PAUSED and budget.left > 0.0:
                continue
            elif code != kernel_orbit.DONE:
                break
        met = int(clock[1])
        if measure and met > room:  # more impacts than room: again, with room for all
            return self._run_general(
                x, stretches, points, key, before, max_events, met, measure=True, phase=phase
            )
        return self._result(code, log, int(cursor[0]), met, self._keys[int(cursor[1])], phi)

    def _run_modal(
        self,
        tables: ModalTables,
        x: Array,
        periods: int,
        key: ModeKey,
        phi: Array,
        max_events: int,
    ) -> FlowResult:
        """The run by the fast path: no impact log, no extremes."""
        keys = modal_tables.keys(self.system)
        cursor = np.array([keys.index(key), 0], dtype=np.int64)
        log = self._log(x, periods, 0)

        def advance(part: slice, start: Array) -> int:
            strobes, counts = log.strobes[part.start : part.stop + 1], log.impacts[part, 0]
            return kernel_modal.advance(
                tables, start, cursor, self.drive.period, phi, max_events, strobes, counts
            )

        code, done = self._in_chunks(advance, log, cursor, self._chunk(), 1)
        return self._result(code, log, done, 0, keys[int(cursor[0])], phi)

    def _run_tabulated(
        self,
        modes: TabulatedModes,
        x: Array,
        stretches: int,
        points: int,
        key: ModeKey,
        phi: Array,
        max_events: int,
        room: int,
        *,
        measure: bool,
    ) -> FlowResult | None:
        """The run by the tabulated fast path; None where it leaves the working modes."""
        try:
            cursor = np.array([modes.number(key), 0, measure, 0], dtype=np.int64)
        except ArithmeticError:
            return None
        more = 2 * len(self._waves)  # at a strobe each has a sine of 0 and a cosine of 1
        driven = np.concatenate([x, np.arange(more) % 2])
        phi = np.concatenate([phi, np.zeros((more if phi.size else 0, phi.shape[1]))])
        log, met = self._log(driven, stretches, room), np.zeros(1, dtype=np.int64)
        undecided = np.zeros(1)
        trail = RunTrail(log.extremes, log.graze, undecided, log.when, log.at, log.stop, met)
        anchor = working_modes.anchors(points, self._waves)

        def advance(part: slice, start: Array) -> int:
            strobes = log.strobes[part.start : part.stop + 1]
            counts = log.impacts[part].reshape(len(strobes) - 1, -1)
            begin, before = cursor.copy(), phi.copy()
            while True:
                code = kernel_propagators.advance(
                    modes.limited(max_events),
                    start,
                    cursor,
                    self.drive.period,
                    anchor,
                    phi,
                    strobes,
                    counts,
                    trail,
                )
                if code != kernel_orbit.UNKNOWN_MODE:
                    return code
                try:
                    modes.enter(int(cursor[0]), int(cursor[3]))
                except ArithmeticError:
                    return kernel_orbit.LEFT
                # From the start of the part again, now with this mode.
                cursor[:], phi[:], counts[:], met[0], undecided[0] = begin, before, 0, 0, 0.0
                log.extremes[:], log.graze[:] = [np.inf, -np.inf], np.inf

        chunk = stretches if measure else self._chunk() * points
        before = phi[: len(x)].copy()
        code, done = self._in_chunks(advance, log, cursor, chunk, points)
        if code == kernel_orbit.LEFT:
            if not modes.look_closely():
                return None
            return self._run_tabulated(
                modes, x, stretches, points, key, before, max_events, room, measure=measure
            )
        if met[0] > room and measure:  # more impacts than room: again, with room for all
            return self._run_tabulated(
                modes, x, stretches, points, key, before, max_events, int(met[0]), measure=True
            )
        if measure:
            log.tangencies[0] = int(undecided[0])
        else:
            log.graze[:] = np.inf
        if more:
            n = len(x)
            log = log._replace(
                strobes=log.strobes[:, :n].copy(),
                at=log.at[:, :n],
                extremes=np.delete(log.extremes, np.s_[n : n + more], axis=0),
            )
            phi = phi[:n]
        return self._result(code, log, done, int(met[0]), modes.targets.keys[int(cursor[0])], phi)

    def _log(self, x: Array, stretches: int, room: int) -> Log:
        """Room for what a run from x (n,) writes; the fast paths write a part of it."""
        n, c = len(x), len(self.system.clearances)
        log = Log(
            strobes=np.empty((stretches + 1, n)),
            impacts=np.zeros((stretches, c, 2), dtype=np.int64),
            when=np.empty(room),
            at=np.empty((room, n)),
            stop=np.zeros((room, 2), dtype=np.int64),
            extremes=np.tile([np.inf, -np.inf], (n + len(self._watched), 1)),
            graze=np.full((c, 2), np.inf),
            tangencies=np.zeros(1, dtype=np.int64),
            clipped=np.zeros(1),
        )
        log.strobes[0] = x
        return log

    def _in_chunks(
        self,
        advance: Callable[[slice, Array], int],
        log: Log,
        cursor: Index,
        chunk: int,
        points: int,
    ) -> tuple[int, int]:
        """Run a fast path to the end of the log; its code, and the stretches done."""
        budget, done, code = self._budget or Budget(), 0, kernel_orbit.DONE
        while done < len(log.impacts) and code == kernel_orbit.DONE:
            heed()
            if budget.left <= 0.0:
                return kernel_orbit.PAUSED, done
            part = slice(done, min(done + chunk, len(log.impacts)))
            code = advance(part, log.strobes[done].copy())
            if code == kernel_orbit.LEFT:
                break
            self._charge(budget, log.impacts[done : done + int(cursor[1])], points)
            done += int(cursor[1])
        return code, done

    def _chunk(self) -> int:
        """Periods of a fast path between two looks at ``interrupt`` and the budget."""
        periods = SLICE / (FAST_PERIOD + FAST_STEP * self.steps_a_period)
        return max(1, min(CHUNK, int(periods)))

    def _charge(self, budget: Budget, counts: NDArray[np.int64], points: int = 1) -> None:
        """Take from the budget what a fast path ran; counts : impacts, a row a stretch."""
        a_period = FAST_PERIOD + FAST_STEP * self.steps_a_period
        budget.take(len(counts) / points * a_period + FAST_IMPACT * float(counts.sum()))

    def _result(
        self, code: int, log: Log, done: int, met: int, mode: ModeKey, phi: Array
    ) -> FlowResult:
        """done : stretches; met : impacts in the log; phi : tangent vectors, (0, 0) for none."""
        return FlowResult(
            status=_STATUS[code],
            strobes=log.strobes[: done + 1],
            counts=log.impacts[:done],
            mode=mode,
            tangent=phi if phi.size else None,
            impacts=self._impacts(log, met),
            extremes=log.extremes[: self.system.size],
            spans=self._spans(log.extremes),
            graze=log.graze,
            tangencies=int(log.tangencies[0]),
            clipped_time=float(log.clipped[0]),
        )

    def _impacts(self, log: Log, met: int) -> Impacts:
        """The impacts in the log, with their velocities."""
        when, at, stop = log.when[:met], log.at[:met], log.stop[:met]
        velocity = np.zeros(0)
        if met:
            rates = np.column_stack([at, self.drive.rate_at(self.drive.omega * when)])
            velocity = (rates * np.array(self.system.velocity)[stop[:, 0]]).sum(axis=1)
        return Impacts(when, stop[:, 0], stop[:, 1], velocity, at)

    def _spans(self, extremes: Array) -> Array:
        """(clearances, 2) extremes of the displacements among what was watched."""
        further = iter(range(self.system.size, len(extremes)))
        rows = [next(further) if j is None else j for j in self.system.state_in]
        return extremes[rows] if rows else np.zeros((0, 2))

    def _number(self, key: ModeKey) -> int:
        """Index of the mode in the tables, which are filled on its first use, and linked to those
        beside it that are known."""
        known = self._index.get(key)
        if known is not None:
            return known
        number = len(self._keys)
        mode = self.system.mode(key)
        rows, guards = len(self._tables.step), len(mode.guards)
        if number >= rows or guards > self._tables.guard.shape[1]:
            room = self._room(max(rows, 2 * (number + 1)), max(guards, self._tables.guard.shape[1]))
            for new, old in zip(room, self._tables, strict=True):
                new[tuple(slice(0, s) for s in old.shape)] = old
            self._tables = room
        touched = [
            self.system.contact_rows(j)[side] if side else None for j, side in enumerate(mode.sides)
        ]
        mode_tables.fill(
            self._tables, number, mode, touched, self._watched, self.drive, self.orders
        )
        self._index[key] = number
        self._keys.append(key)
        for g, guard in enumerate(mode.guards):
            other = self._index.get(guard.target, -1)
            self._tables.target[number, g] = other
            beyond = self.system.mode(guard.target).guards if other >= 0 else ()
            for h, back in enumerate(beyond):
                if back.target == key:
                    self._tables.target[other, h] = number
        return number

    def _room(self, modes: int, guards: int) -> ModeTables:
        """Empty tables for so many modes with so many guards each."""
        clearances, watched = len(self.system.clearances), len(self._watched)
        width = self.system.size + 3 + 2 * len(self.orders)
        return mode_tables.empty_tables(modes, guards, width, clearances, watched)

    def _link(self, number: int, guard: int) -> None:
        """Give a guard its target, building the mode if it is new."""
        target = self._number(self.system.mode(self._keys[number]).guards[guard].target)
        self._tables.target[number, guard] = target


def _check(x: Array, size: int, periods: int, points: int) -> None:
    if x.shape != (size,) or not np.all(np.isfinite(x)):
        raise InputError(None, "state", np.array2string(x), f"{size} finite numbers")
    for name, value in (("periods", periods), ("points", points)):
        if value < 1:
            raise InputError(None, name, value, "at least 1")


_STATUS = {
    kernel_orbit.DONE: FlowStatus.DONE,
    kernel_orbit.TOO_MANY_EVENTS: FlowStatus.CHATTER,
    kernel_orbit.DIVERGED: FlowStatus.DIVERGED,
    kernel_orbit.PAUSED: FlowStatus.TOO_LONG,
}
