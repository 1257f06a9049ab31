"""The linear picture of a branch: how far each response is from being lost, in every way it can be
shown, and what each upgrade takes off the spread.

A limit of ``yields.margins`` is nominal + Σ slope·ξ; a board is ok while every limit is positive.
Its variance is the sum of what the parts contribute, so with the quantile z of the form's own
distribution (of boards that are drawn: sums of uniform and normal numbers have no common one) the
demand "P(limit > 0) is at least the target" reads: variance ≤ (nominal/z)², linear in the choice of
grades. z depends a little on the choice, so it is taken again of each choice that is found. Beyond
the share that the drawn boards show it goes on as a normal distribution's does.

``trimmer_ways`` has the responses on boards whose trimmers are set: how many boards show them, and
their margins as functions of what is drawn alone. A trimmer that is set is set for every response,
so it is no way to any where it is hopeless for one. On such boards the wiper's place is one more
quantity that the response depends on, and it follows from the others: it cancels their constant
force. So the margin is taken of the circuit with its trimmer, and the part of the wiper is then
given to the quantities that move it, by least squares over many boards. What offsets do to the
response and what the wiper undoes of it cancel in the slopes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from scipy.special import ndtr, ndtri

from designer.base.arrays import Array
from designer.centering.repair_branch import TRIM, TRIMMER, RepairBranch
from designer.centering.repair_couplings import couplings, finest
from designer.centering.repair_measure import VerdictCache, is_rare, questions_of
from designer.centering.repair_milp import Demand, Option, RepairProgram, Slot
from designer.centering.repair_slots import (
    TRIMMED,
    PartSlot,
    network_slots,
    part_slots,
    trimmer_slot,
)
from designer.centering.repair_upgrade import PartNetwork, Upgrades, rebuilt, upgraded_file
from designer.centering.repair_ways import FEW, SAMPLES, ResponseSurvey, ResponseWay, foretold
from designer.circuit.board_arrays import Boards
from designer.circuit.netlist import Circuit
from designer.spread.board_quantities import between, column
from designer.spread.part_rules import spread_of
from designer.spread.spread import Spread, draw_many
from designer.verdicts.verdict import Answer, Question, StudyPlan, Verdict
from designer.yields import margins
from designer.yields.loss_regions import OFTEN, WIDE
from designer.yields.margins import Margin
from designer.yields.trimmed_yield import HIGH, LOW, DcTrim, trimmed_boards

SHOWN = 4
"""The fewest of the boards drawn by which a share is read off."""
FITTED = 1000
"""Boards from which is learnt what moves the wiper."""


def trimmer_ways(
    survey: ResponseSurvey, trim: DcTrim, firsts: Sequence[ResponseWay]
) -> list[ResponseWay] | None:
    """The trimmer as a way to each response; None where it is hopeless for one of them.

    trim : of the branch's circuit. firsts : the responses as they are, in the order in which they
    are to be looked at.
    """
    boards, _ = trimmed_boards(trim, survey.plan, range(SAMPLES))
    finest = [trimmed_boards(trim.on(p.circuit), p, range(2 * FEW))[0] for p in survey.best]
    ways = []
    for first in firsts:
        way = survey.with_rate(ResponseWay(first.response, TRIMMER, first.question), boards)
        ways.append(survey.bounded(way, finest))
        if ways[-1].hopeless:
            return None
    return ways


def trimmed_margins(
    plan: StudyPlan,
    trim: DcTrim,
    *,
    count: int,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> list[Margin]:
    """The margin of each question; the plan is of the circuit without the trimmer.

    count, progress : as ``margins.margins``.
    """
    boards, _ = trimmed_boards(trim, plan, range(plan.samples))
    answers = []
    for question in plan.questions:
        answers.append(foretold(boards, question, jobs))
        progress()
    trimmed = margins.margins(
        trim.circuit, plan.questions, boards, answers, count=count, jobs=jobs, progress=progress
    )
    return [without_wiper(margin, plan, trim) for margin in trimmed]


def without_wiper(margin: Margin, plan: StudyPlan, trim: DcTrim) -> Margin:
    """A margin of trimmed boards in terms of the quantities of the boards without a trimmer."""
    indices = range(FITTED)
    boards, _ = trimmed_boards(trim, plan, indices)
    part_names = set(plan.circuit.values)
    wiper = [k for k, q in enumerate(margin.quantities) if q.part in (HIGH, LOW)]
    remaining = [
        k for k, q in enumerate(margin.quantities) if q.group != "values" or q.part in part_names
    ]  # and not the resistor at the wiper

    def off(k: int) -> Array:
        q = margin.quantities[k]
        return (column(boards, q) - q.nominal) / q.sigma

    deviations = np.stack([off(k) for k in remaining], axis=1)
    moves = np.linalg.lstsq(deviations, np.stack([off(k) for k in wiper], axis=1), rcond=None)[0]
    quantities = tuple(margin.quantities[k] for k in remaining)
    plain = plan.boards(indices)
    limits = []
    for limit in margin.limits:
        slopes = limit.slopes[remaining] + moves @ limit.slopes[wiper]
        moved = replace(limit, sigma=1.0, slopes=slopes)
        sigma = float(Margin(quantities, (moved,)).each(plain).std())
        if sigma > 0.0:
            limits.append(replace(moved, sigma=sigma))
    limits.sort(key=lambda limit: limit.reliability_index)
    return replace(margin, quantities=quantities, limits=tuple(limits))


DRAWN = 4000
"""Boards that a linear form's distribution is taken from."""
KEPT = 8
"""Choices whose boards are kept."""
CROSSINGS = 4
"""Lost boards of each response whose way to the loss is followed."""
MOVED = 1.0
"""Trouble of another setting of the generator."""
STREAM = "cure:"


