"""The linear picture of a branch: how far each response is from being lost, in every way it can be
shown, and what each upgrade takes off the spread.

A limit of ``designer.margins`` is nominal + Σ slope·ξ; a board is ok while every limit is positive.
Its variance is the sum of what the parts contribute, so with the quantile z of the form's own
distribution (of boards that are drawn: sums of uniform and normal numbers have no common one) the
demand "P(limit > 0) is at least the target" reads: variance ≤ (nominal/z)², linear in the choice of
grades. z depends a little on the choice, so it is taken again of each choice that is found.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from designer import margins
from designer.boards import Boards
from designer.cure_branch import PLACE, TRIM, TRIMMER, Branch
from designer.cure_couplings import couplings
from designer.cure_program import Demand, Option, Program, Slot
from designer.cure_slots import TRIMMED, PartSlot, network_slots, part_slots, trimmer_slot
from designer.cure_study import Book, answers_of, asked, measure, plan_of
from designer.cure_trimmed import trimmed_margins
from designer.margins import Margin
from designer.responses import ModelResponse
from designer.spread import Spread, draw_many
from designer.system import Array
from designer.trimmer import DcTrim
from designer.upgrade import PartNetwork, Place, Upgrades, upgraded_file, with_parts_kept
from designer.verdict import BLOCK, Question, StudyPlan, count
from designer.yield_maps import YieldMap, yield_map

SAMPLES = 250
"""Boards on which a picture is taken: their verdicts choose the limits."""
DRAWN = 4000
"""Boards that a linear form's distribution is taken from."""
CROSSINGS = 4
"""Lost boards of each response whose way to the loss is followed."""
MAP_POINTS, MAP_BOARDS, TRIM_BOARDS = 7, 50, 100
MOVED = 1.0
"""Trouble of another setting of the generator."""
STREAM = "cure:"


@dataclass(frozen=True)
class Way:
    """One way of showing a response.

    response : its number. kind : "as it is", "omega", "b", "trim" or "trimmer". place : another
    than stated. margin : None for trim, and for the trimmer where it is enough by itself, which
    have been measured instead: rate.
    """

    response: int
    kind: str
    question: Question
    place: Place | None = None
    margin: Margin | None = None
    rate: float = float("nan")


