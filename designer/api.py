"""The main job as functions with typed results: what ``from designer import …`` offers.

Nothing here writes a file or prints; ``designer.job`` does the same with a design folder.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

from designer import equation_check, pipeline
from designer.catalog import Catalog, load_catalog
from designer.design import Design
from designer.equation_check import EquationCheck
from designer.modelfile import ModelFile
from designer.pipeline import Checked
from designer.preconditions import at_least, cores, naming, need_responses, require_ngspice
from designer.progress import Progress
from designer.responses import ModelResponse
from designer.study import SAMPLES, SEED, Study, tolerance
from designer.verdict import Answer, StudyPlan, Yield
from designer.workers import SpicePool


@dataclass(frozen=True)
class Synthesis:
    """A model file, what its model shows, and the parts chosen for it."""

    modelfile: ModelFile
    catalog: Catalog
    found: tuple[ModelResponse, ...]
    design: Design
    seconds: float = 0.0


@dataclass(frozen=True)
class RunResult:
    """Everything that ``run`` found."""

    modelfile: ModelFile
    catalog: Catalog
    found: tuple[ModelResponse, ...]
    design: Design
    checked: tuple[Checked, ...]
    study: Study
    provenance: dict[str, Any] = field(default_factory=dict)
    cost: dict[str, float] = field(default_factory=dict)
    equations: EquationCheck | None = None

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

    @property
    def satisfied(self) -> bool:
        """Whether every wanted response was found, every engine shows it and can be trusted there,
        and the netlist computes the model's equation."""
        right = self.equations is None or self.equations.passed
        return right and all(c.model.found and c.agrees and c.trusted for c in self.checked)


def synthesise(modelfile: ModelFile, catalog: Catalog | None = None) -> Synthesis:
    """Find the wanted responses on the model and choose the parts.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built.
    """
    began = time.perf_counter()
    catalog = load_catalog() if catalog is None else catalog
    catalog = catalog.mounted(modelfile.board.mounting)
    with naming(modelfile):
        found, design = pipeline.design_for(modelfile, catalog)
    return Synthesis(modelfile, catalog, found, design, time.perf_counter() - began)


def run(
    modelfile: ModelFile,
    catalog: Catalog | None = None,
    *,
    samples: int = SAMPLES,
    seed: int = SEED,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """The whole job in memory: synthesis, check in ngspice, tolerance study.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built.
    EnvironmentMissing : ngspice is missing.
    """
    need_responses(modelfile)
    jobs = cores() if jobs is None else jobs
    at_least("--jobs", jobs, 1)
    with SpicePool(jobs) as pool:
        require_ngspice(pool)
        made = synthesise(modelfile, catalog)
        equations = equation_check.check(made.design, made.found, pool)
        study = tolerance(made, samples=samples, seed=seed, jobs=jobs, pool=pool, progress=progress)
    return RunResult(
        made.modelfile,
        made.catalog,
        made.found,
        made.design,
        study.checked,
        study,
        equations=equations,
    )
