"""The folders of a catalogue: which are searched, in which order, and what they hold.

1. the folder that the caller names, then those of the environment variable DESIGNER_CATALOGS
2. the user's own: ``catalogs`` in the configuration folder of this system
3. the catalogue that comes with the tool
"""

from __future__ import annotations

import hashlib
import importlib.resources
import os
from dataclasses import dataclass
from pathlib import Path

import platformdirs

from designer.base.errors import MISSING, InputError, InputErrors
from designer.base.guarded_reading import read_bytes, reading
from designer.catalog.read import Entry, read_catalog_file

ENVIRONMENT = "DESIGNER_CATALOGS"
"""Environment variable: folders to search first, separated as in PATH."""

LAYOUTS = "bom-layouts"
"""Folder of layouts beside the catalogue's files (``board.bom_layouts``)."""


@dataclass(frozen=True)
class Contents:
    """What the folders hold; an entry of the same sort and name in an earlier one counts."""

    entries: tuple[Entry, ...]
    """What the files hold, earlier folders first."""
    hash: str
    """Hash of the content of all files, wherever they lie."""
    folders: tuple[Path, ...]
    """The folders that were read, in order."""


def read_folders(extra: Path | None = None) -> Contents:
    """Read all catalogue folders, ``extra`` first.

    Raises
    ------
    InputError : a named folder does not exist, or a file in one is wrong; names file and field.
    """
    folders = _folders(extra)
    digest = hashlib.sha256()
    held: dict[tuple[type[Entry], str], Entry] = {}
    for folder in folders:
        for key, entry in _read_folder(folder, digest).items():
            held.setdefault(key, entry)
    return Contents(tuple(held.values()), digest.hexdigest(), folders)


def _read_folder(folder: Path, digest: hashlib._Hash) -> dict[tuple[type[Entry], str], Entry]:
    """The entries of a folder, files in the order of their names; other files are left alone."""
    found: dict[tuple[type[Entry], str], Entry] = {}
    with reading(folder, "a folder of catalogue files", "the folder"):
        files = [path for path in folder.iterdir() if path.suffix in (".toml", ".csv")]
    for path in sorted(files, key=lambda each: each.name):
        content, entries = read_catalog_file(path)
        digest.update(f"{path.name} {len(content)}\n".encode())
        digest.update(content)
        twice = []
        for entry in entries:
            key = type(entry), entry.name
            if key in found:
                expected = "names that this folder uses once"
                twice.append(InputError(path, "name", entry.name, expected))
            found[key] = entry
        if twice:
            raise twice[0] if len(twice) == 1 else InputErrors(twice)
    for path in sorted((folder / LAYOUTS).glob("*.toml"), key=lambda each: each.name):
        content = read_bytes(path, "a layout that can be read")
        digest.update(f"{LAYOUTS}/{path.name} {len(content)}\n".encode())
        digest.update(content)
    return found


def _folders(extra: Path | None) -> tuple[Path, ...]:
    named = [] if extra is None else [("the catalogue folder", Path(extra))]
    listed = os.environ.get(ENVIRONMENT, "").split(os.pathsep)
    named += [(ENVIRONMENT, Path(text)) for text in listed if text]
    for origin, folder in named:
        if not folder.is_dir():
            raise InputError(None, origin, str(folder), "a folder of catalogue files")
    own = Path(platformdirs.user_config_dir("designer", appauthor=False)) / "catalogs"
    return (
        *(folder for _, folder in named),
        *([own] if own.is_dir() else []),
        _shipped(),
    )


def _shipped() -> Path:
    """In a wheel inside the package; in a checkout at its top level, beside the package."""
    package = Path(str(importlib.resources.files("designer")))
    for folder in (package / "catalogs", package.parent / "catalogs"):
        if folder.is_dir():
            return folder
    raise InputError(None, "catalogs", MISSING, "the catalogue that comes with the tool")
