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

import re
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from designer.base.plain_json import plain
from designer.base.proportion import wilson
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Capacitor, Reference, Resistor, Section
from designer.spread.board_quantities import exact_in, quantities
from designer.spread.spread import draw_many
from designer.yields import margins as smooth
from designer.yields.corners import Corner, worst_corners
from designer.yields.margins import Margin, Prediction
from designer.yields.sobol import Index, sobol
from designer.yields.verdict import Answer, StudyPlan, Verdict, judge

LOST, KEPT = 50, 20
"""Boards of each response that are replayed: lost ones, and ok ones, in order of the samples."""
SHOWN_LIMITS = 4
DRAWN = 256
"""Boards, at least, from which the standard deviations of the quantities are taken."""

_DEAD_ZONE = re.compile(r"R[2-9]\d\d[AB]?")


@dataclass(frozen=True)
class Subject:
    """A part or a group that was made exact, and what became of the boards.

    kind : "resistor", "capacitor", "op-amp", "reference", "supply" or "group". avoided of replayed
    lost boards were ok then; caused of kept ok boards were lost. Boards without an answer count in
    neither.
    """

    name: str
    kind: str
    avoided: int
    replayed: int
    caused: int
    kept: int

    @property
    def share(self) -> float:
        """Of the losses, avoided; nan where nothing was replayed."""
        return self.avoided / self.replayed if self.replayed else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Two-sided 95 % Wilson interval of the share."""
        return wilson(self.avoided, self.replayed)


@dataclass(frozen=True)
class NearLimit:
    """What ends the response: in words, and how many standard deviations away it is nominally."""

    what: str
    distance: float


@dataclass(frozen=True)
class ResponseBlame:
    """Of one question of the plan.

    lost : boards of the study. subjects : most losses avoided first, groups among them. there : of
    ``sought`` lost boards, those on which the response exists and the nominal orbit leads
    elsewhere. limited_by : one sentence.
    """

    question: int
    lost: int
    subjects: tuple[Subject, ...]
    indices: tuple[Index, ...]
    limits: tuple[NearLimit, ...]
    prediction: Prediction
    sought: int
    there: int
    corner: Corner | None
    limited_by: str


@dataclass(frozen=True)
class Blame:
    """The blame of every question. attractors, orbits : sought and followed; seconds : wall time,
    all that may differ between equal runs."""

    responses: tuple[ResponseBlame, ...]
    samples: int
    seed: int
    attractors: int
    orbits: int
    seconds: float

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
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> Blame:
    """Blame the parts for the losses among these answers (as built, exact rung).

    answers : of any of the plan's samples, in any order. lost, kept : boards of each response that
    are replayed, at most. progress : called once an attractor that was sought or an orbit that was
    followed. The same answers give the same blame but for ``seconds``.
    """
    began = time.perf_counter()
    spent = Counter[str]()

    def count_as(kind: str) -> Callable[[], None]:
        def step() -> None:
            spent[kind] += 1
            progress()

        return step

    count = 1 + max((a.sample for a in answers), default=0)
    boards = draw_many(plan.circuit, plan.spread, plan.seed, range(max(count, DRAWN)))
    rows = [
        sorted((a for a in answers if a.question == i), key=lambda a: a.sample)
        for i in range(len(plan.questions))
    ]
    subjects = _replay(plan, boards, rows, (lost, kept), jobs, count_as("attractors"))
    found = smooth.margins(
        plan.circuit, plan.questions, boards, rows, jobs=jobs, progress=count_as("orbits")
    )
    indices = sobol(plan.circuit, plan.spread, found, plan.seed)
    corners = worst_corners(plan, found, indices, jobs, count_as("attractors"))
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
            )
        )
    return Blame(
        tuple(responses),
        count,
        plan.seed,
        spent["attractors"],
        spent["orbits"],
        time.perf_counter() - began,
    )


def _replay(
    plan: StudyPlan,
    boards: Boards,
    rows: Sequence[Sequence[Answer]],
    most: tuple[int, int],
    jobs: int,
    progress: Callable[[], None],
) -> list[tuple[Subject, ...]]:
    tasks = [
        (i, a.sample, a.verdict)
        for i, row in enumerate(rows)
        if any(a.verdict is Verdict.LOST for a in row)
        for verdict, limit in ((Verdict.LOST, most[0]), (Verdict.OK, most[1]))
        for a in [a for a in row if a.verdict is verdict][:limit]
    ]
    out: list[list[Subject]] = [[] for _ in rows]
    samples = sorted({sample for _, sample, _ in tasks})
    place = {sample: k for k, sample in enumerate(samples)}
    drives = [q.excitation.drive for q in plan.questions]
    for name, kind, changed in _exact_ones(boards.take(samples)) if samples else ():
        orbits = Ensemble(changed).settle(
            [place[sample] for _, sample, _ in tasks],
            [drives[i] for i, _, _ in tasks],
            np.array([plan.questions[i].start.start for i, _, _ in tasks]),
            jobs=jobs,
            progress=progress,
        )
        tally = Counter[tuple[int, Verdict, Verdict]]()
        for (i, _, before), orbit in zip(tasks, orbits, strict=True):
            question = plan.questions[i]
            tally[i, before, judge(orbit, question.spec, question.start)[0]] += 1
        for i in {i for i, _, _ in tasks}:
            replayed, kept = (
                sum(tally[i, before, now] for now in Verdict if now is not Verdict.FAILED)
                for before in (Verdict.LOST, Verdict.OK)
            )
            avoided, caused = (
                tally[i, Verdict.LOST, Verdict.OK],
                tally[i, Verdict.OK, Verdict.LOST],
            )
            out[i].append(Subject(name, kind, avoided, replayed, caused, kept))
    return [tuple(sorted(row, key=lambda s: (-s.avoided, s.caused, s.name))) for row in out]


def _exact_ones(boards: Boards) -> list[tuple[str, str, Boards]]:
    """Every part that differs between these boards, and the groups, each made exact."""
    circuit = boards.circuit
    differing = {q.part for q in quantities(circuit, boards)}
    differing |= {s.name for s in circuit.sections if s.name in boards.low}
    kinds = {p.name: _KINDS[type(p)] for p in circuit.parts if type(p) in _KINDS}
    kinds |= {rail.name: "supply" for rail in circuit.rails}
    out = [(n, k, boards.exact([n])) for n, k in kinds.items() if n in differing]

    def group(name: str, parts: Sequence[str]) -> None:
        parts = [p for p in parts if p in differing]
        if len(parts) > 1:
            out.append((name, "group", boards.exact(parts)))

    if len({q.part for q in quantities(circuit, boards) if q.group == "offset"}) > 1:
        out.append(("all offsets", "group", exact_in(boards, ("offset",))))
    if boards.low:
        out.append(("all output limits", "group", exact_in(boards, ("low", "high"))))
    resistors = [r.name for r in circuit.resistors]
    dead_zone = [n for n in resistors if _DEAD_ZONE.fullmatch(n)]
    group("resistors of the dead zone", dead_zone)
    group("all other resistors", [n for n in resistors if n not in dead_zone])
    group("all capacitors", [c.name for c in circuit.capacitors])
    group("all references", [r.name for r in circuit.references])
    group("both supplies", [rail.name for rail in circuit.rails])
    return out


_KINDS: dict[type, str] = {
    Resistor: "resistor",
    Capacitor: "capacitor",
    Section: "op-amp",
    Reference: "reference",
}


def _sentence(
    row: Sequence[Answer], subjects: Sequence[Subject], indices: Sequence[Index], margin: Margin
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
