"""The tolerance study of a design: which responses can be asked, and what became of each board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from designer.base.defaults import SAMPLES as SAMPLES, SEED as SEED
from designer.base.frames import frame, table_html
from designer.check.checked_design import CheckedResponse
from designer.yields import two_engine_yield as combined
from designer.yields.blame_analysis import Blame
from designer.yields.blame_status import BlameStatus
from designer.yields.joint_yield import all_on_one
from designer.yields.ngspice_sampling import Hearing
from designer.yields.power_up_yield import PowerUpAnswer
from designer.yields.start_recipe import Recipe
from designer.yields.trimmed_yield import Trimmed
from designer.yields.tuned_yield import Tuned
from designer.yields.two_engine_yield import Combined
from designer.yields.verdict import Answer, StudyPlan, Yield, count
from designer.yields.yield_maps import YieldMap

if TYPE_CHECKING:
    import pandas as pd

BOARD_COLUMNS = tuple(
    "sample board number omega expected verdict response reason radius penetration miss "
    "asymmetry periods waveform".split()
)
"""Of the table of boards."""


@dataclass(frozen=True)
class Study:
    """A tolerance study of wanted responses."""

    checked: tuple[CheckedResponse, ...]
    """The wanted responses on all engines."""
    plan: StudyPlan
    """What decides the samples."""
    asked: tuple[int, ...]
    """Index of the response that each question of the plan asks for."""
    left_out: dict[int, str]
    """Why a response is no question, by index."""
    answers: tuple[Answer, ...]
    """Rows of the boards as built."""
    heard: tuple[Hearing, ...] = ()
    """What ngspice said about boards of the study."""
    until: float | None = None
    """Width of the intervals that was asked for; None for none."""
    narrow: bool | None = None
    """Whether every interval is narrower (None where no width was asked for)."""
    tuned: tuple[Tuned, ...] | None = None
    """Rows of the boards with the generator tuned; None where these were not asked for."""
    trimmed: tuple[Trimmed, ...] | None = None
    """Rows of the boards with the trimmer set; None where no trimmer is fitted."""
    reached: tuple[PowerUpAnswer, ...] | None = None
    """Rows of the boards powered up; None where these were not asked for."""
    recipes: tuple[Recipe, ...] | None = None
    """Recipes of power-up, one for each question."""
    blame: Blame | None = None
    """The blame by question; None where none was asked for."""
    maps: tuple[YieldMap, ...] = ()
    """Yield maps of questions; empty where none were asked for."""
    blame_wanted: bool = True
    """Whether a blame was asked for."""

    def answers_to(self, index: int) -> tuple[Answer, ...]:
        """The answers for response number ``index``, by sample."""
        return self._answers.get(index, ())

    def heard_of(self, index: int) -> tuple[Hearing, ...]:
        """What ngspice said about response number ``index``, by sample."""
        return tuple(h for h in self.heard if self.asked[h.question] == index)

    def tuned_of(self, index: int) -> tuple[Tuned, ...]:
        """The rows of the tuned layer of response number ``index``."""
        return tuple(t for t in self.tuned or () if self.asked[t.question] == index)

    def trimmed_of(self, index: int) -> tuple[Trimmed, ...]:
        """The rows of the trimmed layer of response number ``index``."""
        return tuple(t for t in self.trimmed or () if self.asked[t.question] == index)

    def reached_of(self, index: int) -> tuple[PowerUpAnswer, ...]:
        """The rows of the reached layer of response number ``index``."""
        return tuple(r for r in self.reached or () if self.asked[r.question] == index)

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
        index = self.asked[answer.question]
        model = self.checked[index].model
        values = asdict(answer) | {
            "board": self.plan.label(answer.sample) if self.plan.labels else None,
            "number": index + 1,
            "omega": model.omega,
            "expected": model.expected,
            "verdict": str(answer.verdict),
        }
        return {name: values[name] for name in BOARD_COLUMNS}

    def yield_rows(self) -> list[dict[str, Any]]:
        """The rows of ``yields_table``."""
        rows = []
        for index, (checked, counted) in enumerate(zip(self.checked, self.yields, strict=True)):
            model = checked.model
            head = {"number": index + 1, "omega": model.omega, "expected": model.expected}
            rows.append({**head, **_counts(counted), "left_out": self.left_out.get(index, "")})
        return rows

    def _repr_html_(self) -> str:
        return table_html(f"{self.plan.samples} boards, as built", self.yield_rows())

    @property
    def yields(self) -> tuple[Yield | None, ...]:
        """For each response; None where it was left out."""
        return tuple(
            count(self.answers_to(i), self.plan.census) if i in self.asked else None
            for i in range(len(self.checked))
        )

    @cached_property
    def combined(self) -> tuple[Combined | None, ...]:
        """For each response: both engines together; None where ngspice has no answer."""
        return tuple(
            combined.combine(
                self.answers_to(i),
                self.heard_of(i),
                self.plan.questions[self.asked.index(i)],
                census=self.plan.census,
            )
            if i in self.asked
            else None
            for i in range(len(self.checked))
        )

    @property
    def blame_status(self) -> BlameStatus:
        """How much of the blame there is."""
        return BlameStatus.of(self.blame, self.blame_wanted and bool(self.asked))

    @property
    def all_on_one_board(self) -> Yield | None:
        """Boards that show every response as built; None unless there are two at least and each
        was asked."""
        return self._on_one(self.answers)

    @property
    def all_tuned(self) -> Yield | None:
        """The same with the generator free within the bands, for each response its own."""
        return self._on_one(self.tuned)

    @property
    def all_trimmed(self) -> Yield | None:
        """The same with the trimmer at its one setting, the generator as built."""
        return self._on_one(self.trimmed)

    @property
    def all_reached(self) -> Yield | None:
        """The same from power-up by the recipes."""
        return self._on_one(self.reached)

    def _on_one(
        self, rows: Sequence[Answer | Tuned | Trimmed | PowerUpAnswer] | None
    ) -> Yield | None:
        if not rows or len(self.asked) < max(len(self.checked), 2):
            return None
        return all_on_one(rows, self.plan.census)

    @cached_property
    def _answers(self) -> dict[int, tuple[Answer, ...]]:
        by: dict[int, list[Answer]] = {index: [] for index in self.asked}
        for a in self.answers:
            by[self.asked[a.question]].append(a)
        return {index: tuple(rows) for index, rows in by.items()}


def _counts(counted: Yield | None) -> dict[str, Any]:
    """The counts of a yield, and its rate; None where it was not asked."""
    names = ("ok", "lost", "grazing", "failed", "samples", "rate")
    if counted is None:
        return dict.fromkeys((*names, "low", "high"))
    low, high = counted.interval
    return {**{name: getattr(counted, name) for name in names}, "low": low, "high": high}
