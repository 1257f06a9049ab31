"""The catalogue, and an op-amp's figures beside its model's, as tables for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from designer.base.units import format_quantity
from designer.cli.console import say, table

if TYPE_CHECKING:
    from designer.catalog.catalog import Catalog
    from designer.spice.opamp_check import FigureCheck


def checks(name: str, measured: Sequence[FigureCheck]) -> None:
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


def catalog(entries: Catalog) -> None:
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
