"""The attractors of many boards of one circuit: what every study of yields is made of.

Boards are reduced together, and the usual way to an answer (settle, shoot, check) is compiled
(``kernels.kernel_boards``). What is unusual on that way goes to ``dynamics.attractors.settle``,
which it must equal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from threading import Lock

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.base.threads import heed, parallel
from designer.circuit import board_modes as working
from designer.circuit.board_arrays import Boards
from designer.circuit.nodal_bandwidth import swinging_sections
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics import attractors, working_modes
from designer.dynamics.counts import MAX_PERIOD
from designer.dynamics.flow import MAX_EVENTS, Flow
from designer.dynamics.flow_result import FlowResult
from designer.dynamics.orbit import Orbit, OrbitStatus, failed
from designer.dynamics.piecewise_linear import Drive, ModeKey
from designer.dynamics.step_budget import Budget
from designer.kernels import kernel_boards as kernel
from designer.kernels.kernel_orbit import CHAOS, DONE, FOUND, LEFT

CHUNK = 32
"""Questions that one thread takes at a time, at most; no answer depends on it."""
TOGETHER = 125
"""Boards that one thread reduces at a time: their matrices stay in the cache. Nor on this."""
QUICK = 3
"""Stages of settling, 140 drive periods, after which a prediction gives up."""
BRIEF = 200_000
"""Steps that a trial may take."""
FAINT = 5.0 * CHAOS
"""Growth of a tangent vector per drive period below which chaos is not plain."""


@dataclass(frozen=True)
class SettledBoard:
    """The steady response of a board."""

    orbit: Orbit
    trace: Array
    """(n · POINTS,) displacement over the orbit's n drive periods; empty where none was drawn."""


