"""Files that another file names: inside its folder, and nowhere else."""

from __future__ import annotations

from pathlib import Path

from designer.base.errors import InputError


def inside(folder: Path, name: str, field: str) -> Path:
    """The file ``name`` of a folder.

    Raises
    ------
    InputError : no file, or not inside the folder (symbolic links count as outside); ``field`` is
        where the name was found.
    """
    expected = f"a file inside {folder}, no symbolic link"
    relative = Path(name)
    if relative.is_absolute() or not relative.parts or ".." in relative.parts:
        raise InputError(None, field, name, expected)
    root = folder.resolve()
    path = root / relative
    if path.resolve() != path:
        raise InputError(None, field, name, expected)
    if not path.exists():
        raise InputError(None, field, f"{name}, which does not exist", f"a file in {folder}")
    if not path.is_file():
        raise InputError(None, field, name, expected)
    return path
