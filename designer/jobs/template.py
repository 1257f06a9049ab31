"""The model files that ``designer new`` writes, from the folder ``templates``."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Literal

from designer.base import atomic_write
from designer.base.errors import InputError
from designer.base.plain_json import dumps
from designer.jobs.second_format import second_format
from designer.model.ascii_sketch import sketch
from designer.model.model_file import json_schema, read_model_file

_FOLDER = Path(__file__).parent / "templates"
SCHEMA = "designer.schema.json"
"""The file beside a model file from which an editor knows the keys."""


def _commented(number: int, circuit: str) -> str:
    text = (_FOLDER / f"format_{number}.toml").read_text("utf-8")
    drawn = "".join(f"# {line}\n" for line in sketch().splitlines())
    return f"#:schema ./{SCHEMA}\n" + text.replace("# SKETCH\n", drawn) + circuit


_CIRCUIT = (_FOLDER / "circuit.toml").read_text("utf-8")
TEXT = _commented(1, _CIRCUIT)
"""A file of format 1."""
SECOND = _commented(
    2,
    _CIRCUIT.replace(
        "saturation = 13.0               # V; ", "# saturation = 13.0             # V; "
    ).replace(
        "where omega = 1 may lie", "where the first mass's own frequency may lie on the board"
    ),
)
"""A file of format 2."""


def write_model_file(
    place: Path, from_: Path | str | None = None, *, format: Literal[1, 2] | None = None
) -> Path:
    """Write a model file to start from, and beside a commented one ``SCHEMA``, for editors; its
    path.

    ``from_`` : a model file to begin with: one of format 1 is rewritten in format 2
    (``second_format``), one of format 2 copied. format : of the commented file, 1 unless given.

    Raises
    ------
    InputError : there is a file of this name, which is left alone, or none can be written there;
        both ``from_`` and ``format``; a file that cannot be read or rewritten.
    """
    text = _text(from_, format)
    try:
        with place.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(place, "PATH", "a file", "a name that is free") from None
    except OSError as error:
        expected = "a file that can be written"
        raise InputError(place, "PATH", error.strerror or str(error), expected) from None
    if from_ is None:
        _write_schema(place.with_name(SCHEMA))
    return place


def _write_schema(place: Path) -> None:
    """Write the JSON Schema of model files, or renew one that an older version wrote."""
    schema = json_schema()
    with contextlib.suppress(OSError):  # the model file is good without it
        if not place.exists() or f'"{schema["title"]}"' in place.read_text("utf-8", "replace"):
            atomic_write.write(place, dumps(schema))


def _text(from_: Path | str | None, format: Literal[1, 2] | None) -> str:
    if from_ is None:
        return SECOND if format == 2 else TEXT
    if format is not None:
        raise InputError(
            None, "--format", format, "none beside --from, whose file becomes format 2"
        )
    return second_format(read_model_file(Path(from_)))
