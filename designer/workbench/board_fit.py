"""The board behind a record: the most probable one of the spread, and how well it is known.

Maximum a posteriori by Gauss and Newton (Nocedal and Wright, Numerical Optimization, 2006, chapter
10; Tarantola, Inverse Problem Theory, 2005, chapter 3). The unknowns are the coordinates of the
board (``board_prior.Prior``), and for each record the gain and offset of each channel, its shift
in time and, where nobody knows it better, the generator's amplitude. What is held against the
record is the board's exact orbit. Its derivatives are difference quotients of exact orbits along
the few directions in which the board's equation changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from designer.base.arrays import Array
from designer.base.errors import DesignerError
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.orbit import OrbitStatus
from designer.workbench.board_orbits import POINTS, NetOrbit, follow
from designer.workbench.board_prior import PROBE, Prior
from designer.workbench.observation import Observation

DRAWS = 16
"""Boards of the spread whose orbits are held against a record first, the nominal one among them."""
LOOK = 1024
"""Samples of a record that this first look takes."""
ROUNDS = 16
"""Steps of Gauss and Newton at most."""
HALVINGS = 6
"""Of a step that leads to no better board."""
LONGEST = 2.0
"""Standard deviations that a step moves a coordinate at most."""
ENOUGH = 0.02
"""Of the objective, minus twice the logarithm of the probability: a gain that ends the search."""
UNALIGNED = 0.25
"""Drive periods: standard deviation of the shift of a record without the generator."""


class NoSuchBoard(DesignerError):
    """No board of the spread has an orbit like the record's."""


@dataclass(frozen=True)
class _Reading:
    """How a record is read: gain (nets,), offset (nets,) [V], shift [drive periods], and the
    generator's amplitude over what was set."""

    gain: Array
    offset: Array
    shift: float
    amplitude: float = 1.0

    @property
    def vector(self) -> Array:
        return np.array([*self.gain, *self.offset, self.shift, self.amplitude])

    @classmethod
    def of(cls, vector: Array) -> _Reading:
        nets = (len(vector) - 2) // 2
        return cls(vector[:nets], vector[nets:-2], float(vector[-2]), float(vector[-1]))


@dataclass(frozen=True)
class _Place:
    """A board z (K,) with its orbit for each record and how those are read."""

    z: Array
    orbits: tuple[NetOrbit, ...]
    readings: tuple[_Reading, ...]


@dataclass(frozen=True)
class BoardFit:
    """What records say of the board that they are of."""

    prior: Prior
    """The boards that it is one of."""
    observations: tuple[Observation, ...]
    """The records."""
    centre: Array
    """(K,) coordinates of the most probable board."""
    covariance: Array
    """(K, K) of the coordinates, as the records leave them."""
    orbits: tuple[NetOrbit, ...]
    """Its orbit for each record."""
    gains: tuple[Array, ...]
    """(nets,) gain of each channel for each record."""
    shifts: tuple[float, ...]
    """Shift in time of each record [drive periods]."""
    residuals: tuple[float, ...]
    """RMS difference of each record and the orbit over the orbit's peak, the worst net's."""
    misfits: tuple[float, ...]
    """The same over what noise and model are stated to leave: about 1 where the board is one of
    the spread and the scope keeps what is stated of it."""
    rounds: int
    """Steps that the search took."""

    def samples(self, count: int, seed: int = 0) -> Array:
        """(count, K) boards as probable as the records leave them; the first is the centre."""
        root = np.linalg.cholesky(self.covariance + 1e-12 * np.eye(len(self.centre)))
        normal = np.random.default_rng(seed).standard_normal((count, len(self.centre)))
        normal[0] = 0.0
        return np.asarray(self.centre + normal @ root.T)


