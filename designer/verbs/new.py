"""The verb ``new``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from designer.base.errors import InputError
from designer.base.printed import tell
from designer.verbs import next_steps
from designer.verbs.declared import Verb, argument, option

if TYPE_CHECKING:
    from designer.answers.catalog_answer import NewAnswer


def new(
    path: Annotated[Path | str, argument("PATH", "The file to write.", reads=Path)] = Path(
        "model.toml"
    ),
    from_: Annotated[
        Path | str | None,
        option(
            "--from", "OLD", "Rewrite this model file in format 2; its other tables stay.", Path
        ),
    ] = None,
    *,
    format: Annotated[
        Literal[1, 2] | None,
        option(
            "--format",
            "1|2",
            "Format of the commented file: 2 for any system [1].",
            reads=int | None,
        ),
    ] = None,
) -> Path:
    """Write a commented model file to start from; an existing file is never replaced.

    Beside a commented file stands its JSON Schema: with it an editor completes the keys and marks
    mistakes. A file of that name that is something else is left alone. ``from_`` : a file of format
    1 is rewritten, one of format 2 copied. The path is returned.

    Raises
    ------
    InputError : there is a file of this name, which is left alone, or none can be written there;
        both ``from_`` and ``format``; a file that cannot be read or rewritten.
    """
    from designer.jobs.template import write_model_file

    if format not in (None, 1, 2):
        raise InputError(None, "--format", format, "1 or 2")
    return write_model_file(Path(path), from_, format=format)


def _files(path: Path) -> list[str]:
    """What was written: beside a commented file its schema."""
    from designer.jobs.template import SCHEMA, SECOND, TEXT

    schema = path.with_name(SCHEMA)
    commented = path.read_text("utf-8") in (TEXT, SECOND) and schema.exists()
    return [str(path), *([str(schema)] if commented else [])]


def printed(path: Path) -> NewAnswer:
    """The JSON object (docs/contract.md)."""
    return {"format": 1, "files": _files(path)}


def show(path: Path) -> None:
    """Where the file is, and what may be done with it."""
    tell(f"written: {', '.join(_files(path))}")
    next_steps.show(next_steps.after_model(path))


VERB = Verb(new, "Design", "designer new hammer.toml --format 2", show, printed, computes=False)
