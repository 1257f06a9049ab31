"""Op-amp models for ngspice, written from the catalogue's data-sheet figures.

Three fidelities share one subcircuit, ``opamp`` with the pins ``inp inn out vcc vee`` and, per
instance, ``vos`` [V], ``ib`` [A], ``low`` and ``high`` (its own output limits [V] about ground, at
the pin as it is loaded), above ``ideal`` ``start`` [V] and, where it is drawn, ``gbw`` [Hz], on
``full`` ``load`` [ohm], which the limits belong to:

``ideal``    limits and finite gain, nothing else.
``dynamic``  and gain-bandwidth, slew rate, output resistance, recovery from saturation.
``full``     and a second pole, limits that move with the current, output current limit, input
             common-mode range (with phase reversal where the op-amp has it), supply current, noise.

The models are made so that Newton's method converges at the kinks of the circuits here. Limits are
XSPICE ``limit`` blocks with a rounded corner; sources with formulas (``B``) cost ten times as much
and serve only the supply pins. The offset is a source in series, not the limiter's own parameter:
with the parameter every op-amp starts beyond its limit, where the slope is zero, and no board with
offsets ever starts. The output resistance acts before the limit (``Hout``), so that up to
``dynamic`` the limits are those of the pin whatever the current.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from designer.base.defaults import Fidelity
from designer.catalog.entries import OpAmp
from designer.catalog.output_stage import RATED_LOAD, saturation_resistance

PINS = "inp inn out vcc vee"
LIMIT_RANGE = 1e-3
"""Width [V] over which an output limit's corner is rounded, so that Newton's method converges."""
NO_LOAD = 1e12
"""Load [ohm] that stands for none."""

ASSUMED_RECOVERY = 1e-6
"""Recovery [s] from a hard overdrive, for op-amps whose data sheet gives none."""
ASSUMED_PHASE_MARGIN = 60.0
"""Phase margin [degrees] at unity gain, likewise."""
LARGEST_PHASE_MARGIN = 88.0
"""Degrees; a margin of 90 would put the second pole at infinity."""
REVERSAL = 100.0
"""How much stronger than the signal an input below its range pulls the output up."""
BOLTZMANN = 1.380649e-23
NOISE_TEMPERATURE = 300.15
"""ngspice's own, K: the noise of a resistor stands for the op-amp's."""
NOISE_FREQUENCY = 1e3
"""Hz, where the catalogue's noise holds."""

_POLE = 1e-9
"""Capacitor [F] of the dominant pole: a choice of units, no property of the op-amp."""
_CORNER = 0.02
"""Part of a current limit over which its corner is rounded."""
_FLICKER_CURRENT = 1e-3
"""Current [A] through the 1 ohm whose flicker noise stands for the op-amp's."""


def literal(value: float) -> str:
    """A number that SPICE reads back as the same float: no unit letters, all digits."""
    return repr(float(value))


def recovery(opamp: OpAmp) -> float:
    """Time [s] from the end of a hard overdrive to the output's leaving its limit."""
    return opamp.recovery.nominal if opamp.recovery else ASSUMED_RECOVERY


def headroom(opamp: OpAmp) -> tuple[float, float | None]:
    """Distances [V] of the input common-mode range from the lower and the upper rail; None: no
    limit.

    An op-amp with phase reversal has its upper end at the positive rail.
    """
    range_ = opamp.common_mode
    lower = opamp.rated_supply + (range_.nominal if range_.min is None else range_.min)
    upper = opamp.rated_supply - (range_.nominal if range_.max is None else range_.max)
    return lower, None if opamp.phase_reversal else upper


def second_pole(opamp: OpAmp) -> float:
    """Frequency [Hz] of a second pole that leaves the op-amp's phase margin at unity gain.

    With one pole more, f_u sqrt(1 + (f_u/f_2)^2) = gbw and the margin is arctan(f_2/f_u).
    """
    degrees = opamp.phase_margin.nominal if opamp.phase_margin else ASSUMED_PHASE_MARGIN
    margin = math.radians(min(degrees, LARGEST_PHASE_MARGIN))
    return opamp.gbw.nominal * math.sin(margin) * math.tan(margin)


def instance(
    name: str,
    nets: tuple[str, str, str],
    *,
    fidelity: Fidelity,
    vos: float,
    ib: float,
    rails: tuple[float, float],
    start: float = 0.0,
    more: Mapping[str, float] | None = None,
    supplies: tuple[str, str] = ("vcc", "vee"),
) -> str:
    """The element line of one op-amp.

    nets : noninverting input, inverting input, output. rails : output limits [V]. start : output
    voltage at the start of a transient [V]. more : `bandwidth` and `load` of this one; the model's
    own where None. Of both stands here what the fidelity takes: ``ideal`` has neither memory nor
    bandwidth.
    """
    parameters = {"vos": vos, "ib": ib, "low": rails[0], "high": rails[1]}
    parameters |= _taken(fidelity, {"start": start, **(more or {})})
    words = " ".join(f"{key}={literal(value)}" for key, value in parameters.items())
    return f"X{name} {' '.join(nets)} {' '.join(supplies)} opamp {words}"


