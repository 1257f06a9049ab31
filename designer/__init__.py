"""Op-amp circuits for mechanical models with clearances, and how many boards will work.

The public names below are imported when first used, so that worker processes and the command line
load only what they need.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from designer.api import (
        RunResult,
        Synthesis,
        run,
        synthesise,
    )
    from designer.catalog import Catalog, load_catalog
    from designer.errors import DesignerError, EnvironmentMissing, InputError, Unreachable
    from designer.model import Dimensionless, Mechanical
    from designer.modelfile import ModelFile, Response, parse_model_file, read_model_file
    from designer.simulation import Simulated, simulate
    from designer.study import Study, tolerance

__version__ = "0.1.0"

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
    "designer.api": (
        "RunResult",
        "Synthesis",
        "run",
        "synthesise",
    ),
    "designer.catalog": ("Catalog", "load_catalog"),
    "designer.errors": ("DesignerError", "EnvironmentMissing", "InputError", "Unreachable"),
    "designer.model": ("Dimensionless", "Mechanical"),
    "designer.modelfile": ("ModelFile", "Response", "parse_model_file", "read_model_file"),
    "designer.simulation": ("Simulated", "simulate"),
    "designer.study": ("Study", "tolerance"),
}


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
