"""Boards that are asked again with one part exact: which losses does that part explain.

Lost boards are replayed on the exact circuit with one part at its nominal value (and without
offset, for an op-amp section), everything else as drawn; so are groups of parts. The same is done
with boards that were ok, which tells the losses that an exact part would *cause*.

The unit of an attribution's work is a step: an attractor that is sought, or an orbit that is
followed. How many there are is known before the first, so that progress can say how long it takes.
A board that took many drive periods in the study counts for several, since it takes as many again.
What a budget leaves out are boards: fewer lost ones are replayed and followed, of every response in
turn, never fewer parts.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby, islice

import numpy as np

from designer.base.proportion import wilson
from designer.base.threads import parallel
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import BRIEF, Ensemble
from designer.circuit.netlist import Capacitor, Circuit, Reference, Resistor, Section
from designer.spread.board_quantities import exact_in, quantities
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import Answer, StudyPlan, Verdict
from designer.yields.margins import DRAWN, ROUNDS, lost_boards
from designer.yields.stored_parts import StoredParts
from designer.yields.worst_corner import CORNER

LOST, KEPT = 50, 20
"""Boards of each response that are replayed: lost ones, and ok ones, in order of the samples."""
PROBE = 10
"""Lost boards of a response of which no board is ok that decide whether more are replayed."""
AT_ONCE = 8
"""Boards that are replayed before what they showed is stored; no answer depends on it."""
BUDGET = 20_000
"""About how many steps an attribution takes where nobody says another number."""

PERIODS = 125
"""Drive periods of a step of that budget; nearly all boards with a periodic answer take fewer."""

_DEAD_ZONE = re.compile(r"R[2-9]\d\d[AB]?")
_VERDICTS = {str(verdict)[0]: verdict for verdict in Verdict}
"""A verdict by its first letter, as a stored part holds it."""


@dataclass(frozen=True)
class PartAttribution:
    """A part or a group that was made exact, and what became of the boards.

    Boards without an answer count in neither ``avoided`` nor ``caused``.
    """

    name: str
    """Name of the part or the group."""
    kind: str
    """"resistor", "capacitor", "op-amp", "reference", "supply" or "group"."""
    avoided: int
    """How many of the ``replayed`` boards were ok then."""
    replayed: int
    """Lost boards that were asked again."""
    caused: int
    """How many of the ``kept`` boards were lost then."""
    kept: int
    """Ok boards that were asked again."""

    @property
    def share(self) -> float:
        """Share of the losses that is avoided; nan where nothing was replayed."""
        return self.avoided / self.replayed if self.replayed else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Two-sided 95 % Wilson interval of the share."""
        return wilson(self.avoided, self.replayed)


@dataclass(frozen=True)
class _Change:
    """A part or a group that is made exact: parts at their nominal values, or fields of ``Boards``
    that are nominal on every part."""

    name: str
    kind: str
    parts: tuple[str, ...] = ()
    fields: tuple[str, ...] = ()

    def of(self, boards: Boards) -> Boards:
        """The same boards with what is changed made exact."""
        return exact_in(boards, self.fields) if self.fields else boards.exact(self.parts)


@dataclass(frozen=True)
class _Replay:
    """A board that is asked a question again. before : its verdict in the study. place : number of
    the question's boards of that verdict before it. turn : that, over the most of them."""

    question: int
    sample: int
    before: Verdict
    place: int
    turn: float
    cost: float
    """Steps that one question counts for."""

    @property
    def part(self) -> str:
        """Name of its result among the stored parts of an attribution."""
        return f"replay {self.question} {self.sample}"


@dataclass(frozen=True)
class Extent:
    """How much of an attribution is done: all of it where that stays within a budget, else a
    share."""

    boards: Boards
    """Boards of the study, by sample."""
    rows: tuple[tuple[Answer, ...], ...]
    """The answers to each question, by sample."""
    changes: tuple[_Change, ...]
    """What is made exact."""
    replays: tuple[_Replay, ...]
    """Boards that are asked again."""
    crossings: tuple[tuple[int, int], ...]
    """Lost boards that are followed from the nominal one, as (question, sample)."""
    steps: int
    """Steps of all this, at most."""
    whole: int
    """Steps of all this without a budget."""

    @property
    def share(self) -> float:
        """Share of the whole work that is done."""
        return self.steps / self.whole if self.whole else 1.0

    @property
    def hopeless(self) -> list[bool]:
        """Whether boards were lost and none is ok, for each question."""
        outcomes = [{a.verdict for a in row} for row in self.rows]
        return [Verdict.LOST in verdicts and Verdict.OK not in verdicts for verdicts in outcomes]


