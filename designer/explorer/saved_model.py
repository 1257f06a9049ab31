"""The place that the page shows as a model file, with the responses that were pinned on the way."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from designer.base import atomic_write
from designer.base.errors import InputError
from designer.base.toml_writer import toml_text
from designer.base.units import shortest
from designer.dynamics.counts import Counts
from designer.explorer.place import ModelPlace, first_place, read_place
from designer.model.find_responses import find
from designer.model.model import SiScales
from designer.model.model_file import ModelFile, parse_model_file
from designer.model.si_units import angular_frequency

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,59}")
"""What a file may be called: one name, without a folder."""
MOST_PINS = 24
"""Responses of one page that are wanted."""
SUFFIX = ".toml"


@dataclass(frozen=True)
class PinnedResponse:
    """A response that is wanted."""

    omega: float
    """Drive frequency in the model's units."""
    expect: str
    """n-p-q."""
    b: float
    """The clearance, or the factor on all gaps, at which it was seen."""

    @property
    def text(self) -> str:
        """As the address has it."""
        return f"{self.omega!r}~{self.expect}~{self.b!r}"


def read_pins(modelfile: ModelFile, texts: object) -> tuple[PinnedResponse, ...]:
    """The pins that texts as ``PinnedResponse.text`` give.

    Raises
    ------
    InputError : a text that is none, or more than ``MOST_PINS``.
    """
    if not isinstance(texts, list) or len(texts) > MOST_PINS:
        raise InputError(None, "pins", repr(texts), f"a list of at most {MOST_PINS}")
    return tuple(_pin(modelfile, str(text)) for text in texts)


def _pin(modelfile: ModelFile, text: str) -> PinnedResponse:
    try:
        omega, expect, b = text.split("~")
        counts = Counts.parse(expect)
    except ValueError:
        raise InputError(None, "pins", text, "ω~n-p-q~b") from None
    place = read_place(modelfile, {"omega": omega, "b": b})
    return PinnedResponse(place.omega, str(counts), place.model.b)


def saved_text(modelfile: ModelFile, place: ModelPlace, pins: Sequence[PinnedResponse] = ()) -> str:
    """The model file with the values of a place; the pins take the place of its responses.

    Comments are lost. The factor ``b`` of a system has no key of its own: it goes to the pins, or
    to the responses that state none or that of the first place.

    Raises
    ------
    InputError : the text would be no model file, or no response can take a changed factor.
    """
    data = modelfile.data
    modelfile.numbers.put(data, place.model)
    own = parse_model_file(toml_text(data)).model.b
    if pins:
        key = _frequency_key(data.get("response", ()), modelfile.si)
        data["response"] = [_table(pin, own, key, modelfile.si) for pin in pins]
    elif "b" not in place.model.units:
        _put_factor(data, first_place(modelfile).model.b, place.model.b)
    text = f"# Saved by designer explore from {_one_line(modelfile.title)}\n{toml_text(data)}"
    parse_model_file(text)
    return text


def _put_factor(data: Mapping[str, Any], first: float, b: float) -> None:
    """Give a changed factor to the responses that have the first place's."""
    if b == first:
        return
    following = [r for r in data.get("response", ()) if r.get("b", first) == first]
    if not following:
        raise InputError(None, "b", b, f"{first:g}, or a pin: no wanted response here can have it")
    for response in following:
        response["b"] = b


def _one_line(title: str) -> str:
    return "".join(ch if ch.isprintable() else " " for ch in title)


def _frequency_key(responses: Sequence[Mapping[str, Any]], si: SiScales | None) -> str:
    """How a file gives frequencies: by the key of its first response. One in SI that has none is
    given hertz."""
    keys = ("omega", "Omega", "frequency")
    own = (key for response in responses for key in keys if key in response)
    return next(own, "omega" if si is None else "frequency")


def _table(pin: PinnedResponse, own: float, key: str, si: SiScales | None) -> dict[str, Any]:
    value: float | str = pin.omega
    if si is not None and key == "frequency":

        def read(text: str) -> float:
            return si.omega(angular_frequency(text))

        value = shortest(read, pin.omega, si.hertz(pin.omega), " Hz")
    elif si is not None and key == "Omega":
        value = 2.0 * math.pi * si.hertz(pin.omega)
    table: dict[str, Any] = {key: value, "expect": pin.expect}
    return table if pin.b == own else {**table, "b": pin.b}


def not_found(modelfile: ModelFile) -> list[str]:
    """The wanted responses that the model does not show, such as "1-2-2 at ω = 0.85"."""
    wanted = [r for r in modelfile.responses if r.omega is not None and not isinstance(r.b, tuple)]
    return [
        f"{each.expected} at {each.spec.place_text(6)}"
        for each in find(modelfile.model, wanted)
        if not each.found
    ]


def place_for(root: Path, name: object) -> Path:
    """A model file directly in ``root``.

    Raises
    ------
    InputError : a name that is more than a name.
    """
    text = name.removesuffix(SUFFIX) if isinstance(name, str) else ""
    if not NAME.fullmatch(text) or text.endswith("."):
        expected = "letters, digits, _, - and ., without a folder, at most 60"
        raise InputError(None, "name", text, expected)
    return root / f"{text}{SUFFIX}"


def save(path: Path, text: str, *, overwrite: bool = False) -> bool:
    """Write a model file; False, and nothing is written, where there is one and ``overwrite`` was
    not said.

    Raises
    ------
    InputError : it cannot be written.
    """
    if overwrite:
        atomic_write.write(path, text)
        return True
    with atomic_write.writing(path, "name"):
        try:
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        except FileExistsError:
            return False
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
    return True
