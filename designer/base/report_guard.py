"""A report's folder: files of others are left alone."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from designer.base.atomic_write import PART
from designer.base.errors import InputError
from designer.base.guarded_reading import parse_json, read_bytes


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


def _says(path: Path, command: str) -> bool:
    try:
        data = parse_json(read_bytes(path, "JSON"), path)
    except InputError:
        return False
    return isinstance(data, dict) and data.get("command") == command
