"""The ways in which a branch may show a response, as far as few boards tell: as it is, at another
place in its window, trimmed.

Everything here is foretold, not decided: of the boards without a period after the drive periods
that the compiled way grants a few are settled, and only if none of them shows the response are the
others taken for lost. What is chosen is measured afterwards. A way is hopeless where even of boards
with the best parts that can be bought too many for the target are seen to be lost; no picture of it
is needed then, nor of a branch all of whose ways to one response are.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import bdtrc

from designer.centering.repair_branch import PLACE, TRIM, RepairBranch
from designer.centering.repair_measure import VerdictCache, measure, plan_of, questions_of
from designer.centering.repair_upgrade import Upgrades, WindowPlace, upgraded_file, with_same_parts
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import Ensemble
from designer.spread.part_rules import spread_of
from designer.verdicts.verdict import Answer, Question, StudyPlan, Verdict, judge
from designer.yields.margins import Margin
from designer.yields.yield_count import count
from designer.yields.yield_maps import YieldMap, settle_open, yield_map

SAMPLES = 250
"""Boards on which a way is looked at: their verdicts choose the limits of its picture."""
FEW = 50
"""Boards of a place on a map, and boards with the best parts; as many again where the first leave
it open whether a way is hopeless."""
MAP_POINTS, TRIM_FIRST, TRIM_BOARDS = 7, 25, 100
FAINT = 0.5
"""Share of boards below which the best place is sought with the best parts instead."""
RARE = 1e-3
"""Chance of as many lost boards under the target at which a way is hopeless."""


@dataclass(frozen=True)
class ResponseWay:
    """One way of showing a response."""

    response: int
    """Number of the response."""
    kind: str
    """"as it is", "omega", "b", "trim" or "trimmer"."""
    question: Question
    """What every board is asked."""
    place: WindowPlace | None = None
    """The place, where it is another than stated."""
    margin: Margin | None = None
    """Margin of the response; None where there is no picture of it."""
    rate: float = float("nan")
    """Share of boards that show the response, parts as they are; 1 without a margin: no board of
    ``SAMPLES`` was lost."""
    most: float = 1.0
    """Share of boards that show the response with the best parts, at most."""
    hopeless: bool = False
    """Whether ``most`` is too small for the target."""

    @property
    def certain(self) -> bool:
        """Every board that was looked at shows the response."""
        return self.rate == 1.0


def forecast(boards: Boards, question: Question, jobs: int) -> list[Verdict | None]:
    """The verdict of each board; None where the compiled kernel leaves it open."""
    size = len(boards)
    orbits = Ensemble(boards, jobs=jobs).quick(
        range(size),
        [question.excitation.drive] * size,
        np.tile(question.start.start, (size, 1)),
        jobs=jobs,
    )
    verdicts = [None if o is None else judge(o, question.spec, question.start)[0] for o in orbits]
    return [None if verdict is Verdict.FAILED else verdict for verdict in verdicts]


def settled(boards: Boards, question: Question, jobs: int) -> list[Verdict]:
    """The verdict of each board, given all the time there is."""
    size = len(boards)
    orbits = Ensemble(boards).settle(
        range(size),
        [question.excitation.drive] * size,
        np.tile(question.start.start, (size, 1)),
        jobs=jobs,
    )
    return [judge(orbit, question.spec, question.start)[0] for orbit in orbits]


def foretold(boards: Boards, question: Question, jobs: int) -> list[Answer]:
    """As much of an answer for each board as a margin needs.

    Of the boards that the compiled kernel leaves open a few are settled; where none of them shows
    the response, all of them count as lost.
    """
    verdicts = forecast(boards, question, jobs)
    left = [k for k, verdict in enumerate(verdicts) if verdict is None]
    settle_open(verdicts, left, lambda some: settled(boards.take(some), question, jobs))
    nan = float("nan")
    return [
        Answer(sample, 0, verdict or Verdict.LOST, "", "", nan, nan, nan, nan, 0)
        for sample, verdict in enumerate(verdicts)
    ]


@dataclass(frozen=True)
class ResponseSurvey:
    """Computes the ways in which a branch may show each response."""

    branch: RepairBranch
    target: float
    """Yield that is wanted of every response."""
    seed: int
    verdict_cache: VerdictCache
    """Keeps what has been computed."""
    trim: float
    """Half-width of the band of the DC offset, over the amplitude."""
    without: frozenset[str]
    """Kinds of upgrades that are not wanted."""
    best: tuple[StudyPlan, ...]
    """Studies of boards with the best parts that can be bought, of no question yet: single ones,
    then arrays."""
    jobs: int
    """Number of workers."""
    progress: Callable[[], None]
    """Called as the work goes on."""
    missed: Collection[int] = ()
    """Responses that are known to miss the target as they are, whatever the look at few boards
    says."""

    @property
    def plan(self) -> StudyPlan:
        """The study of boards with the parts as they are, of no question yet."""
        synthesis = self.branch.synthesis
        spread = spread_of(synthesis.modelfile, synthesis.design.circuit, synthesis.catalog)
        return StudyPlan(synthesis.design.circuit, spread, self.seed, SAMPLES, ())

    def with_rate(self, way: ResponseWay, boards: Boards | None = None) -> ResponseWay:
        """The way with the share of boards that show its response.

        boards : drawn boards; None: those of the design with its parts as they are.
        """
        boards = first_boards(self.plan, SAMPLES) if boards is None else boards
        counts = count(foretold(boards, way.question, self.jobs))
        self.progress()
        return replace(way, rate=0.0 if np.isnan(counts.rate) else counts.rate)

    def bounded(self, way: ResponseWay, finest: Sequence[Boards] | None = None) -> ResponseWay:
        """A way with what the best parts make of it.

        finest : (2 ``FEW``,) boards with them; None: not trimmed.
        """
        if way.certain or way.kind == TRIM:
            return way
        if finest is None:
            finest = [first_boards(plan, 2 * FEW) for plan in self.best]
        shares = []
        for boards in finest:
            lost, total = self._lost(boards, way.question)
            shares.append(1.0 - lost / total)
            if not self._too_many(lost, total):
                break
        self.progress()
        return replace(way, most=max(shares), hopeless=self._too_many(lost, total))

    def _lost(self, boards: Boards, question: Question) -> tuple[int, int]:
        """How many boards are lost, and of how many.

        More boards are asked while few are lost. Boards left open are settled only where they
        decide whether too many are lost.
        """
        lost, left = 0, list[int]()
        for total in (FEW, 2 * FEW):
            some = range(total - FEW, total)
            verdicts = forecast(boards.take(some), question, self.jobs)
            left += [k for k, verdict in zip(some, verdicts, strict=True) if verdict is None]
            lost += verdicts.count(Verdict.LOST)
            needed = next((n for n in range(total + 1) if self._too_many(n, total)), total + 1)
            if needed <= lost + len(left):
                missing = max(needed - lost, 0)
                settled_verdicts = (
                    settled(boards.take(left[:missing]), question, self.jobs) if missing else []
                )
                lost, left = lost + settled_verdicts.count(Verdict.LOST), left[missing:]
                if lost >= needed:  # those that were not settled are taken for lost too
                    return lost + len(left), total
            if not lost and not left:
                break
        return lost, total

    def _too_many(self, lost: int, total: int) -> bool:
        return bool(bdtrc(lost - 1, total, 1.0 - self.target) < RARE)

    def enough(self, first: ResponseWay) -> bool:
        """Whether a response needs no way but ``first``, the one as it is."""
        return first.rate >= self.target and first.response not in self.missed

    def ways(self, first: ResponseWay) -> list[ResponseWay]:
        """A response's ways, ``first`` the one as it is. What asks more of people is looked for
        only where nothing before it is certain."""
        row = [self.bounded(first)]
        if self.enough(first):
            return row
        plan = plan_of(self.branch.synthesis, first.question, self.seed)
        if PLACE not in self.without:
            for over in ("omega", "b"):
                moved = self._moved(first, plan, over)
                if moved is not None:
                    row.append(self.bounded(self.with_rate(moved)))
                    if row[-1].certain:
                        return row
        if TRIM not in self.without and self.trim > 0.0:
            few = measure(
                plan, self.target, self.verdict_cache, trim=self.trim, first=TRIM_FIRST,
                least=TRIM_BOARDS, most=TRIM_BOARDS, jobs=self.jobs,
            )  # fmt: skip
            self.progress()
            hopeless = few.rate < self.target
            row.append(
                ResponseWay(first.response, "trim", first.question,
                    rate=few.rate, most=few.rate, hopeless=hopeless)
            )  # fmt: skip
        return row

    def _moved(self, way: ResponseWay, plan: StudyPlan, over: str) -> ResponseWay | None:
        """Another place of the response in its window, where more boards show it."""
        number, synthesis = way.response, self.branch.synthesis
        response = synthesis.model_responses[number]

        def mapped(of: StudyPlan, values: tuple[float, ...] | None = None) -> YieldMap:
            result = yield_map(
                of, 0, "b" if over == "b" else "omega", response.b, values=values,
                samples=FEW, points=MAP_POINTS, jobs=self.jobs, quick=True,
            )  # fmt: skip
            self.progress()
            return result

        rate_map = mapped(plan)
        if rate_map.rate.max() < FAINT:
            rate_map = mapped(
                replace(self.best[0], questions=plan.questions), rate_map.axes[0].values
            )
        best = best_place(rate_map)
        if best is None:
            return None
        value = float(f"{best:.4g}")
        place = (
            WindowPlace(value, response.b)
            if over == "omega"
            else WindowPlace(response.omega, value)
        )
        question = moved_question(self.branch, {number: place})
        return None if question is None else ResponseWay(number, over, question, place)


def first_boards(plan: StudyPlan, number: int) -> Boards:
    """The first boards of a study."""
    return plan.boards(range(number))


def moved_question(branch: RepairBranch, places: Mapping[int, WindowPlace]) -> Question | None:
    """What boards are asked of one response at another place; None where the circuit does not show
    it there, or a side condition breaks that held."""
    synthesis = branch.synthesis
    ((number, _),) = places.items()
    moved = with_same_parts(
        synthesis, upgraded_file(synthesis.modelfile, Upgrades(places=places)), [number]
    )
    broken = {c.quantity for c in synthesis.design.checks if not c.holds}
    if any(not c.holds and c.quantity not in broken for c in moved.design.checks):
        return None
    return questions_of(moved, moved.model_responses[number : number + 1])[0]


def best_place(rate_map: YieldMap) -> float | None:
    """The middle of the longest row of settings with the highest yield; None where the setting in
    use has it.

    Not ``recommended``, which stays where it is unless another setting is proved to be better: a
    repair is measured before it is believed.
    """
    values, rate = np.array(rate_map.axes[0].values), rate_map.rate
    if rate[rate_map.axes[0].values.index(rate_map.used)] >= rate.max():
        return None
    equal = np.flatnonzero(rate == rate.max())
    rows = np.split(equal, np.flatnonzero(np.diff(equal) > 1) + 1)
    longest = max(rows, key=lambda row: float(values[row[-1]] - values[row[0]]))
    middle = 0.5 * (values[longest[0]] + values[longest[-1]])
    return float(values[longest[int(np.argmin(np.abs(values[longest] - middle)))]])
