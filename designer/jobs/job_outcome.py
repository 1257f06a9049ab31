"""What the verbs answer that make a design: the answer, and the design and the study behind it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.errors import MISSING, InputError
from designer.base.frames import flat_frame, table_html
from designer.board.bom import bill_of_materials
from designer.check.synthesis_result import Synthesis
from designer.circuit.design import Design
from designer.folders.design_source import read_design

if TYPE_CHECKING:
    import pandas as pd

    from designer.jobs.study_stage import Place
    from designer.yields.study import RunResult, Study


@dataclass(frozen=True)
class JobOutcome:
    """What ``synthesise``, ``tolerance``, ``run`` and ``search`` answer.

    What was not computed now is read from the folder when it is asked for.
    """

    answer: Any
    """The JSON object (docs/contract.md), as ``answers`` has its type."""
    satisfied: bool
    """Whether the answer is yes."""
    folder: Path | None = None
    """The design folder; None where nothing was to be written."""
    reused: bool = False
    """Whether the folder held the answer already."""
    made: Synthesis | None = None
    """The design, where it was made or read; ``synthesis`` has it always."""
    result: RunResult | None = None
    """The study with all that went into it, where it was made now."""
    place: Place | None = None
    """Where in the folder the study is; None: ``study_stage.RANDOM``."""
    shown: bool = False
    """Whether what stands in the answer beside attribution and maps was shown before they were
    worked out."""

    @cached_property
    def synthesis(self) -> Synthesis:
        """The model file, what its model shows, and the design."""
        if self.made is not None:
            return self.made
        assert self.folder is not None
        return read_design(self.folder)

    @property
    def design(self) -> Design:
        """The chosen parts."""
        return self.synthesis.design

    @cached_property
    def study(self) -> Study:
        """The tolerance study; of one that was not made now, what the exact circuit says.

        Raises
        ------
        InputError : there is none.
        """
        if self.result is not None:
            return self.result.study
        if self.folder is None:
            raise InputError(None, "the study", MISSING, "a verb that makes one, such as tolerance")
        from designer.jobs.study_stage import RANDOM, read_study

        return read_study(self.folder, self.synthesis, self.place or RANDOM)

    def bom(self) -> pd.DataFrame:
        """The bill of materials: a row for each part to buy, as in ``bom.csv``."""
        return bill_of_materials(self.synthesis)

    def boards(self) -> pd.DataFrame:
        """A row for each board and response of the study."""
        return self.study.boards()

    def yields(self) -> pd.DataFrame:
        """A row for each response of the study: counts, rate and its interval."""
        return self.study.yields_table()

    def responses(self) -> pd.DataFrame:
        """A row for each response of the answer; of what a yield has, columns such as
        "yield.ok"."""
        return flat_frame(self.answer.get("responses", ()))

    def _repr_html_(self) -> str:
        title = str(self.answer.get("title", ""))
        if "responses" not in self.answer:
            return self.synthesis._repr_html_()
        names = ("omega", "expected", "model", "circuit", "ngspice")
        rows = [
            {**{n: row.get(n) for n in names}, "ok": row["yield"]["ok"]}
            for row in self.answer["responses"]
            if row.get("yield")
        ]
        return table_html(title, rows)
