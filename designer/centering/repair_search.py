"""The search for the cheapest repair: upgrades that bring every wanted response to the yield that
is asked for (docs/cure.md).

Rounds of choosing and measuring. Each branch (``repair_branch``) has a linear picture
(``repair_linear_model``); the cheapest choice of upgrades that it promises to be enough is found by
mixed-integer optimisation (``repair_milp``) and put to fresh boards on the exact circuit. A
response that falls short has its demand tightened by what was measured, and the next round chooses
again. Branches are made only as far as they may be cheaper than what is known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from designer.answers.rare_words import boards_text
from designer.base import progress
from designer.base.defaults import cores
from designer.base.progress import best_so_far, seeking
from designer.centering.limiting_parts import joint_boards, limiting
from designer.centering.repair_branch import TRIM, TRIMMER, Refused, RepairBranch, branches
from designer.centering.repair_couplings import finest
from designer.centering.repair_linear_model import LinearModel, picture, pictured, tail_quantile
from designer.centering.repair_measure import (
    FIRST,
    MOST,
    PLAIN_BLOCK,
    MeasuredYield,
    VerdictCache,
    is_rare,
    measure,
    measure_all,
    plan_of,
    questions_of,
    study_seed,
    telling,
)
from designer.centering.repair_milp import RepairProgram, cheapest
from designer.centering.repair_trial import Repair, Trial
from designer.centering.repair_upgrade import Upgrades
from designer.centering.repair_ways import ResponseWay
from designer.check.synthesis_result import Synthesis
from designer.circuit.board_arrays import Boards
from designer.model.model_file import need_responses
from designer.spread.part_rules import spread_of
from designer.verdicts.verdict import BLOCK, StudyPlan
from designer.yields.trimmed_yield import DcTrim

FRONT, AS_IT_IS = 100, 101
"""Numbers of the studies of the front and of the first that confirms the design as it is; no round
comes so far."""
CONFIRMING = 4000
"""Boards of each response by which a choice is confirmed."""
ROUNDS = 10
"""Choices that are measured before the search gives up."""
TRIES = 16
"""Programs that are solved for one choice: each takes the quantiles of the one before."""
FRONT_TARGETS = (0.5, 0.8, 0.9, 0.95, 0.98, 0.995, 0.999)
FRONT_POINTS = 5
"""Points of the front that are measured beside those of the rounds."""
FRONT_BOARDS = 500
TIGHTER = 0.95
"""The factor by which a demand's room is tightened at least where a promise was not kept."""
LARGEST_STEP = 2.0
"""The factor by which a measurement brings a loss nearer than the picture has it, at most: one that
is so wrong says little about by how much."""


def find_repair(
    base: Synthesis,
    target: float,
    *,
    budget: float | None = None,
    trim: float = 0.0,
    without: frozenset[str] = frozenset(),
    seed: int = 1,
    jobs: int | None = None,
    verdict_cache: VerdictCache | None = None,
) -> Repair:
    """Search, in memory.

    target : yield that the whole 95 % interval of every response is to reach. Where so few may be
    lost that counting does not tell (``is_rare``), losses are estimated, of boards as built: none
    is trimmed. budget : most that upgrades may cost [euro]. trim : half-width of the band of the
    generator's DC offset. without : kinds of upgrades that are not wanted
    (``repair_branch.KINDS``). verdict_cache : verdicts that are known.

    Raises
    ------
    InputError : the model file names no response, or a place of a response is no choice.
    """
    need_responses(base.modelfile)
    verdict_cache = VerdictCache() if verdict_cache is None else verdict_cache
    threads = cores() if jobs is None else jobs
    if is_rare(target):
        without, trim = without | {TRIM, TRIMMER}, 0.0
    search = _Search(base, target, budget, trim, without, seed, threads, verdict_cache)
    with seeking("cure"):
        return search.run()


