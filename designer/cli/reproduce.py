"""The verb ``reproduce``: what the paper says against what is found here."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from designer.base.errors import InputError
from designer.cli.app import Jobs, Log, Quiet, Resume, Verbose, app, compiling, session


class ReproducedPart(StrEnum):
    """What is reproduced."""

    DYNAMICS = "dynamics"
    CIRCUIT = "circuit"
    TOLERANCE = "tolerance"


PLACES = {
    ReproducedPart.DYNAMICS: Path("reports/paper-dynamics"),
    ReproducedPart.CIRCUIT: Path("reports/paper-circuit"),
    ReproducedPart.TOLERANCE: Path("reports/tolerance"),
}


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
        from designer.base.checks import at_least, cores

        if jobs is not None:
            at_least("--jobs", jobs, 1)
        place = PLACES[what] if out is None else out
        if what is not ReproducedPart.TOLERANCE:
            for name, value in (("--samples", samples), ("--seed", seed)):
                if value is not None:
                    raise InputError(None, name, value, f"nothing: {what.value} draws no boards")
        if what is ReproducedPart.DYNAMICS:
            from designer.paper import reproduce_dynamics

            if resume:
                expected = "nothing: dynamics is made anew each time"
                raise InputError(None, "--resume", "given", expected)
            reproduce_dynamics.reproduce(place, jobs=jobs or cores(), progress=progress)
        elif what is ReproducedPart.CIRCUIT:
            from designer.paper import reproduce_circuit

            reproduce_circuit.reproduce(place, jobs=jobs, progress=progress, resume=resume)
        else:
            from designer.paper import reproduce_tolerance

            reproduce_tolerance.reproduce(
                place,
                samples=reproduce_tolerance.SAMPLES if samples is None else samples,
                seed=reproduce_tolerance.SEED if seed is None else seed,
                jobs=jobs,
                progress=progress,
                resume=resume,
            )
    return 0
