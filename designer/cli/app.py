"""The application, the options that its verbs share, and the way in which every verb runs."""

from __future__ import annotations

import inspect
import itertools
import logging
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer
import typer.core

from designer.base.errors import DesignerError, InputError, ResponseNotFound
from designer.base.printed import printable
from designer.base.progress import Progress, progress_for
from designer.base.version import __version__

VERBS = tuple(
    "run synthesise synthesize simulate bifurcation tolerance search trade export rules bench "
    "explore reproduce catalog new".split()
)
GROUPS = ("Design", "Study", "Explore", "Make")
"""The headings of the verbs in the help, in their order."""


class GroupedVerbs(typer.core.TyperGroup):
    """The verbs, under headings in the help."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write each group with the first sentence of each of its verbs."""
        verbs = [self.commands[name] for name in self.list_commands(ctx)]
        for group in GROUPS:
            rows = [
                (str(each.name), each.get_short_help_str(limit=200))
                for each in verbs
                if not each.hidden and getattr(each, "rich_help_panel", None) == group
            ]
            with formatter.section(group):
                formatter.write_dl(rows)


app = typer.Typer(
    name="designer",
    cls=GroupedVerbs,
    help="Op-amp circuits for mechanical models with clearances, and how many boards will work.",
    epilog="designer VERB --help says more, with an example.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def option(names: str, metavar: str | None = None, text: str = "") -> Any:
    """An option by its spellings, such as "-q --quiet", with its help."""
    return typer.Option(*names.split(), metavar=metavar, help=text)


SOURCE = "model"
"""Name of the argument that is a ``Source``."""
Source = Annotated[
    Path, typer.Argument(metavar="MODEL|DIR", help="A model file (TOML) or a design folder.")
]
Out = Annotated[Path | None, option("--out", "DIR", "The design folder to write.")]
Samples = Annotated[
    int | None,
    option("--samples", "N", "Boards in the study [200, all of a list, or the folder's own]."),
]
Seed = Annotated[int, option("--seed", "N", "Seed of the random numbers.")]
OwnSeed = Annotated[
    int | None, option("--seed", "N", "Seed of the random numbers [1, or the folder's own].")
]
_SHARED: dict[str, tuple[Any, Any]] = {
    "jobs": (int | None, option("--jobs", "N", "Workers at a time [default: all cores].")),
    "overwrite": (
        bool,
        option("--overwrite", None, "Replace files that the folder's manifest.json lists."),
    ),
    "resume": (bool, option("--resume", None, "Go on with work that was interrupted.")),
    "json": (bool, option("--json", None, "Print one JSON object on standard output.")),
    "verbose": (
        bool,
        option("-v --verbose", None, "Show where in the code a defect of the tool is."),
    ),
    "quiet": (bool, option("-q --quiet", None, "Print nothing but errors.")),
    "log": (Path | None, option("--log", "FILE", "Append a log of the work to this file.")),
}
"""Type and declaration of the options that verbs share; off, or None, where nothing is said."""


Show = Callable[[Mapping[str, Any]], None]
"""Prints an answer as tables."""


@dataclass(frozen=True)
class Output:
    """The answer of a verb, in the ways in which it can be printed."""

    json: Mapping[str, Any]
    """The object for ``--json``."""
    show: Callable[[], None] = lambda: None
    """Prints the tables for people."""
    satisfied: bool = True
    """Whether the answer is yes."""


@dataclass(frozen=True)
class Session:
    """One call of the command line."""

    progress: Progress
    """Told how far the work is."""
    tables: bool
    """Whether tables for people are wanted."""

    def early(self, first: Show, later: Show) -> Show:
        """What shows an answer while the work goes on: in one way, and then in another."""
        ways = itertools.chain([first], itertools.repeat(later))

        def show(answer: Mapping[str, Any]) -> None:
            if self.tables:
                with self.progress.aside():
                    next(ways)(answer)

        return show


def verb(
    group: str, example: str, *shared: str, json: bool = True, computes: bool = True
) -> Callable[[Callable[..., Output]], Callable[..., int]]:
    """Register a function as a verb.

    The function takes a ``Session``, its own options, and the values of ``shared`` as keywords.
    Its verb has, after its own options, the shared ones and those of every verb.

    group : one of ``GROUPS``. example : a command line, which the help shows. json : whether the
    verb has a JSON object. computes : whether it may need the exact engine, whose
    compilation is then announced.
    """
    every = ("json", "verbose", "quiet", "log") if json else ("verbose", "quiet", "log")

    def register(function: Callable[..., Output]) -> Callable[..., int]:
        @wraps(function)
        def command(
            *, json: bool = False, verbose: bool, quiet: bool, log: Path | None, **words: Any
        ) -> int:
            try:
                with _logged(log), progress_for(quiet) as progress:
                    _refuse_at_once(words.get(SOURCE))
                    with _announced(progress) if computes else nullcontext():
                        output = function(Session(progress, not (json or quiet)), **words)
            except ResponseNotFound as error:
                if json:
                    print_json(error.answer)
                raise
            if json:
                print_json(output.json)
            elif not quiet:
                output.show()
            return 0 if output.satisfied else 1

        _, *specific, _ = inspect.signature(function, eval_str=True).parameters.values()
        parameters = [*specific, *(_parameter(name) for name in (*shared, *every))]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        command.__annotations__ = {p.name: p.annotation for p in parameters}
        app.command(rich_help_panel=group, epilog=f"\b\nExample:\n  {example}")(command)
        return command

    return register


def _parameter(name: str) -> inspect.Parameter:
    kind, declaration = _SHARED[name]
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=False if kind is bool else None,
        annotation=Annotated[kind, declaration],
    )


class _LogLine(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        return printable(super().format(record))


@contextmanager
def _logged(log: Path | None) -> Iterator[None]:
    """The log as asked."""
    logger = logging.getLogger("designer")
    logger.handlers.clear()
    logger.propagate = False
    logger.setLevel(logging.DEBUG)
    logger.addHandler(logging.NullHandler())
    if log is not None:
        try:
            handler = logging.FileHandler(log, encoding="utf-8")
        except OSError as error:
            raise InputError(
                log, "--log", error.strerror or str(error), "a file that can be written"
            ) from None
        handler.setFormatter(_LogLine("%(asctime)s %(levelname)s %(message)s"))
        logger.addHandler(handler)
    logger.info("designer %s %s", __version__, " ".join(sys.argv[1:]))
    try:
        yield
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


def _refuse_at_once(source: object) -> None:
    """Read a verb's model file, if that is what it is given, before the engine is imported: what is
    wrong in it is told at once."""
    if isinstance(source, Path) and source.is_file():
        from designer.folders.model_source import model_file

        model_file(source)


@contextmanager
def _announced(progress: Progress) -> Iterator[None]:
    """Says it when the engine has to be compiled."""
    from designer.base.jit_notice import announced

    with announced(progress.note):
        yield


def print_json(answer: object) -> None:
    from designer.base.plain_json import dumps

    sys.stdout.write(dumps(answer))
    sys.stdout.flush()
