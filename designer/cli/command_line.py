"""The whole command line: every verb is registered here, and a line of words finds its verb."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Annotated, cast

import typer
import typer.core
import typer.main

from designer.base.defaults import cores
from designer.base.errors import EnvironmentMissing, InputError
from designer.base.version import __version__
from designer.cli.app import HELP, SOURCE, VERBS, empty_application, register

OTHER_SPELLINGS = {"synthesize": "synthesise"}
"""Verbs that the help does not list, and those that they are."""


def _designer(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version, and what it works with here.")
    ] = False,
) -> None:
    if version:
        print(f"designer {__version__}")
        for name, version_text in _surroundings():
            print(f"{name:8} {version_text}")
        raise typer.Exit


def _surroundings() -> Iterator[tuple[str, str]]:
    """The programs that verbs call and the cores that they use, as they are on this machine."""
    from designer.design_rules.kicad_program import kicad_version
    from designer.linear_network.solver_check import solver_words
    from designer.spice.batch_backend import program_version

    yield "Python", platform.python_version()
    try:
        yield "ngspice", program_version()
    except EnvironmentMissing as missing:
        yield "ngspice", str(missing)
    yield "KiCad", kicad_version() or "none (kicad-cli 9 checks boards in designer rules)"
    yield "solver", solver_words()
    yield "cores", str(cores())


@cache
def application(verbs: tuple[str, ...] = VERBS) -> typer.core.TyperGroup:
    """The parser with these verbs, which are imported now."""
    app = empty_application()
    app.callback(invoke_without_command=True)(_designer)
    for name in verbs:
        module = import_module(f"designer.verbs.{OTHER_SPELLINGS.get(name, name)}")
        register(app, name, module.VERB, hidden=name in OTHER_SPELLINGS)
        for kind in module.VERB.kinds:
            register(app, name, module.VERB, kind=kind, hidden=True)
    return cast(typer.core.TyperGroup, typer.main.get_command(app))


def _names_kind(parser: typer.core.TyperGroup, arguments: list[str]) -> bool:
    """Whether the word after the verb's is one of its kinds. A model or a folder of the same name
    is meant where no other one follows.

    Raises
    ------
    InputError : it is none, and another word follows that is no option.
    """
    (verb, word), following = arguments[:2], arguments[2:]
    kinds = [name.split()[1] for name in parser.commands if name.startswith(f"{verb} ")]
    if not kinds or word.startswith("-"):
        return False
    if word not in kinds:
        if following and not following[0].startswith("-"):
            from designer.base.schema import one_of

            raise InputError(None, verb, word, f"{one_of(word, kinds)}, or a model or a folder")
        return False
    if set(following) & set(HELP) or not Path(word).exists():
        return True
    command = parser.commands[f"{verb} {word}"]
    context = command.make_context(word, following, resilient_parsing=True)
    return context.params[SOURCE] is not None


def dispatch(arguments: list[str]) -> int:
    """Run a command line; returns the exit status or raises what went wrong."""
    asked = tuple(arguments[:1]) if arguments and not arguments[0].startswith("-") else VERBS
    if asked != VERBS and asked[0] not in VERBS:
        from designer.base.schema import one_of

        raise InputError(None, "the verb", arguments[0], one_of(arguments[0], VERBS))
    parser = application(asked)
    if len(arguments) > 1 and _names_kind(parser, arguments):
        arguments = [" ".join(arguments[:2]), *arguments[2:]]
    result = parser.main(arguments, prog_name="designer", standalone_mode=False)
    return result if isinstance(result, int) else 0
