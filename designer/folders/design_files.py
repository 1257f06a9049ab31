"""The files of the design stage: what is written of a design, and how it is read again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np

from designer.base.design_folder import DESIGN, MEASURED, MODEL, Folder
from designer.base.errors import InputError
from designer.base.guarded_reading import csv_rows, read_text, reading
from designer.base.plain_json import dumps
from designer.base.second_process import Ask
from designer.board.board_check import check_board
from designer.catalog.parts_catalog import Catalog
from designer.check.checked_design import CheckedResponse
from designer.check.deck_runs import circuit_notes, first_run
from designer.check.synthesis_result import Synthesis, with_stage
from designer.circuit import build
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.dead_zone_parts import dead_zone_stage
from designer.circuit.design import Certificate, ConditionCheck, Design
from designer.design_rules.rule_subject import RuleSubject
from designer.dynamics.drive_shape import has_harmonics
from designer.fabrication.board_cost import CostEstimate, cost_or_none
from designer.folders import board_files
from designer.folders.bench_tables import scales_csv, setup_csv, start_recipes, waveform_csv
from designer.folders.design_findings import error_warnings, findings, judged, subject_of
from designer.folders.json_answers import synthesis_json
from designer.folders.origin import provenance
from designer.linear_network.milp import SOLVER
from designer.model.circuit_table import DeadZone
from designer.model.find_responses import find, peaks
from designer.model.model_file import ModelFile, errors_in
from designer.spice import deck
from designer.spread.part_grades import better_grades

if TYPE_CHECKING:
    from designer.answers.design_answer import DesignAnswer
    from designer.answers.shared_rows import ProvenanceRow

SETUP = "setup.csv"
WAVEFORMS = "waveform.csv", "waveform2.csv"
"""Of the generator's channels."""


def check(modelfile: ModelFile, catalog: Catalog) -> None:
    """Refuse what no design folder could be written for, before any part is chosen
    (``board_check.check_board``)."""
    with errors_in(modelfile):
        check_board(modelfile, catalog)


def texts(synthesis: Synthesis) -> dict[str, str]:
    """Every file of the design stage but the drawing, ``setup.csv`` and ``design.json``; made
    before the folder is touched."""
    modelfile, design = synthesis.modelfile, synthesis.design
    return {
        MODEL: modelfile.text,
        "circuit.cir": circuit_deck(synthesis),
        "scales.csv": scales_csv(modelfile, design, synthesis.model_responses),
        **{
            name: waveform_csv(shape)
            for name, shape in zip(waveform_names(modelfile), design.drive_shapes, strict=False)
        },
        **board_files.bills(synthesis),
    }


def waveform_names(modelfile: ModelFile) -> tuple[str, ...]:
    """The waveforms that a generator's channels have to be given; none where all are sines."""
    system = modelfile.model.second_order()
    shapes = system.drive_shapes(system.own_frequency)
    return WAVEFORMS[: len(shapes)] if has_harmonics(*shapes) else ()


def write(folder: Folder, synthesis: Synthesis, files: Mapping[str, str]) -> None:
    """Write what is known without a look at how the circuit moves. files : ``texts``."""
    for name, content in files.items():
        folder.write(name, content)
    if synthesis.modelfile.measured is not None:
        folder.write(MEASURED, synthesis.modelfile.measured.content)


def write_last(
    folder: Folder,
    synthesis: Synthesis,
    jobs: int,
    other: Ask,
    drawing: Callable[[], Mapping[str, str | bytes]],
    better_stage: Callable[[], str] | None,
) -> Synthesis:
    """Write the rest of the stage: the drawing, how to start each response, and ``design.json``.
    What is returned has all that was found.

    other : as of ``find_recipes``. drawing : waits for it. better_stage : waits for what the other
    process finds out of the other stage, if it does.
    """
    design, responses = synthesis.design, synthesis.model_responses
    idle = other if better_stage is None else None
    subject, cost = subject_of(synthesis, idle), cost_or_none(synthesis)
    synthesis = judged(synthesis, subject)
    folder.write(board_files.NOTES, board_files.notes(synthesis, subject, cost))
    for name, content in drawing().items():
        folder.write(name, content)
    recipes = start_recipes(synthesis, jobs, other)
    folder.write(SETUP, setup_csv(design, responses, recipes, synthesis.modelfile.si))
    if better_stage is not None:
        synthesis = replace(synthesis, better_stage=better_stage())
    folder.write(DESIGN, dumps(_answer(synthesis, subject, cost)))
    return synthesis


def renew_bills(folder: Folder, synthesis: Synthesis) -> None:
    """Write the bills of a finished design anew, as its parts are bought now."""
    assert folder.manifest is not None
    for name, text in board_files.bills(synthesis).items():
        if name in folder.manifest.files:
            folder.rewrite(name, text)


def answer(synthesis: Synthesis) -> DesignAnswer:
    """The JSON object of ``design.json``."""
    return _answer(synthesis, subject_of(synthesis), cost_or_none(synthesis))


