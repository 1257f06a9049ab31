"""A cure as a JSON object and as rows of a table, by the keys of docs/cure.md."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from designer.base.csv_tables import csv_text
from designer.base.plain_json import FORMAT
from designer.centering.cure_trial import Cure, Trial
from designer.centering.cure_upgrade import Upgrades

COLUMNS = ("price_euro", "predicted", "yield", "low", "high", "samples", "upgrades", "failed")


def cure_json(found: Cure, provenance: Mapping[str, Any], seconds: float) -> dict[str, Any]:
    """Everything that was found. Prices are over the design as it is, in euro."""
    best = found.best
    responses = [
        {
            "omega": r.omega,
            "b": r.b,
            "expected": r.expected,
            "before": before.as_dict(),
            "after": after.as_dict(),
            "reached": after.reached,
            "limit": limit,
        }
        for r, before, after, limit in zip(
            found.base.found, found.before.measured, best.measured, found.limits, strict=True
        )
    ]
    return {
        "format": FORMAT,
        "reached": found.reached,
        "why": found.why,
        "target": found.target,
        "budget": found.budget,
        "price": best.price,
        "branch": best.branch,
        "upgrades": best.upgrades.as_dict(),
        "said": words(best.upgrades),
        "responses": responses,
        "rounds": [_trial(t) for t in found.rounds],
        "front": [_trial(t) for t in found.front],
        "refused": [{"upgrades": words(r.upgrades), "why": r.why} for r in found.refused],
        "provenance": dict(provenance),
        "cost": {"seconds": seconds},
    }


def words(upgrades: Upgrades) -> list[str]:
    """Each upgrade in a few words, the same grade of several parts together."""
    said = []
    if upgrades.opamp is not None:
        said.append(f"op-amp {upgrades.opamp}")
    if upgrades.dead_zone is not None:
        said.append(f"dead zone: {upgrades.dead_zone}")
    if upgrades.reference is not None:
        said.append(f"reference {upgrades.reference}")
    for grade in sorted(set(upgrades.grades.values())):
        names = [name for name, own in upgrades.grades.items() if own == grade]
        said.append(f"{100.0 * grade:g} % {' '.join(names)}")
    said += [f"array {n.family} for {' '.join(n.parts)}" for n in upgrades.networks]
    for number, place in sorted(upgrades.places.items()):
        said.append(f"response {number + 1} at ω = {place.omega:g}, b = {place.b:g}")
    if upgrades.trimmer:
        said.append("trimmer fitted, set once on each board")
    if upgrades.trim is not None:
        said.append(f"DC offset trimmed on each board, ± {100.0 * upgrades.trim:g} %")
    return said


def front_csv(found: Cure) -> str:
    """The front of yield against price: the yield is that of the worst response."""
    rows = []
    for t in found.front:
        low, high = t.worst.counts.interval
        rows.append(
            {
                "price_euro": f"{t.price:.4g}",
                "predicted": f"{min(t.predicted):.5g}",
                "yield": f"{t.worst.rate:.5g}",
                "low": f"{low:.5g}",
                "high": f"{high:.5g}",
                "samples": str(t.worst.counts.samples),
                "upgrades": "; ".join(words(t.upgrades)),
                "failed": str(t.worst.counts.failed),
            }
        )
    return csv_text(COLUMNS, rows)


def _trial(t: Trial) -> dict[str, Any]:
    return {
        "branch": t.branch,
        "price": t.price,
        "said": words(t.upgrades),
        "upgrades": t.upgrades.as_dict(),
        "predicted": list(t.predicted),
        "measured": [m.as_dict() for m in t.measured],
        "reached": t.reached,
    }