class _Search:
    def __init__(
        self,
        base: Synthesis,
        target: float,
        budget: float | None,
        trim: float,
        without: frozenset[str],
        seed: int,
        jobs: int,
        verdict_cache: VerdictCache,
    ) -> None:
        self.base, self.target, self.budget, self.trim = base, target, budget, trim
        self.without, self.seed, self.jobs = without, seed, jobs
        self.verdict_cache = verdict_cache
        self.waiting = branches(base, without)
        self.known: list[RepairBranch] = []
        self.pictures: list[LinearModel] = []
        self.refused: list[Refused] = []
        self.shrink: dict[tuple[int, int, int], float] = {}
        self.spoiled: set[tuple[int, int, int]] = set()
        self.fell_short: dict[tuple[int, tuple[int, ...]], list[int]] = {}
        self.unseen: list[int] = []
        self.best: Trial | None = None

    def run(self) -> Repair:
        before = self._before(1, "as it is")
        if before.reached and is_rare(self.target):
            before = self._confirmed(self._before, AS_IT_IS, "as it is")
        self.before = before
        if before.reached:
            return self._answer(before, [], True, "every response is there already")
        rounds: list[Trial] = []
        for number in range(ROUNDS):
            choice = self._choice(self.target)
            if choice is None:
                return self._answer(before, rounds, False, self._out_of_reach())
            which, pick, predicted = choice
            cost = self._price(which, pick)
            if self.budget is not None and cost > self.budget + 1e-9:
                why = f"the cheapest choice that may be enough costs {cost:.2f} euro"
                return self._answer(before, rounds, False, why)
            name = f"round {number + 1}"
            measured = partial(self._trial, which, pick, predicted)
            trial = measured(2 + number, name)
            if trial.reached:
                trial = self._confirmed(measured, 2 + ROUNDS + number, name)
            rounds.append(trial)
            if trial.reached:
                return self._answer(before, rounds, True, "measured on fresh boards")
            self._learn(which, pick, trial)
        return self._answer(before, rounds, False, f"not within {ROUNDS} rounds")

    def _confirmed(self, measured: Callable[..., Trial], number: int, name: str) -> Trial:
        """The verdict on a choice that was measured to be enough.

        measured : measures it anew, by the number of a study, a name, how many boards, and whether
        estimates are whole. number : of the first of its studies; the others are ``ROUNDS`` apart.

        Boards were drawn until the target was reached, which favours it. The verdict is that of
        other boards, of a number fixed beforehand. Where the target is rare these refute, and bound
        what no search met; two whole estimates decide, the worse one: a region of losses may be met
        by one alone."""
        rare = is_rare(self.target)
        boards = telling(self.target) if rare else CONFIRMING
        trial = measured(number, f"{name}, once more", boards)
        if not rare or any(m.missed for m in trial.measured):
            return trial
        one, other = (
            measured(number + k * ROUNDS, f"{name}, estimate {k}", whole=True) for k in (1, 2)
        )
        pairs = list(zip(one.measured, other.measured, strict=True))
        for r, (a, b) in enumerate(pairs, start=1):
            if max(a.interval[0], b.interval[0]) > min(a.interval[1], b.interval[1]):
                progress.note(
                    f"  response {r}: the two estimates differ by more than their intervals, as "
                    "where one of them alone met a region of losses; the worse one counts"
                )
        worse = (min(pair, key=lambda m: m.interval) for pair in pairs)
        bounded = (m.bounded(plain.counts) for m, plain in zip(worse, trial.measured, strict=True))
        return replace(other, measured=tuple(bounded))

    def _before(
        self, study: int, name: str, boards: int | None = None, *, whole: bool = False
    ) -> Trial:
        """The design as it is, on fresh boards. Arguments : as of ``_trial``."""
        step = progress.stage(name.replace("as it is", "the design as it is", 1))
        synthesis, plans = self.base, list[tuple[StudyPlan, float | DcTrim | None] | None]()
        self.unseen.clear()
        for number, question in enumerate(questions_of(synthesis, synthesis.model_responses)):
            if question is None:
                self.unseen.append(number)
            plan = (
                None
                if question is None
                else plan_of(synthesis, question, study_seed(self.seed, study))
            )
            plans.append(None if plan is None else (plan, None))
        trials = self._measured(plans, boards, whole, step)
        rates = tuple(m.rate for m in trials)
        return self._reported(name, Trial("as it is", Upgrades(), 0.0, rates, trials, self.target))

    def _measured(
        self,
        plans: Sequence[tuple[StudyPlan, float | DcTrim | None] | None],
        boards: int | None,
        whole: bool,
        step: Callable[[], None],
    ) -> tuple[MeasuredYield, ...]:
        """The yields of these studies; boards, whole : as of ``_trial``."""
        if boards is None:
            return measure_all(
                plans, self.target, self.verdict_cache, whole=whole, jobs=self.jobs, progress=step
            )
        block = PLAIN_BLOCK if is_rare(self.target) else BLOCK
        return tuple(
            measure(
                plan, self.target, self.verdict_cache, trim=trim, least=boards, most=boards,
                first=FIRST, block=block, jobs=self.jobs, progress=step,
            )
            for plan, trim in filter(None, plans)
        )  # fmt: skip

    def _reported(self, name: str, trial: Trial) -> Trial:
        """The trial, once its yields are said and the best of all so far is known."""
        shares = ", ".join(_share(m) for m in trial.measured)
        progress.note(f"  {name}: yield of each response: {shares}")
        if self.best is None or trial.worst.rate > self.best.worst.rate:
            self.best = trial
            what = ", ".join(trial.upgrades.in_words(self.base.modelfile)) or "as it is"
            worst = f"worst response {_share(trial.worst)}"
            best_so_far(f"{worst} for {trial.price:.2f} euro: {what}")
        return trial

    def _choice(self, target: float) -> tuple[int, tuple[int, ...], tuple[float, ...]] | None:
        """The cheapest choice over all branches: its picture's number, the options, the promise.

        Branches that have no picture yet get one where they may be cheaper."""
        best: tuple[float, int, tuple[int, ...], tuple[float, ...]] | None = None
        for which in range(len(self.pictures)):
            best = self._better(best, which, target)
        while (branch := self._next_branch(None if best is None else best[0])) is not None:
            progress.stage(f"margins, {branch.name}")
            step = progress.stage(f"linear picture, {branch.name}")
            measured = self.before.measured if branch.upgrades == Upgrades() else ()
            model = picture(
                branch,
                self.target,
                study_seed(self.seed, 0),
                self.verdict_cache,
                trim=self.trim,
                without=self.without,
                missed=[r for r, m in enumerate(measured) if m.missed],
                jobs=self.jobs,
                progress=step,
            )
            if model is None:
                why = "the nominal circuit does not show every response"
                self.refused.append(Refused(branch.upgrades, why))
                continue
            self.pictures.append(model)
            if branch.upgrades == Upgrades():  # it has been measured
                self._learn(0, tuple(0 for _ in model.slots), self.before)
            best = self._better(best, len(self.pictures) - 1, target)
        return None if best is None else best[1:]

    def _next_branch(self, least: float | None) -> RepairBranch | None:
        """A branch that has no picture and may be cheaper than ``least``: None where there is none.

        All are made as soon as one is asked for beyond the first: their prices must be known.
        """
        if not self.pictures and not self.known and not self.refused:
            first = next(self.waiting)
            assert isinstance(first, RepairBranch)
            return first
        if least is not None and least <= 0.0:
            return None
        for branch in self.waiting:
            progress.stage("other op-amps and dead zones")
            if isinstance(branch, Refused):
                self.refused.append(branch)
            else:
                self.known.append(branch)
        self.known.sort(key=lambda b: b.extra)
        if self.known and (least is None or self.known[0].extra < least):
            return self.known.pop(0)
        return None

    def _better(
        self,
        best: tuple[float, int, tuple[int, ...], tuple[float, ...]] | None,
        which: int,
        target: float,
    ) -> tuple[float, int, tuple[int, ...], tuple[float, ...]] | None:
        choice = self._of_picture(which, target)
        if choice is None:
            return best
        cost = self._cost(which, choice[0])
        return (cost, which, *choice) if best is None or cost < best[0] - 1e-12 else best

    def _of_picture(
        self, which: int, target: float
    ) -> tuple[tuple[int, ...], tuple[float, ...]] | None:
        """The cheapest choice on one branch that its picture promises to be enough."""
        model = self.pictures[which]
        base = tuple(0 for _ in model.slots)
        shrink = {(r, w): f for (k, r, w), f in self.shrink.items() if k == which}
        spoiled = frozenset((r, w) for k, r, w in self.spoiled if k == which)
        spoiled |= {
            (r, w)
            for r, row in enumerate(model.ways)
            for w, way in enumerate(row)
            if (way.margin is None and way.rate < target)
            or (way.hopeless and target >= self.target)
        }
        if any(all((r, w) in spoiled for w in range(len(row))) for r, row in enumerate(model.ways)):
            return None
        z = model.quantiles(target, model.boards(base))
        enough: dict[tuple[int, ...], tuple[float, ...]] = {}
        earlier: set[tuple[int, ...]] = set()
        for _ in range(TRIES):
            program = model.program(z, shrink, spoiled)
            pick = cheapest(program)
            if pick is None or (pick in earlier and pick in enough):
                break
            earlier.add(pick)
            boards = model.boards(pick)
            promised = model.predicted(pick, boards, shrink)
            short = [r for r, share in enumerate(promised) if share < target]
            if target >= self.target:
                short = sorted({*short, *self.fell_short.get((which, pick), [])})
            if short:
                for r in short:
                    key = r, pick[len(model.parts) + r]
                    shrink[key] = shrink.get(key, 1.0) * _cut(program, pick, key, len(model.parts))
            else:
                enough[pick] = promised
            z = model.quantiles(target, boards)
        if not enough:
            return None
        pick = min(enough, key=lambda p: (self._cost(which, p), p))
        return pick, enough[pick]

    def _price(self, which: int, pick: Sequence[int]) -> float:
        model = self.pictures[which]
        return model.branch.extra + RepairProgram(model.slots, ()).price(pick)

    def _cost(self, which: int, pick: Sequence[int]) -> float:
        model = self.pictures[which]
        return model.branch.extra + RepairProgram(model.slots, ()).cost(pick)

    def _trial(
        self,
        which: int,
        pick: Sequence[int],
        predicted: tuple[float, ...],
        number: int,
        name: str,
        boards: int | None = None,
        *,
        whole: bool = False,
    ) -> Trial:
        """A choice, measured on fresh boards.

        boards : their number, for each response; None: more until it is decided whether all
        responses reach the target. whole : as ``measure_all`` has it."""
        model = self.pictures[which]
        cost = self._price(which, pick)
        step = progress.stage(f"{name}: {cost:.2f} euro, fresh boards")
        upgrades = model.upgrades(pick)
        circuit, spread = model.spread(pick)
        seed = study_seed(self.seed, number)
        plans = list[tuple[StudyPlan, float | DcTrim | None]]()
        for way in model.ways_of(pick):
            setting: float | DcTrim | None = upgrades.trim if way.kind == "trim" else None
            if way.kind == TRIMMER and model.trimmer is not None:
                setting = model.trimmer.on(circuit)
            plans.append((StudyPlan(circuit, spread, seed, MOST, (way.question,)), setting))
        measured = self._measured(plans, boards, whole, step)
        trial = Trial(model.branch.name, upgrades, cost, predicted, measured, self.target)
        return self._reported(name, trial)

    def _learn(self, which: int, pick: Sequence[int], trial: Trial) -> None:
        """Tighten the demands of ways that promised more than was measured.

        Where a response has missed the target, those that are undecided were asked on few boards
        only: nothing is learnt of them."""
        model = self.pictures[which]
        short = [r for r, m in enumerate(trial.measured) if m.missed or not m.counts.samples]
        short = short or [r for r, m in enumerate(trial.measured) if not m.reached]
        self.fell_short[which, tuple(pick)] = short
        boards = model.boards(pick)
        for r, (way, m) in enumerate(zip(model.ways_of(pick), trial.measured, strict=True)):
            if r not in short:
                continue
            w = pick[len(model.parts) + r]
            if way.margin is None and (way.certain or way.kind == TRIMMER):  # it seemed enough
                step = progress.stage(f"linear picture, {model.branch.name}: response {r + 1}")
                model = pictured(model, [(r, w)], self.target, self.jobs, step)
                self.pictures[which] = model
                way = model.ways[r][w]
            if way.margin is None or not way.margin.limits:
                self.spoiled.add((which, r, w))
                continue
            # The upper end of the interval: the search approaches the cheapest choice from below.
            key, rate = (which, r, w), m.interval[1]
            self.shrink[key] = min(self.shrink.get(key, 1.0), _shrink_factor(way, boards, rate))

    def _answer(self, before: Trial, rounds: list[Trial], reached: bool, why: str) -> Repair:
        limits = tuple(self._limit(r) for r in range(len(self.base.model_responses)))
        return Repair(
            self.base,
            self.target,
            self.budget,
            before,
            tuple(rounds),
            reached,
            why,
            limits,
            self._front(before, rounds),
            tuple(self.refused),
            tuple(self.pictures),
        )

    def _out_of_reach(self) -> str:
        """The responses for which no choice of upgrades is enough, by the linear pictures."""
        best = np.zeros(len(self.base.model_responses))
        for which, model in enumerate(self.pictures):
            shrink = {(r, w): f for (k, r, w), f in self.shrink.items() if k == which}
            for most in finest(model.parts, model.branch.synthesis.catalog):
                boards = model.boards(most)
                for r, row in enumerate(model.ways):
                    for w, way in enumerate(row):
                        if way.hopeless:
                            best[r] = max(best[r], way.most)
                        elif (which, r, w) not in self.spoiled:
                            pick = [*most, *(w if k == r else 0 for k in range(len(model.ways)))]
                            best[r] = max(best[r], model.predicted(pick, boards, shrink)[r])
        short = [
            f"response {r + 1} ({share:.6g} at most)"
            for r, share in enumerate(best)
            if share < self.target
        ]
        named = f": {', '.join(short)}" if short else ""
        return f"no choice of upgrades is enough in the linear picture{named}"

    def _limit(self, number: int) -> str:
        """What limits a response with nothing upgraded, in one line."""
        if number in self.unseen:
            return "the nominal circuit does not show it"
        model = self.pictures[0] if self.pictures else None
        margin = None if model is None else model.ways[number][0].margin
        if model is None or margin is None:
            return ""
        synthesis = model.branch.synthesis
        spread = spread_of(synthesis.modelfile, synthesis.design.circuit, synthesis.catalog)
        return limiting(margin, joint_boards(synthesis.design.circuit, spread, model.seed)).line

    def _front(self, before: Trial, rounds: list[Trial]) -> tuple[Trial, ...]:
        """The design as it is, and trials by price, each with a higher worst yield than any cheaper
        one: those of the rounds and the choices for other targets, as the pictures are known
        now."""
        trials = [before, *rounds]
        keys = {(t.branch, repr(t.upgrades)) for t in trials}
        choices: list[tuple[int, tuple[int, ...], tuple[float, ...]]] = []
        # The few boards of a front's trial say nothing of a rare loss.
        for target in FRONT_TARGETS if self.pictures and not is_rare(self.target) else ():
            options = [(k, choice) for k in range(len(self.pictures))
                       if (choice := self._of_picture(k, target)) is not None]  # fmt: skip
            if not options:
                break
            which, (pick, promised) = min(options, key=lambda x: (self._cost(x[0], x[1][0]), x[0]))
            if (which, pick, promised) not in choices:
                choices.append((which, pick, promised))
        for which, pick, promised in choices:
            picked = self.pictures[which]
            key = picked.branch.name, repr(picked.upgrades(pick))
            if key in keys or len(trials) > len(rounds) + FRONT_POINTS:
                continue
            keys.add(key)
            trials.append(self._trial(which, pick, promised, FRONT, "front", FRONT_BOARDS))

        def shown(trial: Trial) -> float:
            worst = trial.worst
            return worst.interval[0] if is_rare(self.target) else worst.rate

        trials.sort(key=lambda t: (t.price, -shown(t)))
        front: list[Trial] = []
        for t in trials:
            if not front or shown(t) > shown(front[-1]):
                front.append(t)
        return tuple(front) if before in front else (before, *front)


