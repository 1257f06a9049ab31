"""Op-amp circuits for mechanical models with clearances, and how many boards will work.

The public names below are imported when first used, so that worker processes and the command line
load only what they need.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from designer.base.errors import DesignerError, EnvironmentMissing, InputError, Unreachable
    from designer.catalog.catalog import Catalog, load_catalog
    from designer.check.simulation import Simulated, simulate
    from designer.check.synthesis_result import Synthesis, synthesise
    from designer.jobs.study_job import run
    from designer.model.model import Dimensionless, Mechanical
    from designer.model.model_file import ModelFile, parse_model_file, read_model_file
    from designer.model.response_table import Response
    from designer.yields.run_result import RunResult
    from designer.yields.study import Study
    from designer.yields.tolerance_study import tolerance


__all__ = [
    "Catalog",
    "DesignerError",
    "Dimensionless",
    "EnvironmentMissing",
    "InputError",
    "Mechanical",
    "ModelFile",
    "Response",
    "RunResult",
    "Simulated",
    "Study",
    "Synthesis",
    "Unreachable",
    "load_catalog",
    "parse_model_file",
    "read_model_file",
    "run",
    "simulate",
    "synthesise",
    "tolerance",
]

_HOMES = {
    "designer.check.synthesis_result": ("Synthesis", "synthesise"),
    "designer.jobs.study_job": ("run",),
    "designer.catalog.catalog": ("Catalog", "load_catalog"),
    "designer.base.errors": ("DesignerError", "EnvironmentMissing", "InputError", "Unreachable"),
    "designer.model.model": ("Dimensionless", "Mechanical"),
    "designer.model.model_file": ("ModelFile", "Response", "parse_model_file", "read_model_file"),
    "designer.check.simulation": ("Simulated", "simulate"),
    "designer.yields.run_result": ("RunResult",),
    "designer.yields.study": ("Study",),
    "designer.yields.tolerance_study": ("tolerance",),
}


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
