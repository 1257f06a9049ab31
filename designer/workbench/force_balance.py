"""Whether channels obey the board's own equations of motion, and which drive they then have.

Inside its clearances a board is linear: its states answer to the forces of the stops and to the
generator. Both are on the scope, or follow from what is: the output of a dead zone is the force of
its stops, or the displacement says it; what a displacement has beyond the answer to that force is
the answer to the drive, one sine. So the nominal board's linear part, which every board has to a
few per cent, tells which channel is which and what the drive frequency is, of any motion, chaotic
ones too, and of any setting of the generator.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations

import numpy as np
from scipy.signal import lfilter

from designer.base.arrays import Array, Mask
from designer.circuit.netlist import Circuit, Stop
from designer.circuit.noise_gains import conductance
from designer.workbench.drive_estimate import spectrum_tops, tuned
from designer.workbench.prediction import BoardPrediction, PredictedStop

BY_OUTPUT, BY_DISPLACEMENT = 0.01, 0.06
"""Of the power of the drive's answer: what a board of a usual spread leaves of the equations, with
the force of the stops recorded, and with that which the nominal stops have."""
ZONE = 0.03
"""What a board leaves of a dead zone's output by the nominal stops, over its power."""
SINE = 0.005
"""What of the generator's channel is no sine, over its power."""
FAINT = 0.1
"""A dead zone's output that is no contact, over that at a contact as deep as the clearance."""
LEAST_SHARE = 1e-3
"""What is left of a channel counts as at least this share of its power."""
FREE = 0.1
"""The share of a channel that must not be cut off to say anything of it."""
DIRECT = 1e-9
"""The difference that makes a board's modes distinct, over the largest entry of its matrix."""


@dataclass(frozen=True)
class Balance:
    """How well an assignment of channels to nets obeys the equations."""

    nets: tuple[str, ...]
    """The net of each channel."""
    misfit: float
    """What is left over, in units of what a usual board leaves: about 1 or less for the right
    one; nan where these channels test nothing."""
    explained: float
    """How much of the channels it explains: the sum of -log of the share of its own power that is
    left of each; a channel that nothing tests adds nothing."""
    whole: bool
    """Whether every channel is tested by the others."""
    frequency: float
    """The frequency of the drive [Hz]; nan where the channels do not tell it."""


@dataclass(frozen=True)
class _Test:
    """The test of one channel: what the equations leave of what they weigh, how much of that a
    usual board leaves, and what is left over the channel's own power."""

    left: float
    allowed: float
    share: float


