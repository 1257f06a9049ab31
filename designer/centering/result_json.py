"""What a search found, as JSON objects."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from scipy.stats import norm

from designer.centering.candidate import Candidate, Contribution, Searched
from designer.centering.design_search import BOARDS
from designer.centering.distance import LADDER, STREAM
from designer.centering.levers import DesignChoice
from designer.centering.ngspice_check import RUNG, STRETCH
from designer.verdicts.cross_check import CrossCheck
from designer.verdicts.verdict import Answer, Verdict

Rank = tuple[float, float] | None


def search_json(found: Searched) -> dict[str, Any]:
    """``search.json``: the levers, what each contributed, what was tried, what is predicted."""
    return {
        "format": 1,
        "seed": found.seed,
        "stream": STREAM,
        "stretches": list(LADDER),
        "boards": BOARDS,
        "designs_tried": found.candidates,
        "places_tried": found.places,
        "objective": _rank(found.final.rank),
        "choice": _choice(found.final.choice),
        "start": None if found.start is None else _candidate(found.start),
        "final": _candidate(found.final),
        "steps": [
            {
                "lever": s.lever,
                "setting": s.setting,
                **_rank(s.rank),
                "kept": s.kept,
                "reason": s.reason,
            }
            for s in found.steps
        ],
        "contributions": [_contribution(c) for c in found.contributions],
        "ngspice": {
            "rung": RUNG,
            "stretch": STRETCH,
            "designs": [
                {
                    "frequency_hz": row.frequency,
                    "kept": row.kept,
                    "responses": [{**h.__dict__, "borne_out": h.borne_out} for h in row.agreements],
                }
                for row in found.heard
            ],
        },
        "windows": [
            [{"b": s.b, "from": s.low, "to": s.high, "steps": len(s.places)} for s in row]
            for row in found.windows
        ],
    }


def confirmation_json(
    heard: Sequence[CrossCheck],
    answers: Mapping[tuple[int, int], Answer],
    asked: Sequence[int],
    responses: int,
) -> list[dict[str, Any]]:
    """What ngspice's rung said of boards of the study, by response.

    asked : for each question the index of its response; one that was left out asked nothing.
    """
    out: list[dict[str, Any]] = []
    for index in range(responses):
        own = [h for h in heard if asked[h.question] == index]
        ok = [answers[h.sample, h.question].verdict is Verdict.OK for h in own]
        agreed = [h.agrees(answers[h.sample, h.question]) is True for h in own]
        differ = [h for h, same in zip(own, agreed, strict=True) if not same]
        out.append(
            {
                "asked": len(own),
                "agreed": sum(agreed),
                "ok_on_both": sum(a and b for a, b in zip(ok, agreed, strict=True)),
                "differences": [
                    {
                        "sample": h.sample,
                        "exact": answers[h.sample, h.question].response,
                        "ngspice": h.response,
                        "reason": h.reason,
                    }
                    for h in differ
                ],
                "gate": None,
                "limited_by": None,
            }
        )
    return out


def _choice(choice: DesignChoice) -> dict[str, Any]:
    return {
        "opamp": choice.opamp,
        "dead_zone": choice.dead_zone,
        "swing": choice.aims.swing,
        "share": choice.aims.share,
        "noise_gain": choice.aims.noise_gain,
        "frequency": list(choice.frequency),
    }


def _candidate(made: Candidate) -> dict[str, Any]:
    return {
        "max_error": made.design.errors.max_error,
        "threshold_v": made.design.errors.scales.threshold,
        **_rank(made.rank),
        "responses": [
            {
                "omega": r.omega,
                "b": r.b,
                "expected": r.expected,
                "distance": s.distance if math.isfinite(s.distance) else None,
                "predicted_yield": s.counts.predicted if s.stand is not None else 0.0,
                "ok": list(s.counts.ok),
            }
            for r, s in zip(made.found, made.scored, strict=True)
        ],
    }


def _rank(rank: Rank) -> dict[str, Any]:
    if rank is None or not math.isfinite(rank[0]):
        return {"smallest_distance": None, "smallest_yield": None, "product": None}
    return {
        "smallest_distance": rank[0],
        "smallest_yield": float(norm.cdf(rank[0])),
        "product": math.exp(rank[1]),
    }


def _contribution(c: Contribution) -> dict[str, Any]:
    return {
        "lever": c.lever,
        "from": c.start,
        "to": c.final,
        "by": c.by,
        "alone": _rank(c.alone),
        "without": _rank(c.without),
    }
