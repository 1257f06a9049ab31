"""The studies of a repair: fresh boards, as many as it takes to tell on which side of the target a
yield is. Where so few may be lost that counting does not tell, they are drawn where they are lost
(``yields.rare_losses``). All are stored, so that interrupted work goes on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, astuple, dataclass, replace
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import bdtrc

from designer.base.guarded_reading import UNREADABLE
from designer.base.plain_json import plain
from designer.base.progress import doing
from designer.base.proportion import TAIL, mid_p
from designer.base.record_check import read_record
from designer.check import checked_design
from designer.check.synthesis_result import Synthesis
from designer.dynamics.orbit import OrbitStatus
from designer.model.find_responses import ModelResponse
from designer.model.tuning_bands import Bands
from designer.spread.part_rules import spread_of
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import BLOCK, Question, StudyPlan, Verdict
from designer.yields.rare_losses import rare_losses, unseen_share
from designer.yields.stored_parts import AnswerLog, GivenAnswers, StoredParts
from designer.yields.study_identity import study_hash
from designer.yields.trimmed_yield import DcTrim, trimmed_answers
from designer.yields.tuned_yield import benched_block
from designer.yields.yield_count import Yield

if TYPE_CHECKING:
    from designer.answers.cure_answer import MeasuredYieldRow, RareShareKey

MOST = 8000
"""Boards of a study at which it gives up."""
FIRST, LOST = 50, 20
"""Boards after which a study may end because the target is missed, and the lost boards by which
it then knows their share well enough (to a quarter of it): lost boards are the dear ones."""
MOST_PLAIN, PLAIN_BLOCK = 400_000, 10_000
"""Boards drawn as they are by which a share is bounded of which no search met a loss, and how many
are asked together."""
TAG = 0xC04E
"""Sets the boards of a repair apart from those of a study with the same seed."""
VERDICTS = {"o": Verdict.OK, "l": Verdict.LOST, "g": Verdict.GRAZING, "f": Verdict.FAILED}
_LETTERS = {verdict: letter for letter, verdict in VERDICTS.items()}
_RARE = "rare"
"""Takes the place of a block's number where a study was estimated."""
_ANSWERS = "answers"
"""Takes it while the estimate is under way."""


@dataclass(frozen=True)
class RareShare:
    """The share of boards that lose a response, from boards drawn where they are lost."""

    lost: float
    """The estimate."""
    low: float
    """Lower end of its 95 % interval."""
    high: float
    """Upper end; where no board was lost, ``unseen``."""
    unseen: float
    """A region that no search met may hold this share at most, by 95 %."""
    boards: int
    """Boards that were asked."""


def study_seed(seed: int, number: int) -> int:
    """The seed of study ``number`` of a repair: boards that no other one has seen."""
    return int(np.random.SeedSequence([seed, number, TAG]).generate_state(1)[0])


def questions_of(synthesis: Synthesis, responses: Sequence[ModelResponse]) -> list[Question | None]:
    """The question that the boards of a design are asked for each response; None where the model or
    the nominal circuit does not show the response."""
    checked = checked_design.check(synthesis.design, responses, None)
    return [
        Question(c.model.spec, c.excitation, c.circuit, None)
        if c.model.found and c.circuit.status is OrbitStatus.PERIODIC
        else None
        for c in checked
    ]


def plan_of(synthesis: Synthesis, question: Question, seed: int) -> StudyPlan:
    """The study of one response of a design, boards as its model file says."""
    circuit = synthesis.design.circuit
    spread = spread_of(synthesis.modelfile, circuit, synthesis.catalog)
    return StudyPlan(circuit, spread, seed, MOST, (question,))


