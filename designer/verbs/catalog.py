"""The verb ``catalog``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, cast

from designer.base.progress import Progress, reported, stage
from designer.base.units import format_quantity
from designer.verbs.console import say, table
from designer.verbs.declared import Verb, option

if TYPE_CHECKING:
    from designer.answers.catalog_answer import CatalogNames, FigureCheckRow, OpAmpChecks
    from designer.catalog.parts_catalog import Catalog
    from designer.spice.opamp_check import FigureCheck

KINDS = (
    "opamps", "families", "diodes", "references", "supply_diodes", "trimmers", "headers",
    "coaxial_jacks",
)  # fmt: skip
"""What can be bought, as the answer names it."""


@dataclass(frozen=True)
class CatalogAnswer:
    """What the verb ``catalog`` answers."""

    entries: Catalog
    """All that can be bought."""
    opamp: str | None
    """The op-amp that was measured, if any."""
    figures: tuple[FigureCheck, ...]
    """Its figures, by the catalogue and by its model in ngspice."""

    @property
    def answer(self) -> CatalogNames | OpAmpChecks:
        """The JSON object (docs/contract.md)."""
        own = self.entries.hash
        if self.opamp is None:
            names = {kind: [entry.name for entry in getattr(self.entries, kind)] for kind in KINDS}
            return cast("CatalogNames", {"format": 1, **names, "hash": own})
        rows = [
            cast("FigureCheckRow", {**asdict(figure), "agrees": figure.agrees})
            for figure in self.figures
        ]
        return {"format": 1, "opamp": self.opamp, "checks": rows, "hash": own}


@reported
def catalog(
    check: Annotated[
        str | None, option("--check", "NAME", "Measure this op-amp's model against its figures.")
    ] = None,
    *,
    progress: Progress | None = None,
) -> CatalogAnswer:
    """List what can be bought (part families, op-amps, diodes, …), or check an op-amp's model.

    Raises
    ------
    InputError : no such op-amp, or a catalogue that cannot be read.
    EnvironmentMissing : ``check``, and no ngspice.
    """
    from designer.catalog.parts_catalog import load_catalog

    entries = load_catalog()
    if check is None:
        return CatalogAnswer(entries, None, ())
    from designer.spice.opamp_check import checks

    opamp = entries.opamp(check)
    stage(f"{check} in ngspice")
    return CatalogAnswer(entries, check, tuple(checks(opamp)))


def show(result: CatalogAnswer) -> None:
    """The catalogue, or the op-amp's figures."""
    if result.opamp is None:
        _entries(result.entries)
    else:
        _figures(result.opamp, result.figures)


def _figures(name: str, measured: Sequence[FigureCheck]) -> None:
    """An op-amp's figures, by the catalogue and by its model in ngspice."""
    table(
        f"{name} in ngspice",
        (
            {
                "figure": row.figure + (" (assumed)" if row.assumed else ""),
                "catalogue": format_quantity(row.expected, row.unit),
                "measured": format_quantity(row.measured, row.unit),
                "": "" if row.agrees else f"differ by more than {100 * row.tolerance:g} %",
            }
            for row in measured
        ),
    )


def _entries(entries: Catalog) -> None:
    """What can be bought."""
    units = {"resistor": "Ω", "capacitor": "F"}
    table(
        "Families",
        (
            {
                "name": f.name,
                "kind": f.kind,
                "series": " ".join(f.series),
                "range": " to ".join(format_quantity(end, units[f.kind]) for end in f.range),
                "grade": f"{100 * f.grade:g} %",
                "price class": str(f.price),
            }
            for f in entries.families
        ),
    )
    table(
        "Op-amps",
        (
            {
                "name": o.name,
                "sections": str(o.sections),
                "saturation": f"{o.saturation.nominal:g} V at ± {o.rated_supply:g} V",
                "gain-bandwidth": format_quantity(o.gbw.nominal, "Hz"),
                "price class": str(o.price),
            }
            for o in entries.opamps
        ),
    )
    for kind in (
        "Diodes", "References", "Supply diodes", "Trimmers", "Headers", "Coaxial jacks",
    ):  # fmt: skip
        names = [entry.name for entry in getattr(entries, kind.lower().replace(" ", "_"))]
        say(f"{kind}: {', '.join(names) or 'none'}")


VERB = Verb(
    catalog,
    "Design",
    "designer catalog --check TL074",
    show=show,
    satisfied=lambda result: all(figure.agrees for figure in result.figures),
    computes=False,
)
