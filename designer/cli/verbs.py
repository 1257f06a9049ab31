"""The verbs of the command line: options in, one JSON object or tables out."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from designer.base.defaults import DRAWN_STARTS, SEED
from designer.base.progress import Progress
from designer.base.version import __version__
from designer.cli.app import (
    EngineName,
    Jobs,
    Json,
    Log,
    Out,
    Overwrite,
    Quiet,
    Resume,
    RungName,
    Samples,
    Seed,
    Source,
    Verbose,
    app,
    compiling,
    print_json,
    session,
)

if TYPE_CHECKING:
    from designer.jobs.synthesise_job import JobOutcome

STUDY_KEYS = (
    "format",
    "samples",
    "until",
    "narrow",
    "all_on_one_board",
    "blame",
    "boards",
    "equation_check",
    "responses",
    "maps",
    "provenance",
)
"""Of what a study's JSON object has, in the order in which ``tolerance`` prints it."""


OwnSeed = Annotated[
    int | None,
    typer.Option("--seed", metavar="N", help="Of the random numbers [1, or the folder's own]."),
]
WithBlame = Annotated[
    bool | None,
    typer.Option("--blame/--no-blame", help="Which part is to blame [yes, or as the folder has]."),
]
BlameBudget = Annotated[
    int | None,
    typer.Option("--blame-budget", metavar="STEPS", help="Of the work on the blame [20000]."),
]


