"""What a record shows: n-p-q on the board's own thresholds, and how sure that is.

The record is laid on itself (``folding``). The period is the least after which it repeats within
its noise; impacts are counted on the curve of all laps (``contact_count``), beyond the stops that
the record itself has (``dead_zone_curve``) or, where the dead zone's output was not recorded, where
the nominal board has them, as far off as the spread allows. Nothing here simulates the board, but
where contacts are lost in the noise of that curve: then the orbit of the board behind the record
gives the curve its shape (``board_curve``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.counts import MAX_PERIOD, Counts
from designer.dynamics.orbit import SYMMETRY_TOLERANCE, OrbitStatus
from designer.workbench.board_curve import SURE as BOARD_SURE, board_evidence
from designer.workbench.contact_count import (
    SURE,
    ContactCount,
    ContactEvidence,
    ExtremeEvidence,
    count,
)
from designer.workbench.dead_zone_curve import DeadZoneCurve, fitted
from designer.workbench.drive_estimate import near_frequency
from designer.workbench.folding import (
    KNOTS,
    POINTS,
    Fold,
    Samples,
    best_knots,
    fold,
    left_over,
    samples_of,
)
from designer.workbench.prediction import LEVEL, BoardPrediction, PredictedStop
from designer.workbench.record import NORMAL, RecordedMotion

LAPS = 2.0
"""Laps of n periods that a record needs for n to be sure."""
LAPS_OF_MANY, MANY = 10.0, 3
"""The same for n of that many periods or more: an intermittent motion stays near one of these for
several laps (Pomeau and Manneville, Commun. Math. Phys. 74, 1980)."""
FEWEST_LAPS = 1.5
"""Laps with which a period is tried at all."""
COARSE = 64
"""Knots of a period, at most, while the period is sought."""
DIFFERENT = 6.0
"""Standard errors by which a longer period has to leave less over to be seen, and by which its laps
have to differ."""
PERHAPS = 3.0
"""Such standard errors from which on a period that is not seen is not ruled out either."""
WHITE, NEARER, FEWEST_PAIRS = 1.1, 0.85, 32
"""Times the noise that a curve leaves over that is all noise; times as far as before that
neighbours of different laps are at most where a longer period is right, unless so near is noise;
and the fewest of them."""
NOISE_ROOM = 1.25
"""How much more than the noise a curve may leave over and still be the whole motion."""
SCOPE_GAIN = 0.03
"""Error of scope and probe, over a channel's value, where they are not told."""
KINK = 5e-4
"""Share of the peak: the least error of a threshold that is a corner only on paper, and of a curve
through such corners."""
FLAT, FEWEST_FLAT = 0.15, 0.1
"""Distance from its level, over its range, at which an output is still inside the clearance; and
the least share of a lap that it is there."""
CORNER, BEYOND = 0.03, 0.1
"""Distance from where a channel is cut off, over its range, in which its curve is round; and how
far beyond a stop it has to reach, over the stop."""
FEWEST_FREE, POOR = 0.1, 0.05
"""Share of the curve that has to be left to fit a stage; and share of its output's range by which
it may be off the lines of one."""
SURELY = 2.0
"""Times the noise that a curve leaves over of a motion that surely does not repeat."""
STRETCHES, FEWEST_ALIKE, MOST_OF_IT, COLOURED = 16, 4, 0.9, 0.15
"""Stretches of a drive period in which what is left over ought to be noise; the fewest samples of
one that counts, alone and over the median of all; and how much more than that of white noise the
squared mean of one may be, for a converter's steps."""
MOST_OTHERS = 8
"""Other responses that are listed."""


