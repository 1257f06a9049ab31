"""A repair as a JSON object and as rows of a table, by the keys of docs/cure.md."""

from __future__ import annotations

from typing import TYPE_CHECKING

from designer.base.csv_tables import csv_text
from designer.base.plain_json import FORMAT
from designer.centering.repair_measure import is_rare
from designer.centering.repair_trial import Repair, Trial
from designer.model.model_file import ModelFile
from designer.model.si_units import hertz_json

if TYPE_CHECKING:
    from designer.answers.cure_answer import CureAnswer, CuredResponse, TrialRow
    from designer.answers.shared_rows import ProvenanceRow

COLUMNS = ("price_euro", "predicted", "yield", "low", "high", "samples", "upgrades", "failed")


def repair_json(repair: Repair, provenance: ProvenanceRow, seconds: float) -> CureAnswer:
    """Everything that was found. Prices are over the design as it is, in euro."""
    best, file = repair.best, repair.base.modelfile
    responses: list[CuredResponse] = [
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
            repair.base.model_responses,
            repair.before.measured,
            best.measured,
            repair.limits,
            strict=True,
        )
    ]
    return {
        "format": FORMAT,
        "reached": repair.reached,
        "why": repair.why,
        "target": repair.target,
        "budget": repair.budget,
        "price": best.price,
        "branch": best.branch,
        "upgrades": best.upgrades.as_dict(),
        "said": best.upgrades.in_words(file),
        "responses": responses,
        "rounds": [_trial(t, file) for t in repair.rounds],
        "front": [_trial(t, file) for t in repair.front],
        "refused": [{"upgrades": r.upgrades.in_words(file), "why": r.why} for r in repair.refused],
        "provenance": provenance,
        "cost": {"seconds": seconds},
    }


def front_csv(repair: Repair) -> str:
    """The front of yield against price: the yield is that of the worst response."""
    rows = []
    for t in repair.front:
        low, high = t.worst.interval
        asked, rare = t.worst.counts, t.worst.rare
        digits = 9 if is_rare(repair.target) else 5
        rows.append(
            {
                "price_euro": f"{t.price:.4g}",
                "predicted": f"{min(t.predicted):.{digits}g}",
                "yield": f"{t.worst.rate:.{digits}g}",
                "low": f"{low:.{digits}g}",
                "high": f"{high:.{digits}g}",
                "samples": str(asked.samples if rare is None else rare.boards),
                "upgrades": "; ".join(t.upgrades.in_words(repair.base.modelfile)),
                "failed": str(t.worst.counts.failed),
            }
        )
    return csv_text(COLUMNS, rows)


def _trial(t: Trial, file: ModelFile) -> TrialRow:
    return {
        "branch": t.branch,
        "price": t.price,
        "said": t.upgrades.in_words(file),
        "upgrades": t.upgrades.as_dict(),
        "predicted": list(t.predicted),
        "measured": [m.as_dict() for m in t.measured],
        "reached": t.reached,
    }
