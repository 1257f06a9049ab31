"""What can go wrong, and the exit status that says so.

Every error that a user can cause or meet is one of these; the command line turns it into a
message on standard error and an exit status (docs/contract.md): 2 for bad input, 3 for a missing
environment. Anything else that escapes is a defect of the tool.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar, Final

from designer.base.printed import one_line, printable


class Absent(Enum):
    """What was found where nothing stands; an enumeration, so that workers pass it on as it is."""

    MISSING = "missing"


MISSING: Final = Absent.MISSING
"""``found`` of an ``InputError`` about a field, an option or a file that is not there."""


MOST_PROBLEMS = 30
"""Problems of one input that a message has a line for; the rest is counted."""


class DesignerError(Exception):
    """Base of the errors that the tool raises on purpose; ``exit_status`` is what a shell sees."""

    exit_status = 1


class InputError(DesignerError):
    """Bad input: names the file, the field, what was found and what was expected.

    Parameters
    ----------
    file : path or short name of where the input came from (``None`` for a function argument).
    field : dotted name of the offending field, such as ``model.k0`` or ``response[2].omega``.
    found : what stands there now; ``MISSING`` where nothing does.
    expected : what would have been accepted, in words.
    """

    exit_status = 2
    longest_found: ClassVar[int] = 200
    """Characters of what was found that are told: it may be anything."""

    def __init__(self, file: Path | str | None, field: str, found: object, expected: str) -> None:
        self.file = None if file is None else str(file)
        self.field = field
        self.found = found
        self.expected = expected
        prefix = f"{one_line(self.file)}: " if self.file else ""
        text = found if isinstance(found, str) else _written(found)
        stands = " is missing" if found is MISSING else f": found {_clip(text, self.longest_found)}"
        super().__init__(f"{prefix}{one_line(field)}{stands}, expected {printable(expected)}")


class InputErrors(InputError):
    """Several things wrong with one input: an ``InputError`` about the first whose message has a
    line for each.

    Parameters
    ----------
    problems : at least one; those of an ``InputErrors`` among them count one by one.
    """

    def __init__(self, problems: Sequence[InputError]) -> None:
        first = problems[0]
        super().__init__(first.file, first.field, first.found, first.expected)
        self.problems = tuple(each for problem in problems for each in problems_in(problem))
        lines = [str(problem) for problem in self.problems[:MOST_PROBLEMS]]
        more = len(self.problems) - MOST_PROBLEMS
        self.args = ("\n".join([*lines, *([f"and {more} more"] if more > 0 else [])]),)


def problems_in(error: InputError) -> tuple[InputError, ...]:
    """Each thing that an error says is wrong."""
    return error.problems if isinstance(error, InputErrors) else (error,)


class Unreachable(InputError):
    """The target cannot be met with this catalogue: names the conditions that bind."""

    longest_found = 2000


class ResponseNotFound(DesignerError):
    """A wanted response that the model does not show: the answer is no.

    answer : the JSON object, with what was found instead.
    """

    def __init__(self, message: str, answer: Mapping[str, Any] | None = None) -> None:
        super().__init__(message)
        self.answer = dict(answer or {})


class EnvironmentMissing(DesignerError):
    """A program or library that the work needs is not on this machine; says what to install."""

    exit_status = 3


def _written(found: object) -> str:
    try:
        return repr(found)
    except ValueError:  # more digits than Python writes
        return f"a very large {type(found).__name__}"


def _clip(text: str, limit: int) -> str:
    """One line, printable, at most ``limit`` characters: foreign text stays harmless."""
    flat = "".join(ch if ch.isprintable() else "?" for ch in text)
    return flat if len(flat) <= limit else flat[: limit - 1] + "…"