def bandwidth(fidelity: Fidelity, opamp: OpAmp, gbw: float) -> dict[str, float]:
    """Parameters of one op-amp with a gain-bandwidth [Hz] of its own.

    The second pole of ``full`` moves along, so that the phase margin stays the data sheet's.
    """
    pole = second_pole(opamp) * gbw / opamp.gbw.nominal
    return _taken(fidelity, {"gbw": gbw, "pole2": pole})


def slew_rate(fidelity: Fidelity, slew: float) -> dict[str, float]:
    """Parameter of one op-amp with a slew rate [V/s] of its own."""
    return _taken(fidelity, {"slew": slew})


def load(fidelity: Fidelity, ohms: float) -> dict[str, float]:
    """Parameter of one op-amp whose limits are those into this load [ohm]: on ``full``, where they
    move with the current."""
    return _taken(fidelity, {"load": min(ohms, NO_LOAD)})


def _taken(fidelity: Fidelity, parameters: Mapping[str, float]) -> dict[str, float]:
    takes = MODELS[fidelity].takes
    return {key: value for key, value in parameters.items() if key in takes}


def subcircuit(fidelity: Fidelity, opamp: OpAmp, gain: float | None = None) -> list[str]:
    """The lines of the subcircuit ``opamp`` of one fidelity, every figure typical.

    gain : in the place of the catalogue's. On ``full`` a vendor's model goes first.
    """
    return MODELS[fidelity].lines(opamp, opamp.gain.nominal if gain is None else gain)


def ideal(gain: float) -> list[str]:
    """The subcircuit of the fidelity ``ideal``, for which the gain is all."""
    return [
        f".subckt opamp {PINS} {_EACH}",
        *_INPUT,
        "Alimit %vd(inside inn) out limiter",
        f".model limiter limit(in_offset=0 gain={literal(gain)} out_lower_limit={{low}} "
        f"out_upper_limit={{high}} limit_range={LIMIT_RANGE!r} fraction=FALSE)",
        ".ends opamp",
    ]


def _dynamic(opamp: OpAmp, gain: float) -> list[str]:
    """One pole whose charging current is limited, then the output limit."""
    return [
        f".subckt opamp {PINS} {_EACH} start=0 {_dynamics(opamp, gain)}",
        *_INPUT,
        *_pole("inside", "inn"),
        "Hout z x Vout {-rout}",
        *_output_limit("{low}", "{high}"),
        "Vout y out 0",
        ".ends opamp",
    ]


def _full(opamp: OpAmp, gain: float) -> list[str]:
    """Common-mode range, pole, second pole, output limit, output current limit, supply pins; or
    the vendor's model."""
    if opamp.spice is not None:
        return opamp.spice.wrapped()
    return [
        f".subckt opamp {PINS} {_EACH} start=0 load={RATED_LOAD!r} {_dynamics(opamp, gain)} "
        f"pole2={literal(second_pole(opamp))} rsat={literal(saturation_resistance(opamp))} "
        f"isc={literal(opamp.output_current.nominal)} iq={literal(opamp.supply_current.nominal)}",
        *_noisy_input(opamp),
        *_common_mode(opamp),
        *_pole("seen", "seenn"),
        "Gpole2 0 w x 0 1",
        "Rpole2 w 0 1",
        f"Cpole2 w 0 {{{literal(0.5 / math.pi)}/pole2}} IC={{start}}",
        "Hout z w Vout {rsat-rout}",
        # The limits are those into the load: without one the output reaches further.
        *_output_limit("{low*(1+rsat/load)}", "{high*(1+rsat/load)}"),
        "Acurrent %vd(y drive) %id(y drive) short",
        ".model short limit(in_offset=0 gain={1/rsat} out_lower_limit={-isc} "
        f"out_upper_limit={{isc}} limit_range={{{literal(_CORNER)}*isc}} fraction=FALSE)",
        "Vout drive out 0",
        "Bpositive vcc 0 I={iq}+uramp(i(Vout))",
        "Bnegative 0 vee I={iq}+uramp(-i(Vout))",
        ".ends opamp",
    ]


def _pole(positive: str, negative: str) -> list[str]:
    """The dominant pole at node x, in volts of the output, and its wind-up beyond the limit.

    What the pole holds beyond the limit (z against y) leaks away through ``Gwind``. Under a hard
    overdrive the pole's current is the slew limit; after a reversal the limit is left after
    ``recovery``, which is ln 2 times the leak's time constant.
    """
    return [
        f".param charge={{slew*{literal(_POLE)}}}",
        f".param gm={{gbw*{literal(2.0 * math.pi * _POLE)}}}",
        f"Aslew %vd({positive} {negative}) %id(0 x) slewing",
        ".model slewing limit(in_offset=0 gain={gm} out_lower_limit={-charge} "
        f"out_upper_limit={{charge}} limit_range={{{literal(_CORNER)}*charge}} fraction=FALSE)",
        "Rpole x 0 {gain/gm}",
        f"Cpole x 0 {literal(_POLE)} IC={{start}}",
        f"Gwind x 0 z y {{{literal(_POLE * math.log(2.0))}/recovery}}",
    ]


