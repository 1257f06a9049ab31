"""The verb ``trade``."""

from __future__ import annotations

import sys
from typing import Annotated, Any

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
        from designer.base.checks import at_least
        from designer.base.design_folder import Folder
        from designer.jobs import folder_numbers, synthesise_job, trade_job
        from designer.model.model_file import read_model_file

        given = {"boards": boards, "seed": seed}
        numbers: dict[str, Any] = {k: v for k, v in given.items() if v is not None}
        at_least("--boards", numbers.get("boards", TRADE_BOARDS), 0)
        synthesise_job.Options(numbers.get("seed", SEED), jobs).check()
        if out is None and not model.is_dir():
            modelfile, folder = read_model_file(model), None
        else:
            modelfile, folder = synthesise_job.source(model, out)
        if folder is not None and folder_numbers.goes_on(model, folder, resume):
            numbers = folder_numbers.own(Folder(folder), "trade", tuple(given)) | numbers
        seed = numbers.get("seed", SEED)
        options = synthesise_job.Options(seed, jobs, overwrite=overwrite, resume=resume)
        extent = trade_job.TradeExtent(boards=numbers.get("boards", TRADE_BOARDS))
        answer, _ = trade_job.answer(modelfile, folder, options, extent, progress)
    if json:
        print_json(answer)
    elif not quiet:
        from designer.fidelity.trade_files import sheet

        print(sheet(answer), file=sys.stderr)
    return 0
