"""The model file of a found design: as it was given, with everything filled in that was open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from designer.base.toml_reader import parse_toml
from designer.base.toml_writer import toml_text
from designer.centering.levers import DesignChoice
from designer.check.synthesis_result import Synthesis
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile, parse_model_file
from designer.model.response_table import placed


def resolved(
    modelfile: ModelFile, synthesis: Synthesis, choice: DesignChoice, source: Path
) -> ModelFile:
    """The model file that a design folder holds, as if read from ``source``.

    ω and b of each response, op-amp and dead zone are values; ``objective`` stays "yield". What
    the synthesis aimed at inside its conditions is no key of a model file: the parts stand in
    ``design.json``.
    """
    text = _text(modelfile, synthesis.model_responses, choice)
    file = parse_model_file(text, source)
    return replace(file, measured=modelfile.measured)


def _text(modelfile: ModelFile, responses: Sequence[ModelResponse], choice: DesignChoice) -> str:
    data: dict[str, Any] = parse_toml(modelfile.text.lstrip("\ufeff"), None)
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
    return toml_text({**first, **data})