class ForceBalance:
    """Some channels of a record, held against the equations of the nominal board.

    time, values : (k,) times [s] at equal steps and (k, c) voltages [V]. cut : (k, c) where a
    channel is cut off. band : least and greatest drive frequency [Hz] where no channel is the
    generator's.
    """

    def __init__(
        self,
        prediction: BoardPrediction,
        time: Array,
        values: Array,
        cut: Mask,
        band: tuple[float, float] = (0.0, math.inf),
    ) -> None:
        self._prediction, self._band = prediction, band
        self._states = prediction.circuit.state_nets
        self._time = time - time[0]
        self._values = values - values.mean(axis=0)
        self._raw, self._cut = values, cut
        self._free = _linear(prediction)
        self._answers: dict[object, Array] = {}
        self._lines: dict[object, tuple[float, float, float]] = {}

    def assignments(self, most: int) -> Iterator[Balance]:
        """Every way to give each channel a net of its own; none where there are more than
        ``most``."""
        nets, channels = self._prediction.nets, self._values.shape[1]
        if channels <= len(nets) and math.perm(len(nets), channels) <= most:
            for way in permutations(nets, channels):
                yield self.balance(way)

    def balance(self, nets: Sequence[str]) -> Balance:
        """The balance of one assignment. nets : the net of each channel."""
        of = {net: k for k, net in enumerate(nets)}
        generator = of.get(self._prediction.generator)
        tests: dict[str, _Test] = {}
        frequency = math.nan
        for stop in self._prediction.zones:
            if stop.output in of and all(net in of for net in stop.displacement):
                zone = self._zone(stop, of)
                if zone is not None:
                    tests[stop.output] = zone
        if generator is not None:
            frequency, left = self.sine(generator)
            tests[self._prediction.generator] = _Test(left, SINE, left)
        moving = [net for net in self._states if net in of and self._tells(of[net])]
        forces = tuple(f for stop in self._prediction.zones if (f := self._force(stop, of)))
        if moving and len(forces) == len(self._prediction.zones):
            recorded = all(force[0] == "output" for force in forces)
            allowed = BY_OUTPUT if recorded else BY_DISPLACEMENT
            if generator is None:
                near = [n for s in self._prediction.zones for n in s.displacement if n in of]
                first = (near or moving)[0]
                frequency, left, power = self._line(forces, of[first], first)
                tests[first] = _Test(left / power, allowed, left / self._power(of[first]))
                drive = self._drive_of(forces, of[first], first, frequency)
            else:
                drive = self._generator(generator)
            for net in moving:
                if net not in tests:
                    tests[net] = self._driven(forces, of[net], net, drive, allowed)
        misfit = max((test.left / test.allowed for test in tests.values()), default=math.nan)
        explained = sum(
            -math.log(min(max(test.share, LEAST_SHARE), 1.0)) for test in tests.values()
        )
        return Balance(tuple(nets), misfit, explained, len(tests) == len(nets), frequency)

    def sine(self, channel: int) -> tuple[float, float]:
        """Frequency [Hz] of the sine that is most like a channel, and the share of its power that
        this leaves."""
        key = ("sine", channel)
        if key not in self._lines:
            free = ~self._cut[:, channel]
            values, time = self._values[free, channel], self._time[free]
            ones = np.full((len(values), 1), max(len(values), 1) ** -0.5)
            tops = spectrum_tops(self._time, self._values[:, channel], 0.0, math.inf)
            enough = len(values) > FREE * len(free)
            frequency, left, power = _best_line(values, time, ones, tops if enough else [])
            if enough and not free.all():
                left += self._not_beyond(channel, frequency)
            self._lines[key] = frequency, left, power
        frequency, left, power = self._lines[key]
        return frequency, left / power

    def _not_beyond(self, channel: int, frequency: float) -> float:
        """Squares by which the sine of a channel is inside of where that is cut off, which it ought
        to be beyond."""
        off = self._values[:, channel] - self._sine_of(channel, frequency)
        return float((np.maximum(self._sides(channel) * off, 0.0) ** 2).sum())

    def _sine_of(self, channel: int, frequency: float) -> Array:
        """(k,) the sine of a frequency and a constant through a channel, by what is not cut off."""
        free = ~self._cut[:, channel]
        columns = np.column_stack([_columns(self._time, frequency), np.ones_like(self._time)])
        sizes, *_ = np.linalg.lstsq(columns[free], self._values[free, channel], rcond=None)
        return np.asarray(columns @ sizes)

    def sine_of_all(self, channels: Iterable[int]) -> float:
        """Frequency [Hz] of the channel that is most like a sine; nan where none is one. Whatever
        net it shows, that is the drive's: nothing on a board is a sine of another."""
        found = min((self.sine(channel)[::-1] for channel in channels), default=(1.0, math.nan))
        return found[1] if found[0] < SINE else math.nan

    # -- the pieces ---------------------------------------------------------------------------

    def _tells(self, channel: int) -> bool:
        """Whether enough of a channel is not cut off."""
        return not self._cut[:, channel].mean() > 1.0 - FREE

    @cached_property
    def _at_rest(self) -> Array:
        """(k, n + 1) a constant and the free motions of the linear part."""
        columns = [np.ones_like(self._time)]
        for root in self._free.roots:
            wave = np.exp(root * self._time)
            columns.append(wave.real if root.imag >= 0.0 else wave.imag)
        return np.column_stack(columns)

    def _basis(self, channel: int | None = None) -> Array:
        """(k, n + 1) the same, orthonormal; 0 where a channel is cut off."""
        cut = None if channel is None else self._cut[:, channel]
        key = ("basis", channel if cut is not None and cut.any() else None)
        if key not in self._answers:
            columns = self._at_rest if cut is None else self._at_rest * ~cut[:, None]
            self._answers[key], _ = np.linalg.qr(columns)
        return self._answers[key]

    def _zone(self, stop: PredictedStop, of: Mapping[str, int]) -> _Test | None:
        """The test of a dead zone's output by its displacement; None where too little of both is
        not cut off. Where only the output is, it has to be beyond."""
        place = of[stop.output]
        known, sides = self._uncut(stop, of), self._sides(place, stop)
        free = sides == 0.0
        both = known & free
        if both.mean() < FREE:
            return None
        output = self._raw[:, place] - self._raw[both, place].mean()
        expected = stop.output_of(self._displacement(stop, of))
        off = output - (expected - expected[both].mean())
        beyond = known & ~free
        off[beyond] = np.maximum(sides[beyond] * off[beyond], 0.0)
        deep = max(abs(gain * stop.ends[side]) for side, gain in stop.gains.items())
        left = float((off[known] ** 2).mean())
        share = left / max(float((output[known] ** 2).mean()), (FAINT * deep) ** 2)
        return _Test(share, ZONE, share)

    def _uncut(self, stop: PredictedStop, of: Mapping[str, int]) -> Mask:
        """(k,) where no channel of a displacement is cut off."""
        return np.asarray(~self._cut[:, [of[net] for net in stop.displacement]].any(axis=1))

    def _sides(self, channel: int, stop: PredictedStop | None = None) -> Array:
        """(k,) the side on which a channel is cut off, 1 or -1; 0 where it is not. stop : whose
        output it is."""
        cut, raw = self._cut[:, channel], self._raw[:, channel]
        if stop is not None:
            cut = cut & ~stop.resting(raw)
        return np.where(cut, np.sign(raw - (raw.max() + raw.min()) / 2.0), 0.0)

    def _power(self, channel: int) -> float:
        """Squares of a channel without what free motions have."""
        shown = self._without_rest(self._values[:, channel], channel)
        return max(float(shown @ shown), 1e-300)

    def _displacement(self, stop: PredictedStop, of: Mapping[str, int]) -> Array:
        return np.asarray(
            sum(factor * self._raw[:, of[net]] for net, factor in stop.displacement.items())
        )

    def _force(self, stop: PredictedStop, of: Mapping[str, int]) -> tuple[object, ...] | None:
        """What the force of a stop is known by: a key of ``_answers``; None where it is cut off.

        Where the output is, or has what the linear part has too, the displacement says it.
        """
        index, place = self._prediction.zones.index(stop), of.get(stop.output)
        moved = all(net in of for net in stop.displacement)
        key: tuple[object, ...] = ("displacement", index, *map(of.get, stop.displacement), place)
        sides = np.zeros(0) if place is None else self._sides(place, stop)
        if stop.limits:
            if not (moved and self._uncut(stop, of).all()):
                return None
            wave = stop.force_of(self._displacement(stop, of))
        elif place is not None and not sides.any():
            key, wave = ("output", index, place), self._values[:, place]
        elif moved and self._uncut(stop, of).all():
            wave = stop.output_of(self._displacement(stop, of))
            if place is not None:
                wave = _filled(self._raw[:, place], sides, wave)
        else:
            return None
        if key not in self._answers:
            column, lag = self._free.stops[index], self._free.lags[index]
            self._answers[key] = self._answer(wave - wave.mean(), column, lag)
        return key

    def _answer(self, wave: Array, column: Array, lag: float = 0.0) -> Array:
        """(k, n) the states' answer to a force."""
        return self._without_rest(self._free.answer(wave, float(self._time[1]), column, lag))

    def _without_rest(self, waves: Array, channel: int | None = None) -> Array:
        """Waves (k, …) without what free motions have; 0 where a channel is cut off."""
        basis = self._basis(channel)
        if channel is not None and self._cut[:, channel].any():
            waves = np.where(self._cut[:, channel], 0.0, waves.T).T
        return np.asarray(waves - basis @ (basis.T @ waves))

    def _rest(self, forces: tuple[tuple[object, ...], ...], channel: int, net: str) -> Array:
        """(k,) a state's channel less the answers to the stops' forces; 0 where it is cut off."""
        key = ("rest", forces, channel, net)
        if key not in self._answers:
            place = self._states.index(net)
            pushed = sum(self._answers[force][:, place] for force in forces)
            self._answers[key] = self._without_rest(self._values[:, channel] - pushed, channel)
        return self._answers[key]

    def _line(
        self, forces: tuple[tuple[object, ...], ...], channel: int, net: str
    ) -> tuple[float, float, float]:
        """The sine that is most like that: its frequency, what it leaves, and the power."""
        key = ("line", forces, channel, net)
        if key not in self._lines:
            rest, free = self._rest(forces, channel, net), ~self._cut[:, channel]
            tops, basis = spectrum_tops(self._time, rest, *self._band), self._basis(channel)
            self._lines[key] = _best_line(rest[free], self._time[free], basis[free], tops)
        return self._lines[key]

    def _generator(self, channel: int) -> object:
        """The states' answer to the generator on a channel: a key of ``_answers``."""
        key = ("generator", channel)
        if key not in self._answers:
            frequency, _ = self.sine(channel)
            wave = np.zeros_like(self._time)
            if math.isfinite(frequency):
                wave = self._sine_of(channel, frequency)
            self._answers[key] = self._answer(wave - wave.mean(), self._free.drive)
        return key

    def _drive_of(
        self, forces: tuple[tuple[object, ...], ...], channel: int, net: str, frequency: float
    ) -> object:
        """The states' answer to the generator that a state's channel shows: a key likewise."""
        key = ("drive", forces, channel, net)
        if key not in self._answers:
            waves = np.zeros((len(self._time), len(self._states)))
            if math.isfinite(frequency):
                parts = [
                    self._answer(w, self._free.drive) for w in _columns(self._time, frequency).T
                ]
                place = self._states.index(net)
                table = np.column_stack([part[:, place] for part in parts])
                table = self._without_rest(table, channel)
                sizes, *_ = np.linalg.lstsq(table, self._rest(forces, channel, net), rcond=None)
                waves = sizes[0] * parts[0] + sizes[1] * parts[1]
            self._answers[key] = waves
        return key

    def _driven(
        self,
        forces: tuple[tuple[object, ...], ...],
        channel: int,
        net: str,
        drive: object,
        allowed: float,
    ) -> _Test:
        """The test of a state's channel by the answer to the generator."""
        answer = self._without_rest(self._answers[drive][:, self._states.index(net)], channel)
        rest = self._rest(forces, channel, net)
        power = max(float(rest @ rest), float(answer @ answer), 1e-300)
        left = float(((rest - answer) ** 2).sum())
        return _Test(left / power, allowed, left / self._power(channel))


