"""The ways in which a branch may show a response, as far as few boards tell: as it is, at another
place in its window, trimmed.

Everything here is foretold, not decided: a board without a period after the drive periods that the
compiled way grants counts as lost. What is chosen is measured afterwards. A way is hopeless where
even boards with the best parts that can be bought are lost too often for the target; no picture of
it is needed then, nor of a branch all of whose ways to one response are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import binom

from designer.boards import Boards
from designer.cure_branch import PLACE, TRIM, Branch
from designer.cure_study import Book, asked, measure, plan_of
from designer.ensemble import Ensemble
from designer.margins import Margin
from designer.orbit import Orbit
from designer.spread import Spread, draw_many
from designer.upgrade import Place, Upgrades, upgraded_file, with_parts_kept
from designer.verdict import Answer, Question, StudyPlan, Verdict, count, judge
from designer.yield_maps import YieldMap, yield_map

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
DOUBTED = 10
"""Boards left open by the forecast that are settled before a way is called hopeless."""


@dataclass(frozen=True)
class Way:
    """One way of showing a response.

    response : its number. kind : "as it is", "omega", "b" or "trim". place : another than stated.
    margin : None where there is no picture of it. rate : share of boards that show the response,
    parts as they are; 1 without a margin: no board of ``SAMPLES`` was lost. most : that share with
    the best parts, where it was asked; hopeless : it is too small for the target.
    """

    response: int
    kind: str
    question: Question
    place: Place | None = None
    margin: Margin | None = None
    rate: float = float("nan")
    most: float = 1.0
    hopeless: bool = False

    @property
    def certain(self) -> bool:
        """Every board that was looked at shows the response."""
        return self.rate == 1.0


def forecast(boards: Boards, question: Question, jobs: int) -> list[Orbit | None]:
    """The orbit of each board; None where the compiled way leaves it open."""
    size = len(boards)
    return Ensemble(boards, jobs=jobs).quick(
        range(size),
        [question.excitation.drive] * size,
        np.tile(question.start.start, (size, 1)),
        jobs=jobs,
    )


def foretold(boards: Boards, question: Question, jobs: int) -> list[Answer]:
    """As much of an answer as a margin needs, for each board; what is open is lost."""
    nan = float("nan")
    return [
        Answer(sample, 0, _verdict(orbit, question), "", "", nan, nan, nan, nan, 0)
        for sample, orbit in enumerate(forecast(boards, question, jobs))
    ]


def _verdict(orbit: Orbit | None, question: Question) -> Verdict:
    if orbit is None:
        return Verdict.LOST
    return judge(orbit, question.spec, question.start)[0]


@dataclass(frozen=True)
class Looker:
    """Looks for the ways of a branch's responses.

    target : yield wanted. finest : (DRAWN,) boards with the best part of every slot. plan : the
    study of boards with these parts, of no question yet. trim : half-width of the DC offset's band.
    """

    branch: Branch
    target: float
    seed: int
    book: Book
    trim: float
    without: frozenset[str]
    finest: Boards
    best_parts: StudyPlan
    jobs: int
    progress: Callable[[], None]

    def drawn(self) -> Boards:
        """Boards with the parts as they are."""
        made = self.branch.made
        spread = Spread.of(made.modelfile, made.design.circuit, made.catalog)
        return draw_many(made.design.circuit, spread, self.seed, range(SAMPLES))

    def seen(self, way: Way) -> Way:
        """A way with the share of boards that show it."""
        found = count(foretold(self.drawn(), way.question, self.jobs))
        self.progress()
        return replace(way, rate=0.0 if np.isnan(found.rate) else found.rate)

    def bounded(self, way: Way) -> Way:
        """A way with what the best parts make of it."""
        if way.certain or way.kind == "trim":
            return way
        lost = total = 0
        for first in (0, FEW):
            boards = self.finest.take(range(first, first + FEW))
            found = forecast(boards, way.question, self.jobs)
            lost += sum(_verdict(orbit, way.question) is not Verdict.OK for orbit in found)
            total += FEW
            hopeless = bool(binom.sf(lost - 1, total, 1.0 - self.target) < RARE)
            if hopeless:
                unsettled = [k for k, orbit in enumerate(found) if orbit is None][:DOUBTED]
                if unsettled:
                    hopeless = not self._any_settles(boards.take(unsettled), way.question)
                break
            if lost == 0:
                break
        self.progress()
        return replace(way, most=1.0 - lost / total, hopeless=hopeless)

    def _any_settles(self, boards: Boards, question: Question) -> bool:
        """Whether one of these boards shows the response after all, given all the time there is."""
        size = len(boards)
        found = Ensemble(boards).settle(
            range(size),
            [question.excitation.drive] * size,
            np.tile(question.start.start, (size, 1)),
            jobs=self.jobs,
        )
        return any(_verdict(orbit, question) is Verdict.OK for orbit in found)

    def ways(self, first: Way) -> list[Way]:
        """A response's ways, ``first`` the one as it is. What asks more of people is looked for
        only where nothing before it is certain."""
        row = [self.bounded(first)]
        if first.rate >= self.target:
            return row
        plan = plan_of(self.branch.made, first.question, self.seed)
        if PLACE not in self.without:
            for over in ("omega", "b"):
                moved = self._moved(first, plan, over)
                if moved is not None:
                    row.append(self.bounded(self.seen(moved)))
                    if row[-1].certain:
                        return row
        if TRIM not in self.without and self.trim > 0.0:
            few = measure(
                plan, self.target, self.book, trim=self.trim, first=TRIM_FIRST,
                least=TRIM_BOARDS, most=TRIM_BOARDS, jobs=self.jobs,
            )  # fmt: skip
            self.progress()
            hopeless = few.rate < self.target
            row.append(
                Way(first.response, "trim", first.question,
                    rate=few.rate, most=few.rate, hopeless=hopeless)
            )  # fmt: skip
        return row

    def _moved(self, way: Way, plan: StudyPlan, over: str) -> Way | None:
        """Another place of the response in its window, where more boards show it."""
        number, made = way.response, self.branch.made
        response = made.found[number]

        def mapped(of: StudyPlan, values: tuple[float, ...] | None = None) -> YieldMap:
            found = yield_map(
                of, 0, "b" if over == "b" else "omega", response.b, values=values,
                samples=FEW, points=MAP_POINTS, jobs=self.jobs, quick=True,
            )  # fmt: skip
            self.progress()
            return found

        found = mapped(plan)
        if found.rate.max() < FAINT:
            found = mapped(replace(self.best_parts, questions=plan.questions), found.axes[0].values)
        best = best_place(found)
        if best is None:
            return None
        value = float(f"{best:.4g}")
        place = Place(value, response.b) if over == "omega" else Place(response.omega, value)
        question = moved_question(self.branch, {number: place})
        return None if question is None else Way(number, over, question, place)


def moved_question(branch: Branch, places: Mapping[int, Place]) -> Question | None:
    """What boards are asked of one response at another place; None where the circuit does not show
    it there, or a side condition breaks that held."""
    made = branch.made
    ((number, _),) = places.items()
    moved = with_parts_kept(made, upgraded_file(made.modelfile, Upgrades(places=places)), [number])
    broken = {c.quantity for c in made.design.checks if not c.holds}
    if any(not c.holds and c.quantity not in broken for c in moved.design.checks):
        return None
    return asked(moved, moved.found[number : number + 1])[0]


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
