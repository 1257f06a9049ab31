"""The reliability index of a response by scaled-sigma sampling: boards with a stretched spread.

A yield near 1 tells designs apart only with thousands of boards. So every deviation from the
nominal board is stretched λ times, for a few λ, and boards are asked on the exact circuit whether
they still show the response. Were the margin linear and its spread normal, the yield of boards
stretched λ times would be Φ(d/λ). There d is the reliability index: how far the nominal board is
from losing the response, in standard deviations of the margin ("scaled-sigma sampling": Sun, Li,
Liu, Luo and Gu, IEEE Trans. CAD 34, 2015). d is fitted to all λ by largest likelihood; Φ(d) is the
yield that it predicts. Spreads are bounded and margins curved, so this ranks designs and places;
yields that are reported are counted on boards as they are. A prediction does not wait: a board that
has not settled after 140 drive periods counts as lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import log_ndtr, ndtr

from designer.base.plain_json import plain
from designer.centering.answer_cache import AnswerCache
from designer.centering.response_windows import OperatingPoint
from designer.circuit.design import Design
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Excitation
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.response_table import Response
from designer.spice.numerics_gate import GateSubject
from designer.spread.board_quantities import between
from designer.spread.spread import Spread, draw_many
from designer.verdicts.verdict import Verdict, judge
from designer.yields.study_identity import nine_digits

STREAM = "search:"
"""Stands before the names of the coordinates: no study draws these boards, whatever its seed."""
LADDER = (1.0, 1.5, 2.0, 3.0)
"""Stretches of the spread."""
FARTHEST = 20.0
"""Reliability indices above this, in standard deviations, are not told apart."""


@dataclass(frozen=True)
class StretchCounts:
    """What boards showed at several stretches of the spread."""

    stretches: tuple[float, ...]
    """Factors that the spread is stretched by."""
    samples: tuple[int, ...]
    """How many boards were asked at each stretch."""
    ok: tuple[int, ...]
    """How many boards show the response at each stretch."""

    @property
    def reliability_index(self) -> float:
        """The reliability index d of the module's text. Half a loss is added at the largest
        stretch, so that it is finite."""
        scale = 1.0 / np.array(self.stretches)
        ok = np.array(self.ok, dtype=float)
        lost = np.array(self.samples, dtype=float) - ok
        lost[int(np.argmin(scale))] += 0.5

        def against(d: float) -> float:
            z = d * scale
            return -float(np.sum(ok * log_ndtr(z) + lost * log_ndtr(-z)))

        fit = minimize_scalar(against, bounds=(-FARTHEST, FARTHEST), method="bounded")
        return round(float(fit.x), 4)

    @property
    def predicted(self) -> float:
        """Yield at the spread as it is."""
        return float(ndtr(self.reliability_index))


@dataclass(frozen=True)
class OperatingOrbit:
    """The nominal board's orbit at an operating point, which boards start from."""

    spec: Response
    place: OperatingPoint
    """Where it is asked for."""
    drive: Drive
    """The generator's drive there."""
    orbit: Orbit
    """The nominal board's orbit, which boards start from."""


