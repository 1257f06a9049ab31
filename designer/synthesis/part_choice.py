"""Whether the op-amp, the diode and the reference of a model file can be used, and which others.

Everything here is known from the model file and the catalogue alone, so it is refused before any
part is chosen. A refusal names the parts of the catalogue that would do.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

import numpy as np

from designer.base.errors import InputError, Unreachable
from designer.catalog.catalog import Catalog
from designer.catalog.diode_curve import diode_model
from designer.catalog.entries import DiodeEntry, OpAmp, ReferenceEntry
from designer.model.circuit_table import CircuitSpec

_SECTION = re.compile("[A-OQ-Z]")
"""Names that sections may have: U1P is the supply of U1."""
Refusal = InputError | None


def opamp_of(
    spec: CircuitSpec, catalog: Catalog, fits: Callable[[OpAmp], Refusal] = lambda _: None
) -> OpAmp:
    """The op-amp that a model file names.

    fits : a further condition: why an op-amp does not fit, or None.

    Raises
    ------
    InputError : there is none of this name, or it cannot be used; which ones could.
    """

    def refusal(name: str) -> Refusal:
        why = opamp_refusal(name, spec, catalog)
        return why if why is not None else fits(catalog.opamp(name))

    _refuse(spec.opamp, "op-amps", [o.name for o in catalog.opamps], refusal)
    return catalog.opamp(spec.opamp)


def diode_of(name: str, catalog: Catalog) -> DiodeEntry:
    """The diode of this name, with the figures of a diode, in a case that the board takes.

    Raises
    ------
    InputError : there is none; which ones could be used.
    """

    def refusal(other: str) -> Refusal:
        return _caught(lambda: diode_model(catalog.diode(other)))

    _refuse(name, "diodes", [d.name for d in catalog.diodes], refusal)
    return catalog.diode(name)


def reference_of(spec: CircuitSpec, catalog: Catalog) -> ReferenceEntry:
    """The reference that a model file names: one that its rails can feed.

    Raises
    ------
    InputError : there is none in a case that the board takes; which ones could be used.
    Unreachable : the rails cannot feed it; which ones they could.
    """

    def refusal(name: str) -> Refusal:
        why = _caught(lambda: catalog.reference(name))
        if why is not None or catalog.reference(name).voltage < spec.supply:
            return why
        found = f"{name}, of {catalog.reference(name).voltage:g} V"
        return Unreachable(
            None, "circuit.reference", found, f"a reference below the rails of {spec.supply:g} V"
        )

    _refuse(spec.reference, "references", [r.name for r in catalog.references], refusal)
    return catalog.reference(spec.reference)


def opamp_refusal(name: str, spec: CircuitSpec, catalog: Catalog) -> Refusal:
    """Why no circuit of this specification can be built with an op-amp; None if it can."""
    why = _caught(lambda: catalog.opamp(name, spec.supply))
    if why is not None:
        return why
    opamp = catalog.opamp(name)
    low, high = opamp.supply.min or 0.0, opamp.supply.max or np.inf
    if not opamp.takes(spec.supply):
        expected = f"{low:g} to {high:g} V, the rails of {name}"
        return InputError(None, "circuit.supply", spec.supply, expected)
    limit = opamp.saturation_at(spec.supply)
    if spec.saturation is None and not 0.0 < limit <= spec.supply:
        expected = f"an op-amp whose outputs reach something between 0 and {spec.supply:g} V"
        return InputError(None, "circuit.opamp", f"{name}, which limits at {limit:g} V", expected)
    for section in opamp.pins:
        if not _SECTION.fullmatch(section.name):
            found = f"{name}, with a section {section.name}"
            expected = "an op-amp with sections named by one capital letter each, but not P"
            return InputError(None, "circuit.opamp", found, expected)
    return None


def _refuse(name: str, kind: str, names: Iterable[str], refusal: Callable[[str], Refusal]) -> None:
    """Raise why a part is refused, and which of the catalogue's are not."""
    why = refusal(name)
    if why is None:
        return
    if name not in names or why.field == "board.mounting":
        raise why  # which names the known ones, or those that have a case
    good = [other for other in names if refusal(other) is None]
    instead = f"{kind} of the catalogue that would do: {', '.join(good) or 'none'}"
    raise type(why)(why.file, why.field, why.found, f"{why.expected}; {instead}")


def _caught(look_up: Callable[[], object]) -> Refusal:
    """The error of a look-up, or None."""
    try:
        look_up()
    except InputError as error:
        return error
    return None
