"""Boards that are asked again with one part exact: which losses does that part explain.

Lost boards are replayed on the exact rung with one part at its nominal value (and without offset,
for an op-amp section), everything else as drawn; so are groups of parts. The same is done with
boards that were ok, which tells the losses that an exact part would *cause*.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from designer.base.proportion import wilson
from designer.base.threads import parallel
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Capacitor, Circuit, Reference, Resistor, Section
from designer.spread.board_quantities import exact_in, quantities
from designer.yields.blame_pieces import StoredParts
from designer.yields.verdict import Answer, StudyPlan, Verdict, judge

LOST, KEPT = 50, 20
"""Boards of each response that are replayed: lost ones, and ok ones, in order of the samples."""
PROBE = 10
"""Lost boards of a response of which no board is ok that decide whether more are replayed."""
TOGETHER = 8
"""Boards that are replayed before what they showed is stored; no answer depends on it."""

_DEAD_ZONE = re.compile(r"R[2-9]\d\d[AB]?")
_VERDICTS = {str(verdict)[0]: verdict for verdict in Verdict}
"""A verdict by its first letter, as a piece holds it."""


@dataclass(frozen=True)
class BlamedPart:
    """A part or a group that was made exact, and what became of the boards.

    Boards without an answer count in neither ``avoided`` nor ``caused``.
    """

    name: str
    """Name of the part or the group."""
    kind: str
    """"resistor", "capacitor", "op-amp", "reference", "supply" or "group"."""
    avoided: int
    """Of ``replayed`` boards, those that were ok then."""
    replayed: int
    """Lost boards that were asked again."""
    caused: int
    """Of ``kept`` boards, those that were lost then."""
    kept: int
    """Ok boards that were asked again."""

    @property
    def share(self) -> float:
        """Of the losses, avoided; nan where nothing was replayed."""
        return self.avoided / self.replayed if self.replayed else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Two-sided 95 % Wilson interval of the share."""
        return wilson(self.avoided, self.replayed)


@dataclass(frozen=True)
class ExactChange:
    """A part or a group that is made exact on boards that are replayed."""

    name: str
    """Name of the part or the group."""
    kind: str
    """What it is; see ``BlamedPart``."""
    parts: tuple[str, ...] = ()
    """Names of the parts that get their nominal values."""
    fields: tuple[str, ...] = ()
    """Fields of ``Boards`` that are nominal on every part."""

    def of(self, boards: Boards) -> Boards:
        """The same boards with it exact."""
        return exact_in(boards, self.fields) if self.fields else boards.exact(self.parts)


@dataclass(frozen=True)
class Replay:
    """A board that is asked a question again."""

    question: int
    """Number of the question of the plan."""
    sample: int
    """Number of the board."""
    before: Verdict
    """What became of the board in the study."""
    place: int
    """Number of lost or of ok boards of the question before it."""
    turn: float
    """Share of the question's boards of that verdict that come before it."""

    @property
    def piece(self) -> str:
        """Name of what it shows among the pieces of a blame."""
        return f"replay {self.question} {self.sample}"


def replays(rows: Sequence[Sequence[Answer]], most: tuple[int, int]) -> list[Replay]:
    """The boards that are replayed, every response's in turn, so that a first part of the list
    holds some of each.

    rows : the answers to each question, by sample. most : lost and ok boards of each. A question
    that lost no board has none.
    """
    found = [
        Replay(i, a.sample, verdict, place, place / limit)
        for i, row in enumerate(rows)
        if any(a.verdict is Verdict.LOST for a in row)
        for verdict, limit in zip((Verdict.LOST, Verdict.OK), most, strict=True)
        for place, a in enumerate(islice((a for a in row if a.verdict is verdict), limit))
    ]
    return sorted(found, key=lambda r: (r.turn, r.question, r.sample))


def changes(circuit: Circuit, boards: Boards) -> list[ExactChange]:
    """Every part that differs between these boards, and the groups of them."""
    differing = {q.part for q in quantities(circuit, boards)}
    differing |= {s.name for s in circuit.sections if s.name in boards.low}
    kinds = {p.name: _KINDS[type(p)] for p in circuit.parts if type(p) in _KINDS}
    kinds |= {rail.name: "supply" for rail in circuit.rails}
    out = [ExactChange(n, k, (n,)) for n, k in kinds.items() if n in differing]

    def group(name: str, parts: Iterable[str]) -> None:
        parts = tuple(p for p in parts if p in differing)
        if len(parts) > 1:
            out.append(ExactChange(name, "group", parts))

    if len({q.part for q in quantities(circuit, boards) if q.group == "offset"}) > 1:
        out.append(ExactChange("all offsets", "group", fields=("offset",)))
    if boards.low:
        out.append(ExactChange("all output limits", "group", fields=("low", "high")))
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