class VerdictCache:
    """Verdicts that are known, by study and by block of boards: one letter a board.

    save : called with everything after each block.
    """

    def __init__(
        self,
        studies: Mapping[str, Mapping[str, Any]] | None = None,
        save: Callable[[dict[str, Any]], None] = lambda _: None,
    ) -> None:
        self._known = {
            study: {place: found for place, found in blocks.items() if _is_stored(place, found)}
            for study, blocks in (studies or {}).items()
        }
        self._save = save

    def block(
        self, plan: StudyPlan, indices: range, trim: float | DcTrim | None, jobs: int
    ) -> tuple[str, bool]:
        """The letters of these boards, and whether they had to be found.

        trim : each board's DC offset is trimmed by the bench procedure within this band, or its
        own trimmer is set.
        """
        bands = Bands(0.0, 0.0, trim) if isinstance(trim, float) else None
        layer, more = "samples", dict[str, Any]()
        if bands is not None:
            layer, more = "tuned", {"bands": bands.as_dict()}
        elif isinstance(trim, DcTrim):
            layer, more = "trimmed", trim.as_dict()
        study, place = study_hash(plan, layer, more), str(indices.start)
        letters = self._known.get(study, {}).get(place, "")
        if len(letters) >= len(indices):
            return letters[: len(indices)], False
        if isinstance(trim, DcTrim):
            answers, _ = trimmed_answers(trim, plan, indices, jobs)
        else:
            answers = exact_circuit.block(plan, indices, jobs)
        verdicts = [a.verdict for a in answers]
        if bands is not None:
            verdicts = benched_block(plan, indices, answers, bands, jobs)
        letters = "".join(_LETTERS[v] for v in verdicts)
        self._known.setdefault(study, {})[place] = letters
        self._save_all()
        return letters, True

    def rare(
        self, plan: StudyPlan, bound: float | None, jobs: int, progress: Callable[[], None]
    ) -> RareShare:
        """How many boards of a plan of one question lose the response, estimated once.

        bound : as ``rare_losses`` has it."""
        study = self._known.setdefault(study_hash(plan, "rare", {"bound": bound}), {})
        if _RARE not in study:
            log = AnswerLog(_EstimateParts(study, self._save_all), _ANSWERS)
            found = rare_losses(plan, 0, bound=bound, jobs=jobs, progress=progress, log=log)
            study.pop(_ANSWERS, None)
            boards = found.boards + found.pilots
            share = RareShare(found.lost, found.low, found.high, found.unseen, boards)
            study[_RARE] = asdict(share)
            self._save_all()
        return RareShare(**study[_RARE])

    def _save_all(self) -> None:
        self._save({"format": 1, "studies": self._known})


class _EstimateParts(StoredParts):
    """What boards of an estimate answered, in its study's entry."""

    def __init__(self, study: dict[str, Any], save: Callable[[], None]) -> None:
        self._study, self._save = study, save

    def get(self, name: str) -> GivenAnswers | None:
        stored = self._study.get(name)
        return None if stored is None else read_record(GivenAnswers, stored)

    def put(self, values: Mapping[str, Any]) -> None:
        self._study.update({name: asdict(answers) for name, answers in values.items()})
        self._save()


def _is_stored(place: str, found: Any) -> bool:
    try:
        if place == _ANSWERS:
            read_record(GivenAnswers, found)
            return True
        if place == _RARE:
            share = read_record(RareShare, found)
            return all(0.0 <= value < float("inf") for value in astuple(share))
    except UNREADABLE:
        return False
    return isinstance(found, str) and set(found) <= set(_LETTERS.values())


@dataclass(frozen=True)
class MeasuredYield:
    """A yield, and whether its 95 % interval says on which side of the target it is."""

    counts: Yield
    """Counts of boards and of those that keep the response."""
    target: float
    """The yield that is wanted."""
    rare: RareShare | None = None
    """What was estimated beyond the counts."""

    @property
    def rate(self) -> float:
        """The yield; 0 where nothing was decided."""
        if self.rare is not None:
            return 1.0 - self.rare.lost
        return self.counts.rate if self.counts.samples > self.counts.failed else 0.0

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the yield's 95 % interval."""
        if self.rare is not None:
            return 1.0 - self.rare.high, 1.0 - self.rare.low
        if is_rare(self.target):  # hardly a board is lost
            return mid_p(self.counts.ok, self.counts.samples - self.counts.failed)
        return self.counts.interval

    @property
    def reached(self) -> bool:
        """The whole interval is at the target or above."""
        return self.interval[0] >= self.target

    @property
    def missed(self) -> bool:
        """The whole interval is below the target."""
        return self.interval[1] < self.target

    @property
    def decided(self) -> bool:
        """Whether more boards would not change the answer."""
        return self.reached or self.missed

    def bounded(self, plain: Yield) -> MeasuredYield:
        """The same with what other boards, drawn as they are, leave for losses that no search
        met. Where more of them are lost than the estimate has room for, they are the measure."""
        if self.rare is None:
            return self
        lost, asked = plain.lost + plain.grazing, plain.samples - plain.failed
        if bdtrc(lost - 1, asked, self.rare.high) < TAIL:
            return replace(self, counts=plain, rare=None)
        left = unseen_share(lost, asked)
        return replace(self, rare=replace(self.rare, unseen=min(left, self.rare.unseen)))

    def as_dict(self) -> MeasuredYieldRow:
        """Plain data for JSON."""
        low, high = self.interval
        rate = self.counts.rate if self.rare is None else self.rate
        more: RareShareKey = {} if self.rare is None else {"rare": plain(self.rare)}
        return {**self.counts.counts, "rate": rate, "low": low, "high": high, **more}