@app.callback(invoke_without_command=True)
def _designer(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        print(f"designer {__version__}")
        raise typer.Exit


@app.command()
def run(
    model: Source,
    out: Out = None,
    samples: Samples = None,
    blame: WithBlame = None,
    blame_budget: BlameBudget = None,
    seed: OwnSeed = None,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """Everything: parts, circuit, check in ngspice, yield, report."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        from designer.jobs import folder_numbers, search_job, study_job, synthesise_job
        from designer.jobs.options import Options

        given = {"samples": samples, "seed": seed, "until": None}
        given |= {"blamed": blame, "blame_budget": blame_budget}
        said: dict[str, Any] = {k: v for k, v in given.items() if v is not None}
        options = Options(jobs=jobs, overwrite=overwrite, resume=resume, **said)
        options.check()
        modelfile, folder = synthesise_job.source(model, out)
        options = folder_numbers.of_study(model, folder, modelfile, options, given)
        modelfile = search_job.chosen(modelfile, folder, options, progress)
        command = partial(Options.command, verb="run", model=model, out=out)
        shown = EarlyTables(progress, "run", silent=json or quiet)
        outcome = study_job.run_into(modelfile, folder, options, progress, command, shown)
    return print_answer(outcome, json, quiet, "run")


@app.command()
def synthesise(
    model: Source,
    out: Out = None,
    compare: Annotated[
        bool, typer.Option("--compare", help="Beside the paper's values; needs no --out.")
    ] = False,
    seed: Seed = SEED,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """Choose the parts and write the design folder."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        from designer.jobs import search_job, synthesise_job
        from designer.model.model_file import read_model_file

        options = synthesise_job.Options(seed, jobs, overwrite=overwrite, resume=resume)
        options.check()
        if compare and out is None and not model.is_dir():
            outcome = synthesise_job.compare_in_memory(read_model_file(model), options, progress)
        else:
            modelfile, folder = synthesise_job.source(model, out)
            modelfile = search_job.chosen(modelfile, folder, options, progress)
            outcome = synthesise_job.synthesise_into(
                modelfile, folder, options, progress, compare=compare
            )
    return print_answer(outcome, json, quiet, "synthesise")


app.command("synthesize", hidden=True)(synthesise)


@app.command()
def simulate(
    model: Source,
    omega: Annotated[
        list[float] | None,
        typer.Option("--omega", metavar="W", help="Dimensionless frequency; may be repeated."),
    ] = None,
    frequency: Annotated[
        list[str] | None,
        typer.Option(
            "--frequency",
            metavar="F",
            help='Frequency of a [mechanical] model, such as "10 Hz" or "62.8 rad/s"; may be '
            "repeated.",
        ),
    ] = None,
    engine: Annotated[EngineName, typer.Option("--engine", help="What simulates.")] = (
        EngineName.MODEL
    ),
    rung: Annotated[
        RungName, typer.Option("--rung", help="The op-amps' model, with --engine ngspice.")
    ] = RungName.IDEAL,
    starts: Annotated[
        int,
        typer.Option(
            "--starts", metavar="N", help="Initial states that are drawn: the attractors' shares."
        ),
    ] = DRAWN_STARTS,
    seed: Seed = SEED,
    plots: Annotated[
        Path | None,
        typer.Option("--plots", metavar="DIR", help="Draw each response: PNG and SVG."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace pictures of the same names.")
    ] = False,
    jobs: Jobs = None,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """The responses: those that the model file wants, or what is reached from rest at --omega
    and --frequency."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        from designer.jobs import synthesise_job

        synthesise_job.Options(seed, jobs).check()
        answer, found = synthesise_job.simulate_answer(
            model,
            tuple(omega or ()),
            engine.value,
            jobs,
            progress,
            plots,
            overwrite,
            rung.value,
            frequencies=tuple(frequency or ()),
            starts=starts,
            seed=seed,
        )
    if json:
        print_json(answer)
    elif not quiet:
        from designer.cli import tables

        tables.simulated(answer)
        if plots is not None:
            tables.pictures(plots, answer["files"])
    return 0 if found else 1


@app.command()
def catalog(
    check: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Measure this op-amp's model against its figures."),
    ] = None,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """What can be bought: part families, op-amps, diodes, references, trimmers, headers."""
    with session(verbose, quiet, log) as progress:
        from designer.catalog.catalog import load_catalog

        held = load_catalog()
        if check is not None:
            from designer.spice.opamp_check import checks

            progress.stage(f"{check} in ngspice")
            measured = checks(held.opamp(check))
    if check is not None:
        if json:
            rows = [{**asdict(row), "agrees": row.agrees} for row in measured]
            print_json({"format": 1, "opamp": check, "checks": rows, "hash": held.hash})
        elif not quiet:
            from designer.cli import tables

            tables.checks(check, measured)
        return 0 if all(row.agrees for row in measured) else 1
    if json:
        print_json(
            {
                "format": 1,
                "opamps": [entry.name for entry in held.opamps],
                "families": [entry.name for entry in held.families],
                "diodes": [entry.name for entry in held.diodes],
                "references": [entry.name for entry in held.references],
                "trimmers": [entry.name for entry in held.trimmers],
                "headers": [entry.name for entry in held.headers],
                "hash": held.hash,
            }
        )
    elif not quiet:
        from designer.cli import tables

        tables.catalog(held)
    return 0


@app.command()
def new(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="The file to write.")] = Path(
        "model.toml"
    ),
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """Write a commented model file to start from; an existing file is left alone."""
    with session(verbose, quiet, log):
        from designer.model.template import new as write_model_file

        write_model_file(path)
    if json:
        print_json({"format": 1, "files": [str(path)]})
    elif not quiet:
        print(f"written: {path}", file=sys.stderr)
    return 0


def print_answer(outcome: JobOutcome, json: bool, quiet: bool, verb: str) -> int:
    answer = outcome.answer
    if verb == "tolerance":
        answer = {k: answer[k] for k in STUDY_KEYS if k in answer} | {
            "cost": answer["cost"]["study"]
        }
    if json:
        print_json(answer)
    elif not quiet:
        from designer.cli import tables

        if outcome.shown:
            tables.blame_status(answer)
        else:
            _shown(answer, verb)
        if "comparison" in answer:
            tables.compared(answer["comparison"])
        if outcome.folder is not None:
            tables.files(outcome.folder, outcome.reused)
    return 0 if outcome.satisfied else 1


class EarlyTables:
    """Prints the tables of a verb's answer while the work goes on: the first time all of them, then
    those of the study alone, since parts and settings stay as they are."""

    def __init__(self, progress: Progress, verb: str, silent: bool) -> None:
        self._progress, self._verb, self._silent = progress, verb, silent

    def __call__(self, answer: Mapping[str, Any]) -> None:
        if not self._silent:
            with self._progress.aside():
                _shown(answer, self._verb)
        self._verb = "tolerance"


def _shown(answer: Mapping[str, Any], verb: str) -> None:
    from designer.cli import tables

    shows: dict[str, Callable[[Mapping[str, Any]], None]] = {
        "run": tables.run,
        "synthesise": tables.synthesised,
        "tolerance": tables.tolerance,
    }
    shows[verb](answer)
