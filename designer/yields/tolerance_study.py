"""Run a tolerance study."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from designer.base.defaults import SAMPLES as SAMPLES, SEED as SEED, at_least, cores
from designer.base.progress import Progress
from designer.check import checked_design
from designer.check.checked_design import CheckedResponse
from designer.check.synthesis_result import Synthesis
from designer.dynamics.orbit import OrbitStatus
from designer.model.model_file import need_responses
from designer.spice.numerics_gate import GateResult
from designer.spice.pool import SpicePool
from designer.spread.spread import NO_BANDWIDTH
from designer.yields import layers, study_plan
from designer.yields.blame_extent import BUDGET
from designer.yields.layers import Runner
from designer.yields.study import Study
from designer.yields.study_layers import RungName, Stores, Work
from designer.yields.trimmed_yield import dc_trim
from designer.yields.yield_maps import Over


def check(
    synthesis: Synthesis,
    pool: SpicePool | None,
    progress: Progress | None = None,
    gates: Sequence[GateResult] | None = None,
) -> tuple[CheckedResponse, ...]:
    """Every response of a design on the exact circuit and, with a pool, in ngspice.

    gates : see ``checked_design.check``.
    """
    said = Progress() if progress is None else progress

    def stage(text: str) -> None:
        said.stage(text)

    return checked_design.check(synthesis.design, synthesis.found, pool, stage, gates=gates)


def tolerance(
    synthesis: Synthesis,
    *,
    samples: int = SAMPLES,
    until: float | None = None,
    rung: RungName = "auto",
    tuned: bool = False,
    reached: bool = False,
    blamed: bool = True,
    blame_budget: int = BUDGET,
    maps: Sequence[Over] = (),
    seed: int = SEED,
    jobs: int | None = None,
    pool: SpicePool | None = None,
    checked: tuple[CheckedResponse, ...] | None = None,
    stores: Stores | None = None,
    runner: Runner | None = None,
    progress: Progress | None = None,
    sampled: Callable[[Study], None] = lambda _: None,
    standing: Callable[[Study], None] | None = None,
) -> Study:
    """How many boards show each response, under the spread of the model file.

    samples : at least. until : width of the 95 % intervals at which the study stops growing; it
    does not grow if None. rung : ``exact`` asks no ngspice, ``auto`` as ``yields.ngspice_sampling``
    says, ``ngspice`` about every board. tuned, reached, blamed : whether these are wanted; a fitted
    trimmer is always asked for. blame_budget : steps of the blame (``blame_extent``). maps :
    settings over which the yield is wanted (``yield_maps.OVERS``). checked : of the same design, to
    save the time of the gate. pool : where ngspice runs; without one ngspice is not asked. stores :
    where rows are read from and written to. runner : who computes blocks; this process if None.
    sampled : is given the study once the exact circuit has every board and ngspice is still to be
    asked. standing : is given the study once its yields stand and the blame or maps are still to be
    worked out.
    """
    need_responses(synthesis.modelfile)
    said = Progress() if progress is None else progress
    jobs = cores() if jobs is None else jobs
    at_least("--samples", samples, 1)
    at_least("--seed", seed, 0)
    at_least("--jobs", jobs, 1)
    pool = None if rung == "exact" else pool
    checked = check(synthesis, pool, said) if checked is None else checked
    left_out = {i: why for i, c in enumerate(checked) if (why := _why_not(c))}
    asked = tuple(i for i in range(len(checked)) if i not in left_out)
    plan = study_plan.plan_study(
        synthesis.modelfile,
        synthesis.design,
        [checked[i] for i in asked],
        synthesis.catalog,
        samples=samples,
        seed=seed,
    )
    if plan.spread.gain_bandwidth is not None:
        said.note(f"the spread of the gain-bandwidth {NO_BANDWIDTH}")
    study = Study(checked, plan, asked, left_out, (), until=until, blame_wanted=blamed)
    if not asked:
        return study
    work = Work(
        jobs,
        pool,
        Stores() if stores is None else stores,
        layers.Here(jobs) if runner is None else runner,
        said,
        rung,
        blame_budget,
    )
    if until is None:
        study = work.sampled(study)
        if pool is not None:
            sampled(study)
        study = work.heard(study)
    else:
        study = work.grown(study)
    if tuned:
        study = work.tuned(study, synthesis.modelfile.tuning)
    trim = dc_trim(synthesis)
    if trim is not None:
        study = work.trimmed(study, trim)
    if reached:
        study = work.reached(study)
    if blamed:
        study = replace(study, blame=work.known_blame(study))
    if standing is not None and (maps or (blamed and study.blame is None)):
        standing(study)
    if blamed and study.blame is None:
        study = work.blamed(study)
    return work.mapped(study, maps) if maps else study


def _why_not(checked: CheckedResponse) -> str:
    """Why a response cannot be a question of a study; "" where it can."""
    if not checked.model.found:
        return "the model does not show it"
    if checked.circuit.status is not OrbitStatus.PERIODIC:
        return f"the nominal circuit is {checked.circuit.response}"
    return ""
