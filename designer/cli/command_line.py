"""The whole command line: every verb is registered here, and a line of words finds its verb."""

from __future__ import annotations

from functools import cache
from typing import cast

import typer
import typer.core
import typer.main

from designer.base.errors import InputError
from designer.cli import bifurcation, explore, make_verbs, tools, verbs
from designer.cli.app import VERBS, app

REGISTERED = (verbs, make_verbs, bifurcation, explore, tools)
"""The modules of the verbs: importing one registers what it has."""


@cache  # typer reads the signatures of all verbs
def application() -> typer.core.TyperGroup:
    """The parser with every verb."""
    return cast(typer.core.TyperGroup, typer.main.get_command(app))


def dispatch(arguments: list[str]) -> int:
    """Run a command line; returns the exit status or raises what went wrong."""
    if arguments and not arguments[0].startswith("-") and arguments[0] not in VERBS:
        from designer.base.schema import one_of

        raise InputError(None, "the verb", arguments[0], one_of(arguments[0], VERBS))
    result = application().main(arguments, prog_name="designer", standalone_mode=False)
    return result if isinstance(result, int) else 0
