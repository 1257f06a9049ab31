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
        from designer.jobs import export_job

        found = export_job.export(
            model,
            out,
            deck=[name.value for name in deck or ()],
            overwrite=overwrite,
            resume=resume,
            progress=progress,
        )
    if json:
        print_json(found.answer)
    elif not quiet:
        from designer.cli import tables

        tables.files(found.folder, found.reused)
    return 0
