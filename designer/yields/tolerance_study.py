"""Run a tolerance study, layer by layer: how far it grows and who is asked what."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from designer.base import progress
from designer.base.defaults import (
    SAMPLES as SAMPLES,
    SEED as SEED,
    Over,
    StudyEngine,
    check_count,
    check_seed,
    cores,
)
from designer.base.errors import InputError
from designer.base.progress import Laps
from designer.check import checked_design
from designer.check.checked_design import CheckedResponse
from designer.check.synthesis_result import Synthesis
from designer.circuit.ensemble import Ensemble
from designer.dynamics.orbit import SETTLED
from designer.model.model_file import ModelFile, need_responses
from designer.model.tuning_bands import Bands
from designer.spice.numerics_gate import GateResult
from designer.spice.pool import SpicePool
from designer.spread.part_rules import warmed
from designer.spread.spread import NO_BANDWIDTH, Spread
from designer.verdicts import cross_check
from designer.verdicts.cross_check import NOMINAL_SAMPLES, Ask, CrossCheck
from designer.verdicts.fidelity_gate import gated
from designer.verdicts.verdict import BLOCK, StudyPlan
from designer.yields import layers
from designer.yields.layers import LayerName, Runner, Task
from designer.yields.loss_attribution import Attribution, attribute
from designer.yields.loss_replay import BUDGET, extent_of
from designer.yields.power_up import power_up_block
from designer.yields.rare_losses import counted_losses, rare_losses
from designer.yields.row_store import BlockStore
from designer.yields.setting_search import MOST_TRIES
from designer.yields.start_recipe_search import find_recipes
from designer.yields.stored_parts import AnswerLog, StoredParts
from designer.yields.study import Study
from designer.yields.study_identity import study_hash
from designer.yields.study_plan import plan_study
from designer.yields.trimmed_yield import DcTrim, dc_trim, trimmed_block
from designer.yields.tuned_yield import tuned_block
from designer.yields.yield_maps import yield_map


def lagging_plan(
    plan: StudyPlan, pool: SpicePool | None
) -> tuple[StudyPlan, tuple[int, ...], dict[int, str]]:
    """The plan of the same boards with bandwidth, which of its questions are left in order, and
    why the others are not.

    Each question starts on the nominal orbit of the circuit with bandwidth. pool : of ngspice,
    which must pass the gate with op-amps that lag too; without one it is not asked.

    Raises
    ------
    InputError : the circuit's op-amp has no gain-bandwidth.
    """
    if plan.circuit.figures is None:
        expected = "a circuit whose op-amp has figures in the catalogue"
        raise InputError(None, "--rung", "bandwidth", expected)
    plan = replace(plan, bandwidth=True)
    if not plan.questions:
        return plan, (), {}
    orbits = Ensemble(plan.nominal()).settle(
        [0] * len(plan.questions),
        [q.excitation.drive for q in plan.questions],
        np.array([q.start.start for q in plan.questions]),
    )
    left = tuple(k for k, o in enumerate(orbits) if o.status in SETTLED)
    why = {
        k: f"the nominal circuit with bandwidth is {orbit.response}"
        for k, orbit in enumerate(orbits)
        if k not in left
    }
    questions = tuple(replace(plan.questions[k], start=orbits[k], settings=None) for k in left)
    plan = replace(plan, questions=questions)
    if pool is not None and questions:
        plan, _ = gated(plan, pool, plan.fidelity)
    return plan, left, why


GROWTH = 0.05
"""By what share of its samples a study grows until its intervals are narrow, at least by a block:
each time all its rows are counted anew."""
MOST_NOMINAL = 1000
"""Boards of each response that ngspice starts from the nominal orbit in such a study, at most."""
MORE_NOMINAL = 50
"""By how many boards their number grows."""


IN_VAIN = 0.1
"""The exact samples' interval over the wanted width below which more samples change nothing: it is
ngspice that keeps the whole interval wide."""


LongWork = Literal["attribution", "maps", "rare", "rare answers"]
"""Work that is kept in parts: an attribution, yield maps, estimates of rare losses, and the answers
of boards that one of these has asked so far."""


class Stores:
    """Where the layers of a study are kept, and its attribution; this one keeps nothing."""

    def rows(
        self, layer: LayerName, plan: StudyPlan, more: Mapping[str, Any] | None = None
    ) -> BlockStore[Any] | None:
        """The blocks of a layer. more : what decides its rows beside the plan."""
        return None

    def attribution(self, plan: StudyPlan, budget: int) -> Attribution | None:
        """The whole attribution, or one of this budget at least."""
        return None

    def put_attribution(self, plan: StudyPlan, attribution: Attribution) -> None:
        pass

    def parts(self, work: LongWork, plan: StudyPlan) -> StoredParts:
        """Where the finished parts of long work are."""
        return StoredParts()


def check(
    synthesis: Synthesis,
    pool: SpicePool | None,
    gates: Sequence[GateResult] | None = None,
) -> tuple[CheckedResponse, ...]:
    """Every response of a design on the exact circuit and, with a pool, in ngspice.

    gates : see ``checked_design.check``.
    """
    return checked_design.check(
        synthesis.design, synthesis.model_responses, pool, progress.stage, gates=gates
    )


def tolerance(
    synthesis: Synthesis,
    *,
    samples: int = SAMPLES,
    until: float | None = None,
    fidelity: StudyEngine = "auto",
    tuned: bool = False,
    reached: bool = False,
    attributed: bool = True,
    attribution_budget: int = BUDGET,
    maps: Sequence[Over] = (),
    rare: bool = False,
    seed: int = SEED,
    jobs: int | None = None,
    pool: SpicePool | None = None,
    checked: tuple[CheckedResponse, ...] | None = None,
    stores: Stores | None = None,
    runner: Runner | None = None,
    sampled: Callable[[Study], None] = lambda _: None,
    standing: Callable[[Study], None] | None = None,
) -> Study:
    """How many boards show each response, under the spread of the model file.

    samples : at least. until : width of the 95 % intervals at which the study stops growing; it
    does not grow if None. fidelity : ``exact`` asks no ngspice, ``auto`` as
    ``verdicts.cross_check`` says, ``bandwidth`` as ``auto``, with op-amps that lag, ``ngspice``
    about every board. tuned, reached, attributed : whether these are wanted; a fitted trimmer is
    always asked for. attribution_budget : steps of the attribution (``loss_replay``). maps :
    settings over which the yield is wanted (``yield_maps.OVERS``). rare : whether boards are drawn
    where they are lost (``rare_losses``). checked : of the same design, to save the time of the
    gate. pool : where ngspice runs; without one ngspice is not asked. stores : where rows are read
    from and written to. runner : who computes blocks; this process if None. sampled : is given the
    study once the exact circuit has every board, before ngspice is asked. standing : is given the
    study once its yields stand and the attribution or maps are still to be worked out.
    """
    need_responses(synthesis.modelfile)
    warm = None
    if "temperature" in maps:
        warm = warmed(synthesis.modelfile, synthesis.design.circuit, synthesis.catalog)
    jobs = cores() if jobs is None else jobs
    check_count("--samples", samples, 1)
    check_seed(seed)
    check_count("--jobs", jobs, 1)
    if rare:
        need_drawn_boards(synthesis.modelfile)
    pool = None if fidelity == "exact" else pool
    checked = check(synthesis, pool) if checked is None else checked
    left_out = {i: why for i, c in enumerate(checked) if (why := _why_not(c))}
    indices = tuple(i for i in range(len(checked)) if i not in left_out)
    plan = plan_study(
        synthesis.modelfile,
        synthesis.design,
        [checked[i] for i in indices],
        synthesis.catalog,
        samples=samples,
        seed=seed,
    )
    if fidelity == "bandwidth":
        progress.stage("nominal orbits with bandwidth")
        plan, left, gone = lagging_plan(plan, pool)
        left_out |= {indices[k]: reason for k, reason in gone.items()}
        indices = tuple(indices[k] for k in left)
    elif plan.spread.gain_bandwidth is not None:
        progress.note(f"the spread of the gain-bandwidth {NO_BANDWIDTH}")
    laps = Laps()
    study = Study(
        checked,
        plan,
        indices,
        left_out,
        (),
        until=until,
        blame_wanted=attributed,
        seconds=laps.seconds,
    )
    if not indices:
        return study
    work = StudyWork(
        jobs,
        pool,
        Stores() if stores is None else stores,
        layers.LocalRunner(jobs) if runner is None else runner,
        fidelity,
        attribution_budget,
    )
    if until is None:
        study = work.sampled(study)
        laps.end("exact")
        sampled(study)
        laps.end("early_table")
        study = work.cross_checked(study)
        laps.end("ngspice")
    else:
        study = work.grown(study)
        laps.end("growing")
    if tuned:
        study = work.tuned(study, synthesis.modelfile.tuning)
    trim = dc_trim(synthesis)
    if trim is not None:
        study = work.trimmed(study, trim)
    if reached:
        study = work.powered_up(study)
    laps.end("further_layers")
    if attributed:
        study = replace(study, blame=work.stores.attribution(study.plan, attribution_budget))
    if standing is not None and (maps or rare or (attributed and study.blame is None)):
        standing(study)
        laps.end("first_report")
    if attributed and study.blame is None:
        study = work.attributed(study)
    if rare:
        study = work.drawn_where_lost(study)
    return work.mapped(study, maps, warm) if maps else study


def need_drawn_boards(modelfile: ModelFile) -> None:
    """InputError where the boards of a model file are those of a list, whose rare losses nobody
    can estimate."""
    if modelfile.measured is not None and modelfile.measured.labels:
        expected = "no list of measured boards, which are as many as there are"
        raise InputError(None, "--rare", "spread.measured", expected)


def _why_not(checked: CheckedResponse) -> str:
    """Why a response cannot be a question of a study; "" where it can."""
    if not checked.model.found:
        return "the model does not show it"
    if checked.circuit.status not in SETTLED:
        return f"the nominal circuit is {checked.circuit.response}"
    return ""


@dataclass(frozen=True)
class StudyWork:
    """Who does the work of a study, and where it goes. Each step takes a study and gives it back
    with more in it."""

    jobs: int
    """Number of workers."""
    pool: SpicePool | None
    """Runs ngspice; None where it is not asked."""
    stores: Stores
    """Where rows are kept."""
    runner: Runner
    """Who computes blocks."""
    engine: StudyEngine
    """Which engine decides."""
    attribution_budget: int = BUDGET
    """Steps that the attribution may take."""

    def sampled(self, study: Study) -> Study:
        """The study with the exact circuit's answers of the plan's samples."""
        return self._with_samples(study, study.plan.samples)

    def cross_checked(self, study: Study) -> Study:
        """The study with ngspice's answers about some of the boards, or all."""
        return self._with_all_checks(study, NOMINAL_SAMPLES)

    def grown(self, study: Study) -> Study:
        """The study with as many samples as its intervals take; it stops at edges of blocks
        only."""
        until = study.until
        assert until is not None
        samples = -(-study.plan.samples // BLOCK) * BLOCK
        nominal = NOMINAL_SAMPLES
        study = self._with_samples(study, samples)
        both_engines = self.pool is not None and self.engine != "ngspice"
        checks: tuple[CrossCheck, ...] = ()
        while any(_decided(study)):
            asks = self._random(study, nominal)
            study = replace(study, cross_checks=self._checks(study, asks, last=False))
            if _widest(study) < until and both_engines:
                # The boards at a boundary are a stratum of their own and may widen it again. They
                # are others once there are more samples, so these are not kept.
                asks += cross_check.ask_boundary(study.answers, study.plan.questions, asks)
                checks = self._checks(study, asks, earlier=checks, store=False)
                study = replace(study, cross_checks=checks)
            if _widest(study) < until:
                break
            # Exact samples narrow the first part of an interval, boards in ngspice the second.
            exact = _widest(replace(study, cross_checks=()))
            if exact >= 0.7 * until:
                samples = _more(samples)
                study = self._with_samples(study, samples)
            elif both_engines and nominal < min(MOST_NOMINAL, samples):
                nominal += MORE_NOMINAL
            elif nominal < MOST_NOMINAL and exact >= IN_VAIN * until:
                samples = _more(samples)
                study = self._with_samples(study, samples)
            else:
                break
        study = self._with_all_checks(study, nominal)
        return replace(study, narrow=self._narrow(study, until))

    def _narrow(self, study: Study, until: float) -> bool:
        """Whether every interval is; says which is not, and why there are no more samples."""
        silent = [i + 1 for i in study.response_indices if not _decided(study)[i]]
        if silent:
            progress.note(
                f"no board has an answer to response {', '.join(map(str, silent))}: "
                "more samples would not narrow its interval"
            )
        if not _widest(study) < until:
            progress.note(
                f"the intervals are still wider than {until:g}, by what ngspice says: it is asked "
                f"about {MOST_NOMINAL} boards of a response at most"
            )
        return not silent and _widest(study) < until

    def tuned(self, study: Study, bands: Bands) -> Study:
        """The study with yields where the generator is free within the bands."""
        plan, count = study.plan, len(study.plan.questions)
        more = {"bands": bands.as_dict(), "tries": MOST_TRIES}

        def task(block: range) -> Task:
            as_built = study.answers[block.start * count : block.stop * count]
            return partial(tuned_block, plan, block, as_built, bands)

        return replace(study, tuned=self._rows("tuned", "tuned boards", plan, task, more))

    def trimmed(self, study: Study, trim: DcTrim) -> Study:
        """The study with yields where the trimmer of each board is set once."""
        plan = study.plan

        def task(block: range) -> Task:
            return partial(trimmed_block, trim, plan, block)

        rows = self._rows("trimmed", "trimmed boards", plan, task, trim.as_dict())
        return replace(study, trimmed=rows)

    def powered_up(self, study: Study) -> Study:
        """The study with yields from power-up, by the recipes that the nominal circuit and a few
        boards suggest."""
        plan = study.plan
        progress.stage("start recipes")
        recipes = find_recipes(plan, self.jobs)

        def task(block: range) -> Task:
            return partial(power_up_block, plan, block, recipes)

        more = {"recipes": [r.as_dict() for r in recipes]}
        rows = self._rows("reached", "boards from power-up", plan, task, more)
        return replace(study, power_ups=rows, recipes=recipes)

    def attributed(self, study: Study) -> Study:
        """The study with the attribution of its losses."""
        plan, answers, budget = study.plan, study.answers, self.attribution_budget
        result = attribute(
            plan,
            answers,
            budget=budget,
            jobs=self.jobs,
            progress=progress.stage(
                "blame, boards asked again", extent_of(plan, answers, budget).steps
            ),
            parts=self.stores.parts("attribution", plan),
        )
        self.stores.put_attribution(plan, result)
        return replace(study, blame=result)

    def drawn_where_lost(self, study: Study) -> Study:
        """The study with an estimate of each response's losses, by boards that are drawn where they
        are lost."""
        found, parts = [], self.stores.parts("rare", study.plan)
        answers = self.stores.parts("rare answers", study.plan)
        for number, index in enumerate(study.response_indices):
            name = f"rare {number}"
            result = parts.get(name)
            counted = study.yields[index]
            if result is None and counted is not None:
                result = counted_losses(number, counted)
            if result is None:
                step = progress.stage(f"boards where they are lost, response {index + 1}")
                log = AnswerLog(answers, name)
                result = rare_losses(study.plan, number, jobs=self.jobs, progress=step, log=log)
                parts.put({name: replace(result, seconds=0.0)})
                log.forget()
            found.append(result)
        return replace(study, rare=tuple(found))

    def mapped(self, study: Study, overs: Sequence[Over], warm: Spread | None = None) -> Study:
        """The study with a yield map of each response over each of these settings.

        warm : ``warmed`` of ``yield_map``.
        """
        maps, parts = [], self.stores.parts("maps", study.plan)
        for over in overs:
            for number, index in enumerate(study.response_indices):
                b = study.checked[index].model.b
                name = f"map {over} {number} {b!r}"
                if over == "temperature":  # what moves boards is not part of the plan
                    assert warm is not None
                    name += f" {study_hash(replace(study.plan, spread=warm))}"
                result = parts.get(name)
                if result is None:
                    step = progress.stage(f"yield map over {over}, response {index + 1}")
                    result = yield_map(
                        study.plan, number, over, b, warmed=warm, jobs=self.jobs, progress=step
                    )
                    parts.put({name: replace(result, seconds=0.0)})
                maps.append(result)
        return replace(study, maps=tuple(maps))

    def _rows(
        self,
        layer: LayerName,
        stage: str,
        plan: StudyPlan,
        task: Callable[[range], Task],
        more: Mapping[str, Any] | None = None,
        first: int = 0,
    ) -> tuple[Any, ...]:
        """The rows of a layer from sample ``first`` on, under a stage of this name."""
        step = progress.stage(stage, (plan.samples - first) * len(plan.questions))
        store = self.stores.rows(layer, plan, more)
        size = layers.LAYERS[layer][1]
        return tuple(layers.fill(plan, store, size, task, self.runner, step, first))

    def _with_samples(self, study: Study, samples: int) -> Study:
        """The study with the answers of so many samples; those that it has end at an edge of a
        block."""
        plan = replace(study.plan, samples=samples)
        stage = f"tolerance study, {samples} boards, responses: {len(plan.questions)}"
        task = partial(layers.samples_task, plan)
        first = len(study.answers) // len(plan.questions)
        rows = self._rows("samples", stage, plan, task, first=first)
        return replace(study, plan=plan, answers=(*study.answers, *rows))

    def _random(self, study: Study, nominal: int) -> list[Ask]:
        if self.engine == "ngspice":
            return cross_check.ask_all(study.answers)
        asks = cross_check.ask_random(study.answers, nominal)
        questions = study.plan.questions
        return cross_check.affordable(asks, study.answers, questions, nominal)

    def _not_asked(self, study: Study, asks: Sequence[Ask], nominal: int) -> tuple[int, ...]:
        """How many boards of each question the limit of ngspice's steps leaves out, which a note
        says."""
        if self.pool is None:
            return ()
        wanted = cross_check.ask_random(study.answers, nominal)
        counts = cross_check.not_asked(wanted, asks, study.plan.questions)
        for index, count in zip(study.response_indices, counts, strict=True):
            if count:
                progress.note(
                    f"response {index + 1}: {count} boards are not asked in ngspice, whose runs "
                    f"would take more than {nominal} × {cross_check.STEPS_EACH} steps together"
                )
        return counts

    def _with_all_checks(self, study: Study, nominal: int) -> Study:
        """The study with ngspice's answers about the boards at a boundary, which are known only
        once there is no more sample, and about those on which the engines differ, once that is
        known."""
        asks = self._random(study, nominal)
        if self.engine != "ngspice":
            asks += cross_check.ask_boundary(study.answers, study.plan.questions, asks)
            study = replace(study, not_asked=self._not_asked(study, asks, nominal))
        study = replace(study, cross_checks=self._checks(study, asks, last=False))
        asks += cross_check.ask_differing(study.answers, study.cross_checks, asks)
        return replace(study, cross_checks=self._checks(study, asks))

    def _checks(
        self,
        study: Study,
        asks: Sequence[Ask],
        *,
        last: bool = True,
        earlier: Sequence[CrossCheck] = (),
        store: bool = True,
    ) -> tuple[CrossCheck, ...]:
        """ngspice's answers. earlier : answers beside those of the study. store : whether to store
        them."""
        plan = study.plan
        asks = [a for a in asks if plan.questions[a.question].settings is not None]
        if self.pool is None or not asks:
            return ()
        rows = self.stores.rows("ngspice", plan) if store else None
        earlier = (*earlier, *study.cross_checks)
        new = len(asks) - layers.count_answered(asks, rows, earlier)
        old = f", {len(asks) - new} more are there" if new < len(asks) else ""
        step: layers.Step = _no_step
        if new:
            step = progress.stage(f"boards in ngspice, {new} runs{old}", len(asks))
        return tuple(
            layers.fill_cross_checks(
                plan, asks, rows, self.pool, self.jobs, step, earlier=earlier, last=last
            )
        )


def _no_step() -> None:
    pass


def _more(samples: int) -> int:
    """The samples of the next step, at the edge of a block."""
    return samples + BLOCK * max(1, round(GROWTH * samples / BLOCK))


def _decided(study: Study) -> list[bool]:
    """Whether any board has an answer, for each response."""
    return [y is not None and y.samples > y.failed for y in study.yields]


def _widest(study: Study) -> float:
    """Width of the widest interval, the combined one where there is one, of the responses to which
    any board has an answer."""
    intervals = [
        (c.low, c.high) if c is not None else y.interval
        for c, y, some in zip(study.combined, study.yields, _decided(study), strict=True)
        if y is not None and some
    ]
    return max((high - low for low, high in intervals), default=0.0)
