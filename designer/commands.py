"""The verbs of the command line: options in, one JSON object or tables out."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from designer import __version__
from designer.errors import DesignerError, InputError
from designer.progress import Progress, progress_for

if TYPE_CHECKING:
    from designer.job import Outcome

STUDY_KEYS = (
    "format",
    "samples",
    "until",
    "narrow",
    "all_on_one_board",
    "equation_check",
    "responses",
    "maps",
    "provenance",
)
"""Of what a study's JSON object has, in the order in which ``tolerance`` prints it."""
VERBS = tuple(
    "run synthesise synthesize simulate bifurcation tolerance search trade export rules reproduce "
    "catalog new".split()
)

app = typer.Typer(
    name="designer",
    help="Op-amp circuits for mechanical models with clearances, and how many boards will work.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


class EngineName(StrEnum):
    """Which engine simulates."""

    MODEL = "model"
    CIRCUIT = "circuit"
    NGSPICE = "ngspice"


class RungName(StrEnum):
    """How ngspice models the op-amps."""

    IDEAL = "ideal"
    DYNAMIC = "dynamic"
    FULL = "full"


Source = Annotated[
    Path, typer.Argument(metavar="MODEL|DIR", help="A model file (TOML) or a design folder.")
]
Out = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="The design folder to write.")
]
Samples = Annotated[int, typer.Option("--samples", metavar="N", help="Boards in the study.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]
Verbose = Annotated[
    bool, typer.Option("-v", "--verbose", help="Say more; show where a defect of the tool is.")
]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Say nothing but errors.")]
Log = Annotated[
    Path | None, typer.Option("--log", metavar="FILE", help="Append what happens to a file.")
]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Of the random numbers.")]
Jobs = Annotated[
    int | None, typer.Option("--jobs", metavar="N", help="Workers at a time [default: all cores].")
]
Overwrite = Annotated[
    bool,
    typer.Option("--overwrite", help="Replace files that the folder's manifest.json lists."),
]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with unfinished work.")]


def dispatch(arguments: list[str]) -> int:
    """Run a command line; returns the exit status or raises what went wrong."""
    if arguments and not arguments[0].startswith("-") and arguments[0] not in VERBS:
        from designer.schema import one_of

        raise InputError(None, "the verb", arguments[0], one_of(arguments[0], VERBS))
    result = app(args=arguments, prog_name="designer", standalone_mode=False)
    return result if isinstance(result, int) else 0


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
    samples: Samples = 200,
    seed: Seed = 1,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """Everything: parts, circuit, check in ngspice, yield, report."""
    with _session(verbose, quiet, log) as progress, _compiling(progress):
        from designer import job, search_job, study_job
        from designer.options import Options

        options = Options(seed, jobs, samples, overwrite, resume)
        options.check()
        modelfile, folder = job.source(model, out)
        modelfile = search_job.chosen(modelfile, folder, options, progress)
        command = partial(Options.command, verb="run", model=model, out=out)
        outcome = study_job.run_into(modelfile, folder, options, progress, command)
    return _answer(outcome, json, quiet, "run")


@app.command()
def synthesise(
    model: Source,
    out: Out = None,
    compare: Annotated[
        bool, typer.Option("--compare", help="Beside the paper's values; needs no --out.")
    ] = False,
    seed: Seed = 1,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """Choose the parts and write the design folder."""
    with _session(verbose, quiet, log) as progress, _compiling(progress):
        from designer import job, search_job
        from designer.modelfile import read_model_file

        options = job.Options(seed, jobs, overwrite=overwrite, resume=resume)
        options.check()
        if compare and out is None and not model.is_dir():
            outcome = job.compare_in_memory(read_model_file(model), options, progress)
        else:
            modelfile, folder = job.source(model, out)
            modelfile = search_job.chosen(modelfile, folder, options, progress)
            outcome = job.synthesise_into(modelfile, folder, options, progress, compare=compare)
    return _answer(outcome, json, quiet, "synthesise")


app.command("synthesize", hidden=True)(synthesise)


@app.command()
def simulate(
    model: Source,
    omega: Annotated[
        list[float] | None,
        typer.Option("--omega", metavar="W", help="Dimensionless frequency; may be repeated."),
    ] = None,
    engine: Annotated[EngineName, typer.Option("--engine", help="What simulates.")] = (
        EngineName.MODEL
    ),
    rung: Annotated[
        RungName, typer.Option("--rung", help="The op-amps' model, with --engine ngspice.")
    ] = RungName.IDEAL,
    seed: Seed = 1,
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
    """The responses: those that the model file wants, or what is reached from rest at --omega."""
    with _session(verbose, quiet, log) as progress, _compiling(progress):
        from designer import job

        job.Options(seed, jobs).check()
        answer, found = job.simulate_answer(
            model, tuple(omega or ()), engine.value, jobs, progress, plots, overwrite, rung.value
        )
    if json:
        _print_json(answer)
    elif not quiet:
        from designer import show

        show.simulated(answer)
        if plots is not None:
            show.pictures(plots, answer["files"])
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
    with _session(verbose, quiet, log):
        from designer.catalog import load_catalog

        held = load_catalog()
        if check is not None:
            from designer.opamp_bench import checks

            measured = checks(held.opamp(check))
    if check is not None:
        if json:
            rows = [{**asdict(row), "agrees": row.agrees} for row in measured]
            _print_json({"format": 1, "opamp": check, "checks": rows, "hash": held.hash})
        elif not quiet:
            from designer import show

            show.checks(check, measured)
        return 0 if all(row.agrees for row in measured) else 1
    if json:
        _print_json(
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
        from designer import show

        show.catalog(held)
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
    with _session(verbose, quiet, log):
        from designer.starter import TEXT

        try:
            with path.open("x", encoding="utf-8") as stream:
                stream.write(TEXT)
        except FileExistsError:
            raise InputError(path, "PATH", "a file", "a name that is free") from None
        except OSError as error:
            raise InputError(
                path, "PATH", error.strerror or str(error), "a file that can be written"
            ) from None
    if json:
        _print_json({"format": 1, "files": [str(path)]})
    elif not quiet:
        print(f"written: {path}", file=sys.stderr)
    return 0


@contextmanager
def _session(verbose: bool, quiet: bool, log: Path | None) -> Iterator[Progress]:
    """Logging as asked, progress on standard error."""
    logger = logging.getLogger("designer")
    logger.handlers.clear()
    logger.propagate = False
    logger.setLevel(logging.DEBUG)
    logger.addHandler(logging.NullHandler())
    if log is not None:
        try:
            handler: logging.Handler = logging.FileHandler(log, encoding="utf-8")
        except OSError as error:
            raise InputError(
                log, "--log", error.strerror or str(error), "a file that can be written"
            ) from None
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        logger.addHandler(handler)
    logger.info("designer %s %s", __version__, " ".join(sys.argv[1:]))
    with progress_for(quiet) as progress:
        try:
            yield progress
        except DesignerError as error:
            logger.error("%s", error)
            raise
        except Exception:
            logger.exception("internal error")
            raise
        finally:
            for each in logger.handlers:
                each.close()
            logger.handlers.clear()
            logger.addHandler(logging.NullHandler())


@contextmanager
def _compiling(progress: Progress) -> Iterator[None]:
    """Says it when the engine has to be compiled."""
    from designer.first_use import announced

    with announced(progress.note):
        yield


def _answer(outcome: Outcome, json: bool, quiet: bool, verb: str) -> int:
    answer = outcome.answer
    if verb == "tolerance":
        answer = {**{k: answer[k] for k in STUDY_KEYS}, "cost": answer["cost"]["study"]}
    if json:
        _print_json(answer)
    elif not quiet:
        from designer import show

        shows: dict[str, Callable[[dict[str, Any]], None]] = {
            "run": show.run,
            "synthesise": show.synthesised,
            "tolerance": show.tolerance,
        }
        shows[verb](answer)
        if "comparison" in answer:
            show.compared(answer["comparison"])
        if outcome.folder is not None:
            show.files(outcome.folder, outcome.reused)
    return 0 if outcome.satisfied else 1


def _print_json(answer: object) -> None:
    from designer.jsonout import dumps

    sys.stdout.write(dumps(answer))
    sys.stdout.flush()


# The verbs that stand in files of their own register themselves.
from designer import (  # noqa: E402
    commands_bifurcation,  # noqa: F401
    commands_export,  # noqa: F401
    commands_reproduce,  # noqa: F401
    commands_rules,  # noqa: F401
    commands_search,  # noqa: F401
    commands_tolerance,  # noqa: F401
    commands_trade,  # noqa: F401
)
