"""The tolerance study of a design: which responses are asked, and what became of each board."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from designer.base.defaults import SAMPLES as SAMPLES, SEED as SEED
from designer.base.frames import frame, table_html
from designer.base.reason import Reason
from designer.catalog.parts_catalog import Catalog
from designer.check.checked_design import CheckedResponse
from designer.check.trust import Trust
from designer.circuit.design import Design
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile
from designer.spice.equation_check import EquationCheck
from designer.verdicts.cross_check import CrossCheck
from designer.verdicts.verdict import Answer, BoardRow, StudyPlan
from designer.yields import two_engine_yield
from designer.yields.loss_attribution import Attribution, AttributionStatus
from designer.yields.power_up import PowerUp
from designer.yields.rare_losses import AnyLost, RareLosses
from designer.yields.start_recipe import Recipe
from designer.yields.trimmed_yield import Trimmed
from designer.yields.tuned_yield import Tuned
from designer.yields.two_engine_yield import Combined
from designer.yields.yield_count import Yield, all_on_one, count
from designer.yields.yield_maps import YieldMap

if TYPE_CHECKING:
    import pandas as pd

    from designer.answers.shared_rows import ProvenanceRow
    from designer.yields.row_store import Row

BOARD_COLUMNS = tuple(
    "sample board number omega expected verdict response reason radius penetration miss "
    "asymmetry periods waveform".split()
)
"""The columns of the table of boards."""
_COUNTS = ("ok", "lost", "grazing", "failed", "samples", "rate")


@dataclass(frozen=True)
class Study:
    """A tolerance study of wanted responses."""

    checked: tuple[CheckedResponse, ...]
    """The wanted responses on all engines."""
    plan: StudyPlan
    """What decides the samples."""
    response_indices: tuple[int, ...]
    """Index of the response that each question of the plan asks for."""
    left_out: dict[int, str]
    """Why a response is no question, by index."""
    answers: tuple[Answer, ...]
    """Rows of the boards as built."""
    cross_checks: tuple[CrossCheck, ...] = ()
    """What ngspice answered about boards of the study."""
    not_asked: tuple[int, ...] = ()
    """Boards of each question that a limit of steps leaves out (``cross_check.affordable``); empty
    without ngspice."""
    until: float | None = None
    """Width of the intervals that was asked for; None for none."""
    narrow: bool | None = None
    """Whether every interval is narrower (None where no width was asked for)."""
    tuned: tuple[Tuned, ...] | None = None
    """Rows of the boards with the generator tuned; None where these were not asked for."""
    trimmed: tuple[Trimmed, ...] | None = None
    """Rows of the boards with the trimmer set; None where no trimmer is fitted."""
    power_ups: tuple[PowerUp, ...] | None = None
    """Rows of the boards powered up; None where these were not asked for."""
    recipes: tuple[Recipe, ...] | None = None
    """Recipes of power-up, one for each question."""
    blame: Attribution | None = None
    """The attribution by question; None where none was asked for."""
    maps: tuple[YieldMap, ...] = ()
    """Yield maps of questions; empty where none were asked for."""
    rare: tuple[RareLosses, ...] = ()
    """Estimates by boards that are drawn where they are lost; empty where none were asked for."""
    blame_wanted: bool = True
    """Whether an attribution was asked for."""
    seconds: Mapping[str, float] = field(default_factory=dict, compare=False)
    """Wall time of each part of the work [s], as far as it has gone."""

    def answers_to(self, index: int) -> tuple[Answer, ...]:
        """The answers for response number ``index``, by sample."""
        return self._answers.get(index, ())

    def rows_of(self, index: int, rows: Sequence[Row] | None) -> tuple[Row, ...]:
        """The rows of a layer that are about response number ``index``, by sample."""
        return tuple(row for row in rows or () if self.response_indices[row.question] == index)

    def boards(self) -> pd.DataFrame:
        """A row for each board and response, as built.

        ``sample``, ``board`` (its name in a list of measured boards, else None), ``number`` of the
        response in the model file, from 1, ``omega``, ``expected``, and what ``Answer`` has.
        """
        return frame(map(self._board, self.answers), BOARD_COLUMNS)

    def yields_table(self) -> pd.DataFrame:
        """A row for each response: ``number``, ``omega``, ``expected``, counts of boards as built,
        ``rate`` and its 95 % interval ``low`` to ``high``, and why it was ``left_out``."""
        return frame(self.yield_rows())

    def _board(self, answer: Answer) -> dict[str, Any]:
        index = self.response_indices[answer.question]
        values = asdict(answer) | self._head(index) | {"verdict": str(answer.verdict)}
        values["board"] = self.plan.label(answer.sample) if self.plan.labels else None
        return {name: values[name] for name in BOARD_COLUMNS}

    def _head(self, index: int) -> dict[str, Any]:
        model = self.checked[index].model
        return {"number": index + 1, "omega": model.omega, "expected": model.expected}

    def yield_rows(self) -> list[dict[str, Any]]:
        """The rows of ``yields_table``."""
        rows = []
        for index, counted in enumerate(self.yields):
            low, high = (None, None) if counted is None else counted.interval
            counts = {name: getattr(counted, name, None) for name in _COUNTS}
            left_out = self.left_out.get(index, "")
            rows.append(
                {**self._head(index), **counts, "low": low, "high": high, "left_out": left_out}
            )
        return rows

    def _repr_html_(self) -> str:
        return table_html(f"{self.plan.samples} boards, as built", self.yield_rows())

    @property
    def yields(self) -> tuple[Yield | None, ...]:
        """The yield of each response; None where it was left out."""
        return tuple(
            count(self.answers_to(i), self.plan.census) if i in self.response_indices else None
            for i in range(len(self.checked))
        )

    @cached_property
    def combined(self) -> tuple[Combined | None, ...]:
        """Both engines' estimate of each response; None where ngspice has no answer."""
        return tuple(
            two_engine_yield.combine(
                self.answers_to(i),
                self.rows_of(i, self.cross_checks),
                self.plan.questions[self.response_indices.index(i)],
                census=self.plan.census,
            )
            if i in self.response_indices
            else None
            for i in range(len(self.checked))
        )

    def not_asked_of(self, index: int) -> int:
        """Boards of response number ``index`` that a limit of steps leaves out."""
        return dict(zip(self.response_indices, self.not_asked, strict=False)).get(index, 0)

    def rare_of(self, index: int) -> RareLosses | None:
        """The estimate for response number ``index``, if there is one."""
        return next((r for r in self.rare if self.response_indices[r.question] == index), None)

    @property
    def any_lost(self) -> AnyLost | None:
        """How many boards lose one response at least; None unless there are two at least and each
        has an estimate."""
        if len(self.rare) < max(len(self.checked), 2):
            return None
        return AnyLost.of(self.rare)

    @property
    def blame_status(self) -> AttributionStatus:
        """How much of the attribution there is."""
        return AttributionStatus.of(self.blame, self.blame_wanted and bool(self.response_indices))

    @property
    def all_on_one_board(self) -> Yield | None:
        """Boards that show every response as built; as ``on_one_board``."""
        return self.on_one_board(self.answers)

    def on_one_board(self, rows: Sequence[BoardRow] | None) -> Yield | None:
        """Boards that show every response by these rows of a layer; None unless there are two
        responses at least and each was asked."""
        if not rows or len(self.response_indices) < max(len(self.checked), 2):
            return None
        return all_on_one(rows, self.plan.census)

    @cached_property
    def _answers(self) -> dict[int, tuple[Answer, ...]]:
        by: dict[int, list[Answer]] = {index: [] for index in self.response_indices}
        for a in self.answers:
            by[self.response_indices[a.question]].append(a)
        return {index: tuple(rows) for index, rows in by.items()}


