"""The board behind a record: the most probable one of the spread, and how well it is known.

Maximum a posteriori by Gauss and Newton (Nocedal and Wright, Numerical Optimization, 2006, chapter
10; Tarantola, Inverse Problem Theory, 2005, chapter 3). The unknowns are the coordinates of the
board (``board_prior.Prior``), and for each record the gain and offset of each channel, its shift in
time and, where nobody knows it better, the generator's amplitude. What is held against the record
is the board's exact orbit, with its linear variation; against a record of the generator switched
off, the board's resonances (``free_decay``).

The linear variation says how a board's orbit moves with the board, all coordinates at once. Along
the orbit x(t) of x' = f(x, t, z), the derivative by a coordinate z_k obeys

    y' = A y + ∂f/∂z_k,

with A and ∂f/∂z_k of the mode that holds. Where a mode begins f is continuous, so y is as well, and
what a coordinate does to a stop is in ∂f/∂z_k of the contact. Steps are those of the orbit's grid:
A by its exponential, ∂f/∂z_k by the trapezoidal rule, a step with an entry or exit shared between
both modes. The orbit's own y closes after n periods. Of a board with dampers in its stops f jumps
there, and none is fitted (``jobs.bench_job.check_fits``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from designer.base.arrays import Array, Index
from designer.base.errors import DesignerError
from designer.circuit.board_modes import ModeRows, mode_rows
from designer.circuit.netlist import Excitation
from designer.circuit.nodal_bandwidth import swinging_sections
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics.attractors import peaks_near, shoot
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.workbench.board_prior import PROBE, Prior
from designer.workbench.free_decay import FreeDecay
from designer.workbench.observation import Observation

POINTS = 512
"""Points of an orbit per drive period."""


@dataclass(frozen=True)
class NetOrbit:
    """A periodic orbit of a board, as voltages of nets."""

    start: Array
    """(states,) state at drive phase 0."""
    n: int
    """Its period in drive periods."""
    volts: Array
    """(n · POINTS, nets) voltages [V]."""
    states: Array
    """(n · POINTS, states) states at the same phases."""
    sides: Index
    """(n · POINTS, clearances) side of the contact there: 1 upper, -1 lower, 0 none."""
    beyond: Array
    """(n · POINTS, clearances, 2) how far past the upper and the lower stop [V]: positive
    in contact; -inf where there is no stop."""
    monodromy: Array
    """(states, states) its matrix over n periods."""

    @property
    def stable(self) -> bool:
        return bool(np.abs(np.linalg.eigvals(self.monodromy)).max() < 1.0)


def follow(
    reduction: Reduction, excitation: Excitation, nets: Sequence[str], near: Array, n: int
) -> NetOrbit | None:
    """The orbit of period n of a board near a start (states,); None where shooting does not arrive
    or the board has no flow."""
    try:
        flow = Flow(reduction.system(), excitation.drive)
        found = shoot(flow, near, n, peak=peaks_near(flow, near))
        if found is None:
            return None
        states = flow.run(found[0], n, points=POINTS).strobes[:-1]
    except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError):
        return None
    if len(states) < n * POINTS:
        return None
    beyond = beyond_stops(reduction, states, excitation)
    volts = net_volts(reduction, states, excitation, nets, sides_of(beyond))
    return NetOrbit(found[0], n, volts, states, sides_of(beyond), beyond, found[1])


def whole_states(states: Array, excitation: Excitation) -> Array:
    """(k, n + 2) what rows of a circuit are over: states (k, n), ``POINTS`` of them a drive period
    from phase 0, the generator [V] and 1."""
    u = excitation.drive.at(2.0 * np.pi * np.arange(len(states)) / POINTS)
    return np.column_stack([states, u, np.ones(len(states))])


def beyond_stops(reduction: Reduction, states: Array, excitation: Excitation) -> Array:
    """(k, clearances, 2) the displacement beyond the upper and the lower stop of each clearance
    [V] along states (k, n) as of ``whole_states``; -inf where there is no stop."""
    whole, system = whole_states(states, excitation), reduction.system()
    out = np.full((len(states), len(reduction.circuit.stops), 2), -np.inf)
    for c in range(out.shape[1]):
        for sign, row in system.contact_rows(c).items():
            out[:, c, 0 if sign > 0 else 1] = whole @ row
    return out


def sides_of(beyond: Array) -> Index:
    """(k, clearances) side of the contact, 1 or -1, of ``beyond_stops``; 0 where there is none."""
    return np.asarray((beyond[..., 0] > 0.0).astype(np.int64) - (beyond[..., 1] > 0.0))


def net_volts(
    reduction: Reduction, states: Array, excitation: Excitation, nets: Sequence[str], sides: Index
) -> Array:
    """(k, nets) voltages [V] along states (k, n) as of ``whole_states``, in contact on ``sides``
    (k, clearances).

    A net behind a dead zone changes its law where contact begins. The steps of a rectifier on the
    way there, microvolts wide, are left out.
    """
    whole = whole_states(states, excitation)
    volts = np.empty((len(states), len(nets)))
    for each in np.unique(sides, axis=0):
        here = (sides == each).all(axis=1)
        key = reduction.circuit.in_contact(each.tolist())
        voltage = reduction.solution(key).voltage
        volts[here] = whole[here] @ np.column_stack([voltage[net] for net in nets])
    return volts


TERMS = 12
"""Terms of Taylor's series of an exponential: 1e-12 where the matrix has a norm of a half."""


