"""The few upgrades that change the circuit itself: another op-amp, the other dead zone.

Each is a branch with a nominal circuit of its own, so its margins are its own too. Parts stay as
they are under another op-amp as long as every side condition still holds; the other dead zone is
synthesised anew.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from designer.base.errors import InputError
from designer.catalog.entries import OpAmp
from designer.catalog.parts_catalog import Catalog
from designer.centering.repair_upgrade import Upgrades, price, upgraded_file, with_same_parts
from designer.check import synthesis_result
from designer.check.synthesis_result import Synthesis
from designer.model.circuit_table import DeadZone
from designer.synthesis.part_checks import stage_refusal

OPAMP, DEAD_ZONE, REFERENCE = "op-amp", "dead zone", "reference"
GRADE, NETWORK, PLACE, TRIM, TRIMMER = "grade", "network", "place", "trim", "trimmer"
KINDS = (GRADE, NETWORK, REFERENCE, TRIMMER, OPAMP, DEAD_ZONE, PLACE, TRIM)
"""Kinds of upgrades, by the names that leave them out; for a space a hyphen may stand."""


def kind_named(name: str) -> str | None:
    """The kind that is meant by this name; None where there is none."""
    plain = {kind.replace("-", " "): kind for kind in KINDS}
    return plain.get(name.replace("-", " "))


@dataclass(frozen=True)
class RepairBranch:
    """A design with other upgrades, of which the linear program chooses."""

    upgrades: Upgrades
    """The upgrades that need a new design."""
    synthesis: Synthesis
    """The design with its model."""
    extra: float
    """Price over the design that is repaired [euro]."""

    @property
    def name(self) -> str:
        """The branch in words; "as it is" for the design that is repaired."""
        u = self.upgrades
        phrases = [f"op-amp {u.opamp}"] if u.opamp else []
        phrases += [f"dead zone: {u.dead_zone}"] if u.dead_zone else []
        return ", ".join(phrases) or "as it is"


@dataclass(frozen=True)
class Refused:
    """A branch that cannot be built, and why."""

    upgrades: Upgrades
    """Upgrades that the branch asks for."""
    why: str
    """Why it cannot be built."""


def better_opamps(now: OpAmp, supply: float, catalog: Catalog) -> tuple[OpAmp, ...]:
    """Op-amps with as many sections, for these rails [V], whose offsets spread less at the boards'
    temperatures."""
    spread = now.offset_spread(catalog.temperatures)
    return tuple(
        other
        for other in catalog.opamps
        if other.sections == now.sections
        and (other.supply.min or 0.0) <= supply <= (other.supply.max or float("inf"))
        and other.offset_spread(catalog.temperatures) < spread
    )


def branches(
    base: Synthesis, without: frozenset[str] = frozenset()
) -> Iterator[RepairBranch | Refused]:
    """The design as it is, then every other branch; made one after the other, as they are asked
    for."""
    least = price(base)
    yield branch_of(base, Upgrades(), least)
    spec, catalog = base.modelfile.circuit, base.catalog
    names: list[str | None] = [None]
    if OPAMP not in without:
        now = catalog.opamp(spec.opamp)
        names += [o.name for o in better_opamps(now, spec.supply, catalog)]
    zones: list[str | None] = [None]
    dead_zones = base.modelfile.model.second_order().dead_zones
    if DEAD_ZONE not in without and dead_zones:
        other: DeadZone = "rectifier" if spec.dead_zone == "saturation" else "saturation"
        zones += [other] if stage_refusal(dead_zones, other) is None else []
    for zone in zones:
        for name in names:
            if name is not None or zone is not None:
                yield branch_of(base, Upgrades(opamp=name, dead_zone=zone), least)


def branch_of(
    base: Synthesis, upgrades: Upgrades, least: float | None = None
) -> RepairBranch | Refused:
    """The branch with this op-amp and this dead zone, whatever else is upgraded.

    least : price of the base, where it is known.
    """
    upgrades = Upgrades(opamp=upgrades.opamp, dead_zone=upgrades.dead_zone)
    least = price(base) if least is None else least
    if upgrades == Upgrades():
        return RepairBranch(upgrades, base, 0.0)
    modelfile = upgraded_file(base.modelfile, upgrades)
    try:
        synthesis = None
        if upgrades.dead_zone is None:
            synthesis = with_same_parts(base, modelfile)
            if not all(check.holds for check in synthesis.design.checks):
                synthesis = None
        if synthesis is None:
            synthesis = synthesis_result.synthesise(modelfile, base.catalog)
    except InputError as error:
        return Refused(upgrades, str(error))
    return RepairBranch(upgrades, synthesis, price(synthesis) - least)


def repaired(base: Synthesis, upgrades: Upgrades) -> Synthesis:
    """The design with all these upgrades.

    Raises
    ------
    InputError : there is no such design.
    """
    branch = branch_of(base, upgrades)
    if isinstance(branch, Refused):
        raise InputError(None, "upgrades", branch.why, "upgrades with which there is a design")
    return applied(branch, upgrades)


def applied(branch: RepairBranch, upgrades: Upgrades) -> Synthesis:
    """The branch's design with the other upgrades."""
    more = replace(upgrades, opamp=None, dead_zone=None)
    if more == Upgrades():
        return branch.synthesis
    return with_same_parts(branch.synthesis, upgraded_file(branch.synthesis.modelfile, more))
