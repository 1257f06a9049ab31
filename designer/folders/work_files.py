"""The finished blocks of a sweep, a map or a basin in a folder, as Parquet.

Every file says which work it belongs to and carries the provenance; it appears whole or not at
all, and one that was damaged since is not taken (``base.keyed_store``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from designer.base.keyed_store import KeyedStore, Note, Vouch, nobody
from designer.base.parquet_entry import ParquetCodec, Rows
from designer.base.progress import quiet

FORMAT = 1
Made = TypeVar("Made")


@dataclass(frozen=True)
class WorkFiles:
    """Where the blocks of one work lie, and what each of them says."""

    root: Path
    """Folder that they lie in."""
    work: str
    """Hash of what decides the work."""
    provenance: Mapping[str, Any]
    """Versions, seed and settings, which go into every file."""
    note: Note = quiet
    """Is told of entries that are not taken."""
    vouch: Vouch = nobody
    """Asked about entries without a seal."""
    noted: set[str] = field(default_factory=set)
    """Names of blocks that ``note`` was told of."""

    def read(
        self, name: str, codec: ParquetCodec, make: Callable[[Rows], Made], **place: str | int
    ) -> Made | None:
        """What ``make`` makes of the rows of a finished block of this very work (as of
        ``KeyedStore.read_as``), or None. place : of the block in the work."""
        return self._store(codec).read_as(name, self._key(place), make)

    def write(self, name: str, codec: ParquetCodec, rows: Rows, **place: str | int) -> None:
        """Keep a finished block.

        Raises
        ------
        InputError : it cannot be written.
        """
        more = {"provenance": self.provenance}
        self._store(codec).write(name, self._key(place), rows, more)

    def _store(self, codec: ParquetCodec) -> KeyedStore[Rows]:
        return KeyedStore(self.root, codec, self.note, self.vouch, noted=self.noted)

    def _key(self, place: Mapping[str, str | int]) -> dict[str, Any]:
        return {"format": FORMAT, "work": self.work, **place}