@dataclass(frozen=True)
class NamedMotion:
    """What a record shows."""

    motion: RecordedMotion
    """The record, its channels and its drive."""
    response: str
    """The likeliest n-p-q, or "aperiodic" or "not settled"; "?" for impacts that no channel
    shows."""
    counts: Counts | None
    """The same; None without a period, or where no channel shows the impacts of a clearance."""
    sure: bool
    """Whether nothing else fits the record."""
    others: tuple[str, ...]
    """Other responses that the record allows, the likeliest first."""
    reason: str
    """Why it is not sure; "" where it is."""
    would_tell: str
    """What record would; "" where it is sure."""
    asymmetry: float
    """Largest |x(t + nT/2) + x(t)| over the peak of the first displacement that was recorded, a
    constant left out; nan for an even n."""
    asymmetry_error: float
    """Four standard errors of it."""
    curve: Fold | None
    """The curve of n periods; its channels are in the order of ``nets``. None without a period."""
    nets: tuple[str, ...]
    """The nets that were recorded, but the generator."""
    moving: str
    """The first state among them, else the first of them: what a phase portrait shows."""
    dead_zones: Mapping[str, DeadZoneCurve]
    """The stage of each clearance as the record shows it, where its output and displacement are
    there."""
    by_board: bool = False
    """Whether impacts that the curve leaves open were counted on the board behind the record."""
    clipped: Mapping[str, tuple[float | None, float | None]] = field(default_factory=dict)
    """Lowest and highest voltage [V] at which the channel of a net is cut off; None where it is
    not."""

    @property
    def symmetric(self) -> bool | None:
        """Whether the motion is its own mirror image; None where the noise hides it."""
        if math.isnan(self.asymmetry):
            return None if self.counts is None else False
        if self.asymmetry > SYMMETRY_TOLERANCE + self.asymmetry_error:
            return False
        return True if self.asymmetry_error < SYMMETRY_TOLERANCE else None


def identify_response(motion: RecordedMotion, prediction: BoardPrediction) -> NamedMotion:
    """The name of a recorded motion."""
    nets = tuple(net for net in motion.channels if net != motion.generator)
    channels = [motion.channels[net] for net in nets]
    samples = samples_of(motion.record, channels, motion.frequency)
    lap = _whole_lap(samples, motion)
    if isinstance(lap, float):
        without = _without_period(motion, nets, _moving(nets, prediction), samples, lap)
        return replace(without, clipped=_clipped(motion, prediction))
    curve, doubt, motion = lap
    n = curve.n
    limits = _limits(motion, prediction)
    zones = dict(_zones(curve, nets, prediction.stops, limits))
    counted = [
        _counted(curve, nets, stop, zones.get(stop.clearance), prediction, k, limits)
        for k, stop in enumerate(prediction.stops)
    ]
    asymmetry, error = _asymmetry(curve, nets, prediction)
    names, by_board = list(_names(n, counted)), False
    if len(names) > 1 and not doubt and not limits:
        evidence = {}
        if not prediction.circuit.bends:  # boards with laws are not fitted
            evidence = board_evidence(curve, samples, motion, nets, prediction, zones)
        instead = [_by_board(sides, k, evidence) for k, sides in enumerate(counted)]
        by_board = instead != counted
        counted, names = instead, list(_names(n, instead))
    reason, remedy = _why(names, counted, doubt, motion, n)
    if not reason and n >= MANY and motion.periods < LAPS_OF_MANY * n:
        reason = (
            f"a motion may stay near {n} periods for {motion.periods / n:.2g} laps and leave it"
        )
        remedy = f"a record of {math.ceil(LAPS_OF_MANY * n)} drive periods or more"
    if not reason and all(net in limits for net in nets):
        reason, remedy = "every channel is cut off", "a larger range of the channels"
    if not reason and _laps_differ(samples, motion.frequency, curve):
        reason, remedy = "its laps differ by more than the noise", "a record of more drive periods"
    if not reason:
        reason, remedy = motion.doubt, motion.remedy
    counts = None if "?" in names[0] else Counts.parse(names[0])
    return NamedMotion(
        motion=motion,
        response=names[0],
        counts=counts,
        sure=not reason,
        others=tuple(names[1 : MOST_OTHERS + 1]),
        reason=reason,
        would_tell=remedy,
        asymmetry=asymmetry,
        asymmetry_error=error,
        curve=curve,
        nets=nets,
        moving=_moving(nets, prediction),
        dead_zones=zones,
        by_board=by_board,
        clipped=_clipped(motion, prediction),
    )


