"""The application: each verb's declaration made a command, and the way in which every verb runs."""

from __future__ import annotations

import inspect
import itertools
import logging
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

import typer
import typer.core

from designer.base.errors import DesignerError, InputError, ResponseNotFound
from designer.base.printed import printable, tell
from designer.base.progress import Progress, Show, progress_for
from designer.base.version import __version__
from designer.verbs.declared import GROUPS, Kind, Verb, Word

VERBS = tuple(
    "run synthesise synthesize simulate bifurcation tolerance search trade export rules bench "
    "explore reproduce catalog new".split()
)


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


def empty_application() -> typer.Typer:
    """The command line without its verbs."""
    return typer.Typer(
        name="designer",
        cls=GroupedVerbs,
        help=(
            "Op-amp circuits for mechanical models with clearances, and how many boards will work."
        ),
        epilog="designer VERB --help says more, with an example.",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        context_settings={"help_option_names": list(HELP)},
    )


_EVERY: tuple[inspect.Parameter, ...] = tuple(
    inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=False if kind is bool else None,
        annotation=Annotated[kind, typer.Option(*names, metavar=metavar, help=text)],
    )
    for name, kind, names, metavar, text in (
        ("json", bool, ("--json",), None, "Print one JSON object on standard output."),
        (
            "verbose",
            bool,
            ("-v", "--verbose"),
            None,
            "Show where in the code a defect of the tool is.",
        ),
        ("quiet", bool, ("-q", "--quiet"), None, "Print nothing but errors."),
        ("log", Path | None, ("--log",), "FILE", "Append a log of the work to this file."),
    )
)
"""The options of every verb, after its own."""
HELP = ("-h", "--help")
"""The spellings that ask for a help page."""
SOURCE = "model"
"""Name of a parameter that is a model file or a design folder."""


def register(
    app: typer.Typer, name: str, verb: Verb, *, kind: Kind | None = None, hidden: bool = False
) -> None:
    """Give an application a verb by its declaration, or one of the things that it does."""
    own = tuple(verb.words(kind))

    def command(
        *, json: bool = False, verbose: bool, quiet: bool, log: Path | None, **words: Any
    ) -> int:
        # A parameter without a value has the function's own default.
        given = {key: _plain(value) for key, value in words.items() if value not in (None, [])}
        given |= {} if kind is None else kind.given
        try:
            with _logged(log), progress_for(quiet) as progress, verb.beside(**given):
                for parameter, word, _ in own:
                    _look(given.get(parameter.name), word.names[-1] if word.names else word.metavar)
                _refuse_at_once(given.get(SOURCE))
                tellers = {
                    "progress": progress,
                    "shown": _early(verb, progress, tables=not (json or quiet)),
                }
                taken = inspect.signature(verb.function).parameters
                given |= {key: value for key, value in tellers.items() if key in taken}
                with _announced(progress) if verb.computes else nullcontext():
                    result = verb.function(**given)
        except ResponseNotFound as error:
            if json:
                print_json(error.answer)
            raise
        if json and verb.json is not None:
            print_json(verb.json(result))
        elif not quiet:
            verb.show(result)
        return 0 if verb.satisfied(result) else 1

    parameters = [_parameter(*each) for each in own]
    parameters += [p for p in _EVERY if p.name != "json" or verb.json is not None]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    summary = (inspect.getdoc(verb.function) or "").split("\n\n")[0]
    command.__doc__ = summary if kind is None else kind.help
    of_kinds = "".join(f"\n  designer {name} {each.name} --help" for each in verb.kinds)
    several = f"\n\n\b\nOne thing at a time:{of_kinds}" if of_kinds and kind is None else ""
    app.command(
        name if kind is None else f"{name} {kind.name}",
        hidden=hidden,
        rich_help_panel=verb.group,
        epilog=f"\b\nExample:\n  {(kind or verb).example}{several}",
    )(command)


def _parameter(own: inspect.Parameter, word: Word, reads: Any) -> inspect.Parameter:
    """A parameter as the parser reads it. One with several values has none where none is given."""
    several = get_origin(reads) is list
    if several and get_origin(get_args(reads)[0]) is Literal:  # the parser has no list of literals
        names = get_args(get_args(reads)[0])
        reads = list[StrEnum(own.name, {str(name): name for name in names})]  # type: ignore[misc]
    declared: Any = (
        typer.Option(*word.names, metavar=word.metavar, help=word.help)
        if word.names
        else typer.Argument(metavar=word.metavar, help=word.help)
    )
    return inspect.Parameter(
        own.name,
        inspect.Parameter.KEYWORD_ONLY,
        default=None if several and own.default == () else own.default,
        annotation=Annotated[reads | None if several else reads, declared],
    )


def _plain(value: Any) -> Any:
    """Members of an enumeration as the texts that they are."""
    if isinstance(value, list):
        return [_plain(each) for each in value]
    return value.value if isinstance(value, StrEnum) else value


def _early(verb: Verb, progress: Progress, *, tables: bool) -> Show:
    """What shows an answer while the work goes on: the parts, then a study in one way, and from
    then on in another."""
    first, later = verb.early or (None, None)
    ways = itertools.chain([first], itertools.repeat(later))

    def show(answer: Mapping[str, Any]) -> None:
        way = next(ways) if "samples" in answer else verb.parts
        if tables and way is not None:
            with progress.aside():
                way(answer)

    return show


class _LogFile(logging.FileHandler):
    """A log that work does without where it can no longer be written: the disk is full."""

    lost = False
    """Whether that has been said."""

    def handleError(self, record: logging.LogRecord) -> None:
        if not self.lost:
            self.lost, error = True, sys.exc_info()[1]
            reason = getattr(error, "strerror", None) or error
            tell(f"designer: {self.baseFilename}: the log ends here: {reason}")

    def close(self) -> None:
        with suppress(OSError):  # what was said already
            super().close()


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
            handler = _LogFile(log, encoding="utf-8")
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


def _look(value: object, field: str | None) -> None:
    """Refuse paths at which there is nothing to be seen: no verb need then be ready for that.

    Raises
    ------
    InputError : a name that is too long, a folder that may not be entered, links in a circle.
    """
    for path in value if isinstance(value, list) else [value]:
        if isinstance(path, Path):
            try:
                path.stat()
            except (FileNotFoundError, NotADirectoryError):  # it may be made, or is missed later
                continue
            except OSError as error:
                found = error.strerror or str(error)
                raise InputError(path, str(field), found, "a path that can be followed") from None


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
