"""The command line's application and the options that its verbs share."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from designer.base.errors import DesignerError, InputError
from designer.base.progress import Progress, progress_for
from designer.base.version import __version__

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


Samples = Annotated[
    int | None,
    typer.Option(
        "--samples",
        metavar="N",
        help="Boards in the study [200, all of a list, or the folder's own].",
    ),
]


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


@contextmanager
def session(verbose: bool, quiet: bool, log: Path | None) -> Iterator[Progress]:
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
def compiling(progress: Progress) -> Iterator[None]:
    """Says it when the engine has to be compiled."""
    from designer.base.jit_notice import announced

    with announced(progress.note):
        yield


def print_json(answer: object) -> None:
    from designer.base.plain_json import dumps

    sys.stdout.write(dumps(answer))
    sys.stdout.flush()