def replay(
    plan: StudyPlan,
    boards: Boards,
    todo: Sequence[Replay],
    made: Sequence[ExactChange],
    hopeless: Sequence[bool],
    pieces: StoredParts,
    jobs: int,
    progress: Callable[[], None],
) -> tuple[list[tuple[BlamedPart, ...]], list[bool]]:
    """The subjects of each question, most losses avoided first; and whether its replays were cut
    short.

    boards : of the study, by sample. made : what is made exact. hopeless : of each question,
    whether no board of the study shows it. Of such a one no more than ``PROBE`` boards are
    replayed where nothing that was made exact saves any of them. progress : called once an
    attractor, also where the pieces know it.
    """
    first = [r for r in todo if r.before is Verdict.LOST and r.place < PROBE]
    seen = _all(plan, boards, first, made, pieces, jobs, progress)
    saved = {r.question for r in first if Verdict.OK in seen[r]}
    cut = [lost and i not in saved for i, lost in enumerate(hopeless)]
    rest = [r for r in todo if r not in seen and not cut[r.question]]
    seen |= _all(plan, boards, rest, made, pieces, jobs, progress)
    return [_subjects(i, made, seen) for i in range(len(plan.questions))], cut


def _all(
    plan: StudyPlan,
    boards: Boards,
    todo: Sequence[Replay],
    made: Sequence[ExactChange],
    pieces: StoredParts,
    jobs: int,
    progress: Callable[[], None],
) -> dict[Replay, list[Verdict]]:
    """What each board shows with each change; what the pieces hold is not computed again."""
    seen: dict[Replay, list[Verdict]] = {}
    for r in todo:
        known = pieces.get(r.piece)
        if known is not None:
            seen[r] = [_VERDICTS[letter] for letter in known]
            for _ in made:
                progress()
    missing = [r for r in todo if r not in seen]
    for start in range(0, len(missing), TOGETHER):
        some = missing[start : start + TOGETHER]
        columns = _some(plan, boards, some, made, jobs, progress)
        seen |= {r: list(row) for r, row in zip(some, zip(*columns, strict=True), strict=True)}
        pieces.put({r.piece: "".join(str(v)[0] for v in seen[r]) for r in some})
    return seen


def _some(
    plan: StudyPlan,
    boards: Boards,
    some: Sequence[Replay],
    made: Sequence[ExactChange],
    jobs: int,
    progress: Callable[[], None],
) -> list[list[Verdict]]:
    """For each change the verdicts of these boards with it."""
    samples = sorted({r.sample for r in some})
    place = {sample: k for k, sample in enumerate(samples)}
    drawn = boards.take(samples)
    questions = [plan.questions[r.question] for r in some]
    starts = np.array([q.start.start for q in questions])

    def one(change: ExactChange) -> list[Verdict]:
        orbits = Ensemble(change.of(drawn)).settle(
            [place[r.sample] for r in some],
            [q.excitation.drive for q in questions],
            starts,
            progress=progress,
        )
        pairs = zip(orbits, questions, strict=True)
        return [judge(orbit, q.spec, q.start)[0] for orbit, q in pairs]

    return list(parallel(one, made, jobs))


def _subjects(
    question: int, made: Sequence[ExactChange], seen: dict[Replay, list[Verdict]]
) -> tuple[BlamedPart, ...]:
    own = {r: verdicts for r, verdicts in seen.items() if r.question == question}
    if not own:
        return ()
    out = []
    for k, change in enumerate(made):
        tally = Counter((r.before, verdicts[k]) for r, verdicts in own.items())
        replayed, kept = (
            sum(tally[before, now] for now in Verdict if now is not Verdict.FAILED)
            for before in (Verdict.LOST, Verdict.OK)
        )
        avoided, caused = tally[Verdict.LOST, Verdict.OK], tally[Verdict.OK, Verdict.LOST]
        out.append(BlamedPart(change.name, change.kind, avoided, replayed, caused, kept))
    return tuple(sorted(out, key=lambda s: (-s.avoided, s.caused, s.name)))
