"""The numerics gate: which ngspice settings may decide on a response.

Before ngspice's verdict counts, two step sizes and two integration methods must agree with the
exact circuit on n-p-q, and with each other on every strobe within a stated bound; with ideal
op-amps the wave itself must be the exact circuit's, within another. Where the exact
circuit's response is not periodic there is no strobe and no wave to compare: the three runs must
only call it what the exact circuit does. The largest step is min(T/200, shortest contact/N): it
follows the contact, for T/200 miscounts the eight-impact response; a harmonic of the generator's
voltage has 50 steps. All bounds are halved together
until the settings pass, which finds N.

At the fidelity ``ideal`` the start is right and two periods are enough. Op-amps with a pole and a
slew limit have an orbit of their own nearby, so there is a way to go, which shrinks by the
multiplier ρ with every n periods: after k of them c·ρᵏ is left. c is read off a short run of that
fidelity (how far the strobe still moves, over 1 - ρ). ρ is the exact circuit's, or what the short
run shows where that is slower: the fidelity's own orbit may be less stable.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array
from designer.base.defaults import Fidelity
from designer.base.progress import doing
from designer.base.reason import Reason
from designer.circuit.board_values import Board
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.counts import MAX_PERIOD
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import PiecewiseLinearSystem
from designer.spice import convergence_aids as remedies, deck
from designer.spice.convergence_aids import AidedRun, Remedy, Task
from designer.spice.deck import SolverSettings
from designer.spice.opamp_model import LIMIT_RANGE
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import (
    BRIEF,
    STROBE_TOLERANCE,
    LinearOutput,
    Read,
    Reading,
    clearance_rows,
    name_in_ngspice,
    read,
)
from designer.spice.simulator import SimulationFailed, SpiceJob

PROBE = 12
"""Laps of n periods in the short run. The first strobe is left out: op-amps with a memory settle
within microseconds of the start, but not before it."""
SLOWEST = 0.999
"""A multiplier that a short run seems to show above this one is taken for this one."""


def settling_periods(strobes: Array, n: int, radius: float, peak: Array) -> tuple[int, float]:
    """Drive periods until the predicted remainder is below the strobe tolerance, and ρ a lap.

    strobes : (k, states) of the short run from its start, every drive period. radius : the exact
    circuit's. peak : (states,).
    """
    laps = strobes[n::n]
    moves = (np.abs(np.diff(laps, axis=0)) / peak).max(axis=1)
    rho = max(radius, _seen(moves)) if math.isfinite(radius) else _seen(moves)
    rho = min(max(rho, 1e-3), SLOWEST)
    left = moves / (1.0 - rho)
    far = np.flatnonzero(left > STROBE_TOLERANCE)
    if len(far) == 0:
        return n, rho
    last = int(far[-1])
    if last + 1 < len(left):
        return n * (last + 2), rho
    more = math.ceil(math.log(STROBE_TOLERANCE / left[-1]) / math.log(rho))
    return n * (last + 1 + more), rho


def _seen(moves: Array) -> float:
    """Geometric mean of the last ratios of successive moves; 0 where they are lost in noise."""
    quiet = 0.05 * STROBE_TOLERANCE
    tail = moves[-5:]
    if len(tail) < 2 or tail.min() < quiet:
        return 0.0
    return float((tail[-1] / tail[0]) ** (1.0 / (len(tail) - 1)))


STEPS_PER_PERIOD, STEPS_PER_CONTACT, STEPS_PER_WAVE = 200, 20, 50
MOST_STEPS = 40_000
"""The most steps of a period at the first level: a contact shorter than T/2000 gets fewer steps
than others. A run of more would take minutes, and such an orbit is next to grazing."""
LEVELS = 5
"""How often the step is halved before the gate gives up."""
REMEDIES_OF_GATE: tuple[Remedy, ...] = ("tolerance", "start")
"""Remedies inside the gate: steps and methods are what it compares, so they stay as they are."""
BOUND = 1e-3
"""The bound on strobes, over the peak: half the strobe tolerance, so that boards that differ have
room too."""
WAVE_BOUND = 2e-3
"""The bound on the wave, over the peak: RMS over the last n periods of ngspice, with ideal op-amps,
less the exact circuit's."""
RELTOL = 1e-5
"""ngspice's relative tolerance. At 1e-4, for a tenth less time, errors at the kinks are double."""
DISCARD = 2
"""Periods left out after a start on the exact circuit's orbit."""
MOST_DISCARDED = 400
"""Drive periods: no run at any fidelity discards more."""
WAVE_POINTS = 20_000
"""Points of a period of the exact wave, so many that straight lines join them."""
SHORTEST = 8
"""Drive periods of the shortest run: a lap of one period is then judged over six."""


