"""The sliders of a model: one for the drive frequency and one for every parameter but those that
stand in lists."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from designer.base.errors import InputError
from designer.base.si_unit import quantity_text, value_text
from designer.base.units import parse_quantity
from designer.explorer.place import OMEGA, ModelPlace, first_place
from designer.model.mechanics import MechanicalModel, frequency_range
from designer.model.model_file import ModelFile
from designer.model.si_units import in_si
from designer.model.swept_model import ModelSubject

REACH = 5.0
"""How far a slider without finite ends goes: from 1/5 of the file's value to 5 times it."""
MARGIN = 1e-3
"""How far from the ends of an open interval a slider stays."""
MOST_ASKED = 30
"""Points of laws and entries of matrices that have a slider at most: an address may name any number
of them, and the page waits for the ends of each."""
SENT = 6
"""Digits of what the page sends when a slider is moved."""
LOWEST, HIGHEST = 0.1, 2.5
"""Ends of the slider of ω over the first mass's own frequency; wider where a response is."""
LABELS = {
    OMEGA: "drive frequency ω",
    "m": "mass ratio m",
    "k": "stiffness ratio k",
    "k0": "stop stiffness k₀",
    "c": "damping ratio c",
    "zeta": "damping ζ",
    "f20": "force on M₂, f₂₀",
    "b": "clearance b",
}
"""What the paper's parameters are called; others by their own names."""
FACTOR = "factor b on gaps"
"""What ``b`` is called where it is a factor."""


@dataclass(frozen=True)
class Control:
    """A slider with a number field."""

    name: str
    label: str
    """What people read."""
    unit: str
    """Unit that its numbers are shown in; "" for none."""
    low: float
    """Value at the left end of the slider."""
    high: float
    """Value at its right end."""
    value: float
    """The model file's own."""
    logarithmic: bool
    """Whether equal ways on the slider are equal factors."""
    drive: bool
    """Whether the generator sets it."""
    scale: float = 1.0
    """How many of the numbers that are shown are one of the model's."""

    def rounded(self, value: float, digits: int) -> float:
        """A value of the model that is shown in so many digits."""
        return float(f"{value * self.scale:.{digits}g}") / self.scale


def controls(modelfile: ModelFile, asked: Collection[str] = ()) -> tuple[Control, ...]:
    """One for ω, then one for every parameter, those of the drive first; of points of laws and
    entries of matrices the first `MOST_ASKED` of those that are ``asked`` for."""
    listed = modelfile.model.listed
    wanted = [name for name in dict.fromkeys(asked) if name in listed]
    left_out = listed.difference(wanted[:MOST_ASKED])
    place, subject = first_place(modelfile), ModelSubject(modelfile.model, scales=modelfile.si)
    each = [
        _of_omega(modelfile, place, subject),
        *_parameters(place.model, subject.units, left_out),
    ]
    return tuple(sorted(each, key=lambda control: not control.drive))


def length_unit(modelfile: ModelFile) -> tuple[str, float]:
    """The unit that displacements are drawn in, and how many of it are one of the model's length:
    that of the largest gap, and mm without one; ("", 1) of a model that has no SI values of its
    own."""
    if not in_si(modelfile.si, modelfile.model):
        return "", 1.0
    clearances = modelfile.model.second_order().clearances
    gaps = [abs(stop.gap) for clearance in clearances for _, stop in clearance.sides]
    return _shown_in(max(gaps, default=0.0) or 1e-3, "m")


def units_note(modelfile: ModelFile) -> str:
    """What the numbers of the page without a unit are."""
    model, si = modelfile.model, modelfile.si
    if in_si(si, model):
        return "Numbers without a unit are ratios."
    if si is not None:
        hertz, length = value_text(si.hertz(1.0), "Hz"), value_text(si.length_scale, "m")
        return f"All numbers are dimensionless: ω = 1 is {hertz}, a displacement of 1 is {length}."
    if "b" in model.units:
        return "All numbers are dimensionless."
    return "Numbers are in the units of the model file, which names none."


def _shown_in(value: float, unit: str) -> tuple[str, float]:
    """The unit with a prefix that suits a value, and how many of it are one without."""
    if not unit:
        return "", 1.0
    _, _, shown = quantity_text(value, unit).partition(" ")
    return shown, 1.0 / parse_quantity(f"1 {shown}", unit)


def _of_omega(modelfile: ModelFile, place: ModelPlace, subject: ModelSubject) -> Control:
    own = place.model.second_order().own_frequency
    wanted = [r.omega for r in modelfile.responses if r.omega is not None] or [place.omega]
    least, most = frequency_range(place.model)
    low = max(least, min(LOWEST * own, 0.8 * min(wanted)))
    high = min(most, max(HIGHEST * own, 1.25 * max(wanted)))
    si = subject.si.get(OMEGA)
    if si is None or not si.own_si:
        return Control(OMEGA, LABELS[OMEGA], "", low, high, place.omega, True, True)
    return Control(OMEGA, "drive frequency", si.name, low, high, place.omega, True, True, si.scale)


def _parameters(
    model: MechanicalModel, units: Mapping[str, str], left_out: Collection[str]
) -> Iterator[Control]:
    for name, (least, most) in model.parameters.items():
        if name in left_out:
            continue
        value = model.parameter(name)
        low, high, logarithmic = _range(value, least, most)
        factor = name == "b" and "b" not in model.units
        label = FACTOR if factor else LABELS.get(name, name)
        drive = name == "b" or name.endswith(".amplitude")
        unit, scale = _shown_in(value, units.get(name, ""))
        own = Control(name, label, unit, low, high, value, logarithmic, drive, scale)
        low, high = (_nearer(model, own, end) for end in (low, high))
        if low < high:  # or another number decides it
            yield replace(own, low=low, high=high)


def _nearer(model: MechanicalModel, control: Control, end: float) -> float:
    """An end of a slider: the furthest, to a thousandth of the way, that the model may have beside
    its other numbers; of as many digits as the page sends."""
    best, good, bad, share = control.value, 0.0, 1.0, 1.0
    while bad - good > MARGIN:
        there = control.rounded(control.value + share * (end - control.value), SENT)
        try:
            model.changed({control.name: there})
        except InputError:
            bad = share
        else:
            best, good = there, share
        share = 0.5 * (good + bad)
    return best


def _range(value: float, least: float, most: float) -> tuple[float, float, bool]:
    """Ends of the slider of a parameter in [least, most], and whether it is logarithmic."""
    if least >= 0.0 and most <= 1.0:
        return least + MARGIN * (least > 0.0 or value > 0.0), most - MARGIN, False
    if least >= 0.0 and value > 0.0:
        return max(value / REACH, least), min(value * REACH, most), True
    reach = 2.0 * abs(value) or 1.0
    return max(value - reach, least), min(value + reach, most), False
