"""The sliders of a model: one for the drive frequency and one for every parameter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from designer.explorer.place import OMEGA, ModelPlace, first_place
from designer.model.mechanics import MechanicalModel, frequency_range
from designer.model.model_file import ModelFile
from designer.model.swept_model import ModelSubject

REACH = 5.0
"""How far a slider without finite ends goes: from 1/5 of the file's value to 5 times it."""
MARGIN = 1e-3
"""How far from the ends of an open interval a slider stays."""
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
    """Name of the parameter."""
    label: str
    """What people read."""
    unit: str
    """Unit of its numbers; "" for none."""
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


def controls(modelfile: ModelFile) -> tuple[Control, ...]:
    """One for ω, then one for every parameter, those of the drive first."""
    place, subject = first_place(modelfile), ModelSubject(modelfile.model, scales=modelfile.si)
    units = subject.units
    each = [_of_omega(modelfile, place, units.get(OMEGA, "")), *_parameters(place.model, units)]
    return tuple(sorted(each, key=lambda control: not control.drive))


def _of_omega(modelfile: ModelFile, place: ModelPlace, unit: str) -> Control:
    own = place.model.second_order().own_frequency
    wanted = [r.omega for r in modelfile.responses if r.omega is not None] or [place.omega]
    least, most = frequency_range(place.model)
    low = max(least, min(LOWEST * own, 0.8 * min(wanted)))
    high = min(most, max(HIGHEST * own, 1.25 * max(wanted)))
    return Control(OMEGA, LABELS[OMEGA], unit, low, high, place.omega, True, True)


def _parameters(model: MechanicalModel, units: Mapping[str, str]) -> Iterator[Control]:
    for name, (least, most) in model.parameters.items():
        value = model.parameter(name)
        low, high, logarithmic = _range(value, least, most)
        factor = name == "b" and "b" not in model.units
        label = FACTOR if factor else LABELS.get(name, name)
        drive = name == "b" or name.endswith(".amplitude")
        yield Control(name, label, units.get(name, ""), low, high, value, logarithmic, drive)


def _range(value: float, least: float, most: float) -> tuple[float, float, bool]:
    """Ends of the slider of a parameter in [least, most], and whether it is logarithmic."""
    if least >= 0.0 and most <= 1.0:
        return least + MARGIN * (least > 0.0 or value > 0.0), most - MARGIN, False
    if least >= 0.0 and value > 0.0:
        return max(value / REACH, least), min(value * REACH, most), True
    reach = 2.0 * abs(value) or 1.0
    return max(value - reach, least), min(value + reach, most), False
