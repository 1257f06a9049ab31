"""The verb ``reproduce``: what the paper says against what is found here."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from designer.cli.app import Jobs, Log, Quiet, Resume, Verbose, app, compiling, session


class ReproducedPart(StrEnum):
    """What is reproduced."""

    DYNAMICS = "dynamics"
    CIRCUIT = "circuit"
    TOLERANCE = "tolerance"


@app.command()
def reproduce(
    what: Annotated[
        ReproducedPart,
        typer.Argument(
            metavar="dynamics|circuit|tolerance",
            help="Which part of the paper.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Where to [default: reports/paper-dynamics, reports/paper-circuit, "
            "reports/tolerance].",
        ),
    ] = None,
    samples: Annotated[
        int | None, typer.Option("--samples", metavar="N", help="Boards a case (tolerance).")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", metavar="N", help="Of the boards (tolerance).")
    ] = None,
    jobs: Jobs = None,
    resume: Resume = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """The paper's figures and statements, measured again."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        from designer.paper import paper_reports

        paper_reports.reproduce(
            what.value,
            out,
            samples=samples,
            seed=seed,
            jobs=jobs,
            resume=resume,
            progress=progress,
        )
    return 0
