"""Where a result comes from: versions, seed, settings, hashes. Never a time or a path."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from designer.base.errors import EnvironmentMissing
from designer.base.version import __version__
from designer.model.model_file import ModelFile

if TYPE_CHECKING:
    from designer.answers.shared_rows import ProvenanceRow

LIBRARIES = {
    "numpy": "numpy",
    "scipy": "scipy",
    "cvxpy": "cvxpy",
    "highs": "highspy",
    "numba": "numba",
    "pyspice": "PySpice",
}


def versions() -> dict[str, str | None]:
    """Versions of everything that a result depends on; None for what is not installed."""
    tool = {"designer": __version__, "python": platform.python_version()}
    libraries = {name: _version(distribution) for name, distribution in LIBRARIES.items()}
    return {**tool, **libraries, "ngspice": _ngspice()}


def provenance(
    modelfile: ModelFile,
    catalog_hash: str,
    *,
    seed: int | None = None,
    settings: Mapping[str, Any] | None = None,
    spread: Mapping[str, Any] | None = None,
) -> ProvenanceRow:
    """The object ``provenance`` of a JSON file.

    seed : None where no random number enters. settings : of the solvers that were used.
    """
    return {
        "versions": versions(),
        "seed": seed,
        "settings": dict(settings or {}),
        "catalogue_sha256": catalog_hash,
        "model_sha256": modelfile.sha256,
        "spread": None if spread is None else dict(spread),
    }


def _version(distribution: str) -> str | None:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return None


def _ngspice() -> str | None:
    from designer.spice.batch_backend import program_version

    try:
        return program_version()
    except EnvironmentMissing:
        return None
