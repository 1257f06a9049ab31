"""What a person with an oscilloscope and a generator finds: the procedure of docs/bench.md, played.

The person sees v1 and fv on a screen of 8 bits: readings are off by up to one step of the screen,
low pulses and small differences between periods are not seen. Where the person stops, the exact
circuit says what the response really is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.counts import MAX_PERIOD, Counts
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.piecewise_linear import PiecewiseLinearSystem
from designer.model.tuning_bands import Bands
from designer.verdicts.verdict import Question
from designer.yields.adjustment import AS_BUILT, Adjustment

BITS = 8
SCREEN = 2.5
"""Volts on the whole screen, over the nominal response's peak."""
READINGS = 4
"""Readings that the person takes the mean of."""
SEEN = 0.002
"""Of the nominal response's deepest penetration: lower pulses of fv, and shallower valleys between
two, are not seen. A step of the screen with fv magnified five times."""
DWELL = 100
"""Drive periods that the person waits after each change."""
WATCHED = 16
"""Drive periods on the screen; three times the wanted n where that is more."""
POINTS = 512
"""Points of the trace per drive period."""
FIRST_OFFSET = 0.01
"""Of the amplitude: the first change of the DC offset, and half of the largest."""
CENTRING_STEPS = 6
"""Settings of the DC offset that the person tries at most."""
FREQUENCY_STEPS = 5
"""Steps from the middle of the frequency band to its edge."""
AMPLITUDES = (0.0, -0.5, 0.5, -1.0, 1.0)
"""Of the half-band: amplitudes at which the frequency is swept, in order."""
MOST_STEPS = 1 + CENTRING_STEPS + 2 * FREQUENCY_STEPS + 4 * (2 * FREQUENCY_STEPS + 1)
"""Settings of the generator after which the person gives up."""
DIGITS = 4
"""Decimals of the DC offset over the amplitude that the generator is set to."""
TAG = 0xBE7C
"""Sets the readings' noise apart from the other draws of a sample."""


@dataclass(frozen=True)
class BenchResult:
    """Where the person at the bench stopped."""

    setting: Adjustment
    """The setting of the generator there."""
    state: Array
    """(states,) state of the board there, at drive phase 0."""
    seen: bool
    """Whether the wanted pattern was on the screen."""
    steps: int
    """Settings tried, the first one included."""
    failure: str = ""
    """Why the procedure could not be played; "" where it was."""


def find_on_bench(
    system: PiecewiseLinearSystem, question: Question, bands: Bands, *, seed: Sequence[int]
) -> BenchResult:
    """Play the procedure on one board, from the nominal orbit at the setting of ``setup.csv``.

    seed : of the readings. Where the pattern is seen nowhere, the setting is the one as built.
    """
    person = _Person(system, question, bands, np.random.default_rng([*seed, TAG]))
    is_seen = person.look(AS_BUILT) or person.centre() or person.sweep()
    return BenchResult(person.setting if is_seen else AS_BUILT, person.state, is_seen, person.steps)


