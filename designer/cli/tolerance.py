"""The verb ``tolerance``."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from typing import Annotated

import typer

from designer.base.default_counts import SAMPLES, SEED
from designer.cli.app import (
    Jobs,
    Json,
    Log,
    Out,
    Overwrite,
    Quiet,
    Resume,
    Samples,
    Seed,
    Source,
    Verbose,
    _compiling,
    _session,
    app,
)
from designer.cli.verbs import _answer


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
    samples: Samples = SAMPLES,
    until: Annotated[
        float | None,
        typer.Option("--until", metavar="WIDTH", help="Add boards until intervals are narrower."),
    ] = None,
    rung: Annotated[
        StudyRung,
        typer.Option("--rung", help="exact: no ngspice; ngspice: every board in ngspice too."),
    ] = StudyRung.AUTO,
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
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", metavar="tcp://…", help="A Dask scheduler that shares the work."),
    ] = None,
    seed: Seed = SEED,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """How many boards will work; writes into the design folder (a model file needs --out)."""
    with _session(verbose, quiet, log) as progress, _compiling(progress):
        from designer.jobs import search_job, study_job, synthesise_job
        from designer.jobs.options import Options

        options = Options(
            seed,
            jobs,
            samples,
            overwrite,
            resume,
            until=until,
            rung=rung.value,
            tuned=tuned,
            reached=reached,
            maps=tuple(dict.fromkeys(over.value for over in map_ or ())),
            cluster=cluster,
        )
        options.check()
        modelfile, folder = synthesise_job.source(model, out)
        modelfile = search_job.chosen(modelfile, folder, options, progress)
        command = partial(Options.command, verb="tolerance", model=model, out=out)
        outcome = study_job.run_into(modelfile, folder, options, progress, command)
    return _answer(outcome, json, quiet, "tolerance")
