"""What every net and part meets in operation: voltages, currents, power, speed.

Over the orbits of the wanted responses on the exact circuit, their starts from rest, and every run
with one op-amp stuck at a rail. All of it is linear in state and drive within a mode, so a value on
a strobe is exact; strobes lie 0.1 rad of the fastest motion apart (``output_loads.RESOLUTION``), so
a smooth peak between them is missed by at most 0.13 %; with an op-amp stuck, 0.5 rad and 3 %.

A slope counts where the section's loop is closed. While one diode of a rectifier has let go and the
other has not taken over, nothing closes it: for some nanoseconds of the exact circuit the output
crosses two drops with the open-loop gain, and a strobe may fall there. That is no motion that an
output is asked to follow; a real op-amp crosses at its own pace.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from designer.base.arrays import Array
from designer.base.second_process import Ask
from designer.catalog.design_rules import BY_ID
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.feedback_loops import feedback_share
from designer.circuit.netlist import GROUND, Circuit, Reference
from designer.circuit.nodal import Solution
from designer.circuit.reduction import Reduction
from designer.dynamics.piecewise_linear import ModeKey
from designer.synthesis.output_loads import RESOLUTION, REST, Run, Sampled

CLOSED = BY_ID["feedback"].limit or 0.0
"""Share of its output that closes a section's loop, at least."""
COARSE = 0.5
"""Resolution of the runs with an op-amp stuck: there are two for each section, and nobody measures
a fault to a per mille."""
STUCK = 1e3
"""Offset [V] that drives a section to its rail whatever its inputs do."""


@dataclass(frozen=True)
class Peak:
    """The largest value of something over all runs, and the run it happens in."""

    value: float
    """The largest value over all runs."""
    run: str
    """Name of the run that it happens in."""


@dataclass
class Operating:
    """What a circuit's nets and parts have to bear, by name of the net or part."""

    high: dict[str, Peak] = field(default_factory=dict)
    """Highest voltage of each net [V]."""
    low: dict[str, Peak] = field(default_factory=dict)
    """Lowest voltage of each net [V]."""
    slew: dict[str, Peak] = field(default_factory=dict)
    """Largest slope of each section's output while its loop is closed [V/s]."""
    across: dict[str, Peak] = field(default_factory=dict)
    """Largest magnitude of the voltage over each capacitor and resistor [V]."""
    power: dict[str, Peak] = field(default_factory=dict)
    """Power of each resistor, the mean over a run [W]."""
    source: dict[str, Peak] = field(default_factory=dict)
    """Largest current out of each section's output [A]."""
    reference: dict[str, Peak] = field(default_factory=dict)
    """Least current through each shunt reference, as its negative [A]."""
    runs: list[str] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    """Runs without an answer."""


def operating(reduction: Reduction, runs: Sequence[Run], left_out: dict[str, str]) -> Operating:
    """What the circuit meets over these runs; one that does not come to its end is left out."""
    return _operating(reduction, runs, left_out, RESOLUTION, speed=True)


def _operating(
    reduction: Reduction,
    runs: Sequence[Run],
    left_out: dict[str, str],
    resolution: float,
    *,
    speed: bool,
) -> Operating:
    """speed : whether slopes are looked at, which takes as long as all else on a strobe."""
    out = Operating(left_out=dict(left_out))
    for run in runs:
        try:
            sampled = Sampled(reduction, run, resolution)
            _add(out, reduction.circuit, sampled, run.name, speed=speed)
        except ArithmeticError as error:
            out.left_out[run.name] = str(error)
            continue
        out.runs.append(run.name)
    return out


def stuck(circuit: Circuit, run: Run, other: Ask | None = None) -> Operating:
    """The same, but for slopes, with each section in turn stuck at each rail of the supply, from
    rest.

    run : whose drive is on meanwhile. other : a process that takes every other section; nothing
    depends on it.
    """
    names = [section.name for section in circuit.sections]
    away = names[1::2] if other is not None else []
    theirs = other(_all_stuck, circuit, run, away) if other is not None else dict
    points = _all_stuck(circuit, run, [name for name in names if name not in away])
    points |= theirs()
    return merged([each for name in names for each in points[name]])


def merged(points: Sequence[Operating]) -> Operating:
    """What is met over all of these."""
    out = Operating()
    for point in points:
        for kind in ("high", "low", "slew", "across", "power", "source", "reference"):
            _raise_peaks(getattr(out, kind), getattr(point, kind).items())
        out.runs += point.runs
        out.left_out |= point.left_out
    return out


def _all_stuck(circuit: Circuit, run: Run, names: Sequence[str]) -> dict[str, list[Operating]]:
    """What is met with each of these sections at its upper and at its lower rail, by name."""
    points: dict[str, list[Operating]] = {}
    for name in names:
        for sign, rail in ((1.0, "upper"), (-1.0, "lower")):
            at = f"{name} at the {rail} rail"
            there = replace(run, name=at, start=np.zeros(len(circuit.states)), periods=REST)
            reduction = Reduction(circuit, _stuck(circuit, name, sign))
            point = _operating(reduction, [there], {}, COARSE, speed=False)
            points.setdefault(name, []).append(point)
    return points


