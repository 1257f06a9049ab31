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
from dataclasses import dataclass
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
from designer.workbench.folding import (
    KNOTS,
    POINTS,
    Fold,
    Samples,
    best_knots,
    fold,
    samples_of,
)
from designer.workbench.prediction import BoardPrediction, PredictedStop
from designer.workbench.record import NORMAL, RecordedMotion

LAPS = 2.0
"""Laps of n periods that a record needs for n to be sure."""
FEWEST_LAPS = 1.5
"""Laps with which a period is tried at all."""
COARSE = 64
"""Knots of a period, at most, while the period is sought."""
DIFFERENT = 6.0
"""Standard errors by which a longer period has to leave less over to be seen."""
NOISE_ROOM = 1.25
"""How much more than the noise a curve may leave over and still be the whole motion."""
SCOPE_GAIN = 0.03
"""Of a channel's value: how wrong scope and probe may be where they are not told."""
KINK = 5e-4
"""Of the peak: the least error of a threshold that is a corner only on paper."""
FLAT = 0.15
"""Of the output's range: how far from its median it is still inside the clearance."""
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
    """By clearance: its stage as the record shows it, where its output and displacement are
    there."""
    by_board: bool = False
    """Whether impacts that the curve leaves open were counted on the board behind the record."""

    @property
    def symmetric(self) -> bool | None:
        """Whether the motion is its own mirror image; None where the noise hides it."""
        if math.isnan(self.asymmetry):
            return None if self.counts is None else False
        if self.asymmetry > SYMMETRY_TOLERANCE + self.asymmetry_error:
            return False
        return True if self.asymmetry_error < SYMMETRY_TOLERANCE else None


def named(motion: RecordedMotion, prediction: BoardPrediction) -> NamedMotion:
    """The name of a recorded motion."""
    nets = tuple(net for net in motion.channels if net != motion.generator)
    channels = [motion.channels[net] for net in nets]
    samples = samples_of(motion.record, channels, motion.frequency)
    lap = _whole_lap(samples, motion)
    if lap is None:
        return _without_period(motion, nets, _moving(nets, prediction), samples)
    curve, doubt = lap
    n = curve.n
    zones = dict(_zones(curve, nets, prediction.stops))
    counted = [
        _counted(curve, nets, stop, zones.get(stop.clearance), prediction, k)
        for k, stop in enumerate(prediction.stops)
    ]
    asymmetry, error = _asymmetry(curve, nets, prediction)
    names, by_board = list(_names(n, counted)), False
    if len(names) > 1 and not doubt:
        evidence = board_evidence(curve, samples, motion, nets, prediction, zones)
        instead = [_by_board(sides, k, evidence) for k, sides in enumerate(counted)]
        by_board = instead != counted
        counted, names = instead, list(_names(n, instead))
    reason, remedy = _why(names, counted, doubt, motion, n)
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
    )


# -- the period -------------------------------------------------------------------------------


def _whole_lap(samples: Samples, motion: RecordedMotion) -> tuple[Fold, str] | None:
    """The curve of the least period, with what speaks against it; None where the record repeats
    after none that it is long enough to show."""
    knots = best_knots(samples, motion.frequency)
    coarse, most = min(*knots, COARSE), int(min(MAX_PERIOD, motion.periods / FEWEST_LAPS))
    folds = [
        fold(samples, motion.frequency, n, coarse)
        for n in range(1, max(most, 1) + 1)
        if n == 1 or 2 * coarse * n <= len(samples.time)
    ]
    best = folds[0]
    for further in folds[1:]:
        if _gain(best, further) > DIFFERENT:
            best = further
    if best.n > 1:  # what one period leaves over has hidden what is fine in the curve
        knots = best_knots(samples, motion.frequency, n=best.n)
    whole = fold(samples, motion.frequency, best.n, _room(samples, best.n, knots))
    if not (whole.left < NOISE_ROOM * samples.noise).all():
        return None
    short = motion.periods < LAPS * best.n
    return whole, f"it lasts {motion.periods:.3g} drive periods" if short else ""


def _gain(shorter: Fold, longer: Fold) -> float:
    """By how many standard errors a longer period leaves less over than its extra knots explain."""
    extra = float((shorter.freedom - longer.freedom).sum())
    drop = float(((shorter.squares - longer.squares) / longer.left**2).sum())
    return (drop - extra) / math.sqrt(2.0 * extra)


def _room(samples: Samples, n: int, knots: Sequence[int]) -> tuple[int, ...]:
    """Knots of a period that n periods of this record have samples for."""
    return tuple(max(min(k, len(samples.time) // (2 * n)), KNOTS[0] // 4) for k in knots)


def _without_period(
    motion: RecordedMotion, nets: tuple[str, ...], moving: str, samples: Samples
) -> NamedMotion:
    """A motion that the record does not show to repeat: still settling, aperiodic, or of a period
    that is too long for it."""
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


def _zones(
    curve: Fold, nets: Sequence[str], stops: Sequence[PredictedStop]
) -> Iterator[tuple[str, DeadZoneCurve]]:
    """The stage of each clearance whose output and displacement were recorded."""
    for stop in stops:
        moved = _displacement(curve, nets, stop)
        if moved is not None and stop.output in nets:
            output = nets.index(stop.output)
            errors = moved[1], float(curve.error[output])
            shape = fitted(moved[0], curve.curve[:, output], errors, stop, float(curve.knots.min()))
            yield stop.clearance, shape


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
) -> dict[int, ContactCount | None]:
    """The impacts on each stop of a clearance, by side; None where no channel shows them."""
    out: dict[int, ContactCount | None] = {}
    for side in stop.ends:
        evidence = _evidence(curve, nets, stop, zone, side, prediction, index)
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
) -> ContactEvidence | None:
    """What the recorded channels say of contact with one stop."""
    moved = _displacement(curve, nets, stop)
    if moved is None:
        return _by_output(curve, nets, stop, side)
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


def _by_output(
    curve: Fold, nets: Sequence[str], stop: PredictedStop, side: int
) -> ContactEvidence | None:
    """By the output of the dead zone alone: what it shows beyond its level inside the clearance,
    where it stays about half of the time, and beyond what it varies there."""
    if stop.output not in nets:
        return None
    place = nets.index(stop.output)
    output, noise = curve.curve[:, place], float(curve.error[place])
    flat = output[np.abs(output - np.median(output)) < FLAT * np.ptp(output)]
    level = float(np.median(flat))
    ripple = float(np.median(np.abs(flat - level))) / NORMAL
    error = math.hypot(noise, ripple) / abs(stop.gains[side])
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
    """Of the first displacement that was recorded, with four standard errors."""
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
