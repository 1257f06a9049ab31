"""The verb ``trade``."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from designer.base.default_counts import SEED, TRADE_BOARDS
from designer.cli.app import (
    Jobs,
    Json,
    Log,
    Out,
    Overwrite,
    Quiet,
    Resume,
    Seed,
    Source,
    Verbose,
    _compiling,
    _print_json,
    _session,
    app,
)


@app.command()
def trade(
    model: Source,
    out: Out = None,
    boards: Annotated[
        int,
        typer.Option(
            "--boards", metavar="N", help="Boards of each response for the yield; 0: none."
        ),
    ] = TRADE_BOARDS,
    seed: Seed = SEED,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """Time and error of every rung on this design, and the cheapest for each question."""
    with _session(verbose, quiet, log) as progress, _compiling(progress):
        from designer.base.checks import at_least
        from designer.jobs import synthesise_job, trade_job
        from designer.model.model_file import read_model_file

        at_least("--boards", boards, 0)
        options = synthesise_job.Options(seed, jobs, overwrite=overwrite, resume=resume)
        options.check()
        if out is None and not model.is_dir():
            modelfile, folder = read_model_file(model), None
        else:
            modelfile, folder = synthesise_job.source(model, out)
        extent = trade_job.Extent(boards=boards)
        answer, _ = trade_job.answer(modelfile, folder, options, extent, progress)
    if json:
        _print_json(answer)
    elif not quiet:
        from designer.fidelity.trade_files import sheet

        print(sheet(answer), file=sys.stderr)
    return 0
