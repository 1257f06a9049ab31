"""The verb ``search``: a design that real parts cannot spoil, or the cheapest cure of one."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from designer.base.default_counts import SEARCH_SAMPLES, SEED
from designer.base.errors import MISSING, InputError
from designer.base.progress import Progress
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

if TYPE_CHECKING:
    from designer.jobs.cure_job import CureResult
    from designer.jobs.options import Options

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
        from designer.jobs.options import Options

        said = StudyRung.AUTO if rung is None else rung
        options = Options(
            SEED if seed is None else seed,
            jobs,
            SEARCH_SAMPLES if samples is None else samples,
            overwrite,
            resume,
            rung=said.value,
        )
        options.check()
        if not model.exists():
            raise InputError(model, "MODEL|DIR", MISSING, "a model file or a design folder")
        if model.is_dir():
            for name, given in (("--samples", samples), ("--rung", rung)):
                if given is not None:
                    raise InputError(None, name, given, "no such option with a design folder")
            cure = {"yield": wanted, "budget": budget, "without": without, "seed": seed}
            result = _cured(model, out, cure, options, progress)
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
        from designer.jobs import folder_numbers, search_job, synthesise_job

        modelfile, folder = synthesise_job.source(model, out)
        options = folder_numbers.of_search(folder, options, {"samples": samples, "seed": seed})
        command = partial(Options.command, verb="search", model=model, out=out)
        outcome = search_job.search_into(modelfile, folder, options, progress, command)
    if json:
        print_json(outcome.answer)
    elif not quiet:
        from designer.cli import search_tables, tables

        tables.run(outcome.answer)
        search_tables.searched(outcome.answer)
        tables.files(folder, outcome.reused)
    return 0 if outcome.satisfied else 1


def _cured(
    folder: Path,
    out: Path | None,
    given: Mapping[str, Any],
    options: Options,
    progress: Progress,
) -> CureResult:
    """given : the options of a cure by their names, None where there is none; then it is that of
    the folder's own cure, if there is one."""
    from designer.base.design_folder import Folder, is_design_folder
    from designer.jobs import folder_numbers
    from designer.jobs.cure_job import cure

    limits = () if options.overwrite else ("budget", "without")
    known: dict[str, Any] = {}
    if is_design_folder(folder):
        known = folder_numbers.own(Folder(folder), "cure", ("yield", "seed"), limits)
    asked = known | {name: value for name, value in given.items() if value is not None}
    if "yield" not in asked:
        raise InputError(None, "--yield", MISSING, "the yield that the cure shall reach")
    return cure(
        folder,
        target=asked["yield"],
        budget=asked.get("budget"),
        out=out,
        without=asked.get("without", ()),
        options=replace(options, seed=asked.get("seed", SEED)),
        progress=progress,
    )
