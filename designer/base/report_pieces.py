"""The pieces of a long report, each on disk as soon as it is done.

A piece is a JSON file in the folder ``cases`` of the report, with a key that says what it was made
of. The report's own files are made of the pieces; a file of somebody else's is not written over.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from designer.base.atomic_write import write
from designer.base.errors import InputError

FOLDER = "cases"


class CaseStore:
    """The pieces of one report.

    Parameters
    ----------
    out : the report's folder, which is made. files : names of the report's own files. resume : go
    on with the pieces that are there. place : what messages call ``out``, where the command has no
    ``--out`` and no ``--resume``, since it always goes on.

    Raises
    ------
    InputError : pieces are there already and ``resume`` is not given; a file stands where one of
        the report's goes, and nothing that it could be made of; the folder cannot be made.
    """

    def __init__(
        self, out: Path, files: Iterable[str], *, resume: bool, place: str | None = None
    ) -> None:
        self._out, self._folder, self._files = out, out / FOLDER, tuple(files)
        self._place, self._option = place or "--out", place or "--resume"
        self._keys: str | Mapping[str, str] = {}
        begun = self._folder.is_dir() and any(self._folder.iterdir())
        if begun and not resume:
            raise InputError(self._folder, self._place, "results", "an empty folder, or --resume")
        if not begun:
            self._check_free()
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            said = error.strerror or str(error)
            raise InputError(
                self._folder, self._place, said, "a place that can be written"
            ) from None

    def expect(self, keys: str | Mapping[str, str]) -> None:
        """Before the first piece: keys : of all that decides the pieces, one for all of them, or
        one for each by its name; others in the folder are then left alone.

        Raises
        ------
        InputError : a piece that is there was made with other settings; or none is there, and a
            file stands where one of the report's goes.
        """
        self._keys = keys
        there = sorted(self._folder.glob("*.json"))
        mine = [p for p in there if isinstance(keys, str) or p.stem in keys]
        if not [p for p in mine if self._read(p)]:
            self._check_free()

    def piece(self, name: str, make: Callable[[], Mapping[str, Any]]) -> dict[str, Any]:
        """A piece as it was kept, or made now and kept.

        Raises
        ------
        InputError : what is there was made with other settings, or is no piece.
        """
        path = self._folder / f"{name}.json"
        known = self._read(path)
        if known is None:
            known = {"key": self._key(name), **make()}
            text = json.dumps(known, indent=1, ensure_ascii=False, allow_nan=False)
            write(path, text + "\n")
        return {k: v for k, v in known.items() if k != "key"}

    def _key(self, name: str) -> str:
        return self._keys if isinstance(self._keys, str) else self._keys[name]

    def _check_free(self) -> None:
        for name in self._files:
            if (self._out / name).exists():
                found = "a file that the report would replace, and no piece of it to go on with"
                raise InputError(self._out / name, self._place, found, "a folder without it")

    def _read(self, path: Path) -> dict[str, Any] | None:
        known = read_piece(path, self._option)
        if known is not None and known.get("key") != self._key(path.stem):
            found = "a piece of other settings"
            raise InputError(
                path,
                self._option,
                found,
                "the same settings, or another folder; to make the report anew in this one, "
                f"delete {self._folder} and what was made beside it",
            )
        return known


def read_piece(
    path: Path, option: str, what: str = "a piece of this report"
) -> dict[str, Any] | None:
    """A piece as it stands on the disk; None where there is none.

    Raises
    ------
    InputError : it cannot be read, or is no piece; in the name of ``option``.
    """
    try:
        known = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise InputError(path, option, str(error), what) from None
    if not isinstance(known, dict):
        raise InputError(path, option, type(known).__name__, what)
    return known