@dataclass(frozen=True)
class _LinearPart:
    """x' = A x + drive · u + Σ stops · force, in the modes of A."""

    roots: Array
    """(n,) eigenvalues of A [1/s], complex."""
    shapes: Array
    """(n, n) their vectors."""
    drive: Array
    """(n,) per volt of the generator."""
    stops: tuple[Array, ...]
    """(n,) per volt of each dead zone's output."""
    lags: tuple[float, ...]
    """What a damper adds to the force of each: so many seconds of its output's rate."""

    def answer(self, wave: Array, step: float, column: Array, lag: float = 0.0) -> Array:
        """(k, n) states under a force (k,) and ``lag`` [s] times its rate, straight between its
        samples, but for a free motion. The rate b w' moves them by b w, and as A b w would."""
        sizes = np.linalg.solve(self.shapes, column.astype(complex))
        out = np.zeros((len(wave), len(self.roots)), dtype=complex)
        for root, size, shape in zip(self.roots, sizes, self.shapes.T, strict=True):
            z = root * step
            grown = np.exp(z)
            first = np.expm1(z) / z if abs(z) > DIRECT else 1.0
            second = (first - 1.0) / z if abs(z) > 1e-4 else 0.5
            new, old = step * second, step * (first - second)
            begun = np.array([-new * wave[0]])
            moved, _ = lfilter([new, old], [1.0, -grown], wave.astype(complex), zi=begun)
            out += np.outer((1.0 + lag * root) * moved * size, shape)
        return np.asarray(out.real + lag * np.outer(wave, column))


