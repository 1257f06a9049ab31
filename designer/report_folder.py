"""A report's folder: files of others are left alone, and each file appears whole or not at all."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Collection
from pathlib import Path

from designer.errors import InputError

PART = ".part"
"""Ends the name of a file that is being written."""


def check_ours(out: Path, names: Collection[str], data: str, command: str) -> None:
    """Whether the folder is empty, or holds an earlier report and nothing else.

    names : of the report's files. data : of these, the JSON file whose "command" is ``command``.

    Raises
    ------
    InputError : it is neither.
    OSError : the folder cannot be read.
    """
    there = sorted(path.name for path in out.iterdir())
    foreign = [name for name in there if name.removeprefix(".").removesuffix(PART) not in names]
    if foreign:
        found = foreign[0]
    elif there and not _says(out / data, command):
        found = there[0]
    else:
        return
    raise InputError(
        out / found,
        "--out",
        "a file that is not of an earlier report",
        "an empty folder, or one that this command made",
    )


def write(path: Path, content: str | bytes) -> None:
    """Write a file all at once.

    Raises
    ------
    InputError : it cannot be written.
    """
    partial = path.with_name(f".{path.name}{PART}")
    try:
        partial.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)
        os.replace(partial, path)
    except OSError as error:
        expected = "a place that can be written"
        raise InputError(path, "--out", error.strerror or str(error), expected) from None
    finally:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)


def _says(path: Path, command: str) -> bool:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(data, dict) and data.get("command") == command