@dataclass(frozen=True)
class OrbitSlopes:
    """Derivatives of an orbit by the K coordinates of the board and by the generator's amplitude
    over what it is, which stands last."""

    volts: Array
    """(n · POINTS, nets, K + 1) of its nets' voltages [V]."""
    start: Array
    """(states, K + 1) of its start."""


def orbit_slopes(
    prior: Prior, z: Array, orbit: NetOrbit, excitation: Excitation, nets: tuple[str, ...]
) -> OrbitSlopes:
    """The slopes of the orbit of the board at z (K,) under this setting.

    Where op-amps drive diodes, their lag is left out of the slopes (not of the orbit).
    """
    circuit = prior.circuit
    boards = prior.boards(np.vstack([z, z + PROBE * np.eye(len(z))]))
    sides, which = np.unique(orbit.sides, axis=0, return_inverse=True)
    keys = [circuit.in_contact(each.tolist()) for each in sides]
    if swinging_sections(circuit):
        boards = replace(boards, bandwidth=False)
    modes = [mode_rows(boards, key, nets) for key in keys]
    whole = whole_states(orbit.states[:, : len(circuit.states)], excitation)
    which = which.reshape(-1)
    moved = _variation(modes, which, orbit, whole, excitation)
    volts = np.empty((len(which), len(nets), len(z) + 1))
    for k, mode in enumerate(modes):
        here = which == k
        rows = mode.rows[:, :, :-2]
        volts[here] = np.einsum("ni,mik->mnk", rows[0], moved[here])
        volts[here, :, :-1] += np.einsum("knj,mj->mnk", _change(mode.rows), whole[here])
    more = np.zeros((len(orbit.start) - moved.shape[1], len(z) + 1))
    return OrbitSlopes(volts, np.vstack([moved[0], more]))


def _change(rows: Array) -> Array:
    """(K, ...) derivatives of rows (1 + K, ...) of a board and of those beside it."""
    return np.asarray((rows[1:] - rows[0]) / PROBE)