def _linear(prediction: BoardPrediction) -> _LinearPart:
    """The linear equations of the nominal board with every clearance open."""
    reduction, circuit = prediction.reduction, prediction.circuit
    system = reduction.system()
    rest, n = system.mode(circuit.open), system.size
    columns = []
    for stop in circuit.dead_zones:
        _, contact = stop.contacts[0]
        key = circuit.carrying(contact)
        change = system.mode(key).A - rest.A
        output = reduction.solution(key).voltage[stop.output]
        row = (output - reduction.solution(circuit.open).voltage[stop.output])[:n]
        columns.append(change @ row / (row @ row))
    # Equal roots have no vectors of their own: a rounding of the matrix parts them.
    size = float(np.abs(rest.A).max())
    roots, shapes = np.linalg.eig(rest.A + DIRECT * size * np.diag(np.arange(n) / n))
    lags = tuple(_lag(circuit, stop) for stop in circuit.dead_zones)
    return _LinearPart(roots.astype(complex), shapes.astype(complex), rest.B, tuple(columns), lags)


def _lag(circuit: Circuit, stop: Stop) -> float:
    """Damping of a stop over its stiffness [s]; 0 without a damper."""
    for c in circuit.dependent_capacitors:
        if c.plus == stop.driving:
            return c.value / conductance(circuit, c.plus, c.minus)
    return 0.0


