"""The verb ``reproduce``: what the paper says against what is found here."""

from __future__ import annotations

from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from designer.commands import Jobs, Log, Quiet, Verbose, _compiling, _session, app
from designer.errors import InputError

REPORTS = Path("reports")


class Subject(StrEnum):
    """What is reproduced."""

    DYNAMICS = "dynamics"
    CIRCUIT = "circuit"
    TOLERANCE = "tolerance"


@app.command()
def reproduce(
    what: Annotated[
        Subject, typer.Argument(metavar="dynamics|circuit|tolerance", help="Which part.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Where to [default: reports/paper-WHAT]."),
    ] = None,
    jobs: Jobs = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """The paper's figures and statements, measured again."""
    with _session(verbose, quiet, log) as progress, _compiling(progress):
        from designer.preconditions import at_least, cores

        if jobs is not None:
            at_least("--jobs", jobs, 1)
        module = _module(what)
        module.reproduce(
            out or REPORTS / f"paper-{what.value}", jobs=jobs or cores(), progress=progress
        )
    return 0


def _module(what: Subject) -> Any:
    """The module that does it; InputError for what this version does not have."""
    name = f"designer.reproduce_{what.value}"
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        there = [s.value for s in Subject if s is not what and s is not Subject.CIRCUIT]
        raise InputError(
            None, "what to reproduce", what.value, f"{' or '.join(there)}: this version has no more"
        ) from None
