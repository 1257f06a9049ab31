"""What a search found, as JSON objects."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from scipy.special import ndtr

from designer.centering.bandwidth_check import BANDWIDTH
from designer.centering.candidate import Candidate, Contribution, SearchResult
from designer.centering.design_search import BOARDS
from designer.centering.levers import DesignChoice
from designer.centering.ngspice_check import FIDELITY, STRETCH
from designer.centering.scaled_sigma import LADDER, STREAM
from designer.model.model import SiScales
from designer.model.si_units import mechanism_json
from designer.verdicts.cross_check import CrossCheck, NgspiceVerdict
from designer.verdicts.verdict import Answer, Verdict

if TYPE_CHECKING:
    from designer.answers.search_answer import (
        AskedDesign,
        AskedFidelity,
        CandidateRow,
        ChoiceRow,
        ConfirmedRow,
        ContributionRow,
        ObjectiveRow,
        SearchResultKeys,
        SurvivorKeys,
    )

Rank = tuple[float, float] | None


def search_json(result: SearchResult) -> SearchResultKeys:
    """``search.json``: the levers, what each contributed, what was tried, what is predicted."""
    si = result.synthesis.modelfile.si
    return {
        "seed": result.seed,
        "stream": STREAM,
        "stretches": list(LADDER),
        "boards": BOARDS,
        "designs_tried": result.candidates,
        "places_tried": result.places,
        "objective": _rank(result.final.rank),
        "choice": _choice(result.final.choice),
        "start": None if result.start is None else _candidate(result.start, si),
        "final": _candidate(result.final, si),
        "steps": [
            {
                "lever": s.lever,
                "setting": s.setting,
                **_rank(s.rank),
                "kept": s.adopted,
                "reason": s.reason,
            }
            for s in result.steps
        ],
        "contributions": [_contribution(c) for c in result.contributions],
        "bandwidth": _checks(result, BANDWIDTH, lambda count: {"bandwidth": count}),
        "ngspice": _checks(result, FIDELITY, lambda count: {"ngspice": count}),
        "windows": [
            [{"b": s.b, "from": s.low, "to": s.high, "steps": len(s.places)} for s in row]
            for row in result.windows
        ],
    }


def _checks(
    result: SearchResult, fidelity: str, survivors: Callable[[int], SurvivorKeys]
) -> AskedFidelity:
    """What a fidelity was asked about. survivors : the boards that it keeps, by their key."""
    designs: list[AskedDesign] = [
        {
            "frequency_hz": row.frequency,
            "kept": row.adopted,
            "responses": [
                {
                    "exact": a.exact,
                    **survivors(a.survivors),
                    "unanswered": a.unanswered,
                    "borne_out": a.borne_out,
                }
                for a in row.agreements
            ],
        }
        for row in result.checks
        if row.fidelity == fidelity
    ]
    return {"rung": fidelity, "stretch": STRETCH, "designs": designs}


def confirmation_json(
    checks: Sequence[CrossCheck],
    answers: Mapping[tuple[int, int], Answer],
    response_of: Sequence[int],
    responses: int,
) -> list[ConfirmedRow]:
    """How ngspice's fidelity judges boards of the study, by response.

    response_of : for each question the index of its response; a response that was left out has no
    question.
    """
    out: list[ConfirmedRow] = []
    for index in range(responses):
        pairs = [
            (h, answers[h.sample, h.question]) for h in checks if response_of[h.question] == index
        ]
        outcomes = Counter(h.outcome(a) for h, a in pairs)
        both = [h for h, a in pairs if a.verdict is Verdict.OK and h.agrees(a)]
        out.append(
            {
                "asked": len(pairs),
                "agreed": outcomes[NgspiceVerdict.AGREED],
                "undecided": outcomes[NgspiceVerdict.UNDECIDED],
                "failed": outcomes[NgspiceVerdict.FAILED],
                "ok_on_both": len(both),
                "differences": [
                    {
                        "sample": h.sample,
                        "exact": a.response,
                        "ngspice": h.response,
                        "reason": h.reason,
                    }
                    for h, a in pairs
                    if h.outcome(a) is NgspiceVerdict.DIFFERED
                ],
                "gate": None,
                "limited_by": None,
            }
        )
    return out


def _choice(choice: DesignChoice) -> ChoiceRow:
    return {
        "opamp": choice.opamp,
        "dead_zone": choice.dead_zone,
        "swing": choice.aims.swing,
        "share": choice.aims.share,
        "noise_gain": choice.aims.noise_gain,
        "frequency": list(choice.frequency),
    }


def _candidate(candidate: Candidate, si: SiScales | None) -> CandidateRow:
    return {
        "max_error": candidate.design.errors.max_error,
        "threshold_v": candidate.design.errors.scales.threshold,
        **_rank(candidate.rank),
        "responses": [
            {
                "omega": r.omega,
                **mechanism_json(r.omega, si),
                "b": r.b,
                "expected": r.expected,
                "distance": s.reliability_index if math.isfinite(s.reliability_index) else None,
                "predicted_yield": s.counts.predicted if s.operating_orbit is not None else 0.0,
                "ok": list(s.counts.ok),
            }
            for r, s in zip(candidate.model_responses, candidate.scored, strict=True)
        ],
    }


def _rank(rank: Rank) -> ObjectiveRow:
    if rank is None or not math.isfinite(rank[0]):
        return {"smallest_distance": None, "smallest_yield": None, "product": None}
    return {
        "smallest_distance": rank[0],
        "smallest_yield": float(ndtr(rank[0])),
        "product": math.exp(rank[1]),
    }


def _contribution(c: Contribution) -> ContributionRow:
    return {
        "lever": c.lever,
        "from": c.start,
        "to": c.final,
        "by": c.by,
        "alone": _rank(c.alone),
        "without": _rank(c.without),
    }