def _variation(
    modes: list[ModeRows], which: Index, orbit: NetOrbit, whole: Array, excitation: Excitation
) -> Array:
    """(m, states, K + 1) derivatives of the states along the orbit."""
    steps, step = len(which), 1.0 / (excitation.frequency * POINTS)
    n, count = modes[0].rates.shape[1], len(modes[0].rates)
    force = np.zeros((steps, n, count + n))
    for k, mode in enumerate(modes):
        here = which == k
        force[here, :, : count - 1] = np.einsum("kij,mj->mik", _change(mode.rates), whole[here])
        swing = whole[here, n] - excitation.offset
        force[here, :, count - 1] = swing[:, None] * mode.rates[0, :, n]
    after = np.roll(which, -1)
    share = _shares(orbit)
    A = np.stack([mode.rates[0, :, :n] for mode in modes])
    held, at = np.unique(np.column_stack([which, after, share]), axis=0, return_inverse=True)
    first, last, part = held[:, 0].astype(int), held[:, 1].astype(int), held[:, 2, None, None]
    jumps = _exponentials(step * (part * A[first] + (1.0 - part) * A[last]))[at.reshape(-1)]
    # The last n columns are the free motion from each unit vector: the matrix of the whole lap.
    path = np.zeros((steps + 1, n, count + n))
    path[0, :, count:] = np.eye(n)
    for j in range(steps):
        path[j + 1] = jumps[j] @ (path[j] + step * share[j] * force[j])
        path[j + 1] += step * (1.0 - share[j]) * force[(j + 1) % steps]
    lap = path[steps]
    start = np.linalg.solve(np.eye(n) - lap[:, count:], lap[:, :count])
    return np.asarray(path[:steps, :, :count] + path[:steps, :, count:] @ start)


def _exponentials(A: Array) -> Array:
    """(k, n, n) exponentials of small matrices (k, n, n), by Taylor's series of them divided by a
    power of two, then squared: SciPy's, made for large ones, takes a thousand times as long."""
    halvings = max(0, math.ceil(math.log2(max(float(np.abs(A).sum(axis=2).max()), 1e-300))) + 1)
    small, out = A / 2.0**halvings, np.eye(A.shape[1])
    for order in range(TERMS, 0, -1):
        out = np.eye(A.shape[1]) + small @ out / order
    for _ in range(halvings):
        out = out @ out
    return out


def _shares(orbit: NetOrbit) -> Array:
    """(m,) how much of each step of the grid its first mode holds; a half where it does not
    change."""
    share = np.full(len(orbit.sides), 0.5)
    after, ahead = np.roll(orbit.sides, -1, axis=0), np.roll(orbit.beyond, -1, axis=0)
    for j, c in zip(*np.nonzero(after != orbit.sides), strict=True):
        side = orbit.sides[j, c] or after[j, c]
        k = 0 if side > 0 else 1
        here, there = orbit.beyond[j, c, k], ahead[j, c, k]
        share[j] = float(np.clip(here / (here - there), 0.0, 1.0)) if here != there else 0.5
    return share


LOOK = 1024
"""Samples of a record that it takes."""
SAME = 1e-6
"""Relative difference of two starts of one orbit."""


@dataclass(frozen=True)
class OrbitMatch:
    """How far a record is from an orbit, at the shift at which it is nearest."""

    cost: float
    """Squares of what is left of the record, over what is allowed for."""
    orbit: NetOrbit
    shift: float
    """The shift in time [drive periods]."""


def matches(
    prior: Prior, draws: Array, obs: Observation, starts: Sequence[Array]
) -> dict[int, OrbitMatch]:
    """For each of the boards at draws (N, K) that settles on the record's period from one of the
    starts, by its number: its orbit that is nearest to the record."""
    boards = prior.ensemble(draws)
    which = [i for i in range(len(draws)) for _ in starts]
    asked = np.array([state for _ in draws for state in starts])
    asked = asked.reshape(len(which), len(prior.circuit.states))
    settled = boards.settle(which, [obs.excitation.drive] * len(which), asked)
    best: dict[int, OrbitMatch] = {}
    seen: dict[int, list[Array]] = {}
    for i, motion in zip(which, settled, strict=True):
        if motion.status is not OrbitStatus.PERIODIC or obs.n not in (None, motion.n):
            continue
        known = seen.setdefault(i, [])
        if any(np.allclose(motion.start, start, rtol=SAME, atol=0.0) for start in known):
            continue
        known.append(motion.start)
        orbit = follow(boards.reduction(i), obs.excitation, obs.nets, motion.start, motion.n)
        look = None if orbit is None else _nearest(obs, orbit)
        if look is not None and (i not in best or look.cost < best[i].cost):
            best[i] = look
    return best