# -- the period -------------------------------------------------------------------------------


def _whole_lap(
    samples: Samples, motion: RecordedMotion
) -> tuple[Fold, str, RecordedMotion] | float:
    """The curve of the least period, with what speaks against it, and the motion with the drive
    frequency that this period shows. Where the record repeats after none that it is long enough to
    show, how many times the noise the best curve leaves over."""
    seen, n, knots, doubt = motion, 1, best_knots(samples, motion.frequency), ""
    coarse, most = min(*knots, COARSE), int(min(MAX_PERIOD, motion.periods / FEWEST_LAPS))
    for longer in range(2, min(most, len(samples.time) // (2 * coarse)) + 1):
        tried = _at_period(samples, seen, (coarse, _room(samples, longer, knots)), longer)
        if not _lies_better(samples, motion, tried, (n, longer), knots, coarse):
            continue
        surely, perhaps = _laps_apart(samples, tried.frequency, (n, longer), knots)
        if surely > DIFFERENT:
            # What a shorter lap leaves over has hidden what is fine in the curve.
            motion, n, knots = tried, longer, best_knots(samples, tried.frequency, n=longer)
            doubt = ""
        elif perhaps > PERHAPS and not doubt:
            doubt = f"it may repeat after {longer} drive periods only"
    if n > 1:
        motion = _at_period(samples, motion, (knots,), n)
    whole = fold(samples, motion.frequency, n, _room(samples, n, knots))
    noise = np.hypot(samples.noise, KINK * _peaks(samples))
    rest = left_over(samples, motion.frequency, whole)
    left = np.minimum(whole.left, _between_laps(samples, motion.frequency, rest, n))
    if not (left < NOISE_ROOM * noise).all():
        return float((left / noise).max())
    if motion.periods < LAPS * n:
        doubt = f"it lasts {motion.periods:.3g} drive periods"
    return whole, doubt, motion


def _peaks(samples: Samples) -> Array:
    """(c,) half of what each channel spans [V]."""
    return np.asarray(np.maximum(np.ptp(samples.values, axis=0) / 2.0, 1e-300))


def _between_laps(samples: Samples, frequency: float, left: Array, n: int) -> Array:
    """(c,) standard deviation [V] of what is left (k, c), by samples of different laps of n drive
    periods that are neighbours in the lap: what a smooth curve leaves at a corner of each lap is
    the same for both (von Neumann, Ann. Math. Stat. 12, 1941). Infinite without such neighbours."""
    cycles = samples.time * (frequency / n)
    order = np.argsort(cycles % 1.0)
    apart = np.diff(np.floor(cycles[order])) != 0.0
    if np.count_nonzero(apart) < FEWEST_PAIRS:
        return np.full(left.shape[1], np.inf)
    steps = np.diff(left[order], axis=0)[apart]
    return np.asarray(np.sqrt((steps**2).mean(axis=0) / 2.0))


def _laps_differ(samples: Samples, frequency: float, curve: Fold) -> bool:
    """Whether what is left of the samples differs from lap to lap for longer than noise does: an
    aperiodic motion that stays near a period for a few laps passes for it in all else.

    Of white noise the squared mean of a stretch, less that of all laps, over its variance, is 1 on
    average. What a curve leaves over in every lap alike is no difference.
    """
    least = KINK * _peaks(samples)
    left = left_over(samples, frequency, curve) / np.maximum(curve.left, least)
    stretch = np.floor(samples.time * frequency * STRETCHES).astype(np.int64)
    many = np.bincount(stretch)
    whole = np.flatnonzero(many >= max(FEWEST_ALIKE, MOST_OF_IT * float(np.median(many))))
    place = whole % (curve.n * STRETCHES)
    laps = np.bincount(place)[place]
    free = float((1.0 - 1.0 / laps).sum()) * left.shape[1]
    if free < STRETCHES:
        return False
    total = 0.0
    for column in left.T:
        means = np.bincount(stretch, column)[whole] / many[whole]
        common = np.bincount(place, means)[place] / laps
        total += float((many[whole] * (means - common) ** 2).sum())
    return bool(total / free > 1.0 + COLOURED + math.sqrt(2.0 / free))


def _at_period(
    samples: Samples, motion: RecordedMotion, knots: Sequence[int | Sequence[int]], n: int
) -> RecordedMotion:
    """The motion with the drive frequency at which the record lies on itself after n periods; as it
    is where the generator says it, or where it has been seen by one period."""
    if n == 1 or motion.generator in motion.channels:
        return motion
    frequency, error = near_frequency(samples, motion.frequency, knots, n)
    return replace(motion, frequency=frequency, frequency_error=error)


def _lies_better(
    samples: Samples,
    shorter: RecordedMotion,
    longer: RecordedMotion,
    laps: tuple[int, int],
    knots: Sequence[int],
    coarse: int,
) -> bool:
    """Whether the record lies on itself better after more drive periods.

    shorter, longer : with the frequency of each. laps : drive periods of each. knots : of a drive
    period, those that the curve of the shorter lap needs. coarse : how many there are for what
    differs between the shorter laps in one longer lap.

    Of channels of which the shorter lap leaves no more than noise, what the longer one explains
    beyond that counts against what its extra knots do. Of the others it may be that the laps
    differ, or that a curve is no corner: neighbours of different laps tell.
    """
    few, many = laps
    short = fold(samples, shorter.frequency, few, knots)
    left = left_over(samples, shorter.frequency, short)
    common = fold(samples, longer.frequency, few, knots)
    rest = left_over(samples, longer.frequency, common)
    noise = np.hypot(samples.noise, KINK * _peaks(samples))
    white = short.left < WHITE * noise
    after = _between_laps(samples, longer.frequency, rest, many)
    before = np.minimum(
        _between_laps(samples, shorter.frequency, left, few),
        _between_laps(samples, longer.frequency, rest, few),
    )
    nearer = np.maximum(NEARER, noise / np.maximum(short.left, 1e-300))
    if longer.periods >= LAPS * many and (after < nearer * before)[~white].any():
        return True
    if not white.any():
        return False
    if many % few:
        long = fold(samples, longer.frequency, many, _room(samples, many, knots))
        extra, used = np.maximum(long.knots - short.knots, 1), long.knots
        squares = (left_over(samples, longer.frequency, long) ** 2).sum(axis=0)
    else:
        differing = fold(replace(samples, values=rest), longer.frequency, many, coarse)
        extra, squares = differing.knots - coarse * few, differing.squares
        used = common.knots + extra
    variance = squares / np.maximum(len(samples.time) - used, 1)
    variance = np.maximum(variance, (KINK * _peaks(samples)) ** 2)
    drop = float((((left**2).sum(axis=0) - squares) / variance)[white].sum())
    more = float(extra[white].sum())
    return drop - more > DIFFERENT * math.sqrt(2.0 * more)


def _laps_apart(
    samples: Samples, frequency: float, laps: tuple[int, int], knots: Sequence[int]
) -> tuple[float, float]:
    """Standard errors by which shorter laps at different places of a longer one differ more than
    those at the same place, of the channel where they do most: surely and perhaps. 0 where none is
    recorded twice.

    frequency : of the drive [Hz]. laps : drive periods of each; where the longer one is no
    multiple, the shorter is what both are multiples of. knots : of a drive period.

    That a longer lap leaves less over proves no period. Steps of a converter are alike from sample
    to sample, and a corner that the curve does not follow meets other samples in each lap. Both
    differ as much between laps that ought to be alike. So the means over short parts of a lap are
    held against each other, between places and at one place (Fisher's analysis of variance; parts
    of unequal variance count for fewer: Satterthwaite, Biometrics 2, 1946). Where the samples come
    at the same times of every lap at one place, these are alike all the same: surely is what is
    beyond the steps that no noise carries, and beyond what a curve may be off at corners.
    """
    few, many = math.gcd(*laps), laps[1]
    left = left_over(samples, frequency, fold(samples, frequency, few, _room(samples, few, knots)))
    cycles = samples.time * (frequency / few)
    parts = max(int(min(COARSE * few, len(cycles) / (FEWEST_ALIKE * cycles[-1]))), 1)
    shape = int(cycles[-1] * few / many) + 1, many // few, parts
    place = np.floor(cycles * parts).astype(np.int64)
    number = np.bincount(place, minlength=math.prod(shape)).reshape(shape)
    count = np.where(number > 0.5 * float(np.median(number[number > 0])), number, 0)
    at_place = count.sum(axis=0)
    again = np.maximum((count > 0).sum(axis=0) - 1, 0).sum(axis=0)
    others = np.maximum((at_place > 0).sum(axis=0) - 1, 0)
    used = (again > 0) & (others > 0)
    if not used.any():
        return 0.0, 0.0
    found = []
    white = (KINK * _peaks(samples)) ** 2
    alike_in_part = float(at_place[:, used].mean()) * (white + samples.rounding**2)
    for column, floors in zip(left.T, np.column_stack([alike_in_part, white]), strict=True):
        sums = np.bincount(place, column, minlength=math.prod(shape)).reshape(shape)
        means = sums / np.maximum(number, 1)
        alike = (count * means).sum(axis=0) / np.maximum(at_place, 1)
        common = (at_place * alike).sum(axis=0) / np.maximum(at_place.sum(axis=0), 1)
        within = (count * (means - alike) ** 2).sum(axis=(0, 1))[used]
        between = (at_place * (alike - common) ** 2).sum(axis=0)[used]
        each = np.maximum(within / again[used], 1e-300)
        counted = float(each.sum() ** 2 / (each**2).sum()) / len(each)
        free = counted * float(others[used].sum()), counted * float(again[used].sum())
        error = math.sqrt(2.0 / free[0] + 2.0 / free[1])
        noise = np.maximum(within.sum() / again[used].sum(), floors)
        found.append((between.sum() / others[used].sum() / noise - 1.0) / error)
    surely, perhaps = np.max(found, axis=0)
    return float(surely), float(perhaps)


def _room(samples: Samples, n: int, knots: Sequence[int]) -> tuple[int, ...]:
    """Knots of a period that n periods of this record have samples for."""
    return tuple(max(min(k, len(samples.time) // (2 * n)), KNOTS[0] // 4) for k in knots)


def _without_period(
    motion: RecordedMotion, nets: tuple[str, ...], moving: str, samples: Samples, left: float
) -> NamedMotion:
    """A motion that the record does not show to repeat: still settling, aperiodic, or of a period
    that is too long for it. left : what the best curve leaves over, in noise."""
    settles = _settles(samples, motion.frequency)
    response = str(OrbitStatus.NOT_SETTLED if settles else OrbitStatus.APERIODIC)
    tried = int(min(MAX_PERIOD, motion.periods / FEWEST_LAPS))
    enough = tried >= MAX_PERIOD
    reason = remedy = ""
    if settles:
        reason = "each period is nearer to the last one than the one before it"
        remedy = "a record that begins later; one with the generator off is for --decay"
    elif not enough:
        reason = f"no period up to {tried}; longer ones do not fit into the record"
        remedy = f"a record of {3 * MAX_PERIOD} drive periods or more"
    elif left < SURELY:
        reason = f"what the best curve leaves over is {left:.2g} times the noise"
        remedy = "less noise, or a channel over more of its screen"
    elif n := _hidden_period(samples, motion):
        laps = f"laps of {n} drive periods" if n > 1 else "single drive periods"
        reason = f"{laps} differ by no more than a curve through so few samples is off"
        remedy = "more samples a drive period"
    else:
        reason, remedy = motion.doubt, motion.remedy
    return NamedMotion(
        motion=motion,
        response=response,
        counts=None,
        sure=not reason,
        others=(),
        reason=reason,
        would_tell=remedy,
        asymmetry=math.nan,
        asymmetry_error=math.nan,
        curve=None,
        nets=nets,
        moving=moving,
        dead_zones={},
    )


def _hidden_period(samples: Samples, motion: RecordedMotion) -> int:
    """The least n whose laps differ by no more than a curve with as many knots is off a record that
    is not laid on itself: at corners between few samples that is far more than the noise. 0 where
    there is none."""
    whole = int(motion.periods) + 2  # a period more, in which the curve closes
    knots = _room(samples, whole, KNOTS[-1:])
    alone = fold(samples, motion.frequency, whole, knots[0])
    room = SURELY * np.maximum(alone.left, samples.noise)
    for n in range(1, MAX_PERIOD + 1):
        at = _at_period(samples, motion, knots, n).frequency
        curve = fold(samples, at, n, knots[0])
        between = _between_laps(samples, at, left_over(samples, at, curve), n)
        if (np.minimum(curve.left, between) < room).all():
            return n
    return 0


def _settles(samples: Samples, frequency: float) -> bool:
    """Whether the periods come nearer to the last one all the time, faster than by chance."""
    laps = int(np.ptp(samples.time) * frequency)
    if laps < 4:
        return False
    phases = np.arange(laps * COARSE) / (COARSE * frequency) + samples.time[0]
    scaled = samples.values / samples.noise
    each = np.column_stack([np.interp(phases, samples.time, column) for column in scaled.T])
    lap = each.reshape(laps, -1)
    gaps = ((lap[:-1] - lap[-1]) ** 2).mean(axis=1)
    half = len(gaps) // 2
    falls = np.diff(gaps) < 0.0
    return bool(gaps[:half].mean() > 3.0 * max(gaps[half:].mean(), 0.0) and falls.mean() > 0.6)


# -- the impacts ------------------------------------------------------------------------------


def _limits(motion: RecordedMotion, prediction: BoardPrediction) -> dict[str, tuple[float, float]]:
    """Lowest and highest voltage [V] of each net whose channel is cut off, but the generator's.

    The output of a dead zone that rests on its level inside the clearance, with no noise, is not.
    """
    inside = {stop.output: stop for stop in prediction.zones}
    out = {}
    for net, channel in motion.channels.items():
        low, high = motion.record.limits[channel]
        if net in inside:
            levels, room = inside[net].levels, LEVEL * motion.record.span[channel]
            low = low if all(abs(low - level) > room for level in levels) else -math.inf
            high = high if all(abs(high - level) > room for level in levels) else math.inf
        if net != motion.generator and not (math.isinf(low) and math.isinf(high)):
            out[net] = low, high
    return out


def _clipped(
    motion: RecordedMotion, prediction: BoardPrediction
) -> dict[str, tuple[float | None, float | None]]:
    """Where the channels of nets are cut off, the generator's too."""
    cut, own = _limits(motion, prediction), motion.channels.get(motion.generator)
    if own in motion.record.clipped:
        cut[motion.generator] = motion.record.limits[str(own)]
    return {
        net: (low if low > -math.inf else None, high if high < math.inf else None)
        for net, (low, high) in cut.items()
    }


def _zones(
    curve: Fold,
    nets: Sequence[str],
    stops: Sequence[PredictedStop],
    limits: Mapping[str, tuple[float, float]],
) -> Iterator[tuple[str, DeadZoneCurve]]:
    """The stage of each clearance whose output and displacement were recorded, the displacement in
    full and the output by where it is not cut off."""
    for stop in stops:
        moved = _displacement(curve, nets, stop)
        if moved is None or not _tells(stop, nets, limits) or limits.keys() & stop.displacement:
            continue
        output = nets.index(stop.output)
        wave = curve.curve[:, output]
        low, high = limits.get(stop.output, (-math.inf, math.inf))
        room = CORNER * float(np.ptp(wave))
        free = (wave > low + room) & (wave < high - room)
        if np.count_nonzero(free) < FEWEST_FREE * len(free):
            continue
        errors = moved[1], float(curve.error[output])
        dof = float(curve.knots.min()) * float(free.mean())
        shape = fitted(moved[0][free], curve.curve[free, output], errors, stop, dof)
        if shape.misfit < POOR * np.ptp(wave):
            yield stop.clearance, shape


def _tells(
    stop: PredictedStop, nets: Sequence[str], limits: Mapping[str, tuple[float, float]]
) -> bool:
    """Whether the output of a stage was recorded, and not cut off from where it is inside the
    clearance."""
    if stop.output not in nets:
        return False
    low, high = limits.get(stop.output, (-math.inf, math.inf))
    return low < stop.inside[0] < high


def _displacement(
    curve: Fold, nets: Sequence[str], stop: PredictedStop
) -> tuple[Array, float] | None:
    """(n · POINTS,) displacement in a clearance [V] and its standard error; None where a net of it
    was not recorded."""
    if not all(net in nets for net in stop.displacement):
        return None
    places = [(nets.index(net), factor) for net, factor in stop.displacement.items()]
    value = sum(factor * curve.curve[:, place] for place, factor in places)
    error = math.sqrt(sum((factor * curve.error[place]) ** 2 for place, factor in places))
    return np.asarray(value), error


def _counted(
    curve: Fold,
    nets: Sequence[str],
    stop: PredictedStop,
    zone: DeadZoneCurve | None,
    prediction: BoardPrediction,
    index: int,
    limits: Mapping[str, tuple[float, float]],
) -> dict[int, ContactCount | None]:
    """The impacts on each stop of a clearance, by side; None where no channel shows them."""
    out: dict[int, ContactCount | None] = {}
    for side in stop.ends:
        evidence = _evidence(curve, nets, stop, zone, side, prediction, index, limits)
        out[side] = None if evidence is None else count(evidence)
    return out


def _evidence(
    curve: Fold,
    nets: Sequence[str],
    stop: PredictedStop,
    zone: DeadZoneCurve | None,
    side: int,
    prediction: BoardPrediction,
    index: int,
    limits: Mapping[str, tuple[float, float]],
) -> ContactEvidence | None:
    """What the recorded channels say of contact with one stop."""
    moved = _displacement(curve, nets, stop)
    tells = _tells(stop, nets, limits)
    if moved is None or not _reaches(stop, side, limits) or (tells and zone is None):
        return _by_output(curve, nets, stop, side) if tells else None
    displacement, error = moved
    if zone is None:
        scope = SCOPE_GAIN * abs(stop.ends[side])
        end_error = math.hypot(prediction.end_errors[index][side], scope)
        beyond = side * (displacement - stop.ends[side])
        return ContactEvidence(beyond, math.hypot(error, end_error), None, math.inf, error)
    output = nets.index(stop.output)
    end_error = zone.end_errors[side]
    if math.isinf(end_error):
        end_error = prediction.end_errors[index][side]
    corner = KINK * float(np.abs(displacement).max())
    line = math.hypot(float(curve.error[output]), zone.inside[1] * error)
    return ContactEvidence(
        side * (displacement - zone.ends[side]),
        math.sqrt(error**2 + end_error**2 + corner**2),
        side * zone.excess(displacement, curve.curve[:, output]) / zone.gains[side],
        math.hypot(line, zone.misfit) / abs(zone.gains[side]),
        error,
    )


def _reaches(stop: PredictedStop, side: int, limits: Mapping[str, tuple[float, float]]) -> bool:
    """Whether the displacement was recorded beyond a stop: where it is cut off there it is in
    contact, as it is at the place where it is cut off."""
    cut = [net for net in stop.displacement if net in limits]
    if not cut:
        return True
    if len(stop.displacement) > 1:
        return False
    (net,) = cut
    ends = [stop.displacement[net] * end for end in limits[net]]
    return max(side * end for end in ends) > side * stop.ends[side] + BEYOND * abs(stop.ends[side])


def _by_output(
    curve: Fold, nets: Sequence[str], stop: PredictedStop, side: int
) -> ContactEvidence | None:
    """The contacts by the output of the dead zone alone: what it shows beyond its level inside the
    clearance, and beyond what it varies there. None where it does not stay near that level."""
    if stop.output not in nets:
        return None
    place = nets.index(stop.output)
    output, noise = curve.curve[:, place], float(curve.error[place])
    flat = output[np.abs(output - stop.inside[0]) < FLAT * np.ptp(output)]
    if len(flat) < FEWEST_FLAT * len(output):
        return None
    level = float(np.median(flat))
    ripple = float(np.median(np.abs(flat - level))) / NORMAL
    # What leaks through an open stage is no contact, however fine the scope sees it.
    corner = KINK * abs(stop.ends[side])
    error = math.hypot(math.hypot(noise, ripple) / abs(stop.gains[side]), corner)
    depth = side * (output - level) / stop.gains[side]
    return ContactEvidence(None, math.inf, depth, error, error)


def _by_board(
    counted: Mapping[int, ContactCount | None],
    clearance: int,
    evidence: Mapping[tuple[int, int], ExtremeEvidence],
) -> dict[int, ContactCount | None]:
    """The impacts on each stop of a clearance: what the curve leaves open as the curve of the board
    has it, if the first allows that."""
    out = dict(counted)
    for side, by_curve in counted.items():
        if by_curve is None or not by_curve.others or (clearance, side) not in evidence:
            continue
        instead = count(evidence[clearance, side], BOARD_SURE)
        if instead.impacts in (by_curve.impacts, *(number for number, _ in by_curve.others)):
            out[side] = instead
    return out


# -- the name ---------------------------------------------------------------------------------


def _names(n: int, counted: Sequence[Mapping[int, ContactCount | None]]) -> Iterator[str]:
    """The responses that the counts allow, the likeliest first."""
    choices: list[list[tuple[str, float]]] = []
    for sides in counted or ({},):
        for side in (1, -1):
            found = sides.get(side)
            if side in sides and found is None:
                choices.append([("?", 0.0)])
            elif found is None:
                choices.append([("0", 0.0)])
            else:
                others = [(str(number), cost) for number, cost in found.others]
                choices.append([(str(found.impacts), 0.0), *others])
    ways = [(sum(cost for _, cost in way), [text for text, _ in way]) for way in product(*choices)]
    for cost, texts in sorted(ways, key=lambda way: way[0]):
        if cost < SURE:
            pairs = zip(texts[0::2], texts[1::2], strict=True)
            yield f"{n}-" + ";".join(f"{upper}-{lower}" for upper, lower in pairs)


def _why(
    names: Sequence[str],
    counted: Sequence[Mapping[int, ContactCount | None]],
    doubt: str,
    motion: RecordedMotion,
    n: int,
) -> tuple[str, str]:
    """Why a name is not sure, and what record would make it so."""
    if doubt:
        return doubt, f"a record of {math.ceil(3 * n)} drive periods or more"
    if "?" in names[0]:
        return "no channel shows the impacts of a clearance", "the output of its dead zone as well"
    if len(names) == 1:
        return "", ""
    every = [c for sides in counted for c in sides.values() if c is not None]
    least = min(cost for c in every for _, cost in c.others) if every else SURE
    nearest = min((c.nearest for c in every if c.others), default=least)
    reason = "a contact, or a gap between two, is as small as the noise of the curve"
    times = SURE / max(nearest, 1e-3)
    samples = len(motion.record.time) * times
    remedy = (
        f"{samples:.2g} samples, or as many times less noise"
        if times < 1e3
        else "hardly any: the motion grazes a stop; change the drive a little"
    )
    return reason, remedy


def _asymmetry(
    curve: Fold, nets: Sequence[str], prediction: BoardPrediction
) -> tuple[float, float]:
    """Asymmetry of the first displacement that was recorded, with four standard errors."""
    first = _moving(nets, prediction)
    if curve.n % 2 == 0 or first not in prediction.circuit.state_nets:
        return math.nan, math.nan
    place = nets.index(first)
    wave = curve.curve[:, place] - curve.curve[:, place].mean()
    peak = float(np.abs(wave).max())
    folded = wave + np.roll(wave, curve.n * POINTS // 2)
    return (
        float(np.abs(folded).max()) / peak,
        4.0 * math.sqrt(2.0) * float(curve.error[place]) / peak,
    )


def _moving(nets: Sequence[str], prediction: BoardPrediction) -> str:
    """The first state that was recorded, else the first net."""
    return next((net for net in prediction.circuit.state_nets if net in nets), nets[0])
