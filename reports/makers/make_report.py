"""A report from a command line."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Callable, Sequence

from designer.base.errors import DesignerError
from designer.base.progress import progress_for


def make_report(
    report: Callable[..., object], parser: ArgumentParser, arguments: Sequence[str] | None
) -> int:
    """Make the report that a command line asks for; the exit status.

    report : takes what the parser reads, by name. arguments : the command line; None for this
    process's.
    """
    asked = parser.parse_args(arguments)
    try:
        with progress_for(False):
            report(**vars(asked))
    except DesignerError as error:
        print(f"{parser.prog.rpartition('.')[2]}: {error}", file=sys.stderr)
        return error.exit_status
    return 0
