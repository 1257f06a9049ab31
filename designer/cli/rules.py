"""The verb ``rules``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from designer.cli.app import Json, Log, Quiet, Verbose, app, compiling, print_json, session


@app.command()
def rules(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A design folder.")],
    board: Annotated[
        Path | None,
        typer.Option("--board", metavar="FILE", help="Its board, a .kicad_pcb of KiCad 7 to 9."),
    ] = None,
    junit: Annotated[
        Path | None,
        typer.Option("--junit", metavar="FILE", help="Also write a JUnit report."),
    ] = None,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """Design rules on a circuit and its board; exit status 1 where one fails."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        from designer.jobs import rules_job

        found = rules_job.rules(folder, board=board, junit=junit, progress=progress)
    if json:
        print_json(found.answer)
    elif not quiet:
        from designer.cli import rules_table

        rules_table.show(found.answer)
    return 0 if found.passed else 1
