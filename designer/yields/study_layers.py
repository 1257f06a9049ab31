"""The work of a tolerance study, layer by layer: how far it grows and who is asked what.

Each step takes a study and gives it back with more in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Literal

from designer.base.progress import Progress
from designer.model.tuning_bands import Bands
from designer.spice.pool import SpicePool
from designer.yields import layers, ngspice_sampling
from designer.yields.blame_analysis import Blame, blame
from designer.yields.blame_extent import BUDGET, extent_of
from designer.yields.blame_pieces import StoredParts
from designer.yields.layers import Runner
from designer.yields.ngspice_sampling import NOMINAL_SAMPLES, Ask, Hearing
from designer.yields.power_up_yield import PowerUpAnswer
from designer.yields.row_store import BlockStore
from designer.yields.start_recipe import Recipe
from designer.yields.start_recipe_search import find_recipes
from designer.yields.trimmed_yield import DcTrim, Trimmed
from designer.yields.tuned_yield import Tuned
from designer.yields.verdict import BLOCK, Answer, StudyPlan
from designer.yields.yield_maps import Over, yield_map

if TYPE_CHECKING:
    from designer.yields.study import Study

MOST_UNTIL = 100_000
"""Samples at which a study that grows until its intervals are narrow gives up."""
MOST_NOMINAL = 1000
"""Boards of each response that ngspice starts from the nominal orbit in such a study, at most."""
MORE_NOMINAL = 50
"""By how many their number grows."""

RungName = Literal["exact", "auto", "ngspice"]
RUNGS: tuple[RungName, ...] = ("exact", "auto", "ngspice")


class Stores:
    """Where the layers of a study are kept, and its blame; this one keeps nothing."""

    def samples(self, plan: StudyPlan) -> BlockStore[Answer] | None:
        return None

    def ngspice(self, plan: StudyPlan) -> BlockStore[Hearing] | None:
        return None

    def tuned(self, plan: StudyPlan, bands: Bands) -> BlockStore[Tuned] | None:
        return None

    def trimmed(self, plan: StudyPlan, trim: DcTrim) -> BlockStore[Trimmed] | None:
        return None

    def reached(
        self, plan: StudyPlan, recipes: Sequence[Recipe]
    ) -> BlockStore[PowerUpAnswer] | None:
        return None

    def blame(self, plan: StudyPlan, budget: int) -> Blame | None:
        """The whole blame, or one of this budget at least."""
        return None

    def keep_blame(self, plan: StudyPlan, found: Blame) -> None:
        pass

    def blame_pieces(self, plan: StudyPlan) -> StoredParts:
        """Where the finished parts of a blame are."""
        return StoredParts()

    def maps(self, plan: StudyPlan) -> StoredParts:
        """Where the finished yield maps are."""
        return StoredParts()


@dataclass(frozen=True)
class Work:
    """Who does the work of a study, and where it goes."""

    jobs: int
    """Number of workers."""
    pool: SpicePool | None
    """Runs ngspice; None where it is not asked."""
    stores: Stores
    """Where rows are kept."""
    runner: Runner
    """Who computes blocks."""
    said: Progress
    """Told how far the work is."""
    rung: RungName
    """Which engine decides; "auto": the exact circuit, and ngspice is asked about a sample."""
    blame_budget: int = BUDGET
    """Steps that the blame may take."""

    def sampled(self, study: Study) -> Study:
        """With the exact circuit's answers of the plan's samples."""
        return self._sampled(study, study.plan.samples)

    def heard(self, study: Study) -> Study:
        """With ngspice's answers about some of the boards, or all."""
        return self._all_heard(study, NOMINAL_SAMPLES)

    def grown(self, study: Study) -> Study:
        """A study of as many samples as it takes; it stops at edges of blocks only."""
        until = study.until
        assert until is not None
        samples = -(-study.plan.samples // BLOCK) * BLOCK
        nominal = NOMINAL_SAMPLES
        study = self._sampled(study, samples)
        spoken = self.pool is not None and self.rung == "auto"
        known: tuple[Hearing, ...] = ()
        while any(_decided(study)):
            asks = self._random(study, nominal)
            study = replace(study, heard=self._heard(study, asks, last=False))
            if _wide(study) < until and spoken:
                # The boards at a boundary are a stratum of their own and may widen it again. They
                # are others once there are more samples, so these are not kept.
                asks += ngspice_sampling.ask_boundary(study.answers, study.plan.questions, asks)
                known = self._heard(study, asks, known=known, store=False)
                study = replace(study, heard=known)
            if _wide(study) < until:
                break
            # Exact samples narrow the first part of an interval, boards in ngspice the second.
            exact = max(
                high - low
                for y, some in zip(study.yields, _decided(study), strict=True)
                if y is not None and some
                for low, high in [y.interval]
            )
            if exact >= 0.7 * until and samples < MOST_UNTIL:
                samples = min(samples + BLOCK, MOST_UNTIL)
                study = self._sampled(study, samples)
            elif spoken and nominal < min(MOST_NOMINAL, samples):
                nominal += MORE_NOMINAL
            elif samples < MOST_UNTIL and (exact >= until or nominal < MOST_NOMINAL):
                samples = min(samples + BLOCK, MOST_UNTIL)
                study = self._sampled(study, samples)
            else:
                break
        study = self._all_heard(study, nominal)
        return replace(study, narrow=self._narrow(study, until))

    def _narrow(self, study: Study, until: float) -> bool:
        """Whether every interval is; says which is not, and why there are no more samples."""
        silent = [i + 1 for i in study.asked if not _decided(study)[i]]
        if silent:
            self.said.note(
                f"no board has an answer to response {', '.join(map(str, silent))}: "
                "more samples would not narrow its interval"
            )
        if not _wide(study) < until:
            self.said.note(
                f"the intervals are still wider than {until:g}: a study grows to "
                f"{MOST_UNTIL} samples at most, and to {MOST_NOMINAL} boards in ngspice"
            )
        return not silent and _wide(study) < until

    def tuned(self, study: Study, bands: Bands) -> Study:
        """With the generator free within the bands."""
        plan = study.plan
        step = self.said.stage("tuned boards", len(study.answers))
        rows = layers.fill(
            plan,
            self.stores.tuned(plan, bands),
            layers.SEARCH,
            partial(layers.Tunings, plan, study.answers, bands),
            self.runner,
            step,
        )
        return replace(study, tuned=tuple(rows))

    def trimmed(self, study: Study, trim: DcTrim) -> Study:
        """With the trimmer of each board set once."""
        plan = study.plan
        step = self.said.stage("trimmed boards", len(study.answers))
        rows = layers.fill(
            plan,
            self.stores.trimmed(plan, trim),
            BLOCK,
            partial(layers.Trimmings, plan, trim),
            self.runner,
            step,
        )
        return replace(study, trimmed=tuple(rows))

    def reached(self, study: Study) -> Study:
        """From power-up, by the recipes that the nominal circuit and a few boards suggest."""
        plan = study.plan
        self.said.stage("start recipes")
        recipes = find_recipes(plan, self.jobs)
        step = self.said.stage("boards from power-up", len(study.answers))
        rows = layers.fill(
            plan,
            self.stores.reached(plan, recipes),
            layers.SEARCH,
            partial(layers.PowerUps, plan, recipes),
            self.runner,
            step,
        )
        return replace(study, reached=tuple(rows), recipes=recipes)

    def blamed(self, study: Study) -> Study:
        """With the parts that the losses come from."""
        plan, answers, budget = study.plan, study.answers, self.blame_budget
        found = blame(
            plan,
            answers,
            budget=budget,
            jobs=self.jobs,
            progress=self.said.stage("blame", extent_of(plan, answers, budget).steps),
            pieces=self.stores.blame_pieces(plan),
        )
        self.stores.keep_blame(plan, found)
        return replace(study, blame=found)

    def known_blame(self, study: Study) -> Blame | None:
        """The blame of the study where it is stored; None where it has to be worked out."""
        return self.stores.blame(study.plan, self.blame_budget)

    def mapped(self, study: Study, overs: Sequence[Over]) -> Study:
        """With a yield map of each response over each of these settings."""
        maps, pieces = [], self.stores.maps(study.plan)
        for over in overs:
            for number, index in enumerate(study.asked):
                b = study.checked[index].model.b
                name = f"map {over} {number} {b!r}"
                found = pieces.get(name)
                if found is None:
                    step = self.said.stage(f"yield map over {over}, response {index + 1}")
                    found = yield_map(study.plan, number, over, b, jobs=self.jobs, progress=step)
                    pieces.put({name: replace(found, seconds=0.0)})
                maps.append(found)
        return replace(study, maps=tuple(maps))

    def _sampled(self, study: Study, samples: int) -> Study:
        """With the answers of so many samples; those that it has are at an edge of a block."""
        plan = replace(study.plan, samples=samples)
        first = len(study.answers) // len(plan.questions)
        steps = (samples - first) * len(plan.questions)
        step = self.said.stage(
            f"tolerance study, {samples} boards, responses: {len(plan.questions)}", steps
        )
        rows = layers.fill(
            plan,
            self.stores.samples(plan),
            BLOCK,
            partial(layers.Samples, plan),
            self.runner,
            step,
            first,
        )
        return replace(study, plan=plan, answers=(*study.answers, *rows))

    def _random(self, study: Study, nominal: int) -> list[Ask]:
        if self.rung == "ngspice":
            return ngspice_sampling.ask_all(study.answers)
        return ngspice_sampling.ask_random(study.answers, nominal)

    def _all_heard(self, study: Study, nominal: int) -> Study:
        """With the boards at a boundary, which are known only once there is no more sample, and
        those on which the engines differ, once that is known."""
        asks = self._random(study, nominal)
        if self.rung == "auto":
            asks += ngspice_sampling.ask_boundary(study.answers, study.plan.questions, asks)
        study = replace(study, heard=self._heard(study, asks, last=False))
        asks += ngspice_sampling.ask_differing(study.answers, study.heard, asks)
        return replace(study, heard=self._heard(study, asks))

    def _heard(
        self,
        study: Study,
        asks: Sequence[Ask],
        *,
        last: bool = True,
        known: Sequence[Hearing] = (),
        store: bool = True,
    ) -> tuple[Hearing, ...]:
        """What ngspice says to ``asks``. known : beside what the study has. store : keep it."""
        plan = study.plan
        asks = [a for a in asks if plan.questions[a.question].settings is not None]
        if self.pool is None or not asks:
            return ()
        kept = self.stores.ngspice(plan) if store else None
        heard = (*known, *study.heard)
        new = len(asks) - layers.held(asks, kept, heard)
        step: layers.Step = _nothing
        if new:
            old = f", {len(asks) - new} more are there" if new < len(asks) else ""
            step = self.said.stage(f"ngspice, {new} runs{old}", len(asks))
        return tuple(
            layers.listen(
                plan,
                asks,
                kept,
                self.pool,
                self.jobs,
                step,
                known=heard,
                last=last,
            )
        )


def _nothing() -> None:
    return None


def _decided(study: Study) -> list[bool]:
    """For each response, whether any board has an answer."""
    return [y is not None and y.samples > y.failed for y in study.yields]


def _wide(study: Study) -> float:
    """Width of the widest interval, the combined one where there is one, of the responses to which
    any board has an answer."""
    both = [
        (c.low, c.high) if c is not None else y.interval
        for c, y, some in zip(study.combined, study.yields, _decided(study), strict=True)
        if y is not None and some
    ]
    return max((high - low for low, high in both), default=0.0)
