"""The pieces of a long report, each on disk as soon as it is done.

A piece is a JSON file in the folder ``cases`` of the report, with a key that says what it was made
of, and a seal (``base.keyed_store``): one that was damaged since is made again. The report's
own files are made of the pieces; a file of somebody else's is not written over.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from designer.base.atomic_write import PART
from designer.base.errors import InputError
from designer.base.guarded_reading import parse_json, read_bytes
from designer.base.keyed_store import SEAL, KeyedStore, Note
from designer.base.progress import quiet
from designer.base.seal import BLANK, intact

FOLDER = "cases"


class CaseStore:
    """The pieces of one report.

    Parameters
    ----------
    out : the report's folder, which is made. files : names of the report's own files. resume : go
    on with the pieces that are there. place : what messages call ``out``, where the command has no
    ``--out`` and no ``--resume``, since it always goes on. note : told of damaged pieces.

    Raises
    ------
    InputError : pieces are there already and ``resume`` is not given; a file stands where one of
        the report's goes, and nothing that it could be made of; the folder cannot be made.
    """

    def __init__(
        self,
        out: Path,
        files: Iterable[str],
        *,
        resume: bool,
        place: str | None = None,
        note: Note = quiet,
    ) -> None:
        self._out, self._folder, self._files = out, out / FOLDER, tuple(files)
        self._place, self._option = place or "--out", place or "--resume"
        self._keys: str | Mapping[str, str] = {}
        self._store: KeyedStore[dict[str, Any]] = KeyedStore(self._folder, _Json(), note)
        has_pieces = self._folder.is_dir() and any(self._folder.iterdir())
        if has_pieces and not resume:
            raise InputError(self._folder, self._place, "results", "an empty folder, or --resume")
        if not has_pieces:
            self._check_free()
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(
                self._folder, self._place, reason, "a place that can be written"
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
        """A piece from its file, or made now and written.

        Raises
        ------
        InputError : the file was made with other settings, or is no piece.
        """
        path = self._folder / f"{name}.json"
        content = self._read(path)
        if content is None:
            content = dict(make())
            self._store.write(path.name, {"key": self._key(name)}, content)
        return content

    def _key(self, name: str) -> str:
        return self._keys if isinstance(self._keys, str) else self._keys[name]

    def _check_free(self) -> None:
        for name in self._files:
            if (self._out / name).exists():
                text = "a file that the report would replace, and no piece of it to go on with"
                raise InputError(self._out / name, self._place, text, "a folder without it")

    def _read(self, path: Path) -> dict[str, Any] | None:
        key = self._key(path.stem)
        if read_key(path, self._option) not in (None, key):
            text = "a piece of other settings"
            raise InputError(
                path,
                self._option,
                text,
                "the same settings, or another folder; to make the report anew in this one, "
                f"delete {self._folder} and what was made beside it",
            )
        return self._store.read(path.name, {"key": key})


class _Json:
    """A JSON object with its key first and its seal last (``keyed_store.EntryCodec``)."""

    def encode(self, head: Mapping[str, Any], value: Mapping[str, Any]) -> bytes:
        document = {**head, **value, SEAL: BLANK}
        text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
        return f"{text}\n".encode()

    def decode(self, content: bytes) -> tuple[dict[str, Any], dict[str, Any]]:
        document = parse_json(content, None)
        head = {"key": document.pop("key")}
        document.pop(SEAL, None)
        return head, document


_BEGINS = b'{\n "key": '
"""How a piece begins; cut off or not."""


def read_key(path: Path, option: str, expected: str = "a piece of this report") -> str | None:
    """The key of a piece; None where there is no file, or one that was damaged or cut off.

    Raises
    ------
    InputError : it cannot be read, or is no piece; its field is ``option``.
    """
    if not path.exists():
        return None
    content = read_bytes(path, expected, option)
    if intact(content) is False:
        return None
    try:
        document = parse_json(content, path, expected, option)
    except InputError as error:
        if content.startswith(_BEGINS) or _BEGINS.startswith(content):
            return None
        raise InputError(path, option, error.found, expected) from None
    if not isinstance(document, dict) or not isinstance(document.get("key"), str):
        text = "no key" if isinstance(document, dict) else type(document).__name__
        raise InputError(path, option, text, expected)
    return str(document["key"])


def check_report_folder(out: Path, names: Collection[str], data: str, command: str) -> None:
    """Refuse a folder that is neither empty nor holds an earlier report and nothing else.

    names : of the report's files. data : of these, the JSON file whose "command" is ``command``.

    Raises
    ------
    InputError : the folder holds other files.
    OSError : the folder cannot be read.
    """
    there = sorted(path.name for path in out.iterdir())
    foreign = [name for name in there if name.removeprefix(".").removesuffix(PART) not in names]
    if not there or not (foreign or _command(out / data) != command):
        return
    raise InputError(
        out / (foreign or there)[0],
        "--out",
        "a file that is not of an earlier report",
        "an empty folder, or one that this command made",
    )


def _command(path: Path) -> object:
    """The command that the data of a report state; None where there are none."""
    try:
        data = parse_json(read_bytes(path, "JSON"), path)
    except InputError:
        return None
    return data.get("command") if isinstance(data, dict) else None
