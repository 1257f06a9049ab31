"""What becomes of a model file on a board: the design, its yields, its drawing and its rules."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup

from designer.base.page import Picture, bullets, table
from designer.base.progress import Progress
from designer.examples.evidence import Evidence
from designer.jobs.export_job import export
from designer.jobs.job_outcome import JobOutcome
from designer.jobs.rules_job import rules
from designer.jobs.study_job import run
from designer.report import comparison

FOLDER = "design"


def board_part(
    model: Path, out: Path, samples: int, seed: int, jobs: int, progress: Progress
) -> Evidence:
    """Take the file to a board in the folder ``design`` of the report; finished work is kept.

    Raises
    ------
    InputError, Unreachable, EnvironmentMissing : as the verbs.
    """
    folder = out / FOLDER
    outcome = run(
        model, folder, samples=samples, seed=seed, jobs=jobs, resume=True, progress=progress
    )
    export(folder, progress=progress)
    counts = rules(folder, progress=progress).answer["counts"]
    blocks = [
        _responses(outcome.answer["responses"]),
        bullets(_facts(outcome, counts)),
        Picture("The circuit", "The circuit.", f"{FOLDER}/schematic.svg"),
        Markup(f"Files of the design, KiCad's among them, are in [{FOLDER}]({FOLDER}/)."),
    ]
    return Evidence("On a board", blocks)


def _responses(answers: list[Mapping[str, Any]]) -> Any:
    rows = []
    for each in answers:
        counted = each["yield"]
        rate = counted["ok"] / max(counted["samples"] - counted["failed"], 1)
        interval = f"{counted['low']:.3f} to {counted['high']:.3f}"
        engines = (str(each[name]) for name in ("model", "circuit", "ngspice"))
        failed = str(counted["failed"])
        rows.append((f"{each['omega']:.4g}", *engines, f"{rate:.3f}", interval, failed))
    head = ("ω", "model", "exact circuit", "ngspice", "yield", "95 % interval", "failed")
    return table(head, rows, numeric=(0, 4, 6))


def _facts(outcome: JobOutcome, counts: Mapping[str, int]) -> list[str]:
    design, answer = outcome.design, outcome.answer
    certificate = answer["certificate"]
    made = outcome.synthesis
    bill = comparison.bill_of(design.circuit, made.modelfile.circuit, made.catalog)
    bound = "" if certificate["lower_bound"] is None else f" of {certificate['lower_bound']:.2e}"
    return [
        f"Largest error of a coefficient: {answer['max_error']:.2e}; certificate: "
        f"{certificate['status']}, with the lower bound{bound}.",
        f"{bill.parts} parts, {bill.packages} packages of op-amps, {bill.distinct} distinct "
        f"values, {bill.price:.2f} € a board.",
        f"Design rules: {counts['pass']} pass, {counts['fail']} fail, {counts['not run']} not run "
        "(they ask for a routed board).",
    ]
