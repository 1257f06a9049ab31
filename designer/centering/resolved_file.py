"""The model file of a found design: as it was given, with everything filled in that was open."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from designer.centering.levers import DesignChoice
from designer.check.synthesis_result import Synthesis
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile
from designer.model.response_table import placed


def resolved(
    modelfile: ModelFile, synthesis: Synthesis, choice: DesignChoice, source: Path
) -> ModelFile:
    """The model file that a design folder holds, as if read from ``source``.

    ω and b of each response, op-amp and dead zone are values; ``objective`` stays "yield". What
    the synthesis aimed at inside its conditions is no key of a model file: the parts stand in
    ``design.json``.
    """
    return modelfile.rewritten(_tables(modelfile, synthesis.model_responses, choice), source)


def _tables(
    modelfile: ModelFile, responses: Sequence[ModelResponse], choice: DesignChoice
) -> dict[str, Any]:
    data = modelfile.data
    data.setdefault("title", modelfile.title)
    wanted = zip(modelfile.responses, responses, strict=True)
    for index, (spec, response) in enumerate(wanted):
        omega = response.omega if spec.omega is None else None
        b = response.b if isinstance(spec.b, tuple) else None
        data["response"][index] = placed(data["response"][index], omega, b, modelfile.si)
    circuit = data.setdefault("circuit", {})
    circuit |= {"opamp": choice.opamp, "dead_zone": choice.dead_zone}
    if choice.opamp != modelfile.circuit.opamp:
        circuit.pop("saturation", None)  # it was stated for the other op-amp
    order = ["format", "title", "model", "mechanical", "response", "circuit"]
    first = {key: data[key] for key in order if key in data}
    return {**first, **data}
