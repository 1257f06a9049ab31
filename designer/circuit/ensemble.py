"""The attractors of many boards of one circuit: what every study of yields is made of.

Boards are reduced together, and the usual way to an answer (settle, shoot, check) is compiled
(``dynamics.kernel_boards``). What is unusual on that way goes to ``dynamics.attractors.settle``,
which it must equal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.base.threads import heed, parallel
from designer.circuit import working_modes as working
from designer.circuit.board_arrays import Boards
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics import attractors, kernel_boards as kernel, kernel_mode_tables, working_modes
from designer.dynamics.flow import MAX_EVENTS, Flow, FlowResult
from designer.dynamics.kernel_orbit import CHAOS, FOUND
from designer.dynamics.orbit import Complex, Orbit, OrbitStatus, failed
from designer.dynamics.piecewise_linear import Drive, ModeKey

CHUNK = 32
"""Questions that one thread takes at a time; no answer depends on it."""
TOGETHER = 125
"""Boards that one thread reduces at a time: their matrices stay in the cache. Nor on this."""
FAINT = 5.0 * CHAOS
"""Growth of a tangent vector per drive period below which chaos is not plain."""


@dataclass(frozen=True)
class SettledBoard:
    """The steady response of a board."""

    orbit: Orbit
    """The orbit."""
    trace: Array
    """(n · POINTS,) displacement over the orbit's n drive periods; empty where none was drawn."""