def _answer(
    synthesis: Synthesis, subject: RuleSubject | InputError, cost: CostEstimate | None
) -> DesignAnswer:
    found = findings(synthesis, subject)
    document = chosen(synthesis)
    return {**document, "board_cost": None if cost is None else cost.as_dict(), **found}


def chosen(synthesis: Synthesis) -> DesignAnswer:
    """Of ``answer``, what is known as soon as the parts are chosen."""
    document = synthesis_json(
        synthesis.modelfile,
        synthesis.design,
        synthesis.model_responses,
        design_provenance(synthesis),
        synthesis.seconds,
        better_grades(synthesis.modelfile, synthesis.design.circuit, synthesis.catalog),
    )
    if synthesis.stage_reason and (stage := document["dead_zone"]):
        stage["reason"] = synthesis.stage_reason
    return {**document, "warnings": list(error_warnings(synthesis))}


def design_provenance(synthesis: Synthesis) -> ProvenanceRow:
    return provenance(synthesis.modelfile, synthesis.catalog.hash, settings={"highs": SOLVER})


def load(folder: Folder, modelfile: ModelFile, catalog: Catalog) -> Synthesis:
    """The design of a folder, rebuilt from its model and the values of its parts.

    Nothing is chosen again; the errors are computed afresh and must be those that were written.
    """
    document, file = folder.json(DESIGN), folder / DESIGN
    stage = document.get("dead_zone") or {}
    if isinstance(stage, Mapping) and stage.get("kind") in get_args(DeadZone):
        modelfile = with_stage(modelfile, stage["kind"])
    model, spec = modelfile.model, modelfile.circuit
    responses = find(model, modelfile.responses)
    catalog = modelfile.choices(catalog)
    with errors_in(modelfile):
        opamp = catalog.opamp(spec.opamp, spec.supply)
    with reading(file, "the design of this folder's model", "parts"):
        values = {name: _size(value, file, name) for name, value in document["parts"].items()}
        circuit = build.circuit_of(
            model,
            values,
            opamp,
            supply=float(document["circuit"]["supply"]),
            saturation=spec.saturation,
            stage=dead_zone_stage(model, spec, catalog, values),
            composites=document.get("composites", {}),
        )
        gain, bias, limit = (float(document["circuit"][k]) for k in ("gain", "bias", "saturation"))
        circuit = replace(circuit, gain=gain, bias=bias, saturation=limit)
        largest = peaks(model, responses).states
        volts = np.array(list(document["scales"]["volts"].values()), dtype=float)
        swing = (float((volts * largest).max()), largest)
        errors = coefficient_errors(circuit, model.second_order(), swing=swing)
        if abs(errors.max_error - float(document["max_error"])) > 1e-9:
            raise ValueError("parts and max_error do not belong together")
        conditions = document["conditions"]
        listed = {key: conditions.get(key, ()) for key in ("checked", "at_limit", "binding")}
        design = Design(
            model=model,
            circuit=circuit,
            errors=errors,
            certificate=Certificate(**document["certificate"]),
            conditions={
                k: float(v) for k, v in conditions.items() if k not in listed and not _endless(k, v)
            },
            solver=dict(document["solver"]),
            seconds=float(document["cost"]["synthesis_seconds"]),
            checks=tuple(
                ConditionCheck(**check | {"limit": float(check["limit"])})
                for check in listed["checked"]
                if not _endless(check["quantity"], check["limit"])
            ),
            binding=dict(listed["binding"]),
        )
    reason = str(stage.get("reason", "")) if isinstance(stage, Mapping) else ""
    return Synthesis(modelfile, catalog, responses, design, stage_reason=reason)


def _endless(quantity: str, limit: object) -> bool:
    """Whether a condition has no limit, as versions wrote that of a rectifier's idle half."""
    return quantity == "rectifier_fv_v" and limit is None


def _size(value: object, file: Path, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0.0:
        raise InputError(file, f"parts.{name}", value, "a number > 0, in ohm or farad")
    return float(value)


def starts(folder: Folder) -> tuple[str, ...]:
    """How to start each response, by the folder's ``setup.csv``."""
    path = folder / SETUP
    rows = csv_rows(read_text(path, "the setup table of this design (CSV)"), path)
    _, header = next(rows, (1, []))
    if "start" not in header:
        text = ", ".join(header) or "nothing"
        raise InputError(path, "line 1", text, "a header with a column start")
    at = header.index("start")
    return tuple(row[at] if len(row) > at else "" for _, row in rows if row)


def circuit_deck(synthesis: Synthesis, checked: CheckedResponse | None = None) -> str:
    """``circuit.cir``: the first response (ω = 1 where there is none), from its own orbit.

    checked : of the first response; its gate's settings are used.
    """
    design, run = synthesis.design, first_run(synthesis, checked)
    text = deck.write(
        design.circuit,
        nominal_board(design.circuit),
        run.excitation,
        run.settings,
        title=synthesis.modelfile.title,
        stop_time=run.stop_time,
        initial=run.initial,
        notes=circuit_notes(synthesis, run),
    )
    # Without such a line the plain program runs nothing.
    return text.replace("\n.end\n", f"\n.print tran {deck.voltages(design.circuit)}\n.end\n")