def _cut(program: RepairProgram, pick: Sequence[int], key: tuple[int, int], parts: int) -> float:
    """A factor on a way's room under which this choice no longer keeps its demands."""
    r, w = key
    demands = [d for d in program.demands if d.when == (parts + r, w) and d.room > 0.0]
    shares = [d.variance(pick) / d.room for d in demands]
    return min(TIGHTER, 0.999 * max(shares, default=1.0))


def _shrink_factor(way: ResponseWay, boards: Boards, rate: float) -> float:
    """The factor by which the room of a way's demands is to shrink for the picture to promise what
    was measured: the square of the ratio of the reliability indices at which that share of boards
    is lost; 1 where more are ok than was promised."""
    assert way.margin is not None
    form = way.margin.of(boards)
    middle = float(np.median(form))
    reach = middle - tail_quantile(form, min(1.0 - rate, 0.5))
    if middle <= 0.0 or reach >= middle:
        return 1.0
    return max((reach / middle) ** 2, 1.0 / LARGEST_STEP**2)


def _share(measured: MeasuredYield) -> str:
    """A yield with its 95 % interval, in words."""
    low, high = measured.interval
    if measured.rare is not None:
        rare = measured.rare
        lost, *ends = (boards_text(1e6 * s) for s in (rare.lost, rare.low, rare.high))
        return f"{lost} of a million lost ({' to '.join(ends)})"
    return f"{measured.rate:.4f} ({low:.4f} to {high:.4f})"
