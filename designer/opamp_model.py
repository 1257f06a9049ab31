"""Op-amp models for ngspice, written from the catalogue's data-sheet figures.

Three rungs share one subcircuit, ``opamp`` with the pins ``inp inn out vcc vee`` and, per
instance, ``vos`` [V], ``ib`` [A], ``low`` and ``high`` (its own output limits [V] about ground):

``ideal``    limits and finite gain, nothing else.
``dynamic``  and gain-bandwidth, slew rate, output resistance, recovery from saturation.

The models are made so that Newton's method converges at the kinks of the circuits here. Limits are
XSPICE ``limit`` blocks with a rounded corner. The offset is a source in series, not the limiter's
own parameter: with the parameter every op-amp starts beyond its limit, where the slope is zero,
and no board with offsets ever starts. The output resistance acts before the limit (``Hout``), so
that the limits are those of the pin whatever the load.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from designer.catalogentry import OpAmp

Rung = Literal["ideal", "dynamic"]
RUNGS: tuple[Rung, ...] = get_args(Rung)

PINS = "inp inn out vcc vee"
LIMIT_RANGE = 1e-3
"""Width [V] over which an output limit's corner is rounded, so that Newton's method converges."""
ASSUMED_RECOVERY = 1e-6
"""Recovery [s] from a hard overdrive, for op-amps whose data sheet gives none."""

_POLE = 1e-9
"""Capacitor [F] of the dominant pole: a choice of units, no property of the op-amp."""
_CORNER = 0.02
"""Part of the slew limit over which its corner is rounded."""


@dataclass(frozen=True)
class Parameters:
    """Figures of a model, typical: gain [V/V], gbw [Hz], slew [V/s], output_resistance [Ω],
    recovery [s]."""

    gain: float
    gbw: float
    slew: float
    output_resistance: float
    recovery: float

    @classmethod
    def of(cls, opamp: OpAmp, gain: float | None = None) -> Parameters:
        """From the catalogue's entry; ``gain`` replaces its own."""
        return cls(
            gain=opamp.gain.nominal if gain is None else gain,
            gbw=opamp.gbw.nominal,
            slew=opamp.slew.nominal,
            output_resistance=opamp.output_resistance.nominal,
            recovery=opamp.recovery.nominal if opamp.recovery else ASSUMED_RECOVERY,
        )


def instance(
    name: str,
    nets: tuple[str, str, str],
    *,
    rung: Rung,
    vos: float,
    ib: float,
    rails: tuple[float, float],
    start: float = 0.0,
    supplies: tuple[str, str] = ("vcc", "vee"),
) -> str:
    """The element line of one op-amp.

    nets : noninverting input, inverting input, output. rails : output limits [V]. start : output
    voltage at the start of a transient [V]; ``ideal`` has no memory and takes none.
    """
    given = {"vos": vos, "ib": ib, "low": rails[0], "high": rails[1]}
    if rung != "ideal":
        given["start"] = start
    words = " ".join(f"{key}={_n(value)}" for key, value in given.items())
    return f"X{name} {' '.join(nets)} {' '.join(supplies)} opamp {words}"


def subcircuit(rung: Rung, parameters: Parameters) -> list[str]:
    """The lines of the subcircuit ``opamp`` of one rung."""
    if rung == "ideal":
        return ideal(parameters.gain)
    return _dynamic(parameters)


def ideal(gain: float) -> list[str]:
    """The subcircuit of the rung ``ideal``, for which the gain is all."""
    return [
        f".subckt opamp {PINS} vos=0 ib=0 low=-13 high=13",
        *_INPUT,
        "Alimit %vd(inside inn) out limiter",
        f".model limiter limit(in_offset=0 gain={_n(gain)} {_LIMITS}",
        ".ends opamp",
    ]


def _dynamic(p: Parameters) -> list[str]:
    """One pole whose charging current is limited, then the output limit.

    What the pole holds beyond the limit leaks away through ``Gwind``. Under a hard overdrive the
    pole's current is the slew limit, and after its reversal the limit is left after ``recovery``.
    """
    return [
        f".subckt opamp {PINS} vos=0 ib=0 low=-13 high=13 start=0 {_written(p)}",
        *_INPUT,
        f".param charge={{slew*{_n(_POLE)}}}",
        f".param gm={{gbw*{_n(2.0 * math.pi * _POLE)}}}",
        "Aslew %vd(inside inn) %id(0 x) slewing",
        ".model slewing limit(in_offset=0 gain={gm} out_lower_limit={-charge} "
        f"out_upper_limit={{charge}} limit_range={{{_n(_CORNER)}*charge}} fraction=FALSE)",
        "Rpole x 0 {gain/gm}",
        f"Cpole x 0 {_n(_POLE)} IC={{start}}",
        "Hout z x Vout {-rout}",
        "Alimit z y limiter",
        f".model limiter limit(in_offset=0 gain=1 {_LIMITS}",
        f"Gwind x 0 z y {{{_n(_POLE * math.log(2.0))}/recovery}}",
        "Vout y out 0",
        ".ends opamp",
    ]


_INPUT = ("Voffset inside inp {vos}", "Ibiasp inp 0 {ib}", "Ibiasn inn 0 {ib}")
_LIMITS = (
    f"out_lower_limit={{low}} out_upper_limit={{high}} limit_range={LIMIT_RANGE!r} fraction=FALSE)"
)


def _written(p: Parameters) -> str:
    return (
        f"gain={_n(p.gain)} gbw={_n(p.gbw)} slew={_n(p.slew)} "
        f"rout={_n(p.output_resistance)} recovery={_n(p.recovery)}"
    )


def _n(value: float) -> str:
    """A number that SPICE reads back as the same float: no unit letters, all digits."""
    return repr(float(value))