class Ensemble:
    """N boards, reduced once each and asked as often as is wanted.

    fast : take the compiled way where it fits; False: ``attractors.settle`` of each board.
    jobs : threads that reduce. Boards with bandwidth whose op-amps drive diodes are settled one by
    one.
    """

    def __init__(self, boards: Boards, *, fast: bool = True, jobs: int = 1) -> None:
        self.boards = boards
        self._fast = fast
        self._reductions: dict[int, Reduction] = {}
        self._entered: dict[int, working.BoardModes] = {}
        self._entering = Lock()
        fits = len(boards.circuit.states) <= working_modes.MOST_STATES and len(boards) > 0
        fits = fits and not (boards.bandwidth and swinging_sections(boards.circuit))  # jumps
        self._modes = _reduced(boards, jobs) if fast and fits else None

    def __len__(self) -> int:
        return len(self.boards)

    @property
    def compiled(self) -> bool:
        """Whether there is a compiled way to answers."""
        return self._modes is not None

    def reduction(self, index: int) -> Reduction:
        """The exact reduction of one board."""
        known = self._reductions.get(index)
        if known is None:
            board = self.boards.board(index)
            known = Reduction(self.boards.circuit, board, bandwidth=self.boards.bandwidth)
            self._reductions[index] = known
        return known

    def settle(
        self,
        which: Sequence[int],
        drives: Sequence[Drive],
        starts: Array,
        *,
        jobs: int = 1,
        within: int | None = None,
        progress: Callable[[], None] = lambda: None,
    ) -> list[Orbit]:
        """The attractor of board ``which[k]`` under ``drives[k]`` from ``starts[k]``, for each k.

        A board may be asked more than once; questions of one board under one drive that follow
        each other share its tables. starts : (len(which), states), or capacitor voltages, at drive
        phase 0. Equal to ``dynamics.attractors.settle`` of each, to rounding, but for the periods
        spent where Newton's method strayed into a mode in which an op-amp clips; a board without an
        answer gives a failed orbit with the reason. within : as of ``respond``. progress : called
        once an answer.
        """
        every = self.respond(which, drives, starts, jobs=jobs, within=within, progress=progress)
        return [r.orbit for r in every]

    def respond(
        self,
        which: Sequence[int],
        drives: Sequence[Drive],
        starts: Array,
        *,
        jobs: int = 1,
        within: int | None = None,
        progress: Callable[[], None] = lambda: None,
    ) -> list[SettledBoard]:
        """``settle``, with the displacement that each orbit draws.

        within : steps of a trial, such as `BRIEF`. What the compiled way leaves open and takes
        longer is not settled, and chaos is not watched until it may end. None: no trial.
        """
        stages, alone = len(kernel.STAGES), partial(self._alone, within=within)
        every = self._settled(which, drives, starts, stages, alone, jobs, progress)
        return [response for response in every if response is not None]

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

        For predictions: what has no period after 140 drive periods (``QUICK`` stages), or clips,
        stays open. Under a drive that is no sine a board is settled briefly.
        """

        def brief(board: int, drive: Drive, start: Array) -> SettledBoard | None:
            return None if drive.is_sine else self._alone(board, drive, start, BRIEF)

        every = self._settled(which, drives, starts, QUICK, brief, jobs, progress)
        return [None if response is None else response.orbit for response in every]

    def _settled(
        self,
        which: Sequence[int],
        drives: Sequence[Drive],
        starts: Array,
        stages: int,
        alone: Callable[[int, Drive, Array], SettledBoard | None],
        jobs: int,
        progress: Callable[[], None],
    ) -> list[SettledBoard | None]:
        """What each board settles on the compiled way within so many stages, else ``alone``."""
        index = np.asarray(which, dtype=np.int64)
        states = np.ascontiguousarray(starts, dtype=np.float64)
        size = _chunk(len(index), jobs)

        def chunk(first: int) -> list[SettledBoard | None]:
            heed()
            part = slice(first, first + size)
            settled = self._compiled(index[part], drives[part], states[part], stages)
            for k, response in enumerate(settled, start=first):
                if response is None:
                    settled[k - first] = alone(int(index[k]), drives[k], states[k])
                progress()
            return settled

        chunks = parallel(chunk, range(0, len(index), size), jobs)
        return [response for settled in chunks for response in settled]

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

    def swept(
        self,
        board: int,
        stages: Sequence[tuple[Drive, int]],
        starts: Array,
        neighbours: Sequence[int] = (),
    ) -> tuple[Array, Mask]:
        """(E, n) the states of a board after each drive for its whole periods, phase-continuous,
        from ``starts`` (E, n) at drive phase 0, and (E,) where the compiled way knows them: there
        the board kept to its working modes, in which nothing clips that ought to be linear.

        neighbours : boards that are asked about the same drives. Modes that this one enters are
        solved for them too; no state depends on it.
        """
        starts = np.array(starts, dtype=np.float64)
        sines = all(drive.is_sine for drive, _ in stages)
        if self._modes is None or not self._modes.good[board] or not len(starts) or not sines:
            return starts, np.zeros(len(starts), dtype=bool)
        modes = self._modes_of(board)
        drives = np.array([working_modes.drive_of(drive, MAX_EVENTS) for drive, _ in stages])
        laps, closely = np.array([count for _, count in stages], dtype=np.int64), False
        rows = np.zeros(len(starts), dtype=np.int64)
        while True:
            heed()
            answers = self._answers(modes, rows, drives, starts, 0, closely, laps)
            codes = answers.whole[:, kernel.CODE]
            mode, guard = answers.whole[0, kernel.MISSING :][:2].tolist()
            before = len(modes.targets.keys)
            if mode >= 0:
                modes = self._further(board, [modes.targets.beyond(mode, guard)], neighbours)
            elif not (codes == LEFT).any() or closely:
                return answers.start, np.asarray(codes == DONE)
            else:  # all modes first: a proof step by step takes longer
                modes = self._further(board, None, neighbours)
                closely = len(modes.targets.keys) == before

    def _modes_of(self, board: int) -> working.BoardModes:
        """A board's own modes: a copy, for another thread may ask about this board too."""
        assert self._modes is not None
        known = self._entered.get(board)
        modes, row = (self._modes, board) if known is None else (known, 0)
        return modes.take(np.array([row]))

    def _further(
        self, board: int, keys: Sequence[ModeKey] | None, neighbours: Sequence[int]
    ) -> working.BoardModes:
        """A board's own modes with these working modes too, all where None; and those of the boards
        beside it that have had the same ones so far: a mode of many boards takes little longer."""
        with self._entering:
            modes = self._modes_of(board)
            if all(key in modes.targets.numbers for key in keys or self.boards.circuit.working):
                return modes  # nothing is left, or another thread has been here
            boards, parts = [board], [modes]
            for other in neighbours:
                own = self._modes_of(other)
                if other != board and own.targets.keys == modes.targets.keys:
                    boards.append(other)
                    parts.append(own)
            joined = working.BoardModes.joined(self.boards.take(np.array(boards)), parts)
            if keys is None:
                joined.enter_all()
            else:
                joined.enter(keys)
            for row, each in enumerate(boards):
                self._entered[each] = joined.take(np.array([row]))
            return self._modes_of(board)

    def _alone(self, board: int, drive: Drive, start: Array, within: int | None) -> SettledBoard:
        """One question, in Python."""
        try:
            reduction = self.reduction(board)
            system, start = reduction.system(), reduction.state(start)
            if self._modes is not None and not (system.built or drive.is_sine):
                system.know(self._modes.alone(board, self._second_channel))
            flow = Flow(system, drive, fast=self._fast, waves=True)
            if within is None:
                orbit = attractors.settle(flow, start)
            else:
                orbit = attractors.settle(flow, start, budget=Budget(within), watch=0)
            if self._fast and within is None and _faint(orbit, drive):
                flow = Flow(system, drive, fast=False)
                orbit = attractors.settle(flow, start)
            trace = np.zeros(0)
            if orbit.status is OrbitStatus.PERIODIC:
                trace = displacement(flow, orbit)
        except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError) as error:
            return SettledBoard(failed(str(error)), np.zeros(0))
        return SettledBoard(orbit, trace)

    def _compiled(
        self, which: Index, drives: Sequence[Drive], starts: Array, stages: int
    ) -> list[SettledBoard | None]:
        """None for each question that the compiled way leaves open after so many stages."""
        out: list[SettledBoard | None] = [None] * len(which)
        if self._modes is None:
            return out
        sines = np.array([drive.is_sine for drive in drives], dtype=bool)
        good = np.flatnonzero(self._modes.good[which] & sines)
        boards, number = np.unique(which[good], return_inverse=True)
        modes = self._modes.take(boards)
        given = np.array([working_modes.drive_of(d, MAX_EVENTS) for d in drives]).reshape(-1, 4)
        settling = np.zeros(0, dtype=np.int64)
        for closely in (False, True):
            open_ = np.array([out[k] is None for k in good], dtype=bool)
            asked, rows = good[open_], number[open_]
            while len(asked):
                answers = self._answers(
                    modes, rows, given[asked], starts[asked], stages, closely, settling
                )
                code = answers.whole[:, kernel.CODE]
                closed = np.flatnonzero(code == FOUND)
                periods = [drives[k].period for k in asked[closed]]
                responses = self._responses(answers, closed, periods, modes)
                for k, response in zip(asked[closed], responses, strict=True):
                    out[k] = response
                again = code == kernel.BUILD
                missing = answers.whole[again, kernel.MISSING :][:, :2]
                modes.enter({modes.targets.beyond(int(m), int(g)) for m, g in missing})
                if (code == kernel.NOWHERE).any() and modes.enter_all():
                    again |= code == kernel.NOWHERE
                asked, rows = asked[again], rows[again]
        return out

    def _answers(
        self,
        modes: working.BoardModes,
        rows: Index,
        drives: Array,
        starts: Array,
        stages: int,
        closely: bool,
        laps: Index,
    ) -> kernel.Answers:
        """What the compiled code says of boards ``rows`` of these modes. closely : as of
        ``DrivenModes``; laps : as of ``answer_all``."""
        count, (_, _, clearances, wide) = len(rows), modes.modes.past.shape
        n, watched = wide - 2, len(modes.modes.watched)
        answers = kernel.Answers(
            whole=np.zeros((count, kernel.COUNTED + 2 + 2 * clearances), dtype=np.int64),
            start=np.zeros((count, n)),
            monodromy=np.zeros((count, n, n)),
            extremes=np.zeros((count, n + watched, 2)),
            graze=np.zeros((count, clearances, 2)),
            facts=np.zeros((count, 2)),
            when=np.zeros((count, kernel.IMPACTS)),
            speed=np.zeros((count, kernel.IMPACTS)),
            stop=np.zeros((count, kernel.IMPACTS, 2), dtype=np.int64),
            trace=np.zeros((count, MAX_PERIOD * kernel.POINTS)),
        )
        room = working_modes.driven(modes.modes, drives[0])
        kernel.answer_all(
            modes.modes, rows, drives, starts, stages, laps, working_modes.ANCHORS, room.data,
            room.ints, room.width, room.far, bool(self.boards.circuit.dependent_capacitors),
            closely, room.unit, answers,
        )  # fmt: skip
        return answers

    def _responses(
        self,
        answers: kernel.Answers,
        closed: Index,
        periods: Sequence[float],
        modes: working.BoardModes,
    ) -> Iterator[SettledBoard]:
        """The answers in the normal form, by the rules of ``attractors.describe``."""
        multipliers = np.linalg.eigvals(answers.monodromy[closed]).astype(complex)
        radius = np.abs(multipliers).max(axis=1, initial=0.0)
        graze, facts = answers.graze[closed], answers.facts[closed]
        spans = np.abs(answers.extremes[closed][:, self._in_clearances]).max(axis=2)
        near = (graze.min(axis=2) < attractors.ENGINE_ERROR * spans).any(axis=1)
        grazing = near | (facts[:, kernel.UNDECIDED] > 0.0)
        size = len(self.boards.circuit.states)
        for k, e in enumerate(closed):
            whole = answers.whole[e].tolist()
            n, spent, *counts = whole[kernel.COUNTED :]
            first, *more = zip(counts[0::2], counts[1::2], strict=True) if counts else [(0, 0)]
            met = int(np.searchsorted(answers.when[e, : whole[kernel.MET]], n * periods[k]))
            orbit = Orbit(
                status=OrbitStatus.GRAZING if grazing[k] else OrbitStatus.PERIODIC,
                n=n,
                p=first[0],
                q=first[1],
                more=tuple(more),
                start=answers.start[e].copy(),
                mode=modes.targets.keys[whole[kernel.BEGIN]],
                extremes=answers.extremes[e, :size].copy(),
                impact_times=answers.when[e, :met].copy(),
                impact_velocities=answers.speed[e, :met].copy(),
                impact_sides=answers.stop[e, :met, 1].astype(float),
                impact_clearances=answers.stop[e, :met, 0].copy(),
                asymmetry=float(facts[k, kernel.ASYMMETRY]),
                multipliers=multipliers[k],
                lyapunov=_rate(radius[k], n * periods[k]),
                graze=answers.graze[e].copy(),
                reason=f"while classifying period {n}" if grazing[k] else "",
                periods=spent,
            )
            yield SettledBoard(orbit, answers.trace[e, : n * kernel.POINTS].copy())

    @cached_property
    def _second_channel(self) -> working.BoardModes | None:
        """The modes by the generator's second channel; None where there is none."""
        if self.boards.circuit.second is None:
            return None
        return working.BoardModes(self.boards, 1)

    @cached_property
    def _in_clearances(self) -> Index:
        """(C,) which of the extremes that are watched is the displacement in each clearance."""
        circuit = self.boards.circuit
        further = iter(range(len(circuit.states), len(circuit.states) + len(circuit.stops)))
        rows = [
            circuit.states.index(stop.state) if stop.difference is None else next(further)
            for stop in circuit.stops
        ]
        return np.array(rows, dtype=np.int64)