@dataclass(frozen=True)
class GateResult:
    """How ngspice's settings for a response were found, and the run at these settings."""

    settings: SolverSettings
    """The settings that passed, or the finest that were tried."""
    passed: bool
    """Whether any settings passed."""
    difference: float
    """Largest strobe difference between the runs, of the peak."""
    read: Read | SimulationFailed
    """The run at ``settings``."""
    tried: tuple[int, ...]
    """Steps a period that were tried."""
    contact_steps: float = float("nan")
    """N, largest steps in the shortest contact at ``settings`` (nan without contact)."""
    remedies: tuple[Remedy, ...] = ()
    """What the run at ``settings``, or its companions, needed besides."""
    discarded: int = DISCARD
    """Drive periods before the run was judged."""
    wave: float = float("nan")
    """``wave_error`` of the run at ``settings``; nan where it is not periodic, as ``difference``
    is."""
    wave_bound: float = float("nan")
    """What ``wave`` was held to; nan where the run is not periodic, and above the fidelity
    ``ideal``."""

    @property
    def why(self) -> str:
        """Why it did not pass, at the finest step tried; empty where it did."""
        if isinstance(self.read, SimulationFailed):
            return "" if self.passed else self.read.reason
        return ", ".join(map(str, self.doubts))

    @property
    def doubts(self) -> tuple[Reason, ...]:
        """What the runs that there are were found not to do; none where they passed."""
        if self.passed or isinstance(self.read, SimulationFailed):
            return ()
        reasons = []
        if self.difference > BOUND:
            differ = f"strobes differ by more than {BOUND:g} of the peak"
            reasons.append(Reason(differ, f"by {self.difference:.1g}"))
        if self.wave > self.wave_bound:
            off = f"by {self.wave:.1g} of the peak, bound {self.wave_bound:.1g}"
            reasons.append(
                Reason("the wave is off the exact circuit's by more than its bound", off)
            )
        other = "its runs do not all show the exact circuit's response"
        shown = f"the coarsest shows {self.read.orbit.response}"
        return tuple(reasons) or (Reason(other, shown),)

    def as_dict(self) -> dict[str, object]:
        """The settings and what they passed, for provenance."""
        return {
            **self.settings.as_dict(),
            "passed": self.passed,
            "difference": self.difference,
            "bound": BOUND,
            "rms": self.wave,
            "rms_bound": self.wave_bound,
            "steps_a_period": self.tried[-1],
            "steps_a_contact": self.contact_steps,
            "steps_tried": list(self.tried),
            "remedies": list(self.remedies),
            "discarded_periods": self.discarded,
        }


@dataclass(frozen=True)
class GateSubject:
    """One response of one board (a reduction): what a run of ngspice needs."""

    reduction: Reduction
    """The reduction of the board's circuit."""
    excitation: Excitation
    """The generator's setting."""
    orbit: Orbit
    """Orbit on the exact circuit; its n sets the length of the run."""
    start: Array | None = None
    """(states,) capacitor voltages at t = 0 if not the orbit's."""
    discard: int = DISCARD
    """Periods left out before the run is judged."""
    fidelity: Fidelity = "ideal"
    """The op-amps' model in ngspice."""
    judged: int = 0
    """Periods that are judged at least."""
    brief: bool = False
    """Whether half as many strobes may show that there is no period, where the exact circuit has
    none."""

    @property
    def circuit(self) -> Circuit:
        return self.reduction.circuit

    @property
    def laps(self) -> int:
        """Drive periods after which ngspice is to repeat; 0 where the orbit has no period or one
        that is not looked for there."""
        return self.orbit.n if self.orbit.n <= MAX_PERIOD else 0

    @property
    def board(self) -> Board:
        return self.reduction.board

    @cached_property
    def system(self) -> PiecewiseLinearSystem:
        return self.reduction.system()

    @property
    def shift(self) -> Array:
        """(states,) voltages of the state nets with every capacitor discharged: offsets."""
        solved = self.reduction.solution(self.system.start)
        return np.array([solved.voltage[net][-1] for net in self.circuit.state_nets])

    @property
    def period(self) -> float:
        return 1.0 / self.excitation.frequency


