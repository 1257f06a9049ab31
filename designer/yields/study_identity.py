"""Which study a row on disk belongs to: a hash of everything that decides it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from designer.base.plain_json import plain
from designer.base.seal import json_hash
from designer.base.version import __version__
from designer.circuit.netlist import Part
from designer.verdicts import cross_check, ngspice_runs
from designer.verdicts.verdict import StudyPlan, rounded

RULES = {
    "samples": 3,
    "ngspice": 6,
    "tuned": 3,
    "reached": 3,
    "trimmed": 2,
    "blame": 3,
    "maps": 1,
    "rare": 7,
    "checks": 2,
}
"""Numbers of the rules by which each layer's rows are made. Whoever changes what a row says under
the same inputs (how an attractor is sought, a verdict given, ngspice asked) raises the number of
the layer, so that rows of the old rules are not taken for rows of the new ones. So with the
attribution and with the equation check and the gate."""


WAVES = 1
"""Likewise of samples under a drive that is no sine: by which kernel, and so within how many drive
periods, they settle."""


def study_hash(
    plan: StudyPlan, layer: str = "samples", more: Mapping[str, Any] | None = None
) -> str:
    """Hash of everything that decides the rows of a layer; not of how many there are.

    Every layer stands on the samples; ngspice's also on its settings. more : what else decides.
    What is computed (settings of the generator and of ngspice, starts, recipes) counts to nine
    digits: the last ones depend on the machine's linear algebra.
    """
    inputs = _samples(plan)
    if layer != "samples":
        inputs["layer"] = [layer, RULES[layer], nine_digits(plain(more or {}))]
    if layer == "ngspice":
        inputs["ngspice"] = {
            "refinements": [ngspice_runs.OWN_REFINEMENTS, ngspice_runs.NOMINAL_REFINEMENTS],
            "periods": [
                cross_check.UNKNOWN_PERIODS,
                ngspice_runs.REMAINDER,
                cross_check.MOST_PERIODS,
                cross_check.MOST_STEPS,
                ngspice_runs.STRETCH,
                ngspice_runs.LONG,
                ngspice_runs.MOST_AGAIN,
                ngspice_runs.MOST_STEPS_AGAIN,
            ],
            "undecided": cross_check.UNDECIDED,
            "settings": [
                None if q.settings is None else nine_digits(plain(q.settings.as_dict()))
                for q in plan.questions
            ],
        }
    return json_hash(inputs)


def attribution_hash(plan: StudyPlan) -> str:
    """Hash of everything that decides the attribution of a study's answers."""
    return study_hash(plan, "blame", {"samples": plan.samples})


def checks_hash(design: str | None, ngspice: str | None) -> str:
    """Hash of everything that decides ngspice's answers about a design's nominal board.

    design : hash of ``design.json``. ngspice : its version.
    """
    return json_hash([__version__, RULES["checks"], design, ngspice])


def nine_digits(value: Any) -> Any:
    """JSON data with every number in it to nine digits."""
    if isinstance(value, float):
        return rounded(value)
    if isinstance(value, Mapping):
        return {key: nine_digits(v) for key, v in value.items()}
    return [nine_digits(v) for v in value] if isinstance(value, list | tuple) else value


def _simulated(part: Part) -> dict[str, Any]:
    """What a part is to a simulation: not where else it stands."""
    return {key: value for key, value in asdict(part).items() if key != "views"}


def _samples(plan: StudyPlan) -> dict[str, Any]:
    circuit = plan.circuit
    return {
        "version": __version__,
        "rules": RULES["samples"],
        "parts": [[type(p).__name__, plain(_simulated(p))] for p in circuit.parts],
        "opamp": [circuit.opamp, circuit.gain, circuit.bias, circuit.supply, circuit.saturation],
        **({"limit_into": circuit.saturation_load} if circuit.saturation_load else {}),
        "figures": repr(circuit.figures),
        "spread": plain(plan.spread.as_dict()),
        **({"bandwidth": True} if plan.bandwidth else {}),
        **({} if all(q.excitation.drive.is_sine for q in plan.questions) else {"waves": WAVES}),
        "seed": plan.seed,
        "questions": [
            {
                "spec": q.spec.as_dict(),
                "excitation": nine_digits(q.excitation.as_dict()),
                "start": nine_digits([float(v) for v in q.start.start]),
                "nominal": q.start.response,
            }
            for q in plan.questions
        ],
    }