@dataclass(frozen=True)
class Picture:
    """branch, its slots part by part, the ways of each response, and the standard deviation of each
    quantity by name under option j of its slot, over that as it is: ratios[j]. matched : by slot
    and option of an array, the covariance (n, n) of its elements, in the same units."""

    branch: Branch
    parts: tuple[PartSlot, ...]
    ways: tuple[tuple[Way, ...], ...]
    ratios: tuple[Mapping[str, float], ...]
    trim: float
    seed: int
    matched: Mapping[tuple[int, int], Array] = field(default_factory=dict)

    @property
    def slots(self) -> tuple[Slot, ...]:
        """Of the program: parts, then one for each response."""
        trouble = {"omega": MOVED, "b": MOVED, "trim": TRIMMED}
        ways = [
            Slot(
                f"response {number + 1}",
                tuple(Option(w.kind, 0.0, trouble.get(w.kind, 0.0)) for w in row),
            )
            for number, row in enumerate(self.ways)
        ]
        return (*(p.slot for p in self.parts), *ways)

    def upgrades(self, pick: Sequence[int]) -> Upgrades:
        """What a choice of options changes."""
        grades, reference, networks = {}, None, list[PartNetwork]()
        for part, i in zip(self.parts, pick, strict=False):
            if i and part.grades:
                grades[part.parts[0]] = part.grades[i]
            elif i and part.network:
                networks.append(PartNetwork(part.models[i], part.network))
            elif i and part.models:
                reference = part.models[i]
        taken = self.taken(pick)
        return replace(
            self.branch.upgrades,
            reference=reference,
            grades=grades,
            places={w.response: w.place for w in taken if w.place is not None},
            trim=self.trim if any(w.kind == "trim" for w in taken) else None,
            networks=tuple(networks),
            trimmer=any(
                i and part.trim is not None for part, i in zip(self.parts, pick, strict=False)
            ),
        )

    def taken(self, pick: Sequence[int]) -> tuple[Way, ...]:
        """The way of each response."""
        chosen = pick[len(self.parts) :]
        return tuple(row[i] for row, i in zip(self.ways, chosen, strict=True))

    def boards(self, pick: Sequence[int]) -> Boards:
        """Boards of this choice, for its linear forms."""
        made = self.branch.made
        upgrades = replace(
            self.upgrades(pick), places={}, opamp=None, dead_zone=None, trim=None, trimmer=False
        )
        modelfile = upgraded_file(made.modelfile, upgrades)
        circuit = made.design.circuit
        if upgrades.reference is not None:
            circuit = with_parts_kept(made, modelfile).design.circuit
        spread = Spread.of(modelfile, circuit, made.catalog)
        return draw_many(circuit, spread, self.seed, range(DRAWN), STREAM)

    def predicted(
        self,
        pick: Sequence[int],
        boards: Boards,
        shrink: Mapping[tuple[int, int], float] | None = None,
    ) -> tuple[float, ...]:
        """Share of these boards on which each response's margin is positive.

        shrink : as ``program`` has it.
        """
        known = shrink or {}
        chosen = pick[len(self.parts) :]
        out = []
        for w, way in zip(chosen, self.taken(pick), strict=True):
            if way.margin is None:
                out.append(way.rate)
                continue
            nearer = 1.0 - known.get((way.response, w), 1.0) ** 0.5
            away = np.array([nearer * limit.distance for limit in way.margin.limits])
            fine = (way.margin.each(boards) > away).all(axis=1) if len(away) else np.ones(1)
            out.append(float(fine.mean()))
        return tuple(out)

    def quantiles(self, target: float, boards: Boards) -> dict[tuple[int, int, int], float]:
        """z of each limit: (response, way, limit) → how many standard deviations of its form the
        nominal value has to be above 0 for the target."""
        found = {}
        for r, row in enumerate(self.ways):
            for w, way in enumerate(row):
                if way.margin is None or not way.margin.limits:
                    continue
                each = way.margin.each(boards)
                for k, limit in enumerate(way.margin.limits):
                    form = each[:, k] - limit.distance
                    found[r, w, k] = _quantile(form, target)
        return found

    def program(
        self,
        z: Mapping[tuple[int, int, int], float],
        shrink: Mapping[tuple[int, int], float],
        spoiled: frozenset[tuple[int, int]] = frozenset(),
    ) -> Program:
        """The program for these quantiles.

        shrink : by (response, way), a factor on the room of its demands: what was learnt where the
        picture promised too much. spoiled : ways that are not to be taken.
        """
        slots, demands = self.slots, list[Demand]()
        none = tuple(np.zeros(len(s.options)) for s in slots)
        for r, row in enumerate(self.ways):
            for w, way in enumerate(row):
                when = (len(self.parts) + r, w)
                if (r, w) in spoiled:
                    demands.append(Demand(f"response {r + 1}: {way.kind}", -1.0, none, when))
                    continue
                if way.margin is None:
                    continue
                for k, limit in enumerate(way.margin.limits):
                    shares, fixed = self._shares(way.margin, k)
                    room = (limit.distance / z[r, w, k]) ** 2 * shrink.get((r, w), 1.0)
                    rows = list(none)
                    rows[: len(shares)] = shares
                    name = f"response {r + 1}: {limit.what}"
                    demands.append(Demand(name, room - fixed, tuple(rows), when))
        kinds = [[w.kind for w in row] for row in self.ways]
        return Program(slots, (*demands, *couplings(slots, self.parts, kinds)))

    def _shares(self, margin: Margin, number: int) -> tuple[list[Array], float]:
        """What the options of each part add to a limit's variance, and what no upgrade changes, in
        the limit's own variances."""
        limit = margin.limits[number]
        slot_of = {name: k for k, part in enumerate(self.parts) for name in part.parts}
        shares = [np.zeros(len(p.slot.options)) for p in self.parts]
        fixed, total = 0.0, 0.0
        for q, slope in zip(margin.quantities, limit.slopes, strict=True):
            base = float(slope / limit.sigma) ** 2
            total += base
            slot = slot_of.get(q.part)
            if slot is None or q.group not in ("values", "reference"):
                fixed += base
                continue
            for j in range(len(shares[slot])):
                shares[slot][j] += base * self.ratios[j].get(q.name, 1.0) ** 2
        slope_of = {q.name: s for q, s in zip(margin.quantities, limit.slopes / limit.sigma,
                                              strict=True) if q.group == "values"}  # fmt: skip
        for (k, j), together in self.matched.items():
            slopes = np.array([slope_of.get(name, 0.0) for name in self.parts[k].network])
            # Over what the parts are counted with as they are, one by one.
            shares[k][j] = float(slopes @ together @ slopes - slopes @ slopes)
        # The limit's own variance is of drawn boards, on which parts that track vary together: what
        # that adds or takes stays in proportion.
        own = 1.0 / total if total > 0.0 else 1.0
        return [row * own for row in shares], fixed * own


