"""The main job as functions with typed results: what ``from designer import …`` offers.

Nothing here writes a file or prints; ``jobs.synthesise_job`` does the same with a design folder.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from designer.catalog.catalog import Catalog, load_catalog
from designer.check import checked_design
from designer.circuit.design import Design
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile, naming


@dataclass(frozen=True)
class Synthesis:
    """A model file, what its model shows, and the parts chosen for it."""

    modelfile: ModelFile
    catalog: Catalog
    found: tuple[ModelResponse, ...]
    design: Design
    seconds: float = 0.0


def synthesise(modelfile: ModelFile, catalog: Catalog | None = None) -> Synthesis:
    """Find the wanted responses on the model and choose the parts.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built.
    """
    began = time.perf_counter()
    catalog = modelfile.choices(load_catalog() if catalog is None else catalog)
    with naming(modelfile):
        found, design = checked_design.design_for(modelfile, catalog)
    return Synthesis(modelfile, catalog, found, design, time.perf_counter() - began)


synthesize = synthesise
"""The same in American spelling."""
