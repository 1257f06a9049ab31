"""Which part is to blame when a board does not show a response.

Three answers for each response, each with what it cost:

- **losses avoided**: lost boards are replayed on the exact rung with one part at its nominal value
  (and without offset, for an op-amp section), everything else as drawn; so are groups of parts. The
  same is done with boards that were ok, which tells the losses that an exact part would *cause*.
- **indices**: first-order and total Sobol indices of the margin (``designer.margins``) over the
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
from itertools import product
from typing import Any

import numpy as np
from scipy.stats import binomtest, sobol_indices

from designer import margins as smooth
from designer.boards import Boards
from designer.circuit import Capacitor, Circuit, Reference, Resistor, Section, nominal_board
from designer.ensemble import Ensemble
from designer.exact import drive_of
from designer.margins import Margin, Prediction
from designer.quantities import Quantity, exact_in, quantities, with_column
from designer.spread import Spread, draw_many, part_of
from designer.system import Array
from designer.system import Index as Places
from designer.verdict import Answer, StudyPlan, Verdict, judge

LOST, KEPT = 50, 20
"""Boards of each response that are replayed: lost ones, and ok ones, in order of the samples."""
CUBE = 512
"""Base samples of the Sobol indices; a power of two."""
CORNER = 5
"""Coordinates that are put to the ends of their ranges."""
SHOWN_LIMITS = 4

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
        if not self.replayed:
            return (0.0, 1.0)
        ci = binomtest(self.avoided, self.replayed).proportion_ci(0.95, method="wilson")
        return (float(ci.low), float(ci.high))


@dataclass(frozen=True)
class Index:
    """Sobol indices of the margin for one coordinate of the spread, which belongs to ``part``."""

    coordinate: str
    part: str
    first: float
    total: float


@dataclass(frozen=True)
class NearLimit:
    """What ends the response: in words, and how many standard deviations away it is nominally."""

    what: str
    distance: float


@dataclass(frozen=True)
class Corner:
    """Coordinates at the ends of their ranges, all others nominal.

    coordinates : what was put to its ends; worst : for each "low" or "high" in the corner of the
    least margin; margin : there. verdict, response : on the exact rung. survived : of ``corners``.
    """

    coordinates: tuple[str, ...]
    worst: tuple[str, ...]
    margin: float
    verdict: Verdict
    response: str
    survived: int
    corners: int


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
            for subject, plain in zip(r.subjects, row["subjects"], strict=True):
                plain["low"], plain["high"] = subject.interval
            rows.append(row)
        cost = {"attractors": self.attractors, "orbits": self.orbits, "seconds": self.seconds}
        out = {"samples": self.samples, "seed": self.seed, "responses": rows, "cost": cost}
        plain_out: dict[str, Any] = _finite(out)
        return plain_out


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
    boards = draw_many(plan.circuit, plan.spread, plan.seed, range(count))
    rows = [
        sorted((a for a in answers if a.question == i), key=lambda a: a.sample)
        for i in range(len(plan.questions))
    ]
    subjects = _replay(plan, boards, rows, (lost, kept), jobs, count_as("attractors"))
    found = smooth.margins(
        plan.circuit, plan.questions, boards, rows, jobs=jobs, progress=count_as("orbits")
    )
    indices = sobol(plan.circuit, plan.spread, found, plan.seed)
    corners = _corners(plan, found, indices, jobs, count_as("attractors"))
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


def sobol(
    circuit: Circuit, spread: Spread, margins: Sequence[Margin], seed: int, base: int = CUBE
) -> list[tuple[Index, ...]]:
    """Sobol indices of each margin over the spread's coordinates, largest total first.

    Saltelli's estimators with ``base`` base samples on a scrambled Sobol set (scipy.stats). Empty
    where nothing limits.
    """
    names = spread.coordinates(circuit)
    real = [m for m in margins if m.limits]
    if not real:
        return [() for _ in margins]

    def values(cube: Array) -> Array:
        boards = spread.from_cube(circuit, np.minimum(cube.T, 1.0 - 2.0**-53))
        return np.stack([m.of(boards) for m in real])

    uniform: Any = _Uniform()
    found = sobol_indices(
        func=values,
        n=base,
        dists=[uniform] * len(names),
        rng=np.random.default_rng([seed, base]),
    )
    first = np.reshape(found.first_order, (len(real), len(names)))
    total = np.reshape(found.total_order, (len(real), len(names)))
    by_margin = iter(range(len(real)))
    out: list[tuple[Index, ...]] = []
    for margin in margins:
        if not margin.limits:
            out.append(())
            continue
        i = next(by_margin)
        rows = (
            Index(name, part_of(name), float(first[i, k]), float(total[i, k]))
            for k, name in enumerate(names)
        )
        out.append(tuple(sorted(rows, key=lambda x: (-x.total, x.coordinate))))
    return out


class _Uniform:
    """A coordinate of the cube, as scipy.stats wants it."""

    def ppf(self, q: Array) -> Array:
        return q


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
    drives = [drive_of(q.excitation) for q in plan.questions]
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


def _corners(
    plan: StudyPlan,
    margins: Sequence[Margin],
    indices: Sequence[Sequence[Index]],
    jobs: int,
    progress: Callable[[], None],
) -> list[Corner | None]:
    width = len(plan.spread.coordinates(plan.circuit))
    ends = plan.spread.from_cube(
        plan.circuit, np.array([np.zeros(width), np.full(width, 1.0 - 2.0**-53)])
    )
    out: list[Corner | None] = []
    for i, (margin, ranked) in enumerate(zip(margins, indices, strict=True)):
        known = {q.name: q for q in margin.quantities}
        chosen = [known[x.coordinate] for x in ranked if x.coordinate in known][:CORNER]
        if not chosen:
            out.append(None)
            continue
        picks = np.array(list(product((0, 1), repeat=len(chosen))), dtype=np.intp)
        boards = _corner_boards(plan.circuit, chosen, ends, picks)
        question = plan.questions[i]
        orbits = Ensemble(boards).settle(
            range(len(boards)),
            [drive_of(question.excitation)] * len(boards),
            np.tile(question.start.start, (len(boards), 1)),
            jobs=jobs,
            progress=progress,
        )
        verdicts = [judge(o, question.spec, question.start)[0] for o in orbits]
        values = margin.of(boards)
        worst = int(np.argmin(values))
        out.append(
            Corner(
                tuple(q.name for q in chosen),
                tuple("high" if end else "low" for end in picks[worst]),
                float(values[worst]),
                verdicts[worst],
                orbits[worst].response,
                sum(v is Verdict.OK for v in verdicts),
                len(boards),
            )
        )
    return out


def _corner_boards(
    circuit: Circuit, chosen: Sequence[Quantity], ends: Boards, picks: Places
) -> Boards:
    """(2^k,) nominal boards with the chosen quantities at their low (0) or high (1) end."""
    boards = Boards.of(circuit, [nominal_board(circuit)]).take(np.zeros(len(picks), dtype=np.intp))
    for k, q in enumerate(chosen):
        # Of a lower limit too "low" is the smaller number, whichever way it is drawn.
        pair = np.sort(getattr(ends, q.group)[q.part])
        boards = with_column(boards, q, pair[picks[:, k]])
    return boards


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


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return str(value) if isinstance(value, Verdict) else value
