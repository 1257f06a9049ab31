"""Where in the space of its parameters a model is looked at, as the page's address says it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.schema import one_of
from designer.model.find_responses import LARGEST_START
from designer.model.mechanics import MechanicalModel, check_omega
from designer.model.model_file import ModelFile
from designer.model.si_units import Reader, in_si
from designer.model.swept_model import ModelSubject

OMEGA, START, SHOWN = "omega", "start", "shown"


@dataclass(frozen=True)
class ModelPlace:
    """A model with the values of its parameters, its drive, and where the motion starts."""

    model: MechanicalModel
    """The model with these values."""
    omega: float
    """Drive frequency in the model's units."""
    start: tuple[float, ...] = ()
    """State at drive phase 0 from which the motion is followed; () for rest."""
    shown: int = 0
    """Index of the displacement that the plots show (``response_view.shown_motions``)."""
    in_si: bool = False
    """Whether the model's numbers are SI values."""
    asked: frozenset[str] = frozenset()
    """Those of the model's ``listed`` parameters that were asked for."""

    @property
    def state(self) -> Array:
        """(states,) the start."""
        size = 2 * self.model.second_order().size
        return np.array(self.start, dtype=float) if self.start else np.zeros(size)


def first_place(modelfile: ModelFile) -> ModelPlace:
    """The model file's own values, at the frequency of its first response, or the model's own; a
    factor ``b``, which has no other place in a file, is that response's."""
    model = modelfile.model
    wanted = next((r for r in modelfile.responses if r.omega is not None), None)
    if wanted is not None and isinstance(wanted.b, float) and "b" not in model.units:
        model = model.changed({"b": wanted.b})
    omega = _own(model) if wanted is None or wanted.omega is None else wanted.omega
    return ModelPlace(model, omega, in_si=in_si(modelfile.si, model))


def read_place(modelfile: ModelFile, words: Mapping[str, object]) -> ModelPlace:
    """The place that these words give; what they leave out is as in ``first_place``.

    words : "omega" and parameters by name, each a number or a text with a unit; "start", numbers
    with commas between them; "shown".

    Raises
    ------
    InputError : an unknown word, or a value outside its domain.
    """
    first = first_place(modelfile)
    subject = ModelSubject(first.model, first.omega)
    changes: dict[str, float] = {}
    for name, value in words.items():
        if name in (START, SHOWN):
            continue
        if name not in subject.parameters:
            raise InputError(None, "address", str(name), one_of(str(name), subject.parameters))
        changes[name] = number_of(modelfile, name, name, value)
    omega = changes.pop(OMEGA, first.omega)
    for name, value in changes.items():
        subject.check(name, name, value)
    model = first.model.changed(changes)
    check_omega(OMEGA, omega, model)
    size = 2 * model.second_order().size
    start, shown = _start(words.get(START, ""), size), _shown(words.get(SHOWN, 0))
    return ModelPlace(model, omega, start, shown, first.in_si, model.listed & changes.keys())


def words_of(place: ModelPlace) -> dict[str, str]:
    """The words that ``read_place`` makes this place of: every number to the last digit."""
    model = place.model
    names = [n for n in model.parameters if n in place.asked or n not in model.listed]
    words = {OMEGA: repr(place.omega), **{name: repr(model.parameter(name)) for name in names}}
    if place.start:
        words[START] = start_text(place.start)
    if place.shown:
        words[SHOWN] = str(place.shown)
    return words


def start_text(start: tuple[float, ...]) -> str:
    """A start as the address has it."""
    return ",".join(repr(float(x)) for x in start)


def number_of(modelfile: ModelFile, field: str, name: str, value: object) -> float:
    """A parameter's value that a page gives, in the model's units.

    Raises
    ------
    InputError : no finite number. field : what it then names.
    """
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise InputError(None, field, repr(value), "a number")
    number = Reader(modelfile.model, modelfile.si).value(field, name, value)
    if not math.isfinite(number):
        raise InputError(None, field, value, "a finite number")
    return number


def _own(model: MechanicalModel) -> float:
    return model.second_order().own_frequency


def _start(text: object, size: int) -> tuple[float, ...]:
    """() for no text."""
    if text == "":
        return ()
    try:
        start = tuple(float(part) for part in str(text).split(","))
    except ValueError:
        start = ()
    if len(start) != size or not all(abs(x) <= LARGEST_START for x in start):
        raise InputError(None, START, str(text), f"{size} numbers with commas between them")
    return start


def _shown(value: object) -> int:
    if not str(value).isdecimal() or len(str(value)) > 3:
        raise InputError(None, SHOWN, str(value), "a whole number >= 0")
    return int(str(value))
