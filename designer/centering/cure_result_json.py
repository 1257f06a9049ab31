"""A cure as a JSON object and as rows of a table, by the keys of docs/cure.md."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from designer.base.csv_tables import csv_text
from designer.base.plain_json import FORMAT
from designer.centering.cure_measure import is_rare
from designer.centering.cure_trial import Cure, Trial
from designer.model.model_file import ModelFile
from designer.model.si_units import hertz_json

COLUMNS = ("price_euro", "predicted", "yield", "low", "high", "samples", "upgrades", "failed")


def cure_json(cure: Cure, provenance: Mapping[str, Any], seconds: float) -> dict[str, Any]:
    """Everything that was found. Prices are over the design as it is, in euro."""
    best, file = cure.best, cure.base.modelfile
    responses = [
        {
            "omega": r.omega,
            **hertz_json(r.omega, file.si),
            "b": r.b,
            "expected": r.expected,
            "before": before.as_dict(),
            "after": after.as_dict(),
            "reached": after.reached,
            "limit": limit,
        }
        for r, before, after, limit in zip(
            cure.base.model_responses, cure.before.measured, best.measured, cure.limits, strict=True
        )
    ]
    return {
        "format": FORMAT,
        "reached": cure.reached,
        "why": cure.why,
        "target": cure.target,
        "budget": cure.budget,
        "price": best.price,
        "branch": best.branch,
        "upgrades": best.upgrades.as_dict(),
        "said": best.upgrades.in_words(file),
        "responses": responses,
        "rounds": [_trial(t, file) for t in cure.rounds],
        "front": [_trial(t, file) for t in cure.front],
        "refused": [{"upgrades": r.upgrades.in_words(file), "why": r.why} for r in cure.refused],
        "provenance": dict(provenance),
        "cost": {"seconds": seconds},
    }


def front_csv(cure: Cure) -> str:
    """The front of yield against price: the yield is that of the worst response."""
    rows = []
    for t in cure.front:
        low, high = t.worst.interval
        asked, rare = t.worst.counts, t.worst.rare
        digits = 9 if is_rare(cure.target) else 5
        rows.append(
            {
                "price_euro": f"{t.price:.4g}",
                "predicted": f"{min(t.predicted):.{digits}g}",
                "yield": f"{t.worst.rate:.{digits}g}",
                "low": f"{low:.{digits}g}",
                "high": f"{high:.{digits}g}",
                "samples": str(asked.samples if rare is None else rare.boards),
                "upgrades": "; ".join(t.upgrades.in_words(cure.base.modelfile)),
                "failed": str(t.worst.counts.failed),
            }
        )
    return csv_text(COLUMNS, rows)


def _trial(t: Trial, file: ModelFile) -> dict[str, Any]:
    return {
        "branch": t.branch,
        "price": t.price,
        "said": t.upgrades.in_words(file),
        "upgrades": t.upgrades.as_dict(),
        "predicted": list(t.predicted),
        "measured": [m.as_dict() for m in t.measured],
        "reached": t.reached,
    }
