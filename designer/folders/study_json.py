"""A tolerance study as a JSON object, by the keys of docs/contract.md."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from designer.base.plain_json import FORMAT, plain
from designer.check.checked_design import CheckedResponse
from designer.model.model import SiScales
from designer.model.si_units import hertz_json
from designer.report import measured_table
from designer.spice.equation_check import EquationCheck
from designer.verdicts.cross_check import CrossCheck, NgspiceVerdict
from designer.verdicts.verdict import Answer, Verdict
from designer.yields.study import Study, trust_of_yield
from designer.yields.trimmed_yield import Trimmed
from designer.yields.tuned_yield import Tuned
from designer.yields.two_engine_yield import Combined
from designer.yields.yield_count import Yield, count, count_verdicts, reasons

if TYPE_CHECKING:
    from designer.answers.shared_rows import ProvenanceRow
    from designer.answers.study_answer import (
        AgreementCounts,
        AgreementRow,
        AnyLostKey,
        AttributionRow,
        CensusKey,
        CombinedRow,
        MarginRows,
        QuantileRows,
        RareLossKeys,
        RatedCounts,
        ReachedRow,
        ResponseExtras,
        StudyAnswer,
        StudyCost,
        StudyResponse,
        TrimmedRow,
        TunedRow,
        YieldCounts,
    )

MARGINS = ("radius", "penetration", "miss", "asymmetry", "waveform")
QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


def study_json(
    study: Study,
    provenance: ProvenanceRow,
    cost: Mapping[str, float],
    equations: EquationCheck | None = None,
    si: SiScales | None = None,
) -> StudyAnswer:
    """What ``tolerance`` prints and ``tolerance.json`` holds; with ``si`` also the
    frequencies in Hz."""
    any_lost: AnyLostKey = {"any_lost": plain(study.any_lost)} if study.rare else {}
    return {
        "format": FORMAT,
        "samples": study.plan.samples,
        "boards": measured_table.rows(study),
        "until": study.until,
        "narrow": study.narrow,
        "all_on_one_board": {
            "built": _yield(study.all_on_one_board),
            "tuned": _yield(study.on_one_board(study.tuned)),
            "trimmed": _yield(study.on_one_board(study.trimmed)),
            "reached": _yield(study.on_one_board(study.power_ups)),
        },
        **any_lost,
        "blame": study.blame_status.as_dict(),
        "equation_check": None if equations is None else equations.as_dict(),
        "responses": [
            {**_response(c, study, i), **hertz_json(c.model.omega, si)}
            for i, c in enumerate(study.checked)
        ],
        "maps": [each.as_dict() for each in study.maps],
        "provenance": provenance,
        "cost": cast("StudyCost", dict(cost)),
    }


def _response(checked: CheckedResponse, study: Study, index: int) -> StudyResponse:
    model, ngspice = checked.model, checked.ngspice
    answers = study.answers_to(index)
    counted = study.yields[index]
    exponents: ResponseExtras = {}
    if checked.exponents:
        exponents = {
            "exponents": {k: {"value": v, "error": e} for k, (v, e) in checked.exponents.items()}
        }
    rare: ResponseExtras = {"rare": _rare(study, index)} if study.rare else {}
    row: StudyResponse = {
        "omega": model.omega,
        "expected": model.expected,
        "found": model.found,
        "model": model.orbit.response,
        "circuit": checked.circuit.response,
        "ngspice": None if ngspice is None else ngspice.response,
        "ngspice_reason": "" if ngspice is None else ngspice.reason,
        "engines_agree": checked.agrees,
        "symmetric": model.orbit.symmetric,
        **exponents,
        "others": [o.response for o in model.others],
        "yield": _yield(counted),
        "rate": None if counted is None else counted.rate,
        "reasons": reasons((a.verdict, a.reason) for a in answers),
        "margins": margins(answers),
        "agreement": _agreement(
            answers, study.rows_of(index, study.cross_checks), study.not_asked_of(index)
        ),
        "combined": _combined(study.combined[index]),
        "tuned": tuned_json(study.rows_of(index, study.tuned), study.plan.census),
        "trimmed": trimmed_json(study.rows_of(index, study.trimmed), study.plan.census),
        "reached": _reached(study, index),
        "blame": _attribution(study, index),
        **rare,
        "trust": {
            **{engine: trust.verdict() for engine, trust in checked.trust.items()},
            "yield": None
            if counted is None
            else trust_of_yield(counted, checked.circuit_trust).verdict(),
        },
    }
    if counted is None:
        row["left_out"] = study.left_out[index]
    return row


def _yield(counted: Yield | None) -> YieldCounts | None:
    return None if counted is None else _counts(counted)


def _counts(counted: Yield) -> YieldCounts:
    low, high = counted.interval
    more: CensusKey = {"census": True} if counted.census else {}
    return {**counted.counts, "low": low, "high": high, **more}


def tuned_json(rows: Sequence[Tuned], census: bool = False) -> TunedRow | None:
    """What exists within the bands, and under ``bench`` what the bench procedure finds."""
    if not rows:
        return None
    return {
        **_counted(count(rows, census)),
        "tries": sum(r.tries for r in rows),
        "unanswered": sum(r.unanswered for r in rows),
        "followed": sum(r.followed for r in rows),
        "reasons": reasons((a.verdict, a.reason) for a in rows),
        "bench": {
            **_counted(count_verdicts((r.bench_verdict for r in rows), census)),
            "reasons": reasons((r.bench_verdict, r.bench_reason) for r in rows),
            "steps": sum(r.bench_steps for r in rows),
            "seen_where_it_is_not": sum(r.bench_seen and r.bench_verdict != "ok" for r in rows),
        },
    }


def trimmed_json(rows: Sequence[Trimmed], census: bool = False) -> TrimmedRow | None:
    """What the boards show with their trimmers set; at_end : boards that would turn further."""
    if not rows:
        return None
    return {
        **_counted(count(rows, census)),
        "reasons": reasons((a.verdict, a.reason) for a in rows),
        "at_end": sum(r.at_end for r in rows),
    }


def _reached(study: Study, index: int) -> ReachedRow | None:
    """What the boards of a response show from power-up by the recipe."""
    rows = study.rows_of(index, study.power_ups)
    if not rows or study.recipes is None:
        return None
    return {
        **_counted(count(rows, study.plan.census)),
        "reasons": reasons((a.verdict, a.reason) for a in rows),
        "clipped_at_start": sum(r.clipped for r in rows),
        "recipe": study.recipes[study.response_indices.index(index)].as_dict(),
    }


def _attribution(study: Study, index: int) -> AttributionRow | None:
    if study.blame is None or index not in study.response_indices:
        return None
    return study.blame.as_dict()["responses"][study.response_indices.index(index)]


def _rare(study: Study, index: int) -> RareLossKeys | None:
    """Without what it cost, which stands with the other costs."""
    found = study.rare_of(index)
    return None if found is None else _without(found.as_dict(), "question", "seconds")


def _without(row: Mapping[str, Any], *keys: str) -> Any:
    return {key: value for key, value in row.items() if key not in keys}


def _counted(counted: Yield) -> RatedCounts:
    return {**_counts(counted), "rate": counted.rate}


def _agreement(
    answers: Sequence[Answer], cross_checks: Sequence[CrossCheck], not_asked: int
) -> AgreementRow:
    """Boards on which ngspice agrees, by their start: their own orbit, or the nominal one."""
    answer_of = {a.sample: a for a in answers}

    def of(kind: str) -> AgreementCounts:
        outcomes = [
            h.outcome(answer_of[h.sample]) for h in cross_checks if h.kind == kind and h.response
        ]
        return {
            "asked": len(outcomes),
            "agreed": outcomes.count(NgspiceVerdict.AGREED),
            "failed": outcomes.count(NgspiceVerdict.FAILED),
            "undecided": outcomes.count(NgspiceVerdict.UNDECIDED),
        }

    too_long = [h for h in cross_checks if not h.response]
    return {
        **of("own"),
        "nominal_start": {
            **of("nominal"),
            "too_long": len(too_long),
            "left_out": [{"sample": h.sample, "reason": h.reason} for h in too_long],
            "not_asked": not_asked,
        },
    }


def _combined(both: Combined | None) -> CombinedRow | None:
    if both is None:
        return None
    low, high = both.disagreement.interval
    return {
        "estimate": both.estimate,
        "low": both.low,
        "high": both.high,
        "disagreement": {
            "count": both.disagreement.count,
            "asked": both.disagreement.of,
            "low": low,
            "high": high,
        },
        "undecided": both.undecided,
        "if_undecided_lost": both.if_lost,
        "if_undecided_ok": both.if_ok,
        "strata": [
            {
                "name": s.name,
                "samples": s.samples,
                "asked": s.asked,
                "only_ngspice_ok": s.gained,
                "only_exact_ok": s.lost,
            }
            for s in both.strata
        ],
        "differences": plain(both.differences),
    }


def margins(answers: Sequence[Answer]) -> MarginRows:
    """Quantiles of each margin over the boards that are ok and have it; null where none has it.

    boards : that are ok, and ``counted`` by margin: not every board has every margin, such as the
    nearest miss without one. penetration, miss : V of the moving state; the others are ratios.
    """
    ok = [a for a in answers if a.verdict is Verdict.OK]
    values = {
        name: [v for a in ok if math.isfinite(v := float(getattr(a, name)))] for name in MARGINS
    }
    quantiles = {n: np.quantile(v, QUANTILES).tolist() if v else None for n, v in values.items()}
    return {
        "quantiles": QUANTILES,
        "boards": len(ok),
        "counted": {name: len(v) for name, v in values.items()},
        **cast("QuantileRows", quantiles),
    }