class _Person:
    """At the bench with one board: what is on the screen and where the knobs are.

    state : (states,) of the board at drive phase 0. high, low : of v1, as read.
    """

    def __init__(
        self,
        system: PiecewiseLinearSystem,
        question: Question,
        bands: Bands,
        rng: np.random.Generator,
    ) -> None:
        self.system, self.question, self.bands, self.rng = system, question, bands, rng
        extremes = _extremes(system, question)
        peak = float(np.abs(extremes[system.moving]).max())
        self.step = SCREEN * peak / 2**BITS
        self.stages = [
            _Stage.of(system, index, extremes) for index in range(len(system.clearances))
        ]
        self.stops = dict(self.stages[0].stops) if self.stages else {}
        self.state = question.start.start
        self.setting = AS_BUILT
        self.high = self.low = 0.0
        self.steps = 0

    def look(self, setting: Adjustment) -> bool:
        """Set the generator, wait, look: whether the wanted pattern is on the screen."""
        self.setting = setting
        self.steps += 1
        wanted = self.question.wanted.expect
        # A motion without a period is one that the screen shows to repeat after none.
        n = wanted.n if isinstance(wanted, Counts) else MAX_PERIOD
        periods = n * max(-(-WATCHED // n), 3)
        flow = Flow(self.system, setting.of(self.question.excitation).drive)
        waited = flow.run(self.state, DWELL)
        run = flow.run(waited.strobes[-1], periods, mode=waited.mode, points=POINTS)
        if {waited.status, run.status} != {FlowStatus.DONE}:
            self.state = self.question.start.start  # switched off and on again
            return False
        self.state = run.strobes[-1]
        states = run.strobes[:-1]
        trace = states[:, self.system.moving]
        self.high, self.low = self._read(float(trace.max())), self._read(float(trace.min()))
        wave = flow.drive.at(2.0 * np.pi * np.arange(len(states)) / POINTS)
        return self._shows(trace, np.column_stack([states, wave]), n)

    def centre(self) -> bool:
        """Turn the DC offset until the peaks of v1 stand equally far beyond the stops, by the rule
        of proportion; whether the pattern appeared. With one stop there is nothing to centre."""
        if set(self.stops) != {1, -1}:
            return False
        stops = {side: self._read(value) for side, value in self.stops.items()}

        def uneven() -> float:
            return (self.high - stops[1]) - (stops[-1] - self.low)

        before, offset, error = 0.0, min(FIRST_OFFSET, self.bands.offset), uneven()
        for _ in range(CENTRING_STEPS):
            if abs(error) <= self.step or offset == before:
                break
            offset = round(offset, DIGITS)
            if self.look(Adjustment(offset=offset)):
                return True
            now = uneven()
            slope = (now - error) / (offset - before)
            change = -now / slope if slope else 0.0
            change = min(max(change, -2.0 * FIRST_OFFSET), 2.0 * FIRST_OFFSET)
            before, error = offset, now
            offset = min(max(offset + change, -self.bands.offset), self.bands.offset)
        return False

    def sweep(self) -> bool:
        """Step the frequency through its band at one amplitude after the other."""
        centred = self.setting.offset
        return any(self.look(setting) for setting in _snake(centred, self.bands))

    def _shows(self, trace: Array, signals: Array, wanted: int) -> bool:
        """Whether v1 over whole multiples of the wanted period is the wanted pattern to the eye.

        wanted : the period; the longest that is looked for where none is wanted. signals : (k,
        states + 1) states and generator, of which the stages' outputs are made.
        """
        laps = trace.reshape(-1, POINTS)
        n = next(
            (
                m
                for m in range(1, wanted + 1)
                if np.abs(laps[m:] - laps[:-m]).max() < 2.0 * self.step
            ),
            0,
        )
        if not self.question.periodic:
            return n == 0
        if n != wanted:
            return False
        pulses = [stage.pulses(signals) for stage in self.stages] or [(0, 0)]
        repeats = len(laps) // n
        if any(count % repeats for pair in pulses for count in pair):
            return False
        counts = tuple((upper // repeats, lower // repeats) for upper, lower in pulses)
        return self.question.wanted.accepts(Counts(n, counts))

    def _read(self, volts: float) -> float:
        """The mean of a few readings, each off by up to one step of the screen, in whole steps."""
        noisy = volts / self.step + self.rng.uniform(-1.0, 1.0, READINGS)
        return float(np.round(noisy).mean() * self.step)


def _extremes(system: PiecewiseLinearSystem, question: Question) -> Array:
    """(states, 2) least and greatest of each state on the nominal orbit; of a motion without a
    period over as many drive periods as the screen is watched at most."""
    orbit = question.start
    if len(orbit.extremes):
        return orbit.extremes
    flow = Flow(system, question.excitation.drive)
    run = flow.run(orbit.start, WATCHED * MAX_PERIOD, mode=orbit.mode or None, points=POINTS)
    return np.column_stack([run.strobes.min(axis=0), run.strobes.max(axis=0)])


@dataclass(frozen=True)
class _Stage:
    """A clearance's dead-zone stage on the screen.

    row : (states + 1,) the displacement [V] over states and generator. stops : where its output
    leaves zero [V], by side. low_pulse : how far beyond that it has to go to be seen [V].
    """

    row: Array
    stops: Mapping[int, float]
    low_pulse: float

    @classmethod
    def of(cls, system: PiecewiseLinearSystem, index: int, extremes: Array) -> _Stage:
        row = system.displacement[index][:-1]
        largest = int(np.argmax(np.abs(row)))
        stops = {
            side: -float(contact[-1] * row[largest] / contact[largest])
            for side, contact in system.contact_rows(index).items()
        }
        peak = float(np.abs(row[:-1]) @ np.abs(extremes).max(axis=1))
        inside = min((abs(place) for place in stops.values()), default=peak)
        return cls(row, stops, SEEN * max(peak - inside, 0.0))

    def pulses(self, signals: Array) -> tuple[int, int]:
        """How often the displacement goes far enough beyond the upper and the lower stop to be seen
        on the stage's output; the trace is a loop."""
        trace = signals @ self.row

        def count(side: int) -> int:
            if side not in self.stops:
                return 0
            beyond = side * (trace - self.stops[side]) > self.low_pulse
            return int((beyond & ~np.roll(beyond, 1)).sum())

        return count(1), count(-1)


def _snake(offset: float, bands: Bands) -> Iterator[Adjustment]:
    """Frequencies down from the middle and then up; at the next amplitude back again."""
    steps = list(np.arange(-FREQUENCY_STEPS, FREQUENCY_STEPS + 1) / FREQUENCY_STEPS)
    first = [*steps[FREQUENCY_STEPS - 1 :: -1], *steps[FREQUENCY_STEPS + 1 :]]
    if bands.frequency == 0.0:
        steps, first = [0.0], []
    amplitudes = AMPLITUDES if bands.amplitude else AMPLITUDES[:1]
    for number, amplitude in enumerate(amplitudes):
        row = first if number == 0 else steps[:: -1 if number % 2 else 1]
        for step in row:
            yield Adjustment(bands.frequency * float(step), bands.amplitude * amplitude, offset)
