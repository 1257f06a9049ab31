"""Which stage makes the clearance, where the model file states none; whether a stated one is worse.

Both are designed, and a few boards of each are asked what they show. The stage whose boards keep
the responses is taken; where the boards cannot tell the two apart, one that fails no design rule of
the circuit, then the smaller one. Of a stated stage whose boards lose a response it is said how
many boards of the other one keep it, if those are more.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, get_args

from designer.base.errors import InputError, Unreachable
from designer.base.progress import doing, is_watched, note, part
from designer.base.second_process import Ask
from designer.catalog.design_rule import FAIL
from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.check import checked_design, synthesis_result
from designer.check.synthesis_result import Ahead, Synthesis, with_stage
from designer.circuit.coefficients import LARGE_ERROR
from designer.circuit.ensemble import BRIEF, Ensemble
from designer.design_rules import run_rules
from designer.design_rules.rule_subject import RuleSubject
from designer.dynamics.orbit import OrbitStatus
from designer.model.circuit_table import DeadZone
from designer.model.find_responses import ModelResponse, matches
from designer.model.model_file import ModelFile
from designer.spread.spread import draw_many
from designer.synthesis.part_checks import stage_refusal
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import Verdict
from designer.yields.study_plan import plan_study

BOARDS = 64
"""Boards of each stage that are asked."""
FEW = 16
"""Of these, so many are asked about a response at a time."""
STREAM = "stage:"
"""Stream of these boards, which no study draws."""


@dataclass(frozen=True)
class StageForecast:
    """What is foretold of a design with one of the stages."""

    synthesis: Synthesis
    kept: int | None
    """Of ``BOARDS`` boards, those that keep the response that the fewest keep; None without a
    response that the model shows with a period."""

    @property
    def kind(self) -> DeadZone:
        """The stage."""
        kind = self.synthesis.modelfile.circuit.dead_zone
        assert kind is not None
        return kind

    @property
    def failed(self) -> tuple[str, ...]:
        """Rules of the circuit that fail."""
        return tuple(o.rule.id for o in self.synthesis.outcomes or () if o.status == FAIL)

    @property
    def words(self) -> str:
        """The forecast in words."""
        boards = "" if self.kept is None else f"{self.kept} of {BOARDS} boards keep the responses, "
        rules = "no rule fails"
        if self.failed:
            rules = f"{', '.join(self.failed)} {'fail' if len(self.failed) > 1 else 'fails'}"
        parts = len(self.synthesis.design.circuit.values)
        error = self.synthesis.design.errors.max_error
        return f"{self.kind}: {boards}{rules}, largest error {100 * error:.2g} %, {parts} parts"

    def better_than(self, other: StageForecast) -> bool:
        """Whether this stage is to be taken: by what its boards keep, if that differs by more than
        chance; else by the rules, the error and the number of parts."""
        if self.kept is not None and other.kept is not None and _differ(self.kept, other.kept):
            return self.kept > other.kept
        return self._rank < other._rank

    @property
    def _rank(self) -> tuple[bool, bool, int]:
        design = self.synthesis.design
        return bool(self.failed), design.errors.max_error > LARGE_ERROR, len(design.circuit.values)


def synthesise(
    modelfile: ModelFile,
    catalog: Catalog | None = None,
    *,
    all_found: bool = True,
    jobs: int = 1,
    other: Ask | None = None,
    ahead: Ahead | None = None,
) -> Synthesis:
    """``check.synthesis_result.synthesise``, with the better stage where the model file states none
    and both make its clearances. other : a process that designs with one of them meanwhile; no
    choice depends on it. ahead : as of ``responses_of``.

    Raises
    ------
    InputError, Unreachable, ResponseNotFound : as there; of the stage that is built without a
        choice where neither can be.
    """
    catalog = load_catalog() if catalog is None else catalog
    able = _able(modelfile)
    if modelfile.circuit.dead_zone is not None or len(able) < 2:
        return synthesis_result.synthesise(
            modelfile, catalog, all_found=all_found, jobs=jobs, ahead=ahead
        )
    began = time.perf_counter()
    first, second = able
    met = synthesis_result.responses_of(
        with_stage(modelfile, first), catalog, all_found=all_found, ahead=ahead
    )
    if other is not None:
        elsewhere = other(_foretold, modelfile, second, catalog, met, jobs)
    refusal = None
    forecasts: list[StageForecast] = []
    try:
        forecasts.append(_of_stage(modelfile, first, catalog, met, jobs))
    except Unreachable as error:
        refusal = error
    there = _foretold(modelfile, second, catalog, met, jobs) if other is None else elsewhere()
    forecasts += [] if there is None else [there]
    if refusal is not None and not forecasts:
        raise refusal
    made = replace(chosen(forecasts), seconds=time.perf_counter() - began)
    if is_watched():
        note(synthesis_result.parts_line(made.design, made.seconds))
    return made


def _of_stage(
    modelfile: ModelFile,
    kind: DeadZone,
    catalog: Catalog,
    met: tuple[ModelResponse, ...],
    jobs: int,
) -> StageForecast:
    """What is foretold with one of the stages. met : the responses of the model.

    Raises
    ------
    Unreachable : no parts make it.
    """
    with part(f"with the {kind} stage"):
        stated = with_stage(modelfile, kind)
        made = synthesis_result.synthesise(stated, catalog, jobs=jobs, announced=False, shown=met)
        return forecast(made, jobs)


def _foretold(*choice: Any) -> StageForecast | None:
    """``_of_stage``; None where no parts make it."""
    try:
        return _of_stage(*choice)
    except Unreachable:
        return None


def chosen(forecasts: Sequence[StageForecast]) -> Synthesis:
    """The design of the better one, with the reason."""
    first, *rest = forecasts
    for other in rest:
        first = other if other.better_than(first) else first
    others = [f.words for f in forecasts if f is not first]
    reasons = "; ".join(others) or "no parts were found for the other stage"
    return replace(first.synthesis, stage_reason=f"{first.words}; {reasons}")


def better_stage(modelfile: ModelFile, synthesis: Synthesis, jobs: int = 1) -> str:
    """What is said of a stage that the model file states while boards of the other one keep the
    responses more often, by more than chance; empty otherwise.

    synthesis : the design with the stated stage.
    """
    kept = kept_of_doubtful(modelfile, synthesis, jobs)
    return "" if kept is None else other_stage(modelfile, synthesis, kept, jobs)


def kept_of_doubtful(modelfile: ModelFile, synthesis: Synthesis, jobs: int = 1) -> int | None:
    """As ``boards_that_keep``, of a design with a stated stage beside which the other one is to be
    looked at; None where there is no other one, or no more that it could keep."""
    if modelfile.circuit.dead_zone is None or len(_able(modelfile)) < 2:
        return None
    kept = boards_that_keep(synthesis, jobs)
    return None if kept is None or not _differ(kept, BOARDS) else kept


def other_stage(modelfile: ModelFile, synthesis: Synthesis, kept: int, jobs: int = 1) -> str:
    """As ``better_stage``, where boards of the stated stage are known. kept : of them."""
    stated = modelfile.circuit.dead_zone
    (kind,) = (each for each in _able(modelfile) if each != stated)
    with part(f"with the {kind} stage"):
        try:
            there = with_stage(modelfile, kind), synthesis.catalog
            met = synthesis.model_responses
            other = synthesis_result.synthesise(*there, jobs=jobs, announced=False, shown=met)
            others = boards_that_keep(other, jobs)
        except (InputError, Unreachable):
            return ""
    if others is None or others <= kept or not _differ(kept, others):
        return ""
    parts, error = len(other.design.circuit.values), other.design.errors.max_error
    return (
        f"The file states the {stated} stage, and the other one keeps the responses more often. "
        f"Of the response that is lost most, {kept} of {BOARDS} boards keep it; with the {kind} "
        f"stage {others} of {BOARDS} (largest error {100 * error:.2g} %, {parts} parts). "
        f'circuit.dead_zone = "{kind}" takes that one.'
    )


def _able(modelfile: ModelFile) -> list[DeadZone]:
    """The stages that make the clearances of a model; none where it has none."""
    dead_zones = modelfile.model.second_order().dead_zones
    kinds: tuple[DeadZone, ...] = get_args(DeadZone) if dead_zones else ()
    return [kind for kind in kinds if stage_refusal(dead_zones, kind) is None]


def _differ(one: int, two: int) -> bool:
    """Whether two counts of ``BOARDS`` differ by more than chance."""
    shares = one / BOARDS, two / BOARDS
    chance = math.sqrt(sum(share * (1.0 - share) for share in shares) / BOARDS)
    return abs(shares[0] - shares[1]) > 2.0 * chance


def boards_that_keep(synthesis: Synthesis, jobs: int = 1) -> int | None:
    """Of ``BOARDS`` boards of a design, those that keep the response that the fewest keep; None
    without a response that the model shows with a period."""
    doing("boards of the stage")
    design = synthesis.design
    checked = [
        c
        for c in checked_design.check(design, synthesis.model_responses, None)
        if c.model.orbit.status is OrbitStatus.PERIODIC
    ]
    there = [c for c in checked if matches(c.circuit, c.model.spec)]
    if not checked:
        return None
    if len(there) < len(checked):
        return 0
    plan = plan_study(synthesis.modelfile, design, there, synthesis.catalog, samples=BOARDS, seed=0)
    drawn = draw_many(plan.circuit, plan.spread, plan.seed, range(BOARDS), STREAM)
    sample = Ensemble(plan.modelled(drawn), jobs=jobs)

    def kept_by(number: int, boards: range) -> int:
        question = plan.questions[number]
        asked = question, question.excitation, question.start.start
        cases: list[Case] = [(i, *asked) for i in boards]
        answers = settled(sample, cases, jobs, within=BRIEF)
        return sum(verdict is Verdict.OK for _, verdict, _ in answers)

    return least_kept(len(plan.questions), kept_by)


def least_kept(responses: int, kept_by: Callable[[int, range], int]) -> int:
    """Of ``BOARDS`` boards, those that keep the response that the fewest keep.

    kept_by : how many of these boards keep the response of this number. The response that the
    fewest have kept so far is asked of further boards: most others need not be asked of all.
    """
    asked, kept = [0] * responses, [0] * responses
    while True:
        k = min(range(responses), key=lambda each: (kept[each], -asked[each]))
        if asked[k] == BOARDS:
            return kept[k]
        boards = range(asked[k], min(asked[k] + FEW, BOARDS))
        kept[k] += kept_by(k, boards)
        asked[k] = boards.stop


def forecast(synthesis: Synthesis, jobs: int = 1) -> StageForecast:
    """What a few boards of a design show, and which rules its circuit fails."""
    kept = boards_that_keep(synthesis, jobs)
    try:
        outcomes = run_rules.on_circuit(RuleSubject.of(synthesis), synthesis.modelfile.rules)
    except InputError:  # no board can be made of it, which its own checks say
        return StageForecast(synthesis, kept)
    return StageForecast(replace(synthesis, outcomes=outcomes), kept)
