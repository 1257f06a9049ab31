"""The verb ``tolerance``."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from designer.base.errors import InputError
from designer.cli.app import (
    Jobs,
    Json,
    Log,
    Out,
    Overwrite,
    Quiet,
    Resume,
    Samples,
    Source,
    Verbose,
    app,
    compiling,
    session,
)
from designer.cli.verbs import BlameBudget, EarlyTables, OwnSeed, WithBlame, print_answer


class MapOver(StrEnum):
    """What a yield is mapped over."""

    OMEGA = "omega"
    B = "b"
    GRADE = "grade"
    OMEGA_GRADE = "omega-grade"


class StudyRung(StrEnum):
    """Which engines a tolerance study asks."""

    EXACT = "exact"
    AUTO = "auto"
    NGSPICE = "ngspice"


@app.command()
def tolerance(
    model: Source,
    out: Out = None,
    samples: Samples = None,
    until: Annotated[
        float | None,
        typer.Option("--until", metavar="WIDTH", help="Add boards until intervals are narrower."),
    ] = None,
    rung: Annotated[
        StudyRung | None,
        typer.Option(
            "--rung",
            help="exact: no ngspice; ngspice: every board in ngspice too "
            "[auto, or as the folder has].",
        ),
    ] = None,
    tuned: Annotated[
        bool, typer.Option("--tuned", help="Also with the generator free within its bands.")
    ] = False,
    reached: Annotated[
        bool, typer.Option("--reached", help="Also from power-up, by the start recipe.")
    ] = False,
    map_: Annotated[
        list[MapOver] | None,
        typer.Option("--map", help="Also the yield over this setting; may be repeated."),
    ] = None,
    measured: Annotated[
        Path | None,
        typer.Option(
            "--measured", metavar="FILE", help="Of the boards in this list instead (CSV)."
        ),
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", metavar="tcp://…", help="A Dask scheduler that shares the work."),
    ] = None,
    blame: WithBlame = None,
    blame_budget: BlameBudget = None,
    seed: OwnSeed = None,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """How many boards will work; writes into the design folder (a model file needs --out)."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        from designer.jobs import folder_numbers, search_job, study_job, synthesise_job
        from designer.jobs.options import Options

        given = {
            "samples": samples,
            "seed": seed,
            "until": until,
            "rung": None if rung is None else rung.value,
            "blamed": blame,
            "blame_budget": blame_budget,
        }
        said: dict[str, Any] = {k: v for k, v in given.items() if v is not None}
        options = Options(
            jobs=jobs,
            overwrite=overwrite,
            resume=resume,
            tuned=tuned,
            reached=reached,
            maps=tuple(dict.fromkeys(over.value for over in map_ or ())),
            cluster=cluster,
            **said,
        )
        options.check()
        command = partial(Options.command, verb="tolerance", model=model, out=out)
        shown = EarlyTables(progress, "tolerance", silent=json or quiet)
        if measured is not None:
            from designer.jobs.measured_job import measured_into

            of_random = {"--out": out, "--samples": samples, "--until": until, "--map": map_}
            _refuse(of_random, "no such option with --measured, whose boards are the samples")
            options = folder_numbers.of_built(model, options, given)
            outcome = measured_into(model, measured, options, progress, command, shown)
            return print_answer(outcome, json, quiet, "tolerance")
        modelfile, folder = synthesise_job.source(model, out)
        options = folder_numbers.of_study(model, folder, modelfile, options, given)
        modelfile = search_job.chosen(modelfile, folder, options, progress)
        outcome = study_job.run_into(modelfile, folder, options, progress, command, shown)
    return print_answer(outcome, json, quiet, "tolerance")


def _refuse(given: Mapping[str, object], expected: str) -> None:
    """InputError for the first of these options that has a value."""
    for name, value in given.items():
        if value not in (None, []):
            found = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
            raise InputError(None, name, found, expected)
