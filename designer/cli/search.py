"""The verb ``search``: a design that real parts cannot spoil, or the cheapest cure of one."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from designer.base.defaults import SEARCH_SAMPLES
from designer.base.errors import MISSING, InputError
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
from designer.cli.tolerance import StudyRung
from designer.cli.verbs import OwnSeed

KINDS = ("grade", "network", "reference", "trimmer", "op-amp", "dead-zone", "place", "trim")
"""Of upgrades; as ``cure_branch.KINDS``."""


@app.command()
def search(
    model: Source,
    out: Out = None,
    samples: Annotated[
        int | None,
        typer.Option("--samples", metavar="N", help=f"Fresh boards at the end [{SEARCH_SAMPLES}]."),
    ] = None,
    wanted: Annotated[
        float | None,
        typer.Option("--yield", metavar="Y", help="Cure this design folder: the yield wanted."),
    ] = None,
    budget: Annotated[
        float | None, typer.Option("--budget", metavar="PRICE", help="Of a cure, at most.")
    ] = None,
    without: Annotated[
        list[str] | None,
        typer.Option(
            "--without",
            metavar="KIND",
            help=f"Of a cure, no upgrade of this kind: {', '.join(KINDS)}; may be repeated.",
        ),
    ] = None,
    rung: Annotated[
        StudyRung | None,
        typer.Option(
            "--rung", help="Of the final study; auto: by a trade that is in the folder. [auto]"
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
    """The design of the highest yield for a model file; with --yield the cure of a folder."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        if not model.exists():
            raise InputError(model, "MODEL|DIR", MISSING, "a model file or a design folder")
        if model.is_dir():
            for name, given in (("--samples", samples), ("--rung", rung)):
                if given is not None:
                    raise InputError(None, name, given, "no such option with a design folder")
            from designer.jobs import cure_job

            result = cure_job.cure(
                model,
                yield_=wanted,
                budget=budget,
                without=without or (),
                out=out,
                seed=seed,
                jobs=jobs,
                overwrite=overwrite,
                resume=resume,
                progress=progress,
            )
            if json:
                print_json(result.answer)
            elif not quiet:
                from designer.centering import cure_table

                print(cure_table.text(result.answer), file=sys.stderr)
            return 0 if result.reached else 1
        for name, value in (("--yield", wanted), ("--budget", budget), ("--without", without)):
            if value not in (None, []):
                expected = "a design folder to cure; a model file gets its highest yield"
                raise InputError(None, name, value, expected)
        from designer.jobs import search_job

        outcome = search_job.search(
            model,
            out,
            samples=samples,
            rung="auto" if rung is None else rung.value,
            seed=seed,
            jobs=jobs,
            overwrite=overwrite,
            resume=resume,
            progress=progress,
        )
    if json:
        print_json(outcome.answer)
    elif not quiet:
        from designer.cli import search_tables, tables

        tables.run(outcome.answer)
        search_tables.searched(outcome.answer)
        assert outcome.folder is not None
        tables.files(outcome.folder, outcome.reused)
    return 0 if outcome.satisfied else 1