def _quantile(form: Array, target: float) -> float:
    """How many standard deviations the form (N,) falls short of 0 in all but ``target`` of cases;
    at least a little, so that no demand is without bound."""
    size = float(form.std())
    if size == 0.0:
        return 1e-6
    return max(-float(np.quantile(form, 1.0 - target)) / size, 1e-6)


def picture(
    branch: Branch,
    target: float,
    seed: int,
    book: Book,
    *,
    trim: float,
    without: frozenset[str] = frozenset(),
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> Picture | None:
    """The picture of a branch; None where its nominal circuit does not show every response.

    trim : half-width of the band of the DC offset. without : kinds of upgrades that are not wanted.
    progress : called once a piece of work.
    """
    made = branch.made
    parts = (*part_slots(made, without), *network_slots(made, without))
    questions = [q for q in asked(made, made.found) if q is not None]
    if len(questions) < len(made.found):
        return None
    rows: list[list[Way]] = []
    short = False
    for r, question in enumerate(questions):
        row = [Way(r, "as it is", question)]
        rows.append(row)
        plan = plan_of(made, question, seed)
        seen = measure(plan, target, book, least=SAMPLES, most=SAMPLES, jobs=jobs)
        progress()
        if seen.counts.rate >= target:
            continue
        short = True
        if PLACE not in without:
            row += _moved(branch, r, made.found[r], plan, jobs, progress)
        if TRIM not in without and trim > 0.0:
            few = measure(
                plan, target, book, trim=trim, least=TRIM_BOARDS, most=TRIM_BOARDS, jobs=jobs
            )
            progress()
            row.append(Way(r, "trim", question, rate=few.counts.rate))
    ways = _with_margins(branch, rows, seed, book, jobs, progress)
    slot = trimmer_slot(made, without) if short else None
    if slot is not None and slot.trim is not None:
        parts = (*parts, slot)
        more = _trimmed(branch, slot.trim, questions, target, seed, book, jobs, progress)
        ways = tuple((*row, way) for row, way in zip(ways, more, strict=True))
    ratios, matched = _ratios(branch, parts, seed), _matched(branch, parts, seed)
    return Picture(branch, parts, ways, ratios, trim, seed, matched)


def _trimmed(
    branch: Branch,
    trim: DcTrim,
    questions: Sequence[Question],
    target: float,
    seed: int,
    book: Book,
    jobs: int,
    progress: Callable[[], None],
) -> list[Way]:
    """Every response on boards whose trimmers are set; with their margins where that alone is not
    enough."""
    plan = plan_of(branch.made, questions[0], seed, SAMPLES)
    plan = replace(plan, questions=tuple(questions))
    found = trimmed_margins(plan, trim, target, book, count=CROSSINGS, jobs=jobs, progress=progress)
    return [
        Way(r, TRIMMER, question, None, margin, rate)
        for r, (question, (margin, rate)) in enumerate(zip(questions, found, strict=True))
    ]


def _moved(
    branch: Branch,
    number: int,
    response: ModelResponse,
    plan: StudyPlan,
    jobs: int,
    progress: Callable[[], None],
) -> list[Way]:
    """Other places of a response in its window, where more boards show it: over ω, over b."""
    out = []
    for over in ("omega", "b"):
        found = yield_map(
            plan, 0, "b" if over == "b" else "omega", response.b,
            samples=MAP_BOARDS, points=MAP_POINTS, jobs=jobs,
        )  # fmt: skip
        progress()
        best = best_place(found)
        if best is None:
            continue
        value = float(f"{best:.4g}")
        place = Place(value, response.b) if over == "omega" else Place(response.omega, value)
        base = branch.made
        moved = with_parts_kept(
            base, upgraded_file(base.modelfile, Upgrades(places={number: place}))
        )
        broken = {c.quantity for c in base.design.checks if not c.holds}
        if any(not c.holds and c.quantity not in broken for c in moved.design.checks):
            continue
        question = asked(moved, [moved.found[number]])[0]
        if question is not None:
            out.append(Way(number, over, question, place))
    return out


def best_place(found: YieldMap) -> float | None:
    """The middle of the longest row of settings with the highest yield; None where the setting in
    use has it.

    Not ``recommended``, which stays where it is unless another setting is proved to be better: a
    cure is measured before it is believed.
    """
    values, rate = np.array(found.axes[0].values), found.rate
    if rate[found.axes[0].values.index(found.used)] >= rate.max():
        return None
    equal = np.flatnonzero(rate == rate.max())
    rows = np.split(equal, np.flatnonzero(np.diff(equal) > 1) + 1)
    longest = max(rows, key=lambda row: float(values[row[-1]] - values[row[0]]))
    middle = 0.5 * (values[longest[0]] + values[longest[-1]])
    return float(values[longest[int(np.argmin(np.abs(values[longest] - middle)))]])


def _with_margins(
    branch: Branch,
    rows: Sequence[Sequence[Way]],
    seed: int,
    book: Book,
    jobs: int,
    progress: Callable[[], None],
) -> tuple[tuple[Way, ...], ...]:
    """The ways with their margins; those that are trimmed have none."""
    made = branch.made
    asked_for = [w for row in rows for w in row if w.kind != TRIM]
    circuit = made.design.circuit
    spread = Spread.of(made.modelfile, circuit, made.catalog)
    by = []
    for w in asked_for:
        plan = StudyPlan(circuit, spread, seed, SAMPLES, (w.question,))
        letters = "".join(book.block(plan, block, None, jobs)[0] for block in plan.blocks(BLOCK))
        by.append(answers_of(letters))
        progress()
    boards = draw_many(circuit, spread, seed, range(SAMPLES))
    found = margins.margins(
        circuit,
        [w.question for w in asked_for],
        boards,
        by,
        count=CROSSINGS,
        jobs=jobs,
        progress=progress,
    )
    known = {
        id(w): replace(w, margin=m, rate=count(row).rate)
        for w, m, row in zip(asked_for, found, by, strict=True)
    }
    return tuple(tuple(known.get(id(w), w) for w in row) for row in rows)


def _ratios(
    branch: Branch, parts: Sequence[PartSlot], seed: int
) -> tuple[Mapping[str, float], ...]:
    """Under option j of every slot (its last, where it has fewer), the standard deviation of each
    quantity over that as it is."""
    most = max((len(p.slot.options) for p in parts), default=1)
    bare = Picture(branch, tuple(parts), (), (), 0.0, seed)
    columns: list[dict[str, float]] = []
    names = [name for p in parts for name in p.parts]
    for j in range(most):
        boards = bare.boards([0 if p.network else min(j, len(p.slot.options) - 1) for p in parts])
        known = {**boards.values, **boards.reference}
        columns.append({name: float(np.std(known[name])) for name in names})
    base = columns[0]
    return tuple({n: c[n] / base[n] if base[n] > 0.0 else 1.0 for n in names} for c in columns)


def _matched(
    branch: Branch, parts: Sequence[PartSlot], seed: int
) -> Mapping[tuple[int, int], Array]:
    """By slot and option of an array, the covariance of its elements on drawn boards, in units of
    each part's own standard deviation as it is."""
    bare = Picture(branch, tuple(parts), (), (), 0.0, seed)
    none = [0] * len(parts)
    found = {}
    plain = bare.boards(none).values if any(p.network for p in parts) else {}
    for k, part in enumerate(parts):
        for j in range(1, len(part.slot.options) if part.network else 1):
            drawn = bare.boards([j if i == k else 0 for i in range(len(parts))]).values
            off = [(drawn[n] - drawn[n].mean()) / float(np.std(plain[n])) for n in part.network]
            found[k, j] = np.array([[float((a * b).mean()) for b in off] for a in off])
    return found