def extent_of(
    plan: StudyPlan,
    answers: Sequence[Answer],
    budget: int | None = None,
    *,
    lost: int = LOST,
    ok: int = KEPT,
) -> Extent:
    """What an attribution of these answers does within a budget of so many steps; without one, all.

    answers : of any of the plan's samples, in any order. lost, ok : boards of each response that
    are replayed, at most. The nominal board and the corners are always looked at, and so is one
    board at least of each response that lost any.
    """
    count = max(1 + max((a.sample for a in answers), default=0), DRAWN)
    boards = plan.boards(range(count))
    rows = tuple(
        tuple(sorted((a for a in answers if a.question == i), key=lambda a: a.sample))
        for i in range(len(plan.questions))
    )
    again = _replays(rows, (lost, ok))
    followed = _in_turn([pair for pair in lost_boards(rows) if plan.questions[pair[0]].periodic])
    samples = sorted({r.sample for r in again})
    changes = _changes(plan.circuit, boards.take(samples)) if samples else []
    around = 2 * len(quantities(plan.circuit, boards))
    least = len(rows) * (around + 2**CORNER)
    costs = (len(changes), ROUNDS + around)
    total = least + len(again) * costs[0] + len(followed) * costs[1]
    replaying = np.cumsum([replay.cost * costs[0] for replay in again])
    work = least + float(replaying[-1] if len(again) else 0.0) + len(followed) * costs[1]
    if budget is not None and budget < work:
        share = max(budget - least, 0) / max(work - least, 1.0)  # nothing lost: no more to do
        within = int(np.searchsorted(replaying, share * replaying[-1:].sum(), side="right"))
        # The first boards in turn are one of each response.
        again = again[: max(within, len({r.question for r in again}))]
        followed = followed[: max(int(share * len(followed)), len({q for q, _ in followed}))]
    steps = least + len(again) * costs[0] + len(followed) * costs[1]
    return Extent(boards, rows, tuple(changes), tuple(again), tuple(followed), steps, total)


def _in_turn(pairs: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """The first of each question, then the second of each, …"""
    by_question = groupby(pairs, key=lambda pair: pair[0])
    turned = [(turn, pair) for _, group in by_question for turn, pair in enumerate(group)]
    return [pair for _, pair in sorted(turned)]


def _replays(rows: Sequence[Sequence[Answer]], most: tuple[int, int]) -> list[_Replay]:
    """The boards that are replayed, every response's in turn, so that a first part of the list
    holds some of each.

    rows : the answers to each question, by sample. most : lost and ok boards of each. A question
    that lost no board has none.
    """
    replays = [
        _Replay(i, a.sample, verdict, place, place / limit, max(1.0, a.periods / PERIODS))
        for i, row in enumerate(rows)
        if any(a.verdict is Verdict.LOST for a in row)
        for verdict, limit in zip((Verdict.LOST, Verdict.OK), most, strict=True)
        for place, a in enumerate(islice((a for a in row if a.verdict is verdict), limit))
    ]
    return sorted(replays, key=lambda r: (r.turn, r.question, r.sample))


def _changes(circuit: Circuit, boards: Boards) -> list[_Change]:
    """Every part that differs between these boards, and the groups of them."""
    differing = {q.part for q in quantities(circuit, boards)}
    differing |= {s.name for s in circuit.sections if s.name in boards.low}
    kinds = {p.name: _KINDS[type(p)] for p in circuit.parts if type(p) in _KINDS}
    kinds |= {rail.name: "supply" for rail in circuit.rails}
    out = [_Change(n, k, (n,)) for n, k in kinds.items() if n in differing]

    def group(name: str, parts: Iterable[str]) -> None:
        parts = tuple(p for p in parts if p in differing)
        if len(parts) > 1:
            out.append(_Change(name, "group", parts))

    if len({q.part for q in quantities(circuit, boards) if q.group == "offset"}) > 1:
        out.append(_Change("all offsets", "group", fields=("offset",)))
    if boards.low:
        out.append(_Change("all output limits", "group", fields=("low", "high")))
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
    extent: Extent,
    parts: StoredParts,
    jobs: int,
    progress: Callable[[], None],
) -> tuple[list[tuple[PartAttribution, ...]], list[bool]]:
    """The parts of each question, most losses avoided first; and whether its replays were cut
    short.

    Of a question that no board of the study shows no more than ``PROBE`` boards are replayed where
    nothing that was made exact saves any of them. progress : called once an attractor, also where
    it is stored.
    """
    first = [r for r in extent.replays if r.before is Verdict.LOST and r.place < PROBE]
    verdicts = _all(plan, extent, first, parts, jobs, progress)
    saved = {r.question for r in first if Verdict.OK in verdicts[r]}
    cut = [hopeless and i not in saved for i, hopeless in enumerate(extent.hopeless)]
    rest = [r for r in extent.replays if r not in verdicts and not cut[r.question]]
    verdicts |= _all(plan, extent, rest, parts, jobs, progress)
    return [_attributed(i, extent.changes, verdicts) for i in range(len(plan.questions))], cut


