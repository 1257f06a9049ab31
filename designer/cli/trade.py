"""The verb ``trade``."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from designer.base.defaults import TRADE_BOARDS
from designer.cli.app import (
    Jobs,
    Json,
    Log,
    Out,
    Overwrite,
    Quiet,
    Resume,
    Source,
    Verbose,
    app,
    compiling,
    print_json,
    session,
)
from designer.cli.verbs import OwnSeed


@app.command()
def trade(
    model: Source,
    out: Out = None,
    boards: Annotated[
        int | None,
        typer.Option(
            "--boards",
            metavar="N",
            help=f"Boards of each response for the yield; 0: none "
            f"[{TRADE_BOARDS}, or the folder's own].",
        ),
    ] = None,
    seed: OwnSeed = None,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """Time and error of every rung on this design, and the cheapest for each question."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        from designer.jobs import trade_job

        answer = trade_job.trade(
            model,
            out,
            boards=boards,
            seed=seed,
            jobs=jobs,
            overwrite=overwrite,
            resume=resume,
            progress=progress,
        ).answer
    if json:
        print_json(answer)
    elif not quiet:
        from designer.fidelity.trade_files import sheet

        print(sheet(answer), file=sys.stderr)
    return 0