def _nearest(obs: Observation, orbit: NetOrbit) -> OrbitMatch:
    """The match at the best of the shifts that the record allows."""
    width = max(1, len(obs.phase) // LOOK)
    phase, volts = obs.phase[::width], obs.volts[::width]
    sigma = obs.spread_of(np.abs(orbit.volts).max(axis=0)) / np.sqrt(width)
    fine = 1 if obs.aligned else 64
    costs = []
    for k in range(orbit.n * fine):
        shown = interpolated(orbit.volts, phase + k / fine)
        rest = (volts - shown - (volts - shown).mean(axis=0)) / sigma
        costs.append((float((rest**2).sum()), k / fine))
    cost, shift = min(costs)
    return OrbitMatch(cost, orbit, shift)


def interpolated(values: Array, phase: Array) -> Array:
    """(k, ...) periodic values (m, ...) of whole drive periods at phases (k,), straight between the
    points of the grid."""
    place = phase * POINTS
    cell = np.floor(place).astype(np.int64)
    share = (place - cell).reshape(-1, *(1,) * (values.ndim - 1))
    size = len(values)
    return np.asarray((1.0 - share) * values[cell % size] + share * values[(cell + 1) % size])


DRAWS, MORE = 16, 96
"""Boards of the spread whose orbits are held against a record first, the nominal one among them;
and where none of them has orbits like all records."""
ROUNDS = 16
"""Steps of Gauss and Newton at most."""
DAMPINGS = (0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0)
"""The dampings of a step, over the diagonal of its matrix: the next where one leads to no better
board."""
STARTS, GOOD = 4, 1.5
"""Boards from which the search begins, one after the other, until the misfit is good."""
LONGEST = 2.0
"""Standard deviations that a step moves a coordinate at most."""
ENOUGH = 0.02
"""The gain that ends the search, in the objective: minus twice the logarithm of the probability."""
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
    observations: tuple[Observation, ...]
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
    the spread and the scope keeps what is stated of it. Then those of the free decays."""
    rounds: int
    """Steps that the search took."""

    @property
    def determined(self) -> float:
        """How many numbers the records tell of the board, a coordinate of one each."""
        return float(len(self.centre) - np.trace(self.covariance))

    def shown(self, record: int, phase: Array) -> Array:
        """(k, nets) what a record shows of the orbit at phases (k,) of its observation [V], but for
        a constant."""
        orbit = _shown(self.orbits[record].volts, phase + self.shifts[record])
        return np.asarray(self.gains[record] * orbit)

    def samples(self, count: int, seed: int = 0) -> Array:
        """(count, K) boards as probable as the records leave them; the first is the centre."""
        root = np.linalg.cholesky(self.covariance + 1e-12 * np.eye(len(self.centre)))
        normal = np.random.default_rng(seed).standard_normal((count, len(self.centre)))
        normal[0] = 0.0
        return np.asarray(self.centre + normal @ root.T)


def fit_board(
    prior: Prior,
    observations: Sequence[Observation],
    starts: Sequence[Sequence[Array]],
    decays: Sequence[FreeDecay] = (),
) -> BoardFit:
    """The board that these records are of, one or more.

    starts : for each record the states (states,) from which a board may have come to its motion:
    those of the nominal board's orbits there. decays : records of its free motion.

    Raises
    ------
    NoSuchBoard : no board of the spread settles from these starts on an orbit of the records'
        periods, so there is nothing to begin with.
    """
    problem = _Problem(prior, tuple(observations), tuple(decays))
    draws = prior.draws(DRAWS)
    if decays:  # they know resonances so well that only boards near the right ones lead there
        draws = fit_board(prior, observations, starts).samples(DRAWS)
    candidates = problem.candidates(starts, draws)
    if not candidates:
        candidates = problem.candidates(starts, _more_draws(problem, starts))
    if not candidates:
        raise NoSuchBoard(
            f"none of {MORE} boards, of the spread or as the other records leave them, settles on "
            "motions of these periods at all of these settings"
        )
    best: tuple[BoardFit, float] | None = None
    for candidate in candidates[:STARTS]:
        fit = problem.climbed(candidate)
        if best is None or fit[1] < best[1]:
            best = fit
        if max(best[0].misfits) < GOOD:
            break
    assert best is not None
    return best[0]


def _more_draws(problem: _Problem, starts: Sequence[Sequence[Array]]) -> Array:
    """(MORE, K) boards to begin with where ``DRAWS`` do not do: as probable as those records leave
    them that any board settled on. A motion of several periods, say, few boards have."""
    usual = [i for i, looks in enumerate(problem.looks) if looks]
    if not usual or len(usual) == len(problem.observations):
        return problem.prior.draws(MORE)
    observations = [problem.observations[i] for i in usual]
    return fit_board(problem.prior, observations, [starts[i] for i in usual]).samples(MORE)


@dataclass(frozen=True)
class _Linearised:
    """normal (m, m) and gradient (m,) of half the objective by z, then each record's reading; the
    slopes (states, K + 1) of each orbit's start, see ``OrbitSlopes``."""

    normal: Array
    gradient: Array
    starts: tuple[Array, ...]


class _Problem:
    def __init__(
        self, prior: Prior, observations: tuple[Observation, ...], decays: tuple[FreeDecay, ...]
    ) -> None:
        self.prior, self.observations, self.decays = prior, observations, decays
        self.looks: list[dict[int, OrbitMatch]] = []
        self.centres: list[_Reading] = []
        self.sigmas: list[Array] = []

    def candidates(
        self, starts: Sequence[Sequence[Array]], draws: Array
    ) -> list[tuple[Array, list[OrbitMatch]]]:
        """The boards among (N, K) that settle on motions like all records, with their orbits, the
        nearest first."""
        self.looks = [
            matches(self.prior, draws, obs, states)
            for obs, states in zip(self.observations, starts, strict=True)
        ]
        common = set.intersection(*(set(look) for look in self.looks))
        order = sorted(
            common, key=lambda i: sum(look[i].cost for look in self.looks) + self._decayed(draws[i])
        )
        return [(draws[i], [look[i] for look in self.looks]) for i in order]

    def climbed(self, candidate: tuple[Array, list[OrbitMatch]]) -> tuple[BoardFit, float]:
        """The most probable board that is found from a candidate, with its objective."""
        z, looks = candidate
        self.centres, self.sigmas = [], []
        for obs, look in zip(self.observations, looks, strict=True):
            nets = len(obs.nets)
            self.centres.append(_Reading(np.ones(nets), np.zeros(nets), look.shift))
            self.sigmas.append(obs.spread_of(np.abs(look.orbit.volts).max(axis=0)))
        place = _Place(z, tuple(look.orbit for look in looks), tuple(self.centres))
        worth, gain, rounds = self.objective(place), np.inf, 0
        while gain > ENOUGH and rounds < ROUNDS:
            rounds += 1
            better = self.step(place, worth, self.linearised(place))
            if better is None:
                break
            gain = worth - better[1]
            place, worth = better
        return self.answer(place, rounds), worth

    def objective(self, place: _Place) -> float:
        """Minus twice the logarithm of the probability, but for a constant."""
        total = float(place.z @ place.z) + self._decayed(place.z)
        for i, obs in enumerate(self.observations):
            total += float((self._residual(i, place) ** 2).sum())
            off = place.readings[i].vector - self.centres[i].vector
            total += float((off**2 * _precision(obs)).sum())
        return total

    def _decayed(self, z: Array) -> float:
        """What the free decays add to the objective."""
        rest = (decay.of_board(self.prior, z) for decay in self.decays)
        return float(sum(r @ r for r in rest))

    def _residual(self, i: int, place: _Place) -> Array:
        """(k, nets) what is left of a record, over what is allowed for."""
        obs, reading = self.observations[i], place.readings[i]
        shown = _shown(place.orbits[i].volts, obs.phase + reading.shift)
        return np.asarray((obs.volts - reading.gain * shown - reading.offset) / self.sigmas[i])

    def linearised(self, place: _Place) -> _Linearised:
        """The objective about a place, by the slopes of the exact orbits."""
        K, readings = len(place.z), [len(r.vector) for r in place.readings]
        normal = np.zeros((K + sum(readings),) * 2)
        gradient = np.zeros(len(normal))
        normal[:K, :K], gradient[:K] = np.eye(K), place.z
        for decay in self.decays:
            slope = decay.slopes(self.prior, place.z)
            normal[:K, :K] += slope.T @ slope
            gradient[:K] += slope.T @ decay.of_board(self.prior, place.z)
        moved, first = [], K
        for i, (obs, size) in enumerate(zip(self.observations, readings, strict=True)):
            slopes = self._slopes(i, place)
            J = self._residual_slopes(i, place, slopes)
            r = self._residual(i, place).ravel()
            at = np.r_[0:K, first : first + size]
            normal[np.ix_(at, at)] += J.T @ J
            gradient[at] -= J.T @ r
            known = _precision(obs)
            own = np.arange(first, first + size)
            normal[own, own] += known
            gradient[own] += known * (place.readings[i].vector - self.centres[i].vector)
            moved.append(slopes.start)
            first += size
        return _Linearised(normal, gradient, tuple(moved))

    def _slopes(self, i: int, place: _Place) -> OrbitSlopes:
        obs = self.observations[i]
        drive = _driven(obs.excitation, place.readings[i].amplitude)
        return orbit_slopes(self.prior, place.z, place.orbits[i], drive, obs.nets)

    def _residual_slopes(self, i: int, place: _Place, slopes: OrbitSlopes) -> Array:
        """(k · nets, K + reading) of what is shown, over what is allowed for, by the coordinates of
        the board, then the reading's own numbers."""
        obs, reading, sigma = self.observations[i], place.readings[i], self.sigmas[i]
        nets, volts = len(obs.nets), place.orbits[i].volts
        phase = obs.phase + reading.shift
        by_board = interpolated(slopes.volts, phase) * (reading.gain / sigma)[:, None]
        shown, rate = _shown(volts, phase), _shown(volts, phase, 1)
        own = np.zeros((len(phase), nets, 2 * nets + 2))
        for c in range(nets):
            own[:, c, c] = shown[:, c] / sigma[c]
            own[:, c, nets + c] = 1.0 / sigma[c]
        own[:, :, -2] = reading.gain * rate / sigma
        own[:, :, -1] = by_board[:, :, -1] / reading.amplitude
        return np.concatenate([by_board[:, :, :-1], own], axis=2).reshape(len(phase) * nets, -1)

    def step(self, place: _Place, worth: float, system: _Linearised) -> tuple[_Place, float] | None:
        """A more probable place, with as little damping (Levenberg and Marquardt) as leads to one;
        None where none does."""
        K = len(place.z)
        for damping in DAMPINGS:
            damped = system.normal + damping * np.diag(np.diag(system.normal))
            move: Array = np.asarray(-np.linalg.solve(damped, system.gradient), dtype=float)
            move /= max(1.0, float(np.abs(move[:K]).max()) / LONGEST)
            there = self._moved(place, move, system)
            if there is not None:
                now = self.objective(there)
                if now < worth:
                    return there, now
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
            louder = new.amplitude / reading.amplitude - 1.0
            first += size
            near = orbit.start + slope @ np.append(move[: len(z)], louder)
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
        decayed = [decay.of_board(self.prior, place.z) for decay in self.decays]
        misfits += [float(np.sqrt((rest**2).mean())) for rest in decayed]
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