def is_rare(target: float) -> bool:
    """Whether so few boards may be lost that no count of ``MOST`` shows that the target is reached,
    though none of them is lost."""
    return Yield(MOST, 0, 0, 0).interval[0] < target


def measure(
    plan: StudyPlan,
    target: float,
    verdict_cache: VerdictCache,
    *,
    trim: float | DcTrim | None = None,
    least: int = 2 * BLOCK,
    most: int = MOST,
    first: int | None = None,
    block: int = BLOCK,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> MeasuredYield:
    """The yield of a plan of one question on ``least`` boards, and on more until it is decided.

    most : boards at which it gives up. first : boards after which, and after each block from there,
    it ends where the target is missed and ``LOST`` boards are lost; None: never before ``least``.
    block : boards that are asked together. progress : called once a block.
    """
    letters, result, most = "", MeasuredYield(Yield(0, 0, 0, 0), target), max(least, most)
    while len(letters) < least or (len(letters) < most and not result.decided):
        lost = result.counts.lost + result.counts.grazing
        if first is not None and result.missed and lost >= LOST:
            break
        stop = (len(letters) // block + 1) * block
        if not letters and first is not None:
            stop = first
        indices = range(len(letters), min(stop, most))
        letters += verdict_cache.block(replace(plan, samples=most), indices, trim, jobs)[0]
        result = MeasuredYield(Yield(*(letters.count(letter) for letter in VERDICTS)), target)
        shown = plan.questions[0].wanted.expect
        doing(f"{result.counts.ok} of {len(letters)} boards show {shown or 'the response'}")
        progress()
    return result


def measure_all(
    plans: Sequence[tuple[StudyPlan, float | DcTrim | None] | None],
    target: float,
    verdict_cache: VerdictCache,
    *,
    whole: bool = False,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> tuple[MeasuredYield, ...]:
    """The yields of several responses that all have to reach the target.

    One block of boards each. Once a response has missed the target the choice is out, whatever
    becomes of the others: only those that miss it are asked on more boards, for their share. Where
    the target is rare (``is_rare``), the share of what none of the block has lost is estimated.

    plans : each with what its boards are trimmed by (``VerdictCache.block``), None: as built; None
    where there is no response to ask for, which misses. whole : an estimate does not end as soon as
    it lies on one side of the target.
    """
    measured = [MeasuredYield(Yield(0, 0, 0, 0), target) for _ in plans]
    for least, most in ((BLOCK, BLOCK), (2 * BLOCK, MOST)):
        for k, study in enumerate(plans):
            out = None in plans or any(m.missed for m in measured)
            if most > BLOCK and out and not measured[k].missed:
                continue
            if study is None:
                continue
            plan, trim = study
            if most > BLOCK and is_rare(target) and not measured[k].missed:
                assert trim is None, "boards that are trimmed are counted"
                measured[k] = _estimated(plan, measured[k], verdict_cache, whole, jobs, progress)
            else:
                measured[k] = measure(
                    plan, target, verdict_cache, trim=trim, least=least, most=most, first=FIRST,
                    jobs=jobs, progress=progress,
                )  # fmt: skip
    return tuple(measured)


def telling(target: float) -> int:
    """Boards drawn as they are that tell whether a target is reached, where none of them is lost;
    ``MOST_PLAIN`` at most."""
    return min(ceil(unseen_share(0, 1) / (1.0 - target)), MOST_PLAIN)


def _estimated(
    plan: StudyPlan,
    counted: MeasuredYield,
    verdict_cache: VerdictCache,
    whole: bool,
    jobs: int,
    progress: Callable[[], None],
) -> MeasuredYield:
    """A yield whose losses are too rare to be counted.

    Where no search met a loss, boards drawn as they are bound the share, as many as the target
    takes; a loss among them is one that the searches did not meet: then these boards decide.
    """
    rare = verdict_cache.rare(plan, None if whole else 1.0 - counted.target, jobs, progress)
    if rare.lost > 0.0 or 1.0 - rare.high >= counted.target:
        return replace(counted, rare=rare)
    drawn = unseen_share(0, 1) / rare.unseen
    plain = measure(
        plan, counted.target, verdict_cache, block=PLAIN_BLOCK, jobs=jobs, progress=progress,
        least=ceil(telling(counted.target) - drawn), most=MOST_PLAIN,
    ).counts  # fmt: skip
    if plain.lost + plain.grazing:
        return replace(counted, counts=plain)
    bound = unseen_share(0, plain.ok + drawn)
    boards = rare.boards + plain.samples
    return replace(counted, rare=replace(rare, high=bound, unseen=bound, boards=boards))
