"""Which part is to blame when a board does not show a response.

Three answers for each response, each with what it cost:

- **losses avoided**: lost boards are replayed on the exact rung with one part at its nominal value
  (and without offset, for an op-amp section), everything else as drawn; so are groups of parts. The
  same is done with boards that were ok, which tells the losses that an exact part would *cause*.
- **indices**: first-order and total Sobol indices of the margin (``yields.margins``) over the
  spread's own coordinates: the shares of the margin's variance that a coordinate explains alone,
  and together with others. With them stands how well the margin foretells verdicts.
- **worst corner**: the coordinates of the largest indices at the ends of their ranges, all others
  nominal, in every combination, on the exact rung.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from designer.base.plain_json import plain
from designer.yields import margins as smooth
from designer.yields.blame_extent import extent_of
from designer.yields.blame_pieces import StoredParts
from designer.yields.blame_replay import KEPT, LOST, BlamedPart as BlamedPart, replay
from designer.yields.corners import Corner, worst_corners
from designer.yields.margins import Margin, Prediction
from designer.yields.sobol import Index, sobol
from designer.yields.verdict import Answer, StudyPlan, Verdict

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
class ResponseBlame:
    """Why boards lose one response."""

    question: int
    """Number of the question of the plan."""
    lost: int
    """Boards of the study that lost the response."""
    subjects: tuple[BlamedPart, ...]
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
    """Of ``sought`` lost boards, those on which the response exists and the nominal orbit
    leads elsewhere."""
    corner: Corner | None
    """The worst corner; None where none was looked for."""
    limited_by: str
    """What limits the response, in one sentence."""
    skipped: str = ""
    """Why boards were not replayed, or no more than a few; "" where they were."""


@dataclass(frozen=True)
class Blame:
    """The blame of every question. Only ``seconds`` may differ between equal runs."""

    responses: tuple[ResponseBlame, ...]
    """The blame of each question."""
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

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON; an undefined number is None."""
        rows = []
        for r in self.responses:
            row = asdict(r)
            row["prediction"]["right"] = r.prediction.right
            for subject, its_row in zip(r.subjects, row["subjects"], strict=True):
                its_row["low"], its_row["high"] = subject.interval
            rows.append(row)
        cost = {"attractors": self.attractors, "orbits": self.orbits, "seconds": self.seconds}
        out = {"samples": self.samples, "seed": self.seed, "responses": rows, "cost": cost}
        shown: dict[str, Any] = plain(out)
        return shown


def blame(
    plan: StudyPlan,
    answers: Sequence[Answer],
    *,
    lost: int = LOST,
    kept: int = KEPT,
    budget: int | None = None,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
    pieces: StoredParts | None = None,
) -> Blame:
    """Blame the parts for the losses among these answers (as built, exact rung).

    answers : of any of the plan's samples, in any order. lost, kept : boards of each response that
    are replayed, at most. budget : steps of the work, see ``blame_extent``; all of it if None.
    progress : called once for each of the extent's steps. pieces : what is known of this very
    blame, and where the rest goes as it is found. The same answers and budget give the same blame
    but for ``seconds``.
    """
    began = time.perf_counter()
    spent = Counter[str]()

    def count_as(kind: str) -> Callable[[], None]:
        def step() -> None:
            spent[kind] += 1
            progress()

        return step

    pieces = StoredParts() if pieces is None else pieces
    extent = extent_of(plan, answers, budget, lost=lost, kept=kept)
    boards, rows = extent.boards, extent.rows
    subjects, cut = replay(
        plan,
        boards,
        extent.replays,
        extent.made,
        extent.hopeless,
        pieces,
        jobs,
        count_as("attractors"),
    )
    found = smooth.margins(
        plan.circuit,
        plan.questions,
        boards,
        rows,
        only=extent.crossings,
        jobs=jobs,
        progress=count_as("orbits"),
        pieces=pieces,
    )
    indices = sobol(plan.circuit, plan.spread, found, plan.seed)
    corners = worst_corners(plan, found, indices, jobs, count_as("attractors"), pieces)
    for _ in range(extent.steps - spent.total()):  # what turned out not to be needed
        progress()
    responses = []
    for i, row in enumerate(rows):
        number = sum(a.verdict is Verdict.LOST for a in row)
        limits = tuple(NearLimit(x.what, x.distance) for x in found[i].limits[:SHOWN_LIMITS])
        responses.append(
            ResponseBlame(
                question=i,
                lost=number,
                subjects=subjects[i],
                indices=indices[i],
                limits=limits,
                prediction=found[i].prediction,
                sought=found[i].sought,
                there=found[i].there,
                corner=corners[i],
                limited_by=_sentence(row, subjects[i], indices[i], found[i]),
                skipped=_skipped(row, subjects[i], cut[i]),
            )
        )
    return Blame(
        tuple(responses),
        1 + max((a.sample for a in answers), default=0),
        plan.seed,
        spent["attractors"],
        spent["orbits"],
        time.perf_counter() - began,
        None if extent.share >= 1.0 else budget,
        extent.share,
    )


def _skipped(row: Sequence[Answer], subjects: Sequence[BlamedPart], cut: bool) -> str:
    """Why the boards of one question were not replayed, or not all of them."""
    lost = [a for a in row if a.verdict is Verdict.LOST]
    if not lost:
        return NOTHING_LOST
    if not cut:
        return ""
    causes = {a.reason for a in lost}
    cause = f" ({causes.pop()})" if len(causes) == 1 else ""
    replayed = max((s.replayed for s in subjects), default=0)
    return (
        f"every board is lost{cause}, and no part or group that was made exact saves one of the "
        f"first {replayed}, so no more were replayed"
    )


def _sentence(
    row: Sequence[Answer], subjects: Sequence[BlamedPart], indices: Sequence[Index], margin: Margin
) -> str:
    """What limits the response, in one line."""
    nearest = margin.limits[0] if margin.limits else None
    through = ", ".join(list(dict.fromkeys(index.part for index in indices))[:3])
    lost = [a for a in row if a.verdict is Verdict.LOST]
    if not lost:
        if nearest is None:
            return "nothing within the spread"
        return (
            f"nothing was lost; nearest is {nearest.what}, {nearest.distance:.2g} standard "
            f"deviations away, mostly through {through}"
        )
    said = []
    if nearest is not None:
        said.append(f"{nearest.what}, mostly through {through}")
    helped = [s for s in subjects if s.kind == "group" and s.avoided]
    if helped:
        best = helped[0]
        said.append(f"{best.name} exact: {best.avoided} of {best.replayed} losses avoided")
    to, number = Counter(a.response for a in lost).most_common(1)[0]
    said.append(f"lost most often to {to} ({number} of {len(lost)})")
    if margin.sought and 2 * margin.there > margin.sought:
        said.append("the response exists on most lost boards, but the start leads elsewhere")
    return "; ".join(said)
