"""What the main job answers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from designer.base.frames import table_html
from designer.catalog.catalog import Catalog
from designer.check.checked_design import CheckedResponse
from designer.circuit.design import Design
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile
from designer.spice.equation_check import EquationCheck
from designer.yields.study import Study
from designer.yields.verdict import Answer, StudyPlan, Yield


@dataclass(frozen=True)
class RunResult:
    """Everything that ``run`` found."""

    modelfile: ModelFile
    """The model file."""
    catalog: Catalog
    """The catalogue."""
    found: tuple[ModelResponse, ...]
    """What the model shows of the wanted responses."""
    design: Design
    """The design."""
    checked: tuple[CheckedResponse, ...]
    """The wanted responses on all engines."""
    study: Study
    """The tolerance study."""
    provenance: dict[str, Any] = field(default_factory=dict)
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
        """For each response; None where it was left out of the study."""
        return self.study.yields

    def _repr_html_(self) -> str:
        return table_html(self.modelfile.title, self.study.yield_rows())

    @property
    def satisfied(self) -> bool:
        """Whether every wanted response was found, every engine shows it and can be trusted there,
        and the netlist computes the model's equation."""
        right = self.equations is None or self.equations.passed
        return right and all(c.model.found and c.agrees and c.trusted for c in self.checked)