def _rate(radius: float, span: float) -> float:
    """Growth per unit time of what grows by ``radius`` in ``span``."""
    return float(np.log(radius) / span) if radius > 0.0 else -np.inf


def _faint(orbit: Orbit, drive: Drive) -> bool:
    """Whether rounding may decide between no period and chaos: the general kernel has the word."""
    if orbit.status is OrbitStatus.APERIODIC:
        return orbit.lyapunov * drive.period < FAINT
    return orbit.status is OrbitStatus.NOT_SETTLED


def _chunk(questions: int, jobs: int) -> int:
    """How many questions a thread takes at a time, so that there is something for each."""
    return max(1, min(CHUNK, -(-questions // jobs)))


def _reduced(boards: Boards, jobs: int) -> working.BoardModes:
    """The first working modes, by ``jobs`` threads."""
    count = len(boards)
    if count <= TOGETHER:
        return working.BoardModes(boards)
    chunks = [range(k, min(k + TOGETHER, count)) for k in range(0, count, TOGETHER)]

    def part(chunk: range) -> working.BoardModes:
        return working.BoardModes(boards.take(chunk))

    parts = list(parallel(part, chunks, jobs))
    return working.BoardModes.joined(boards, parts)


def displacement(flow: Flow, orbit: Orbit) -> Array:
    """(n · POINTS,) the first moving state over the n periods of an orbit."""
    run = flow.run(orbit.start, orbit.n, mode=orbit.mode or None, points=kernel.POINTS)
    return np.asarray(run.strobes[:-1, flow.system.moving])