def fit_board(
    prior: Prior, observations: Sequence[Observation], starts: Sequence[Sequence[Array]]
) -> BoardFit:
    """The board that these records are of.

    starts : for each record the states (states,) from which a board may have come to its motion:
    those of the nominal board's orbits there.

    Raises
    ------
    NoSuchBoard : no board of the spread settles from these starts on an orbit of the records'
        periods, so there is nothing to begin with.
    """
    problem = _Problem(prior, tuple(observations))
    place = problem.first(starts)
    worth, gain, rounds = problem.objective(place), np.inf, 0
    while gain > ENOUGH and rounds < ROUNDS:
        rounds += 1
        better = problem.step(place, worth, problem.linearised(place))
        if better is None:
            break
        gain = worth - better[1]
        place, worth = better
    return problem.answer(place, rounds)


@dataclass(frozen=True)
class _Linearised:
    """normal (m, m) and gradient (m,) of half the objective by z, then each record's reading; the
    directions (r, K), and the change (r, states) of each orbit's start along them."""

    normal: Array
    gradient: Array
    directions: Array
    starts: tuple[Array, ...]


class _Problem:
    def __init__(self, prior: Prior, observations: tuple[Observation, ...]) -> None:
        self.prior, self.observations = prior, observations
        self.centres: list[_Reading] = []
        self.sigmas: list[Array] = []

    def first(self, starts: Sequence[Sequence[Array]]) -> _Place:
        """The board among some of the spread whose orbits look most like all records."""
        draws = self.prior.draws(DRAWS)
        looks = [
            dict(_looks(self.prior, draws, obs, states))
            for obs, states in zip(self.observations, starts, strict=True)
        ]
        common = set.intersection(*(set(look) for look in looks))
        if not common:
            raise NoSuchBoard(
                f"none of {DRAWS} boards of the spread settles on motions of these periods at "
                "all of these settings"
            )
        best = min(common, key=lambda i: sum(look[i][0] for look in looks))
        chosen = [look[best] for look in looks]
        for obs, (_, orbit, shift) in zip(self.observations, chosen, strict=True):
            nets = len(obs.nets)
            self.centres.append(_Reading(np.ones(nets), np.zeros(nets), shift))
            self.sigmas.append(obs.spread_of(np.abs(orbit.volts).max(axis=0)))
        orbits = tuple(orbit for _, orbit, _ in chosen)
        return _Place(draws[best], orbits, tuple(self.centres))

    def objective(self, place: _Place) -> float:
        """Minus twice the logarithm of the probability, but for a constant."""
        total = float(place.z @ place.z)
        for i, obs in enumerate(self.observations):
            total += float((self._residual(i, place) ** 2).sum())
            off = place.readings[i].vector - self.centres[i].vector
            total += float((off**2 * _precision(obs)).sum())
        return total

    def _residual(self, i: int, place: _Place) -> Array:
        """(k, nets) what is left of a record, over what is allowed for."""
        obs, reading = self.observations[i], place.readings[i]
        shown = _shown(place.orbits[i].volts, obs.phase + reading.shift)
        return np.asarray((obs.volts - reading.gain * shown - reading.offset) / self.sigmas[i])

    def linearised(self, place: _Place) -> _Linearised:
        """The objective about a place, by the exact orbits of boards beside it."""
        directions = self.prior.directions(place.z)
        K, readings = len(place.z), [len(r.vector) for r in place.readings]
        normal = np.zeros((K + sum(readings),) * 2)
        gradient = np.zeros(len(normal))
        normal[:K, :K], gradient[:K] = np.eye(K), place.z
        beside = self.prior.reductions(place.z + PROBE * directions)
        moved, first = [], K
        for i, (obs, size) in enumerate(zip(self.observations, readings, strict=True)):
            slopes, start = self._slopes(i, place, beside)
            J = np.concatenate([slopes @ directions, self._reading_slopes(i, place)], axis=1)
            r = self._residual(i, place).ravel()
            at = np.r_[0:K, first : first + size]
            normal[np.ix_(at, at)] += J.T @ J
            gradient[at] -= J.T @ r
            known = _precision(obs)
            own = np.arange(first, first + size)
            normal[own, own] += known
            gradient[own] += known * (place.readings[i].vector - self.centres[i].vector)
            moved.append(start)
            first += size
        return _Linearised(normal, gradient, directions, tuple(moved))

    def _slopes(self, i: int, place: _Place, beside: Sequence[Reduction]) -> tuple[Array, Array]:
        """(k · nets, r) of what is shown, over what is allowed for, by the directions, and (r,
        states) of the orbit's start; 0 where a board beside it has no such orbit."""
        obs, orbit, reading = self.observations[i], place.orbits[i], place.readings[i]
        drive = _driven(obs.excitation, reading.amplitude)
        volts = np.zeros((len(beside), *orbit.volts.shape))
        start = np.zeros((len(beside), len(orbit.start)))
        for j, reduction in enumerate(beside):
            there = follow(reduction, drive, obs.nets, orbit.start, orbit.n)
            if there is not None:
                volts[j] = (there.volts - orbit.volts) / PROBE
                start[j] = (there.start - orbit.start) / PROBE
        columns = np.moveaxis(volts, 0, -1).reshape(len(orbit.volts), -1)
        shown = _shown(columns, obs.phase + reading.shift)
        shown = shown.reshape(len(obs.phase), len(obs.nets), len(beside))
        shown *= (reading.gain / self.sigmas[i])[:, None]
        return shown.reshape(-1, len(beside)), start

    def _reading_slopes(self, i: int, place: _Place) -> Array:
        """(k · nets, reading) the same by the reading's own numbers."""
        obs, reading, sigma = self.observations[i], place.readings[i], self.sigmas[i]
        nets, orbit = len(obs.nets), place.orbits[i]
        shown = _shown(orbit.volts, obs.phase + reading.shift)
        out = np.zeros((len(shown), nets, 2 * nets + 2))
        for c in range(nets):
            out[:, c, c] = shown[:, c] / sigma[c]
            out[:, c, nets + c] = 1.0 / sigma[c]
        rate = _shown(orbit.volts, obs.phase + reading.shift, 1)
        out[:, :, -2] = reading.gain * rate / sigma
        if obs.scope.amplitude > 0.0:
            (reduction,) = self.prior.reductions(place.z[None])
            louder = _driven(obs.excitation, reading.amplitude * (1.0 + 1e-3))
            there = follow(reduction, louder, obs.nets, orbit.start, orbit.n)
            if there is not None:
                more = _shown(there.volts - orbit.volts, obs.phase + reading.shift) / 1e-3
                out[:, :, -1] = reading.gain * more / sigma
        return out.reshape(-1, 2 * nets + 2)

    def step(self, place: _Place, worth: float, system: _Linearised) -> tuple[_Place, float] | None:
        """A more probable place; None where no part of the step leads to one."""
        K = len(place.z)
        move: Array = np.asarray(-np.linalg.solve(system.normal, system.gradient), dtype=float)
        move /= max(1.0, float(np.abs(move[:K]).max()) / LONGEST)
        for _ in range(HALVINGS):
            there = self._moved(place, move, system)
            if there is not None:
                now = self.objective(there)
                if now < worth:
                    return there, now
            move = 0.5 * move
        return None

    def _moved(self, place: _Place, move: Array, system: _Linearised) -> _Place | None:
        first = len(place.z)
        z = place.z + move[:first]
        (reduction,) = self.prior.reductions(z[None])
        orbits, readings = [], []
        for obs, orbit, reading, slope in zip(
            self.observations, place.orbits, place.readings, system.starts, strict=True
        ):
            size = len(reading.vector)
            new = _Reading.of(reading.vector + move[first : first + size])
            first += size
            near = orbit.start + (system.directions @ move[: len(z)]) @ slope
            drive = _driven(obs.excitation, new.amplitude)
            there = follow(reduction, drive, obs.nets, near, orbit.n)
            if there is None:
                return None
            orbits.append(there)
            readings.append(new)
        return _Place(z, tuple(orbits), tuple(readings))

    def answer(self, place: _Place, rounds: int) -> BoardFit:
        """What is known at the most probable place."""
        system, K = self.linearised(place), len(place.z)
        residuals, misfits = [], []
        for i, orbit in enumerate(place.orbits):
            rest = np.sqrt((self._residual(i, place) ** 2).mean(axis=0))
            peak = np.maximum(np.abs(orbit.volts).max(axis=0), 1e-12)
            residuals.append(float((rest * self.sigmas[i] / peak).max()))
            misfits.append(float(rest.max()))
        return BoardFit(
            prior=self.prior,
            observations=self.observations,
            centre=place.z,
            covariance=np.asarray(np.linalg.inv(system.normal)[:K, :K], dtype=float),
            orbits=place.orbits,
            gains=tuple(reading.gain for reading in place.readings),
            shifts=tuple(reading.shift for reading in place.readings),
            residuals=tuple(residuals),
            misfits=tuple(misfits),
            rounds=rounds,
        )


