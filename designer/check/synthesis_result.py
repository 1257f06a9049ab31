"""The main job as functions with typed results: what ``from designer import …`` offers.

Nothing here writes a file or prints; ``jobs.synthesise_job`` does the same with a design folder.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from designer.base.frames import table_html
from designer.catalog.catalog import Catalog, load_catalog
from designer.circuit.design import Design, settings
from designer.model.find_responses import ModelResponse, find, peaks
from designer.model.model_file import ModelFile, naming
from designer.spread.part_rules import check_names, spread_of
from designer.synthesis import parts_choice
from designer.synthesis.part_checks import check_choices, unit_circuit


@dataclass(frozen=True)
class Synthesis:
    """A model file, what its model shows, and the parts chosen for it."""

    modelfile: ModelFile
    """The model file."""
    catalog: Catalog
    """The catalogue that parts were chosen from."""
    model_responses: tuple[ModelResponse, ...]
    """The wanted responses as the model shows them."""
    design: Design
    """The parts chosen for it."""
    seconds: float = 0.0
    """Wall time [s]."""

    def _repr_html_(self) -> str:
        responses = self.model_responses
        rows = [
            {
                "omega": r.omega,
                "expected": r.expected,
                "model": r.orbit.response,
                "frequency_hz": s.frequency_hz,
                "amplitude_v_peak": s.amplitude_v_peak,
            }
            for r, s in zip(responses, settings(self.design, responses), strict=True)
        ]
        note = f"largest coefficient error {self.design.errors.max_error:.3g}"
        return table_html(self.modelfile.title, rows, note)


def synthesise(modelfile: ModelFile, catalog: Catalog | None = None) -> Synthesis:
    """Find the wanted responses on the model and choose the parts.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built.
    """
    began = time.perf_counter()
    catalog = modelfile.choices(load_catalog() if catalog is None else catalog)
    with naming(modelfile):
        choice = modelfile.model, modelfile.circuit, catalog
        check_choices(*choice)
        check_names(modelfile, unit_circuit(*choice), catalog)
        responses = find(modelfile.model, modelfile.responses)
        design = parts_choice.synthesise(*choice, peaks(modelfile.model, responses), responses)
        spread_of(modelfile, design.circuit, catalog)  # refuses what this design's boards cannot be
    return Synthesis(modelfile, catalog, responses, design, time.perf_counter() - began)


synthesize = synthesise
"""The same in American spelling."""