def _output_limit(low: str, high: str) -> list[str]:
    return [
        "Alimit z y limiter",
        f".model limiter limit(in_offset=0 gain=1 out_lower_limit={low} out_upper_limit={high} "
        f"limit_range={LIMIT_RANGE!r} fraction=FALSE)",
    ]


def _common_mode(opamp: OpAmp) -> list[str]:
    """Inputs as the first stage sees them: cut at its range, at nodes ``seen`` and ``seenn``.

    Two limits in a row, each about its own pin: XSPICE's controlled limiter would do with one, but
    reports an error in Newton's first steps, while the supplies are still at zero.
    Phase reversal: an input below the range, either of them, pulls the output up.
    """
    lower, upper = headroom(opamp)
    lines = [
        f".model lowest limit(in_offset=0 gain=1 out_lower_limit={literal(lower)} "
        f"out_upper_limit={literal(BEYOND)} limit_range=0.01 fraction=FALSE)"
    ]
    if upper is not None:
        lines.append(
            f".model highest limit(in_offset=0 gain=1 out_lower_limit={literal(-BEYOND)} "
            f"out_upper_limit={literal(-upper)} limit_range=0.01 fraction=FALSE)"
        )
    pull = REVERSAL if opamp.phase_reversal else 0.0
    for pin, suffix, node in (("inside", "p", "seen"), ("inn", "n", "seenn")):
        cut = f"cut{suffix}" if upper is not None else f"kept{suffix}"
        lines.append(f"Alowest{suffix} %vd({pin} vee) %vd({cut} vee) lowest")
        if upper is not None:
            lines.append(f"Ahighest{suffix} %vd({cut} vcc) %vd(kept{suffix} vcc) highest")
        sign = f"kept{suffix} {pin}" if suffix == "p" else f"{pin} kept{suffix}"
        lines.append(f"Epull{suffix} {node} kept{suffix} {sign} {literal(pull)}")
    return lines


def _noisy_input(opamp: OpAmp) -> list[str]:
    """The offset in series with a resistor that carries no current and has the op-amp's noise."""
    corner = opamp.noise_corner.nominal if opamp.noise_corner else 0.0
    density = opamp.noise.nominal / math.sqrt(1.0 + corner / NOISE_FREQUENCY)  # above the corner
    white = density**2 / (4.0 * BOLTZMANN * NOISE_TEMPERATURE)
    bias = [f"Rwhite inp noisy {literal(white)}", *_BIAS]
    if corner == 0.0:
        return ["Voffset inside noisy {vos}", *bias]
    flicker = density**2 * corner / _FLICKER_CURRENT**2
    return [
        f"Voffset flicker noisy {{vos-{literal(_FLICKER_CURRENT)}}}",
        "Eflicker inside flicker nf 0 1",
        f"Iflicker 0 nf {literal(_FLICKER_CURRENT)}",
        "Rflicker nf 0 pink r=1",
        f".model pink r(kf={literal(flicker)} af=2)",
        *bias,
    ]


BEYOND = 1e3
"""V beyond a rail: no limit."""
_EACH = "vos=0 ib=0 low=-13 high=13"
_BIAS = ("Ibiasp inp 0 {ib}", "Ibiasn inn 0 {ib}")
_INPUT = ("Voffset inside inp {vos}", *_BIAS)


def _dynamics(opamp: OpAmp, gain: float) -> str:
    return (
        f"gain={literal(gain)} gbw={literal(opamp.gbw.nominal)} slew={literal(opamp.slew.nominal)} "
        f"rout={literal(opamp.output_resistance.nominal)} recovery={literal(recovery(opamp))}"
    )


@dataclass(frozen=True)
class OpAmpModel:
    """The op-amps of a fidelity."""

    words: str
    """What they are called in tables."""
    lines: Callable[[OpAmp, float], list[str]]
    """The subcircuit with a gain, every other figure typical."""
    takes: frozenset[str] = frozenset()
    """What an instance may have of its own, beside offset, bias current and limits."""


MODELS: Mapping[Fidelity, OpAmpModel] = {
    "ideal": OpAmpModel("ideal op-amps", lambda _, gain: ideal(gain)),
    "dynamic": OpAmpModel("bandwidth and slew", _dynamic, frozenset({"start", "gbw", "slew"})),
    "full": OpAmpModel("full op-amps", _full, frozenset({"start", "gbw", "pole2", "slew", "load"})),
}
FIDELITIES: tuple[Fidelity, ...] = tuple(MODELS)