class Ensemble:
    """N boards, reduced once each and asked as often as is wanted.

    fast : take the compiled way where it fits; False: ``attractors.settle`` of each board.
    jobs : threads that reduce.
    """

    def __init__(self, boards: Boards, *, fast: bool = True, jobs: int = 1) -> None:
        self.boards = boards
        self._fast = fast
        self._reductions: dict[int, Reduction] = {}
        self._modes: kernel_mode_tables.Modes | None = None
        self._good = np.zeros(len(boards), dtype=np.bool_)
        self._keys = working.working_keys(boards.circuit)
        if fast:
            self._modes, self._good = _reduced(boards, jobs)

    def __len__(self) -> int:
        return len(self.boards)

    def reduction(self, index: int) -> Reduction:
        """The exact reduction of one board."""
        known = self._reductions.get(index)
        if known is None:
            board = self.boards.board(index)
            known = self._reductions[index] = Reduction(self.boards.circuit, board)
        return known

    def settle(
        self,
        which: Sequence[int],
        drives: Sequence[Drive],
        starts: Array,
        *,
        jobs: int = 1,
        progress: Callable[[], None] = lambda: None,
    ) -> list[Orbit]:
        """The attractor of board ``which[k]`` under ``drives[k]`` from ``starts[k]``, for each k.

        A board may be asked more than once; questions of one board under one drive that follow
        each other share its tables. starts : (len(which), states), at drive phase 0. Equal to
        ``dynamics.attractors.settle`` of each, to rounding; a board without an answer gives a
        failed orbit with the reason. progress : called once an answer.
        """
        return [r.orbit for r in self.respond(which, drives, starts, jobs=jobs, progress=progress)]

    def respond(
        self,
        which: Sequence[int],
        drives: Sequence[Drive],
        starts: Array,
        *,
        jobs: int = 1,
        progress: Callable[[], None] = lambda: None,
    ) -> list[SettledBoard]:
        """``settle``, with the displacement that each orbit draws."""
        index = np.asarray(which, dtype=np.int64)
        states = np.ascontiguousarray(starts, dtype=np.float64)

        def chunk(first: int) -> list[SettledBoard]:
            heed()
            part = slice(first, first + CHUNK)
            found = self._compiled(index[part], drives[part], states[part])
            for k, response in enumerate(found):
                if response is None:
                    found[k] = self._alone(
                        int(index[first + k]), drives[first + k], states[first + k]
                    )
                progress()
            return [r for r in found if r is not None]

        chunks = parallel(chunk, range(0, len(index), CHUNK), jobs)
        return [response for found in chunks for response in found]

    def quick(
        self,
        which: Sequence[int],
        drives: Sequence[Drive],
        starts: Array,
        *,
        jobs: int = 1,
        progress: Callable[[], None] = lambda: None,
    ) -> list[Orbit | None]:
        """``settle`` as far as the compiled way goes: None where it leaves a question open.

        For predictions: what has no period after 140 drive periods, or clips, stays open.
        """
        index = np.asarray(which, dtype=np.int64)
        states = np.ascontiguousarray(starts, dtype=np.float64)

        def chunk(first: int) -> list[Orbit | None]:
            heed()
            part = slice(first, first + CHUNK)
            found = self._compiled(index[part], drives[part], states[part])
            progress()
            return [None if r is None else r.orbit for r in found]

        chunks = parallel(chunk, range(0, len(index), CHUNK), jobs)
        return [orbit for found in chunks for orbit in found]

    def run(
        self,
        which: Sequence[int],
        drives: Sequence[Drive],
        starts: Array,
        periods: int,
        *,
        modes: Sequence[ModeKey | None] | None = None,
        jobs: int = 1,
    ) -> list[FlowResult | None]:
        """Each board's plain flow over ``periods`` drive periods, without settling.

        modes : in which each starts, where that is known. None where a board has no flow: no
        mode holds at its start, or its nodal equations are singular.
        """
        begin = [None] * len(which) if modes is None else modes

        def one(k: int) -> FlowResult | None:
            try:
                flow = Flow(self.reduction(which[k]).system(), drives[k], fast=self._fast)
                return flow.run(starts[k], periods, mode=begin[k])
            except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError):
                return None

        return list(parallel(one, range(len(which)), jobs))

    def _alone(self, board: int, drive: Drive, start: Array) -> SettledBoard:
        """One question, in Python."""
        try:
            system = self.reduction(board).system()
            flow = Flow(system, drive, fast=self._fast)
            orbit = attractors.settle(flow, start)
            if self._fast and _faint(orbit, drive):
                flow = Flow(system, drive, fast=False)
                orbit = attractors.settle(flow, start)
            trace = np.zeros(0)
            if orbit.status is OrbitStatus.PERIODIC:
                trace = displacement(flow, orbit)
        except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError) as error:
            return SettledBoard(failed(str(error)), np.zeros(0))
        return SettledBoard(orbit, trace)

    def _compiled(
        self, which: Index, drives: Sequence[Drive], starts: Array
    ) -> list[SettledBoard | None]:
        """None for each question that the compiled way leaves open."""
        out: list[SettledBoard | None] = [None] * len(which)
        if self._modes is None:
            return out
        asked = np.flatnonzero(self._good[which])
        if not len(asked):
            return out
        given = np.array([[d.omega, d.amplitude, d.offset] for d in drives])
        count = len(asked)
        answers = kernel.Answers(
            whole=np.zeros((count, 7), dtype=np.int64),
            real=np.zeros((count, 32)),
            when=np.zeros((count, kernel.IMPACTS)),
            speed=np.zeros((count, kernel.IMPACTS)),
            stop=np.zeros((count, kernel.IMPACTS), dtype=np.int64),
            trace=np.zeros((count, kernel.LONGEST * kernel.POINTS)),
        )
        j = self.boards.circuit.states.index(self.boards.circuit.stops[0].state)
        kernel.respond_all(
            self._modes,
            which[asked],
            given[asked],
            starts[asked],
            MAX_EVENTS,
            working_modes.ANCHORS,
            j,
            answers,
        )
        found = np.flatnonzero(answers.whole[:, 0] == FOUND)
        multipliers = np.linalg.eigvals(answers.real[found, 4:20].reshape(-1, 4, 4)).astype(complex)
        for e, multiplier in zip(found, multipliers, strict=True):
            period = drives[int(asked[e])].period
            out[int(asked[e])] = self._response(answers, int(e), period, multiplier, j)
        return out

    def _response(
        self, answers: kernel.Answers, e: int, period: float, multipliers: Complex, j: int
    ) -> SettledBoard:
        """Answer e in the normal form; the rules are those of ``attractors.describe``."""
        n, p, q, spent, mode, met = (int(v) for v in answers.whole[e, 1:])
        real = answers.real[e]
        extremes = real[20:28].reshape(4, 2).copy()
        penetration, miss = float(real[28]), float(real[29])
        floor = attractors.ENGINE_ERROR * float(np.abs(extremes[j]).max())
        grazing = min(penetration, miss) < floor or real[31] > 0.0
        status = OrbitStatus.GRAZING if grazing else OrbitStatus.PERIODIC
        radius = float(np.abs(multipliers).max())
        once = answers.when[e, :met] < n * period
        orbit = Orbit(
            status=status,
            n=n,
            p=p,
            q=q,
            start=real[:4].copy(),
            mode=self._keys[mode],
            extremes=extremes,
            impact_times=answers.when[e, :met][once],
            impact_velocities=answers.speed[e, :met][once],
            impact_sides=answers.stop[e, :met][once].astype(float),
            asymmetry=float(real[30]),
            multipliers=multipliers,
            lyapunov=float(np.log(radius) / (n * period)) if radius > 0.0 else -np.inf,
            penetration=penetration,
            miss=miss,
            reason=f"while classifying period {n}" if grazing else "",
            periods=spent,
        )
        return SettledBoard(orbit, answers.trace[e, : n * kernel.POINTS].copy())


def _faint(orbit: Orbit, drive: Drive) -> bool:
    """Whether rounding may decide between no period and chaos: the general kernel has the word."""
    if orbit.status is OrbitStatus.APERIODIC:
        return orbit.lyapunov * drive.period < FAINT
    return orbit.status is OrbitStatus.NOT_SETTLED


def _reduced(boards: Boards, jobs: int) -> tuple[kernel_mode_tables.Modes | None, Mask]:
    """``working_modes.of_boards`` by ``jobs`` threads."""
    count = len(boards)
    if count <= TOGETHER:
        return working.of_boards(boards)
    chunks = [range(k, min(k + TOGETHER, count)) for k in range(0, count, TOGETHER)]
    found = list(parallel(lambda chunk: working.of_boards(boards.take(chunk)), chunks, jobs))
    good = np.concatenate([each for _, each in found])
    parts = [modes for modes, _ in found if modes is not None]
    if not parts:
        return None, good
    of_each = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("A", "B", "d", "guard", "past")
    }
    return parts[0]._replace(**of_each), good


def displacement(flow: Flow, orbit: Orbit) -> Array:
    """(n · POINTS,) the first moving state over the n periods of an orbit."""
    run = flow.run(orbit.start, orbit.n, mode=orbit.mode or None, points=kernel.POINTS)
    return np.asarray(run.strobes[:-1, flow.system.moving])
