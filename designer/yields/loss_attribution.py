"""Yield-loss attribution: which parts make boards lose a response.

Three answers for each response, each with what it cost: the losses that an exact part avoids or
causes (``loss_replay``); the Sobol indices of the margin over the coordinates of the spread, with
how well the margin predicts verdicts; and the worst corner (``worst_corner``).
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from designer.base.plain_json import plain
from designer.verdicts.verdict import Answer, Question, StudyPlan, Verdict
from designer.yields import margins as margin_limits
from designer.yields.loss_replay import KEPT, LOST, PartAttribution, extent_of, replay
from designer.yields.margins import Margin, Prediction
from designer.yields.stored_parts import StoredParts
from designer.yields.worst_corner import Corner, Index, sobol, worst_corners

if TYPE_CHECKING:
    from designer.answers.study_answer import AttributionRows, AttributionStatusRow

SHOWN_LIMITS = 4
NOTHING_LOST = "no board was lost, so none was replayed"


@dataclass(frozen=True)
class NearLimit:
    """What ends the response."""

    what: str
    """What ends the response, in words."""
    distance: float
    """How many standard deviations away it is on the nominal board."""


@dataclass(frozen=True)
class ResponseAttribution:
    """The attribution of one response: why boards lose it."""

    question: int
    """Number of the question of the plan."""
    lost: int
    """Boards of the study that lost the response."""
    subjects: tuple[PartAttribution, ...]
    """Parts and groups that were made exact, most losses avoided first."""
    indices: tuple[Index, ...]
    """Sobol indices of the margin."""
    limits: tuple[NearLimit, ...]
    """Ways of losing the response, the nearest first."""
    prediction: Prediction
    """How well the margin foretells what became of boards."""
    sought: int
    """Lost boards on which the response was looked for."""
    there: int
    """How many of the ``sought`` lost boards have the response, while the nominal orbit leads
    elsewhere."""
    corner: Corner | None
    """The worst corner; None where none was looked for."""
    limited_by: str
    """What limits the response, in one sentence."""
    skipped: str = ""
    """Why boards were not replayed, or no more than a few; "" where they were."""


@dataclass(frozen=True)
class Attribution:
    """The attribution of every question. Only ``seconds`` may differ between equal runs."""

    responses: tuple[ResponseAttribution, ...]
    """The attribution of each question."""
    samples: int
    """How many boards were drawn."""
    seed: int
    """Seed that the boards were drawn with."""
    attractors: int
    """Attractors that were sought."""
    orbits: int
    """Orbits that were followed."""
    seconds: float
    """Wall time [s]."""
    budget: int | None = None
    """Steps that were allowed, None where all were."""
    share: float = 1.0
    """Share of the whole work that was done within the budget."""

    @property
    def noise_known(self) -> bool:
        """Whether the indices have their noise; an earlier version made them without."""
        made = (index for response in self.responses for index in response.indices)
        return all(math.isfinite(i.total_error) for i in made if math.isfinite(i.total))

    def as_dict(self) -> AttributionRows:
        """The attribution as plain data for JSON; an undefined number is None."""
        rows = []
        for r in self.responses:
            row = asdict(r)
            row["prediction"]["right"] = r.prediction.right
            for subject, its_row in zip(r.subjects, row["subjects"], strict=True):
                its_row["low"], its_row["high"] = subject.interval
            rows.append(row)
        cost = {"attractors": self.attractors, "orbits": self.orbits, "seconds": self.seconds}
        out = {"samples": self.samples, "seed": self.seed, "responses": rows, "cost": cost}
        document: AttributionRows = plain(out)
        return document


def attribute(
    plan: StudyPlan,
    answers: Sequence[Answer],
    *,
    lost: int = LOST,
    ok: int = KEPT,
    budget: int | None = None,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
    parts: StoredParts | None = None,
) -> Attribution:
    """Attribute the losses among these answers to parts (as built, on the exact circuit).

    answers : of any of the plan's samples, in any order. lost, ok : boards of each response that
    are replayed, at most. budget : steps of the work (``loss_replay``); all of it if None.
    progress : called once for each of the extent's steps. parts : the finished ones of this very
    attribution, and where the others go. The same answers and budget give the same attribution but
    for ``seconds``.
    """
    began = time.perf_counter()
    spent = Counter[str]()

    def count_as(kind: str) -> Callable[[], None]:
        def step() -> None:
            spent[kind] += 1
            progress()

        return step

    parts = StoredParts() if parts is None else parts
    extent = extent_of(plan, answers, budget, lost=lost, ok=ok)
    attractor, orbit = count_as("attractors"), count_as("orbits")
    attributed, cut = replay(plan, extent, parts, jobs, attractor)
    margins = margin_limits.margins(
        plan.circuit,
        plan.questions,
        extent.boards,
        extent.rows,
        only=extent.crossings,
        jobs=jobs,
        progress=orbit,
        parts=parts,
    )
    indices = sobol(plan.circuit, plan.spread, margins, plan.seed)
    corners = worst_corners(plan, margins, indices, jobs, attractor, parts)
    for _ in range(extent.steps - spent.total()):  # what turned out not to be needed
        progress()
    responses = [
        ResponseAttribution(
            question=i,
            lost=sum(a.verdict is Verdict.LOST for a in row),
            subjects=attributed[i],
            indices=indices[i],
            limits=tuple(
                NearLimit(x.what, x.reliability_index) for x in margin.limits[:SHOWN_LIMITS]
            ),
            prediction=margin.prediction,
            sought=margin.sought,
            there=margin.there,
            corner=corners[i],
            limited_by=_sentence(row, attributed[i], indices[i], margin, plan.questions[i]),
            skipped=_skipped(row, attributed[i], cut[i]),
        )
        for i, (row, margin) in enumerate(zip(extent.rows, margins, strict=True))
    ]
    return Attribution(
        tuple(responses),
        1 + max((a.sample for a in answers), default=0),
        plan.seed,
        spent["attractors"],
        spent["orbits"],
        time.perf_counter() - began,
        None if extent.share >= 1.0 else budget,
        extent.share,
    )


def _skipped(row: Sequence[Answer], attributed: Sequence[PartAttribution], cut: bool) -> str:
    """Why the boards of one question were not replayed, or not all of them."""
    lost = [a for a in row if a.verdict is Verdict.LOST]
    if not lost:
        return NOTHING_LOST
    if not cut:
        return ""
    causes = {a.reason for a in lost}
    cause = f" ({causes.pop()})" if len(causes) == 1 else ""
    replayed = max((p.replayed for p in attributed), default=0)
    return (
        f"every board is lost{cause}, and no part or group that was made exact saves one of the "
        f"first {replayed}, so no more were replayed"
    )


def _sentence(
    row: Sequence[Answer],
    attributed: Sequence[PartAttribution],
    indices: Sequence[Index],
    margin: Margin,
    question: Question,
) -> str:
    """What limits the response, in one line."""
    nearest = margin.limits[0] if margin.limits else None
    through = ", ".join(list(dict.fromkeys(index.part for index in indices))[:3])
    lost = [a for a in row if a.verdict is Verdict.LOST]
    if not lost:
        if not question.periodic:
            return "nothing was lost; a motion without a period has no orbit to follow to a limit"
        if nearest is None:
            return "nothing within the spread"
        return (
            f"nothing was lost; nearest is {nearest.what}, {nearest.reliability_index:.2g} "
            f"standard deviations away, mostly through {through}"
        )
    clauses = []
    if nearest is not None:
        clauses.append(f"{nearest.what}, mostly through {through}")
    helped = [p for p in attributed if p.kind == "group" and p.avoided]
    if helped:
        best = helped[0]
        clauses.append(f"{best.name} exact: {best.avoided} of {best.replayed} losses avoided")
    to, number = Counter(a.response for a in lost).most_common(1)[0]
    clauses.append(f"lost most often to {to} ({number} of {len(lost)})")
    if margin.sought and 2 * margin.there > margin.sought:
        clauses.append("the response exists on most lost boards, but the start leads elsewhere")
    return "; ".join(clauses)


class AttributionStage(StrEnum):
    """How far an attribution is."""

    WHOLE = "whole"
    PART = "part"
    NOT_YET = "not done yet"
    LEFT_OUT = "left out"


@dataclass(frozen=True)
class AttributionStatus:
    """How much of a study's attribution there is, for its answer, its page and the terminal."""

    stage: AttributionStage
    """How far the attribution is."""
    share: float
    """Share of the whole work that was done."""
    budget: int | None
    """Steps that were allowed, None where all were."""
    reason: str
    """Why there is no attribution, or not all of it; "" where it is whole."""

    @classmethod
    def of(cls, attribution: Attribution | None, wanted: bool = True) -> AttributionStatus:
        """The status of what a study has. wanted : whether an attribution was asked for."""
        if attribution is None and not wanted:
            return cls(AttributionStage.LEFT_OUT, 0.0, None, "it was not asked for")
        if attribution is None:
            reason = "the yields stand without it; it is worked out after them"
            return cls(AttributionStage.NOT_YET, 0.0, None, reason)
        if attribution.share >= 1.0:
            return cls(AttributionStage.WHOLE, 1.0, attribution.budget, "")
        reason = (
            f"{100.0 * attribution.share:.0f} % of its work fits into {attribution.budget} steps, "
            "so fewer boards were replayed and followed than without a budget"
        )
        return cls(AttributionStage.PART, attribution.share, attribution.budget, reason)

    @property
    def sentence(self) -> str:
        """The status in one sentence; "" where the attribution is whole."""
        if self.stage is AttributionStage.WHOLE:
            return ""
        if self.stage is AttributionStage.PART:
            return f"Blame, in part: {self.reason}."
        return f"Blame {self.stage}: {self.reason}."

    def as_dict(self) -> AttributionStatusRow:
        """The status as plain data for JSON."""
        return {
            "status": str(self.stage),
            "share": self.share,
            "budget": self.budget,
            "reason": self.reason,
        }
