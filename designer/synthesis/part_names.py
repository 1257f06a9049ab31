"""Which parts a model's circuit has, and whether a model file speaks of no others."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.schema import did_you_mean
from designer.catalog.catalog import Catalog
from designer.circuit import build, drive_resistors, terms
from designer.circuit.dead_zone_kind import Zone
from designer.circuit.netlist import Circuit
from designer.circuit.terms import Term
from designer.model.circuit_table import CircuitSpec
from designer.model.model import Dimensionless
from designer.synthesis.preferences import Wishes


def terms_of(model: Dimensionless) -> tuple[Term, ...]:
    """The input resistors that the model needs."""
    system = model.second_order()
    return terms.terms(system.damping.tolist(), system.stiffness.tolist(), system.force.tolist())


def parts_of(model: Dimensionless, spec: CircuitSpec, catalog: Catalog, zone: Zone) -> Circuit:
    """The circuit of this model with every value 1: its parts' names are what counts."""
    opamp = catalog.opamp(spec.opamp)
    return build.build(
        terms_of(model),
        defaultdict(lambda: 1.0),
        opamp,
        supply=spec.supply,
        saturation=spec.saturation or opamp.saturation_at(spec.supply),
        clearance="A" if model.k0 > 0.0 else None,
        zone=zone,
    )


def levels(circuit: Circuit) -> frozenset[str]:
    """Resistors that only set a level: of the inverters."""
    return frozenset(n for n in circuit.values if n[:2] == "R1" and len(n) == 4)


def matching_resistors(circuit: Circuit) -> tuple[str, ...]:
    """Resistors that the coefficients depend on; only these can gain from a second part."""
    others = levels(circuit) | set(drive_resistors.NAMES) | feeds(circuit)
    return tuple(r.name for r in circuit.resistors if r.name not in others)


def feeds(circuit: Circuit) -> frozenset[str]:
    """Resistors that feed a reference from a supply."""
    held = {net for ref in circuit.references for net in ref.nets}
    rails = {supply.net for supply in circuit.supplies}
    return frozenset(r.name for r in circuit.resistors if {r.a, r.b} & held and {r.a, r.b} & rails)


def check_names(circuit: Circuit, spec: CircuitSpec) -> None:
    """Refuse names that this circuit does not have.

    Raises
    ------
    InputError : names the first one that is unknown, and the known ones.
    """
    known = tuple(circuit.values)
    for group in spec.matched:
        _known("circuit.matched", group, known)
    if not isinstance(spec.composites, bool):
        _known("circuit.composites", spec.composites, matching_resistors(circuit))


def _known(field: str, names: Iterable[str], known: tuple[str, ...]) -> None:
    for name in names:
        if name not in known:
            hint = did_you_mean(name, known)
            listed = "parts of this model's circuit: " + ", ".join(known)
            raise InputError(None, field, name, listed + (f"; {hint}" if hint else ""))


def check_preferred(spec: CircuitSpec, resistors: Array, capacitors: Array) -> None:
    """Refuse a preferred value that no part can have.

    Raises
    ------
    InputError : the value, and the nearest that can be chosen.
    """
    for value in spec.preferred:
        values = resistors if value >= 1.0 else capacitors
        if not np.isclose(values, value, rtol=1e-9).any():
            near = float(values[int(np.argmin(np.abs(np.log(values / value))))])
            raise InputError(
                None,
                "circuit.preferred",
                value,
                f"values of the series that can be bought in the range, such as {near:g}",
            )


def wishes_of(spec: CircuitSpec) -> Wishes:
    """What the searches are told; ``matched`` holds every group, whichever block it is of."""
    return Wishes(
        matched=spec.matched,
        preferred=frozenset(spec.preferred),
        most_values=spec.most_values,
        slack=spec.slack,
    )