@dataclass(frozen=True)
class LinearModel:
    """A branch as the linear program sees it."""

    branch: RepairBranch
    """The branch that is modelled."""
    parts: tuple[PartSlot, ...]
    ways: tuple[tuple[ResponseWay, ...], ...]
    """The ways of showing each response."""
    ratios: tuple[Mapping[str, float], ...]
    """By number of the option, standard deviation of each quantity by name under that option of its
    slot, over that as it is."""
    trim: float
    """Half-width of the band of the DC offset, over the amplitude."""
    seed: int
    matched: Mapping[tuple[int, int], Array] = field(default_factory=dict)
    """By slot and option of an array, the covariance (n, n) of its elements, in the same units."""
    _drawn: dict[tuple[int, ...], Boards] = field(default_factory=dict, repr=False, compare=False)

    @property
    def slots(self) -> tuple[Slot, ...]:
        """The slots of the program: one for each part, then one for each response."""
        trouble = {"omega": MOVED, "b": MOVED, TRIM: TRIMMED}
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
        ways = self.ways_of(pick)
        return replace(
            self.branch.upgrades,
            reference=reference,
            grades=grades,
            places={w.response: w.place for w in ways if w.place is not None},
            trim=self.trim if any(w.kind == TRIM for w in ways) else None,
            networks=tuple(networks),
            trimmer=any(
                i and part.trim is not None for part, i in zip(self.parts, pick, strict=False)
            ),
        )

    def ways_of(self, pick: Sequence[int]) -> tuple[ResponseWay, ...]:
        """The way of each response."""
        options = pick[len(self.parts) :]
        return tuple(row[i] for row, i in zip(self.ways, options, strict=True))

    @property
    def trimmer(self) -> DcTrim | None:
        """The board's, of the branch's circuit, where setting it is among the options."""
        return next((p.trim for p in self.parts if p.trim is not None), None)

    def spread(self, pick: Sequence[int]) -> tuple[Circuit, Spread]:
        """The circuit and the spread of this choice, each response where it was."""
        synthesis = self.branch.synthesis
        part_upgrades = replace(self, ways=()).upgrades(pick[: len(self.parts)])
        upgrades = replace(part_upgrades, opamp=None, dead_zone=None, trimmer=False)
        modelfile = upgraded_file(synthesis.modelfile, upgrades)
        circuit = synthesis.design.circuit
        if upgrades.reference is not None:
            circuit = rebuilt(synthesis.design, modelfile, synthesis.catalog)
        return circuit, spread_of(modelfile, circuit, synthesis.catalog)

    def boards(self, pick: Sequence[int]) -> Boards:
        """Boards of this choice, for its linear forms."""
        key = tuple(pick[: len(self.parts)])
        if key not in self._drawn:
            circuit, spread = self.spread(key)
            while len(self._drawn) >= KEPT:
                self._drawn.pop(next(iter(self._drawn)))
            self._drawn[key] = draw_many(circuit, spread, self.seed, range(DRAWN), STREAM)
        return self._drawn[key]

    def predicted(
        self,
        pick: Sequence[int],
        boards: Boards,
        shrink: Mapping[tuple[int, int], float] | None = None,
    ) -> tuple[float, ...]:
        """Share of these boards on which each response's margin is positive.

        shrink : as ``program`` has it.
        """
        factors = shrink or {}
        options = pick[len(self.parts) :]
        out = []
        for w, way in zip(options, self.ways_of(pick), strict=True):
            if way.margin is None:
                out.append(way.rate)
                continue
            nearer = 1.0 - factors.get((way.response, w), 1.0) ** 0.5
            away = np.array([nearer * limit.reliability_index for limit in way.margin.limits])
            form = (way.margin.each(boards) - away).min(axis=1) if len(away) else np.ones(1)
            out.append(share_above(form))
        return tuple(out)

    def quantiles(self, target: float, boards: Boards) -> dict[tuple[int, int, int], float]:
        """z of each limit: (response, way, limit) → how many standard deviations of its form the
        nominal value has to be above 0 for the target."""
        z_scores = {}
        for r, row in enumerate(self.ways):
            for w, way in enumerate(row):
                if way.margin is None or not way.margin.limits:
                    continue
                each = way.margin.each(boards)
                for k, limit in enumerate(way.margin.limits):
                    form = each[:, k] - limit.reliability_index
                    z_scores[r, w, k] = _quantile(form, target)
        return z_scores

    def program(
        self,
        z: Mapping[tuple[int, int, int], float],
        shrink: Mapping[tuple[int, int], float],
        spoiled: frozenset[tuple[int, int]] = frozenset(),
    ) -> RepairProgram:
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
                    room = (limit.reliability_index / z[r, w, k]) ** 2 * shrink.get((r, w), 1.0)
                    rows = list(none)
                    rows[: len(shares)] = shares
                    name = f"response {r + 1}: {limit.what}"
                    demands.append(Demand(name, room - fixed, tuple(rows), when))
        kinds = [[w.kind for w in row] for row in self.ways]
        return RepairProgram(slots, (*demands, *couplings(slots, self.parts, kinds)))

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
        for (k, j), covariance in self.matched.items():
            slopes = np.array([slope_of.get(name, 0.0) for name in self.parts[k].network])
            # Over what the parts are counted with as they are, one by one.
            shares[k][j] = float(slopes @ covariance @ slopes - slopes @ slopes)
        # The limit's own variance is of drawn boards, on which parts that track vary together: what
        # that adds or takes stays in proportion.
        scale = 1.0 / total if total > 0.0 else 1.0
        return [row * scale for row in shares], fixed * scale