def trust_of_yield(counted: Yield, nominal: Trust) -> Trust:
    """The trust in a yield. It is not better than that in the nominal orbit on which each board
    starts, and doubted where so many boards have no answer that they could move the yield out of
    its interval."""
    doubts = [Reason(f"the nominal response: {d.words}", d.figures) for d in nominal.doubts]
    if counted.failed:
        least = counted.ok / counted.samples
        most = (counted.ok + counted.failed) / counted.samples
        low, high = counted.interval
        if counted.failed == counted.samples or least < low or most > high:
            # Counts of boards, which the study's rows have: no measured figures.
            reason = (
                f"{counted.failed} of {counted.samples} boards have no answer; whatever they "
                f"were, the yield lies between {100 * least:.3g} and {100 * most:.3g} %"
            )
            doubts.append(Reason(reason))
    return Trust(error=nominal.error, doubts=tuple(doubts), answered=True)


@dataclass(frozen=True)
class RunResult:
    """What the main job answers."""

    modelfile: ModelFile
    catalog: Catalog
    """The catalogue."""
    model_responses: tuple[ModelResponse, ...]
    """What the model shows of the wanted responses."""
    design: Design
    checked: tuple[CheckedResponse, ...]
    """The wanted responses on all engines."""
    study: Study
    """The tolerance study."""
    provenance: ProvenanceRow
    """Versions, seed and settings."""
    cost: dict[str, float] = field(default_factory=dict)
    """Wall times [s] by stage."""
    equations: EquationCheck | None = None
    """The equation check; None where it was not made."""

    @property
    def plan(self) -> StudyPlan:
        return self.study.plan

    @property
    def answers(self) -> tuple[Answer, ...]:
        return self.study.answers

    @property
    def yields(self) -> tuple[Yield | None, ...]:
        """The yield of each response; None where the study left it out."""
        return self.study.yields

    def _repr_html_(self) -> str:
        return table_html(self.modelfile.title, self.study.yield_rows())