def job(
    subject: GateSubject,
    settings: SolverSettings,
    nudge: float = 0.0,
    *,
    keep: bool = False,
    whole: bool = False,
    patience: float = 1.0,
) -> SpiceJob[Read]:
    """The run of one subject: what it discards, and at least 4n periods to judge.

    Where the exact circuit has no period, ngspice is given enough to find any up to the largest.
    nudge : fraction by which every initial voltage is raised (``remedies``). whole : nothing is
    left out of the strobes, for a look at the way itself. patience : how many times the pool's
    time it may take.
    """
    stop = length(subject) * subject.period
    start = subject.orbit.start if subject.start is None else subject.start
    capacitors = start[: len(subject.circuit.states)]
    reading = Reading(
        period=subject.period,
        discard=0 if whole else subject.discard,
        nets=subject.circuit.state_nets,
        shift=subject.shift,
        clearances=clearance_rows(subject.system),
        generator=subject.circuit.generator.net,
        outputs=linear_outputs(subject),
        keep=keep,
        brief=subject.brief and not subject.laps,
    )
    # A period before the first strobe, for the points around it: a long way takes no memory.
    kept = 0.0 if whole else max(subject.discard - 1, 0) * subject.period
    also = [output.net for output in reading.outputs]
    text = deck_of(subject, settings, (1.0 + nudge) * capacitors, stop, kept, also)
    nets = (*subject.circuit.state_nets, subject.circuit.generator.net, *also)
    signals = tuple(dict.fromkeys(nets))
    return SpiceJob(text, signals, stop, partial(read, reading=reading), patience=patience)


def linear_outputs(subject: GateSubject) -> tuple[LinearOutput, ...]:
    """The outputs that ought to be linear, and from where on they are not; none on ``full``, where
    limits move with the current."""
    if subject.fidelity == "full":
        return ()
    circuit, out = subject.circuit, []
    for section in circuit.sections:
        low, high = subject.board.rails[section.name]
        low = -math.inf if circuit.may_limit(section, -1) else low + LIMIT_RANGE
        high = math.inf if circuit.may_limit(section, 1) else high - LIMIT_RANGE
        if math.isfinite(low) or math.isfinite(high):
            out.append(LinearOutput(section.output, low, high))
    return tuple(out)


def deck_of(
    subject: GateSubject,
    settings: SolverSettings,
    capacitors: Array,
    stop: float,
    kept: float,
    also: Sequence[str] = (),
) -> str:
    """The deck of a subject from capacitor voltages (states,) at t = 0 until ``stop`` [s]; what
    comes before ``kept`` [s] is not stored. also : nets that are, besides states and generator."""
    return deck.write(
        subject.circuit,
        subject.board,
        subject.excitation,
        settings,
        title="one response of one board",
        stop_time=stop,
        initial=capacitors,
        fidelity=subject.fidelity,
        kept_from=kept,
        stage=False,
        also=also,
        bounded=True,
    )


def length(subject: GateSubject) -> int:
    """Drive periods that the run of a subject takes."""
    unperiodic = BRIEF if subject.brief else 4 * MAX_PERIOD
    judged = max(4 * subject.laps or unperiodic, subject.judged)
    return max(subject.discard + judged, SHORTEST)


def task(
    subject: GateSubject,
    settings: SolverSettings,
    *,
    keep: bool = False,
    whole: bool = False,
    patience: float = 1.0,
) -> Task[Read]:
    """The run as one that remedies may change."""
    return Task(partial(job, subject, keep=keep, whole=whole, patience=patience), settings)