def _quantile(form: Array, target: float) -> float:
    """How many standard deviations the form (N,) falls short of 0 in all but ``target`` of cases;
    at least a little, so that no demand is without bound."""
    size = float(form.std())
    if size == 0.0:
        return 1e-6
    return max(-tail_quantile(form, 1.0 - target) / size, 1e-6)


def tail_quantile(form: Array, share: float) -> float:
    """The value that ``share`` of a form's distribution lies below, by drawn values (N,); below a
    share of ``SHOWN`` of them by a normal distribution through their median and that share."""
    shown = SHOWN / len(form)
    if share >= shown:
        return float(np.quantile(form, share))
    middle, lowest = np.median(form), np.quantile(form, shown)
    return float(middle + (lowest - middle) * ndtri(share) / ndtri(shown))


def share_above(form: Array) -> float:
    """The share of a form's distribution above 0, as ``tail_quantile`` has it."""
    below = int((form <= 0.0).sum())
    middle, lowest = np.median(form), np.quantile(form, min(SHOWN / len(form), 0.5))
    if below > SHOWN or lowest >= middle:
        return 1.0 - below / len(form)
    return float(ndtr(middle / (lowest - middle) * ndtri(SHOWN / len(form))))


def picture(
    branch: RepairBranch,
    target: float,
    seed: int,
    verdict_cache: VerdictCache,
    *,
    trim: float,
    without: frozenset[str] = frozenset(),
    missed: Collection[int] = (),
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> LinearModel | None:
    """The picture of a branch; None where its nominal circuit does not show every response.

    The response that the fewest boards show is looked at first, and where all its ways are hopeless
    the branch is, and no more of it is looked at. trim : half-width of the band of the DC offset.
    without : kinds of upgrades that are not wanted. missed : responses that were measured to miss
    the target on this branch as it is. progress : called once a piece of work.
    """
    synthesis = branch.synthesis
    parts = (*part_slots(synthesis, without), *network_slots(synthesis, without))
    questions = [q for q in questions_of(synthesis, synthesis.model_responses) if q is not None]
    if len(questions) < len(synthesis.model_responses):
        return None
    bare = LinearModel(branch, parts, (), (), trim, seed)
    best = tuple(
        StudyPlan(*bare.spread(pick), seed, SAMPLES, ())
        for pick in finest(parts, synthesis.catalog)
    )
    survey = ResponseSurvey(
        branch, target, seed, verdict_cache, trim, without, best, jobs, progress, missed
    )
    rows = [
        [survey.with_rate(ResponseWay(r, "as it is", question))]
        for r, question in enumerate(questions)
    ]
    order = sorted(range(len(rows)), key=lambda r: (rows[r][0].rate, r))
    firsts = [rows[r][0] for r in order]

    @cache
    def fitted() -> tuple[PartSlot, list[ResponseWay]] | None:
        slot = trimmer_slot(synthesis, without)
        ways = (
            None if slot is None or slot.trim is None else trimmer_ways(survey, slot.trim, firsts)
        )
        return None if slot is None or ways is None else (slot, ways)

    out = False
    for r in order:
        rows[r] = survey.ways(rows[r][0])
        out = all(way.hopeless for way in rows[r]) and fitted() is None
        if out:
            break
    enough = [survey.enough(row[0]) or any(way.certain for way in row) for row in rows]
    if not out and not all(enough) and (trimmer := fitted()) is not None:
        parts = (*parts, trimmer[0])
        for way in trimmer[1]:
            rows[way.response].append(way)
    bare = replace(bare, parts=parts, ways=tuple(map(tuple, rows)))
    # What limits the design as it is is told in any case.
    unchanged = branch.upgrades == Upgrades()
    if unchanged or not out:
        ratios, matched = _ratios(branch, parts, seed), _matched(branch, parts, seed)
        bare = replace(bare, ratios=ratios, matched=matched)
    which = [
        (r, w)
        for r, row in enumerate(rows)
        for w, way in enumerate(row)
        if (unchanged and w == 0) or not (out or _needs_no_picture(way, rows, target))
    ]
    return pictured(bare, which, target, jobs, progress)


def _needs_no_picture(
    way: ResponseWay, rows: Sequence[Sequence[ResponseWay]], target: float
) -> bool:
    """Whether a way is taken as it was seen, or not at all. The trimmer is, where it is enough for
    every response. That no board was lost of the few that were looked at says nothing of a rare
    loss."""
    if way.kind == TRIMMER:
        every = [w.rate for row in rows for w in row if w.kind == TRIMMER]
        return min(every) >= target
    return (way.certain and not is_rare(target)) or way.hopeless or way.kind == TRIM


def pictured(
    model: LinearModel,
    which: Sequence[tuple[int, int]],
    target: float,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> LinearModel:
    """The model with margins of these ways (response, way). target : the yield that is wanted;
    where losses are to be rare, they are sought on boards that are farther off."""
    synthesis = model.branch.synthesis
    circuit = synthesis.design.circuit
    spread = spread_of(synthesis.modelfile, circuit, synthesis.catalog)
    margin_of = dict[tuple[int, int], Margin]()
    trimmed = [(r, w) for r, w in which if model.ways[r][w].kind == TRIMMER]
    for some in ([key for key in which if key not in trimmed], trimmed):
        if not some:
            continue
        questions = tuple(model.ways[r][w].question for r, w in some)
        if some is trimmed:
            assert model.trimmer is not None
            plan = StudyPlan(circuit, spread, model.seed, SAMPLES, questions)
            new_margins = trimmed_margins(
                plan, model.trimmer, count=CROSSINGS, jobs=jobs, progress=progress
            )
        else:
            boards = draw_many(circuit, spread, model.seed, range(SAMPLES))
            new_margins = []
            for question in questions:
                asked, answers = _with_losses(boards, question, is_rare(target), jobs)
                progress()
                new_margins += margins.margins(
                    circuit, [question], boards, [answers], asked=asked, count=CROSSINGS,
                    jobs=jobs, progress=progress,
                )  # fmt: skip
        margin_of.update(zip(some, new_margins, strict=True))
    ways = tuple(
        tuple(
            replace(way, margin=margin_of[r, w]) if (r, w) in margin_of else way
            for w, way in enumerate(row)
        )
        for r, row in enumerate(model.ways)
    )
    return replace(model, ways=ways)


def _with_losses(
    boards: Boards, question: Question, rare: bool, jobs: int
) -> tuple[Boards, list[Answer]]:
    """These boards and what becomes of them; where losses are rare, the same boards farther off
    from the nominal one, as far as some of them lose the response."""
    asked, answers = boards, foretold(boards, question, jobs)
    for wider in WIDE if rare else ():
        if sum(a.verdict is Verdict.LOST for a in answers) >= OFTEN * len(answers):
            break
        asked = between(boards, np.full(len(boards), wider))
        answers = foretold(asked, question, jobs)
    return asked, answers


def _ratios(
    branch: RepairBranch, parts: Sequence[PartSlot], seed: int
) -> tuple[Mapping[str, float], ...]:
    """Under option j of every slot (its last, where it has fewer), the standard deviation of each
    quantity over that as it is."""
    most = max((len(p.slot.options) for p in parts), default=1)
    bare = LinearModel(branch, tuple(parts), (), (), 0.0, seed)
    columns: list[dict[str, float]] = []
    names = [name for p in parts for name in p.parts]
    for j in range(most):
        boards = bare.boards([0 if p.network else min(j, len(p.slot.options) - 1) for p in parts])
        values = {**boards.values, **boards.reference}
        columns.append({name: float(np.std(values[name])) for name in names})
    base = columns[0]
    return tuple({n: c[n] / base[n] if base[n] > 0.0 else 1.0 for n in names} for c in columns)


def _matched(
    branch: RepairBranch, parts: Sequence[PartSlot], seed: int
) -> Mapping[tuple[int, int], Array]:
    """By slot and option of an array, the covariance of its elements on drawn boards, in units of
    each part's own standard deviation as it is."""
    bare = LinearModel(branch, tuple(parts), (), (), 0.0, seed)
    none = [0] * len(parts)
    covariances = {}
    plain = bare.boards(none).values if any(p.network for p in parts) else {}
    for k, part in enumerate(parts):
        for j in range(1, len(part.slot.options) if part.network else 1):
            values = bare.boards([j if i == k else 0 for i in range(len(parts))]).values
            off = [(values[n] - values[n].mean()) / float(np.std(plain[n])) for n in part.network]
            covariances[k, j] = np.array([[float((a * b).mean()) for b in off] for a in off])
    return covariances
