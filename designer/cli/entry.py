"""The command ``designer``: exit statuses and messages; ``cli.command_line`` has the verbs.

Worker processes import this module again, so it imports nothing that takes time.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import os
import sys
import traceback
from collections.abc import Sequence

from designer.base.defaults import COLLECTION
from designer.base.errors import DesignerError, EnvironmentMissing
from designer.base.printed import tell

INTERRUPTED = 130
MOST_TOLD = 2000
"""Characters of a usage error: it repeats the word that it is about."""
_INTERRUPTED = "interrupted; --resume goes on with what has been written, if anything was"


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit status (docs/contract.md)."""
    # Whatever starts a Python from here on takes no module from the working directory.
    os.environ.update(PYTHONSAFEPATH="1")
    # The matrices are small: a second thread for one costs more time than it saves.
    for library in ("OPENBLAS", "MKL", "BLIS"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    gc.set_threshold(*COLLECTION)
    atexit.register(gc.freeze)  # a last look for circles takes a fifth of a second
    sys.exit(status(sys.argv[1:] if arguments is None else list(arguments)))


def status(arguments: list[str]) -> int:
    """Run the command line; the exit status."""
    try:
        return _status(arguments)
    except BrokenPipeError:  # whoever read standard output has seen enough
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _status(arguments: list[str]) -> int:
    try:
        from designer.cli import command_line

        code = command_line.dispatch(arguments)
        if code == INTERRUPTED:  # the parser has caught it
            _say(_INTERRUPTED)
        return code
    except KeyboardInterrupt:
        _say(_INTERRUPTED)
        return INTERRUPTED
    except DesignerError as error:
        _say(f"error: {error}")
        return error.exit_status
    except BrokenPipeError:
        raise
    except ImportError as error:
        library = (error.name or "").partition(".")[0]
        if library in ("", "designer"):
            return _unexpected(error, arguments)
        why = f"the library {library} is missing or broken ({print_line(str(error))})"
        _say(f"error: {why}; install this tool anew, with its libraries")
        return EnvironmentMissing.exit_status
    except Exception as error:
        return _unexpected(error, arguments)


def _unexpected(error: Exception, arguments: Sequence[str]) -> int:
    """Usage errors of the parser, whichever library it comes with; else a defect of the tool."""
    format_message = getattr(error, "format_message", None)
    code = getattr(error, "exit_code", None)
    if callable(format_message) and isinstance(code, int):
        _say(f"error: {str(format_message())[:MOST_TOLD]}")
        return code
    if type(error).__name__ == "Abort":
        _say(_INTERRUPTED)
        return INTERRUPTED
    kind = type(error).__name__
    _say(f"internal error: {kind}: {print_line(str(error))}; please report it (-v shows where)")
    if "-v" in arguments or "--verbose" in arguments:
        tell("".join(traceback.format_exception(error)))
    return 1


def print_line(text: str) -> str:
    return " ".join(text.split())[:300]


def _say(text: str) -> None:
    tell(f"designer: {text}")