def _columns(time: Array, frequency: float) -> Array:
    angle = 2.0 * np.pi * frequency * time
    return np.column_stack([np.sin(angle), np.cos(angle)])


def _filled(values: Array, sides: Array, expected: Array) -> Array:
    """(k,) values with what is expected of them (k,), beyond where they are cut off at a side (k,),
    1 or -1; 0 where they are not."""
    free = sides == 0.0
    off = expected - values
    if free.any():
        off -= off[free].mean()
    return np.asarray(values + sides * np.maximum(sides * off, 0.0))


def _left_of(values: Array, time: Array, frequency: float, basis: Array) -> float:
    """Squares that a sine leaves of values (k,), both without what the basis (k, m) has."""
    waves = _columns(time, frequency)
    waves = waves - basis @ (basis.T @ waves)
    values = values - basis @ (basis.T @ values)
    sizes, *_ = np.linalg.lstsq(waves, values, rcond=None)
    return float(((values - waves @ sizes) ** 2).sum())


def _best_line(
    values: Array, time: Array, basis: Array, tops: Sequence[float]
) -> tuple[float, float, float]:
    """The frequency near one of the tops whose sine leaves least of values (k,), what it leaves,
    and their power; nan without a top."""
    power = max(float(values @ values), 1e-300)
    if not tops:
        return math.nan, power, power

    def left(frequency: float) -> float:
        return _left_of(values, time, frequency, basis)

    frequency = min((tuned(left, top, time) for top in tops), key=left)
    return frequency, left(frequency), power
