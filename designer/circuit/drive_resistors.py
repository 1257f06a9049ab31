"""The drive's resistors, R6 and R12: they and the generator's amplitude make the force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from designer.base.arrays import Array
from designer.circuit.coefficients import CoefficientErrors
from designer.model.model import Dimensionless

NAMES = ("R6", "R12")
LEAST_SHARE = 0.2
"""Of the largest amplitude: below it a generator's resolution and noise begin to count."""


def driven(model: Dimensionless) -> tuple[str, ...]:
    """Names of the drive's resistors that this model has."""
    shares = (1.0 - model.f20, model.f20)
    return tuple(name for name, share in zip(NAMES, shares, strict=True) if share > 0.0)


def per_ohm(model: Dimensionless, errors: CoefficientErrors, placeholder: float) -> Array:
    """(2,) generator volts [V peak] that R6 and R12 need for each ohm; 0 where not driven.

    errors : of the circuit in which both have the value ``placeholder`` [ohm].
    """
    wanted = np.array([1.0 - model.f20, model.f20])
    gain = np.where(wanted > 0.0, errors.drive_gain * placeholder, 1.0)
    return np.asarray(np.where(wanted > 0.0, wanted / gain, 0.0))


def choose(
    volts: Array,
    lists: Mapping[str, Array],
    known: Sequence[float],
    aim: float,
    *,
    equal: bool = False,
    least: float = 0.5,
) -> dict[str, float]:
    """R6 and R12: f20 as exact as can be, the amplitude up to what is aimed at.

    volts : as ``per_ohm`` gives them. lists : values that each may have [ohm], ascending. known :
    values that the circuit has already; one of them is taken where it brings the amplitude between
    ``least`` of the largest and the largest. aim : the generator's amplitude [V peak]. equal :
    whether R6 and R12 have to be equal.
    """
    if (volts > 0.0).all():
        return _both(volts, lists, aim, equal)
    index = int(np.flatnonzero(volts > 0.0)[0])
    name = NAMES[index]
    within = lists[name][volts[index] * lists[name] <= aim]
    top = float(within[-1]) if len(within) else float(lists[name][0])
    again = [v for v in known if least * top <= v <= top and v in lists[name]]
    return {name: max(again) if again else top}


def _both(volts: Array, lists: Mapping[str, Array], aim: float, equal: bool) -> dict[str, float]:
    r6, r12 = (a.ravel() for a in np.meshgrid(lists["R6"], lists["R12"]))
    if equal and (r6 == r12).any():
        r6, r12 = r6[r6 == r12], r12[r6 == r12]
    first, second = volts[0] * r6, volts[1] * r12
    off = np.abs(np.log(first / second))
    amplitude = np.sqrt(first * second)  # as ``Design.amplitude`` sets it
    good = (amplitude <= aim) & (amplitude >= LEAST_SHARE * aim)
    good = good if good.any() else np.ones(len(off), dtype=bool)
    best = np.flatnonzero(good)[np.lexsort((-amplitude[good], np.round(off[good], 9)))[0]]
    return {"R6": float(r6[best]), "R12": float(r12[best])}