class ScaledBoards:
    """The boards of a design, each at every stretch, reduced once.

    count : boards. seed : of their numbers, with a stream of their own. memory : of answers that
    are known already.
    """

    def __init__(
        self,
        design: Design,
        spread: Spread,
        seed: int,
        count: int,
        *,
        jobs: int = 1,
        memory: AnswerCache | None = None,
    ) -> None:
        self.design, self.count, self.jobs = design, count, jobs
        self._memory = AnswerCache() if memory is None else memory
        boards = draw_many(design.circuit, spread, seed, range(count), STREAM)
        rows = [0] + [i for _ in LADDER for i in range(count)]
        shares = np.concatenate([[0.0], np.repeat(LADDER, count)])
        self._boards = Ensemble(between(boards.take(rows), shares), jobs=jobs)
        circuit = design.circuit
        self._boards_key = [
            circuit.opamp,
            sorted(circuit.values.items()),
            plain(spread.as_dict()),
            seed,
        ]

    def operating_orbits(
        self, wanted: Sequence[tuple[Response, OperatingPoint]]
    ) -> list[OperatingOrbit | None]:
        """The nominal board's orbit at each place; None where it does not show the response
        there."""
        if not wanted:
            return []
        drives = [self.excitation(place).drive for _, place in wanted]
        starts = np.array([p.start * self.design.volts(p.b) for _, p in wanted])
        orbits = self._boards.quick([0] * len(wanted), drives, starts, jobs=self.jobs)
        out: list[OperatingOrbit | None] = []
        for (spec, place), drive, orbit in zip(wanted, drives, orbits, strict=True):
            fine = orbit is not None and judge(orbit, spec, orbit)[0] is Verdict.OK
            out.append(
                OperatingOrbit(spec, place, drive, orbit) if fine and orbit is not None else None
            )
        return out

    def ask(
        self,
        operating_orbits: Sequence[OperatingOrbit],
        boards: range,
        stretches: Sequence[float] = LADDER,
    ) -> list[StretchCounts]:
        """What these boards show at each place. stretches : some of ``LADDER``."""
        queries = [
            self.query(operating_orbit, boards, stretches) for operating_orbit in operating_orbits
        ]

        def make(new: list[int]) -> list[tuple[int, ...]]:
            return self._made([operating_orbits[k] for k in new], boards, stretches)

        samples = (len(boards),) * len(stretches)
        answers = self._memory.get_all(queries, make, samples)
        return [StretchCounts(tuple(stretches), samples, ok) for ok in answers]

    def _made(
        self,
        operating_orbits: Sequence[OperatingOrbit],
        boards: range,
        stretches: Sequence[float],
    ) -> list[tuple[int, ...]]:
        """How many boards show the response at each place, by stretch."""
        places = [LADDER.index(s) for s in stretches]
        rows = [1 + r * self.count + i for r in places for i in boards]
        which = [row for row in rows for _ in operating_orbits]
        drives = [s.drive for _ in rows for s in operating_orbits]
        starts = np.array([s.orbit.start for _ in rows for s in operating_orbits])
        orbits = self._boards.quick(which, drives, starts, jobs=self.jobs)
        fine = [
            _shows(orbit, operating_orbits[k % len(operating_orbits)])
            for k, orbit in enumerate(orbits)
        ]
        ok = np.array(fine).reshape(len(places), len(boards), len(operating_orbits)).sum(axis=1)
        return [tuple(int(v) for v in ok[:, k]) for k in range(len(operating_orbits))]

    def query(
        self, operating_orbit: OperatingOrbit, boards: range, stretches: Sequence[float]
    ) -> object:
        """Everything that decides an answer, as plain data."""
        drive, spec = operating_orbit.drive, operating_orbit.spec
        setting = [drive.omega, drive.amplitude, *(float(v) for v in operating_orbit.orbit.start)]
        if not drive.is_sine:
            setting += np.ravel(drive.shape).tolist()
        if drive.second is not None:
            setting += [drive.second.amplitude, *np.ravel(drive.second.shape).tolist()]
        wanted = [str(spec.expect), spec.twin, spec.symmetric]
        extent = [boards.start, boards.stop, list(stretches)]
        return [self._boards_key, nine_digits(setting), wanted, extent]

    def excitation(self, place: OperatingPoint) -> Excitation:
        """The generator's setting for a place."""
        return self.design.excitation(place.b, place.omega)

    def nominal(self, operating_orbit: OperatingOrbit) -> GateSubject:
        """The nominal board at a place, for ngspice."""
        return GateSubject(
            self._boards.reduction(0), self.excitation(operating_orbit.place), operating_orbit.orbit
        )

    def subjects(
        self, operating_orbit: OperatingOrbit, boards: range, stretch: float
    ) -> list[GateSubject]:
        """What ngspice needs of those of these boards that show the response at this stretch."""
        excitation = self.excitation(operating_orbit.place)
        return [
            GateSubject(self._boards.reduction(row), excitation, orbit)
            for row, orbit in self._showing(operating_orbit, boards, stretch)
        ]

    def lagging(
        self, operating_orbit: OperatingOrbit, boards: range, stretch: float
    ) -> list[Orbit]:
        """Where those of these boards that show the response at this stretch settle from their own
        orbit, their op-amps with bandwidth."""
        showing = self._showing(operating_orbit, boards, stretch)
        if not showing:
            return []
        rows, orbits = zip(*showing, strict=True)
        boards_with = replace(self._boards.boards.take(rows), bandwidth=True)
        some = Ensemble(boards_with, jobs=self.jobs)
        starts = np.array([orbit.start for orbit in orbits])
        drives = [operating_orbit.drive] * len(rows)
        return some.settle(range(len(rows)), drives, starts, jobs=self.jobs)

    def _showing(
        self, operating_orbit: OperatingOrbit, boards: range, stretch: float
    ) -> list[tuple[int, Orbit]]:
        """Rows and orbits of those of these boards that show the response at this stretch."""
        rows = [1 + LADDER.index(stretch) * self.count + i for i in boards]
        starts = np.tile(operating_orbit.orbit.start, (len(rows), 1))
        orbits = self._boards.quick(
            rows, [operating_orbit.drive] * len(rows), starts, jobs=self.jobs
        )
        return [
            (row, orbit)
            for row, orbit in zip(rows, orbits, strict=True)
            if orbit is not None and _shows(orbit, operating_orbit)
        ]


def _shows(orbit: Orbit | None, operating_orbit: OperatingOrbit) -> bool:
    if orbit is None or orbit.status is not OrbitStatus.PERIODIC:
        return False
    return judge(orbit, operating_orbit.spec, operating_orbit.orbit)[0] is Verdict.OK