def _stuck(circuit: Circuit, name: str, sign: float) -> Board:
    board = nominal_board(circuit)
    return replace(
        board,
        offset={**board.offset, name: sign * STUCK},
        rails={**board.rails, name: (-circuit.supply, circuit.supply)},
    )


def _add(out: Operating, circuit: Circuit, sampled: Sampled, run: str, *, speed: bool) -> None:
    nets = [*circuit.nets, GROUND]
    voltage = _values(sampled, lambda s: np.array([s.voltage[n] for n in nets]))
    at = {net: voltage[:, i] for i, net in enumerate(nets)}
    _raise_peaks(out.high, ((n, Peak(float(v.max()), run)) for n, v in at.items()))
    _raise_peaks(out.low, ((n, Peak(float(-v.min()), run)) for n, v in at.items()))
    for r in circuit.resistors:
        volts = at[r.a] - at[r.b]
        _raise_peaks(out.across, [(r.name, Peak(float(np.abs(volts).max()), run))])
        mean = float(np.mean(volts[:-1] ** 2)) / r.value
        _raise_peaks(out.power, [(r.name, Peak(mean, run))])
    for c in circuit.capacitors:
        volts = at[c.plus] - at[c.minus]
        _raise_peaks(out.across, [(c.name, Peak(float(np.abs(volts).max()), run))])
    for reference in circuit.references:
        out_of = _into(reference, circuit, at)
        _raise_peaks(out.reference, [(reference.name, Peak(float(-out_of.min()), run))])
    sections = circuit.sections
    current = _values(sampled, lambda s: np.array([s.output[a.name] for a in sections]))
    for i, section in enumerate(sections):
        _raise_peaks(out.source, [(section.name, Peak(float(np.abs(current[:, i]).max()), run))])
    if not speed:
        return
    slope = _rates(sampled, lambda s: np.array([s.voltage[a.output] for a in sections]), circuit)
    for i, section in enumerate(sections):
        _raise_peaks(out.slew, [(section.name, Peak(float(np.abs(slope[:, i]).max()), run))])


def _into(reference: Reference, circuit: Circuit, at: Mapping[str, Array]) -> Array:
    """Current from cathode to anode of a reference [A], where resistors alone join the net that it
    holds. at : voltages of the nets."""
    held, sign = (
        (reference.anode, -1.0) if reference.cathode == GROUND else (reference.cathode, 1.0)
    )
    total = np.zeros_like(at[held])
    for r in circuit.resistors:
        if held in (r.a, r.b):
            other = r.b if r.a == held else r.a
            total += (at[other] - at[held]) / r.value
    return sign * total


def _values(sampled: Sampled, rows: Callable[[Solution], Array]) -> Array:
    """(k, q) values of these rows (q, n + 2) on the strobes."""
    drive = sampled.flow.drive
    u, second_drive = drive.at(sampled.angle), drive.second_at(sampled.angle)
    inputs = np.column_stack([sampled.x, u, np.ones(len(u))])
    return _by_mode(sampled, lambda _, solved: rows(solved), inputs, second_drive)


def _rates(sampled: Sampled, rows: Callable[[Solution], Array], circuit: Circuit) -> Array:
    """(k, sections) derivatives of these rows, one a section, on the strobes [1/s]; 0 where the
    section's loop is open."""
    drive = sampled.flow.drive
    moving, second_drive = drive.rate_at(sampled.angle), drive.second_rate_at(sampled.angle)
    inputs = np.column_stack([sampled.slope, moving, np.zeros(len(moving))])

    def closed(key: ModeKey, solved: Solution) -> Array:
        shares = [abs(feedback_share(circuit, section, key)) for section in circuit.sections]
        loop = (np.array(shares) >= CLOSED)[:, None]
        return np.asarray(loop * rows(solved))

    return _by_mode(sampled, closed, inputs, second_drive)


def _by_mode(
    sampled: Sampled, rows: Callable[[ModeKey, Solution], Array], inputs: Array, second_drive: Array
) -> Array:
    """inputs : (k, n + 2) of states, generator and 1. second_drive : (k,) of its second channel."""
    reduction = sampled.reduction
    out: Array | None = None
    for i, key in enumerate(sampled.keys):
        inside = sampled.at == i
        if not inside.any():
            continue
        value = inputs[inside] @ rows(key, reduction.solution(key)).T
        if sampled.flow.drive.second is not None:
            second = rows(key, reduction.by_second(key))[:, -2]
            value += np.outer(second_drive[inside], second)
        if out is None:
            out = np.empty((len(inputs), value.shape[1]))
        out[inside] = value
    assert out is not None
    return out


def _raise_peaks(peaks: dict[str, Peak], values: Iterable[tuple[str, Peak]]) -> None:
    for name, peak in values:
        if name not in peaks or peak.value > peaks[name].value:
            peaks[name] = peak