def trial_of(plan: StudyPlan) -> int | None:
    """Steps that a board may take to settle that is asked again (``Ensemble.respond``); None where
    a motion without a period is wanted, which has to be watched."""
    return BRIEF if all(question.periodic for question in plan.questions) else None


def _all(
    plan: StudyPlan,
    extent: Extent,
    replays: Sequence[_Replay],
    parts: StoredParts,
    jobs: int,
    progress: Callable[[], None],
) -> dict[_Replay, list[Verdict]]:
    """What each board shows with each change; stored results are not computed again."""
    results: dict[_Replay, list[Verdict]] = {}
    for r in replays:
        letters = parts.get(r.part)
        if letters is not None:
            results[r] = [_VERDICTS[letter] for letter in letters]
            for _ in extent.changes:
                progress()
    missing = [r for r in replays if r not in results]
    for start in range(0, len(missing), AT_ONCE):
        some = missing[start : start + AT_ONCE]
        columns = _some(plan, extent, some, jobs, progress)
        results |= {r: list(row) for r, row in zip(some, zip(*columns, strict=True), strict=True)}
        parts.put({r.part: "".join(str(v)[0] for v in results[r]) for r in some})
    return results


def _some(
    plan: StudyPlan,
    extent: Extent,
    replays: Sequence[_Replay],
    jobs: int,
    progress: Callable[[], None],
) -> list[list[Verdict]]:
    """The verdicts of these boards with each change."""
    samples = sorted({r.sample for r in replays})
    boards = extent.boards.take(samples)
    pairs = [(samples.index(r.sample), plan.questions[r.question]) for r in replays]
    cases: list[Case] = [(board, q, q.excitation, q.start.start) for board, q in pairs]
    within = trial_of(plan)

    def one(change: _Change) -> list[Verdict]:
        ensemble = Ensemble(change.of(boards))
        rows = settled(ensemble, cases, progress=progress, within=within)
        return [verdict for _, verdict, _ in rows]

    return list(parallel(one, extent.changes, jobs))


def _attributed(
    question: int, changes: Sequence[_Change], every: dict[_Replay, list[Verdict]]
) -> tuple[PartAttribution, ...]:
    results = {r: verdicts for r, verdicts in every.items() if r.question == question}
    if not results:
        return ()
    out = []
    for k, change in enumerate(changes):
        tally = Counter((r.before, verdicts[k]) for r, verdicts in results.items())
        replayed, ok = (
            sum(tally[before, now] for now in Verdict if now is not Verdict.FAILED)
            for before in (Verdict.LOST, Verdict.OK)
        )
        avoided, caused = tally[Verdict.LOST, Verdict.OK], tally[Verdict.OK, Verdict.LOST]
        out.append(PartAttribution(change.name, change.kind, avoided, replayed, caused, ok))
    return tuple(sorted(out, key=lambda p: (-p.avoided, p.caused, p.name)))
