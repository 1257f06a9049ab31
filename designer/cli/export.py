"""The verb ``export``."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from designer.cli.app import (
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


class DeckName(StrEnum):
    """Simulators that a deck is written for."""

    LTSPICE = "ltspice"
    PORTABLE = "portable"


@app.command()
def export(
    model: Source,
    out: Out = None,
    deck: Annotated[
        list[DeckName] | None,
        typer.Option(
            "--deck",
            help="Instead: a deck for another simulator, with every response. May come twice.",
        ),
    ] = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """The KiCad project: schematic, placed board, netlist; or decks; into the design folder."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        from designer.jobs import synthesise_job
        from designer.jobs.export_job import export_into
        from designer.jobs.options import Options

        options = Options(overwrite=overwrite, resume=resume)
        modelfile, folder = synthesise_job.source(model, out)
        if deck:
            from designer.jobs.deck_job import export_decks

            answer, reused = export_decks(
                modelfile, folder, [name.value for name in deck], options, progress
            )
        else:
            answer, reused = export_into(modelfile, folder, options, progress)
    if json:
        print_json(answer)
    elif not quiet:
        from designer.cli import tables

        tables.files(folder, reused)
    return 0