def shortest_contact(orbit: Orbit, system: PiecewiseLinearSystem, excitation: Excitation) -> float:
    """Length [s] of the orbit's shortest contact; the period where there is none.

    On `WAVE_POINTS` a period, round the n periods. Where an impact of the orbit shows on no point
    its contact is shorter than the distance of two, which is then the answer.
    """
    period = 1.0 / excitation.frequency
    if orbit.n == 0 or len(orbit.impact_times) == 0:
        return period
    flow = Flow(system, excitation.drive)
    apart = period / WAVE_POINTS
    lap = flow.run(orbit.start, orbit.n, mode=orbit.mode or None, points=WAVE_POINTS).strobes[:-1]
    u = excitation.drive.at(2.0 * np.pi * np.arange(len(lap)) / WAVE_POINTS)
    shortest = period
    stops = [
        (k, side, row)
        for k in range(len(system.clearances))
        for side, row in sorted(system.contact_rows(k).items(), reverse=True)
    ]
    for k, side, row in stops:
        touching = lap @ row[:-2] + row[-2] * u + row[-1] > 0.0
        lengths = contact_lengths(touching)
        mine = (orbit.impact_sides == side) & (orbit.impact_clearances == k)
        entries = orbit.impact_times[mine]
        # One further as well: rounding may put an entry on the wrong side of a point.
        after = (entries // apart).astype(int)[:, None] + [1, 2]
        is_sampled = touching[after % len(touching)].any(axis=1)
        points = [*lengths, *np.ones(int(np.sum(~is_sampled)))]
        shortest = min([shortest, *(float(k) * apart for k in points)])
    return shortest


def contact_lengths(touching: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(contacts,) points in each stretch of a lap (points,) in contact; the lap is closed."""
    outside = np.flatnonzero(~touching)
    if not len(outside):
        return outside
    # Turned to begin outside, so that no stretch goes across its ends.
    change = np.diff(np.roll(touching, -outside[0]).astype(int), append=0)
    return np.flatnonzero(change < 0) - np.flatnonzero(change > 0)


def first_steps(subject: GateSubject, contact: float) -> int:
    """Steps of a period that the first level takes; contact : length of the shortest [s]."""
    wanted = int(np.ceil(STEPS_PER_CONTACT * subject.period / contact))
    wave = STEPS_PER_WAVE * max(subject.excitation.drive.orders, default=1)
    return min(max(STEPS_PER_PERIOD, wanted, wave), MOST_STEPS)


def check(
    pool: SpicePool, subjects: Sequence[GateSubject], levels: int = LEVELS
) -> list[GateResult]:
    """Find the coarsest settings that pass, for the nominal board of each response.

    All subjects move through the levels together, so that the workers stay busy. At a fidelity
    above ``ideal`` a short run first says how many periods are discarded (``warm_start``). levels :
    how many step sizes are tried.
    """
    subjects = warmed(pool, subjects)
    contacts = [shortest_contact(s.orbit, s.system, s.excitation) for s in subjects]
    steps = [first_steps(s, contact) for s, contact in zip(subjects, contacts, strict=True)]
    results: list[GateResult | None] = [None] * len(subjects)
    tried: list[list[int]] = [[] for _ in subjects]
    for level in range(levels):
        open_ = [i for i, r in enumerate(results) if r is None or not r.passed]
        tasks = []
        for i in open_:
            tried[i].append(steps[i] * 2**level)
            trio = _trio(subjects[i].period / tried[i][-1])
            tasks += [task(subjects[i], settings, keep=True) for settings in trio]
        outcomes = {}
        for number, outcome in remedies.run(pool, tasks, REMEDIES_OF_GATE):
            outcomes[number] = outcome
            text = f"{len(outcomes)} of {len(tasks)} runs"
            doing(f"step size {level + 1} of at most {levels}: {text}")
        for k, i in enumerate(open_):
            runs = [outcomes[3 * k + j] for j in range(3)]
            results[i] = _judge(subjects[i], runs, tuple(tried[i]), contacts[i])
    return [r for r in results if r is not None]


def warmed(pool: SpicePool, subjects: Sequence[GateSubject]) -> list[GateSubject]:
    """The subjects with the periods that each has to discard at its fidelity, from a short run."""
    out = list(subjects)
    indices = [i for i, s in enumerate(subjects) if s.fidelity != "ideal" and s.laps]
    tasks = []
    for i in indices:
        s = subjects[i]
        contact = shortest_contact(s.orbit, s.system, s.excitation)
        steps = 2 * first_steps(s, contact)
        probe = replace(s, discard=max(PROBE - 4, 0) * s.laps)
        tasks.append(task(probe, SolverSettings("trap", s.period / steps, RELTOL), whole=True))
    for k, outcome in remedies.run(pool, tasks):
        s = subjects[indices[k]]
        if isinstance(outcome.result, Read):
            read, orbit = outcome.result, s.orbit
            peak = orbit.coarse_peaks
            periods, _ = settling_periods(read.strobes, orbit.n, orbit.radius, peak)
            out[indices[k]] = replace(s, discard=min(max(periods, DISCARD), MOST_DISCARDED))
    return out


def wave_bound(orbit: Orbit) -> float:
    """Tighter where the orbit is slow: errors of each period add up, to 1/(1 - ρ) of one."""
    return WAVE_BOUND * min(1.0, 5.0 * (1.0 - orbit.radius)) if orbit.radius < 1.0 else WAVE_BOUND


def wave_error(subject: GateSubject, read: Read) -> float:
    """RMS over the last n periods of ngspice less exact circuit, of the peak of each state, worst.

    ``read`` has its trace; the exact wave starts at the orbit's strobe that is nearest to
    ngspice's. nan without a period or where n differs.
    """
    orbit = subject.orbit
    if orbit.status is not OrbitStatus.PERIODIC or read.trace is None or read.orbit.n != orbit.n:
        return float("nan")
    flow = Flow(subject.system, subject.excitation.drive)
    peak = orbit.coarse_peaks
    time, states = read.trace
    laps = flow.run(orbit.start, orbit.n, mode=orbit.mode or None).strobes[:-1]
    start = laps[int(np.argmin((np.abs(laps - states[0]) / peak).max(axis=1)))]
    exact = flow.run(start, orbit.n, points=WAVE_POINTS).strobes
    grid = np.arange(len(exact)) * subject.period / WAVE_POINTS
    # At ngspice's own points, in time: what lies between them is no part of its answer.
    there = np.stack([np.interp(time, grid, column) for column in exact.T], axis=1)
    square = np.trapezoid((states - there) ** 2, time, axis=0) / (time[-1] - time[0])
    return float((np.sqrt(square) / peak).max())


def _trio(step: float) -> tuple[SolverSettings, SolverSettings, SolverSettings]:
    """The settings under test, the same at half the step, and the other method."""
    return (
        SolverSettings("trap", step, RELTOL),
        SolverSettings("trap", step / 2.0, RELTOL),
        SolverSettings("gear", step / 2.0, RELTOL),
    )


def _judge(
    subject: GateSubject, runs: Sequence[AidedRun[Read]], tried: tuple[int, ...], contact: float
) -> GateResult:
    settings, read = runs[0].settings, runs[0].result
    needed = {r for run in runs for r in run.tried}
    good = [run.result for run in runs if isinstance(run.result, Read)]
    wanted = subject.orbit
    difference, wave, bound, passed = float("nan"), float("nan"), float("nan"), False
    if wanted.status is OrbitStatus.PERIODIC and subject.fidelity == "ideal":
        bound = wave_bound(wanted)
    if len(good) == len(runs):
        passed = all(r.orbit.response == name_in_ngspice(wanted.response) for r in good)
        wave = wave_error(subject, good[0])
        if wanted.status is OrbitStatus.PERIODIC:
            peak = wanted.coarse_peaks
            last = [r.strobes[-wanted.n :] for r in good]
            difference = max(float((np.abs(a - b) / peak).max()) for a, b in combinations(last, 2))
            passed = passed and difference <= BOUND
            passed = passed and (subject.fidelity != "ideal" or wave <= bound)
    return GateResult(
        settings,
        passed,
        difference,
        read,
        tried,
        contact / settings.max_step if len(wanted.impact_times) else float("nan"),
        tuple(r for r in REMEDIES_OF_GATE if r in needed),
        subject.discard,
        wave,
        bound,
    )