def _driven(excitation: Excitation, amplitude: float) -> Excitation:
    return replace(excitation, amplitude=excitation.amplitude * amplitude)


def _precision(obs: Observation) -> Array:
    """(2 nets + 2,) of a reading's numbers; a number that is held has all but infinite."""
    shift = obs.scope.shift if obs.aligned else UNALIGNED
    sigma = [*np.full(len(obs.nets), obs.scope.gain), *obs.room, shift, obs.scope.amplitude]
    return np.asarray(1.0 / np.maximum(np.array(sigma), 1e-9) ** 2)


def _shown(volts: Array, phase: Array, derivative: int = 0) -> Array:
    """(k, columns) a periodic trace (m, columns) of whole drive periods at phases (k,)."""
    periods = len(volts) // POINTS
    closed = np.concatenate([volts, volts[:1]])
    spline = CubicSpline(np.arange(len(closed)) / POINTS, closed, bc_type="periodic")
    return np.asarray(spline(np.mod(phase, periods), derivative))


def _looks(
    prior: Prior, draws: Array, obs: Observation, starts: Sequence[Array]
) -> Iterator[tuple[int, tuple[float, NetOrbit, float]]]:
    """For each of the draws (N, K) that settles: how far the record is from its orbit (in units
    of the objective), the orbit, and the shift at which it is nearest."""
    boards = prior.ensemble(draws)
    which = [i for i in range(len(draws)) for _ in starts]
    asked = np.array([state for _ in draws for state in starts])
    asked = asked.reshape(len(which), len(prior.circuit.states))
    settled = boards.settle(which, [obs.excitation.drive] * len(which), asked)
    best: dict[int, tuple[float, NetOrbit, float]] = {}
    for i, motion in zip(which, settled, strict=True):
        if motion.status is not OrbitStatus.PERIODIC or obs.n not in (None, motion.n):
            continue
        orbit = follow(boards.reduction(i), obs.excitation, obs.nets, motion.start, motion.n)
        if orbit is None:
            continue
        cost, shift = _nearest(obs, orbit)
        if i not in best or cost < best[i][0]:
            best[i] = (cost, orbit, shift)
    yield from best.items()


def _nearest(obs: Observation, orbit: NetOrbit) -> tuple[float, float]:
    """Least cost over the shifts that the record allows, and that shift."""
    width = max(1, len(obs.phase) // LOOK)
    phase, volts = obs.phase[::width], obs.volts[::width]
    sigma = obs.spread_of(np.abs(orbit.volts).max(axis=0)) / np.sqrt(width)
    fine = 1 if obs.aligned else 64
    costs = []
    for k in range(orbit.n * fine):
        shown = _shown(orbit.volts, phase + k / fine)
        rest = (volts - shown - (volts - shown).mean(axis=0)) / sigma
        costs.append((float((rest**2).sum()), k / fine))
    return min(costs)
